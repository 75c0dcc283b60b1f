"""The object ``rviz`` that QML over RViz finds, one for each overlay."""
# ruff: noqa: N802 N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

import logging
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.log import Caller, log_from_qml, plain_path
from rosglass.qml.runtime import runtime_of
from rosglass.qt import Property, QJSValue, QtCore, QtQml, Signal, Slot
from rosglass.rviz.access import Access
from rosglass.rviz.displays_access import Status
from rosglass.rviz.face import VARIANT, given, place, spelled, switch_of, taking, text_of
from rosglass.rviz.property_values import shown
from rosglass.rviz.qml_displays import QmlDisplays, path_of
from rosglass.rviz.qml_tools import PROVIDER, QmlToolManager, ToolIcons
from rosglass.rviz.qml_view import QmlView
from rosglass.rviz.registered_properties import RegisteredProperties
from rosglass.rviz.window import config_file

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.overlay import Overlay

__all__ = ["RvizObject"]

_log = logging.getLogger("rosglass.rviz")
_LIST: Any = "QVariantList"
_PATH = "Grid/Color"


class RvizObject(RegisteredProperties):
    """RViz, as the QML of one overlay sees it; see "The rviz object" in ``docs/rviz.md``.

    Args:
        overlay: The overlay.
        engine: Its engine, which has a session.
    """

    #: What errors call it.
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
    #: A config file was loaded: every display, view and tool is another one now.
    configLoaded = Signal(str, arguments=["file"])

    def __init__(self, overlay: Overlay, engine: QtQml.QQmlEngine) -> None:
        super().__init__()
        runtime = self.runtime = runtime_of(engine)
        assert runtime is not None
        self._engine = engine
        self._overlay = overlay
        self._visible = overlay.visible
        self._leaving: list[Callable[[], Any]] = []
        #: Held: the engine owns it, and Python would let its half go.
        self._icons: ToolIcons | None = None
        QtQml.QQmlEngine.setObjectOwnership(self, QtQml.QQmlEngine.ObjectOwnership.CppOwnership)
        # QML may look at it for as long as there is an engine.
        held = [self, spelled(runtime, self)]
        engine.destroyed.connect(lambda *_: held.clear())
        self._follow(overlay.arranged, self._on_arranged)
        access = runtime.session.shared.get(Access)
        if access is not None:
            self._follow(access.window.fullscreen_changed, self._on_fullscreen)
            self._follow(access.window.bare.changed, self._on_bare)
            self._follow(access.window.config_loaded, self._on_config_loaded)
            self._follow(access.fixed_frame_changed, self._on_fixed_frame)
            self._follow(access.frame_rate_changed, self._on_frame_rate)

    def _follow(self, signal: Any, slot: Any) -> None:
        signal.connect(slot)
        self._leaving.append(lambda: signal.disconnect(slot))

    def close(self) -> None:
        """Follow RViz no longer; safe to call twice."""
        leaving, self._leaving = self._leaving, []
        for leave in leaving:
            leave()
        access = self.__dict__.get("_access")
        if access is not None and self.runtime is not None:
            # Without an event loop of its own, a program may keep the engine for long.
            access.trackers.let_go(self.runtime)

    @cached_property
    def _access(self) -> Access:
        assert self.runtime is not None
        found: Access | None = self.runtime.session.shared.get(Access)
        if found is None:
            raise Error("there is no RViz: the overlay's session is not that of an Application")
        return found

    @cached_property
    def _tool_face(self) -> QmlToolManager:
        assert self.runtime is not None
        self._icons = ToolIcons(self._access.tools)
        self._engine.addImageProvider(PROVIDER, self._icons)
        return QmlToolManager(self._access.tools, self.runtime, self._engine)

    @cached_property
    def _display_faces(self) -> QmlDisplays:
        assert self.runtime is not None
        faces = QmlDisplays(self._access.displays, self.runtime, self._engine)
        faces.changed.connect(self.displaysChanged)
        faces.added.connect(self.displayAdded)
        faces.removed.connect(self.displayRemoved)
        faces.statusChanged.connect(self.statusChanged)
        return faces

    @cached_property
    def _view_face(self) -> QmlView:
        assert self.runtime is not None
        return QmlView(self._access, self.runtime, self._engine)

    def _asked(self, what: str, work: Callable[[], Any], otherwise: Any = None) -> Any:
        """Return what RViz answers; an error is thrown into the JavaScript that is running."""
        try:
            return work()
        except Error as error:
            self.throw(f"rviz.{what}: {error}")
            return otherwise

    def throw(self, text: str) -> None:
        """Throw an error into the JavaScript that is running."""
        if self.runtime is not None:
            self.runtime.throw(text)

    def _js(self, item: QtCore.QObject | None) -> QJSValue:
        if item is None or self.runtime is None or self.runtime.engine is None:
            return QJSValue(QJSValue.SpecialValue.NullValue)
        return self.runtime.engine.newQObject(item)

    def _value(self, value: Any) -> QJSValue:
        return QJSValue() if self.runtime is None else self.runtime.value(value)

    # The overlay and the window.

    def _set_fullscreen(self, fullscreen: Any) -> None:
        def work() -> None:
            self._access.window.fullscreen = switch_of(fullscreen)

        self._asked("isFullscreen", work)

    def _set_bare(self, bare: Any) -> None:
        def work() -> None:
            self._access.window.bare.on = switch_of(bare)

        self._asked("isBare", work)

    def _set_fixed_frame(self, frame: Any) -> None:
        def work() -> None:
            wanted = "the name of a frame, e.g. 'map'"
            name = text_of(frame, wanted)
            if not name:
                raise Error(f"expected {wanted}, got {shown(name)}")
            self._access.fixed_frame = name

        self._asked("fixedFrame", work)

    #: Whether this overlay is shown.
    visible = Property(bool, lambda self: self._overlay.visible, notify=visibleChanged)
    isFullscreen = Property(
        VARIANT,
        lambda self: self._asked("isFullscreen", lambda: self._access.window.fullscreen, False),
        _set_fullscreen,
        notify=isFullscreenChanged,
    )
    #: Whether RViz's window has nothing but the 3D view in it.
    isBare = Property(
        VARIANT,
        lambda self: self._asked("isBare", lambda: self._access.window.bare.on, False),
        _set_bare,
        notify=isBareChanged,
    )
    fixedFrame = Property(
        VARIANT,
        lambda self: self._asked("fixedFrame", lambda: self._access.fixed_frame, ""),
        _set_fixed_frame,
        notify=fixedFrameChanged,
    )
    #: Frames that RViz has drawn in the last second.
    frameRate = Property(
        float,
        lambda self: self._asked("frameRate", lambda: self._access.frame_rate, 0.0),
        notify=frameRateChanged,
    )
    #: How RViz is: ``ok``, ``warn`` or ``error``.
    status = Property(str, lambda self: self._get_status("status").level, notify=statusChanged)
    #: What RViz says about itself, one line for each.
    statusText = Property(
        str, lambda self: self._get_status("statusText").text, notify=statusChanged
    )

    def _get_status(self, what: str) -> Any:
        return self._asked(
            what, lambda: self._display_faces.displays.status, Status("error", "there is no RViz")
        )

    @taking(1, 2, None)
    def screenshot(self, file: QJSValue, window: QJSValue | None = None) -> None:
        """Save a picture of the 3D view with its overlays; of the whole window if `window`."""

        def work() -> None:
            whole = given(window)
            if whole is not None and not isinstance(whole, bool):
                raise Error(f"window: expected true or false, got {shown(whole)}")
            path = _file(given(file), "to save to")
            self._access.picker.screenshot(path, window=whole is True)

        self._asked("screenshot", work)

    @taking(1, 1, None)
    def loadConfig(self, file: QJSValue) -> None:
        """Load a ``.rviz`` file, once the function that calls this has returned.

        What has changed since the last one was saved is lost, and so may be this overlay.
        """

        def work() -> None:
            window, path = self._access.window, config_file(_file(given(file)))

            def load() -> None:
                try:
                    self._access.displays.settle_panel()
                    window.load_config(path)
                except Error as error:
                    _log.error("rviz.loadConfig: %s", error)

            QtCore.QTimer.singleShot(0, load)

        self._asked("loadConfig", work)

    @taking(0, 1, None)
    def saveConfig(self, file: QJSValue | None = None) -> None:
        """Save RViz's config; without a file, where it was loaded from."""

        def work() -> None:
            wanted, window = given(file), self._access.window
            if wanted is None and not window.config:
                raise Error("no config file is loaded; say where to save it")
            window.save_config("" if wanted is None else _file(wanted, "to save to"))

        self._asked("saveConfig", work)

    # Tools, camera, displays.

    toolManager = Property(
        QtCore.QObject,
        lambda self: self._asked("toolManager", lambda: self._tool_face),
        constant=True,
    )
    view = Property(
        QtCore.QObject, lambda self: self._asked("view", lambda: self._view_face), constant=True
    )
    #: All displays, those in groups included, in the order of the panel.
    displays = Property(
        _LIST,
        lambda self: self._all_displays(),
        notify=displaysChanged,
    )
    #: Ids of the classes of which displays can be added.
    displayClasses = Property(
        _LIST,
        lambda self: self._asked("displayClasses", lambda: self._access.displays.classes, []),
        constant=True,
    )

    def _all_displays(self) -> list[Any]:
        found: list[Any] = self._asked("displays", lambda: [*self._display_faces.all()], [])
        return found

    @taking(1, 1)
    def display(self, name: QJSValue) -> QJSValue:
        """Return the first display of a name; null where there is none."""

        def work() -> QJSValue:
            faces = self._display_faces
            wanted = text_of(name, "the name of a display, e.g. 'Grid'")
            found = faces.displays.find(wanted)
            return self._js(None if found is None else faces.face(found))

        return self._answer("display", work)

    @taking(1, 3)
    def addDisplay(
        self,
        class_id: QJSValue,
        name: QJSValue | None = None,
        enabled: QJSValue | None = None,
    ) -> QJSValue:
        """Add a display of a class, and return it."""

        def work() -> QJSValue:
            wanted, title, on = given(class_id), given(name), given(enabled)
            if on is not None and not isinstance(on, bool):
                raise Error(f"enabled: expected true or false, got {shown(on)}")
            if title is not None and not isinstance(title, str):
                raise Error(f"name: expected a text, got {shown(title)}")
            faces = self._display_faces
            made = faces.displays.add(wanted, title or "", enabled=on is not False)
            return self._js(faces.face(made))

        return self._answer("addDisplay", work)

    @taking(1, 1, None)
    def removeDisplay(self, display: QJSValue) -> None:
        """Remove a display; takes a display or its name."""

        def work() -> None:
            faces = self._display_faces
            faces.displays.remove(faces.wanted(given(display)))

        self._asked("removeDisplay", work)

    @taking(1, 1)
    def getProperty(self, path: QJSValue) -> QJSValue:
        """Return the value of any property, e.g. of ``Global Options/Background Color``."""
        displays = self._access.displays
        return self._answer("getProperty", lambda: self._value(displays.get(path_of(path, _PATH))))

    @taking(2, 2, None)
    def setProperty(self, path: QJSValue, value: QJSValue) -> None:
        """Change any property, as if it were done in the panel."""
        displays = self._access.displays
        self._asked("setProperty", lambda: displays.set(path_of(path, _PATH), given(value)))

    # Points.

    @taking(1, 3)
    def pick(
        self, x: QJSValue, y: QJSValue | None = None, radius: QJSValue | None = None
    ) -> QJSValue:
        """Return the point of the fixed frame that is seen at a place; null where there is none.

        Args:
            x: Units of the overlay; or a point with x and y.
            y: The same.
            radius: How far around to look, in the same units.
        """

        def work() -> QJSValue:
            at, scale = [given(part) for part in (x, y, radius)], self._overlay.scale
            if isinstance(at[0], dict) and {"x", "y"} <= set(at[0]):
                at = [at[0]["x"], at[0]["y"], at[1]]
            at[2] = 0.0 if at[2] is None else at[2]
            for name, number in zip(("x", "y", "radius"), at, strict=True):
                if isinstance(number, bool) or not isinstance(number, (int, float)):
                    wanted = "expected a number, in units of the overlay"
                    raise Error(f"{name}: {wanted}, got {shown(number)}")
            found = self._access.picker.pick(*(number * scale for number in at))
            if found is None:
                return self._js(None)
            return self._value(dict(zip("xyz", found, strict=True)))

        return self._answer("pick", work)

    @taking(1, 4)
    def createPositionTracker(
        self,
        x: QJSValue,
        y: QJSValue | None = None,
        z: QJSValue | None = None,
        frame: QJSValue | None = None,
    ) -> QJSValue:
        """Return an object that tells where on the overlay a point is seen.

        Args:
            x: Metres; or a point with x, y and z.
            y: Metres; or the frame.
            z: Metres.
            frame: What the point moves with; the fixed frame by default.
        """

        def work() -> QJSValue:
            parts = [given(part) for part in (x, y, z, frame)]
            if isinstance(parts[0], (dict, list)):
                point, whose = place(parts[0]), parts[1]
            else:
                point, whose = place([part for part in parts[:3] if part is not None]), parts[3]
            return self._track(point, "" if whose is None else whose)

        return self._answer("createPositionTracker", work)

    def _track(self, point: tuple[float, float, float], frame: str) -> QJSValue:
        overlay, runtime = self._overlay, self.runtime
        trackers = self._access.trackers
        made = trackers.add(point, frame, lambda: overlay.scale, runtime)
        assert runtime is not None
        runtime.keep(made)
        return spelled(runtime, made)

    def _answer(self, what: str, work: Callable[[], QJSValue]) -> QJSValue:
        answer: QJSValue = self._asked(what, work, QJSValue())
        return answer

    @Slot(QtCore.QObject, str)
    def refuse(self, item: QtCore.QObject, message: str) -> None:
        """Log what is wrong with an item, with the file that it is used in, not its own."""
        self._log_for(item, logging.ERROR, message)

    @Slot(QtCore.QObject, str)
    def warn(self, item: QtCore.QObject, message: str) -> None:
        """Log what has become of an item, with the file that it is used in."""
        self._log_for(item, logging.WARNING, message)

    def _log_for(self, item: QtCore.QObject, level: int, message: str) -> None:
        context = QtQml.QQmlEngine.contextForObject(item)
        file = "" if context is None else plain_path(context.baseUrl().toString())
        log_from_qml("", level, message, Caller(file or self._overlay.name, 0, ""))

    # Signals of RViz.

    @Slot()
    def _on_arranged(self) -> None:
        if self._overlay.visible != self._visible:
            self._visible = self._overlay.visible
            self.visibleChanged.emit()

    @Slot(bool)
    def _on_fullscreen(self, fullscreen: bool) -> None:
        del fullscreen
        # RViz tells it before it does it.
        QtCore.QTimer.singleShot(0, self._tell_fullscreen)

    @Slot()
    def _tell_fullscreen(self) -> None:
        self.isFullscreenChanged.emit()

    @Slot()
    def _on_bare(self) -> None:
        self.isBareChanged.emit()

    @Slot(str)
    def _on_config_loaded(self, file: str) -> None:
        self.configLoaded.emit(file)

    @Slot()
    def _on_fixed_frame(self) -> None:
        self.fixedFrameChanged.emit()

    @Slot()
    def _on_frame_rate(self) -> None:
        self.frameRateChanged.emit()


def _file(value: Any, use: str = "") -> str:
    """Return a file that QML names by a path or a ``file:`` address.

    Args:
        value: What was given.
        use: What it is for, where ``package://`` will not do.

    Raises:
        Error: It is neither.
    """
    if isinstance(value, str) and value and "\0" not in value and len(value) <= 4096:
        address = QtCore.QUrl(value)
        if address.isLocalFile():
            return address.toLocalFile()
        if "://" not in value or (not use and value.startswith("package://")):
            return value
    raise Error(f"expected the path of a file{f' {use}' if use else ''}, got {shown(value)}")
