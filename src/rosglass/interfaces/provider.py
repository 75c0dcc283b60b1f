"""The providers of definitions: memory, folders, workspaces and ROS distributions.

The bundles in ``distributions/`` are written from rosbags by ``scripts/bundle_definitions.py``, as
importing rosbags takes too long for a GUI's first message. rosbags has messages only;
``definitions/`` has services, actions and a few more messages of common packages.
"""

# pathlib takes longer to import than the first definition to load.
# ruff: noqa: PTH112, PTH113, PTH118, PTH119, PTH120, PTH123, PTH208

from __future__ import annotations

import logging
import os
import re
from abc import ABC, abstractmethod
from functools import lru_cache
from os.path import basename, dirname, isdir, isfile, join, realpath
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import DefinitionConflictError, DefinitionError, UnsupportedError
from rosglass.interfaces.definition import ActionDefinition, Definition, ServiceDefinition
from rosglass.interfaces.idl import parse_idl
from rosglass.interfaces.names import KINDS
from rosglass.interfaces.parser import MAX_TEXT, parse, parse_message

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = [
    "DISTRIBUTIONS",
    "Distributions",
    "Folders",
    "MemoryProvider",
    "Provider",
    "difference",
    "find_in_package",
    "list_package",
    "workspace",
    "workspace_variables",
]

_log = logging.getLogger("rosglass.interfaces")


class Provider(ABC):
    """A source of definitions.

    Attributes:
        name: Short name, which users pass to :meth:`rosglass.Library.prefer`.
    """

    name: str

    @abstractmethod
    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the unresolved definitions of a full type name, the best first, or nothing.

        Several are valid variants (of other distributions); the library uses the first, unless a
        peer's hash selects another.
        """

    @abstractmethod
    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of all types."""

    @abstractmethod
    def describe(self, ros: int) -> str:
        """Describe the source for error messages; empty if it has none."""

    def views(self, ros: int) -> Iterator[Provider]:  # noqa: ARG002 - part of the interface
        """Yield the provider once for every consistent set of variants that it has."""
        yield self


class MemoryProvider(Provider):
    """Definitions in memory, for example those received from peers.

    Args:
        name: The provider's name.
    """

    def __init__(self, name: str = "wire") -> None:
        self.name = name
        self._known: dict[tuple[int, str], InterfaceDefinition] = {}

    def add(self, definition: InterfaceDefinition) -> bool:
        """Store a definition; returns whether it is new.

        Raises:
            DefinitionConflictError: Another definition of the type is stored already.
        """
        known = self._known.setdefault((definition.ros, definition.name), definition)
        found = difference(known, definition)
        if found:
            raise DefinitionConflictError(
                f"{definition.name} was received with two definitions: {known.source.provider} "
                f"and {definition.source.provider} differ: {found}. Peers that use both can't be "
                "read with one Library: give each its own"
            )
        return known is definition

    def replace(self, definition: InterfaceDefinition) -> None:
        """Store a definition, replacing the stored one, if any."""
        self._known[definition.ros, definition.name] = definition

    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the stored definition."""
        found = self._known.get((ros, name))
        return () if found is None else (found,)

    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of the stored definitions."""
        return [name for version, name in list(self._known) if version == ros]

    def describe(self, ros: int) -> str:
        """Describe how many definitions were received."""
        count = len(list(self.names(ros)))
        return f"{self.name} ({count} received)" if count else ""


def difference(one: InterfaceDefinition, other: InterfaceDefinition) -> str:
    """Describe how two definitions of a type differ on the wire; empty if they do not.

    Compares what the hashes cover: fields and, in ROS 1, constants. Field types that are messages
    are compared by name: their own definitions are compared when they are looked up.
    """
    if one is other:
        return ""
    if isinstance(one, Definition) and isinstance(other, Definition):
        return _message_difference(one, other)
    if isinstance(one, ServiceDefinition) and isinstance(other, ServiceDefinition):
        pairs = {
            "request": (one.request, other.request),
            "response": (one.response, other.response),
        }
    elif isinstance(one, ActionDefinition) and isinstance(other, ActionDefinition):
        pairs = {
            "goal": (one.goal, other.goal),
            "result": (one.result, other.result),
            "feedback": (one.feedback, other.feedback),
        }
    else:
        return "they are different kinds of interfaces"
    for part, (first, second) in pairs.items():
        found = _message_difference(first, second)
        if found:
            return f"in the {part} {found}"
    return ""


