"""The item ``SceneView``: a scene in a QML interface, drawn by Qt's own graphics layer."""
# ruff: noqa: N802, N815 - the names of slots, signals and events are Qt's

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from PySide6.QtGui import QColor
from PySide6.QtQuick import QQuickRhiItem

from rosglass.errors import ArgumentError, Error, shown
from rosglass.overlay.orbit import ease
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_config import RvizConfig, ToolConfig, ViewConfig
from rosglass.scene.configs.rviz_formats import FIXED_FRAME, ros_of
from rosglass.scene.displays.display import Display
from rosglass.scene.displays.scene import Scene
from rosglass.scene.render.camera import interpolate
from rosglass.scene.render.drawing import Mesh
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.mesh_shapes import SPHERE
from rosglass.scene.render.picking import pick
from rosglass.scene.render.renderer import Frame, SceneRenderer
from rosglass.scene.render.scene_tree import Group
from rosglass.scene.tools.selection import Selection
from rosglass.scene.tools.tool import Tool
from rosglass.scene.tools.tool_manager import Tools
from rosglass.scene.view.display_configs import (
    add_controller,
    check_panels,
    check_saved_views,
    collect_displays,
    create_saved_view,
    show_displays,
)
from rosglass.scene.view.frame_scheduler import NO_GPU, FrameScheduler, close_renderers
from rosglass.scene.view.pointer_input import PointerInput
from rosglass.scene.view_controllers.view_controller import ViewController
from rosglass.scene.view_controllers.view_settings import setting_text, setting_value
from rosglass.scene.view_controllers.views import VIEWS, create_view

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.scene.render.camera import Camera
    from rosglass.scene.render.picking import Hit
    from rosglass.scene.render.scene_tree import Drawable

__all__ = ["NO_GPU", "SceneView"]

#: Seconds after its last move at which a camera counts as still.
_STILL_S = 0.2
#: Seconds that the camera takes to turn to its goal, and milliseconds between two frames.
_TURN_S, _TURN_MS = 0.4, 16
_SCENE_GONE = "The scene was that of another view, which is gone: nothing is shown."
#: RViz's background.
_BACKGROUND = (48, 48, 48)


