"""``Ros.package``: where packages are, and what they export."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
import os
import shlex
import threading
from typing import TYPE_CHECKING, TypeVar

from rosglass.errors import Error
from rosglass.qml.file_access import FOLDER_PATIENCE, within
from rosglass.qml.log import log_from_qml
from rosglass.qml.waiting import MOST_WAITING, wait_for
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces.folders import Folders
    from rosglass.qml.runtime import Runtime

__all__ = ["Package"]

_T = TypeVar("_T")

#: Seconds that the program ``rospack`` is given.
_PATIENCE = 10


class Package(QtCore.QObject):
    """The packages that the environment names: ``ROS_PACKAGE_PATH`` and sourced workspaces.

    Args:
        runtime: The engine's runtime.
        parent: The singleton.
    """

    def __init__(self, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime = runtime
        self._found: Folders | None = None
        self._searched: tuple[str | None, ...] = ()

    def _look(self, search: Callable[[Folders], _T], otherwise: _T, *, again: bool = False) -> _T:
        """Return what is found in the folders, searched once for each state of the environment."""
        from rosglass.interfaces.folders import (  # noqa: PLC0415 - few need it
            workspace,
            workspace_variables,
        )

        paths = workspace_variables(os.environ)

        def look() -> _T:
            if self._found is None or paths != self._searched or again:
                self._found, self._searched = workspace(os.environ), paths
            return search(self._found)

        try:
            return within(FOLDER_PATIENCE, "a folder of packages", look)
        except Error as error:
            text = f"Ros.package: {error}"
            log_from_qml("", logging.ERROR, text, self._runtime.caller())
            return otherwise

    @Slot(str, result=str)
    def getPath(self, package: str) -> str:
        """Return a package's folder; empty when there is no such package."""
        return self._look(lambda folders: folders.package(package), "")

    @Slot(result="QStringList")
    def getAll(self) -> list[str]:
        """Return the names of all packages, sorted."""
        return self._look(lambda folders: sorted(folders.packages()), [])

    @Slot(str, str, result=QJSValue)
    @Slot(str, str, bool, result=QJSValue)
    def getPlugins(self, name: str, attribute: str, force_recrawl: bool = False) -> QJSValue:
        """Return what packages export for a package.

        Args:
            name: Name of the element within ``<export>``, usually the package that is extended.
            attribute: The attribute whose values are returned.
            force_recrawl: Whether to look at the folders again.

        Returns:
            An object from names of packages to lists of values; ``${prefix}`` is their folder.
        """

        def search(folders: Folders) -> dict[str, list[str]]:
            return {
                package: values
                for package, folder in sorted(folders.packages().items())
                if (values := _exports(folder, name, attribute))
            }

        nothing: dict[str, list[str]] = {}
        return self._runtime.value(self._look(search, nothing, again=force_recrawl))

    @Slot(str, result=str)
    def command(self, command: str) -> str:
        """Return what the program ``rospack`` prints; empty, with a line in the log, without it."""
        caller, session = self._runtime.caller(), self._runtime.session
        printed: list[str | Error] = [""]

        def begin(end: Callable[[], None]) -> None:
            def work() -> None:
                try:
                    printed[0] = _rospack(command)
                except Error as error:
                    printed[0] = error
                session.executor.post(end)

            # Not on the session's worker: whoever subscribes meanwhile would wait, too.
            threading.Thread(target=work, name="rospack", daemon=True).start()

        if not wait_for(session, begin):
            printed[0] = Error(f"{MOST_WAITING} calls wait already")
        result = printed[0]
        if isinstance(result, Error):
            text = f"Ros.package.command({command!r}) failed: {result}"
            log_from_qml("", logging.WARNING, text, caller)
            return ""
        return result


def _rospack(command: str) -> str:
    import subprocess  # noqa: PLC0415 - few interfaces need it

    try:
        words = ["rospack", *shlex.split(command)]
        done = subprocess.run(words, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    except FileNotFoundError:
        raise Error("rospack is not installed; getPath() and getAll() need no ROS") from None
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        raise Error(str(error)) from None
    if done.returncode:
        raise Error(done.stderr.strip())
    return done.stdout.strip()


def _exports(folder: str, name: str, attribute: str) -> list[str]:
    """Return the values of an attribute of ``<export><name .../></export>`` in a package.xml.

    Format: REP 140, "Package Manifest Format Two", section "<export>".
    """
    from xml.etree import ElementTree  # noqa: PLC0415 - few interfaces need it

    try:
        root = ElementTree.parse(os.path.join(folder, "package.xml")).getroot()  # noqa: PTH118
    except (OSError, ElementTree.ParseError):
        return []
    elements = [element for element in root.iterfind("./export/*") if element.tag == name]
    values = [element.get(attribute) for element in elements]
    return [value.replace("${prefix}", folder) for value in values if value is not None]
