"""Layouts of other programs as layouts of the cockpit: of Foxglove, and configurations of RQml.

What has no counterpart is left out and listed, never guessed. The file is data from a stranger:
each of its texts becomes a literal of QML (:func:`to_qml`), topics and types have to be such names,
and a plugin is named by its id, never by a file.
"""

from __future__ import annotations

import json
import math
import re
from textwrap import indent
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.cockpit.first_layout import words_of
from rosglass.cockpit.qml_document import Document
from rosglass.cockpit.qml_values import Code, to_qml
from rosglass.comm.text_files import explain_yaml_error, load_pyyaml, load_yaml
from rosglass.errors import ArgumentError, Error, shown
from rosglass.messages import parse_path

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

__all__ = ["SUFFIXES", "ImportedLayout", "import_layout", "is_foreign"]

#: Suffixes of the files that are read here.
SUFFIXES = (".json", ".rqml", ".yaml", ".yml", ".perspective")
#: Bytes of a file, panels, and splits in each other, beyond which it is not a layout.
_MAX_BYTES, _MAX_PANELS, _MAX_DEPTH = 16 << 20, 500, 64
_MAX_TITLE = 80
#: Pixels of a window that can be meant.
_MAX_PIXELS = 32_768
_TOPIC = re.compile(r"[~/]?[A-Za-z_]\w*(?:/\w+)*", re.ASCII)
_TYPE = re.compile(r"[A-Za-z]\w*/(?:(?:msg|srv|action)/)?[A-Za-z]\w*", re.ASCII)
_FRAME = re.compile(r"[\w/.:-]{1,200}", re.ASCII)
_PLUGIN_ID = re.compile(r"[A-Za-z_][\w-]*(?:\.[\w-]+)*", re.ASCII)
_FOXGLOVE_PATH = re.compile(r'(?:"(?P<quoted>[^"]*)"|(?P<topic>[^.{\["]*))(?P<rest>.*)', re.DOTALL)
_PERSPECTIVE = (
    "perspectives of rqt are not read: their panels are programs of rqt, with settings that only "
    "these understand. Connect to the robot and choose 'New layout of what the robot offers', or "
    "add panels by hand (F4); plugins of RQml are in the catalogue if AMENT_PREFIX_PATH has them"
)


class ImportedLayout(NamedTuple):
    """A layout of another program as QML.

    Attributes:
        text: The QML of the layout.
        program: The program that it is of: ``Foxglove`` or ``RQml``.
        left_out: What is not as it was there, one line each.
    """

    text: str
    program: str
    left_out: tuple[str, ...]


def is_foreign(path: Path) -> bool:
    """Return whether a file is one of another program, by its suffix."""
    return path.suffix.lower() in SUFFIXES


def import_layout(path: Path, plugins: Mapping[str, str] | None = None) -> ImportedLayout:
    """Read a layout of Foxglove, or a configuration of RQml.

    Args:
        path: The file.
        plugins: Ids of the plugins of RQml that are installed, with their names.

    Raises:
        Error: The file cannot be read, is cut, or is of another program; what to do instead.
    """
    found = _read(path)
    title = path.stem[:_MAX_TITLE]
    if not isinstance(found, dict):
        raise Error(f"{path}: expected a layout, an object in braces; got {shown(found)}")
    if isinstance(found.get("data"), dict) and "configById" in found["data"]:
        found = found["data"]
    if "configById" in found:
        return _Foxglove(path, found).layout(title)
    if "mainWindows" in found or "allDockWidgets" in found:
        return _Rqml(path, found, plugins or {}).layout(title)
    if "keys" in found and "groups" in found:
        raise Error(f"{path}: {_PERSPECTIVE}")
    raise Error(
        f"{path}: this is neither a layout of Foxglove (which has configById) nor a configuration "
        "of RQml (which has mainWindows); export the layout in the program it is of, and open that "
        "file"
    )


