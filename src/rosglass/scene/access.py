"""The seam by which overlays know a scene: :class:`rosglass.overlay.access.Access` over a view.

QML that was written for overlays over RViz runs unchanged over a scene: the object ``rviz`` is the
same. docs/architecture.md, section 6, has the members. Class ids are those of RViz 1, as these
interfaces know them (``rviz/Grid``); those of RViz 2 are accepted as well.
"""

from __future__ import annotations

import logging
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from PySide6.QtQuick import QQuickWindow

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay import displays, tools
from rosglass.overlay.access import Access
from rosglass.overlay.camera import Camera, Picker
from rosglass.overlay.orbit import Orbit, Point
from rosglass.overlay.property_values import KINDS
from rosglass.overlay.trackers import Frames, Trackers
from rosglass.overlay.view import CurrentView, View, Views
from rosglass.qml.elements.image_sinks import grab, window_of
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.run.modules import locate
from rosglass.qt import QtCore, QtGui, Slot, is_alive
from rosglass.scene.configs.rviz_config import RvizConfig
from rosglass.scene.configs.rviz_formats import DISPLAYS as DISPLAY_IDS
from rosglass.scene.configs.rviz_formats import TOOLS as TOOL_IDS
from rosglass.scene.configs.rviz_formats import VIEWS as VIEW_IDS
from rosglass.scene.configs.rviz_formats import class_id_of, display_type, tool_type, view_type
from rosglass.scene.tools.tool_manager import Tools
from rosglass.scene.view_controllers.views import VIEWS, TopDownOrthoView

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.overlay.property_values import Kind
    from rosglass.qml.engine.session import Session
    from rosglass.scene.displays.display import Display
    from rosglass.scene.displays.scene import Scene
    from rosglass.scene.tools.tool import Tool
    from rosglass.scene.view.scene_view import SceneView

__all__ = ["SceneAccess", "access_of"]

_log = logging.getLogger("rosglass.scene")
#: Directions in which a pick looks around, and the shares of its radius.
_AROUND = [(1, 0), (-1, 0), (0, 1), (0, -1), (0.7, 0.7), (-0.7, 0.7), (0.7, -0.7), (-0.7, -0.7)]
_RINGS = (0.34, 0.67, 1.0)
_OPTIONS = "Global Options"
#: Size of a tool's icon in pixels.
_ICON_PX = 48


def access_of(view: SceneView) -> SceneAccess:
    """Return the interface of overlays to a view, created on first use."""
    found: Any = view.findChild(SceneAccess)
    return found or SceneAccess(view)


