"""The displays of a scene as overlays see them: a list, status, and properties by RViz's paths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qt import QtGui, Signal, Slot, is_alive
from rosglass.rviz.displays import Status, plain_name
from rosglass.rviz.plugins import PluginList
from rosglass.rviz.property_values import KINDS, shown
from rosglass.scene.rviz_formats import DISPLAYS, display_type

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rosglass.rviz.property_values import Kind
    from rosglass.scene.display import Display
    from rosglass.scene.scene import Scene
    from rosglass.scene.scene_view import SceneView

__all__ = ["SceneDisplay", "SceneDisplays"]

_OPTIONS = "Global Options"


class _Property(NamedTuple):
    """One property of a display, or of the view.

    Attributes:
        kind: What it holds.
        description: For the panel.
        read: Returns its value.
        write: Sets it.
    """

    kind: Kind
    description: str
    read: Callable[[], Any]
    write: Callable[[Any], object]


#: Properties by their path.
_Tree = dict[str, _Property]


def _plain_value(kind: Kind, value: Any) -> Any:
    """Return a value as interfaces get it: ``#rrggbb`` for colours, x, y and z for vectors."""
    if kind.NAME == "color":
        return str(value.name())
    if kind.NAME in ("vector", "quaternion"):
        return {name.lower(): number for name, number in kind.saved(value).items()}
    return value


def _properties_of(display: Display) -> _Tree:
    def of(setting: Any) -> _Property:
        return _Property(
            setting.kind,
            setting.description,
            lambda: getattr(display, setting.name),
            lambda value: display.setProperty(setting.name, value),
        )

    return {path: of(setting) for path, setting in display.SETTINGS.items()}


def _find(tree: _Tree, path: str, whose: str) -> tuple[_Property, str]:
    """Return a property, and the name of one of its numbers for the path of that number.

    Raises:
        Error: There is none; the text says which there are.
    """
    if path in tree:
        return tree[path], ""
    above, _, last = path.rpartition("/")
    if above in tree and not tree[above].kind.HOLDS_OTHERS:
        parts = list(tree[above].kind.saved(tree[above].read()))
        if last in parts:
            return tree[above], last
        raise Error(f"{whose} has no property {path!r:.120}; there are: {_joined(above, parts)}")
    if any(one.startswith(f"{path}/") for one in tree):
        return _CONTAINER, ""
    hint = similar(path, tree) or f"; there are: {', '.join(_children(tree, '')) or 'none'}"
    raise Error(f"{whose} has no property {path!r:.120}{hint}")


_CONTAINER = _Property(KINDS["container"](), "", lambda: None, lambda _: None)


def _joined(above: str, names: Iterable[str]) -> str:
    return ", ".join(f"{above}/{name}" for name in names)


def _children(tree: _Tree, above: str) -> list[str]:
    """Return the names of the properties below a path, in their order."""
    start = f"{above}/" if above else ""
    below = (path.removeprefix(start) for path in tree if path.startswith(start))
    return list(dict.fromkeys(path.partition("/")[0] for path in below))


def _read(tree: _Tree, path: str, whose: str) -> Any:
    found, part = _find(tree, path, whose)
    value = _plain_value(found.kind, found.read())
    return value[part.lower()] if part else value


def _write(tree: _Tree, path: str, value: Any, whose: str) -> None:
    found, part = _find(tree, path, whose)
    name = f"{whose}/{path}" if whose else path
    if found is _CONTAINER or found.kind.NAME == "container":
        raise Error(f"{name} has no value of its own, only properties below it")
    kind: Any = found.kind
    try:
        if part:
            given = kind.with_part(found.read(), part, value)
        else:
            given = kind.read(_colour(value) if kind.NAME == "color" else value)
    except Error as error:
        raise Error(f"{name}: {error}") from None
    if kind.NAME == "color" and given.alpha() != 255:
        raise Error(f"{name}: this colour has no transparency; set the property Alpha")
    found.write(given)


def _colour(value: Any) -> Any:
    """Return a colour that RViz writes as ``255; 0; 0`` as Qt's."""
    if isinstance(value, str) and value.count(";") == 2:
        try:
            return QtGui.QColor(*(int(part) for part in value.split(";")))
        except ValueError:
            return value
    return value


def _describe(tree: _Tree, above: str = "") -> list[dict[str, Any]]:
    """Return the properties below a path as nested dicts, as for RViz."""
    found = []
    for name in _children(tree, above):
        path = f"{above}/{name}" if above else name
        one = tree.get(path, _CONTAINER)
        value = _plain_value(one.kind, one.read())
        below = _describe(tree, path)
        if not one.kind.HOLDS_OTHERS:
            below = [_part(path, part, number) for part, number in value.items()]
        found.append(_described(name, path, value, one.kind.NAME, one.description, below))
    return found


def _part(path: str, name: str, number: float) -> dict[str, Any]:
    upper = name.upper()
    return _described(upper, f"{path}/{upper}", number, "float", "", [])