def _read(path: Path) -> Any:
    if path.suffix.lower() == ".perspective":
        raise Error(f"{path}: {_PERSPECTIVE}")
    try:
        with path.open("rb") as opened:
            data = opened.read(_MAX_BYTES + 1)
    except OSError as error:
        raise Error(f"{path} cannot be read: {error.strerror or error}") from None
    if len(data) > _MAX_BYTES:
        raise Error(f"{path} has more than {_MAX_BYTES:,} bytes: it is not a layout")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Error(f"{path} is not UTF-8 text (byte {error.start}); export it again") from None
    try:
        if path.suffix.lower() in (".yaml", ".yml"):
            return _read_yaml(path, text)
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise Error(
            f"{path}:{error.lineno}:{error.colno}: this is not JSON: {error.msg}; the file may be "
            "cut: export the layout again"
        ) from None
    except RecursionError:
        raise Error(f"{path}: this is nested too deep for a layout; export it again") from None
    except ValueError as error:  # an integer of thousands of digits
        raise Error(f"{path}: this is not a layout: {error}") from None


def _read_yaml(path: Path, text: str) -> Any:
    try:
        documents = load_yaml(text)
    except load_pyyaml().YAMLError as error:
        raise Error(explain_yaml_error(error, str(path), "not YAML")) from None
    return documents[0] if documents else None


# -- the QML ---------------------------------------------------------------------------------------


class _Split(NamedTuple):
    """Places side by side, or above each other, with their shares."""

    vertical: bool
    places: list[tuple[float, _Place]]


class _Tabs(NamedTuple):
    """Panels that share a place."""

    panels: list[str]
    current: int = 0


#: A place of a layout: a panel's text, a split, tabs; None for one whose panel was left out.
_Place = str | _Split | _Tabs | None


def _object(name: str, **values: object) -> str:
    """Return an object with properties; those that are None are left out."""
    lines = [f"{key}: {to_qml(value)}" for key, value in values.items() if value is not None]
    return _block(name, lines) if lines else f"{name} {{}}"


def _block(name: str, parts: list[str]) -> str:
    inner = "\n".join(parts)
    return f"{name} {{\n{indent(inner, '    ')}\n}}"


def _panel(title: str, content: str) -> str:
    return _block("Panel", [f"title: {to_qml(title)}", content])


def _titled(panel: str, title: str) -> str:
    """Return a panel with another title."""
    head, _, rest = panel.split("\n", 2)
    return f"{head}\n    title: {to_qml(title)}\n{rest}"


def _split(vertical: bool, places: list[tuple[float, _Place]]) -> _Place:
    """Return a split without empty places, and without splits of the same direction in it."""
    flat: list[tuple[float, _Place]] = []
    for share, place in places:
        if isinstance(place, _Split) and place.vertical == vertical:
            whole = sum(part for part, _ in place.places)
            flat += [(share * part / whole, inner) for part, inner in place.places]
        elif place is not None:
            flat.append((share, place))
    if len(flat) < 2:
        return flat[0][1] if flat else None
    return _Split(vertical, flat)


def _text(place: _Place, share: float | None = None) -> str:
    """Return the QML of a place."""
    head = [] if share is None else [f"share: {to_qml(share)}"]
    if isinstance(place, _Split):
        if place.vertical:
            head.append("orientation: Qt.Vertical")
        least = min(share for share, _ in place.places)
        shares = [round(share / least, 2) for share, _ in place.places]
        equal = all(share == 1 for share in shares)
        parts = [
            _text(inner, None if equal else share)
            for share, (_, inner) in zip(shares, place.places, strict=True)
        ]
        return _block("Split", head + parts)
    if isinstance(place, _Tabs):
        current = [f"currentIndex: {place.current}"] if place.current else []
        return _block("Tabs", [*head, *current, *place.panels])
    assert place is not None
    first, _, rest = place.partition("{\n")
    return f"{first}{{\n{indent(head[0], '    ')}\n{rest}" if head else place


def _page(title: str, place: _Place) -> str:
    parts = [f"title: {to_qml(title)}"]
    if place is not None:
        parts.append(_text(place))
    return _block("Page", parts)


def _panels_of(place: _Place) -> list[str]:
    """Return all panels in a place."""
    if isinstance(place, _Split):
        return [panel for _, inner in place.places for panel in _panels_of(inner)]
    if isinstance(place, _Tabs):
        return place.panels
    return [] if place is None else [place]


def _bounded(text: object) -> str:
    """Return a title of the file in one line; empty for what is not a text."""
    if not isinstance(text, str):
        return ""
    line = " ".join(text.split())
    return f"{line[: _MAX_TITLE - 1]}…" if len(line) > _MAX_TITLE else line


