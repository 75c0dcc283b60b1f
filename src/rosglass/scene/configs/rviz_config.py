"""RViz's config files (``.rviz``), of RViz 1 and RViz 2: displays, tools, views and settings.

An :class:`RvizConfig` is the file's own tree of dicts and lists, in which each display, tool and
view is an entry (:class:`DisplayConfig` ...). Whatever rosglass does not use stays in the tree, in
its order, and is written back.

RViz reads every value as text. Here, ``true``, ``false`` and numbers become Python's, and all else
stays text, as do numbers that would be written differently (``0.50``, ``1.10``, ``007``), since
they may be names. Read settings with the functions of :mod:`rosglass.scene.configs.rviz_formats`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from rosglass.comm.text_files import check_yaml, explain_yaml_error, write_text
from rosglass.errors import Error, ParameterError, shown
from rosglass.scene.configs.rviz_formats import (
    DISPLAYS,
    TOOLS,
    VIEWS,
    class_id_of,
    display_type,
    read_bool,
    read_color,
    read_number,
    require_ros,
    ros_of,
    setting_text,
    type_of,
    write_color,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator, Mapping, Sequence

__all__ = ["DisplayConfig", "RvizConfig", "ToolConfig", "ViewConfig"]

#: Maximum size of a file. RViz writes some 10 kB; robots with hundreds of links 1 MB.
_MAX_BYTES = 5_000_000
#: Maximum number of values in a file, with aliases expanded.
_MAX_VALUES = 200_000
#: Maximum levels of nesting of what is written; reading has the limit of `check_yaml`.
_MAX_DEPTH = 100
_MAX_WARNINGS = 100

_MANAGER = "Visualization Manager"
_DEFAULT_BACKGROUND = "48; 48; 48"
_DEFAULT_FRAME_RATE_HZ = 30

# -- entries ---------------------------------------------------------------------------------------


@dataclass
class _Entry:
    """A mapping with a class: what displays, tools and views have in common."""

    #: All that stands in the file's mapping, in its order, e.g. ``Class``, ``Name``, ``Alpha``.
    settings: dict[str, Any]
    #: Line in the file; 0 for new ones.
    line: int = field(default=0, compare=False)

    _TABLE: ClassVar[dict[str, tuple[str, str]]] = {}

    @property
    def class_id(self) -> str:
        """The plugin's class, e.g. ``rviz/Grid``; empty if the file has none."""
        return setting_text(self.settings.get("Class"))

    @property
    def type(self) -> str:
        """The type, the same for both RViz, e.g. ``Grid``; empty if it is not one of RViz's."""
        return type_of(self._TABLE, self.class_id)

    @property
    def name(self) -> str:
        """The name; of displays and saved views the one that the user gave."""
        return setting_text(self.settings.get("Name")) or self.type or self.class_id

    @name.setter
    def name(self, name: str) -> None:
        self.settings["Name"] = name


@dataclass
class DisplayConfig(_Entry):
    """A display, or a group of displays."""

    _TABLE: ClassVar[dict[str, tuple[str, str]]] = DISPLAYS

    @classmethod
    def new(
        cls,
        type: str,
        ros: int = 2,
        *,
        name: str = "",
        enabled: bool = True,
        settings: Mapping[str, Any] | None = None,
    ) -> DisplayConfig:
        """Return a display that is not in a file yet.

        Args:
            type: Its type, e.g. ``Grid``, or the id of a plugin of others.
            ros: The RViz that it is for, 1 or 2.
            name: Its name; by default the type's.
            enabled: Whether it is shown.
            settings: Its settings, in the form of that RViz.

        Raises:
            Error: That RViz has no such type.
        """
        class_id = class_id_of(DISPLAYS, type, ros)
        own = {
            "Class": class_id,
            "Enabled": enabled,
            "Name": name or type.rpartition("/")[2],
        }
        if type == "Group":
            own["Displays"] = []
        else:
            own["Value"] = enabled
        return cls(_sorted({**(settings or {}), **own}))

    @property
    def enabled(self) -> bool:
        """True if the display is shown."""
        given = self.settings.get("Enabled", self.settings.get("Value", True))
        try:
            return read_bool(given)
        except Error:
            return True

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self.settings["Enabled"] = enabled
        # RViz writes it twice, but groups once.
        if "Value" in self.settings or not self.is_group:
            self.settings["Value"] = enabled

    @property
    def is_group(self) -> bool:
        """True for a group of displays."""
        return self.type == "Group"

    @property
    def displays(self) -> list[DisplayConfig]:
        """The displays of a group, to be changed in place; empty for all others."""
        if not self.is_group:
            return []
        found: list[DisplayConfig] = self.settings.setdefault("Displays", [])
        return found


