"""Finds the plugins of RQml: in the install spaces of ROS 2, and in source trees."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.comm.text_files import check_yaml, explain_yaml_error, load_pyyaml

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

__all__ = ["FoundPlugins", "RqmlPlugin", "find_plugins"]

_RESOURCES = "share/ament_index/resource_index/rqml_plugin"
_SOURCE_NAME = "rqml_plugins.yaml.in"
_PROJECT = "@PROJECT_NAME@"
#: Maximum bytes of a declaration, and folders of a source tree that are looked at.
_MAX_BYTES, _MAX_FOLDERS = 1 << 20, 20_000
#: Folders of a workspace that hold copies of its sources.
_BUILT = {"build", "install", "log", "node_modules", "__pycache__"}
_KEYS = ("id", "name", "group", "path", "single_instance")
_TRUTHS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
_CMAKE_PROJECT = re.compile(r"^\s*project\s*\(\s*([\w.-]+)", re.IGNORECASE | re.MULTILINE)
_PACKAGE_NAME = re.compile(r"<name>\s*([\w.-]+)\s*</name>")


class RqmlPlugin(NamedTuple):
    """A plugin of RQml: one QML file.

    Attributes:
        id: Its name for programs, such as ``default_plugins.console``.
        name: Its name for people.
        group: Menu that it belongs to; may be empty.
        path: The QML file.
        source: The file for `Plugin.source`: ``package://PACKAGE/...`` if it is installed.
        package: The ROS package that declares it.
        single_instance: Whether only one may be shown at a time.
        declared: Where it is declared, as ``file:line``.
    """

    id: str
    name: str
    group: str
    path: Path
    source: str
    package: str
    single_instance: bool
    declared: str


class FoundPlugins(NamedTuple):
    """The plugins found, by group and name, and what is wrong with others.

    Attributes:
        plugins: Those that can be loaded.
        problems: Errors as ``file:line: text``.
    """

    plugins: tuple[RqmlPlugin, ...]
    problems: tuple[str, ...]


class _Tree(NamedTuple):
    """The files of a declaration.

    Attributes:
        file: The declaration.
        package: The package that it belongs to.
        root: Install space, or folder of the package's sources.
        installed: Whether `root` is an install space.
    """

    file: Path
    package: str
    root: Path
    installed: bool


def find_plugins(
    environment: Mapping[str, str], folders: Iterable[str | os.PathLike[str]] = ()
) -> FoundPlugins:
    """Find plugins of RQml; reads files, so call it outside the GUI thread.

    Args:
        environment: ``AMENT_PREFIX_PATH``: install spaces, of which the first has priority.
        folders: Source trees with ``rqml_plugins.yaml.in``; they have priority over install spaces.
    """
    problems: list[str] = []
    plugins: dict[str, RqmlPlugin] = {}
    sources = list(_source_trees(folders, problems))
    overlaid = {tree.package for tree in sources}
    for tree in (*sources, *_installed(environment, overlaid, problems)):
        for plugin in _declared(tree, problems):
            first = plugins.setdefault(plugin.id, plugin)
            if first is not plugin:
                problems.append(
                    f"{plugin.declared}: the id {plugin.id!r} is declared at {first.declared} "
                    "already; this plugin is left out"
                )
    ordered = sorted(
        plugins.values(), key=lambda p: (p.group.casefold(), p.name.casefold(), p.id.casefold())
    )
    return FoundPlugins(tuple(ordered), tuple(problems))


def _installed(
    environment: Mapping[str, str], overlaid: Iterable[str], problems: list[str]
) -> Iterator[_Tree]:
    """Yield the declarations in install spaces; of one package, only the first.

    Args:
        environment: ``AMENT_PREFIX_PATH``.
        overlaid: Packages to leave out.
        problems: Errors are added to it.
    """
    seen = set(overlaid)
    for prefix in filter(None, environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        folder = Path(prefix, _RESOURCES)
        try:
            names = sorted(entry.name for entry in folder.iterdir())
        except FileNotFoundError:
            continue
        except OSError as error:
            problems.append(f"{folder}: it cannot be read: {error.strerror}")
            continue
        for name in names:
            if name not in seen and not name.startswith("."):
                seen.add(name)
                yield _Tree(folder / name, name, Path(prefix), installed=True)


def _source_trees(
    folders: Iterable[str | os.PathLike[str]], problems: list[str]
) -> Iterator[_Tree]:
    """Yield the declarations in source trees."""
    seen: set[Path] = set()
    for given in folders:
        top = Path(given).absolute()
        if not top.is_dir():
            problems.append(f"{given}: there is no such folder")
            continue
        left = _MAX_FOLDERS
        for place, inside, names in os.walk(top):
            left -= 1
            if not left:
                problems.append(
                    f"{given}: more than {_MAX_FOLDERS} folders; plugins of RQml in the others are "
                    "not found: name the folder of their package"
                )
                break
            inside[:] = sorted(
                name
                for name in inside
                if not name.startswith(".")
                and name not in _BUILT
                and not Path(place, name, "COLCON_IGNORE").exists()
            )
            file = Path(place, _SOURCE_NAME)
            if _SOURCE_NAME in names and file not in seen:
                seen.add(file)
                package, root = _package_of(file, top)
                yield _Tree(file, package, root, installed=False)


def _package_of(file: Path, top: Path) -> tuple[str, Path]:
    """Return the name and folder of the package around a file; else those of the file's folder."""
    for folder in (file.parent, *file.parent.parents):
        for name, pattern in (("package.xml", _PACKAGE_NAME), ("CMakeLists.txt", _CMAKE_PROJECT)):
            try:
                found = pattern.search(Path(folder, name).read_text("utf-8", "replace"))
            except OSError:
                continue
            if found is not None:
                return found[1], folder
        if folder == top.parent:  # `top` may be a folder inside a package
            break
    return file.parent.name, file.parent


