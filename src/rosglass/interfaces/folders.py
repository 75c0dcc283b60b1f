"""Definitions in files: workspaces, install spaces, source trees and plain folders."""

# pathlib takes longer to import than the first definition to load.
# ruff: noqa: PTH112, PTH113, PTH118, PTH119, PTH123

from __future__ import annotations

import os
import re
from os.path import basename, isdir, isfile, join, realpath
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError
from rosglass.interfaces.idl import parse_idl
from rosglass.interfaces.names import KINDS
from rosglass.interfaces.parser import MAX_TEXT, parse
from rosglass.interfaces.provider import Provider

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["Folders", "find_in_package", "list_package", "workspace", "workspace_variables"]

#: Environment variables that name the folders of a workspace.
_VARIABLES = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH")
_MAX_DEPTH = 12
_MAX_FOLDERS = 20_000
_IGNORE_FILES = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "NOBUILD")
_BOTH = frozenset((1, 2))
_ROS1, _ROS2 = frozenset((1,)), frozenset((2,))

_XML_COMMENT = r"(?s)<!--.*?-->"
_XML_NAME = r"<name>\s*([^<\s]+)\s*</name>"
_XML_WORLDS = (
    (1, r">\s*(?:catkin|message_generation|genmsg)\s*<"),
    (2, r">\s*(?:ament_\w+|rosidl_\w+)\s*<"),
)


class _Package(NamedTuple):
    name: str
    path: str
    worlds: frozenset[int]


class _Root:
    """A folder to look in; what it is gets found out when it is first asked.

    Args:
        path: A package, a tree of packages, or a prefix with ``share/<package>`` in it.
        worlds: ROS versions its packages are for; a ``package.xml`` can narrow it.
    """

    def __init__(self, path: str, worlds: frozenset[int]) -> None:
        self.path, self.worlds = path, worlds
        self._packages: dict[str, list[_Package]] | None = None
        self._share = ""
        if basename(path) == "share":
            self._share = path
        elif isdir(join(path, "share")) and not isfile(join(path, "package.xml")):
            self._share = join(path, "share")

    def packages(self, name: str) -> Iterable[_Package]:
        """Return the packages of a name, the one that wins first."""
        if self._share:
            path = join(self._share, name)
            return (_Package(name, path, self.worlds),) if isdir(path) else ()
        return self._scanned().get(name, ())

    def all_packages(self) -> Iterable[_Package]:
        """Return all packages."""
        if self._share:
            names = sorted(entry.name for entry in os.scandir(self._share) if entry.is_dir())
            return [_Package(name, join(self._share, name), self.worlds) for name in names]
        return [package for packages in self._scanned().values() for package in packages]

    def _scanned(self) -> Mapping[str, list[_Package]]:
        if self._packages is None:
            found: dict[str, list[_Package]] = {}
            for package in _scan(self.path, self.worlds):
                found.setdefault(package.name, []).append(package)
            self._packages = found
        return self._packages


class Folders(Provider):
    """Definitions in folders of the file system.

    Args:
        name: The provider's name.
    """

    def __init__(self, name: str = "folders") -> None:
        self.name = name
        self._roots: list[_Root] = []

    def add(self, path: str | os.PathLike[str], worlds: Iterable[int] = _BOTH) -> None:
        """Append a folder: a package, a tree of packages, or an install or devel space.

        Args:
            path: The folder; it is read when the first type is looked up.
            worlds: ROS versions it is for; a package's ``package.xml`` can narrow it.
        """
        text = os.fspath(path)
        if all(root.path != text for root in self._roots):
            self._roots.append(_Root(text, frozenset(worlds)))

    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the definition from the first folder that has one."""
        package_name = name.partition("/")[0]
        for root in self._roots:
            for package in root.packages(package_name):
                if ros in package.worlds:
                    provider = f"{self.name} {root.path}"
                    found = find_in_package(package.path, name, ros, provider)
                    if found is not None:
                        return (found,)
        return ()

    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of all types in the folders."""
        for root in self._roots:
            for package in root.all_packages():
                if ros in package.worlds:
                    yield from list_package(package.path, package.name, ros)

    def package(self, name: str) -> str:
        """Return the folder of a package, of either ROS; empty when there is none."""
        found = (package.path for root in self._roots for package in root.packages(name))
        return next(found, "")

    def packages(self) -> dict[str, str]:
        """Return the folders of all packages by name; the first of a name wins."""
        found: dict[str, str] = {}
        for root in self._roots:
            for package in root.all_packages():
                found.setdefault(package.name, package.path)
        return found

    def describe(self, ros: int) -> str:
        """Name the folders."""
        paths = [root.path for root in self._roots if ros in root.worlds]
        return f"{self.name} ({', '.join(paths)})" if paths else ""