class SceneAccess(Access):
    """The interface of overlays to a scene.

    `before_frame` also reports that something that the view follows has moved.

    Args:
        view: The view.
    """

    def __init__(self, view: SceneView) -> None:
        self.scene_view = view
        super().__init__(view)
        self._full = False
        self._window: QQuickWindow | None = None
        #: Whether the window is about to draw.
        self.is_drawing = False
        view.windowChanged.connect(self._on_window)
        view.sceneChanged.connect(self._watch_scene)
        self._watch_scene()
        view.fixedFrameChanged.connect(self.fixed_frame_changed)
        view.bareChanged.connect(self.bare_changed)
        view.configLoading.connect(self._on_config_loading)
        view.configLoaded.connect(self.config_loaded)
        self._on_window(window_of(view))
        parts = self.__dict__
        view.destroyed.connect(lambda *_: _close_parts(parts))
        application = QtCore.QCoreApplication.instance()
        if application is not None:
            application.aboutToQuit.connect(self._on_quit)

    @property
    def session(self) -> Session:
        """The session of the view's engine.

        Raises:
            Error: The view belongs to no engine of rosglass.
        """
        runtime = self.scene_view.scene._find_runtime() or runtime_of(self.scene_view)
        if runtime is None:
            raise Error("this SceneView has no session: create it with rosglass, or from QML")
        return runtime.session

    # The parts.

    @cached_property
    def tools(self) -> SceneTools:
        """The tools."""
        return SceneTools(self.scene_view)

    @cached_property
    def displays(self) -> SceneDisplays:
        """The displays."""
        return SceneDisplays(self.scene_view)

    @cached_property
    def frames(self) -> Frames:
        """The robot's coordinate frames, received once for the view and its overlays."""
        return Frames(self.session, lambda: self.fixed_frame, "")

    @cached_property
    def view(self) -> View:
        """The camera."""
        return View(CurrentSceneView(self.scene_view), self.frames, self.before_frame)

    @cached_property
    def views(self) -> SceneViews:
        """The view types and the saved views."""
        return SceneViews(self.scene_view)

    @cached_property
    def picker(self) -> ScenePicker:
        """Picking of 3D points, and screenshots."""
        return ScenePicker(self)

    @cached_property
    def trackers(self) -> Trackers:
        """Trackers of points in the 3D view."""
        view = self.scene_view
        return Trackers(self.before_frame, lambda: SceneCamera(view), lambda: self.frames)

    # Members of its own.

    @property
    def fixed_frame(self) -> str:
        """The fixed frame."""
        return self.scene_view.scene.fixed_frame

    @fixed_frame.setter
    def fixed_frame(self, frame: str) -> None:
        self.scene_view.scene.fixed_frame = frame

    @property
    def fullscreen(self) -> bool:
        """True while the window fills the screen."""
        window = window_of(self.scene_view)
        full = QtGui.QWindow.Visibility.FullScreen
        return window is not None and window.visibility() == full

    @fullscreen.setter
    def fullscreen(self, fullscreen: bool) -> None:
        window = window_of(self.scene_view)
        if window is None:
            raise Error("the 3D view is in no window yet")
        # Later: with the render loop of a threaded program, Python may not wait here.
        show = window.showFullScreen if fullscreen else window.showNormal
        if fullscreen != self.fullscreen:
            QtCore.QTimer.singleShot(0, show)

    @property
    def bare(self) -> bool:
        """True if only the 3D view is to be shown; the program that shows panels follows it."""
        return bool(self.scene_view.bare)

    @bare.setter
    def bare(self, bare: bool) -> None:
        self.scene_view.setProperty("bare", bare)

    def load_config(self, file: str) -> None:
        """Load a ``.rviz`` file from the event loop, after the current event.

        Raises:
            Error: The file is missing, or is not an RViz config.
        """
        path = locate(file)
        if not path.is_file():
            wrong = "is a folder" if path.is_dir() else "does not exist"
            raise Error(f"{path} {wrong}; expected an RViz config file (.rviz)")
        config = RvizConfig.load(path)

        def load() -> None:
            for note in self.scene_view.show_config(config):
                _log.warning("%s: %s", path, note)

        QtCore.QTimer.singleShot(0, self, load)

    def save_config(self, file: str = "") -> None:
        """Save the view as a ``.rviz`` file, by default to the file it was loaded from.

        Raises:
            Error: The file cannot be written, or no config is loaded and no file is given.
        """
        config = self.scene_view.config
        if not (file or (config is not None and config.source)):
            raise Error("no config file is loaded; give the file to save to")
        try:
            self.scene_view.save_config(file)
        except Error as error:
            raise Error(f"could not save: {error}") from None

    def close(self) -> None:
        """Stop observing the view and the robot; safe to call twice."""
        super().close()
        _close_parts(self.__dict__)

    # The view's events.

    @Slot()
    def _watch_scene(self) -> None:
        self.scene_view.scene.placed.connect(self._on_placed)

    @Slot(QQuickWindow)
    def _on_window(self, window: QQuickWindow | None) -> None:
        if window is None or window is self._window:
            # A window that is being destroyed cannot be disconnected from.
            return
        before, self._window = self._window, window
        if before is not None and is_alive(before):
            before.afterAnimating.disconnect(self._on_frame)
            before.visibilityChanged.disconnect(self._on_visibility)
        window.afterAnimating.connect(self._on_frame)
        window.visibilityChanged.connect(self._on_visibility)

    @Slot()
    def _on_frame(self) -> None:
        self.is_drawing = True
        try:
            self.before_frame.emit()
        finally:
            self.is_drawing = False

    @Slot()
    def _on_placed(self) -> None:
        # What follows frames has a reason to have a frame drawn.
        self.before_frame.emit()

    @Slot()
    def _on_visibility(self) -> None:
        if self.fullscreen != self._full:
            self._full = self.fullscreen
            self.fullscreen_changed.emit()

    @Slot()
    def _on_quit(self) -> None:
        self.close()

    @Slot()
    def _on_config_loading(self) -> None:
        if "view" in self.__dict__:
            self.view.end_motion()

    def _frames_drawn(self) -> int:
        return self.scene_view.pictures_drawn()

    @Slot()
    def _measure(self) -> None:
        super()._measure()
        if "displays" in self.__dict__:
            self.displays.emit_changes()


