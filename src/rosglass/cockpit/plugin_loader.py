"""The element ``PluginLoader``: loads a plugin of RQml, and shows it as large as itself."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.cockpit.plugin_context import PluginContext
from rosglass.cockpit.rqml import find_plugins
from rosglass.cockpit.rqml_api import RqmlApi
from rosglass.errors import Error, QmlError
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.log import context_of, plain_path
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.runtime import Runtime, runtime_of
from rosglass.qml.engine.watchdog import Watchdog
from rosglass.qml.run.live_file import create, register_imports
from rosglass.qml.run.load_errors import error_list
from rosglass.qml.run.modules import interface_file
from rosglass.qml.run.renderer_choice import imported_modules
from rosglass.qt import QT6, QJSValue, QtCore, QtQml, QtQuick, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["PluginLoader"]

#: RQml's own QML modules, for where RQml is not installed: searched after all other folders.
_MODULES = Path(__file__).parent / "rqml_modules"
#: The item around plugins that import the Material style, and the name of that module.
_LOOK, _MATERIAL = Path(__file__).parent / "rqml_look/MaterialLook.qml", "QtQuick.Controls.Material"
#: Milliseconds: a plugin asks for nodes, topics and services once, when it is loaded. So it is
#: loaded when others are in the graph and it has not changed for a while, or at last after a
#: longer one; nodes on Fast DDS are known up to four seconds after their program.
_QUIET_MS, _MAX_WAIT_MS, _MAX_UNNAMED_MS = 400, 3000, 6000
#: Milliseconds in which a plugin's changes of its context are collected.
_COLLECT_MS = 300
#: Errors kept of a running plugin.
_MAX_COMPLAINTS = 20
_CONTROLS = QtCore.QByteArray(b"import QtQml\nimport QtQuick.Controls\nQtObject {}")
#: The arrays of qml6_ros2_plugin have `at` also when a ListModel has copied them; Qt's have not.
_ARRAY_AT = """if (typeof [].at !== "function")
    Object.defineProperty(Array.prototype, "at", {
        value: function (index) { return this[index < 0 ? this.length + index : index] },
        enumerable: false
    })"""
#: A name that RQml's Joint Trajectory Controller uses; numbers as in `ActionGoalStatus`.
_RESULT_CODES = {"UNKNOWN": 0, "SUCCEEDED": 4, "CANCELED": 5, "ABORTED": 6}
_MISSING = re.compile(r'module "([\w.]+)" (?:plugin|is not installed|version)')
_QT5 = (
    "plugins of RQml need Qt 6 (PySide6), and this program runs Qt 5: show the layout with "
    "rosglass from PyPI, outside of RViz"
)
#: Numbers for the names of plugins that have none.
_numbers = itertools.count(1)


class PluginLoader(QtQuick.QQuickItem):
    """Loads a plugin of RQml into a context of its own; the part of ``Plugin`` written in Python.

    A plugin that cannot be loaded, that throws or that blocks the interface leaves the others
    alone: :attr:`problem` and :attr:`complaint` say what is wrong with it.
    """

    #: The plugin has written to its context; see :meth:`contextText`.
    contextEdited = Signal()

    #: Path, or ``package://PACKAGE/...``, or the id of a plugin that is found.
    source = Writable(str, "", then="_restart")
    #: The values of `context`, a JavaScript object.
    values = Writable(QJSValue, then="_on_values")
    #: The name that the plugin gets as ``uniqueName``; empty for one that is made.
    name = Writable(str, "", then="")
    #: Colours for the plugin's palette, by role: ``window``, ``base``, ``text`` ...
    colors = Writable(QJSValue, then="_on_colors")

    #: ``empty``, ``waiting`` (for the robot), ``ready``, ``failed`` or ``stopped``.
    status = ReadOnly(str, "empty")
    #: Why the plugin is not shown; empty if it is.
    problem = ReadOnly(str, "")
    #: Text of the running plugin's last error, and the number of errors since it was loaded.
    complaint = ReadOnly(str, "")
    complaints = ReadOnly(int, 0)
    #: The least size that the plugin asks for, in pixels; 0 if it does not.
    leastWidth = ReadOnly(float, 0.0)
    leastHeight = ReadOnly(float, 0.0)
    #: The file that is shown; empty before.
    file = ReadOnly(str, "")

    _values: Any

    def __init__(self, parent: QtQuick.QQuickItem | None = None) -> None:
        super().__init__(parent)
        self._root: Any = None
        self._look: QtQuick.QQuickItem | None = None
        self._component: QtQml.QQmlComponent | None = None
        self._context: QtQml.QQmlContext | None = None
        self._map: PluginContext | None = None
        self._engine: QtQml.QQmlEngine | None = None
        self._runtime: Runtime | None = None
        self._folder = ""
        self._is_complete = False
        self._started = QtCore.QElapsedTimer()
        self._pause = single_shot(self, self._on_pause)
        self._collecting = single_shot(self, self._announce_context)
        self.widthChanged.connect(self._fit)
        self.heightChanged.connect(self._fit)
        self.windowChanged.connect(self._on_window)
        state = self.__dict__
        self._detach: Any = None

        def gone() -> None:
            detach = state.get("_detach")
            if detach is not None:
                detach()
            # PySide 6.11 never frees the Python half of an object created by QML.
            state.update(
                _root=None, _look=None, _component=None, _context=None, _map=None, _engine=None
            )
            state.update(_runtime=None, _detach=None, _values=None, _colors=None)

        self.destroyed.connect(gone)

    # From QML.

    @Slot(result=str)
    def contextText(self) -> str:
        """Return the context as text for QML, such as ``({ topic: "/scan" })``.

        It also has the changes inside objects that the context holds, which are not announced.
        """
        if self._map is None:
            return ""
        try:
            text, left = self._map.text()
        except Error as error:
            self._complain(f"what the plugin keeps is not saved: {error}")
            return ""
        if left:
            self._complain(f"functions and items are not saved: context.{', context.'.join(left)}")
        return text

    @Slot()
    def reload(self) -> None:
        """Load the plugin again, from its current file; its context stays."""
        text = self.contextText()
        if self._engine is not None and is_alive(self._engine):
            self._unload()
            self._engine.clearComponentCache()
            if text:
                self._values = self._engine.evaluate(text)
        self._restart()

    @Slot()
    def forgive(self) -> None:
        """Forget the errors of the running plugin."""
        report(self, complaint="", complaints=0)

    def componentComplete(self) -> None:
        """Begin; Qt calls this when all properties are set."""
        super().componentComplete()
        self._is_complete = True
        self._runtime = runtime_of(self)
        if self._runtime is None or self._runtime.engine is None:
            return
        self._engine = self._runtime.engine
        if not QT6:
            self._restart()
            return
        self._on_colors()
        session = self._runtime.session
        self._detach = session.attach(
            self,
            node_changed=self._wait,
            connection_changed=self._wait,
            graph_changed=self._wait,
        )
        self._engine.warnings.connect(self._on_warnings)
        Watchdog.of(session).script_ended.connect(self._on_script_ended)
        self._restart()

    # Waiting for the robot.

    def _restart(self) -> None:
        if not self._is_complete:
            return
        self._unload()
        self._pause.stop()
        if not self.source:
            report(self, status="empty", problem="", file="")
        elif not QT6:
            report(self, status="failed", problem=_QT5)
        else:
            report(self, status="waiting", problem="")
            self._started.start()
            self._wait()

    @Slot()
    def _wait(self, *_: Any) -> None:
        """Load the plugin once the graph has settled, or if there is no robot."""
        if self.status != "waiting" or self._runtime is None or not is_alive(self):
            return
        session, elapsed = self._runtime.session, self._started.elapsed()
        left, node = _MAX_WAIT_MS - elapsed, session.node
        if session.state == "failed":
            left = 0
        elif node is not None and session.state == "connected":
            if node.unnamed_programs():
                left = _MAX_UNNAMED_MS - elapsed
            elif len(node.nodes()) > 1:
                left = min(left, _QUIET_MS)
        self._pause.start(max(0, left))

    @Slot()
    def _on_pause(self, *_: Any) -> None:
        if self.status == "waiting" and is_alive(self):
            self._load()

    # Loading.

    def _load(self) -> None:
        engine = self._engine
        if engine is None or not is_alive(engine):
            return
        outer = self._layout_context()
        try:
            file = self._find(outer)
        except Error as error:
            self._fail(str(error))
            return
        _prepare(engine)
        api = RqmlApi.of(engine)
        if outer is not None and outer.baseUrl().isLocalFile():
            api.allow(Path(outer.baseUrl().toLocalFile()).parent, writable=True)
        api.allow(file.parent, writable=False)
        self._folder = f"{file.parent}{os.sep}"
        report(self, file=str(file), complaint="", complaints=0)
        register_imports(file, engine)
        if self._map is None:
            self._map = PluginContext(engine, self)
            self._map.written.connect(self._on_written)
        self._write_values()
        context = self._context = QtQml.QQmlContext(engine.rootContext(), self)
        context.setContextProperty("context", self._map.map)
        context.setContextProperty("uniqueName", self.name or f"{file.stem}_{next(_numbers)}")
        context.setContextProperty("RQml", api)
        context.setContextProperty("ActionResultCode", _RESULT_CODES)
        self._make_look(engine, file)
        component = self._component = QtQml.QQmlComponent(
            engine, QtCore.QUrl.fromLocalFile(str(file)), self
        )
        root = create(component, context, self._place)
        if root is None or not is_alive(root):
            self._fail(_explained(error_list(component.errors(), file, engine.importPathList())))
            return
        if not isinstance(root, QtQuick.QQuickItem):
            self._fail(f"{file}: its root is not an Item, so that it cannot be shown on a panel")
            return
        api.add(root)
        size: Any = root.property("kddockwidgets_min_size")
        if not isinstance(size, (QtCore.QSize, QtCore.QSizeF)):
            size = QtCore.QSizeF()
        report(
            self,
            status="ready",
            problem="",
            leastWidth=max(0.0, float(size.width())),
            leastHeight=max(0.0, float(size.height())),
        )
        self._fit()

    def _place(self, root: QtCore.QObject) -> None:
        """Make the root a child before its first bindings run, which may use its parent."""
        self._root = root
        root.setParent(self)
        if isinstance(root, QtQuick.QQuickItem):
            root.setParentItem(self._look or self)
            self._fit()

    def _make_look(self, engine: QtQml.QQmlEngine, file: Path) -> None:
        """Make the item around a plugin that imports the Material style, which has no palette."""
        if _MATERIAL not in imported_modules(file, engine.importPathList()):
            return
        component = QtQml.QQmlComponent(engine, QtCore.QUrl.fromLocalFile(str(_LOOK)), self)
        made = component.create()
        if isinstance(made, QtQuick.QQuickItem):
            made.setParent(self)
            made.setParentItem(self)
            self._look = made
            self._on_colors()

    def _find(self, outer: QtQml.QQmlContext | None) -> Path:
        """Return the plugin's file.

        Raises:
            QmlError: There is no such file or plugin.
        """
        source = self.source
        if "/" not in source and os.sep not in source and not source.endswith(".qml"):
            folders = RqmlApi.of(self._engine).folders if self._engine is not None else []
            found = find_plugins(os.environ, folders)
            plugin = next((one for one in found.plugins if one.id == source), None)
            if plugin is None:
                known = ", ".join(one.id for one in found.plugins) or "none"
                raise QmlError(
                    f"{source}: there is no plugin of RQml with this id; found are: {known}. "
                    "Packages are searched in AMENT_PREFIX_PATH, and in folders given by --panels"
                )
            return plugin.path
        url = QtCore.QUrl(source)
        if url.isLocalFile():
            source = url.toLocalFile()
        if not source.startswith("package://") and outer is not None:
            base = outer.baseUrl()
            if base.isLocalFile():
                source = os.path.join(os.path.dirname(base.toLocalFile()), source)  # noqa: PTH118, PTH120 - keeps absolute paths
        return interface_file(source)

    def _layout_context(self) -> QtQml.QQmlContext | None:
        """Return the context of the layout that has the plugin."""
        own = context_of(self)
        return None if own is None else own.parentContext()

    def _fail(self, problem: str) -> None:
        self._unload()
        report(self, status="failed", problem=problem)

    def _unload(self) -> None:
        root, component, context = self._root, self._component, self._context
        look, self._look = self._look, None
        self._root = self._component = self._context = None
        if is_alive(root):
            if isinstance(root, QtQuick.QQuickItem):
                root.setVisible(False)
                root.setParentItem(None)  # type: ignore[arg-type]
            for item in (component, context):
                if item is not None and is_alive(item):
                    item.setParent(root)
            root.deleteLater()
        else:
            for item in (component, context):
                if item is not None and is_alive(item):
                    item.deleteLater()
        if look is not None and is_alive(look):
            look.deleteLater()
        report(self, leastWidth=0.0, leastHeight=0.0)

    @Slot()
    def _fit(self) -> None:
        for item in (self._look, self._root):
            if is_alive(item) and isinstance(item, QtQuick.QQuickItem):
                item.setSize(QtCore.QSizeF(self.width(), self.height()))

    # Its context.

    def _on_values(self) -> None:
        if self._map is not None and self._text_of(self._values) != self._map.text()[0]:
            self._write_values()

    def _text_of(self, values: QJSValue) -> str:
        assert self._engine is not None
        other = PluginContext(self._engine, self)
        try:
            other.write(values)
            return other.text()[0]
        except Error:
            return ""
        finally:
            other.deleteLater()

    def _write_values(self) -> None:
        if self._map is None:
            return
        try:
            refused = self._map.write(self._values or QJSValue())
        except Error as error:
            self._complain(str(error))
            return
        if refused:
            self._complain(f"context: these names belong to the map itself: {', '.join(refused)}")

    @Slot()
    def _on_written(self) -> None:
        if not self._collecting.isActive():
            self._collecting.start(_COLLECT_MS)

    @Slot()
    def _announce_context(self, *_: Any) -> None:
        if is_alive(self):
            self.contextEdited.emit()

    # Its colours.

    def _on_colors(self) -> None:
        engine, colors = self._engine, self.colors.toVariant()
        if not QT6 or engine is None or not isinstance(colors, dict):
            return
        # Popups, such as menus and dialogs, have the colours of the window.
        for item in (self, self.window()):
            for role, color in colors.items() if item is not None else ():
                place: Any = QtQml.QQmlProperty(item, f"palette.{role}", engine)
                place.write(color)
        if self._look is not None and is_alive(self._look):
            self._look.setProperty("colors", self.colors)

    @Slot()
    def _on_window(self) -> None:
        if is_alive(self) and self._is_complete:
            self._on_colors()

    # Its errors.

    @Slot("QList<QQmlError>")
    def _on_warnings(self, warnings: Sequence[QtQml.QQmlError]) -> None:
        if not is_alive(self) or self._root is None:
            return
        for warning in warnings:
            place = plain_path(warning.url().toString())
            # Qt's remarks, such as on loops of bindings, are in the log.
            if "Error:" in warning.description() and self._is_ours(warning, place):
                self._complain(f"{place}:{max(warning.line(), 0)}: {warning.description()}")

    def _is_ours(self, warning: QtQml.QQmlError, place: str) -> bool:
        """Return whether an error is of this plugin, and not of another one from its folder."""
        item, mine = warning.object(), self._context
        context = context_of(item) if item is not None and is_alive(item) else None
        if context is None:
            # Only the plugins of a folder use what is in its subfolders, but any of them may.
            inside = place.startswith(self._folder) and os.sep in place[len(self._folder) :]
            return bool(place == self.file or inside)
        while context is not None and mine is not None and context.isValid():
            if context == mine:
                return True
            context = context.parentContext()
        return False

    def _complain(self, text: str) -> None:
        report(self, complaint=text, complaints=min(self.complaints + 1, _MAX_COMPLAINTS))

    @Slot(QtCore.QObject, str)
    def _on_script_ended(self, engine: QtCore.QObject, text: str) -> None:
        if not is_alive(self) or engine is not self._engine or not self._folder:
            return
        if self._folder in text and self.status == "ready":
            self._stop(text)

    def _stop(self, text: str) -> None:
        """Unload a plugin that has blocked the interface; not while a call from QML waits."""
        if not is_alive(self) or self._runtime is None:
            return
        if self._runtime.session.waiting_calls:
            QtCore.QTimer.singleShot(_COLLECT_MS, lambda: self._stop(text))
            return
        self._unload()
        report(self, status="stopped", problem=text)

    def _refuse(self, text: str) -> None:
        self._complain(text)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return "Plugin"


def _prepare(engine: QtQml.QQmlEngine) -> None:
    """Prepare an engine for plugins; only the first call has an effect."""
    paths, ours = list(engine.importPathList()), str(_MODULES)
    if ours in paths:
        return
    engine.setImportPathList([*paths, ours])
    # The style that is imported first becomes that of all controls in the program.
    first = QtQml.QQmlComponent(engine)
    first.setData(_CONTROLS, QtCore.QUrl())
    made = first.create()
    for item in (made, first):
        if item is not None:
            item.deleteLater()
    engine.evaluate(_ARRAY_AT)


def _explained(errors: str) -> str:
    """Add to errors how a plugin gets the module that it lacks."""
    found = _MISSING.search(errors)
    if found is None or found[1].startswith(("Qt", "Ros")):
        return errors
    return (
        f"{errors}\nThe plugin needs the compiled QML module {found[1]}, which its ROS package "
        "builds: source the workspace that has it, or name the folder with it by -I FOLDER"
    )
