"""A QML file in an engine of its own, which is made anew when it changes."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import QmlError
from rosglass.qml.creation import create
from rosglass.qml.load_errors import error_list
from rosglass.qml.log import forget_repeats, log_engine_warnings
from rosglass.qml.modules import install
from rosglass.qml.places import import_folder, interface_file
from rosglass.qml.runtime import runtime_of
from rosglass.qml.watchdog import Watchdog
from rosglass.qml.watcher import Watcher
from rosglass.qt import QT6, QtCore, QtQml, Signal, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.qml.session import Session

__all__ = ["LiveFile", "Made"]


class Made(NamedTuple):
    """What a file was made into."""

    root: QtCore.QObject
    #: Must live as long as its root: dropping it destroys the root.
    component: QtQml.QQmlComponent


class LiveFile(QtCore.QObject):
    """A QML file, its engine, and what it was made into last.

    What shows it makes it with :meth:`create`, and hands what was made to :meth:`replace`, so that
    a file with errors leaves what is shown as it is.

    Args:
        file: The file.
        session: The node its QML talks through.
        watch: Tell when a file in its folder, or in `import_paths`, changes.
        import_paths: Further folders with QML modules.

    Raises:
        QmlError: There is no such file or folder.
    """

    #: It is to be made anew: it has changed, or :meth:`is_ready` said no before, and would not now.
    due = Signal()
    #: JavaScript of it was ended, for it kept the screen from living: what, where, and what to do.
    script_ended = Signal(str)

    def __init__(
        self,
        file: str | os.PathLike[str],
        session: Session,
        *,
        watch: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
    ) -> None:
        super().__init__()
        self.path, self._session = interface_file(file), session
        self._folders = [import_folder(path) for path in import_paths]
        #: What was made last; None before anything was.
        self.made: Made | None = None
        self._put_off = False
        self._closed = False
        self.engine = QtQml.QQmlEngine()
        log_engine_warnings(self.engine)
        # The last one is looked into first, and nothing hides our own modules.
        for path in [*_environment_paths(), *map(str, reversed(self._folders))]:
            self.engine.addImportPath(path)
        install(self.engine, session)
        Watchdog.of(session).watch(self.engine, self.script_ended.emit)
        session.call_ended.connect(self._go_on)
        self._watcher: Watcher | None = None
        # Before anything is read, so that no change in between goes unnoticed.
        self.watch = watch

    @property
    def watch(self) -> bool:
        """Whether changes are noticed."""
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
        """Return whether it may be made anew now; :attr:`due` tells when, otherwise.

        Not while a call from QML waits, which would return into an interface that is gone.
        """
        self._put_off = bool(self._session.waiting_calls)
        return not self._put_off and not self._closed and is_alive(self.engine)

    def create(self) -> Made:
        """Make the file as it is now, beside what was made of it before.

        Raises:
            QmlError: It has errors; the message lists them as ``file:line:column: text``.
        """
        if not os.path.isfile(self.path):  # noqa: PTH113 - pathlib's may raise
            raise QmlError(f"{self.path}: there is no such file")
        self.engine.clearComponentCache()
        forget_repeats()
        runtime = runtime_of(self.engine)
        if runtime is not None:
            runtime.forget_warnings()
        component = QtQml.QQmlComponent(self.engine, QtCore.QUrl.fromLocalFile(str(self.path)))
        root = create(component, self.engine)
        if root is None:
            raise QmlError(error_list(component.errors(), self.path))
        return Made(root, component)

    def replace(self, made: Made, show: Callable[[], None]) -> None:
        """Have what was made take the place of what was made before, which is destroyed.

        Args:
            made: What was made.
            show: Shows it; what it replaces still exists then.
        """
        before, self.made = self.made, made
        self._session.holding += 1
        try:
            show()
            if before is not None:
                self.drop(before)
        finally:
            self._session.holding -= 1

    def drop(self, made: Made) -> None:
        """Destroy what was made, whose cleaning up leaves the node to others."""
        root, component = made
        if not is_alive(root):
            self._dropped(component)
            return
        self._session.holding += 1

        def dropped() -> None:
            self._session.holding -= 1
            self._dropped(component)

        # A signal of what QML has made, once looked at, has PySide2 keep its half of that for ever.
        end = QtCore.QObject(root)
        # Component.onDestruction runs a little after this signal.
        end.destroyed.connect(lambda: QtCore.QTimer.singleShot(0, dropped))
        root.deleteLater()

    def close(self, *, hold: bool = False) -> None:
        """Let go of everything; safe to call twice.

        Args:
            hold: Others need the node: what QML does at its end must not shut it down.
        """
        if self._closed:
            return
        self.watch = False
        self._closed = True
        self._session.call_ended.disconnect(self._go_on)
        Watchdog.of(self._session).forget(self.engine)
        made, self.made = self.made, None
        if made is not None and hold:
            self.drop(made)
        for item in (*(made or ()), self.engine):
            if is_alive(item):
                item.deleteLater()

    def _go_on(self) -> None:
        # The call that has ended is still to return into QML.
        if self._put_off:
            self._put_off = False
            QtCore.QTimer.singleShot(0, self._tell_due)

    def _tell_due(self) -> None:
        if not self._closed:
            self.due.emit()

    def _dropped(self, component: QtQml.QQmlComponent) -> None:
        if is_alive(component):
            component.deleteLater()
        if is_alive(self.engine) and not self._closed:
            # Publishers of the old interface live until they are collected.
            self.engine.collectGarbage()


def _environment_paths() -> list[str]:
    """Return what Qt 5 does not read itself: QML_IMPORT_PATH, the first path last."""
    paths = [] if QT6 else os.environ.get("QML_IMPORT_PATH", "").split(os.pathsep)
    return [path for path in reversed(paths) if path]
