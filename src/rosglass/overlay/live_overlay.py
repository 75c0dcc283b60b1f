"""Overlays made by a QML file, with the object ``rviz``, reloaded when the file changes."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import QmlError
from rosglass.overlay.overlay import Overlay
from rosglass.overlay.rviz_object import RvizObject
from rosglass.qml.run.live_file import (
    ERRORS,
    ERRORS_BELOW,
    PANEL,
    SCRIPT_ENDED,
    ErrorView,
    LiveFile,
)
from rosglass.qml.run.modules import interface_file
from rosglass.qt import QtCore, QtQuick

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from rosglass.overlay.access import Access
    from rosglass.qml.engine.session import Session
    from rosglass.qml.run.live_file import Made
    from rosglass.qt import QtQml

__all__ = ["LiveOverlay"]

_log = logging.getLogger("rosglass.overlay")
_IMPORTS = Path(__file__).with_name("imports")


class LiveOverlay(Overlay):
    """An overlay made by a QML file; base class: implement :meth:`_place` and :meth:`_close_view`.

    Args:
        file: The QML file; its root must be an Item.
        session: The session that its QML uses.
        name: Its name; by default that of the file.
        access: The 3D view that the object ``rviz`` stands for; None for that of the session.
        watch: Whether to reload when a file in its folder or in `import_paths` is saved.
        import_paths: Additional folders with QML modules, also as ``package://`` URLs.
        options: Options of :class:`Overlay`.

    Raises:
        QmlError: A file or folder does not exist.
    """

    properties: RvizObject

    def __init__(
        self,
        file: str | os.PathLike[str],
        session: Session,
        name: str = "",
        *,
        access: Access | None = None,
        watch: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        **options: Any,
    ) -> None:
        self.file = interface_file(file)
        super().__init__(name or self.file.stem, **options)
        self.session = session
        self._live = LiveFile(file, session, watch=watch, import_paths=import_paths)
        #: The object ``rviz`` in QML.
        self.properties = RvizObject(self, self.engine, access)
        self._live.prepare(self._prepare)
        self._root: Any = None
        self._error = ""
        self._errors = ErrorView(self._live, PANEL)
        self._closed = self._loading = False
        self._live.due.connect(self.reload)
        self._live.script_ended.connect(self._on_script_ended)

    @property
    def engine(self) -> QtQml.QQmlEngine:
        """The engine of the interface; a reload makes another one."""
        return self._live.engine

    def prepare(self, job: Callable[[QtQml.QQmlEngine], None]) -> None:
        """Call a function with the engine, and with that of each reload before it loads the file.

        Args:
            job: E.g. ``lambda engine: engine.addImageProvider("plots", Plots())``.

        Raises:
            Error: The job cannot be called.
        """
        self._live.prepare(job)

    def _prepare(self, engine: QtQml.QQmlEngine) -> None:
        engine.addImportPath(str(_IMPORTS))
        engine.quit.connect(self._quit)
        engine.exit.connect(self._exit)
        self.properties.serve(engine)
        engine.rootContext().setContextProperty("rviz", self.properties)

    # Of each 3D view.

    def _place(self, root: Any) -> None:
        """Show a root item instead of the present one, which is deleted then."""
        raise NotImplementedError(self._missing("_place(root)"))

    def _windows(self) -> list[Any]:
        """Return the windows that show errors of the file."""
        raise NotImplementedError(self._missing("_windows()"))

    def _close_view(self) -> None:
        """Close the program's window, as the file calls ``Qt.quit()``."""
        raise NotImplementedError(self._missing("_close_view()"))

    def _standing_problem(self) -> str:
        """Return the problem while this version of the file is shown."""
        return ""

    @property
    def root(self) -> Any:
        """The root item; None before the file was loaded."""
        return self._root

    @property
    def loaded(self) -> bool:
        """True while it shows the file, in its current or its last valid version."""
        return self._root is not None

    @property
    def watch(self) -> bool:
        """True if it reloads when a file is saved."""
        return self._live.watch

    @watch.setter
    def watch(self, watch: bool) -> None:
        self._live.watch = watch

    def load(self) -> None:
        """Load and show the file; show its errors instead if it has any.

        A watched file is reloaded when its errors are fixed.

        Raises:
            QmlError: The file has errors and is not watched.
        """
        self.session.defer_connecting()
        try:
            self._load()
        except QmlError as error:
            self.session.go_on()
            if not self.watch:
                raise
            _log.error("%s", error)

    def reload(self) -> bool:
        """Reload the file; if it has errors, show them over the previous version.

        Deferred while a call from QML is waiting, which would return into deleted objects.

        Returns:
            Whether the new version is shown.
        """
        if self._loading or not self._live.is_ready():
            return False
        started = time.perf_counter()
        try:
            self._load()
        except QmlError as error:
            _log.error("%s", error)
            return False
        _log.info("%s reloaded in %.0f ms", self.file, (time.perf_counter() - started) * 1000)
        return not self._closed

    def _load(self) -> None:
        self._loading = True
        self.properties.begin_load()
        try:
            made = self._live.create()
            self._check(made)
        except QmlError as error:
            self.properties.serve(self.engine)
            self._show_error(str(error))
            raise
        finally:
            self._loading = False
        if self._closed:
            # Code in the file has removed the overlay.
            self._live.drop(made)
            return
        self._show_error("")
        self._live.replace(made, lambda: self._show(made.root))

    def _check(self, made: Made) -> None:
        root = made.root
        if isinstance(root, QtQuick.QQuickItem):
            return
        if isinstance(root, QtQuick.QQuickWindow):
            root.setVisible(False)
            what = "a window; overlays are shown in the 3D view's window: use Item { } instead"
        else:
            what = f"a {_qml_type_name(root)}: put its content into an Item {{ }}"
        self._live.drop(made)
        raise QmlError(f"{self.file}: the root of an overlay must be an Item, but is {what}")

    def _show(self, root: Any) -> None:
        # Release mouse and focus of the items that are about to be deleted.
        self.renewed.emit(self)
        self._root = root
        self._place(root)
        self.show_problem("")

    def show_problem(self, problem: str) -> None:
        """Set the problem; if empty, errors of the file remain."""
        super().show_problem(problem or self._error or self._standing_problem())

    def _show_error(self, error: str) -> None:
        self._error = error
        self.show_problem(error)
        if self._closed:
            return
        if error:
            self._errors.show(error, self._windows(), ERRORS_BELOW if self.loaded else ERRORS)
            self._fit_errors()
        else:
            self._errors.hide()
        self.changed.emit()

    def _on_script_ended(self, text: str) -> None:
        if self._closed or self._error:
            return
        self.show_problem(text)
        self._errors.show(text, self._windows(), SCRIPT_ENDED)
        self._fit_errors()
        self.changed.emit()

    def _fit_errors(self) -> None:
        """Give the errors the size of the window's other texts."""

    def _quit(self, *_: Any) -> None:
        # Later, because RViz may open a dialog about unsaved changes.
        QtCore.QTimer.singleShot(0, self._close_view)

    def _exit(self, code: int) -> None:
        QtCore.QTimer.singleShot(0, lambda: QtCore.QCoreApplication.exit(code))

    def close(self, *, hold: bool = False) -> None:
        """Delete the QML engine; safe to call twice.

        Args:
            hold: Keep the session's node, which others need, even if the file shuts it down.
        """
        if self._closed:
            return
        self._closed = True
        self.properties.close()
        self._errors.hide()
        # QML uses it until the engine is deleted.
        self.properties.setParent(self.engine)
        self._live.close(hold=hold)
        self._root = None


def _qml_type_name(root: Any) -> str:
    """Return the QML type name of an object."""
    kind = root.metaObject()
    while "_QML" in kind.className():
        kind = kind.superClass()
    name = str(kind.className())
    return "QtObject" if name == "QObject" else name.removeprefix("QQuick").removeprefix("QQml")
