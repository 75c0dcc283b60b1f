"""A QML file with its own engine, reloaded when the file changes."""

from __future__ import annotations

import ctypes
import logging
import os
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import Error, QmlError
from rosglass.qml.engine.language import translate_texts
from rosglass.qml.engine.log import forget_repeats, log_engine_warnings
from rosglass.qml.engine.watchdog import Watchdog
from rosglass.qml.run.load_errors import error_list
from rosglass.qml.run.modules import (
    IMPORT_PATHS,
    import_folder,
    install,
    interface_file,
    is_own_window,
    locate,
)
from rosglass.qml.run.renderer_choice import imported_modules
from rosglass.qt import QT6, QtCore, QtQml, Signal, address, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rosglass.qml.engine.session import Session


__all__ = [
    "ERRORS",
    "ERRORS_BELOW",
    "NO_NODE",
    "PANEL",
    "SCRIPT_ENDED",
    "ErrorView",
    "LiveFile",
    "Made",
    "Watcher",
    "create",
    "register_imports",
]

_LIBRARY = "libQt6Qml.so.6" if QT6 else "libQt5Qml.so.5"
#: QQmlComponent::completeCreate(), mangled by the Itanium C++ ABI.
_COMPLETE = "_ZN13QQmlComponent14completeCreateEv"


@cache
def _completion() -> Callable[[QtQml.QQmlComponent], object]:
    """Return a function for QQmlComponent::completeCreate(), without the GIL if possible."""
    try:
        # The library that the binding has already loaded.
        complete: Any = ctypes.CDLL(_LIBRARY)[_COMPLETE]
    except (OSError, AttributeError):
        return QtQml.QQmlComponent.completeCreate
    complete.restype = None
    return lambda component: complete(ctypes.c_void_p(address(component)))


def create(
    component: QtQml.QQmlComponent,
    context: QtQml.QQmlContext,
    begun: Callable[[QtCore.QObject], None] = lambda _: None,
) -> QtCore.QObject | None:
    """Create a component's object without the GIL; None if the component has errors.

    QQmlComponent.create holds the GIL while the first bindings and ``Component.onCompleted`` run,
    so that the watchdog could not end an endless one.

    Args:
        component: The component.
        context: The context of the object.
        begun: Called with the object before its first bindings run.
    """
    if component.isError():
        return None
    root = component.beginCreate(context)
    if root is None:
        return None
    begun(root)
    _completion()(component)
    if component.isError():
        root.deleteLater()
        return None
    return root


_log = logging.getLogger("rosglass.qml")
_SUFFIXES = (".qml", ".js", ".mjs")
#: Milliseconds without further changes after which saving is considered complete.
_DEBOUNCE = 80
#: Maximum number of files and folders to scan: one in a home folder must not block the interface.
_MOST = 2000


class Watcher(QtCore.QObject):
    """Watches every QML and JavaScript file under some folders.

    Args:
        folders: The folders; hidden subfolders are ignored.
    """

    #: Files were changed, created or deleted.
    changed = Signal()

    def __init__(self, *folders: Path) -> None:
        super().__init__()
        self._roots = folders
        self._watcher = QtCore.QFileSystemWatcher(self)
        self._pause = QtCore.QTimer(self)
        self._pause.setSingleShot(True)
        self._pause.setInterval(_DEBOUNCE)
        self._pause.timeout.connect(self._look)
        self._watcher.fileChanged.connect(self._soon)
        self._watcher.directoryChanged.connect(self._soon)
        self._full = False
        self._stamps = self._scan()

    def _soon(self, path: str) -> None:  # noqa: ARG002 - all folders are looked at
        self._pause.start()

    def _look(self) -> None:
        stamps = self._scan()
        if stamps != self._stamps:
            self._stamps = stamps
            self.changed.emit()

    def _scan(self) -> dict[str, tuple[int, int]]:
        """Return time and size of every file, and watch new files.

        Editors save by renaming, and the renamed file is not yet watched.
        """
        stamps = {path: stamp for root in self._roots for path, stamp in self._files(root)}
        folders = {os.path.dirname(path) for path in stamps}  # noqa: PTH120
        folders.update(map(str, self._roots))
        watched = {*self._watcher.files(), *self._watcher.directories()}
        missing = [path for path in (*stamps, *folders) if path not in watched]
        if missing:
            self._watcher.addPaths(missing)
        return stamps

    def _files(self, root: Path) -> Iterator[tuple[str, tuple[int, int]]]:
        left = _MOST
        for folder, folders, names in os.walk(root):
            folders[:] = sorted(f for f in folders if not f.startswith(".") and f != "__pycache__")
            left -= 1
            for name in names:
                if not name.endswith(_SUFFIXES) and name != "qmldir":
                    continue
                path = os.path.join(folder, name)  # noqa: PTH118 - QFileSystemWatcher speaks text
                try:
                    status = os.stat(path)  # noqa: PTH116
                except OSError:
                    continue
                left -= 1
                yield path, (status.st_mtime_ns, status.st_size)
            if left <= 0:
                if not self._full:
                    self._full = True
                    _log.warning("%s has too many files to watch them all", root)
                return