class SceneView(QQuickRhiItem):
    """A 3D view of the robot and what it sees.

    Displays, tools and views are declared inside it or added at run time. It draws only when
    something has changed. See its page in ``docs/scene.md``.
    """

    fixedFrameChanged = Signal()
    backgroundChanged = Signal()
    problemChanged = Signal()
    viewChanged = Signal()
    savedViewsChanged = Signal()
    toolChanged = Signal()
    statusTextChanged = Signal()
    #: The camera was moved, or the size changed.
    cameraChanged = Signal()
    sceneChanged = Signal()
    bareChanged = Signal()
    focusOnClickChanged = Signal()
    #: A config is about to replace what is shown.
    configLoading = Signal()
    #: A config was shown: its file, if any.
    configLoaded = Signal(str)
    #: The content was saved to a file.
    configSaved = Signal(str)

    def __init__(self, parent: Any = None, runtime: Runtime | None = None) -> None:
        super().__init__(parent)
        self._runtime = runtime
        self._background = QColor(*_BACKGROUND)
        self._bare = self._focus_on_click = False
        self._problem = ""
        #: Whether it showed the scene of another view, which is gone.
        self._scene_is_gone = False
        self._frames = FrameScheduler(self)
        #: The view's own drawables in the scene: tools, and marks of the selection.
        self.overlay = Group()
        #: The selection.
        self._selection = Selection(self, self.overlay, self._drawables, self.camera)
        self.sceneChanged.connect(self._selection.clear)
        self._scene = Scene(self, runtime)
        #: The config that was loaded; None before.
        self.config: RvizConfig | None = None
        #: Whether its view is of an unknown type, and is kept until another one is chosen.
        self._keeps_view = False
        #: The surrounding program's entries in ``Window Geometry`` of configs.
        self.window_geometry: dict[str, Any] = {}
        self._view: ViewController = create_view("Orbit")
        self._view.on_change, self._view.on_target = self.camera_moved, self._on_placed
        #: Why the camera does not follow its target frame.
        self._view_problem = ""
        self._still = QtCore.QTimer(self)
        self._still.setSingleShot(True)
        self._still.setInterval(int(_STILL_S * 1000))
        self._still.timeout.connect(self._frames.draw)
        self.setAcceptHoverEvents(True)
        self.setFlag(QQuickRhiItem.Flag.ItemAcceptsInputMethod, False)
        self.setAcceptTouchEvents(True)
        #: From where the camera turns to what it is to look at, and since when; None while it does
        #: not.
        self._turn: tuple[Camera, float] | None = None
        self._turning = QtCore.QTimer(self)
        self._turning.setInterval(_TURN_MS)
        self._turning.timeout.connect(self._on_turning)
        #: RViz's flat ball at the focal point, while the camera is dragged.
        self._focal = Mesh(SPHERE, lit=True)
        self._focal.visible = False
        self.overlay.add(self._focal)
        #: The tools, and the one that has the mouse.
        self._tools = Tools(self, runtime)
        self._tools.currentChanged.connect(self.toolChanged)
        self._input = PointerInput(self, self._tools)
        self.cameraChanged.connect(self._input.hover_later)
        self.toolChanged.connect(self._input.hover_later)
        self._tools.statusTextChanged.connect(self.statusTextChanged)
        #: The tool that QML wants, which may be declared further down.
        self._wanted_tool = ""
        self._watch_scene()
        self._clean_up_when_destroyed()

    def _clean_up_when_destroyed(self) -> None:
        # PySide never frees the Python half of an item that QML has made.
        state, renderers, root = self.__dict__, self._frames.renderers, self._scene.root
        overlay = self.overlay

        def end() -> None:
            root.on_change = None
            overlay.remove()
            root.clear()
            close_renderers(renderers)
            state.clear()

        self.destroyed.connect(end)

    # -- the scene -------------------------------------------------------------------------------

    @Slot()
    def _on_scene(self) -> None:
        self._frames.request_picture()
        self._selection.on_scene()
        self._input.hover_later()

    def _watch_scene(self) -> None:
        self._scene.changed.connect(self._on_scene)
        self._scene.placed.connect(self._on_placed)
        self._scene.fixedFrameChanged.connect(self.fixedFrameChanged)
        self._scene.problemChanged.connect(self.problemChanged)
        self._scene.destroyed.connect(self._on_scene_destroyed)
        self._scene.root.add(self.overlay)

    def _get_scene(self) -> Scene:
        return self._scene

    def _set_scene(self, scene: Any) -> None:
        before = self._scene
        if scene is before or scene is None:
            return
        if not isinstance(scene, Scene):
            before._refuse(f"SceneView: scene: expected that of another SceneView, got {scene!r}")
            return
        if is_alive(before):
            before.changed.disconnect(self._on_scene)
            before.placed.disconnect(self._on_placed)
            before.fixedFrameChanged.disconnect(self.fixedFrameChanged)
            before.problemChanged.disconnect(self.problemChanged)
            before.destroyed.disconnect(self._on_scene_destroyed)
            if before.parent() is self:
                before.deleteLater()
        self._show_scene(scene)

    def _show_scene(self, scene: Scene, *, is_gone: bool = False) -> None:
        self._scene, self._scene_is_gone = scene, is_gone
        self._watch_scene()
        self.sceneChanged.emit()
        self.fixedFrameChanged.emit()
        self.problemChanged.emit()
        self.update()

    @Slot()
    def _on_scene_destroyed(self) -> None:
        # Later: this view may be about to be destroyed as well.
        QtCore.QTimer.singleShot(0, self._replace_scene)

    @Slot()
    def _replace_scene(self) -> None:
        """Show an empty scene instead of that of another view that is gone."""
        if is_alive(self) and not is_alive(self._scene):
            self._show_scene(Scene(self, self._runtime), is_gone=True)
            self._scene._log(_SCENE_GONE, logging.WARNING)

    if TYPE_CHECKING:
        scene: Scene
    else:
        #: The scene that is shown: its own, or that of another view, seen from elsewhere.
        scene = Property(QtCore.QObject, _get_scene, _set_scene, notify=sceneChanged)

    # -- properties ------------------------------------------------------------------------------

    def _get_fixed_frame(self) -> str:
        return self.scene.fixed_frame

    def _set_fixed_frame(self, frame: str) -> None:
        try:
            self.scene.fixed_frame = frame
        except Error as error:
            self.scene._refuse(f"SceneView: fixedFrame: {error}")

    #: The frame in which everything is placed.
    fixedFrame = Property(str, _get_fixed_frame, _set_fixed_frame, notify=fixedFrameChanged)

    def _get_background(self) -> QColor:
        return self._background

    def _set_background(self, color: QColor) -> None:
        if color != self._background:
            self._background = QColor(color)
            self.setAlphaBlending(color.alpha() < 255)
            self.backgroundChanged.emit()
            self.update()

    #: The background; where it is translucent, items below the view shine through.
    background = Property(QColor, _get_background, _set_background, notify=backgroundChanged)

    def _set_bare(self, bare: bool) -> None:
        if bare != self._bare:
            self._bare = bare
            self.bareChanged.emit()

    #: Whether the view is to be shown alone, as overlays ask for; the program hides its panels.
    bare = Property(bool, lambda self: self._bare, _set_bare, notify=bareChanged)

    def _set_focus_on_click(self, focus: bool) -> None:
        if focus != self._focus_on_click:
            self._focus_on_click = focus
            self.focusOnClickChanged.emit()

    #: Whether a click gives it the keyboard; otherwise, the keys of the interface around it stay as
    #: they are: they may drive the robot, or stop it.
    focusOnClick = Property(
        bool, lambda self: self._focus_on_click, _set_focus_on_click, notify=focusOnClickChanged
    )

    #: Why nothing, or not everything, is drawn, or the camera does not follow its target frame;
    #: empty without a problem.
    problem = Property(str, lambda self: self._get_problem(), notify=problemChanged)

    def _get_problem(self) -> str:
        if self._scene_is_gone or not is_alive(self._scene):
            return _SCENE_GONE
        return self._problem or self._scene.problem or self._view_problem

    def _get_view_name(self) -> str:
        return self._view.TYPE

    def _set_view_name(self, name: str) -> None:
        try:
            self.select_view(name)
        except Error as error:
            self.scene._refuse(f"SceneView: view: {error}")

    #: The type of the view: ``Orbit``, ``XYOrbit``, ``FPS``, ``TopDownOrtho``,
    #: ``ThirdPersonFollower``, ``FrameAligned``.
    view = Property(str, _get_view_name, _set_view_name, notify=viewChanged)

    #: The selection.
    selection: Any = Property(QtCore.QObject, lambda self: self._selection, constant=True)

    #: The tools: a list, and the current one.
    tools: Any = Property(QtCore.QObject, lambda self: self._tools, constant=True)

    def _get_tool(self) -> str:
        tool = self._tools._current
        return "" if tool is None else tool.TYPE or tool.name

    def _set_tool(self, name: str) -> None:
        if not self.isComponentComplete():
            self._wanted_tool = name
            return
        try:
            self._tools.select(name)
        except Error as error:
            self.scene._refuse(f"SceneView: tool: {error}")

    #: The current tool: its type, e.g. ``Measure``; of an own tool, its name.
    tool = Property(str, _get_tool, _set_tool, notify=toolChanged)

    #: The current tool's instructions, and outcomes of tools, for a status bar; bold as in HTML.
    statusText = Property(str, lambda self: self._tools.statusText, notify=statusTextChanged)

    # -- displays and tools ----------------------------------------------------------------------

    def componentComplete(self) -> None:
        """Add declared displays and tools, and select the requested tool.

        Now, not from the event loop: a program may load a config next, which replaces them.
        """
        super().componentComplete()
        with self.scene.changing():
            for child in self.children():
                if isinstance(child, Tool):
                    self.adopt_tool(child)
                elif isinstance(child, Display):
                    self.adopt_display(child)
        wanted, self._wanted_tool = self._wanted_tool, ""
        if wanted:
            self._set_tool(wanted)

    def adopt_tool(self, tool: Tool) -> None:
        """Add a tool that QML has declared inside this view."""
        self._tools.adopt(tool, declared=True)

    @Slot()
    def reset(self) -> None:
        """Drop all data that was received, e.g. as a recording begins anew."""
        self.scene.reset()

    def adopt_display(self, display: Display) -> None:
        """Show a display that QML has declared inside this view."""
        self.scene.adopt(display)

    # -- the camera ------------------------------------------------------------------------------

    @property
    def controller(self) -> ViewController:
        """The view controller, which moves the camera."""
        return self._view

    def select_view(self, name: str) -> None:
        """Change to another type of view, which starts where this one is.

        Raises:
            Error: There is no such type.
        """
        made = create_view(name)
        self._keeps_view = False
        if type(made) is not type(self._view):
            made.mimic(self._view)
            self.show_view(made)

    def show_view(self, view: ViewController) -> None:
        """Switch to another view controller.

        Raises:
            ArgumentError: `view` is not a ViewController.
        """
        if not isinstance(view, ViewController):
            raise ArgumentError("view", view, "a view controller; select_view() takes its type")
        self._keeps_view = False
        self._view.on_change = self._view.on_target = None
        self._view = view
        view.on_change, view.on_target = self.camera_moved, self._on_placed
        self._on_placed()
        self.viewChanged.emit()
        self.camera_moved()

    #: The types of views.
    viewTypes = Property(list, lambda self: list(VIEWS), constant=True)  # noqa: ARG005

    @Slot(result="QVariantList")
    def viewSettings(self) -> list[dict[str, Any]]:
        """Return the settings of the view: name, kind, value and choices for SettingEditor."""
        return [
            {
                "name": one["path"],
                "kind": one["kind"],
                "value": setting_text(one["value"]),
                "choices": self._choices_of(one),
                "description": one["description"],
            }
            for one in self._view.describe()
        ]

    def _choices_of(self, setting: dict[str, Any]) -> list[str]:
        if setting["kind"] == "frame":
            return [FIXED_FRAME, *self.scene.frames()]
        return list(setting.get("choices", ()))

    @Slot(str, str, result=str)
    def setViewSetting(self, name: str, text: str) -> str:
        """Change a setting of the view; return why it does not fit, or an empty text."""
        try:
            self._view.set(name, setting_value(self._view.get(name), text))
        except Error as error:
            return str(error)
        self.camera_moved()
        return ""

    @Slot()
    def resetView(self) -> None:
        """Return to where the view was at first."""
        self._view.reset()
        self.camera_moved()

    # -- saved views -----------------------------------------------------------------------------

    def _saved_views(self) -> list[ViewConfig]:
        return [] if self.config is None else self.config.saved_views

    #: Names of the saved views, not unique.
    savedViews = Property(
        list, lambda self: [one.name for one in self._saved_views()], notify=savedViewsChanged
    )

    #: The type of each, e.g. ``Orbit``.
    savedViewTypes = Property(
        list,
        lambda self: [one.class_id.rpartition("/")[2] for one in self._saved_views()],
        notify=savedViewsChanged,
    )

    def save_view(self, name: str) -> None:
        """Save where the camera is, as the last of the saved views.

        Raises:
            ArgumentError: The name is not a string.
        """
        if not isinstance(name, str):
            raise ArgumentError("name", name, "a text")
        if self.config is None:
            self.config = RvizConfig(self._ros())
        self.config.saved_views.append(self._view_config(name, self.config.ros))
        self.savedViewsChanged.emit()

    def _ros(self) -> int:
        """Return the RViz of the config, 1 or 2; that of the robot if there is none."""
        if self.config is not None:
            return self.config.ros
        node = self.scene.node
        return 1 if node is not None and node.wire == "ros1" else 2

    def _view_config(self, name: str, ros: int) -> ViewConfig:
        """Return the view for a config of one RViz, also if it is one of the other RViz."""
        view = self._view
        if ros_of(view.class_id) in (None, ros):
            return ViewConfig({**view.state(), "Name": name})
        return ViewConfig.new(view.TYPE, ros, name=name, settings=view.state())

    def show_saved_view(self, index: int) -> list[str]:
        """Switch to a saved view.

        Returns:
            Settings of it that were left out, a line each.

        Raises:
            Error: There is none at this index, or it is of a type that does not exist here.
        """
        saved = self._saved_views()[self._saved_index(index)]
        notes: list[str] = []
        made = create_saved_view(saved, notes)
        if made is None:
            raise Error(
                f"rosglass has no {saved.class_id}, the type of the saved view {saved.name!r}"
            )
        add_controller(self.scene, saved, notes)
        self.show_view(made)
        return notes

    def remove_saved_view(self, index: int) -> None:
        """Remove a saved view.

        Raises:
            Error: There is none at this index.
        """
        del self._saved_views()[self._saved_index(index)]
        self.savedViewsChanged.emit()

    def _saved_index(self, index: int) -> int:
        count = len(self._saved_views())
        if not isinstance(index, int) or not 0 <= index < count:
            raise Error(f"there is no saved view {shown(index)}; there are {count}")
        return index

    @Slot(str, result=str)
    def saveView(self, name: str) -> str:
        """Save the view instead of one of this name; return what is wrong, or an empty text."""
        name = name.strip() or self._view.TYPE
        if not name.isprintable():
            return f"expected a name of one line, got {name!r}"
        names = [one.name for one in self._saved_views()]
        if name in names:
            self.remove_saved_view(names.index(name))
        self.save_view(name)
        return ""

    @Slot(int, result=str)
    def showSavedView(self, index: int) -> str:
        """Switch to a saved view; return its problem, or an empty text."""
        try:
            return "; ".join(self.show_saved_view(index))
        except Error as error:
            return str(error)

    @Slot(int)
    def removeSavedView(self, index: int) -> None:
        """Remove a saved view."""
        try:
            self.remove_saved_view(index)
        except Error as error:
            self.scene._refuse(f"SceneView: removeSavedView: {error}")

    def pictures_drawn(self) -> int:
        """Return the number of drawn frames."""
        return self._frames.pictures_drawn

    # -- config files ----------------------------------------------------------------------------

    def load_config(self, path: str | os.PathLike[str]) -> list[str]:
        """Replace the content by an RViz config (``.rviz``).

        Returns:
            What was left out, a line each.

        Raises:
            Error: It cannot be read; nothing has changed then.
        """
        return self.show_config(RvizConfig.load(path))

    def show_config(self, config: RvizConfig) -> list[str]:
        """Replace the content by a config; return the parts left out, a line each."""
        self.configLoading.emit()
        notes = show_displays(self.scene, config)
        red, green, blue, _ = config.background_color
        self.setProperty("background", QColor.fromRgbF(red, green, blue))
        if config.tools:
            notes += self.tools.load_configs(one.settings for one in config.tools)
        saved = config.current_view
        made = None if saved is None else create_saved_view(saved, notes)
        if made is not None:
            self.show_view(made)
        self._keeps_view = saved is not None and made is None
        notes += check_saved_views(config) + check_panels(config)
        self.config = config
        self.savedViewsChanged.emit()
        self.configLoaded.emit(config.source)
        return notes

    def collect_config(self, ros: int | None = None) -> RvizConfig:
        """Return the config of what is shown, with what its file had beside that.

        Args:
            ros: The RViz that a new config is for, 1 or 2; by default that of the robot.
        """
        config = self.config or RvizConfig(ros or self._ros())
        config.fixed_frame = self.scene.fixed_frame
        config.background_color = cast("tuple[float, ...]", self._background.getRgbF())
        config.displays[:] = collect_displays(self.scene, config.ros)
        config.tools[:] = [ToolConfig(one) for one in self.tools.save_configs(config.ros)]
        if self.window_geometry:
            before = config.root.get("Window Geometry")
            geometry = before if isinstance(before, dict) else {}
            config.root["Window Geometry"] = {**geometry, **self.window_geometry}
        if not self._keeps_view:
            current = config.current_view
            before = {} if current is None else current.settings
            state = self._view_config(self._view.name, config.ros).settings
            config.current_view = ViewConfig({**before, **state})
        return config

    def save_config(self, path: str | os.PathLike[str] = "") -> None:
        """Write the content into an RViz config.

        Args:
            path: The file; by default the one that was loaded.

        Raises:
            Error: It cannot be written, or none was loaded.
        """
        config = self.collect_config()
        if not (path or config.source):
            raise Error("no config file is loaded; say where to save it")
        config.save(path or config.source)
        config.source = str(path or config.source)
        self.config = config
        self.configSaved.emit(config.source)

    def camera(self) -> Camera:
        """Return the camera of the next frame; its pixels are units of this item."""
        goal = self._view.camera(self.width(), self.height())
        if self._turn is None:
            return goal
        start, since = self._turn
        return interpolate(start, goal, ease((time.monotonic() - since) / _TURN_S))

    def move_camera(self, change: Callable[[ViewController], bool | None]) -> bool:
        """Change the view, and turn the camera there instead of jumping.

        Args:
            change: Called with the view controller, e.g. to look at a point; may return False for
                no change.

        Returns:
            Whether there was a change.
        """
        start = self.camera()
        if change(self._view) is False:
            return False
        self._turn = (start, time.monotonic())
        self._turning.start()
        self.camera_moved()
        return True

    @Slot()
    def _on_turning(self) -> None:
        if self._turn is not None and time.monotonic() - self._turn[1] >= _TURN_S:
            self.stop_turning()
        self.camera_moved()

    def stop_turning(self) -> None:
        """End a turn of the camera at its goal at once."""
        self._turn = None
        self._turning.stop()

    @property
    def is_complete(self) -> bool:
        """True if the last frame showed everything: new data is uploaded over several frames."""
        return self._frames.is_complete

    @property
    def is_loading(self) -> bool:
        """True while meshes or other files of the scene are being read."""
        return is_alive(self._scene) and self._scene.is_loading

    def camera_moved(self) -> None:
        """Draw from where the camera is now."""
        self._still.start()
        self.show_focal_shape()
        self.cameraChanged.emit()
        self._frames.request_picture()

    @Slot()
    def _on_placed(self) -> None:
        """Move the camera with its target frame."""
        scene, view = self.scene, self._view
        if view.target_frame != FIXED_FRAME:
            pose, reason = None, ""
            try:
                pose = scene.look_up(view.target_frame)
            except Error as error:
                reason = str(error)
            if view.update_target(pose, reason):
                self.cameraChanged.emit()
                self._frames.request_picture()
        # Without transforms, displays say so.
        buffer = scene.transforms
        is_connected = buffer is not None and buffer.has_frame(scene.fixed_frame)
        problem = view.problem if is_connected else ""
        if problem != self._view_problem:
            self._view_problem = problem
            self.problemChanged.emit()

    @property
    def is_moving(self) -> bool:
        """True if the camera was moved just now, so that large clouds are thinned out."""
        return self._still.isActive()

    @property
    def is_turning(self) -> bool:
        """True while the camera turns to its goal."""
        return self._turn is not None

    def pick(self, x: float, y: float, radius: float = 2.0) -> Hit | None:
        """Return the hit nearest to the camera at a point; None for nothing.

        Args:
            x: Units of this item, from its left edge.
            y: The same, from its upper edge.
            radius: How far from there points and lines may be.
        """
        return pick(self._drawables(), self.camera(), x, y, radius)

    def _drawables(self) -> Iterator[tuple[Drawable, NDArray[np.float64], float]]:
        return self.scene.root.drawables()

    def geometryChange(self, new: Any, old: Any) -> None:
        """Draw in the new size."""
        super().geometryChange(new, old)
        if new.size() != old.size() and is_alive(self):
            self.cameraChanged.emit()
            self.update()

    # -- drawing ---------------------------------------------------------------------------------

    def createRenderer(self) -> SceneRenderer:
        """Return a new renderer; called by Qt in the render thread."""
        return self._frames.create_renderer(self._take_frame, self._on_problem)

    def _take_frame(self) -> Frame:
        if not is_alive(self._scene):  # it was that of a view that is gone
            return Frame([], self.camera(), self._background)
        self._frames.begin()
        return Frame(
            list(self._drawables()),
            self.camera(),
            self._background,
            # Not by the clock: the timer, after which the whole is drawn, may end early.
            self.is_moving,
        )

    def is_moved_by_user(self, now: float) -> bool:
        """Return whether the user moves the camera or drags something now."""
        is_touched = self._tools.holds_mouse or now - self._input.touched_at < _STILL_S
        return is_touched or self.is_turning

    def _on_problem(self, problem: str) -> None:
        # From the render thread, in the middle of drawing.
        QtCore.QTimer.singleShot(0, self, lambda: self.set_problem(problem))

    def set_problem(self, problem: str) -> None:
        """Report why nothing is drawn; empty once something is."""
        if is_alive(self) and problem != self._problem:
            self._problem = problem
            self.problemChanged.emit()
            if is_alive(self._scene):
                self._scene._log(problem, logging.WARNING)

    # -- mouse, touch, keys ----------------------------------------------------------------------

    def mousePressEvent(self, event: Any) -> None:
        """Pass a press to the tool, or start to drag the camera."""
        self._input.press(event)

    def mouseMoveEvent(self, event: Any) -> None:
        """Pass a drag to the tool, or drag the camera."""
        self._input.move(event)

    def mouseReleaseEvent(self, event: Any) -> None:
        """End a drag."""
        self._input.release(event)

    def mouseUngrabEvent(self) -> None:
        """Drop a drag that another item has taken over."""
        if is_alive(self):
            self._input.ungrab()

    def hoverEnterEvent(self, event: Any) -> None:
        """Show the object under the mouse, which may not move again."""
        self._input.hover(event)

    def hoverMoveEvent(self, event: Any) -> None:
        """Show the object under the mouse."""
        self._input.hover(event)

    def hoverLeaveEvent(self, event: Any) -> None:
        """Show nothing any more of what was under the mouse."""
        super().hoverLeaveEvent(event)
        if is_alive(self):
            self._input.leave()

    def wheelEvent(self, event: Any) -> None:
        """Zoom."""
        self._input.wheel(event)

    def touchEvent(self, event: Any) -> None:
        """Treat one finger as the tool's left button; else rotate, move and zoom by fingers."""
        self._input.touch(event)

    def touchUngrabEvent(self) -> None:
        """Cancel a drag that another item has taken over."""
        if is_alive(self):
            self._input.ungrab_touch()

    def keyPressEvent(self, event: Any) -> None:
        """Handle the keys of tools, F and Z, and Escape."""
        self._input.press_key(event)

    def keyReleaseEvent(self, event: Any) -> None:
        """Follow keys like Shift."""
        self._input.release_key(event)

    def show_focal_shape(self) -> None:
        """Show the point that the camera turns around, while it is dragged."""
        shape = self._view.focal_shape() if self._tools.moves_camera else None
        if shape is not None:
            self._focal.pose = shape.pose
            size = instance_matrix(scale=shape.size)[np.newaxis]
            self._focal.set_instances(size, shape.color)
        self._focal.visible = shape is not None