class _Import:
    """Base of both readers.

    Args:
        path: The file, for errors.
    """

    program = ""

    def __init__(self, path: Path) -> None:
        self.path, self.left_out = path, dict[str, None]()
        #: Objects beside the pages, and further modules.
        self.beside: list[str] = []
        self.modules: set[str] = set()
        self.count = 0

    def note(self, text: str) -> None:
        """List something that is not as it was."""
        self.left_out[text] = None

    def fail(self, where: str, expected: str, got: object) -> Error:
        return Error(
            f"{self.path}: {where}: expected {expected}, got {shown(got)}; export it again"
        )

    def deeper(self, where: str, depth: int) -> None:
        """Check how deep a place is, and count it.

        Raises:
            Error: There is too much.
        """
        self.count += 1
        if depth > _MAX_DEPTH:
            raise Error(f"{self.path}: {where[:80]}…: more than {_MAX_DEPTH} splits in each other")
        if self.count > 4 * _MAX_PANELS:
            raise Error(f"{self.path}: more than {_MAX_PANELS} panels: it is not a layout")

    def result(self, title: str, parts: list[str]) -> ImportedLayout:
        known = ["QtQuick 2.15", "Ros2 1.0", "RosControls 1.0", "RosCockpit 1.0"]
        modules = known + sorted(self.modules)
        head = "".join(f"import {module}\n" for module in modules)
        root = _block("Cockpit", [f"title: {to_qml(title)}", *self.beside, *parts])
        text = f"{head}\n{root}\n"
        Document(text, str(self.path))
        return ImportedLayout(text, self.program, tuple(self.left_out))


# -- Foxglove --------------------------------------------------------------------------------------


class _UnusableError(Exception):
    """A value of a panel that has no counterpart; its text says why."""


def _topic(value: object) -> str:
    """Return the name of a topic or service."""
    if not isinstance(value, str) or not value:
        raise _UnusableError("it names no topic")
    if len(value) > 255 or _TOPIC.fullmatch(value) is None:
        raise _UnusableError(f"{shown(value)} is not the name of a topic")
    return value


def _type(value: object) -> str | None:
    return value if isinstance(value, str) and _TYPE.fullmatch(value) else None


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _field(value: object) -> str:
    """Return a path of Foxglove (``/odom.pose.x``) as one of rosglass (``/odom:pose.x``)."""
    if not isinstance(value, str) or not value:
        raise _UnusableError("it names no field")
    if len(value) > 500:
        raise _UnusableError("its path is too long")
    found = _FOXGLOVE_PATH.fullmatch(value)
    assert found is not None
    name = found["quoted"] if found["quoted"] is not None else found["topic"]
    rest = found["rest"]
    for sign, reason in {"{": "filters", ".@": "functions", "$": "variables"}.items():
        if sign in rest:
            raise _UnusableError(f"{shown(value)}: {reason} in paths are not supported")
    if not rest.startswith(".") or rest == ".":
        raise _UnusableError(f"{shown(value)} names no field of a topic")
    field = rest[1:].replace("[:]", "[*]")
    try:
        parse_path(field)
    except Error:
        raise _UnusableError(f"{shown(value)} is not a topic with a field") from None
    return f"{_topic(name)}:{field}"


