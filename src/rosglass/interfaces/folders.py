"""Definitions in files: workspaces, install spaces, source trees and plain folders."""

from __future__ import annotations

import logging
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionError
from rosglass.interfaces.idl import parse_idl
from rosglass.interfaces.names import KINDS
from rosglass.interfaces.parser import parse
from rosglass.interfaces.provider import Provider

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["Folders", "find_in_package", "list_package", "workspace"]

_logger = logging.getLogger("rosglass.interfaces")

_MAX_FILE = 8 * 1024 * 1024
_MAX_DEPTH = 12
_MAX_FOLDERS = 20_000
_IGNORE_FILES = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "NOBUILD")
_BOTH = frozenset((1, 2))

_XML_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_XML_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
_XML_ROS1 = re.compile(r">\s*(?:catkin|message_generation|genmsg)\s*<")
_XML_ROS2 = re.compile(r">\s*(?:ament_\w+|rosidl_\w+)\s*<")


class _Package(NamedTuple):
    name: str
    path: Path
    worlds: frozenset[int]


class _Root:
    """A folder to look in; what it is gets found out when it is first asked.

    Args:
        path: A package, a tree of packages, or a prefix with ``share/<package>`` in it.
        worlds: ROS versions its packages are for, unless their ``package.xml`` says otherwise.
        strict: Whether `worlds` overrides the packages' own word.
    """

    def __init__(self, path: Path, worlds: frozenset[int] = _BOTH, *, strict: bool = False) -> None:
        self.path, self.worlds, self.strict = path, worlds, strict
        self._packages: dict[str, list[_Package]] | None = None
        share = path / "share"
        self._share = share if share.is_dir() and not (path / "package.xml").exists() else None

    def packages(self, name: str) -> Iterable[_Package]:
        if self._share is not None:
            path = self._share / name
            return (_Package(name, path, self.worlds),) if path.is_dir() else ()
        return self._scanned().get(name, ())

    def all_packages(self) -> Iterable[_Package]:
        if self._share is not None:
            return [
                _Package(entry.name, entry, self.worlds)
                for entry in sorted(self._share.iterdir())
                if entry.is_dir()
            ]
        return [package for packages in self._scanned().values() for package in packages]

    def _scanned(self) -> Mapping[str, list[_Package]]:
        if self._packages is None:
            found: dict[str, list[_Package]] = {}
            for package in _scan(self.path, self.worlds, strict=self.strict):
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

    def add(self, path: Path, worlds: frozenset[int] = _BOTH, *, strict: bool = False) -> None:
        """Append a folder: a package, a tree of packages, or an install or devel space.

        Args:
            path: The folder; it is read when the first type is looked up.
            worlds: ROS versions it is for.
            strict: Whether `worlds` overrides what the packages say themselves.
        """
        if all(root.path != path for root in self._roots):
            self._roots.append(_Root(path, worlds, strict=strict))

    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
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
        for root in self._roots:
            for package in root.all_packages():
                if ros in package.worlds:
                    yield from list_package(package.path, package.name)

    def describe(self, ros: int) -> str:
        paths = [str(root.path) for root in self._roots if ros in root.worlds]
        return f"{self.name} ({', '.join(paths)})" if paths else ""


def workspace(environment: Mapping[str, str]) -> Folders:
    """Return the provider of the workspace that the shell has sourced.

    Args:
        environment: ``AMENT_PREFIX_PATH`` (ROS 2 install spaces), ``ROS_PACKAGE_PATH`` (ROS 1
            packages) and ``CMAKE_PREFIX_PATH`` (both, and ROS 1 devel spaces) are read.
    """
    folders = Folders("workspace")
    for path in _paths(environment, "AMENT_PREFIX_PATH"):
        folders.add(path, frozenset((2,)), strict=True)
    for path in _paths(environment, "CMAKE_PREFIX_PATH"):
        marker = path / ".catkin"
        if marker.is_file():
            folders.add(path, frozenset((1,)), strict=True)
            # A devel space names the source spaces that it was built from.
            for source in _read(marker).split(";"):
                if source and Path(source).is_dir():
                    folders.add(Path(source), frozenset((1,)))
        elif (path / "share" / "ament_index").is_dir():
            folders.add(path, frozenset((2,)), strict=True)
    for path in _paths(environment, "ROS_PACKAGE_PATH"):
        folders.add(path, frozenset((1,)))
    return folders


