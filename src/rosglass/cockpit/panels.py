"""The catalogue of panels that a layout can have, and proposals for the topics of a robot.

A panel is a QML type with a snippet to insert. Descriptions and properties are read from the QML
files (:mod:`rosglass.cockpit.panel_properties`), those of the controls as well as those of a user's
folder; only groups, snippets and the order of proposals are written here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import rosglass
from rosglass.cockpit.panel_properties import (
    PanelProperty,
    declared_types,
    described_types,
    heading_of,
    message_types,
    properties_of,
    python_properties,
)
from rosglass.comm.names import hidden
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

__all__ = ["GROUPS", "Panel", "Proposal", "controls", "find", "folder_panels", "propose", "search"]

#: The groups of panels, in the order in which they are shown.
GROUPS = ("Drive", "See", "Map", "Plot", "State", "Lists", "Call", "Record", "Robots", "Own")

# The files are read, not imported: the catalogue is shown before any control is loaded.
_ROOT = Path(rosglass.__file__).parent
_CONTROLS = _ROOT / "controls/imports/RosControls"
_SCENE_VIEW = _ROOT / "scene/view/scene_view.py"
_ROS2_TYPES = _ROOT / "qml/imports/Ros2"
# RosScene has a CameraView of its own.
_PLAIN_IMPORT, _SCENE_IMPORT = "RosControls 1.0", "RosScene 1.0 as Scene"
#: Files of a folder that are listed, and bytes of one that is read.
_MAX_FILES, _MAX_BYTES = 500, 1_000_000
_WORD = re.compile(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])")
_LONG_WORD = re.compile(r"[a-z]{4,}")
#: Letters of a text that is compared with similar ones.
_MAX_LETTERS = 40
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage",
           "ffmpeg_image_transport_msgs/msg/FFMPEGPacket")  # fmt: skip
_TWISTS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")

#: Group of each control that is a panel; those that are not listed are parts of others.
_GROUP_OF = {
    name: group
    for group, names in {
        "Drive": "DriveStick DriveKeys GamepadView EmergencyStop WhoSteers Speed ModeSwitch",
        "See": "CameraView CameraGrid",
        "Map": "MapView GeoMap Compass Attitude",
        "Plot": "Plot Gauge",
        "State": "Battery JointView Lamp",
        "Lists": "AlarmList DiagnosticsView LogView TopicTree MessageView NodeGraph TfTree",
        "Call": "ServiceButton ActionPanel ParameterForm PublishPanel CallPanel",
        "Record": "Recorder Timeline",
        "Robots": "RobotSwitch RobotTiles",
    }.items()
    for name in names.split()
}
#: The inserted text, where it is more than the type.
_SNIPPETS = {
    "GamepadView": 'GamepadView {\n    gamepad: Gamepad { topic: "joy" }\n}',
    "Gauge": 'Gauge {\n    path: ""\n    to: 1\n}',
    "Lamp": 'Lamp {\n    path: ""\n}',
    "Plot": "Plot {\n    paths: []\n}",
    "ModeSwitch": 'ModeSwitch {\n    topic: "mode"\n    modes: ["manual", "auto"]\n}',
    "ServiceButton": 'ServiceButton {\n    service: ""\n}',
    "ActionPanel": 'ActionPanel {\n    action: ""\n}',
    "SceneView": 'Scene.SceneView {\n    fixedFrame: "map"\n}',
}
#: Types of the topics that a control shows, where the heading of its file does not name them.
_TYPES = {
    "CameraView": _IMAGES,
    "CameraGrid": _IMAGES,
    "MapView": ("nav_msgs/msg/OccupancyGrid",),
    "GeoMap": ("sensor_msgs/msg/NavSatFix",),
    "DriveStick": _TWISTS,
    "DriveKeys": _TWISTS,
    "EmergencyStop": ("std_msgs/msg/Bool",),
    "Speed": ("nav_msgs/msg/Odometry", *_TWISTS),
    "TfTree": ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"),
    "Lamp": ("std_msgs/msg/Bool",),
}
#: Properties that a control changes itself: they are not settings.
_STATES = {
    "AlarmList": ("muted",),
    "CameraView": ("problem",),
    "EmergencyStop": ("wanted", "overdue", "contested", "sent", "problem"),
    "LogView": ("paused",),
    "ModeSwitch": ("requested", "refusal"),
    "Plot": ("paused", "cursor", "series"),
    "Recorder": ("recording",),
    "RobotSwitch": ("found",),
}
#: Properties of the base of most controls that a form shows as well.
_FRAME_PROPERTIES = ("title", "framed")


@dataclass(frozen=True, slots=True)
class Panel:
    """An entry of the catalogue.

    Attributes:
        name: Name of its QML type.
        group: One of :data:`GROUPS`.
        line: What it shows, in one line.
        icon: One letter or sign.
        snippet: The QML object to insert.
        imports: Modules that the snippet needs, as after ``import``; for a panel from a folder, the
            folder's URL, for which a layout in or beside it writes a relative path.
        types: Message types of the topics that it shows, best first.
        page: Address of its page below that of the documentation; empty without one.
        properties: What its form shows.
        file: Its QML file, of panels from a folder; empty for others.
        problem: Why it cannot be inserted; empty if it can.
    """

    name: str
    group: str
    line: str
    icon: str
    snippet: str
    imports: tuple[str, ...] = (_PLAIN_IMPORT,)
    types: tuple[str, ...] = ()
    page: str = ""
    properties: tuple[PanelProperty, ...] = ()
    file: str = ""
    problem: str = ""

    def property(self, name: str) -> PanelProperty | None:
        """Return one of its properties; None if it has none of this name."""
        return next((one for one in self.properties if one.name == name), None)

    def with_values(self, **values: str) -> str:
        """Return the snippet with properties set to QML expressions."""
        head, _, rest = self.snippet.partition("{")
        body = [
            line for line in rest.rstrip().removesuffix("}").strip().splitlines() if line.strip()
        ]
        inner = [line.strip() for line in body]
        kept = [line for line in inner if line.partition(":")[0] not in values]
        lines = [*(f"{name}: {value}" for name, value in values.items()), *kept]
        if not lines:
            return f"{head.rstrip()} {{}}"
        if len(lines) == 1:
            return f"{head.rstrip()} {{ {lines[0]} }}"
        return "\n".join([f"{head.rstrip()} {{", *(f"    {line}" for line in lines), "}"])


class Proposal(NamedTuple):
    """A panel for what a robot offers.

    Attributes:
        panel: The entry of the catalogue.
        topic: The topic that it shows; empty for one that shows several.
        snippet: The QML object to insert.
        reason: What was found, in words: ``/camera/image (sensor_msgs/Image)``.
    """

    panel: Panel
    topic: str
    snippet: str
    reason: str


@cache
def controls() -> tuple[Panel, ...]:
    """Return the panels that rosglass has, by group and name."""
    texts = {file.stem: file.read_text(encoding="utf-8") for file in _CONTROLS.glob("*.qml")}
    known = {name: declared_types(text) for name, text in texts.items()}
    for folder in (_CONTROLS, _ROS2_TYPES):
        known.update(described_types((folder / "plugins.qmltypes").read_text(encoding="utf-8")))
    frame = [one for one in properties_of(texts["LiveFrame"]) if one.name in _FRAME_PROPERTIES]
    found = [_control(name, texts[name], known, frame) for name in _GROUP_OF]
    found.append(_scene_view())
    order = {group: at for at, group in enumerate(GROUPS)}
    return tuple(sorted(found, key=lambda panel: (order[panel.group], panel.name)))


def _control(
    name: str,
    text: str,
    known: Mapping[str, Mapping[str, str]],
    frame: Sequence[PanelProperty],
) -> Panel:
    line = heading_of(text)
    types = _TYPES.get(name) or message_types(line)
    own = [
        one for one in properties_of(text, types, known) if one.name not in _STATES.get(name, ())
    ]
    if re.search(r"^LiveFrame \{", text, re.M):
        own += [one for one in frame if one.name not in {mine.name for mine in own}]
    return Panel(
        name,
        _GROUP_OF[name],
        line,
        name[0],
        _SNIPPETS.get(name, f"{name} {{}}"),
        types=types,
        page=f"controls/{name}.html",
        properties=tuple(own),
    )


def _scene_view() -> Panel:
    properties = python_properties(_SCENE_VIEW.read_text(encoding="utf-8"))
    return Panel(
        "SceneView",
        "Map",
        "The robot in 3D: displays as in RViz.",
        "3",
        _SNIPPETS["SceneView"],
        imports=(_SCENE_IMPORT,),
        page="scene.html",
        properties=properties,
    )


def folder_panels(folder: str | Path) -> tuple[Panel, ...]:
    """Return the QML files of a folder as panels, sorted by name.

    Their headings, comments and properties are read as those of the controls. A file that cannot
    be read, or whose name does not start with a capital, has a problem.

    Raises:
        Error: The folder cannot be read, or has too many files.
    """
    path = Path(folder)
    try:
        files = sorted(file for file in path.iterdir() if file.suffix == ".qml" and file.is_file())
    except OSError as error:
        raise Error(f"{path}: the panels cannot be listed: {error.strerror or error}") from error
    if len(files) > _MAX_FILES:
        raise Error(f"{path}: {len(files)} QML files are too many for panels; {_MAX_FILES} fit")
    return tuple(_file_panel(file) for file in files)


def _file_panel(file: Path) -> Panel:
    name, text, problem = file.stem, "", ""
    if not re.fullmatch(r"[A-Z][A-Za-z0-9_]*", name):
        problem = (
            f"{file.name}: names of QML types start with a capital and have letters and digits"
        )
    try:
        with file.open("rb") as opened:
            data = opened.read(_MAX_BYTES + 1)
        text = data.decode()
        if len(data) > _MAX_BYTES:
            problem = problem or f"{file} is too large for a panel: more than {_MAX_BYTES:,} bytes"
    except OSError as error:
        problem = problem or f"{file} cannot be read: {error.strerror or error}"
    except UnicodeDecodeError as error:
        problem = problem or f"{file} is not UTF-8 text (byte {error.start})"
    line = heading_of(text) or f"{file.name} of {file.parent}"
    types = message_types(line)
    return Panel(
        name,
        "Own",
        line,
        name[:1].upper(),
        f"{name} {{}}",
        imports=(f'"{file.parent.absolute().as_uri()}"',),
        types=types,
        properties=properties_of(text, types),
        file=str(file),
        problem=problem,
    )


def find(name: str, panels: Iterable[Panel] | None = None) -> Panel | None:
    """Return the panel with the name of a QML type, None without one."""
    name = name.rpartition(".")[2]
    return next(
        (one for one in (controls() if panels is None else panels) if one.name == name), None
    )


# -- searching -------------------------------------------------------------------------------------


def search(text: str, names: Sequence[str], lines: Sequence[str] | None = None) -> list[int]:
    """Return the indices of the names that a text finds, best first; all for an empty text.

    Names that start with the text come first, then those whose words do, then those that contain
    it or whose line does. If there are none, those that are written similarly: with one typo from
    three letters on, with two from six on.

    Args:
        text: What was typed.
        names: What is searched.
        lines: A line of description for each name.
    """
    wanted = text.strip().lower().replace(" ", "")
    if not wanted:
        return list(range(len(names)))
    said = lines if lines is not None else [""] * len(names)
    asked = re.sub(r"[^a-z0-9]", "", wanted) or wanted
    for rank_of in (_rank, _similarity):
        ranked = [
            (rank, at)
            for at, (name, line) in enumerate(zip(names, said, strict=True))
            if (rank := rank_of(asked, wanted, name, line)) is not None
        ]
        if ranked:
            return [at for _, at in sorted(ranked)]
    return []


def _rank(asked: str, wanted: str, name: str, line: str) -> int | None:
    plain = re.sub(r"[^a-z0-9]", "", name.lower())
    if plain.startswith(asked):
        return 0
    if any(word.startswith(asked) for word in _words(name)):
        return 1
    if asked in plain or wanted in name.lower():
        return 2
    return 3 if line and wanted in line.lower().replace(" ", "") else None


def _similarity(asked: str, wanted: str, name: str, line: str) -> int | None:
    del wanted
    allowed = min(2, len(asked) // 3)
    if not allowed or len(asked) > _MAX_LETTERS:
        return None
    parts = [re.sub(r"[^a-z0-9]", "", part) for part in name.lower().split("/")]
    # With the beginning of a word, as the rest may not be typed yet.
    for rank, candidates in (
        (0, (*parts, *_words(name))),
        (1, _LONG_WORD.findall(line.lower())[:40]),
    ):
        for word in candidates:
            start = word[: len(asked) + 1]
            # Most words differ in more letters: they need no closer look.
            missing = sum(letter not in start for letter in asked)
            if missing <= allowed and _differs_by(asked, start, allowed):
                return rank
    return None


def _words(name: str) -> list[str]:
    return [word.lower() for word in _WORD.findall(name)]


def _differs_by(one: str, other: str, most: int) -> bool:
    """Return whether one text becomes the beginning of the other by a few edits.

    An edit adds, removes or replaces a letter, or swaps two neighbours.
    """
    before2: list[int] = []
    before = list(range(len(other) + 1))
    for at, letter in enumerate(one, 1):
        row = [at]
        for to, goal in enumerate(other, 1):
            cost = min(before[to] + 1, row[to - 1] + 1, before[to - 1] + (letter != goal))
            if at > 1 and to > 1 and letter == other[to - 2] and one[at - 2] == goal:
                cost = min(cost, before2[to - 2] + 1)
            row.append(cost)
        before2, before = before, row
        if min(row) > most:
            return False
    # The last letters may be those of the next part of the word.
    return min(before[-2:]) <= most


# -- proposing -------------------------------------------------------------------------------------


def _is_camera(topic: str) -> bool:
    last = topic.rpartition("/")[2]
    return last not in ("compressedDepth", "theora") and "depth" not in last.lower()


def _camera_base(topic: str) -> str:
    base, _, last = topic.rpartition("/")
    return base if base and last in ("compressed", "ffmpeg", "compressedDepth", "theora") else topic


def _is_stop(topic: str) -> bool:
    return re.search(r"(?:^|/)(?:emergency_stop|e_?stop)$", topic) is not None


def _is_command(topic: str) -> bool:
    return re.search(r"(?:^|/)(?:cmd_vel|command|teleop|drive)\w*$", topic) is not None


def _is_map(topic: str) -> bool:
    return "costmap" not in topic


def _any(topic: str) -> bool:
    del topic
    return True


class _Rule(NamedTuple):
    panel: str
    types: tuple[str, ...]
    #: Property that is set to the topic; empty if the panel finds topics by itself.
    sets: str
    suits: Callable[[str], bool] = _any
    #: Panels of this kind that are proposed at most.
    most: int = 8


#: Panels that are proposed for topics of a type; those that an operator needs first come first.
_RULES = (
    _Rule("CameraView", _IMAGES, "topic", _is_camera),
    _Rule("DriveStick", _TWISTS, "topic", _is_command),
    _Rule("EmergencyStop", ("std_msgs/msg/Bool",), "topic", _is_stop),
    _Rule("MapView", ("nav_msgs/msg/OccupancyGrid",), "topic", _is_map),
    _Rule("Battery", ("sensor_msgs/msg/BatteryState",), "topic"),
    _Rule("AlarmList", ("diagnostic_msgs/msg/DiagnosticArray",), "topic"),
    _Rule("Speed", ("nav_msgs/msg/Odometry",), "topic"),
    _Rule("GeoMap", ("sensor_msgs/msg/NavSatFix",), "topic"),
    _Rule("JointView", ("sensor_msgs/msg/JointState",), "topic"),
    _Rule("Attitude", ("sensor_msgs/msg/Imu",), "topic"),
    _Rule("SceneView", ("sensor_msgs/msg/PointCloud2", "visualization_msgs/msg/MarkerArray",
                        "sensor_msgs/msg/LaserScan"), "", most=1),
    _Rule("LogView", ("rcl_interfaces/msg/Log", "rosgraph_msgs/msg/Log"), "", most=1),
    _Rule("TfTree", ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"), "", most=1),
    _Rule("GamepadView", ("sensor_msgs/msg/Joy",), "", most=0),
    _Rule("Gauge", ("sensor_msgs/msg/Temperature",), "temperature", most=4),
    _Rule("Gauge", ("sensor_msgs/msg/Range",), "range", most=4),
)  # fmt: skip
#: The field that a Gauge shows, with what else it is given.
_GAUGES = {
    "temperature": {"unit": '"°C"', "to": "100"},
    "range": {"unit": '"m"', "to": "5"},
}


def propose(
    topics: Mapping[str, Sequence[str]], panels: Collection[Panel] | None = None
) -> list[Proposal]:
    """Return panels for the topics of a robot, best first, at most one for each topic.

    The first of each kind of panel come before the second, so that the first few proposals make a
    useful screen. Hidden topics are left out, and image transports count as one camera.

    Args:
        topics: Full names of the topics, with their types in full (``sensor_msgs/msg/Imu``).
        panels: The catalogue; by default, :func:`controls`. Own panels that name message types are
            proposed after those of rosglass.
    """
    known = {panel.name: panel for panel in (controls() if panels is None else panels)}
    by_type: dict[str, list[str]] = {}
    for topic in sorted(topics, key=lambda name: (name.count("/"), name)):
        if not hidden(topic):
            for kind in topics[topic]:
                by_type.setdefault(kind, []).append(topic)
    rounds: list[list[Proposal]] = []
    taken: set[str] = set()
    own = [
        _Rule(panel.name, panel.types, "topic" if panel.property("topic") else "")
        for panel in known.values()
        if panel.group == "Own" and panel.types and not panel.problem
    ]
    for rule in (*_RULES, *own):
        panel = known.get(rule.panel)
        if panel is None:
            continue
        found = 0
        for kind in rule.types:
            for topic in by_type.get(kind, ()):
                shown = _camera_base(topic) if rule.panel == "CameraView" else topic
                if found >= rule.most:
                    break
                if shown in taken or not rule.suits(topic):
                    continue
                taken.add(shown)
                while len(rounds) <= found:
                    rounds.append([])
                rounds[found].append(_proposal(panel, rule.sets, shown, kind))
                found += 1
    return [one for each in rounds for one in each]


def _proposal(panel: Panel, sets: str, topic: str, kind: str) -> Proposal:
    reason = f"{topic} ({kind.replace('/msg/', '/')})"
    if sets in _GAUGES:
        snippet = panel.with_values(path=_quoted(f"{topic}:{sets}"), **_GAUGES[sets])
    elif sets:
        snippet = panel.with_values(**{sets: _quoted(topic)})
    else:
        snippet, topic = panel.snippet, topic if panel.group == "Own" else ""
    return Proposal(panel, topic, snippet, reason)


def _quoted(text: str) -> str:
    """Return a text as a QML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f\u2028\u2029]", lambda m: f"\\u{ord(m[0]):04x}", escaped) + '"'