def _close_parts(parts: dict[str, Any]) -> None:
    for name in ("displays", "frames", "view"):
        if name in parts:
            parts[name].close()


class SceneCamera(Camera):
    """The camera of a view at the last call of :meth:`update`."""

    def __init__(self, view: SceneView) -> None:
        self._view, self._camera = view, view.camera()

    def update(self) -> bool:
        """Read the camera; return whether it has moved."""
        before, self._camera = self._camera, self._view.camera()
        return self._camera != before

    def project(self, point: Any) -> Any:
        """Return where a point is seen; see :meth:`rosglass.scene.render.camera.Camera.project`."""
        return self._camera.project(point)


class CurrentSceneView(CurrentView):
    """The current view of a scene."""

    def __init__(self, view: SceneView) -> None:
        super().__init__()
        self._view = view
        view.viewChanged.connect(self._on_view_changed)

    @property
    def kind(self) -> str:
        """RViz's class id of the view."""
        return class_id_of(VIEW_IDS, self._view.controller.TYPE, 1)

    def request_frame(self) -> None:
        """Request another frame."""
        self._view.update()

    @Slot()
    def _on_view_changed(self) -> None:
        self._on_current_changed()

    def _read_camera(self, kind: str) -> Orbit:  # noqa: ARG002 - the base class's signature
        camera = self._view.camera()
        eye = camera.eye
        if isinstance(self._view.controller, TopDownOrthoView):
            return self._orbit_from_above(eye.x, eye.y)
        return Orbit.between(eye, camera.focus)

    def _switch_view(self, kind: str) -> None:
        self._view.select_view(kind)

    def _height_px(self) -> float:
        return float(self._view.height())

    def _get(self, name: str) -> Any:
        head, _, axis = name.partition("/")
        value = self._view.controller.get(head)
        return value["XYZ".index(axis)] if axis else value

    def _set(self, name: str, value: Any) -> None:
        head, _, axis = name.partition("/")
        if axis:
            parts = list(self._view.controller.get(head))
            parts["XYZ".index(axis)] = value
            value = Point(*parts)
        self._view.controller.set(head, value)

    def _set_all(self, kind: str, *values: float) -> None:
        controller = self._view.controller
        on_change, controller.on_change = controller.on_change, None
        try:
            super()._set_all(kind, *values)
        finally:
            controller.on_change = on_change
        self._view.camera_moved()