def _declared(tree: _Tree, problems: list[str]) -> Iterator[RqmlPlugin]:
    """Yield the plugins of a declaration whose files exist."""
    yaml = load_pyyaml()
    try:
        if tree.file.stat().st_size > _MAX_BYTES:
            problems.append(f"{tree.file}: larger than {_MAX_BYTES >> 20} MiB")
            return
        text = tree.file.read_text(encoding="utf-8")
        check_yaml(text)
        root = yaml.compose(text.replace(_PROJECT, tree.package), Loader=yaml.SafeLoader)
    except OSError as error:
        problems.append(f"{tree.file}: it cannot be read: {error.strerror}")
        return
    except UnicodeError:
        problems.append(f"{tree.file}: this is not text in UTF-8")
        return
    except (yaml.YAMLError, RecursionError) as error:
        problems.append(explain_yaml_error(error, str(tree.file), "not YAML"))
        return
    listed = _value(root, "plugins")
    if not isinstance(listed, yaml.SequenceNode):
        line = _line(listed if listed is not None else root)
        problems.append(f"{tree.file}:{line}: expected a list under the key 'plugins'")
        return
    for entry in listed.value:
        plugin = _plugin(tree, entry, problems)
        if plugin is not None:
            yield plugin


def _plugin(tree: _Tree, entry: Any, problems: list[str]) -> RqmlPlugin | None:
    """Return a plugin of the list; None, with the reason among the problems, if it is not valid."""
    place = f"{tree.file}:{_line(entry)}"
    if not isinstance(getattr(entry, "value", None), list) or not all(
        isinstance(pair, tuple) for pair in entry.value
    ):
        problems.append(f"{place}: expected a plugin with {', '.join(_KEYS)}")
        return None
    texts: dict[str, str] = {}
    for key, value in entry.value:
        where = f"{tree.file}:{_line(key)}"
        if key.value not in _KEYS:
            hint = similar(str(key.value), _KEYS) or f"; the keys are {', '.join(_KEYS)}"
            problems.append(f"{where}: {key.value!r:.80} is not a key of a plugin{hint}")
        elif not isinstance(value.value, str):
            problems.append(f"{where}: {key.value}: expected a text")
            return None
        else:
            texts[key.value] = value.value.strip()
    missing = [name for name in ("id", "name", "path") if not texts.get(name)]
    if missing:
        problems.append(f"{place}: the plugin has no {' and no '.join(missing)}")
        return None
    single = texts.get("single_instance", "false").lower()
    if single not in _TRUTHS:
        problems.append(f"{place}: single_instance: expected true or false, got {single!r:.80}")
        return None
    path = _file_of(tree, texts["path"])
    if path is None:
        problems.append(
            f"{place}: {texts['id']}: there is no file {Path(tree.root, _inside(tree, texts))}"
        )
        return None
    share = Path(tree.root, "share", tree.package)
    inside = tree.installed and path.is_relative_to(share)
    source = f"package://{tree.package}/{path.relative_to(share).as_posix()}" if inside else ""
    return RqmlPlugin(
        id=texts["id"],
        name=texts["name"],
        group=texts.get("group", ""),
        path=path,
        source=source or str(path),
        package=tree.package,
        single_instance=_TRUTHS[single],
        declared=place,
    )


def _inside(tree: _Tree, texts: Mapping[str, str]) -> str:
    return texts["path"] if tree.installed else _from_sources(tree, texts["path"])


def _from_sources(tree: _Tree, path: str) -> str:
    """Return the place in the package's sources of a file that is installed in its share folder."""
    return path.removeprefix(f"share/{tree.package}/")


def _file_of(tree: _Tree, path: str) -> Path | None:
    """Return a plugin's file; None if it does not exist."""
    if tree.installed:
        file = Path(tree.root, path)
        return file if file.is_file() else None
    file = Path(tree.root, _from_sources(tree, path))
    if file.is_file():
        return file
    # CMake may install a folder under another name.
    found = _named(tree.root, file.name)
    return found[0] if len(found) == 1 else None


def _named(root: Path, name: str) -> Sequence[Path]:
    """Return the files of a package that have a name."""
    found: list[Path] = []
    for place, inside, names in os.walk(root):
        inside[:] = [n for n in inside if not n.startswith(".") and n not in _BUILT]
        if name in names:
            found.append(Path(place, name))
    return found


def _value(node: Any, key: str) -> Any:
    """Return the node of a mapping's key; None without it."""
    pairs = node.value if node is not None and isinstance(node.value, list) else []
    return next(
        (pair[1] for pair in pairs if isinstance(pair, tuple) and pair[0].value == key), None
    )


def _line(node: Any) -> int:
    return 1 if node is None else int(node.start_mark.line) + 1
