"""An interface written in QML, drawn over RViz's 3D view."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import QmlError
from rosglass.qml.error_view import ERRORS, ERRORS_BELOW, PANEL, SCRIPT_ENDED, ErrorView
from rosglass.qml.live_file import LiveFile
from rosglass.qml.opengl_needs import need_in_file, need_in_items
from rosglass.qml.places import interface_file
from rosglass.qt import is_alive
from rosglass.rviz.overlay import Overlay
from rosglass.rviz.qml_input import QmlInput
from rosglass.rviz.qt5 import QtCore, QtQuick
from rosglass.rviz.renderer_choice import choice
from rosglass.rviz.rviz_object import RvizObject
from rosglass.rviz.scene import Scene

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.qml.live_file import Made
    from rosglass.qml.session import Session
    from rosglass.rviz.window import Window

__all__ = ["QmlOverlay"]

_log = logging.getLogger("rosglass.rviz")
_IMPORTS = Path(__file__).with_name("imports")
#: In `Session.shared`: the overlays that talk through it.
_USERS = "overlays"
#: Milliseconds after a drawing until what has come since is looked at.
_LOOK = 1000


class QmlOverlay(QmlInput, Overlay):
    """A QML file over RViz's 3D view.

    Args:
        file: The QML file; its root must be a visual item.
        session: The node its QML talks through.
        name: Its name; that of the file by default.
        watch: Show it anew whenever a file in its folder, or in `import_paths`, is saved.
        import_paths: Further folders with QML modules; ``package://`` as well.
        options: Of :class:`Overlay`.

    Raises:
        QmlError: There is no such file or folder.
        UnsupportedError: Neither OpenGL nor Qt's software renderer can draw here.
    """

    properties: RvizObject

    def __init__(
        self,
        file: str | os.PathLike[str],
        session: Session,
        name: str = "",
        *,
        watch: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        **options: Any,
    ) -> None:
        self.file = interface_file(file)
        super().__init__(name or self.file.stem, **options)
        self.session = session
        self._live = LiveFile(file, session, watch=watch, import_paths=import_paths)
        self.engine = self._live.engine
        self.engine.addImportPath(str(_IMPORTS))
        self.engine.quit.connect(self._quit)
        self.engine.exit.connect(self._exit)
        choice.expect(self.file)
        try:
            self._scene = Scene(choice.make(self.engine.importPathList()))
        except Exception:
            self._live.close()
            raise
        #: What QML finds as ``rviz``.
        self.properties = RvizObject(self, self.engine)
        self.engine.rootContext().setContextProperty("rviz", self.properties)
        self._window = self._scene.window
        self._scene.changed.connect(self.changed)
        self._shown_over: Window | None = None
        self._root: Any = None
        self._error = self._not_drawn = ""
        self._look = QtCore.QTimer()
        self._look.setSingleShot(True)
        self._look.setInterval(_LOOK)
        self._look.timeout.connect(self._rest)
        self._errors = ErrorView(self.engine, PANEL)
        self.arranged.connect(self._fit_errors)
        self._closed = self._loading = False
        self._users: list[QmlOverlay] = session.shared.setdefault(_USERS, [])
        self._users.append(self)
        self._live.due.connect(self.reload)
        self._live.script_ended.connect(self._tell_script_ended)

    @property
    def root(self) -> Any:
        """The root item of what is shown; None before anything is."""
        return self._root

    @property
    def loaded(self) -> bool:
        """Whether it shows the file, as it is now or as it was when it last had no errors."""
        return self._root is not None

    @property
    def watch(self) -> bool:
        """Whether it is shown anew when a file is saved."""
        return self._live.watch

    @watch.setter
    def watch(self, watch: bool) -> None:
        self._live.watch = watch

    def load(self) -> None:
        """Show the file; one with errors that is watched is shown once they are mended.

        Raises:
            QmlError: It has errors, and is not watched. They are shown in its place all the same,
                until :meth:`reload` finds them mended.
        """
        self.session.put_off()
        try:
            self._load()
        except QmlError as error:
            self.session.go_on()
            if not self.watch:
                raise
            _log.error("%s", error)

    def reload(self) -> bool:
        """Show the file as it is now; with errors, keep what is shown and show them over it.

        Put off while a call from QML waits, which would return into an interface that is gone.

        Returns:
            Whether it is shown.
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
            self._show_error(str(error))
            raise
        finally:
            self._loading = False
        if self._closed:
            # Something in it had it removed.
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
            what = "a window, and RViz's 3D view is the window here: write Item { } in its place"
        else:
            what = f"a {_kind(root)}: put what it holds into an Item {{ }}"
        self._live.drop(made)
        raise QmlError(f"{self.file}: the root of an overlay must be an Item, and is {what}")

    def _show(self, root: Any) -> None:
        # What was pressed, and had the keys, is about to go.
        self.renewed.emit(self)
        self._root = root
        self._scene.show_item(root)
        self._not_drawn = ""
        self.tell_problem("")
        # Films, and pictures of items, are no items that could be found.
        self._tell_not_drawn(root, lambda: need_in_file(self.file, self.engine.importPathList()))

    def _rest(self) -> None:
        """Hold no picture, and tell of what is not drawn that was made since; popups, too."""
        self._scene.rest()
        if not self._not_drawn and is_alive(self._window):
            self._tell_not_drawn(self._window.contentItem())

    def _tell_not_drawn(self, item: Any, otherwise: Callable[[], str] = str) -> None:
        if choice.renderer != "software":
            return
        need = need_in_items(item, self.file) or otherwise()
        if need:
            self._not_drawn = choice.tell_missing(need)
            _log.warning("overlay %s: %s", self.name, self._not_drawn)
            self.tell_problem(self.problem)

    def tell_problem(self, problem: str) -> None:
        """Say what is wrong with it; as long as its file has errors, it is they."""
        super().tell_problem(problem or self._error or self._not_drawn)

    def _show_error(self, error: str) -> None:
        self._error = error
        self.tell_problem(error)
        if self._closed:
            return
        if error:
            self._errors.show(error, [self._window], ERRORS_BELOW if self.loaded else ERRORS)
            self._fit_errors()
        else:
            self._errors.hide()
        self.changed.emit()

    def _tell_script_ended(self, text: str) -> None:
        if self._closed or self._error:
            return
        self.tell_problem(text)
        self._errors.show(text, [self._window], SCRIPT_ENDED)
        self._fit_errors()
        self.changed.emit()

    def _fit_errors(self) -> None:
        for item in self._errors.items:
            item.setProperty("unit", 1 / self.scale)

    def _quit(self, *_: Any) -> None:
        # RViz may ask about unsaved changes, which is not for the middle of a JavaScript function.
        QtCore.QTimer.singleShot(0, self._close_rviz)

    def _close_rviz(self) -> None:
        window = self._shown_over
        if window is not None and is_alive(window.widget):
            window.widget.close()

    def _exit(self, code: int) -> None:
        QtCore.QTimer.singleShot(0, lambda: QtCore.QCoreApplication.exit(code))

    def attach(self, window: Window) -> None:
        """Be shown over an RViz."""
        self._panel = window.panel
        self._shown_over = window
        self._scene.show_in(window.panel)

    def resize(self, width: int, height: int, ratio: float) -> None:
        """Fit the interface to the 3D view."""
        self._scene.resize(width, height, ratio)
        self._ratio = self._scene.factor

    def draw(self) -> NDArray[np.uint32] | None:
        """Render the scene, and read it back."""
        self.session.go_on()
        pixels = self._scene.draw()
        self.read_back = self._scene.renderer.read_back
        if not self._look.isActive():
            self._look.start()
        return pixels

    def close(self) -> None:
        """Let the interface, its engine and all its memory go; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._look.stop()
        self.properties.close()
        self._scene.changed.disconnect(self.changed)
        self._users.remove(self)
        self._errors.hide()
        # QML sees it to its end.
        self.properties.setParent(self.engine)
        # The last overlay may shut its node down, one of several not.
        self._live.close(hold=bool(self._users))
        self._scene.close()
        self._root = None


def _kind(root: Any) -> str:
    """Return what QML calls an object."""
    kind = root.metaObject()
    while "_QML" in kind.className():
        kind = kind.superClass()
    name = str(kind.className())
    return "QtObject" if name == "QObject" else name.removeprefix("QQuick").removeprefix("QQml")