class _Foxglove(_Import):
    """Reads a layout of Foxglove: a tree of splits in two, and the settings of each panel."""

    program = "Foxglove"

    def __init__(self, path: Path, found: Mapping[str, Any]) -> None:
        super().__init__(path)
        configs = found["configById"]
        if not isinstance(configs, dict):
            raise self.fail("configById", "an object with the settings of the panels", configs)
        self._configs: dict[str, Any] = configs
        self._tree = found.get("layout")
        self._used: set[str] = set()
        for key, what in {"userNodes": "user scripts", "globalVariables": "variables"}.items():
            if found.get(key):
                self.note(f"{what}: they are not read")

    def layout(self, title: str) -> ImportedLayout:
        """Return the layout; the tabs of a panel that fills the window are its pages."""
        root = self._tree
        config = self._configs.get(root) if isinstance(root, str) else None
        if isinstance(root, str) and root.startswith("Tab!") and isinstance(config, dict):
            self._used.add(root)
            pages = [_page(name, place) for name, place in self._tabs(root, config, 0)]
        else:
            pages = [_page(title, self._place(root, "layout", 0) if root else None)]
        return self.result(title, pages)

    def _place(self, node: object, where: str, depth: int) -> _Place:
        self.deeper(where, depth)
        if isinstance(node, str):
            return self._leaf(node, depth)
        if not isinstance(node, dict) or "first" not in node or "second" not in node:
            raise self.fail(where, "the name of a panel, or a split with first and second", node)
        direction = node.get("direction", "row")
        if direction not in ("row", "column"):
            raise self.fail(f"{where}.direction", "row or column", direction)
        percent = _number(node.get("splitPercentage"))
        first = min(95.0, max(5.0, 50.0 if percent is None else percent))
        places = [
            (first, self._place(node["first"], f"{where}.first", depth + 1)),
            (100 - first, self._place(node["second"], f"{where}.second", depth + 1)),
        ]
        return _split(direction == "column", places)

    def _leaf(self, name: str, depth: int) -> _Place:
        kind = _bounded(name.partition("!")[0])
        if name in self._used:
            self.note(f"{kind}: a second place of the same panel")
            return None
        self._used.add(name)
        config = self._configs.get(name)
        if config is None:
            config = {}
        if not isinstance(config, dict):
            raise self.fail(f"configById.{_bounded(name)}", "an object", config)
        if kind == "Tab":
            return self._in_tabs(name, config, depth)
        maker = _MAKERS.get(kind)
        if maker is None:
            self.note(f"{kind or 'a panel without a type'}: there is no such panel here")
            return None
        title = _bounded(config.get("foxglovePanelTitle")) or _bounded(config.get("title"))
        label = f"{kind} {shown(title)}" if title else kind
        try:
            content = maker(self, label, config)
        except _UnusableError as reason:
            self.note(f"{label}: {reason}")
            return None
        return _panel(title or words_of(content.partition(" ")[0].rpartition(".")[2]), content)

    def _tabs(self, name: str, config: Mapping[str, Any], depth: int) -> list[tuple[str, _Place]]:
        tabs = config.get("tabs", [])
        where = f"configById.{_bounded(name)}.tabs"
        if not isinstance(tabs, list):
            raise self.fail(where, "a list of tabs", tabs)
        found = []
        for at, tab in enumerate(tabs):
            if not isinstance(tab, dict):
                raise self.fail(f"{where}[{at}]", "an object with title and layout", tab)
            self.deeper(where, depth)
            inside = tab.get("layout")
            place = self._place(inside, f"{where}[{at}].layout", depth + 1) if inside else None
            found.append((_bounded(tab.get("title")) or f"Page {at + 1}", place))
        return found

    def _in_tabs(self, name: str, config: Mapping[str, Any], depth: int) -> _Place:
        panels: list[str] = []
        current = 0
        for at, (title, place) in enumerate(self._tabs(name, config, depth)):
            inside = _panels_of(place)
            if config.get("activeTabIdx") == at and inside:
                current = len(panels)
            if len(inside) > 1:
                self.note(f"Tab {shown(title)}: its {len(inside)} panels are tabs of their own")
            elif inside:
                inside = [_titled(inside[0], title)]
            panels += inside
        return _Tabs(panels, current) if len(panels) > 1 else panels[0] if panels else None

    # ---- panels: each returns the control of the panel `label`, with its settings

    def _image(self, label: str, config: Mapping[str, Any]) -> str:
        del label
        mode = config.get("imageMode")
        names = [mode.get("imageTopic") if isinstance(mode, dict) else None]
        names += [config.get(key) for key in ("cameraTopic", "imageTopicName")]
        return _object("CameraView", topic=_topic(next((one for one in names if one), None)))

    def _scene(self, label: str, config: Mapping[str, Any]) -> str:
        self.modules.add("RosScene 1.0 as Scene")
        topics = config.get("topics")
        shows = [
            _bounded(name)
            for name, one in (topics.items() if isinstance(topics, dict) else ())
            if isinstance(one, dict) and one.get("visible")
        ]
        if shows:
            more = f" and {len(shows) - 8} more" if len(shows) > 8 else ""
            self.note(f"{label}: add displays for {', '.join(shows[:8])}{more}")
        frame = config.get("followTf")
        known = isinstance(frame, str) and _FRAME.fullmatch(frame) is not None
        return _object("Scene.SceneView", fixedFrame=frame if known else "map")

    def _plot(self, label: str, config: Mapping[str, Any]) -> str:
        given = config.get("paths")
        paths: list[str] = []
        for one in given if isinstance(given, list) else []:
            value = one.get("value") if isinstance(one, dict) else one
            if not value:
                continue
            try:
                path = _field(value)
            except _UnusableError as reason:
                self.note(f"{label}: {reason}")
                continue
            if path not in paths:
                paths.append(path)
        if config.get("xAxisVal", "timestamp") != "timestamp":
            self.note(f"{label}: its horizontal axis is time here")
        low, high = (_number(config.get(key)) for key in ("minYValue", "maxYValue"))
        width = _number(config.get("followingViewWidth"))
        return _object(
            "Plot",
            paths=paths,
            window=width if width is not None and width > 0 else None,
            leftMin=low,
            leftMax=high,
        )

    def _states(self, label: str, config: Mapping[str, Any]) -> str:
        self.note(f"{label}: states are lines of numbers here; texts are not drawn")
        return self._plot(label, {"paths": config.get("paths")})

    def _message(self, label: str, config: Mapping[str, Any]) -> str:
        path = config.get("topicPath")
        topic, _, field = path.partition(".") if isinstance(path, str) else ("", "", "")
        if field:
            self.note(f"{label}: shows the whole message, not only {shown(field)}")
        return _object("MessageView", topic=_topic(topic.partition("[")[0].partition("{")[0]))

    def _map(self, label: str, config: Mapping[str, Any]) -> str:
        del label
        try:
            return _object("GeoMap", topic=_topic(config.get("followTopic")))
        except _UnusableError:
            return _object("GeoMap")

    def _teleop(self, label: str, config: Mapping[str, Any]) -> str:
        topic = _topic(config.get("topic"))
        limits: dict[str, float] = {}
        for key in ("upButton", "downButton", "leftButton", "rightButton"):
            button = config.get(key)
            if not isinstance(button, dict):
                continue
            field, value = button.get("field"), _number(button.get("value"))
            name = {"linear-x": "maxSpeed", "angular-z": "maxTurn"}.get(str(field))
            if name is None:
                self.note(f"{label}: {key} sends {shown(field)}, which the stick does not")
            elif value:
                limits[name] = max(limits.get(name, 0), abs(value))
        name = "command" if not self.beside else f"command{len(self.beside) + 1}"
        command = _object("TwistCommand", id=Code(name), topic=topic, **limits)
        self.beside.append(command)
        return _object("DriveStick", command=Code(name))

    def _publish(self, label: str, config: Mapping[str, Any]) -> str:
        topic = _topic(config.get("topicName"))
        if config.get("value") not in (None, "", "{}"):
            self.note(f"{label}: enter the message again, it is not kept")
        return _object("PublishPanel", topic=topic, type=_type(config.get("datatype")))

    def _call(self, label: str, config: Mapping[str, Any]) -> str:
        service = _topic(config.get("serviceName"))
        if config.get("requestPayload") not in (None, "", "{}"):
            self.note(f"{label}: enter the request again, it is not kept")
        return _object("CallPanel", service=service)

    def _parameters(self, label: str, config: Mapping[str, Any]) -> str:
        del label, config
        return _object("ParameterForm")

    def _diagnostics(self, label: str, config: Mapping[str, Any]) -> str:
        del label
        hardware = config.get("hardwareIdFilter") or config.get("selectedHardwareId")
        filtered = hardware if isinstance(hardware, str) and len(hardware) <= 200 else None
        topic = config.get("topicToRender")
        return _object("DiagnosticsView", topic=_topic(topic) if topic else None, filter=filtered)

    def _log(self, label: str, config: Mapping[str, Any]) -> str:
        topic, level = config.get("topicToRender"), _number(config.get("minLogLevel"))
        words = config.get("searchTerms")
        terms = [one for one in words if isinstance(one, str)] if isinstance(words, list) else []
        if len(terms) > 1:
            self.note(f"{label}: of several search terms, the first is used")
        return _object(
            "LogView",
            topic=_topic(topic) if topic else None,
            # Foxglove's levels are 1 to 5.
            minLevel=int(level) - 1 if level is not None and 1 <= level <= 5 else None,
            textFilter=terms[0][:200] if terms else None,
        )

    def _gauge(self, label: str, config: Mapping[str, Any]) -> str:
        del label
        low, high = (_number(config.get(key)) for key in ("minValue", "maxValue"))
        return _object("Gauge", path=_field(config.get("path")), **{"from": low, "to": high})

    def _indicator(self, label: str, config: Mapping[str, Any]) -> str:
        path, given = _field(config.get("path")), config.get("rules")
        rules = [one for one in given if isinstance(one, dict)] if isinstance(given, list) else []
        values: dict[str, object] = {"path": path}
        used = 0
        for rule in rules[:1]:
            operator, limit = rule.get("operator"), rule.get("rawValue")
            number = _as_number(limit)
            if operator in (">", ">=") and number is not None:
                values["above"] = number
            elif operator in ("<", "<=") and number is not None:
                values["below"] = number
            elif operator != "=" or limit not in ("true", True):
                break
            used = 1
            values["onText"] = _bounded(rule.get("label")) or None
        if len(rules) > used:
            self.note(f"{label}: {len(rules) - used} of its {len(rules)} rules are not used")
        values["offText"] = _bounded(config.get("fallbackLabel")) or None
        return _object("Lamp", **values)

    def _graph(self, label: str, config: Mapping[str, Any]) -> str:
        del label, config
        return _object("NodeGraph")

    def _topics(self, label: str, config: Mapping[str, Any]) -> str:
        del label, config
        return _object("TopicTree")