class SceneViews(Views):
    """The view types of a scene, and the saved views of its config."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        super().__init__()
        view.viewChanged.connect(self._on_view_changed)
        view.savedViewsChanged.connect(self._on_view_changed)

    @property
    def kinds(self) -> list[str]:
        """RViz's class ids of the view types."""
        return sorted(class_id_of(VIEW_IDS, kind, 1) for kind in VIEWS)

    @property
    def saved(self) -> list[str]:
        """Names of the saved views, not unique."""
        found: list[str] = self._view.property("savedViews")
        return found

    @Slot()
    def _on_view_changed(self) -> None:
        self._on_change()

    def _known_id(self, kind: Any) -> Any:
        known = view_type(kind) if isinstance(kind, str) else ""
        return class_id_of(VIEW_IDS, known, 1) if known in VIEWS else kind

    def _current_kind(self) -> str:
        return class_id_of(VIEW_IDS, self._view.controller.TYPE, 1)

    def _switch(self, kind: str) -> None:
        self._view.select_view(kind)

    def _append(self, name: str) -> None:
        self._view.save_view(name)

    def _show(self, index: int) -> None:
        for note in self._view.show_saved_view(index):
            _log.warning("%s", note)

    def _take(self, index: int) -> None:
        self._view.remove_saved_view(index)


class ScenePicker(Picker):
    """Picks points and takes screenshots of a scene."""

    def __init__(self, access: SceneAccess) -> None:
        self._access, self._view = access, access.scene_view

    def _pick(self, x: float, y: float, radius: float) -> tuple[float, float, float] | None:
        if not (0 <= x < self._view.width() and 0 <= y < self._view.height()):
            return None
        found = self._view.pick(x, y, radius)
        if found is None and radius:
            # Points and lines were looked for within the radius, surfaces only at its centre.
            around = ((radius * ring, step) for ring in _RINGS for step in _AROUND)
            for far, (dx, dy) in around:
                found = self._view.pick(x + dx * far, y + dy * far, 0.0)
                if found is not None:
                    break
        return None if found is None else found.point

    def picture(self) -> Any:
        """Return an image of the 3D view with its overlays."""
        image = self.window_picture()
        ratio = image.devicePixelRatio()
        view = self._view
        rect = view.mapRectToScene(QtCore.QRectF(0, 0, view.width(), view.height()))
        left, top = round(rect.x() * ratio), round(rect.y() * ratio)
        return image.copy(left, top, round(rect.width() * ratio), round(rect.height() * ratio))

    def window_picture(self) -> Any:
        """Return an image of the whole window."""
        window = window_of(self._view)
        if window is None or not window.isExposed() or not self._view.isVisible():
            raise Error("the 3D view is not visible")
        if self._access.is_drawing:
            raise Error("this cannot be called while the view is being drawn; use Qt.callLater()")
        self._view.update()  # a change may wait for its frame
        return grab(window)


