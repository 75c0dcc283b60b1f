"""The object ``rviz`` in QML, one for each overlay, and the objects that it returns.

They use the 3D view only through :class:`rosglass.overlay.access.Access`; docs/architecture.md,
section 6, says what another 3D view has to implement.
"""
# ruff: noqa: N802 N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

import logging
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.overlay.qml_members import (
    LIST,
    VARIANT,
    QmlWrapper,
    QmlWrappers,
    boolean,
    forward,
    member,
    options,
    point,
    point_of,
    property_path,
    slot,
    spell_checked,
    text,
    unchecked,
)
from rosglass.overlay.registered_properties import RegisteredProperties
from rosglass.qml.engine.log import Caller, log_from_qml, plain_path
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QJSValue, QtCore, QtGui, QtQml, QtQuick, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.overlay.access import Access
    from rosglass.overlay.orbit import Point
    from rosglass.overlay.overlay import Overlay
    from rosglass.overlay.tools import Tool, Tools
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["ACCESS", "RvizObject"]

#: Key in `Session.shared` of the 3D view's `Access`.
ACCESS = "3D view"
#: Name of the image provider of icons, after ``image://``.
_ICONS = "rviz_tool_icons"
#: The attributes of an object `rviz` that belong to one engine.
_PARTS = ("runtime", "_engine", "_icons", "tool_manager", "display_wrappers", "camera")
#: Default and maximum size of an icon in pixels.
_ICON_SIZE, _MAX_ICON_SIZE = 48, 1024
#: Minimum movement of the camera in metres that `moved` reports.
_MIN_MOVE_M = 1e-4
_FRAME = "the name of a frame, or '' for none"