def _described(
    name: str, path: str, value: Any, kind: str, description: str, below: list[dict[str, Any]]
) -> dict[str, Any]:
    return {
        "name": name,
        "path": path,
        "value": value,
        "kind": kind,
        "description": description,
        "readOnly": False,
        "hidden": False,
        "properties": below,
    }


def _class_id(kind: str) -> str:
    """Return RViz 1's class id of a type, or RViz 2's of one that only RViz 2 has."""
    one, two = DISPLAYS.get(kind, ("", ""))
    return one or two or (kind if "/" in kind else f"rosglass/{kind}")


def _path(path: str | Sequence[str]) -> str:
    return path if isinstance(path, str) else "/".join(map(str, path))


class SceneDisplay:
    """One display, created by :class:`SceneDisplays`; name and class stay readable after removal.

    It has the members of :class:`rosglass.rviz.displays.Display`, which has their descriptions.
    """

    def __init__(self, owner: SceneDisplays, display: Display) -> None:
        self._owner = owner
        #: The display; None after removal.
        self.display: Display | None = display
        #: RViz 1's class id, e.g. ``rviz/Grid``.
        self.class_id = str(getattr(display, "class_id", "")) or _class_id(display.TYPE)
        self._state = self._read()

    def _read(self) -> tuple[str, bool, Status]:
        display = self.display
        if display is None or not is_alive(display):
            return self._state
        status = Status(display.statusLevel, display.statusText)
        return display.name, display.enabled, status

    def refresh(self) -> bool:
        """Read the state; return whether it has changed."""
        before, self._state = self._state, self._read()
        return before != self._state

    @property
    def exists(self) -> bool:
        """Whether it was not removed."""
        return self.display is not None

    @property
    def name(self) -> str:
        """Its name in the panel, which need not be unique."""
        return self._read()[0]

    @name.setter
    def name(self, name: str) -> None:
        self.require().name = plain_name(name)
        self._owner.emit_changes()

    @property
    def enabled(self) -> bool:
        """Whether it is shown."""
        return self.exists and self._read()[1]

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self.require().enabled = enabled
        self._owner.emit_changes()

    @property
    def status(self) -> Status:
        """Its status; an error after removal."""
        return self._read()[2] if self.exists else Status("error", f"{self.name} was removed")

    def properties(self) -> list[dict[str, Any]]:
        """Return all its properties as nested dicts.

        Raises:
            Error: The display was removed.
        """
        return _describe(_properties_of(self.require()))

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property, e.g. ``Offset/X``.

        Raises:
            Error: The property does not exist, or the display was removed.
        """
        return _read(_properties_of(self.require()), _path(path), self.name)

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property.

        Raises:
            Error: The property does not exist, does not accept the value, or the display was
                removed.
        """
        _write(_properties_of(self.require()), _path(path), value, self.name)
        self._owner.emit_changes()

    def remove(self) -> None:
        """Remove the display.

        Raises:
            Error: It was removed before.
        """
        self._owner.remove(self)

    def require(self) -> Display:
        """Return the display.

        Raises:
            Error: It was removed.
        """
        if self.display is None:
            raise Error(f"the display {self.name} was removed; ask for it again")
        return self.display