#: Module -> the package above this one that registers its types, once a file imports it.
_REGISTERED_BY = {
    "RosControls": "rosglass.controls.modules",
    "RosCockpit": "rosglass.cockpit.modules",
}
if QT6:
    _REGISTERED_BY["RosScene"] = "rosglass.scene.app.modules"


def register_imports(file: Path, engine: QtQml.QQmlEngine, text: str | None = None) -> None:
    """Register the types of those of our modules that a file, or one that it uses, imports.

    Args:
        file: The file.
        engine: The engine that loads it.
        text: The text of the file, for an editor; None for what is in it.
    """
    found = imported_modules(file, engine.importPathList(), text)
    for module in sorted(found & _REGISTERED_BY.keys()):
        import_module(_REGISTERED_BY[module]).register()
        _warn_of_hidden_files(file, module)


def _warn_of_hidden_files(file: Path, module: str) -> None:
    """Name the files beside a file whose types the types of an imported module hide."""
    folders = [path / module for path in IMPORT_PATHS]
    known = set(getattr(import_module(_REGISTERED_BY[module]), "TYPES", ()))
    known |= {found.stem for folder in folders for found in folder.glob("[A-Z]*.qml")}
    for own in sorted(file.parent.glob("[A-Z]*.qml")):
        if own.stem in known and own != file and file.parent not in folders:
            _log.warning(
                "%s is not used: import %s has a type of this name; rename the file", own, module
            )


#: The QML file of a closable item that is only as large as its text.
PANEL = Path(__file__).with_name("ErrorPanel.qml")
#: Headings of an ErrorView, for what is below it.
ERRORS = "This interface has errors. It is shown once they are fixed."
ERRORS_BELOW = "The interface below is the last one without errors."
NO_NODE = "This interface has no node: nothing is received or sent."
SCRIPT_ENDED = "The interface below continues, but a function of it was interrupted."


class ErrorView:
    """Shows errors, in one item per window.

    Args:
        live: The file with the errors.
        look: The QML file of the item, with properties ``heading`` and ``text``.
    """

    def __init__(self, live: LiveFile, look: Path) -> None:
        self._live, self._look = live, look
        self._component: QtQml.QQmlComponent | None = None
        #: The items, while there are errors.
        self.items: list[Any] = []
        self._contents: list[Any] = []

    def show(self, text: str, windows: Iterable[Any], heading: str) -> None:
        """Show errors, replacing earlier ones.

        Args:
            text: The errors.
            windows: The windows to show them in.
            heading: Their effect on the interface below.
        """
        self.hide()
        url = QtCore.QUrl.fromLocalFile(str(self._look))
        component = self._component = QtQml.QQmlComponent(self._live.engine, url)
        for window in windows:
            item: Any = component.create()
            item.setProperty("heading", heading)
            item.setProperty("text", text)
            # PySide2 treats an item as deleted once Python has no reference to its parent.
            content = window.contentItem()
            item.setParentItem(content)
            self.items.append(item)
            self._contents.append(content)

    def hide(self) -> None:
        """Hide the errors."""
        for item in (*self.items, self._component):
            if is_alive(item):
                item.deleteLater()
        self.items, self._contents, self._component = [], [], None


