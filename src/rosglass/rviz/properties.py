"""RViz's property tree: access to any property by its path, and editors of registered ones."""
# ruff: noqa: N802 - C++ calls these methods by their RViz names

from __future__ import annotations

import logging
import math
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.overlay.registered_properties import RegisteredProperty
from rosglass.overlay.trackers import FIXED_FRAME
from rosglass.qt import QtGui, is_alive
from rosglass.rviz.host import class_of, is_a, pyqt, rviz

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.overlay.registered_properties import RegisteredProperties
    from rosglass.overlay.trackers import Frames
    from rosglass.qml.engine.session import Session

__all__ = [
    "Choices",
    "PropertyTree",
    "child_properties",
    "describe_properties",
    "find_property",
    "log_errors",
    "make_editor",
    "owned_by_rviz",
    "read_property",
    "remove_from_tree",
    "write_property",
]


_MAX_TEXT_LENGTH = 10_000
_INT32 = (-(2**31), 2**31 - 1)
#: Properties whose value is a text of numbers with semicolons between them -> their names.
_VECTOR_PARTS = {"rviz::VectorProperty": "xyz", "rviz::QuaternionProperty": "xyzw"}
_COLOR_CLASS = "rviz::ColorProperty"
#: Read-only properties that show a display's status.
_STATUS_CLASSES = ("rviz::StatusList", "rviz::StatusProperty")


def child_properties(item: Any) -> Iterator[Any]:
    """Iterate over a property's children, except for displays and their status."""
    for index in range(item.numChildren()):
        child = item.childAt(index)
        if class_of(child) not in _STATUS_CLASSES and not is_a(child, "rviz::Display"):
            yield child


def find_property(item: Any, path: str | Sequence[str], whose: str = "") -> Any:
    """Return a property by its path below another property.

    Args:
        item: The other property.
        path: Names with slashes between them, e.g. ``Offset/X``, or a list of names.
        whose: Name of `item`, for the error.

    Raises:
        Error: The property does not exist; the error lists existing ones.
    """
    names = path if isinstance(path, str) else "/".join(map(str, path))
    found = _find_below(item, names)
    if found is None:
        head = names.partition("/")[0]
        known = [str(child.getName()) for child in child_properties(item)]
        upper = next((c for c in child_properties(item) if str(c.getName()) == head), None)
        if upper is not None and "/" in names:
            known = [f"{head}/{child.getName()}" for child in child_properties(upper)]
        hint = similar(names, known) or f"; there are: {', '.join(known) or 'none'}"
        raise Error(f"{whose or item.getName()} has no property {names!r:.120}{hint}")
    return found


def _find_below(item: Any, path: str) -> Any:
    # Names may contain slashes, e.g. those of topics and links.
    for child in child_properties(item):
        name = str(child.getName())
        if path == name:
            return child
        if path.startswith(f"{name}/"):
            found = _find_below(child, path[len(name) + 1 :])
            if found is not None:
                return found
    return None


def read_property(item: Any) -> Any:
    """Return the value of a property.

    Returns:
        A bool, int, float or str; ``#rrggbb`` for colours, dicts of x, y, z (and w) for vectors and
        quaternions, in RViz's order; None for a property that has only children.
    """
    value, kind = item.getValue(), class_of(item)
    if kind == _COLOR_CLASS:
        parts = _split(value)
        return "#{:02x}{:02x}{:02x}".format(*map(int, parts)) if len(parts) == 3 else str(value)
    if kind in _VECTOR_PARTS:
        return dict(zip(_VECTOR_PARTS[kind], _split(value), strict=False))
    if isinstance(value, bool) or value is None:
        return value
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        # RViz uses 32-bit floats: return the shortest decimal number that is equal to it.
        return float(str(np.float32(value)))
    return str(value)