@dataclass
class ToolConfig(_Entry):
    """A tool of the tool bar."""

    _TABLE: ClassVar[dict[str, tuple[str, str]]] = TOOLS

    @classmethod
    def new(
        cls, type: str, ros: int = 2, *, settings: Mapping[str, Any] | None = None
    ) -> ToolConfig:
        """Return a tool that is not in a file yet; see :meth:`DisplayConfig.new`."""
        return cls(_sorted({**(settings or {}), "Class": class_id_of(TOOLS, type, ros)}))


@dataclass
class ViewConfig(_Entry):
    """The camera's view, or a saved one."""

    _TABLE: ClassVar[dict[str, tuple[str, str]]] = VIEWS

    @classmethod
    def new(
        cls,
        type: str,
        ros: int = 2,
        *,
        name: str = "Current View",
        settings: Mapping[str, Any] | None = None,
    ) -> ViewConfig:
        """Return a view that is not in a file yet; see :meth:`DisplayConfig.new`."""
        class_id = class_id_of(VIEWS, type, ros)
        package, _, label = class_id.rpartition("/")
        own = {"Class": class_id, "Name": name, "Value": f"{label} ({package})"}
        return cls(_sorted({**(settings or {}), **own}))


_E = TypeVar("_E", DisplayConfig, ToolConfig, ViewConfig)


def _sorted(settings: dict[str, Any]) -> dict[str, Any]:
    """Return settings in the order in which RViz writes them."""
    return dict(sorted(settings.items()))


# -- the file --------------------------------------------------------------------------------------


