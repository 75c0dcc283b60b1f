"""The seam by which overlays know a scene: the members of RViz's ``Access``, over a ``SceneView``.

QML that was written for overlays over RViz runs unchanged over a scene: the object ``rviz`` is the
same. docs/architecture.md, section 6, has the members. Class ids are those of RViz 1, as these
interfaces know them (``rviz/Grid``); those of RViz 2 are accepted as well.
"""

from __future__ import annotations

import logging
import time
from functools import cached_property
from typing import TYPE_CHECKING, Any

from PySide6.QtQuick import QQuickWindow

from rosglass.comm.names import similar
from rosglass.errors import Error, UnsupportedError
from rosglass.qml.image_sinks import window_of
from rosglass.qml.modules import locate
from rosglass.qml.runtime import runtime_of
from rosglass.qt import QtCore, QtGui, Signal, Slot, is_alive
from rosglass.rviz.camera import Picker
from rosglass.rviz.orbit import Orbit, Point
from rosglass.rviz.plugins import PluginList
from rosglass.rviz.property_values import shown
from rosglass.rviz.trackers import Frames, Trackers
from rosglass.rviz.view import CurrentView, View, Views
from rosglass.scene.access_displays import SceneDisplays
from rosglass.scene.rviz_config import RvizConfig, ViewConfig
from rosglass.scene.rviz_formats import TOOLS as TOOL_IDS
from rosglass.scene.rviz_formats import VIEWS as VIEW_IDS
from rosglass.scene.rviz_formats import class_id_of, display_type, tool_type, view_type
from rosglass.scene.tools import Tools
from rosglass.scene.views import VIEWS, TopDownOrthoView, create_view

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.session import Session
    from rosglass.scene.scene_view import SceneView
    from rosglass.scene.tools import Tool

__all__ = ["SceneAccess", "access_of"]

_log = logging.getLogger("rosglass.scene")
#: Directions in which a pick looks around, and the shares of its radius.
_AROUND = [(1, 0), (-1, 0), (0, 1), (0, -1), (0.7, 0.7), (-0.7, 0.7), (0.7, -0.7), (-0.7, -0.7)]
_RINGS = (0.34, 0.67, 1.0)
#: Size of a tool's icon in pixels.
_ICON_PX = 48


def access_of(view: SceneView) -> SceneAccess:
    """Return the interface of overlays to a view, created on first use."""
    found: Any = view.findChild(SceneAccess)
    return found or SceneAccess(view)


