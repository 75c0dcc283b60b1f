"""The object ``RQml`` that plugins of RQml use."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.cockpit.rqml import find_plugins
from rosglass.errors import Error, QmlError
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import Writable
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.engine.waiting import FILE_TIMEOUT_S, FOLDER_TIMEOUT_S, within
from rosglass.qt import Property, QtCore, QtGui, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.cockpit.rqml import RqmlPlugin
    from rosglass.qt import QtQml

__all__ = ["RqmlApi"]

_NAME = "rosglass.rqml"
#: Largest file that plugins read or write, in bytes.
_MAX_BYTES = 64 << 20
_DIALOG = "QQuickFileDialog"


class _Place(NamedTuple):
    """A folder, and whether plugins may write in it."""

    folder: Path
    writable: bool


class RqmlApi(QtCore.QObject):
    """Files, the clipboard and other plugins, for the plugins of one engine.

    Files are read and written in the layout's folder and where a user has chosen one in a file
    dialog of a plugin; a plugin also reads those in its own folder.

    Args:
        engine: The engine; also the parent.
    """

    #: A plugin asks for another one, by its id.
    pluginRequested = Signal(str)

    devMode = Writable(bool, False, then="")

    def __init__(self, engine: QtQml.QQmlEngine) -> None:
        super().__init__(engine)
        self.setObjectName(_NAME)
        #: Source trees with plugins, besides AMENT_PREFIX_PATH.
        self.folders: list[str] = []
        self._places: list[_Place] = []
        #: The items of plugins, whose file dialogs count.
        self._items: list[QtCore.QObject] = []

    @classmethod
    def of(cls, engine: QtQml.QQmlEngine) -> RqmlApi:
        """Return the object of an engine, created if needed."""
        found = engine.findChild(cls, _NAME)
        return found if isinstance(found, cls) else cls(engine)

    def allow(self, folder: Path, *, writable: bool) -> None:
        """Let plugins read, or also write, the files in a folder and those inside it."""
        place = _Place(folder.resolve(), writable)
        if place not in self._places:
            self._places.append(place)

    def add(self, item: QtCore.QObject) -> None:
        """Let the files count that users choose in dialogs of a plugin."""
        self._items = [one for one in self._items if is_alive(one)]
        self._items.append(item)

    #: The plugins that can be loaded: id, name, group, path, singleInstance.
    plugins = Property("QVariantList", lambda self: self._listed(), constant=True)  # type: ignore[arg-type]

    def _listed(self) -> list[dict[str, Any]]:
        return [
            {
                "id": plugin.id,
                "name": plugin.name,
                "group": plugin.group,
                "path": str(plugin.path),
                "singleInstance": plugin.single_instance,
            }
            for plugin in within(FOLDER_TIMEOUT_S, "AMENT_PREFIX_PATH", self._find)
        ]

    def _find(self) -> Iterable[RqmlPlugin]:
        return find_plugins(os.environ, self.folders).plugins

    @Slot(str, result=bool)
    def canCreatePlugin(self, plugin: str) -> bool:
        """Return whether there is a plugin with this id."""
        found = within(FOLDER_TIMEOUT_S, "AMENT_PREFIX_PATH", self._find)
        return any(one.id == plugin for one in found)

    @Slot(str, result="QVariant")
    def createPlugin(self, plugin: str) -> None:
        """Ask the cockpit to show another plugin."""
        if not self.canCreatePlugin(plugin):
            self._complain(f"createPlugin: there is no plugin with the id {plugin!r:.80}")
            return
        self.pluginRequested.emit(plugin)

    @Slot(str)
    def copyTextToClipboard(self, text: str) -> None:
        """Copy a text."""
        QtGui.QGuiApplication.clipboard().setText(text)

    @Slot(str, result=bool)
    def fileExists(self, path: str) -> bool:
        """Return whether a file exists that plugins may read."""
        try:
            return self._allowed(path, writing=False).exists()
        except (OSError, Error):
            return False

    @Slot(str, result=str)
    def readFile(self, path: str) -> str:
        """Return the text of a file; empty, with the reason in the log, if it cannot be read."""
        try:
            file = self._allowed(path, writing=False)
            return within(FILE_TIMEOUT_S, str(file), lambda: _read(file))
        except (OSError, UnicodeError, Error) as error:
            self._complain(f"readFile: {error}")
            return ""

    @Slot(str, str, result=bool)
    def writeFile(self, path: str, text: str) -> bool:
        """Write a text to a file; return False, with the reason in the log, if it cannot."""
        try:
            file, data = self._allowed(path, writing=True), text.encode("utf-8")
            if len(data) > _MAX_BYTES:
                raise QmlError(f"{path}: more than {_MAX_BYTES >> 20} MiB")
            within(FILE_TIMEOUT_S, str(file), lambda: file.write_bytes(data))
        except (OSError, UnicodeError, Error) as error:
            self._complain(f"writeFile: {error}")
            return False
        return True

    @Slot()
    @Slot(str)
    def save(self, path: str = "") -> None:  # noqa: ARG002 - RQml's signature
        """Do nothing: layouts are saved in the cockpit."""
        self._complain("save: layouts are saved in the cockpit's window (Ctrl+S)")

    @Slot(str)
    def load(self, path: str) -> None:  # noqa: ARG002 - RQml's signature
        """Do nothing: layouts are opened in the cockpit."""
        self._complain("load: layouts are opened in the cockpit's window (Ctrl+O)")

    @Slot()
    def closeFocusedPlugin(self) -> None:
        """Do nothing: panels are closed in the cockpit."""
        self._complain("closeFocusedPlugin: panels are closed in the cockpit's window")

    def _allowed(self, path: str, *, writing: bool) -> Path:
        """Return the path of a file that plugins may use.

        Raises:
            QmlError: They may not.
        """
        if not path or "\0" in path:
            raise QmlError(f"expected the path of a file, got {path!r:.80}")
        url = QtCore.QUrl(path)
        file = Path(url.toLocalFile() if url.isLocalFile() else path).resolve()
        for place in self._places:
            if file.is_relative_to(place.folder) and (place.writable or not writing):
                return file
        # A plugin may append a suffix to the name that was chosen.
        if any(file == chosen or file.with_suffix("") == chosen for chosen in self._chosen()):
            return file
        verb = "written" if writing else "read"
        raise QmlError(
            f"{file}: files of plugins are {verb} in the layout's folder, or where you choose one "
            "in a file dialog"
        )

    def _chosen(self) -> Iterable[Path]:
        """Yield the files that are chosen in dialogs of plugins."""
        for item in self._items:
            for child in item.findChildren(QtCore.QObject) if is_alive(item) else ():
                if child.metaObject().className().startswith(_DIALOG):
                    url: Any = child.property("selectedFile")
                    if isinstance(url, QtCore.QUrl) and url.isLocalFile():
                        yield Path(url.toLocalFile()).resolve()

    def _complain(self, text: str) -> None:
        engine = self.parent()
        runtime = runtime_of(engine) if engine is not None else None
        if runtime is not None:
            log_from_qml("", logging.WARNING, f"RQml.{text}", runtime.caller())

    def _refuse(self, text: str) -> None:
        self._complain(text)


def _read(file: Path) -> str:
    if file.stat().st_size > _MAX_BYTES:
        raise QmlError(f"{file}: larger than {_MAX_BYTES >> 20} MiB")
    return file.read_text(encoding="utf-8")