class RvizConfig:
    """An RViz config.

    ```python
    config = RvizConfig.load("robot.rviz")
    for display in config.walk():
        print(display.type or display.class_id, display.name, display.settings.get("Alpha"))
    config.fixed_frame = "odom"
    config.displays.append(DisplayConfig.new("Grid", config.ros, settings={"Cell Size": 2}))
    config.save("robot.rviz")
    ```

    Args:
        ros: The RViz that a new config is for, 1 or 2.
    """

    def __init__(self, ros: int = 2) -> None:
        package = "rviz" if require_ros(ros) == 1 else "rviz_common"
        panels = ("Displays", "Selection", "Tool Properties", "Views", "Time")
        manager: dict[str, Any] = {
            "Class": "",
            "Displays": [],
            "Enabled": True,
            "Global Options": {
                "Background Color": _DEFAULT_BACKGROUND,
                "Fixed Frame": "map",
                "Frame Rate": _DEFAULT_FRAME_RATE_HZ,
            },
            "Name": "root",
            "Tools": [],
            "Value": True,
            "Views": {"Saved": []},
        }
        if ros == 2:
            manager["Transformation"] = {"Current": {"Class": "rviz_default_plugins/TF"}}
        #: The RViz that the file is from, and is written for: 1 or 2.
        self.ros = ros
        #: The file's path, for messages.
        self.source = ""
        #: Problems of single entries, e.g. displays without a class, a line for each.
        self.warnings: list[str] = []
        #: The file's tree.
        self.root: dict[str, Any] = {
            "Panels": [{"Class": f"{package}/{name}", "Name": name} for name in panels],
            _MANAGER: _sorted(manager),
        }

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> RvizConfig:
        """Return the config of a file.

        Raises:
            Error: It cannot be read, or is not an RViz config; the error names file and line.
        """
        try:
            file = Path(path)
            if not file.is_file():
                raise Error(f"{path}: there is no such file")
            with file.open("rb") as opened:
                data = opened.read(_MAX_BYTES + 1)
        except OSError as error:
            raise Error(f"{path} cannot be read: {error.strerror or error}") from None
        except TypeError:
            raise Error(f"{path!r:.200} is not a valid path") from None
        source = str(file)
        if len(data) > _MAX_BYTES:
            raise Error(f"{source}: more than {_MAX_BYTES} bytes, too many for an RViz config")
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            raise Error(f"{source}:{line}: this is not UTF-8 text") from None
        return cls.parse(text, source)

    @classmethod
    def parse(cls, text: str, source: str = "RViz config") -> RvizConfig:
        """Return the config of a text.

        Args:
            text: The text.
            source: Its origin, for messages.

        Raises:
            Error: It is not an RViz config; the error names source and line.
        """
        import yaml  # noqa: PLC0415 - few programs need it

        if len(text) > _MAX_BYTES:
            raise Error(f"{source}: more than {_MAX_BYTES} characters, too many for an RViz config")
        try:
            check_yaml(text, _MAX_VALUES)
            # BaseLoader gives all scalars as text.
            loader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
            node = yaml.compose(text, Loader=loader)
        except yaml.YAMLError as error:
            raise Error(explain_yaml_error(error, source, "not a valid RViz config")) from None
        reader = _Reader(source)
        config = cls()
        config.source, config.root, config.warnings = source, reader.root(node), reader.warnings
        config.ros = config._find_ros()
        config._check_options()
        if reader.skipped:
            config.warnings.append(f"{source}: and {reader.skipped} more")
        return config

    def dump(self) -> str:
        """Return the text of the file.

        Raises:
            Error: It has a value that RViz cannot read; the error has its path.
        """
        import yaml  # noqa: PLC0415

        options: dict[str, Any] = {"allow_unicode": True, "default_flow_style": False}
        plain = _plain(self.root, (), _MAX_DEPTH)
        return str(yaml.dump(plain, Dumper=_dumper(), sort_keys=False, width=1 << 30, **options))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Replace a file atomically.

        Raises:
            Error: It cannot be written; see also :meth:`dump`.
        """
        text = self.dump()
        try:
            write_text(path, text)
        except ParameterError as error:
            raise Error(str(error)) from None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RvizConfig):
            return NotImplemented
        return self.ros == other.ros and self.root == other.root

    __hash__ = None  # type: ignore[assignment]

    # What follows reads and writes the tree; a file may lack any part of it.

    @property
    def manager(self) -> dict[str, Any]:
        """The mapping ``Visualization Manager``: displays, tools, views and global options."""
        return _child(self.root, _MANAGER)

    @property
    def displays(self) -> list[DisplayConfig]:
        """The displays, to be changed in place."""
        found: list[DisplayConfig] = self.manager.setdefault("Displays", [])
        return found

    @property
    def tools(self) -> list[ToolConfig]:
        """The tools, to be changed in place."""
        found: list[ToolConfig] = self.manager.setdefault("Tools", [])
        return found

    @property
    def current_view(self) -> ViewConfig | None:
        """The camera's view; None if the file has none."""
        found: ViewConfig | None = _child(self.manager, "Views").get("Current")
        return found

    @current_view.setter
    def current_view(self, view: ViewConfig) -> None:
        _child(self.manager, "Views")["Current"] = view

    @property
    def saved_views(self) -> list[ViewConfig]:
        """The saved views, to be changed in place."""
        found: list[ViewConfig] = _child(self.manager, "Views").setdefault("Saved", [])
        return found

    @property
    def options(self) -> dict[str, Any]:
        """The mapping ``Global Options``."""
        return _child(self.manager, "Global Options")

    @property
    def fixed_frame(self) -> str:
        """The frame that everything is shown in, as in the file: RViz 1 may write ``/map``."""
        return setting_text(self.options.get("Fixed Frame")) or "map"

    @fixed_frame.setter
    def fixed_frame(self, frame: str) -> None:
        self.options["Fixed Frame"] = frame

    @property
    def background_color(self) -> tuple[float, float, float, float]:
        """The background's colour, as red, green, blue and alpha from 0 to 1."""
        try:
            return read_color(self.options.get("Background Color", _DEFAULT_BACKGROUND))
        except Error:
            return read_color(_DEFAULT_BACKGROUND)

    @background_color.setter
    def background_color(self, color: Sequence[float]) -> None:
        self.options["Background Color"] = write_color(color, "Background Color")

    @property
    def panels(self) -> list[Any]:
        """The mappings of RViz's panels, each with its ``Class``, e.g. ``rviz/Displays``."""
        found = self.root.get("Panels")
        return found if isinstance(found, list) else []

    def walk(self) -> Iterator[DisplayConfig]:
        """Iterate over all displays, each group before its displays."""
        stack = [iter(self.displays)]
        while stack:
            display = next(stack[-1], None)
            if display is None:
                stack.pop()
                continue
            yield display
            stack.append(iter(display.displays))

    def _find_ros(self) -> int:
        """Return the RViz that wrote the file, by the packages of its plugins."""
        entries: list[_Entry] = [*self.walk(), *self.tools, *self.saved_views]
        if self.current_view:
            entries.append(self.current_view)
        ids = [entry.class_id for entry in entries]
        ids += [
            setting_text(panel.get("Class")) for panel in self.panels if isinstance(panel, dict)
        ]
        found = [ros_of(class_id) for class_id in ids]
        return 1 if found.count(1) > found.count(2) else 2

    def _check_options(self) -> None:
        """Warn about global options that are not valid; the defaults are used instead."""
        checks: dict[str, Callable[[Any, str], Any]] = {
            "Background Color": read_color,
            "Frame Rate": lambda value, name: read_number(value, name, minimum=1),
        }
        for name, check in checks.items():
            if name in self.options:
                try:
                    check(self.options[name], name)
                except Error as error:
                    self.warnings.append(f"{self.source}: Global Options: {error}")