def _message_difference(one: Definition, other: Definition) -> str:
    first = [f"{field.type} {field.name}" for field in one.fields]
    second = [f"{field.type} {field.name}" for field in other.fields]
    if one.ros == 1:
        first += [f"{c.type} {c.name}={c.value}" for c in one.constants]
        second += [f"{c.type} {c.name}={c.value}" for c in other.constants]
    if first == second:
        return ""
    for ours, theirs in zip(first, second, strict=False):
        if ours != theirs:
            return f"the first has {ours!r} where the second has {theirs!r}"
    longer = "first" if len(first) > len(second) else "second"
    extra = max(first, second, key=len)[min(len(first), len(second))]
    return f"only the {longer} has {extra!r}"


#: Environment variables that name the folders of a workspace.
_VARIABLES = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH")
_MAX_DEPTH = 12
_MAX_FOLDERS = 20_000
_IGNORE_FILES = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "NOBUILD")
_BOTH = frozenset((1, 2))
_ROS1, _ROS2 = frozenset((1,)), frozenset((2,))

_XML_COMMENT = r"(?s)<!--.*?-->"
_XML_NAME = r"<name>\s*([^<\s]+)\s*</name>"
_XML_ROS_VERSIONS = (
    (1, r">\s*(?:catkin|message_generation|genmsg)\s*<"),
    (2, r">\s*(?:ament_\w+|rosidl_\w+)\s*<"),
)


class _Package(NamedTuple):
    name: str
    path: str
    ros_versions: frozenset[int]


class _Root:
    """A folder to search, scanned when it is first used.

    Args:
        path: A package, a tree of packages, or a prefix with ``share/<package>`` in it.
        ros_versions: ROS versions its packages are for; a ``package.xml`` can narrow it.
    """

    def __init__(self, path: str, ros_versions: frozenset[int]) -> None:
        self.path, self.ros_versions = path, ros_versions
        self._packages: dict[str, list[_Package]] | None = None
        self._share = ""
        if basename(path) == "share":
            self._share = path
        elif isdir(join(path, "share")) and not isfile(join(path, "package.xml")):
            self._share = join(path, "share")

    def packages(self, name: str) -> Iterable[_Package]:
        """Return the packages of a name, the preferred one first."""
        if self._share:
            path = join(self._share, name)
            return (_Package(name, path, self.ros_versions),) if isdir(path) else ()
        return self._scanned().get(name, ())

    def all_packages(self) -> Iterable[_Package]:
        """Return all packages."""
        if self._share:
            names = sorted(entry.name for entry in os.scandir(self._share) if entry.is_dir())
            return [_Package(name, join(self._share, name), self.ros_versions) for name in names]
        return [package for packages in self._scanned().values() for package in packages]

    def _scanned(self) -> Mapping[str, list[_Package]]:
        if self._packages is None:
            found: dict[str, list[_Package]] = {}
            for package in _scan(self.path, self.ros_versions):
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
                if ros in package.ros_versions:
                    provider = f"{self.name} {root.path}"
                    found = find_in_package(package.path, name, ros, provider)
                    if found is not None:
                        return (found,)
        return ()

    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of all types in the folders."""
        for root in self._roots:
            for package in root.all_packages():
                if ros in package.ros_versions:
                    yield from list_package(package.path, package.name, ros)

    def package(self, name: str) -> str:
        """Return the folder of a package, of either ROS; empty if there is none."""
        found = (package.path for root in self._roots for package in root.packages(name))
        return next(found, "")

    def packages(self) -> dict[str, str]:
        """Return the folders of all packages by name; the first of each name."""
        found: dict[str, str] = {}
        for root in self._roots:
            for package in root.all_packages():
                found.setdefault(package.name, package.path)
        return found

    def describe(self, ros: int) -> str:
        """Name the folders."""
        paths = [root.path for root in self._roots if ros in root.ros_versions]
        return f"{self.name} ({', '.join(paths)})" if paths else ""


def workspace(environment: Mapping[str, str]) -> Folders:
    """Return the provider for the sourced workspace.

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
    """Return the environment variables that :func:`workspace` depends on."""
    return tuple(map(environment.get, _VARIABLES))


def _paths(environment: Mapping[str, str], variable: str) -> Iterator[str]:
    for path in environment.get(variable, "").split(os.pathsep):
        if path and isdir(path):
            yield path.rstrip("/") or path