class SceneAccess(QtCore.QObject):
    """The interface of overlays to a scene; use it in the GUI thread only.

    Its parts are created on first use.

    Args:
        view: The view.
    """

    #: The view is about to draw, or what it follows has moved.
    before_frame = Signal()
    #: A config file was loaded, which replaces all displays. Argument: its path.
    config_loaded = Signal(str)
    #: :attr:`fullscreen` has changed.
    fullscreen_changed = Signal()
    #: :attr:`bare` has changed.
    bare_changed = Signal()
    #: :attr:`fixed_frame` has changed.
    fixed_frame_changed = Signal()
    #: :attr:`frame_rate` has changed.
    frame_rate_changed = Signal()

    def __init__(self, view: SceneView) -> None:
        super().__init__(view)
        self.scene_view = view
        self._bare = self._full = False
        self._window: QQuickWindow | None = None
        #: Whether the window is about to draw.
        self.is_drawing = False
        self._frame_rate, self._drawn, self._measured_since = 0.0, view.frames_drawn, _now()
        view.windowChanged.connect(self._on_window)
        view.sceneChanged.connect(self._watch_scene)
        self._watch_scene()
        view.fixedFrameChanged.connect(self.fixed_frame_changed)
        view.configLoading.connect(self._on_config_loading)
        view.configLoaded.connect(self.config_loaded)
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(1000)
        self._timer.timeout.connect(self._measure)
        self._timer.start()
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
        camera: Any = lambda: SceneCamera(self.scene_view)  # noqa: E731 - of another class
        return Trackers(self.before_frame, camera, lambda: self.frames)

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
        """Whether the window fills the screen."""
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
        """Whether only the 3D view is to be shown; the program that shows panels follows it."""
        return self._bare

    @bare.setter
    def bare(self, bare: bool) -> None:
        if bare != self._bare:
            self._bare = bare
            self.bare_changed.emit()

    @property
    def frame_rate(self) -> float:
        """Pictures that were drawn in the last second; a view at rest draws none."""
        return self._frame_rate

    def load_config(self, file: str) -> None:
        """Load a ``.rviz`` file from the event loop, after the current event.

        Raises:
            Error: The file is missing, or is not an RViz config.
        """
        path = locate(file)
        if not path.is_file():
            wrong = "is a folder" if path.is_dir() else "does not exist"
            raise Error(f"{path} {wrong}; expected an RViz config file (.rviz)")
        RvizConfig.load(path)

        def load() -> None:
            try:
                for note in self.scene_view.load_config(path):
                    _log.warning("%s: %s", path, note)
            except Error as error:
                _log.error("rviz.loadConfig: %s", error)

        QtCore.QTimer.singleShot(0, self, load)

    def save_config(self, file: str = "") -> None:
        """Save what is shown as a ``.rviz`` file, by default to the file it was loaded from.

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
        self._timer.stop()
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

    @Slot()
    def _measure(self) -> None:
        now, drawn = _now(), self.scene_view.frames_drawn
        rate = round(max(drawn - self._drawn, 0) / max(now - self._measured_since, 0.001), 1)
        self._drawn, self._measured_since = drawn, now
        if rate != self._frame_rate:
            self._frame_rate = rate
            self.frame_rate_changed.emit()
        if "displays" in self.__dict__:
            self.displays.emit_changes()


def _close_parts(parts: dict[str, Any]) -> None:
    for name in ("displays", "frames", "view"):
        if name in parts:
            parts[name].close()


def _now() -> float:
    return time.monotonic()


class SceneCamera:
    """The camera of a view at the last call of :meth:`update`."""

    def __init__(self, view: SceneView) -> None:
        self._view, self._camera = view, view.camera()

    def update(self) -> bool:
        """Read the camera; return whether it has moved."""
        before, self._camera = self._camera, self._view.camera()
        return self._camera != before

    def project(self, point: Any) -> Any:
        """Return where a point is seen; see :meth:`rosglass.scene.camera.Camera.project`."""
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
        """Have another frame drawn."""
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
        view.configLoaded.connect(self._on_view_changed)

    @property
    def kinds(self) -> list[str]:
        """RViz's class ids of the view types."""
        return sorted(class_id_of(VIEW_IDS, kind, 1) for kind in VIEWS)

    @property
    def saved(self) -> list[str]:
        """Names of the saved views, not unique."""
        return [one.name for one in self._list()]

    @Slot()
    def _on_view_changed(self) -> None:
        self._on_change()

    def _list(self) -> list[ViewConfig]:
        config = self._view.config
        return [] if config is None else config.saved_views

    def _known_id(self, kind: Any) -> Any:
        known = view_type(kind) if isinstance(kind, str) else ""
        return class_id_of(VIEW_IDS, known, 1) if known in VIEWS else kind

    def _current_kind(self) -> str:
        return class_id_of(VIEW_IDS, self._view.controller.TYPE, 1)

    def _switch(self, kind: str) -> None:
        self._view.select_view(kind)

    def _append(self, name: str) -> None:
        if self._view.config is None:
            self._view.config = RvizConfig()
        state = {**self._view.controller.state(), "Name": name}
        self._view.config.saved_views.append(ViewConfig(state))

    def _show(self, index: int) -> None:
        saved = self._list()[index]
        if view_type(saved.class_id) not in VIEWS:
            raise Error(f"the saved view {saved.name!r} is of a type that does not exist here")
        made = create_view(saved.class_id)
        for warning in made.restore(saved.settings):
            _log.warning("the saved view %s: %s", saved.name, warning)
        self._view.show_view(made)

    def _take(self, index: int) -> None:
        del self._list()[index]


class ScenePicker(Picker):
    """Picks points and takes pictures of a scene."""

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
        """Return a picture of the 3D view with its overlays."""
        image = self.window_picture()
        ratio = image.devicePixelRatio()
        view = self._view
        rect = view.mapRectToScene(QtCore.QRectF(0, 0, view.width(), view.height()))
        left, top = round(rect.x() * ratio), round(rect.y() * ratio)
        return image.copy(left, top, round(rect.width() * ratio), round(rect.height() * ratio))

    def window_picture(self) -> Any:
        """Return a picture of the whole window."""
        window = window_of(self._view)
        if window is None or not window.isExposed() or not self._view.isVisible():
            raise Error("the 3D view is not visible")
        if self._access.is_drawing:
            raise Error("this cannot be called while the view is being drawn; use Qt.callLater()")
        return window.grabWindow()