class Made(NamedTuple):
    """The objects created from a file."""

    root: QtCore.QObject
    #: Must live as long as the root: dropping it destroys the root.
    component: QtQml.QQmlComponent
    engine: QtQml.QQmlEngine


class LiveFile(QtCore.QObject):
    """A QML file, the interface created from it last, and its engine.

    Each interface has an engine of its own: when that is destroyed, no function runs any more that
    the file has connected to signals of objects that live on, as ``rviz`` or those of the program.

    Callers pass the result of :meth:`create` to :meth:`replace`, so that the current interface
    stays if the file has errors.

    Args:
        file: The file.
        session: The node that the QML uses.
        watch: Emit :attr:`due` when a file in its folder or in `import_paths` changes.
        import_paths: Further folders with QML modules.
        must_exist: Whether the file must exist; an editor's may not yet.

    Raises:
        QmlError: There is no such file or folder.
    """

    #: Reload now: the file has changed, or :meth:`is_ready`, False before, is True now.
    due = Signal()
    #: JavaScript that blocked the interface was ended: the text names it, with line and advice.
    script_ended = Signal(str)

    def __init__(
        self,
        file: str | os.PathLike[str],
        session: Session,
        *,
        watch: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        must_exist: bool = True,
    ) -> None:
        super().__init__()
        self.path = interface_file(file) if must_exist else locate(file)
        self._session = session
        self._folders = [import_folder(path) for path in import_paths]
        #: The objects created last; None before the first.
        self.made: Made | None = None
        self._deferred = False
        self._closed = self._used = False
        self._is_own = is_own_window(self.path)
        self._preparations: list[Callable[[QtQml.QQmlEngine], None]] = []
        #: The engine of the interface shown, or before the first, the one that it will have.
        self.engine = self._new_engine()
        session.call_ended.connect(self._go_on)
        self._watcher: Watcher | None = None
        # Before reading any file, so that no change is missed.
        self.watch = watch

    def prepare(self, job: Callable[[QtQml.QQmlEngine], None]) -> None:
        """Call a function with the engine, and with each later one before it loads the file.

        Raises:
            Error: The job cannot be called.
        """
        if not callable(job):
            raise Error(f"prepare: expected a function of the engine, got {job!r:.80}")
        self._preparations.append(job)
        job(self.engine)

    def _new_engine(self) -> QtQml.QQmlEngine:
        translate_texts()
        engine = QtQml.QQmlEngine()
        log_engine_warnings(engine)
        # The engine searches the last path first: our own modules are added last.
        for path in [*_environment_paths(), *map(str, reversed(self._folders))]:
            engine.addImportPath(path)
        install(engine, self._session, own_window=self._is_own)
        Watchdog.of(self._session).watch(engine, self.script_ended.emit)
        for job in self._preparations:
            job(engine)
        return engine

    def _drop_engine(self, engine: QtQml.QQmlEngine) -> None:
        if is_alive(engine):
            Watchdog.of(self._session).forget(engine)
            engine.deleteLater()

    @property
    def watch(self) -> bool:
        """True while the files are watched."""
        return self._watcher is not None

    @watch.setter
    def watch(self, watch: bool) -> None:
        if watch == self.watch or self._closed:
            return
        if self._watcher is not None:
            self._watcher.changed.disconnect(self.due)
            self._watcher = None
        else:
            self._watcher = Watcher(self.path.parent, *self._folders)
            self._watcher.changed.connect(self.due)

    def is_ready(self) -> bool:
        """Return whether the file may be reloaded now; if not, :attr:`due` is emitted later.

        Not while a call from QML waits: it would return into a destroyed interface.
        """
        self._deferred = bool(self._session.waiting_calls)
        return not self._deferred and not self._closed and is_alive(self.engine)

    def create(self, text: str | None = None) -> Made:
        """Create the interface from the current file; the previous one stays.

        Args:
            text: The text of the file, for an editor; None for what is in it.

        Raises:
            QmlError: The file has errors; the message lists them as ``file:line:column: text``.
        """
        if text is None and not os.path.isfile(self.path):  # noqa: PTH113 - pathlib's may raise
            raise QmlError(f"{self.path}: there is no such file")
        forget_repeats()
        if self.made is not None:
            self._session.reloading.emit()
        engine = self._new_engine() if self._used else self.engine
        self._used = True
        if not self._is_own:
            register_imports(self.path, engine, text)
        url = QtCore.QUrl.fromLocalFile(str(self.path))
        if text is None:
            component = QtQml.QQmlComponent(engine, url)
        else:
            component = QtQml.QQmlComponent(engine)
            component.setData(text.encode(), url)
        root = create(component, engine.rootContext())
        if root is None:
            errors = error_list(component.errors(), self.path, engine.importPathList())
            if engine is not self.engine:
                component.deleteLater()
                self._drop_engine(engine)
            raise QmlError(errors)
        return Made(root, component, engine)

    def replace(self, made: Made, show: Callable[[], None]) -> None:
        """Replace the previous interface by a new one and destroy the previous one.

        Args:
            made: The result of :meth:`create`.
            show: Shows it; called before the previous interface is destroyed.
        """
        before, self.made = self.made, made
        unused, self.engine = self.engine, made.engine
        if before is None and unused is not made.engine:
            self._drop_engine(unused)
        self._session.holding += 1
        try:
            show()
            if before is not None:
                self.drop(before)
        finally:
            self._session.holding -= 1

    def drop(self, made: Made) -> None:
        """Destroy an interface; its clean-up must not shut down its successor's node."""
        root, component, engine = made
        if not is_alive(root):
            self._dropped(component, engine)
            return
        self._session.holding += 1

        def gone() -> None:
            self._session.holding -= 1

        def dropped() -> None:
            if engine is self.engine or not is_alive(engine):
                gone()
            else:
                # Until then, singletons of the file may shut the node down.
                engine.destroyed.connect(lambda *_: gone())
            self._dropped(component, engine)

        # After access to a signal of an object from QML, PySide2 would keep its half of it forever.
        end = QtCore.QObject(root)
        # Component.onDestruction runs shortly after this signal.
        end.destroyed.connect(lambda: QtCore.QTimer.singleShot(0, dropped))
        root.deleteLater()

    def close(self, *, hold: bool = False) -> None:
        """Close everything; safe to call twice.

        Args:
            hold: Keep the node, which others need, even if QML shuts it down at its end.
        """
        if self._closed:
            return
        self.watch = False
        self._closed = True
        self._session.call_ended.disconnect(self._go_on)
        made, self.made = self.made, None
        if made is not None and hold:
            self.drop(made)
        for item in made[:2] if made is not None else ():
            if is_alive(item):
                item.deleteLater()
        self._drop_engine(self.engine)

    def _go_on(self) -> None:
        # The call that has ended must still return into QML.
        if self._deferred:
            self._deferred = False
            QtCore.QTimer.singleShot(0, self._emit_due)

    def _emit_due(self) -> None:
        if not self._closed:
            self.due.emit()

    def _dropped(self, component: QtQml.QQmlComponent, engine: QtQml.QQmlEngine) -> None:
        if is_alive(component):
            component.deleteLater()
        if engine is not self.engine:
            self._drop_engine(engine)


def _environment_paths() -> list[str]:
    """Return the paths in QML_IMPORT_PATH, which Qt 5 does not read, the first path last."""
    paths = [] if QT6 else os.environ.get("QML_IMPORT_PATH", "").split(os.pathsep)
    return [path for path in reversed(paths) if path]