class SceneTool(tools.Tool):
    """One tool of a scene's view."""

    def __init__(self, owner: SceneTools, tool: Tool) -> None:
        class_id = TOOL_IDS.get(tool.TYPE, ("", ""))[0] or tool.class_id or f"rosglass/{tool.name}"
        super().__init__(owner, tool, class_id, str(tool.shortcutKey))

    def _read(self) -> tuple[str, str]:
        tool = self.handle
        return (tool.name, tool.description) if is_alive(tool) else self._state

    def picture(self) -> Any:
        """Return its icon, a ``QPixmap``: the first letters of its name's words."""
        picture = QtGui.QPixmap(_ICON_PX, _ICON_PX)
        picture.fill(QtGui.QColor(0, 0, 0, 0))
        letters = "".join(word[0] for word in self.name.split())[:2]
        painter = QtGui.QPainter(picture)
        try:
            painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
            painter.setBrush(QtGui.QColor("#4a7fb5"))
            painter.setPen(QtCore.Qt.PenStyle.NoPen)
            painter.drawEllipse(picture.rect().adjusted(2, 2, -2, -2))
            painter.setPen(QtGui.QColor("white"))
            font = painter.font()
            font.setPixelSize(_ICON_PX * 2 // 5)
            painter.setFont(font)
            painter.drawText(picture.rect(), QtCore.Qt.AlignmentFlag.AlignCenter, letters)
        finally:
            painter.end()
        return picture


class SceneTools(tools.Tools):
    """The tools of a scene's view."""

    def __init__(self, view: SceneView) -> None:
        super().__init__()
        self._view, self._tools = view, view.tools
        self._start()
        self._tools.changed.connect(self._on_change)
        self._tools.currentChanged.connect(self._on_change)

    @property
    def classes(self) -> list[str]:
        """RViz's class ids of the tools that can be added."""
        return sorted(filter(None, (TOOL_IDS[kind][0] for kind in Tools.TYPES if kind in TOOL_IDS)))

    @property
    def current(self) -> tools.Tool | None:
        """The selected tool; None if there is none."""
        found = self._tools.property("current") if is_alive(self._tools) else None
        return next((one for one in self._items if one.exists and one.handle is found), None)

    def find(self, class_id: str) -> tools.Tool | None:
        """Return the first tool of a class, by the id of RViz 1 or 2; None if there is none."""
        found = super().find(class_id)
        wanted = tool_type(class_id)
        if found is None and wanted:
            found = next((one for one in self._items if wanted == one.handle.TYPE), None)
        return found

    def remove_all(self) -> None:
        """Remove all tools; the mouse moves the camera until one is added."""
        self._tools.clear()
        self.emit_changes()

    def emit_changes(self) -> None:
        """Emit the signals of all changes since the last call."""
        if is_alive(self._view):
            super().emit_changes()

    def _select(self, tool: tools.Tool) -> None:
        self._tools.select(tool.handle)

    def _add(self, class_id: str) -> Any:
        if tool_type(class_id) not in Tools.TYPES:
            hint = similar(class_id, self.classes) or f"; there are: {', '.join(self.classes)}"
            if display_type(class_id):
                hint = " of tools; it is a display: use addDisplay"
            raise Error(f"no tool was added: there is no class {class_id:.80}{hint}")
        return self._tools.add(class_id)

    def _remove(self, tool: tools.Tool) -> None:
        self._tools.remove(tool.handle)

    def _handles(self) -> list[Any]:
        return list(self._tools)

    def _create(self, handle: Any) -> tools.Tool:
        return SceneTool(self, handle)


class _Property(NamedTuple):
    """One property of a display, or of the view.

    Attributes:
        kind: The type of the value.
        description: For the panel.
        read: Returns its value.
        write: Sets it.
        is_shown: Returns whether it has an effect; panels hide it otherwise.
    """

    kind: Kind
    description: str
    read: Callable[[], Any]
    write: Callable[[Any], object]
    is_shown: Callable[[], bool] = lambda: True


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
            lambda: setting.is_shown(display),
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
            given = kind.read(_color(value) if kind.NAME == "color" else value)
    except Error as error:
        raise Error(f"{name}: {error}") from None
    if kind.NAME == "color" and given.alpha() != 255:
        raise Error(f"{name}: this colour has no transparency; set the property Alpha")
    found.write(given)


def _color(value: Any) -> Any:
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
        described = _described(name, path, value, one.kind.NAME, one.description, below)
        found.append({**described, "hidden": not one.is_shown()})
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
    one, two = DISPLAY_IDS.get(kind, ("", ""))
    return one or two or (kind if "/" in kind else f"rosglass/{kind}")


class SceneDisplay(displays.Display):
    """One display of a scene."""

    def __init__(self, owner: SceneDisplays, display: Display) -> None:
        class_id = str(getattr(display, "class_id", "")) or _class_id(display.TYPE)
        super().__init__(owner, display, class_id)

    def _read(self) -> tuple[str, bool, displays.Status]:
        display = self.handle
        if not is_alive(display):
            return self._state  # type: ignore[no-any-return]
        return (
            display.name,
            display.enabled,
            displays.Status(display.statusLevel, display.statusText),
        )

    def _rename(self, name: str) -> None:
        self.handle.name = name

    def _enable(self, enabled: bool) -> None:
        self.handle.enabled = enabled


class SceneDisplays(displays.Displays):
    """The displays of a scene."""

    def __init__(self, view: SceneView) -> None:
        super().__init__()
        self._view = view
        self._followed: set[int] = set()
        self._start()
        view.fixedFrameChanged.connect(self._on_change)
        view.sceneChanged.connect(self._watch_scene)
        self._watch_scene()

    @property
    def _scene(self) -> Scene:
        return self._view.scene

    @Slot()
    def _watch_scene(self) -> None:
        self._scene.displaysChanged.connect(self._on_change)
        self._on_change()

    @property
    def classes(self) -> list[str]:
        """RViz's class ids of the displays that can be added."""
        return sorted(_class_id(kind) for kind in self._scene.TYPES)

    @property
    def status(self) -> displays.Status:
        """The view's own status, e.g. an error for an unknown fixed frame."""
        problem = str(self._view.property("problem"))
        if problem:
            return displays.Status("error", f"View: {problem}")
        buffer, fixed = self._scene.transforms, self._scene.fixed_frame
        if buffer is None:
            return displays.Status("warn", "Fixed Frame: there is no connection to the robot yet")
        known = buffer.tree()
        if fixed in known:
            return displays.Status("ok", "Fixed Frame: OK")
        if not known:
            return displays.Status("warn", "Fixed Frame: nothing is received on /tf and /tf_static")
        hint = similar(fixed, known)
        return displays.Status("error", f"Fixed Frame: there is no frame {fixed!r}{hint}")

    def emit_changes(self) -> None:
        """Emit the signals of all changes since the last call."""
        if is_alive(self._view):
            super().emit_changes()

    @Slot()
    def _on_change(self) -> None:
        if is_alive(self._view):  # its displays are destroyed with it
            super()._on_change()

    def describe(self, handle: Any) -> list[dict[str, Any]]:
        """Return the properties of a display, or of the view for None, as nested dicts."""
        return _describe(self._tree(handle))

    def read(self, handle: Any, path: str, name: str) -> Any:
        """Return the value of a property of a display, or of the view for None."""
        return _read(self._tree(handle), path, name or "the view")

    def write(self, handle: Any, path: str, value: Any, name: str) -> None:
        """Change a property of a display, or of the view for None."""
        _write(self._tree(handle), path, value, name)

    def _tree(self, display: Display | None) -> _Tree:
        if display is not None:
            return _properties_of(display)
        scene, view = self._scene, self._view
        return {
            f"{_OPTIONS}/Fixed Frame": _Property(
                KINDS["frame"](),
                "Frame in which everything is placed.",
                lambda: scene.fixed_frame,
                lambda frame: setattr(scene, "fixed_frame", frame),
            ),
            f"{_OPTIONS}/Background Color": _Property(
                KINDS["color"](),
                "Colour of the background.",
                lambda: view.property("background"),
                lambda color: view.setProperty("background", color),
            ),
        }

    def _add(self, class_id: str, name: str, enabled: bool) -> Any:
        kind = display_type(class_id) or class_id
        if kind not in self._scene.TYPES:
            hint = similar(class_id, self.classes) or f"; there are: {', '.join(self.classes)}"
            raise Error(f"no display was added: there is no class {class_id:.80}{hint}")
        display = self._scene.add(kind, name)
        display.enabled = enabled
        return display

    def _remove(self, handle: Any) -> None:
        self._scene.remove(handle)

    def _create(self, handle: Any) -> displays.Display:
        return SceneDisplay(self, handle)

    def _handles(self) -> list[Any]:
        found = [display for display in self._scene.displays if is_alive(display)]
        for display in found:
            if id(display) not in self._followed:
                self._follow(display)
        return found

    def _follow(self, display: Any) -> None:
        at = id(display)
        self._followed.add(at)
        for signal in (display.nameChanged, display.enabledChanged, display.statusChanged):
            signal.connect(self._on_change)
        display.destroyed.connect(self._on_change)
        followed = self._followed
        display.destroyed.connect(lambda *_: followed.discard(at))