def write_property(item: Any, value: Any, name: str = "") -> None:
    """Change a property, like the user in the panel.

    Args:
        item: The property.
        value: A value as from :func:`read_property`; a colour may also be a ``QColor`` or a name, a
            vector a list.
        name: Its name in errors.

    Raises:
        Error: The property is read-only, the value is invalid, or RViz does not accept it.
    """
    name = name or str(item.getName())
    kind = class_of(item)
    if item.getReadOnly() or kind in _STATUS_CLASSES:
        raise Error(f"{name} cannot be changed; it is {read_property(item)!r}")
    wanted, given = _convert(item, kind, value, name)
    if item.getValue() == given:
        return
    item.setValue(given)
    now = read_property(item)
    if not _same(now, wanted):
        raise Error(f"{name}: RViz did not accept {shown(value)}, and has set {shown(now)}")


def describe_properties(item: Any, path: str = "") -> list[dict[str, Any]]:
    """Return the properties below another one as nested dicts; `path` is that of `item`.

    Returns:
        A dict for each, with `name`, `path` (for :func:`find_property`), `value`, `kind`,
        `description`, `readOnly`, `hidden`, and in `properties` its children.
    """
    found = []
    for child in child_properties(item):
        name = str(child.getName())
        here = f"{path}/{name}" if path else name
        found.append(
            {
                "name": name,
                "path": here,
                "value": read_property(child),
                "kind": _kind(child),
                "description": " ".join(str(child.getDescription()).split()),
                "readOnly": bool(child.getReadOnly()),
                "hidden": bool(child.getHidden()),
                "properties": describe_properties(child, here),
            }
        )
    return found


def _kind(item: Any) -> str:
    """Return a property's kind: ``bool``, ``int``, ``float``, ``color``, ..."""
    kind = class_of(item).removeprefix("rviz::").removesuffix("Property").lower()
    if kind:
        return {"rostopic": "topic", "tfframe": "frame"}.get(kind, kind)
    value = item.getValue()
    names = {bool: "bool", int: "int", float: "float", str: "string"}
    return names.get(type(value), "container")


def _convert(item: Any, kind: str, value: Any, name: str) -> tuple[Any, Any]:
    """Return a value as returned by :func:`read_property`, and as set in RViz."""
    if kind == _COLOR_CLASS:
        return _color(value, name)
    if kind in _VECTOR_PARTS:
        return _vector(value, _VECTOR_PARTS[kind], name)
    now = item.getValue()
    if now is None:
        raise Error(f"{name} has no value of its own, only properties below it")
    if isinstance(now, bool):
        if not isinstance(value, bool):
            raise Error(f"{name}: expected true or false, got {shown(value)}")
        return value, value
    if isinstance(now, (int, float)):
        number = _number(value, name)
        if isinstance(now, int):
            if number != int(number) or not _INT32[0] <= number <= _INT32[1]:
                raise Error(f"{name}: expected a 32-bit integer, got {shown(value)}")
            return int(number), int(number)
        return number, number
    choices = _choices(item) if kind == "rviz::EnumProperty" else []
    if choices and value not in choices:
        raise Error(f"{name}: expected one of {', '.join(choices)}, got {shown(value)}")
    if not isinstance(value, str) or len(value) > _MAX_TEXT_LENGTH or not value.isprintable():
        raise Error(f"{name}: expected a text of one line, got {shown(value)}")
    return value, value


def _choices(item: Any) -> list[str]:
    """Return the choices of an enum property, which only its editor knows."""
    widgets = pyqt("QtWidgets")
    host = widgets.QWidget()
    editor = item.createEditor(host, widgets.QStyleOptionViewItem())
    found = isinstance(editor, widgets.QComboBox)
    names = [str(editor.itemText(at)) for at in range(editor.count())] if found else []
    host.deleteLater()
    return names