def workspace(environment: Mapping[str, str]) -> Folders:
    """Return the provider of the workspace that the shell has sourced.

    Args:
        environment: ``AMENT_PREFIX_PATH`` (ROS 2 install spaces), ``ROS_PACKAGE_PATH`` (ROS 1
            packages) and ``CMAKE_PREFIX_PATH`` (both, and ROS 1 devel spaces) are read.
    """
    folders = Folders("workspace")
    for path in _paths(environment, "AMENT_PREFIX_PATH"):
        folders.add(path, _ROS2)
    for path in _paths(environment, "CMAKE_PREFIX_PATH"):
        if isfile(join(path, ".catkin")):
            folders.add(path, _ROS1)
            # A devel space names the source spaces that it was built from.
            for source in _read(join(path, ".catkin")).strip().split(";"):
                if source and isdir(source):
                    folders.add(source, _ROS1)
        elif isdir(join(path, "share", "ament_index")):
            folders.add(path, _ROS2)
    for path in _paths(environment, "ROS_PACKAGE_PATH"):
        folders.add(path, _ROS1)
    return folders


def workspace_variables(environment: Mapping[str, str]) -> tuple[str | None, ...]:
    """Return what :func:`workspace` depends on."""
    return tuple(map(environment.get, _VARIABLES))


def _paths(environment: Mapping[str, str], variable: str) -> Iterator[str]:
    for path in environment.get(variable, "").split(os.pathsep):
        if path and isdir(path):
            yield path.rstrip("/") or path


def find_in_package(folder: str, name: str, ros: int, provider: str) -> InterfaceDefinition | None:
    """Parse the file of a type in a package's folder, None when there is no such file.

    Raises:
        DefinitionError: The file can't be read or parsed.
    """
    _, kind, base = name.split("/")
    path = join(folder, kind, f"{base}.{kind}")
    if isfile(path):
        return parse(_read(path), name, ros=ros, file=path, provider=provider)
    path = join(folder, kind, f"{base}.idl")
    if ros == 2 and isfile(path):
        return parse_idl(_read(path), name, file=path, provider=provider)
    return None


def list_package(folder: str, package: str, ros: int) -> Iterator[str]:
    """Yield the full names of the types in a package's folder."""
    for kind in KINDS:
        endings = (f".{kind}", ".idl") if ros == 2 else (f".{kind}",)
        try:
            files = sorted(entry.name for entry in os.scandir(join(folder, kind)))
        except OSError:
            continue
        stems = (file.rpartition(".")[0] for file in files if file.endswith(endings))
        for stem in dict.fromkeys(stems):
            yield f"{package}/{kind}/{stem}"


def _read(path: str) -> str:
    try:
        with open(path, "rb") as file:
            data = file.read(MAX_TEXT + 1)
    except OSError as error:
        raise DefinitionError(f"the file can't be read: {error}", path) from error
    if len(data) > MAX_TEXT:
        raise DefinitionError(f"the file has more than {MAX_TEXT} bytes, which is the limit", path)
    # Comments of old packages are not always UTF-8; nothing else may be non-ASCII anyway.
    return data.decode("utf-8", "replace")


def _scan(root: str, worlds: frozenset[int]) -> Iterator[_Package]:
    """Find the packages below a folder; as catkin and colcon do, none inside of another."""
    pending = [(root, 0)]
    seen: set[str] = set()
    for folder, depth in pending:
        real = realpath(folder)
        if real in seen:
            continue
        seen.add(real)
        if len(seen) > _MAX_FOLDERS:
            _warn_too_many(root)
            return
        try:
            entries = {entry.name: entry for entry in os.scandir(folder)}
        except OSError:
            continue
        if folder != root and any(name in entries for name in _IGNORE_FILES):
            continue
        package = _package(folder, entries, worlds)
        if package is not None:
            yield package
        elif depth < _MAX_DEPTH:
            pending.extend(
                (entry.path, depth + 1)
                for name, entry in sorted(entries.items())
                if not name.startswith(".") and entry.is_dir()
            )


def _warn_too_many(root: str) -> None:
    import logging  # noqa: PLC0415 - takes 4 ms that nearly nobody needs to spend

    logging.getLogger("rosglass.interfaces").warning(
        "stopped looking for packages in %s after %d folders; name the packages' own folders "
        "instead",
        root,
        _MAX_FOLDERS,
    )


def _package(
    folder: str, entries: Mapping[str, os.DirEntry[str]], worlds: frozenset[int]
) -> _Package | None:
    """Return the package that a folder is, None when it is none."""
    if "package.xml" in entries:
        xml = re.sub(_XML_COMMENT, "", _read(join(folder, "package.xml")))
        match = re.search(_XML_NAME, xml)
        said = frozenset(ros for ros, pattern in _XML_WORLDS if re.search(pattern, xml))
        name = match.group(1) if match else basename(folder)
        return _Package(name, folder, (said & worlds) if said else worlds)
    if any(kind in entries for kind in KINDS) and any(list_package(folder, "", 2)):
        return _Package(basename(folder), folder, worlds)
    return None