def _as_number(value: object) -> float | None:
    """Return the number that a rule compares with, which Foxglove keeps as text."""
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            return None
    return _number(value)


#: Panel of Foxglove -> method that makes ours.
_MAKERS: dict[str, Callable[[_Foxglove, str, Mapping[str, Any]], str]] = {
    "Image": _Foxglove._image,
    "ImageViewPanel": _Foxglove._image,
    "3D": _Foxglove._scene,
    "3D Panel": _Foxglove._scene,
    "Plot": _Foxglove._plot,
    "RawMessages": _Foxglove._message,
    "Table": _Foxglove._message,
    "map": _Foxglove._map,
    "StateTransitions": _Foxglove._states,
    "Teleop": _Foxglove._teleop,
    "Publish": _Foxglove._publish,
    "CallService": _Foxglove._call,
    "Parameters": _Foxglove._parameters,
    "DiagnosticSummary": _Foxglove._diagnostics,
    "DiagnosticStatusPanel": _Foxglove._diagnostics,
    "RosOut": _Foxglove._log,
    "Gauge": _Foxglove._gauge,
    "Indicator": _Foxglove._indicator,
    "TopicGraph": _Foxglove._graph,
    "SourceInfo": _Foxglove._topics,
}


# -- RQml ------------------------------------------------------------------------------------------