def _mode(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise Error(f"expected rviz.view.MODE_3D (0) or MODE_2D (1), got {shown(value)}")
    return value


def _vector(value: Point) -> QtGui.QVector3D:
    return QtGui.QVector3D(*value)


class QmlTool(QmlWrapper):
    """A tool of RViz; its members stay readable after removal."""

    CALLED = "tool"

    isSelectedChanged = Signal()
    #: `name` or `description` has changed.
    changed = Signal()
    existsChanged = Signal()

    def __init__(self, tool: Tool, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(tool, runtime, parent)
        self.existsChanged.connect(self.isSelectedChanged)

    isSelected = member("isSelected", bool, isSelectedChanged, path="model.selected")
    exists = member("exists", bool, existsChanged)
    name = member("name", str, changed)
    description = member("description", str, changed)
    shortcutKey = member("shortcutKey", str)
    classId = member("classId", str)
    iconSource = member(
        "iconSource", str, path="model.class_id", to_qml=f"image://{_ICONS}/{{}}".format
    )
    select = forward("select")
    remove = forward("remove")


class QmlToolManager(QmlWrapper):
    """RViz's tools, ``rviz.toolManager``."""

    CALLED = "rviz.toolManager"

    toolsChanged = Signal()
    toolAdded = Signal(QtCore.QObject, arguments=["tool"])
    toolRemoved = Signal(QtCore.QObject, arguments=["tool"])
    #: Another tool was selected.
    toolChanged = Signal(QtCore.QObject, arguments=["tool"])

    def __init__(self, tools: Tools, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(tools, runtime, parent)
        self.wrappers = QmlWrappers(tools, QmlTool, runtime, self)
        self.wrappers.changed.connect(self.toolsChanged)
        self.wrappers.added.connect(self.toolAdded)
        self.wrappers.removed.connect(self.toolRemoved)
        tools.selected.connect(self._on_selected)

    @property
    def current(self) -> QmlTool | None:
        """The selected tool."""
        return self.wrappers.of(self.model.current)  # type: ignore[no-any-return]

    #: All tools, in the order of their buttons.
    tools = Property(LIST, lambda self: self.wrappers.all(), notify=toolsChanged)
    #: The selected tool; may be set to a tool, its index, or a class id.
    currentTool = member(
        "currentTool",
        QJSValue,
        toolChanged,
        path="current",
        from_qml=unchecked,
        setter=lambda self, wanted: self._wanted(wanted).select(),
    )
    #: Class ids of the tools that can be added.
    toolClasses = member("toolClasses", LIST, path="model.classes")

    @slot(1, classId=unchecked)
    def addTool(self, class_id: Any = None) -> QmlTool | None:
        """Add and return a tool of a class; without a class, open RViz's dialog instead."""
        if class_id is None:
            self.model.ask_for_new()
            return None
        return self.wrappers.of(self.model.add(class_id))  # type: ignore[no-any-return]

    @slot(classId=text("a class id, e.g. 'rviz/Measure'"))
    def getTool(self, class_id: str) -> QmlTool | None:
        """Return the first tool of a class; null if there is none."""
        return self.wrappers.of(self.model.find(class_id))  # type: ignore[no-any-return]

    @slot(tool=unchecked)
    def removeTool(self, tool: Any) -> None:
        """Remove a tool, given as a tool, its index, or a class id."""
        self.model.remove(self._wanted(tool))

    removeAll = forward("removeAll")

    def _wanted(self, wanted: Any) -> Tool:
        there = self.model.all
        if isinstance(wanted, QmlTool):
            return wanted.model  # type: ignore[no-any-return]
        if isinstance(wanted, int) and not isinstance(wanted, bool):
            if 0 <= wanted < len(there):
                return there[wanted]  # type: ignore[no-any-return]
            known = f"there are {len(there)}, numbered from 0" if there else "there are none"
            raise Error(f"there is no tool {wanted}; {known}")
        if isinstance(wanted, str):
            found = self.model.find(wanted)
            if found is not None:
                return found  # type: ignore[no-any-return]
            known = ", ".join(tool.class_id for tool in there) or "none"
            named = [t.class_id for t in there if wanted in (t.name, t.class_id.rpartition("/")[2])]
            hint = f"; did you mean {named[0]!r}?" if named else f"; there are: {known}"
            raise Error(f"there is no tool of the class {shown(wanted)}{hint}")
        raise Error(f"expected a tool, its index, or a class id, got {shown(wanted)}")

    @Slot()
    def _on_selected(self) -> None:
        for wrapper in self.wrappers.known():
            wrapper.isSelectedChanged.emit()
        self.toolChanged.emit(self.current)


class ToolIcons(QtQuick.QQuickImageProvider):
    """Image provider of ``image://rviz_tool_icons/<classId>``, for the GUI thread only.

    Scales the largest icon to the requested size, by default 48 pixels; a width or height alone
    keeps the proportions.

    Args:
        find: Returns a tool by its class id; None for one that does not exist.
    """

    def __init__(self, find: Callable[[str], Tool | None]) -> None:
        # Both versions of Qt have it, but only the hints of Qt 5.
        kinds: Any = QtQuick.QQuickImageProvider
        super().__init__(kinds.Pixmap)
        self._find = find

    def requestPixmap(self, name: str, size: Any, requested: Any) -> Any:
        """Return a tool's icon; a transparent one if there is no such tool, or no icon."""
        tool = self._find(name)
        picture = QtGui.QPixmap() if tool is None else tool.picture()
        width, height = (requested.width(), requested.height())
        if picture.isNull():
            side = min(max(width, height, 0) or _ICON_SIZE, _MAX_ICON_SIZE)
            picture = QtGui.QPixmap(side, side)
            picture.fill(QtGui.QColor(0, 0, 0, 0))
        wide, high = picture.width(), picture.height()
        if width <= 0 and height <= 0:
            factor = _ICON_SIZE / max(wide, high)
            width, height = round(wide * factor), round(high * factor)
        elif width <= 0:
            width = round(wide * height / high)
        elif height <= 0:
            height = round(high * width / wide)
        width, height = (min(max(side, 1), _MAX_ICON_SIZE) for side in (width, height))
        scaled = picture.scaled(
            width,
            height,
            QtCore.Qt.AspectRatioMode.KeepAspectRatio,
            QtCore.Qt.TransformationMode.SmoothTransformation,
        )
        if size is not None:
            size.setWidth(scaled.width())
            size.setHeight(scaled.height())
        return scaled


class QmlDisplay(QmlWrapper):
    """A display of RViz; its name and class stay readable after removal."""

    CALLED = "display"

    #: `name`, `status` or `enabled` has changed.
    changed = Signal()
    existsChanged = Signal()

    def _get_properties(self) -> QJSValue:
        return self.runtime.value(self.model.properties() if self.model.exists else [])

    exists = member("exists", bool, existsChanged)
    name = member("name", VARIANT, changed, from_qml=text("a name, a text of one line"))
    classId = member("classId", str)
    enabled = member("enabled", VARIANT, changed, from_qml=boolean())
    #: ``ok``, ``warn`` or ``error``.
    status = member("status", str, changed, path="model.status.level")
    #: The status messages, one per line.
    statusText = member("statusText", str, changed, path="model.status.text")
    #: All its properties with their current values, nested.
    properties = Property(QJSValue, _get_properties, notify=existsChanged)

    @slot(path=property_path("Offset/X"))
    def get(self, path: str | list[str]) -> QJSValue:
        """Return the value of a property, e.g. ``Offset/X``."""
        return self.runtime.value(self.model.get(path))

    set = forward("set", path=property_path("Offset/X"), value=unchecked)
    remove = forward("remove")


class QmlView(QmlWrapper):
    """The camera, ``rviz.view``; points are in metres, by default in the fixed frame."""

    CALLED = "rviz.view"

    modeChanged = Signal()
    trackedFrameChanged = Signal()
    problemChanged = Signal()
    #: `eye` or `focus` has changed.
    moved = Signal()
    animationDurationChanged = Signal()
    trackingGainChanged = Signal()
    typeChanged = Signal()
    savedViewsChanged = Signal()

    def __init__(self, access: Access, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(access.view, runtime, parent)
        self.views = access.views
        self._last_seen = self._seen()
        self.model.mode_changed.connect(self.modeChanged)
        self.model.tracked_frame_changed.connect(self.trackedFrameChanged)
        self.model.problem_changed.connect(self.problemChanged)
        self.views.kind_changed.connect(self.typeChanged)
        self.views.saved_changed.connect(self.savedViewsChanged)
        settings = self.model.settings
        settings.changed("animation_duration").connect(self.animationDurationChanged)
        settings.changed("tracking_gain").connect(self.trackingGainChanged)
        access.before_frame.connect(self._on_frame)

    #: 0 for 3D, 1 for 2D: from above.
    mode = member(
        "mode",
        QJSValue,
        modeChanged,
        from_qml=_mode,
        setter=lambda self, mode: self.model.set_mode(mode),
    )
    MODE_3D = Property(int, lambda _self: 0, constant=True)
    MODE_2D = Property(int, lambda _self: 1, constant=True)
    #: The frame that the camera follows; empty for none.
    trackedFrame = member(
        "trackedFrame",
        VARIANT,
        trackedFrameChanged,
        from_qml=text(_FRAME),
        setter=lambda self, frame: self.model.track(frame),
    )
    #: Why the camera cannot follow the tracked frame; empty if it can.
    problem = member("problem", str, problemChanged)
    eye = member("eye", QtGui.QVector3D, moved, to_qml=_vector)
    focus = member("focus", QtGui.QVector3D, moved, to_qml=_vector)
    #: Duration of a movement in seconds.
    animationDuration = member(
        "animationDuration",
        VARIANT,
        animationDurationChanged,
        path="model.settings.animation_duration",
        from_qml=unchecked,
        setter=lambda self, value: self.model.settings.set("animation_duration", value),
    )
    #: How quickly the camera follows the tracked frame, in 1/s.
    trackingGain = member(
        "trackingGain",
        VARIANT,
        trackingGainChanged,
        path="model.settings.tracking_gain",
        from_qml=unchecked,
        setter=lambda self, value: self.model.settings.set("tracking_gain", value),
    )
    #: Class id of RViz's view, e.g. ``rviz/Orbit``.
    type = member(
        "type",
        VARIANT,
        typeChanged,
        path="views.kind",
        from_qml=text("a view type, e.g. 'rviz/Orbit'"),
    )
    viewTypes = member("viewTypes", LIST, path="views.kinds")
    #: Names of the saved views.
    savedViews = member("savedViews", LIST, savedViewsChanged, path="views.saved")

    moveEye = forward(
        "moveEye",
        1,
        eye=point("eye"),
        options=options(frame=str, animate=bool, stopTracking=bool, switchTo3D=bool),
    )
    moveEyeAndFocus = forward(
        "moveEyeAndFocus",
        1,
        eye=point("eye"),
        focus=point("focus"),
        options=options(frame=str, animate=bool, stopTracking=bool),
    )

    @slot(1, mode=_mode, animate=boolean("animate"))
    def setMode(self, mode: Any, animate: bool = True) -> None:
        """Switch between 3D (0) and 2D (1); jump if `animate` is false."""
        self.model.set_mode(mode, animate=animate)

    track = forward("track", frame=text(_FRAME))
    reset = forward("reset")
    saveView = forward("saveView", 0, "views.save", name=unchecked)
    showView = forward("showView", 0, "views.show", name=unchecked)
    removeView = forward("removeView", 0, "views.remove", name=unchecked)

    def _seen(self) -> tuple[Point, Point]:
        seen = self.model.seen
        return seen.eye, seen.focus

    @Slot()
    def _on_frame(self) -> None:
        now = self._seen()
        for new, old in zip(now, self._last_seen, strict=True):
            if max(abs(n) for n in new - old) > _MIN_MOVE_M:
                self._last_seen = now
                self.moved.emit()
                return


def _file_path(use: str = "") -> Callable[[Any], str]:
    """Return a converter for file paths and ``file:`` URLs.

    Args:
        use: Purpose of the file, for the error; if empty, ``package://`` URLs are accepted as well.
    """

    def take(value: Any) -> str:
        if isinstance(value, str) and value and "\0" not in value and len(value) <= 4096:
            address = QtCore.QUrl(value)
            if address.isLocalFile():
                return address.toLocalFile()
            if "://" not in value or (not use and value.startswith("package://")):
                return value
        raise Error(f"expected the path of a file{f' {use}' if use else ''}, got {shown(value)}")

    return take


class RvizObject(RegisteredProperties):
    """The object ``rviz`` in the QML of an overlay; see "The rviz object" in ``docs/rviz.md``.

    Args:
        overlay: The overlay.
        engine: Its engine.
        access: The 3D view; None for that of the session.
    """

    #: Name in error messages.
    CALLED = "rviz"

    visibleChanged = Signal()
    isFullscreenChanged = Signal()
    isBareChanged = Signal()
    fixedFrameChanged = Signal()
    displaysChanged = Signal()
    displayAdded = Signal(QtCore.QObject, arguments=["display"])
    displayRemoved = Signal(QtCore.QObject, arguments=["display"])
    statusChanged = Signal()
    frameRateChanged = Signal()
    #: A config file was loaded, which replaces all displays, views and tools.
    configLoaded = Signal(str, arguments=["file"])

    runtime: Runtime
    _engine: QtQml.QQmlEngine

    def __init__(
        self, overlay: Overlay, engine: QtQml.QQmlEngine, access: Access | None = None
    ) -> None:
        super().__init__()
        #: The attributes of other engines than the present one, while a file is reloaded.
        self._others: dict[int, dict[str, Any]] = {}
        self._follows_status = False
        self.serve(engine)
        runtime = self.runtime
        self.overlay = overlay
        self._visible = overlay.visible
        self._disconnects: list[Callable[[], Any]] = []
        QtQml.QQmlEngine.setObjectOwnership(self, QtQml.QQmlEngine.ObjectOwnership.CppOwnership)
        self._follow(overlay.arranged, self._on_arranged)
        self._access = access = access or runtime.session.shared.get(ACCESS)
        if access is not None:
            self._follow(access.fullscreen_changed, self.isFullscreenChanged)
            self._follow(access.bare_changed, self.isBareChanged)
            self._follow(access.config_loaded, self.configLoaded)
            self._follow(access.fixed_frame_changed, self.fixedFrameChanged)
            self._follow(access.frame_rate_changed, self.frameRateChanged)

    def serve(self, engine: QtQml.QQmlEngine) -> None:
        """Work with an engine, which may be the one before; the previous one is kept until it ends.

        The objects that QML gets from this one belong to the engine, so that functions that a file
        has connected to their signals end with it.
        """
        state, others = self.__dict__, self._others
        if "_engine" in state:
            key = id(self._engine)
            others[key] = {name: state.pop(name) for name in _PARTS if name in state}
        known = others.pop(id(engine), None)
        if known is not None:
            state.update(known)
            return
        runtime = runtime_of(engine)
        assert runtime is not None
        self.runtime, self._engine = runtime, engine
        #: Keeps the Python half of the image provider alive, which the engine owns. Files may use
        #: it without the object, and before.
        self._icons = ToolIcons(weak_callback(self._find_tool))
        engine.addImageProvider(_ICONS, self._icons)
        # QML may use the object as long as the engine exists.
        held, key = [self, spell_checked(runtime, self)], id(engine)

        def ended(*_: object) -> None:
            held.clear()
            others.pop(key, None)

        engine.destroyed.connect(ended)

    def _follow(self, signal: Any, slot: Any) -> None:
        signal.connect(slot)
        self._disconnects.append(lambda: signal.disconnect(slot))

    def close(self) -> None:
        """Disconnect from RViz; safe to call twice."""
        disconnects, self._disconnects = self._disconnects, []
        for disconnect in disconnects:
            disconnect()
        access = self._access
        if access is not None and "trackers" in access.__dict__:
            # A program without an event loop may delete the engine much later.
            access.trackers.remove_all(self.runtime)

    @property
    def access(self) -> Access:
        """The 3D view.

        Raises:
            Error: The overlay's session has none.
        """
        self._access = self._access or self.runtime.session.shared.get(ACCESS)
        if self._access is None:
            raise Error("there is no RViz: the overlay's session belongs to no Application")
        return self._access

    def _find_tool(self, class_id: str) -> Tool | None:
        try:
            return self.access.tools.find(class_id)
        except Error:  # there is no view
            return None

    @cached_property
    def tool_manager(self) -> QmlToolManager:
        """The QML object `toolManager`."""
        return QmlToolManager(self.access.tools, self.runtime, self._engine)

    @cached_property
    def display_wrappers(self) -> QmlWrappers:
        """The QML objects of all displays."""
        displays = self.access.displays
        wrappers = QmlWrappers(displays, QmlDisplay, self.runtime, self._engine)
        wrappers.changed.connect(self.displaysChanged)
        wrappers.added.connect(self.displayAdded)
        wrappers.removed.connect(self.displayRemoved)
        if not self._follows_status:
            self._follows_status = True
            displays.status_changed.connect(self.statusChanged)
        return wrappers

    @cached_property
    def camera(self) -> QmlView:
        """The QML object `view`."""
        return QmlView(self.access, self.runtime, self._engine)

    # Overlay and window.

    #: The item that positions of trackers refer to; null for the whole window. For RosRviz only.
    _area = Property(QtCore.QObject, lambda self: self.overlay.area, constant=True)
    #: Whether this overlay is shown.
    visible = member("visible", bool, visibleChanged, path="overlay.visible")
    isFullscreen = member(
        "isFullscreen",
        VARIANT,
        isFullscreenChanged,
        path="access.fullscreen",
        from_qml=boolean(),
        on_error=False,
    )
    #: Whether RViz's window shows only the 3D view.
    isBare = member(
        "isBare", VARIANT, isBareChanged, path="access.bare", from_qml=boolean(), on_error=False
    )
    fixedFrame = member(
        "fixedFrame",
        VARIANT,
        fixedFrameChanged,
        path="access.fixed_frame",
        from_qml=text("the name of a frame, e.g. 'map'"),
        on_error="",
    )
    #: Frames that RViz drew in the last second.
    frameRate = member("frameRate", float, frameRateChanged, path="access.frame_rate", on_error=0.0)
    #: RViz's status: ``ok``, ``warn`` or ``error``.
    status = member("status", str, statusChanged, path="rviz_status.level", on_error="error")
    #: RViz's status messages, one per line.
    statusText = member(
        "statusText", str, statusChanged, path="rviz_status.text", on_error="there is no RViz"
    )

    @property
    def rviz_status(self) -> Any:
        """RViz's own status; reading it enables its change signal."""
        displays = self.access.displays
        if "display_wrappers" not in self.__dict__:
            self.display_wrappers  # noqa: B018 - connects the signal
        return displays.status

    @slot(1, file=_file_path("to save to"), window=boolean("window"))
    def screenshot(self, file: str, window: bool = False) -> None:
        """Save a screenshot of the 3D view with overlays, or of the whole window if `window`."""
        self.access.picker.screenshot(file, window=window)

    #: Load a ``.rviz`` file after the calling function has returned. Discards unsaved changes, and
    #: may remove this overlay.
    loadConfig = forward("loadConfig", 0, "access.load_config", file=_file_path())
    #: Save RViz's config, by default to the file it was loaded from.
    saveConfig = forward("saveConfig", 1, "access.save_config", file=_file_path("to save to"))

    # Tools, camera, displays.

    toolManager = member("toolManager", QtCore.QObject, path="tool_manager")
    view = member("view", QtCore.QObject, path="camera")
    #: All displays, including those in groups, in the order of the panel.
    displays = member(
        "displays",
        LIST,
        displaysChanged,
        path="display_wrappers.all",
        to_qml=lambda wrappers: wrappers(),
        on_error=[],
    )
    #: Class ids of the displays that can be added.
    displayClasses = member("displayClasses", LIST, path="access.displays.classes", on_error=[])

    @slot(name=text("the name of a display, e.g. 'Grid'"))
    def display(self, name: str) -> QmlDisplay | None:
        """Return the first display with the given name; null if there is none."""
        return self.display_wrappers.of(self.access.displays.find(name))  # type: ignore[no-any-return]

    @slot(2, classId=unchecked, name=text("a text", "name"), enabled=boolean("enabled"))
    def addDisplay(
        self, class_id: Any, name: str | None = None, enabled: bool = True
    ) -> QmlDisplay:
        """Add and return a display."""
        wrappers = self.display_wrappers
        return wrappers.of(  # type: ignore[no-any-return]
            self.access.displays.add(class_id, name or "", enabled=enabled)
        )

    @slot(display=unchecked)
    def removeDisplay(self, display: Any) -> None:
        """Remove a display, given as a display or its name."""
        displays = self.access.displays
        found = display.model if isinstance(display, QmlDisplay) else None
        if found is None and not isinstance(display, str):
            raise Error(f"expected a display or its name, got {shown(display)}")
        if found is None:
            found = displays.find(display)
        if found is None:
            names = ", ".join(there.name for there in displays.all) or "none"
            raise Error(f"there is no display {shown(display)}; there are: {names}")
        displays.remove(found)

    @slot(path=property_path("Grid/Color"))
    def getProperty(self, path: str | list[str]) -> QJSValue:
        """Return the value of any property, e.g. ``Global Options/Background Color``."""
        return self.runtime.value(self.access.displays.get(path))

    #: Change any property, like the user in the panel.
    setProperty = forward(
        "setProperty", 0, "access.displays.set", path=property_path("Grid/Color"), value=unchecked
    )

    # Points.

    @slot(2, x=unchecked, y=unchecked, radius=unchecked)
    def pick(self, *given: Any) -> dict[str, float] | None:
        """Return the point of the scene at a position of the overlay; null if nothing is there.

        Args:
            given: x, y and optionally a search radius, in units of the overlay; or a point with x
                and y, and optionally a search radius.
        """
        at = [*given, None, None]
        if isinstance(at[0], dict) and {"x", "y"} <= set(at[0]):
            at[:1] = [at[0]["x"], at[0]["y"]]
        at[2] = 0.0 if at[2] is None else at[2]
        for name, number in zip(("x", "y", "radius"), at, strict=False):
            if isinstance(number, bool) or not isinstance(number, (int, float)):
                wanted = "expected a number, in units of the overlay"
                raise Error(f"{name}: {wanted}, got {shown(number)}")
        found = self.access.picker.pick(*(number * self.overlay.scale for number in at[:3]))
        return None if found is None else dict(zip("xyz", found, strict=True))

    @slot(3, x=unchecked, y=unchecked, z=unchecked, frame=unchecked)
    def createPositionTracker(self, *given: Any) -> QJSValue:
        """Return a tracker of a point's position on the overlay.

        Args:
            given: x, y and z in metres, or a point with x, y and z; and the frame of the point, by
                default the fixed frame.
        """
        parts = [*given, None, None, None]
        if not isinstance(parts[0], (dict, list)):
            parts[:3] = [[part for part in parts[:3] if part is not None]]
        overlay, frame = self.overlay, "" if parts[1] is None else parts[1]
        made = self.access.trackers.add(
            point_of(parts[0]), frame, lambda: overlay.scale, self.runtime
        )
        self.runtime.keep(made)
        return spell_checked(self.runtime, made)

    @Slot(QtCore.QObject, str)
    def refuse(self, item: QtCore.QObject, message: str) -> None:
        """Log an error about an item, with the file that uses the item."""
        self._log_for(item, logging.ERROR, message)

    @Slot(QtCore.QObject, str)
    def warn(self, item: QtCore.QObject, message: str) -> None:
        """Log a warning about an item, with the file that uses the item."""
        self._log_for(item, logging.WARNING, message)

    def _log_for(self, item: QtCore.QObject, level: int, message: str) -> None:
        context = QtQml.QQmlEngine.contextForObject(item)
        file = "" if context is None else plain_path(context.baseUrl().toString())
        log_from_qml("", level, message, Caller(file or self.overlay.name, 0, ""))

    @Slot()
    def _on_arranged(self) -> None:
        if self.overlay.visible != self._visible:
            self._visible = self.overlay.visible
            self.visibleChanged.emit()