class SceneTool:
    """One tool, created by :class:`SceneTools`; its members stay readable after removal.

    It has the members of :class:`rosglass.rviz.tools.Tool`, which has their descriptions.
    """

    def __init__(self, owner: SceneTools, tool: Tool) -> None:
        self._owner = owner
        #: The tool; None after removal.
        self.tool: Tool | None = tool
        #: RViz 1's class id, e.g. ``rviz/Measure``.
        self.class_id = (
            TOOL_IDS.get(tool.TYPE, ("", ""))[0] or tool.class_id or f"rosglass/{tool.name}"
        )
        self.shortcut_key = str(tool.shortcutKey)
        self._state = ("", "")
        self.refresh()

    def refresh(self) -> bool:
        """Read name and description; return whether they have changed."""
        before, tool = self._state, self.tool
        if tool is not None and is_alive(tool):
            self._state = (tool.name, tool.description)
        return before != self._state

    @property
    def exists(self) -> bool:
        """Whether it was not removed."""
        return self.tool is not None

    @property
    def name(self) -> str:
        """The text of its button; not unique."""
        return self._state[0]

    @property
    def description(self) -> str:
        """Description of the tool."""
        return self._state[1]

    @property
    def selected(self) -> bool:
        """Whether it is the selected tool."""
        return self.exists and self._owner.current is self

    def select(self) -> None:
        """Select the tool.

        Raises:
            Error: It was removed.
        """
        self._owner.select(self)

    def remove(self) -> None:
        """Remove the tool.

        Raises:
            Error: It was removed before.
        """
        self._owner.remove(self)

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


class SceneTools(PluginList):
    """The tools of a view; it has the members of :class:`rosglass.rviz.tools.Tools`."""

    #: Another tool was selected.
    selected = Signal()

    def __init__(self, view: SceneView) -> None:
        super().__init__()
        self._view, self._tools = view, view.tools
        self._items: list[SceneTool]
        self._sync_items()
        self._known, self._known_current = list(self._items), self.current
        self._tools.changed.connect(self._on_event)
        self._tools.currentChanged.connect(self._on_event)

    @property
    def classes(self) -> list[str]:
        """RViz's class ids of the tools that can be added."""
        return sorted(filter(None, (TOOL_IDS[kind][0] for kind in Tools.TYPES if kind in TOOL_IDS)))

    @property
    def current(self) -> SceneTool | None:
        """The selected tool; None if there is none."""
        found = self._tools.property("current") if is_alive(self._tools) else None
        return next((one for one in self._items if one.exists and one.tool is found), None)

    def find(self, class_id: str) -> SceneTool | None:
        """Return the first tool of a class; None if there is none."""
        wanted = tool_type(class_id)
        return next(
            (
                one
                for one in self._items
                if one.class_id == class_id
                or (wanted and one.tool is not None and wanted == one.tool.TYPE)
            ),
            None,
        )

    def select(self, tool: SceneTool) -> None:
        """Select a tool.

        Raises:
            Error: It was removed.
        """
        self._tools.select(self._require(tool))
        self.emit_changes()

    def add(self, class_id: str) -> SceneTool:
        """Add a tool.

        Args:
            class_id: RViz's class id, e.g. ``rviz/Measure`` or ``rviz_default_plugins/Measure``.

        Raises:
            Error: There is no such class.
        """
        if not isinstance(class_id, str) or class_id.count("/") != 1:
            near = similar(class_id, self.classes) if isinstance(class_id, str) else ""
            raise Error(f"expected a class id, e.g. 'rviz/Measure', got {shown(class_id)}{near}")
        if tool_type(class_id) not in Tools.TYPES:
            hint = similar(class_id, self.classes) or f"; there are: {', '.join(self.classes)}"
            if display_type(class_id):
                hint = " of tools; it is a display: use addDisplay"
            raise Error(f"no tool was added: there is no class {class_id:.80}{hint}")
        made = self._tools.add(class_id)
        self._sync_items()
        found = next(one for one in self._items if one.tool is made)
        self.emit_changes()
        return found

    def remove(self, tool: SceneTool) -> None:
        """Remove a tool; if it was selected, the first one is selected.

        Raises:
            Error: It was removed before.
        """
        self._tools.remove(self._require(tool))
        self.emit_changes()

    def remove_all(self) -> None:
        """Remove all tools; the mouse moves the camera until one is added."""
        self._tools.clear()
        self.emit_changes()

    def ask_for_new(self) -> None:
        """Not possible here.

        Raises:
            UnsupportedError: Always.
        """
        raise UnsupportedError("there is no dialog for adding tools; give addTool() a class id")

    def emit_changes(self) -> None:
        """Emit the signals of all changes since the last call."""
        if is_alive(self._view):
            super().emit_changes()

    def _require(self, tool: SceneTool) -> Tool:
        if tool.tool is None:
            raise Error(f"the tool {tool.name} was removed")
        return tool.tool

    def _sync_items(self) -> None:
        known = {id(one.tool): one for one in self._items if one.tool is not None}
        self._items = [
            known.pop(id(tool)) if id(tool) in known else SceneTool(self, tool)
            for tool in self._tools
        ]
        for gone in known.values():
            gone.tool = None

    def _sync_rest(self) -> Callable[[], None]:
        before, self._known_current = self._known_current, self.current
        return self.selected.emit if self._known_current is not before else lambda: None

    @Slot()
    def _on_event(self) -> None:
        self._on_change()