class _Rqml(_Import):
    """Reads a configuration of RQml: docks in frames, in a tree of splits, and what each keeps."""

    program = "RQml"

    def __init__(self, path: Path, found: Mapping[str, Any], plugins: Mapping[str, str]) -> None:
        super().__init__(path)
        self._plugins = plugins
        self._windows = self._list(found, "mainWindows")
        self._floating = self._list(found, "floatingWindows")
        #: Contexts of the docks that have no place yet.
        self._docks: dict[str, object] = {}
        for at, dock in enumerate(self._list(found, "allDockWidgets")):
            name = dock.get("uniqueName")
            if not isinstance(name, str):
                raise self.fail(f"allDockWidgets[{at}].uniqueName", "a name", name)
            if len(self._docks) >= _MAX_PANELS:
                raise Error(f"{path}: more than {_MAX_PANELS} docks: it is not a configuration")
            self._docks[name] = dock.get("context")

    def _list(self, found: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
        value = found.get(key)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
            raise self.fail(key, "a list of objects", value)
        return value

    def layout(self, title: str) -> ImportedLayout:
        """Return the layout: a page for each main window, and windows for those that float."""
        parts = []
        for at, window in enumerate(self._windows):
            place = self._window(window, f"mainWindows[{at}]")
            name = title if len(self._windows) == 1 else f"{title} {at + 1}"
            parts.append((name, place))
        windows = []
        for at, window in enumerate(self._floating):
            place = self._window(window, f"floatingWindows[{at}]")
            if place is not None:
                windows.append(self._floating_window(window, place))
        # Docks that are in no frame, such as those at the rim.
        rest = [panel for name in list(self._docks) if (panel := self._dock(name))]
        if rest:
            tabs: _Place = _Tabs(rest) if len(rest) > 1 else rest[0]
            if parts:
                parts[0] = (parts[0][0], _split(False, [(3, parts[0][1]), (1, tabs)]))
            else:
                parts.append((title, tabs))
        pages = [_page(name, place) for name, place in parts] or [_page(title, None)]
        return self.result(title, pages + windows)

    def _window(self, window: Mapping[str, Any], where: str) -> _Place:
        splitter = window.get("multiSplitterLayout")
        if not isinstance(splitter, dict):
            raise self.fail(f"{where}.multiSplitterLayout", "an object", splitter)
        frames, tree = splitter.get("frames") or {}, splitter.get("layout") or {}
        if not isinstance(frames, dict):
            raise self.fail(f"{where}.multiSplitterLayout.frames", "an object", frames)
        return self._place(tree, frames, f"{where}.multiSplitterLayout.layout", 0)

    def _place(self, node: object, frames: Mapping[str, Any], where: str, depth: int) -> _Place:
        self.deeper(where, depth)
        if not isinstance(node, dict):
            raise self.fail(where, "an object", node)
        if not node.get("isContainer"):
            frame = frames.get(str(node.get("guestId")))
            return self._frame(frame) if isinstance(frame, dict) else None
        children = node.get("children") or []
        if not isinstance(children, list):
            raise self.fail(f"{where}.children", "a list", children)
        places = [
            (_share(child), self._place(child, frames, f"{where}.children[{at}]", depth + 1))
            for at, child in enumerate(children)
        ]
        # Qt::Vertical
        return _split(node.get("orientation") == 2, places)

    def _frame(self, frame: Mapping[str, Any]) -> _Place:
        names = frame.get("dockWidgets")
        names = [one for one in names if isinstance(one, str)] if isinstance(names, list) else []
        panels = [panel for name in names if (panel := self._dock(name))]
        current = _number(frame.get("currentTabIndex"))
        if len(panels) < 2:
            return panels[0] if panels else None
        return _Tabs(panels, int(current) if current and 0 < current < len(panels) else 0)

    def _dock(self, name: str) -> str:
        """Return the panel of a dock; empty for one that cannot be shown or has a place."""
        if name not in self._docks:
            return ""
        context = self._docks.pop(name)
        # The name is the plugin's id and a number.
        plugin = name.rpartition(".")[0]
        if (
            len(plugin) > 200
            or _PLUGIN_ID.fullmatch(plugin) is None
            or plugin.lower().endswith(".qml")
        ):
            self.note(f"{shown(name)}: this is not the name of a plugin with a number")
            return ""
        if plugin not in self._plugins:
            self.note(f"{plugin}: this plugin is not installed here; its panel says so")
        title = _bounded(self._plugins.get(plugin)) or words_of(
            plugin.rpartition(".")[2].replace("_", " ")
        )
        kept: object = None
        if isinstance(context, dict) and context:
            try:
                kept = Code(to_qml(context))
            except (ArgumentError, RecursionError) as error:
                self.note(f"{plugin}: its settings cannot be written: {str(error)[:200]}")
        elif context is not None and not isinstance(context, dict):
            self.note(f"{plugin}: its settings are not an object; they are left out")
        return _panel(title, _object("Plugin", source=plugin, context=kept))

    def _floating_window(self, window: Mapping[str, Any], place: _Place) -> str:
        geometry = window.get("geometry")
        lines = []
        for key in ("x", "y", "width", "height"):
            number = _number(geometry.get(key)) if isinstance(geometry, dict) else None
            least = 1 if key in ("width", "height") else -_MAX_PIXELS
            if number is not None and least <= number <= _MAX_PIXELS:
                lines.append(f"{key}: {round(number)}")
        return _block("PanelWindow", [*lines, _text(place)])


def _share(node: object) -> float:
    """Return the share of a node in its split."""
    sizing = node.get("sizingInfo") if isinstance(node, dict) else None
    share = _number(sizing.get("percentageWithinParent")) if isinstance(sizing, dict) else None
    return min(20.0, max(0.05, share)) if share is not None and share > 0 else 1.0