def _paths(environment: Mapping[str, str], variable: str) -> Iterator[Path]:
    for text in environment.get(variable, "").split(os.pathsep):
        if text and Path(text).is_dir():
            yield Path(text)


def find_in_package(folder: Path, name: str, ros: int, provider: str) -> InterfaceDefinition | None:
    """Parse the file of a type in a package's folder, None when there is no such file.

    Raises:
        DefinitionError: The file can't be read or parsed.
    """
    _, kind, base = name.split("/")
    path = folder / kind / f"{base}.{kind}"
    if path.is_file():
        return parse(_read(path), name, ros=ros, file=str(path), provider=provider)
    path = folder / kind / f"{base}.idl"
    if ros == 2 and path.is_file():
        return parse_idl(_read(path), name, file=str(path), provider=provider)
    return None


def list_package(folder: Path, package: str) -> Iterator[str]:
    """Yield the full names of the types in a package's folder."""
    for kind in KINDS:
        try:
            entries = sorted(entry.name for entry in os.scandir(folder / kind))
        except OSError:
            continue
        stems = dict.fromkeys(
            entry.rpartition(".")[0] for entry in entries if entry.endswith((f".{kind}", ".idl"))
        )
        for stem in stems:
            yield f"{package}/{kind}/{stem}"


def _read(path: Path) -> str:
    try:
        size = path.stat().st_size
        if size > _MAX_FILE:
            raise DefinitionError(f"the file has {size} bytes, the limit is {_MAX_FILE}", str(path))
        # Comments of old packages are not always UTF-8; nothing else may be non-ASCII anyway.
        return path.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise DefinitionError(f"the file can't be read: {error}", str(path)) from error


def _scan(root: Path, worlds: frozenset[int], *, strict: bool) -> Iterator[_Package]:
    """Find the packages below a folder."""
    pending = [(root, 0)]
    seen: set[str] = set()
    while pending:
        folder, depth = pending.pop(0)
        real = os.path.realpath(folder)
        if real in seen:
            continue
        seen.add(real)
        if len(seen) > _MAX_FOLDERS:
            _logger.warning(
                "stopped looking for packages in %s after %d folders; add the packages' own "
                "folders instead",
                root,
                _MAX_FOLDERS,
            )
            return
        try:
            entries = {entry.name: entry for entry in os.scandir(folder)}
        except OSError:
            continue
        if any(name in entries for name in _IGNORE_FILES) and folder != root:
            continue
        package = _package(folder, entries, worlds, strict=strict)
        if package is not None:
            yield package
        elif depth < _MAX_DEPTH:
            pending += [
                (Path(entry.path), depth + 1)
                for name, entry in sorted(entries.items())
                if not name.startswith(".") and entry.is_dir()
            ]


def _package(
    folder: Path, entries: Mapping[str, os.DirEntry[str]], worlds: frozenset[int], *, strict: bool
) -> _Package | None:
    """Return the package that a folder is, None when it is none."""
    if "package.xml" in entries:
        xml = _XML_COMMENT.sub("", _read(folder / "package.xml"))
        match = _XML_NAME.search(xml)
        said = frozenset(
            ros for ros, pattern in ((1, _XML_ROS1), (2, _XML_ROS2)) if pattern.search(xml)
        )
        name = match.group(1) if match else folder.name
        return _Package(name, folder, worlds if strict or not said else said & worlds)
    if any(kind in entries and any(list_package(folder, "p")) for kind in KINDS):
        return _Package(folder.name, folder, worlds)
    return None