def find_in_package(folder: str, name: str, ros: int, provider: str) -> InterfaceDefinition | None:
    """Parse the file of a type in a package's folder, None if there is no such file.

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


def _scan(root: str, ros_versions: frozenset[int]) -> Iterator[_Package]:
    """Find the packages below a folder; as with catkin and colcon, none inside another."""
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
        package = _package(folder, entries, ros_versions)
        if package is not None:
            yield package
        elif depth < _MAX_DEPTH:
            pending.extend(
                (entry.path, depth + 1)
                for name, entry in sorted(entries.items())
                if not name.startswith(".") and entry.is_dir()
            )


def _warn_too_many(root: str) -> None:
    _log.warning(
        "stopped looking for packages in %s after %d folders; name the packages' own folders "
        "instead",
        root,
        _MAX_FOLDERS,
    )


def _package(
    folder: str, entries: Mapping[str, os.DirEntry[str]], ros_versions: frozenset[int]
) -> _Package | None:
    """Return the package in a folder; None if there is none."""
    if "package.xml" in entries:
        xml = re.sub(_XML_COMMENT, "", _read(join(folder, "package.xml")))
        match = re.search(_XML_NAME, xml)
        said = frozenset(ros for ros, pattern in _XML_ROS_VERSIONS if re.search(pattern, xml))
        name = match.group(1) if match else basename(folder)
        return _Package(name, folder, (said & ros_versions) if said else ros_versions)
    if any(kind in entries for kind in KINDS) and any(list_package(folder, "", 2)):
        return _Package(basename(folder), folder, ros_versions)
    return None


#: Known distributions by ROS version, in the order in which a type is looked for.
DISTRIBUTIONS: dict[int, tuple[str, ...]] = {
    1: ("noetic",),
    2: ("jazzy", "kilted", "lyrical", "iron", "humble", "galactic", "foxy", "eloquent", "dashing"),
}

_HERE = dirname(__file__)
_BLOCK = re.compile(r"^=== (\S+)(.*)\n", re.MULTILINE)


class _Block(NamedTuple):
    distributions: tuple[str, ...]
    start: int
    end: int


@lru_cache(maxsize=2)
def _bundle(ros: int) -> tuple[str, Mapping[str, tuple[_Block, ...]]]:
    with open(join(_HERE, "distributions", f"ros{ros}.txt"), encoding="utf-8") as file:
        text = file.read()
    heads = list(_BLOCK.finditer(text))
    blocks: dict[str, tuple[_Block, ...]] = {}
    for index, head in enumerate(heads):
        end = heads[index + 1].start() if index + 1 < len(heads) else len(text)
        distributions = tuple(head.group(2).split()) or DISTRIBUTIONS[ros]
        name = head.group(1)
        blocks[name] = (*blocks.get(name, ()), _Block(distributions, head.end(), end))
    return text, blocks


class Distributions(Provider):
    """The definitions of the ROS distributions, those of the preferred one first.

    Args:
        preferred: A distribution's name; by default the environment's ``ROS_DISTRO`` if it is a
            known one, else Jazzy (ROS 2) and Noetic (ROS 1).

    Raises:
        UnsupportedError: `preferred` is not a known distribution.
    """

    name = "distribution"

    def __init__(self, preferred: str = "") -> None:
        known = [name for names in DISTRIBUTIONS.values() for name in names]
        if preferred and preferred not in known:
            raise UnsupportedError(
                f"there are no definitions of a distribution {preferred!r}; known: "
                f"{', '.join(known)}. Add a folder with its definitions by Library.add_path()"
            )
        self._preferred = preferred or os.environ.get("ROS_DISTRO", "")

    def order(self, ros: int) -> tuple[str, ...]:
        """Return the distributions in the order of preference."""
        names = DISTRIBUTIONS[ros]
        if self._preferred not in names:
            return names
        return (self._preferred, *(name for name in names if name != self._preferred))

    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the definitions of all distributions, the preferred one's first."""
        text, blocks = _bundle(ros)
        found: list[InterfaceDefinition] = []
        seen: set[int] = set()
        variants = blocks.get(name, ())
        for distribution in self.order(ros) if variants else ():
            for block in variants:
                if distribution in block.distributions and block.start not in seen:
                    seen.add(block.start)
                    found.append(
                        parse_message(
                            text[block.start : block.end].rstrip("\n"),
                            name,
                            ros=ros,
                            file=f"<{name} of {distribution}>",
                            provider=f"rosbags {distribution}",
                        )
                    )
        if found:
            return found
        package = name.partition("/")[0]
        extra = find_in_package(
            join(_HERE, "definitions", f"ros{ros}", package), name, ros, "rosglass definitions"
        )
        return () if extra is None else (extra,)

    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of all types of all distributions."""
        yield from _bundle(ros)[1]
        folder = join(_HERE, "definitions", f"ros{ros}")
        for package in sorted(os.listdir(folder)):
            yield from list_package(join(folder, package), package, ros)

    def describe(self, ros: int) -> str:
        """Name the distributions."""
        return f"{self.name} sets ({', '.join(self.order(ros))})"

    def views(self, ros: int) -> Iterator[Provider]:
        """Yield the sets of one distribution after the other."""
        for distribution in self.order(ros):
            yield Distributions(distribution)