class SceneDisplays(PluginList):
    """The displays of a scene, including those in groups.

    It has the members of :class:`rosglass.rviz.displays.Displays`.
    """

    #: :attr:`status` has changed.
    status_changed = Signal()

    def __init__(self, view: SceneView) -> None:
        super().__init__()
        self._view = view
        self._items: list[SceneDisplay]
        self._status = self.status
        self._followed: set[int] = set()
        self._sync_items()
        self._known = list(self._items)
        view.fixedFrameChanged.connect(self._on_event)
        view.sceneChanged.connect(self._watch_scene)
        self._watch_scene()

    @property
    def _scene(self) -> Scene:
        return self._view.scene

    @Slot()
    def _watch_scene(self) -> None:
        self._scene.displayAdded.connect(self._on_event)
        self._scene.displayRemoved.connect(self._on_event)
        self._on_event()

    @property
    def classes(self) -> list[str]:
        """RViz's class ids of the displays that can be added."""
        return sorted(_class_id(kind) for kind in self._scene.TYPES)

    @property
    def status(self) -> Status:
        """The view's own status, e.g. an error for an unknown fixed frame."""
        problem = str(self._view.property("problem"))
        if problem:
            return Status("error", f"View: {problem}")
        buffer, fixed = self._scene.transforms, self._scene.fixed_frame
        if buffer is None:
            return Status("warn", "Fixed Frame: there is no connection to the robot yet")
        known = buffer.tree()
        if fixed in known:
            return Status("ok", "Fixed Frame: OK")
        if not known:
            return Status("warn", "Fixed Frame: nothing is received on /tf and /tf_static")
        hint = similar(fixed, known)
        return Status("error", f"Fixed Frame: there is no frame {fixed!r}{hint}")

    def find(self, name: str) -> SceneDisplay | None:
        """Return the first display with the given name; None if there is none."""
        return next((display for display in self._items if display.name == name), None)

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property of any display, or of the view.

        Args:
            path: E.g. ``Grid/Color`` or ``Global Options/Background Color``.

        Raises:
            Error: The property does not exist.
        """
        display, rest = self._split(_path(path))
        return _read(self._options(), rest, "the view") if display is None else display.get(rest)

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property of any display, or of the view; see :meth:`get`.

        Raises:
            Error: The property does not exist, or does not accept the value.
        """
        display, rest = self._split(_path(path))
        if display is None:
            _write(self._options(), rest, value, "")
            self.emit_changes()
        else:
            display.set(rest, value)

    def options(self) -> list[dict[str, Any]]:
        """Return the global options."""
        return _describe(self._options())

    def _options(self) -> _Tree:
        scene, view = self._scene, self._view
        return {
            f"{_OPTIONS}/Fixed Frame": _Property(
                KINDS["frame"](),
                "The frame in which everything is placed.",
                lambda: scene.fixed_frame,
                lambda frame: setattr(scene, "fixed_frame", frame),
            ),
            f"{_OPTIONS}/Background Color": _Property(
                KINDS["color"](),
                "What is behind everything.",
                lambda: view.property("background"),
                lambda colour: view.setProperty("background", colour),
            ),
        }

    def _split(self, path: str) -> tuple[SceneDisplay | None, str]:
        """Return the display of a path and the path below it; None for the global options."""
        for display in self._items:
            if path.startswith(f"{display.name}/"):
                return display, path[len(display.name) + 1 :]
        first, _, below = path.partition("/")
        names = [display.name for display in self._items]
        found = self.find(first)
        if found is not None and not below:
            own = next(iter(_children(_properties_of(found.require()), "")), "Alpha")
            example = f"{first}/{own}"
            raise Error(f"{first!r} is a display; name one of its properties, e.g. {example!r}")
        known = [_OPTIONS, *names]
        if first not in known:
            hint = similar(first, known) or f"; there are: {', '.join(known)}"
            raise Error(f"no display is called {shown(first)}{hint}")
        return None, path

    def add(self, class_id: str, name: str = "", *, enabled: bool = True) -> SceneDisplay:
        """Append a display.

        Args:
            class_id: RViz's class id, e.g. ``rviz/Grid`` or ``rviz_default_plugins/Grid``.
            name: Its name; by default the class name.
            enabled: Whether to show it.

        Raises:
            Error: There is no such class.
        """
        if not isinstance(class_id, str) or class_id.count("/") != 1:
            near = similar(class_id, self.classes) if isinstance(class_id, str) else ""
            raise Error(f"expected a class id, e.g. 'rviz/Grid', got {shown(class_id)}{near}")
        kind = display_type(class_id) or class_id
        if kind not in self._scene.TYPES:
            hint = similar(class_id, self.classes) or f"; there are: {', '.join(self.classes)}"
            raise Error(f"no display was added: there is no class {class_id:.80}{hint}")
        shown_name = plain_name(name) if name else class_id.rpartition("/")[2]
        display = self._scene.add(kind, shown_name)
        display.enabled = enabled
        self._sync_items()
        made = next(one for one in self._items if one.display is display)
        self.emit_changes()
        return made

    def remove(self, display: SceneDisplay) -> None:
        """Remove a display, and if it is a group, the displays in it.

        Raises:
            Error: It was removed before.
        """
        self._scene.remove(display.require())
        self.emit_changes()

    def emit_changes(self) -> None:
        """Emit the signals of all changes since the last call."""
        if is_alive(self._view):
            super().emit_changes()

    def close(self) -> None:
        """Nothing to release; for the same members as RViz's."""

    def _sync_rest(self) -> Callable[[], None]:
        before, self._status = self._status, self.status
        return self.status_changed.emit if self._status != before else lambda: None

    def _sync_items(self) -> None:
        known = {id(one.display): one for one in self._items if one.display is not None}
        found = []
        for display in self._scene.displays:
            if is_alive(display):
                at = id(display)
                found.append(known.pop(at) if at in known else SceneDisplay(self, display))
                if at not in self._followed:
                    self._follow(display)
        self._items = found
        for gone in known.values():
            gone.display = None

    def _follow(self, display: Display) -> None:
        at = id(display)
        self._followed.add(at)
        for signal in (display.nameChanged, display.enabledChanged, display.statusChanged):  # type: ignore[attr-defined]
            signal.connect(self._on_event)
        display.destroyed.connect(self._on_event)
        followed = self._followed
        display.destroyed.connect(lambda *_: followed.discard(at))

    @Slot()
    def _on_event(self) -> None:
        self._on_change()