def _number(value: Any, name: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        # Ogre aborts the process on a position that is not finite.
        with np.errstate(over="ignore"):
            if math.isfinite(value) and np.isfinite(np.float32(value)):
                return float(value)
    raise Error(f"{name}: expected a finite number, got {shown(value)}")


def _color(value: Any, name: str) -> tuple[str, str]:
    parts = _split(value) if isinstance(value, str) and value.count(";") == 2 else []
    if len(parts) == 3 and all(0 <= part <= 255 and part == int(part) for part in parts):
        value = QtGui.QColor(*map(int, parts))
    color = QtGui.QColor(value) if isinstance(value, (str, QtGui.QColor)) else QtGui.QColor()
    if not color.isValid():
        raise Error(f"{name}: expected a colour, e.g. '#ff8800' or 'orange', got {shown(value)}")
    if color.alpha() != 255:
        raise Error(f"{name}: RViz's colours have no transparency; set the property Alpha")
    plain = (color.red(), color.green(), color.blue())
    return "#{:02x}{:02x}{:02x}".format(*plain), "; ".join(map(str, plain))


def _vector(value: Any, names: str, name: str) -> tuple[dict[str, float], str]:
    if isinstance(value, (list, tuple)) and len(value) == len(names):
        value = dict(zip(names, value, strict=True))
    if not isinstance(value, dict) or set(value) != set(names):
        example = shown({part: int(part == "w") for part in names})
        raise Error(f"{name}: expected {', '.join(names)}, e.g. {example}, got {shown(value)}")
    parts = {part: _number(value[part], f"{name}/{part.upper()}") for part in names}
    return parts, "; ".join(f"{number:.9g}" for number in parts.values())


def _split(value: Any) -> list[float]:
    try:
        return [float(part) for part in str(value).split(";")]
    except ValueError:
        return []


def _same(now: Any, wanted: Any) -> bool:
    if isinstance(wanted, dict):
        return isinstance(now, dict) and all(_same(now.get(key), wanted[key]) for key in wanted)
    if isinstance(wanted, float) and isinstance(now, (int, float)):
        return math.isclose(now, wanted, rel_tol=1e-5, abs_tol=1e-6)
    return bool(now == wanted)


_log = logging.getLogger("rosglass.rviz")


class Choices:
    """Suggestions of the property editors, and their error reports.

    Args:
        session: The session whose node lists the topics.
        frames: The robot's frames.
        notify: Shows a text to the user, e.g. in RViz's status bar.
    """

    def __init__(self, session: Session, frames: Frames, notify: Callable[[str], Any]) -> None:
        self._session, self._frames, self._notify = session, frames, notify

    def topics(self, type_name: str) -> list[str]:
        """Return the topics of a type; an empty type returns all topics."""
        node = self._session.node
        if node is None:
            return []
        wanted = type_name.replace("/msg/", "/")
        try:
            known = node.topics()
        except Error as error:
            _log.warning("topics cannot be listed: %s", error)
            return []
        names = {
            name: {kind.replace("/msg/", "/") for kind in kinds} for name, kinds in known.items()
        }
        return sorted(name for name, kinds in names.items() if not wanted or wanted in kinds)

    def frames(self, *, fixed: bool) -> list[str]:
        """Return the known frames; with `fixed`, the first one is the fixed frame."""
        buffer = self._frames.buffer
        known = sorted(buffer.tree()) if buffer is not None else []
        return [FIXED_FRAME, *known] if fixed else known

    def set_property(self, model: RegisteredProperty, value: Any) -> None:
        """Set a property to the user's choice; report an invalid value."""
        try:
            if not model.readOnly:
                model.set(value)
        except Error as error:
            self.report(f"{'/'.join(model.path)}: {error}")

    def report(self, text: str) -> None:
        """Log a user error, and show it to the user."""
        _log.warning("property %s", text)
        self._notify(text)


def make_editor(model: RegisteredProperty, parent: Any, choices: Choices) -> Any:
    """Return a property's editor widget, below a parent widget; None to use RViz's own."""
    kind, options = model.kind.NAME, model.kind.options
    if kind == "int":
        return _spin_box(model, parent)
    if kind == "enum":
        return _combo_box(parent, list(options["choices"]), choices, model, editable=False)
    if kind == "topic":
        offered = choices.topics(options.get("messageType", ""))
        return _combo_box(parent, offered, choices, model, editable=True)
    if kind == "frame":
        offered = choices.frames(fixed=options.get("includeFixedFrame", False))
        return _combo_box(parent, offered, choices, model, editable=True)
    if kind in {"color", "path"}:
        return _line_with_button()(model, parent, choices)
    return None


def _spin_box(model: RegisteredProperty, parent: Any) -> Any:
    box = pyqt("QtWidgets").QSpinBox(parent)
    kind: Any = model.kind
    box.setRange(kind.min, kind.max)
    box.setSingleStep(kind.step)
    box.setFrame(False)
    return box


def _combo_box(
    parent: Any, offered: list[str], choices: Choices, model: RegisteredProperty, *, editable: bool
) -> Any:
    box = pyqt("QtWidgets").QComboBox(parent)
    box.setFrame(False)
    box.setEditable(editable)
    box.addItems(offered)
    if editable:
        box.setInsertPolicy(pyqt("QtWidgets").QComboBox.NoInsert)
        box.setEditText(str(model.get()))

    def choose(text: str) -> None:
        choices.set_property(model, text)

    box.textActivated.connect(choose)
    return box


@cache
def _line_with_button() -> Any:
    core, widgets = pyqt(), pyqt("QtWidgets")

    class LineWithButton(widgets.QLineEdit):  # type: ignore[name-defined,misc]
        """A text field with a button that opens a colour or file dialog."""

        def __init__(self, model: RegisteredProperty, parent: Any, choices: Choices) -> None:
            super().__init__(parent)
            self.setFrame(False)
            action = self.addAction(
                self.style().standardIcon(widgets.QStyle.SP_DirOpenIcon)
                if model.kind.NAME == "path"
                else _color_icon(model),
                widgets.QLineEdit.TrailingPosition,
            )
            window = self.window()
            # Later, because the dialog takes the focus, which closes this editor.
            action.triggered.connect(
                lambda: core.QTimer.singleShot(0, lambda: _choose(model, window, choices))
            )

    return LineWithButton


def _color_icon(model: RegisteredProperty) -> Any:
    gui = pyqt("QtGui")
    picture = gui.QPixmap(16, 16)
    picture.fill(gui.QColor(model.kind.saved(model.get())))
    return gui.QIcon(picture)


def _choose(model: RegisteredProperty, window: Any, choices: Choices) -> None:
    widgets = pyqt("QtWidgets")
    if model.kind.NAME == "color":
        gui = pyqt("QtGui")
        dialog = widgets.QColorDialog(gui.QColor(model.kind.saved(model.get())), window)
        dialog.setOption(widgets.QColorDialog.ShowAlphaChannel)
        dialog.colorSelected.connect(
            lambda color: choices.set_property(model, color.name(gui.QColor.HexArgb))
        )
    else:
        dialog = widgets.QFileDialog(window, model.path[-1], str(model.get()))
        dialog.setFileMode(widgets.QFileDialog.ExistingFile)
        dialog.setNameFilter(model.kind.options.get("filter", "All files (*)"))
        dialog.fileSelected.connect(lambda file: choices.set_property(model, file))
    dialog.setAttribute(pyqt().Qt.WA_DeleteOnClose)
    dialog.open()


def log_errors(otherwise: Any = None) -> Callable[[Any], Any]:
    """Return a decorator for callbacks of C++: it logs exceptions and returns a default."""

    def decorate(function: Any) -> Any:
        # Copy the names only: PySide2 evaluates the other attributes to build help texts.
        @wraps(function, assigned=("__name__", "__qualname__"))
        def call(*arguments: Any) -> Any:
            try:
                return function(*arguments)
            except Exception:  # C++ calls it: an error would end RViz
                _log.exception("%s failed, RViz continues", function.__qualname__)
                return otherwise

        return call

    return decorate


def owned_by_rviz(item: Any) -> Any:
    """Transfer ownership of a property to RViz, which deletes it with its parent."""
    pyqt("sip").transferto(item, None)
    return item


@cache
def _classes() -> tuple[Any, Any]:
    """Return our subclasses of RViz's ``Property`` and ``BoolProperty``."""
    bindings, core = rviz(), pyqt()

    class _NotSaved:
        """Mixin of both; `view` is set right after creation."""

        view: PropertyView | None = None

        def load(self, config: Any) -> None:
            """Do nothing: the display loads the value."""

        def save(self, config: Any) -> None:
            """Do nothing: the display saves the value."""

    def flags(item: Any, base: Any, column: int) -> Any:
        found = base.getViewFlags(item, column)
        if item.view is not None and item.view.model.readOnly:
            found &= ~(core.Qt.ItemIsEditable | core.Qt.ItemIsUserCheckable)
        return found

    class Item(_NotSaved, bindings.Property):  # type: ignore[name-defined,misc]
        @log_errors()
        def getViewData(self, column: int, role: int) -> Any:
            view = self.view
            if view is not None and column == 1 and role == core.Qt.DecorationRole:
                swatch = view.swatch()
                if swatch is not None:
                    return swatch
            return bindings.Property.getViewData(self, column, role)

        @log_errors(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            return flags(self, bindings.Property, column)

        @log_errors()
        def createEditor(self, parent: Any, option: Any) -> Any:
            view = self.view
            made = make_editor(view.model, parent, view.choices) if view is not None else None
            return bindings.Property.createEditor(self, parent, option) if made is None else made

    class Check(_NotSaved, bindings.BoolProperty):  # type: ignore[name-defined,misc]
        @log_errors(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            return flags(self, bindings.BoolProperty, column)

    return Item, Check


class PropertyView:
    """A registered property in RViz's tree, with child items for the parts of a vector."""

    def __init__(self, model: RegisteredProperty, above: Any, choices: Choices) -> None:
        self.model, self.choices = model, choices
        item, check = _classes()
        kind = item if model.kind.NAME != "bool" else check
        about = model.description
        name = model.path[-1]
        #: RViz's property.
        self.item: Any = owned_by_rviz(kind(name, _for_rviz(model), about, above))
        self.item.view = self
        self._parts: dict[str, Any] = {}
        self._busy = False
        self._show_attributes()
        if hasattr(model.kind, "parts"):
            for part, number in model.kind.parts(model.get()).items():
                self._parts[part] = owned_by_rviz(item(part, number, "", self.item))
        self.item.changed.connect(log_errors()(lambda: self._edited(self.item, None)))
        for part, below in self._parts.items():
            below.changed.connect(
                log_errors()(lambda part=part, below=below: self._edited(below, part))
            )
        self._connections = [
            (model.valueChanged, lambda _value: self._show()),
            (model.aboutChanged, self._show_attributes),
        ]
        self._connections = [(signal, log_errors()(slot)) for signal, slot in self._connections]
        for signal, slot in self._connections:
            signal.connect(slot)

    def swatch(self) -> Any:
        """Return the colour to show beside the value; None for other kinds."""
        if self.model.kind.NAME != "color":
            return None
        return pyqt("QtGui").QColor(self.model.kind.saved(self.model.get()))

    def close(self) -> None:
        """Disconnect from the registered property."""
        watches, self._connections = self._connections, []
        for signal, slot in watches if is_alive(self.model) else ():
            signal.disconnect(slot)

    def _edited(self, item: Any, part: str | None) -> None:
        if self._busy:
            return
        model = self.model
        value = _plain(item.getValue())
        try:
            if part is not None:
                value = model.kind.with_part(model.get(), part, value)  # type: ignore[attr-defined]
            elif self._parts:
                value = _from_text(str(value), list(self._parts))
            if not model.readOnly:
                model.set(value)
        except Error as error:
            self.choices.report(f"{'/'.join(model.path)}: {error}")
        self._show()

    def _show(self) -> None:
        if self._busy or _is_deleted(self.item):
            return
        self._busy = True
        try:
            self.item.setValue(_for_rviz(self.model))
            if self._parts:
                for part, number in self.model.kind.parts(self.model.get()).items():  # type: ignore[attr-defined]
                    self._parts[part].setValue(number)
        finally:
            self._busy = False

    def _show_attributes(self) -> None:
        if _is_deleted(self.item):
            return
        model = self.model
        self.item.setDescription(model.description)
        for item in (self.item, *self._parts.values()):
            item.setReadOnly(model.readOnly)


def _for_rviz(model: RegisteredProperty) -> Any:
    """Return a property's value as RViz's tree shows it."""
    saved = model.kind.saved(model.get())
    return "; ".join(f"{part:g}" for part in saved.values()) if isinstance(saved, dict) else saved


def _from_text(text: str, parts: list[str]) -> dict[str, str]:
    given = text.replace(",", ";").split(";")
    if len(given) != len(parts):
        raise Error(f"expected {len(parts)} numbers, e.g. {'; '.join('0' for _ in parts)}")
    return dict(zip(parts, given, strict=True))


def _plain(value: Any) -> Any:
    """Return the Python value of an edited item."""
    return value.value() if isinstance(value, pyqt().QVariant) else value


class PropertyTree:
    """Shows all registered properties of an owner below one of RViz's properties."""

    def __init__(self, owner: RegisteredProperties, above: Any, choices: Choices) -> None:
        self._owner, self._above, self._choices = owner, above, choices
        self._views: dict[RegisteredProperty, PropertyView] = {}
        self._watched: dict[RegisteredProperty, Any] = {}
        self._added, self._removed = (
            log_errors()(self._on_registered),
            log_errors()(self._on_unregistered),
        )
        owner.registered.connect(self._added)
        owner.unregistered.connect(self._removed)
        for found in owner.all():
            self._add(found)

    def item(self, found: RegisteredProperty) -> Any:
        """Return the item of a property in RViz's tree."""
        return self._views[found].item

    def close(self) -> None:
        """Disconnect from the owner, and remove its properties from the tree."""
        if is_alive(self._owner):
            self._owner.registered.disconnect(self._added)
            self._owner.unregistered.disconnect(self._removed)
        for found in list(self._owner.properties.values()):
            self._remove(found)

    def _on_registered(self, found: object) -> None:
        # QML can emit the signal with any argument.
        if isinstance(found, RegisteredProperty) and found not in self._watched:
            self._add(found)

    def _on_unregistered(self, found: object) -> None:
        if isinstance(found, RegisteredProperty) and found in self._watched:
            self._remove(found)

    def _add(self, found: RegisteredProperty) -> None:
        watch = self._watched[found] = log_errors()(lambda: self._show(found))
        found.aboutChanged.connect(watch)
        self._show(found)

    def _remove(self, found: RegisteredProperty) -> None:
        for below in found.properties.values():
            self._remove(below)
        watch = self._watched.pop(found, None)
        if watch is not None and is_alive(found):
            found.aboutChanged.disconnect(watch)
        self._hide(found)

    def _show(self, found: RegisteredProperty) -> None:
        """Add a property to the tree, or remove a hidden one.

        RViz itself hides properties with a queued call, which crashes if the property was deleted.
        """
        if found.hidden:
            self._hide(found)
        elif found not in self._views:
            view = self._views.get(found.container) if found.container is not None else None
            above = view.item if view is not None else self._above
            if (found.container is None or view is not None) and not _is_deleted(above):
                self._views[found] = PropertyView(found, above, self._choices)
                for below in found.properties.values():
                    self._show(below)

    def _hide(self, found: RegisteredProperty) -> None:
        for below in found.properties.values():
            self._hide(below)
        view = self._views.pop(found, None)
        if view is not None:
            view.close()
            remove_from_tree(view.item)


def remove_from_tree(item: Any) -> None:
    """Remove a property from RViz's tree, and delete it from the event loop."""
    if not _is_deleted(item):
        above = item.getParent()
        if above is not None:
            above.takeChild(item)
        item.deleteLater()


def _is_deleted(item: Any) -> bool:
    return bool(pyqt("sip").isdeleted(item))