def _child(mapping: dict[str, Any], key: str, *, create: bool = True) -> dict[str, Any]:
    """Return a mapping below another one; an empty one if there is none."""
    found = mapping.get(key)
    if not isinstance(found, dict):
        found = {}
        if create:
            mapping[key] = found
    return found


# -- YAML ------------------------------------------------------------------------------------------

_INT = re.compile(r"(0|-?[1-9][0-9]{0,17})\Z")
_FLOAT = re.compile(r"-?[0-9]{1,20}(\.[0-9]{1,30})?(e[-+][0-9]{2,3})?\Z")
_NULLS = ("", "~", "null", "Null", "NULL")


def _from_text(text: str) -> Any:
    """Return the value of an unquoted text."""
    if text in _NULLS:
        return None
    if text in {"true", "false"}:
        return text == "true"
    if _INT.match(text):
        return int(text)
    # Others stay text, so that they are written as they were read.
    if _FLOAT.match(text) and repr(float(text)) == text:
        return float(text)
    return text


class _Reader:
    """Makes the tree of a file from PyYAML's nodes."""

    def __init__(self, source: str) -> None:
        self._source = source
        self.warnings: list[str] = []
        #: Number of warnings beyond the limit.
        self.skipped = 0

    def root(self, node: Any) -> dict[str, Any]:
        if node is None:
            raise Error(f"{self._source}: the file is empty; expected an RViz config")
        root = self._mapping(node, "the file", {_MANAGER: self._manager})
        if _MANAGER not in root:
            raise Error(
                f"{self._source}:{_line(node)}: this is not an RViz config: {_MANAGER!r} is missing"
            )
        return root

    def _manager(self, node: Any) -> dict[str, Any]:
        return self._mapping(
            node,
            _MANAGER,
            {
                "Displays": self._displays,
                "Tools": lambda inner: self._list(inner, "Tools", ToolConfig),
                "Views": self._views,
                "Global Options": lambda inner: self._mapping(inner, "Global Options", {}),
            },
        )

    def _views(self, node: Any) -> dict[str, Any]:
        saved = lambda inner: self._list(inner, "Saved", ViewConfig)  # noqa: E731
        current = lambda inner: self._entry(inner, "Current", ViewConfig)  # noqa: E731
        return self._mapping(node, "Views", {"Current": current, "Saved": saved})

    def _displays(self, node: Any) -> list[DisplayConfig]:
        return self._list(node, "Displays", DisplayConfig)

    def _group(self, node: Any) -> list[DisplayConfig]:
        if node.id != "sequence" and not _is_null(node):
            self._warn(node, "Displays: expected a list of mappings; the group is empty")
            return []
        return self._displays(node)

    def _list(self, node: Any, name: str, entry_class: type[_E]) -> list[_E]:
        if _is_null(node):
            return []
        if node.id != "sequence":
            raise Error(f"{self._source}:{_line(node)}: {name} must be a list of mappings")
        entries = [self._entry(inner, name, entry_class) for inner in node.value]
        return [entry for entry in entries if entry is not None]

    def _entry(self, node: Any, name: str, entry_class: type[_E]) -> _E | None:
        if node.id != "mapping":
            if name != "Current" or not _is_null(node):
                self._warn(node, f"{name}: expected a mapping with a Class; this entry is left out")
            return None
        class_id = next((v.value for k, v in node.value if k.value == "Class"), "")
        is_group = entry_class is DisplayConfig and display_type(str(class_id)) == "Group"
        inner = {"Displays": self._group} if is_group else {}
        entry = entry_class(self._mapping(node, name, inner), _line(node))
        if not entry.class_id:
            self._warn(node, f"{name}: the entry {entry.name!r:.80} has no Class")
        return entry

    def _mapping(
        self, node: Any, name: str, special: Mapping[str, Callable[[Any], Any]]
    ) -> dict[str, Any]:
        """Return a mapping in which some keys have readers of their own."""
        if _is_null(node):
            return {}
        if node.id != "mapping":
            raise Error(f"{self._source}:{_line(node)}: {name} must be a mapping")
        found: dict[str, Any] = {}
        for key, inner in node.value:
            if key.id != "scalar":
                raise Error(f"{self._source}:{_line(key)}: {name}: a key must be a text")
            if key.value in found:
                self._warn(key, f"{name}: {key.value!r:.80} occurs twice; the last one counts")
            value = special.get(key.value, self._value)(inner)
            if value is not None or key.value not in special:
                found[key.value] = value
        return found

    def _value(self, node: Any) -> Any:
        if node.id == "mapping":
            return self._mapping(node, "a mapping", {})
        if node.id == "sequence":
            return [self._value(inner) for inner in node.value]
        return node.value if node.style else _from_text(node.value)

    def _warn(self, node: Any, text: str) -> None:
        if len(self.warnings) < _MAX_WARNINGS:
            self.warnings.append(f"{self._source}:{_line(node)}: {text}")
        else:
            self.skipped += 1


def _line(node: Any) -> int:
    return int(node.start_mark.line) + 1


def _is_null(node: Any) -> bool:
    return node.id == "scalar" and not node.style and node.value in _NULLS


def _plain(value: Any, path: tuple[str, ...], depth: int) -> Any:
    """Return a tree without entries; raise an Error at what RViz could not read."""
    if isinstance(value, _Entry):
        path, value = (*path[:-1], value.name), value.settings
    if isinstance(value, (dict, list, tuple)) and depth <= 0:
        raise Error(f"{_shown_path(path)}: more than {_MAX_DEPTH} levels cannot be saved")
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise Error(f"{_shown_path(path)}: a key must be a text, got {shown(key)}")
        return {key: _plain(inner, (*path, key), depth - 1) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner, (*path, str(at)), depth - 1) for at, inner in enumerate(value)]
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, (int, float)) and math.isfinite(value):
        # NumPy's numbers derive from Python's, but PyYAML does not know them.
        return int(value) if isinstance(value, int) else float(value)
    raise Error(f"{_shown_path(path)}: {shown(value)} cannot be saved in an RViz config")


def _shown_path(path: tuple[str, ...]) -> str:
    return "/".join(path)[-200:] or "the config"


def _dumper() -> Any:
    """Return a dumper that writes lists and values as RViz does."""
    import yaml  # noqa: PLC0415

    class Dumper(yaml.SafeDumper):
        def increase_indent(self, flow: bool = False, indentless: bool = False) -> Any:  # noqa: ARG002
            return super().increase_indent(flow, False)

        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002
            return True

    tag = "tag:yaml.org,2002:"

    def represent_text(dumper: Any, text: str) -> Any:
        return dumper.represent_scalar(f"{tag}str", text, style=None if text else '"')

    def represent_float(dumper: Any, number: float) -> Any:
        return dumper.represent_scalar(f"{tag}float", repr(number))

    def represent_none(dumper: Any, _none: None) -> Any:
        return dumper.represent_scalar(f"{tag}null", "~")

    Dumper.add_representer(str, represent_text)
    Dumper.add_representer(float, represent_float)
    Dumper.add_representer(type(None), represent_none)
    # PyYAML takes 1e-05 for text.
    pattern = re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+\Z")
    Dumper.add_implicit_resolver(f"{tag}float", pattern, list("-+0123456789"))
    return Dumper
