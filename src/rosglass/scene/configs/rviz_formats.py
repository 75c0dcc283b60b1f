"""The formats of RViz 1 and RViz 2: ids of their classes, and the values of settings.

RViz reads every value as text, and both RViz have different forms of the same setting: of topics,
robot descriptions, interactive marker servers. So read a setting with the function of its form:
:func:`read_bool`, :func:`read_number`, :func:`read_color`, :func:`read_vector`,
:func:`read_topic`, ...
"""

from __future__ import annotations

import math
import re
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.comm.qos import Durability, History, QoS, Reliability
from rosglass.errors import Error, shown

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

__all__ = [
    "DISPLAYS",
    "FIXED_FRAME",
    "TOOLS",
    "VIEWS",
    "DescriptionSetting",
    "TopicSetting",
    "class_id_of",
    "display_type",
    "read_bool",
    "read_choice",
    "read_color",
    "read_description",
    "read_deviations",
    "read_marker_namespace",
    "read_number",
    "read_topic",
    "read_vector",
    "require_ros",
    "ros_of",
    "setting_text",
    "tool_type",
    "type_of",
    "view_type",
    "write_color",
    "write_description",
    "write_deviations",
    "write_marker_namespace",
    "write_topic",
]

#: The word for the fixed frame in settings that name a frame.
FIXED_FRAME = "<Fixed Frame>"

# -- classes of plugins ----------------------------------------------------------------------------

#: Packages of RViz's own plugins.
_ROS1_PACKAGES = ("rviz",)
_ROS2_PACKAGES = ("rviz_default_plugins", "rviz_common")


def _ids(names: str) -> dict[str, tuple[str, str]]:
    return {name: (f"rviz/{name}", f"rviz_default_plugins/{name}") for name in names.split()}


#: Ids in RViz 1 and RViz 2 of each type of display; empty where one of them has none.
DISPLAYS = {
    **_ids(
        "AccelStamped Axes Camera DepthCloud Effort FluidPressure Grid GridCells Illuminance Image"
        " InteractiveMarkers LaserScan Map Marker MarkerArray Odometry Path PointCloud PointCloud2"
        " PointStamped Polygon Pose PoseArray PoseWithCovariance Range RelativeHumidity RobotModel"
        " Temperature TF TwistStamped"
    ),
    "CameraInfo": ("", "rviz_default_plugins/CameraInfo"),
    "Group": ("rviz/Group", "rviz_common/Group"),
    "ParticleCloud": ("", "nav2_rviz_plugins/ParticleCloud"),
    "WrenchStamped": ("rviz/WrenchStamped", "rviz_default_plugins/Wrench"),
}
TOOLS = {
    **_ids("FocusCamera Interact Measure MoveCamera PublishPoint Select SetGoal SetInitialPose"),
    # The goal pose as an action of Nav2.
    "GoalTool": ("", "nav2_rviz_plugins/GoalTool"),
}
VIEWS = _ids("FPS FrameAligned Orbit ThirdPersonFollower TopDownOrtho XYOrbit")


def display_type(class_id: str) -> str:
    """Return the type of a display, the same for both RViz; empty if it is not one of RViz's.

    Args:
        class_id: E.g. ``rviz/WrenchStamped`` or ``rviz_default_plugins/Wrench``, which are both
            ``WrenchStamped``.
    """
    return type_of(DISPLAYS, class_id)


def tool_type(class_id: str) -> str:
    """Return the type of a tool, e.g. ``SetGoal``; empty if it is not one of RViz's."""
    return type_of(TOOLS, class_id)


def view_type(class_id: str) -> str:
    """Return the type of a view controller, e.g. ``Orbit``; empty if it is not one of RViz's."""
    return type_of(VIEWS, class_id)


def type_of(table: dict[str, tuple[str, str]], class_id: str) -> str:
    """Return the type of a class in one of the tables above; empty if it has none there."""
    for name, ids in table.items():
        if class_id and class_id in ids:
            return name
    # The first releases of RViz 2 used the ids of RViz 1, and ids that were renamed later.
    package, _, name = class_id.rpartition("/")
    return name if name in table and package in (*_ROS1_PACKAGES, *_ROS2_PACKAGES) else ""


def class_id_of(table: dict[str, tuple[str, str]], name: str, ros: int) -> str:
    """Return the id of a type in one RViz; ids are returned as they are."""
    require_ros(ros)
    if "/" in name:
        return name
    if name not in table:
        raise Error(f"RViz has no class {name!r:.80}{similar(name, table)}")
    found = table[name][ros - 1]
    if not found:
        raise Error(f"RViz {ros} has no class {name}, only RViz {3 - ros} has")
    return found


def ros_of(class_id: str) -> int | None:
    """Return which RViz a class is from, 1 or 2; None for the plugins of others."""
    package = class_id.rpartition("/")[0]
    return 1 if package in _ROS1_PACKAGES else 2 if package in _ROS2_PACKAGES else None


def require_ros(ros: int) -> int:
    """Return a version of ROS; raise an Error if it is not 1 or 2."""
    if ros not in {1, 2}:
        raise Error(f"the version of ROS must be 1 or 2, got {ros!r:.80}")
    return ros


# -- values ----------------------------------------------------------------------------------------


def setting_text(value: Any) -> str:
    """Return a value as RViz's text."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if isinstance(value, (str, int, float)) else ""


def read_bool(value: Any, name: str = "value") -> bool:
    """Return a setting that is on or off.

    Args:
        value: A bool, 0 or 1, or one of the texts ``true``, ``false``, ``0`` and ``1``.
        name: The setting, for errors.

    Raises:
        Error: It is none of these.
    """
    text = setting_text(value).strip().lower()
    if text in {"true", "false", "1", "0"}:
        return text in {"true", "1"}
    raise Error(f"{name}: expected true or false, got {shown(value)}")


def read_number(
    value: Any,
    name: str = "value",
    *,
    minimum: float | None = None,
    maximum: float | None = None,
) -> float:
    """Return a number.

    Args:
        value: A number, or one as text.
        name: The setting, for errors.
        minimum: The smallest valid number; None for no limit.
        maximum: The largest valid number; None for no limit.

    Returns:
        An int where it is a whole number in the file, else a float.

    Raises:
        Error: It is not a number, not finite, or out of range.
    """
    number: float = math.nan
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        number = value
    elif isinstance(value, str) and len(value) <= 100:
        try:
            text = value.strip()
            number = int(text) if re.fullmatch(r"[-+]?[0-9]+", text) else float(text)
        except ValueError:
            number = math.nan
    try:
        finite = math.isfinite(number)
    except OverflowError:
        finite = False
    if not finite:
        raise Error(f"{name}: expected a finite number, got {shown(value)}")
    if minimum is not None and number < minimum:
        raise Error(f"{name}: expected at least {minimum:g}, got {shown(value)}")
    if maximum is not None and number > maximum:
        raise Error(f"{name}: expected at most {maximum:g}, got {shown(value)}")
    return number


def read_choice(value: Any, choices: Collection[str], name: str = "value") -> str:
    """Return one of several texts; capitals do not matter, since RViz itself mixes them.

    Args:
        value: The text.
        choices: The valid ones.
        name: The setting, for errors.

    Raises:
        Error: It is none of them.
    """
    text = setting_text(value).strip()
    for choice in choices:
        if choice.lower() == text.lower():
            return choice
    expected = ", ".join(islice(choices, 20))
    raise Error(f"{name}: expected one of {expected}, got {shown(value)}{similar(text, choices)}")


def read_color(value: Any, name: str = "Color") -> tuple[float, float, float, float]:
    """Return a colour as red, green, blue and alpha from 0 to 1.

    Args:
        value: ``"255; 128; 0"`` as RViz writes it, ``"#ff8000"`` or ``"#f80"``. Numbers beyond 0
            to 255 are limited, as in RViz.
        name: The setting, for errors.

    Raises:
        Error: It is not a colour.
    """
    text = value.strip() if isinstance(value, str) and len(value) <= 100 else ""
    parts: list[int] = []
    if re.fullmatch(r"#([0-9a-fA-F]{3}){1,2}", text):
        step = len(text) // 3
        digits = [text[at : at + step] for at in range(1, len(text), step)]
        parts = [int(part * (3 - step), 16) for part in digits]
    elif re.fullmatch(r"\s*[-+]?[0-9]+\s*(;\s*[-+]?[0-9]+\s*){2}", text):
        parts = [min(max(int(part), 0), 255) for part in text.split(";")]
    if len(parts) != 3:
        raise Error(f"{name}: expected a colour, e.g. '255; 128; 0', got {shown(value)}")
    return parts[0] / 255, parts[1] / 255, parts[2] / 255, 1.0


def write_color(color: Sequence[float], name: str = "Color") -> str:
    """Return a colour as RViz writes it.

    Args:
        color: Red, green and blue from 0 to 1; RViz has no alpha in colours.
        name: The setting, for errors.

    Raises:
        Error: It is not a colour.
    """
    if len(color) not in {3, 4}:
        raise Error(f"{name}: expected red, green and blue, got {len(color)} numbers")
    parts = [read_number(float(part), name, minimum=0, maximum=1) for part in color[:3]]
    return "; ".join(str(round(part * 255)) for part in parts)


def read_vector(value: Any, name: str = "value", parts: str = "XYZ") -> tuple[float, ...]:
    """Return a vector or quaternion.

    Args:
        value: A mapping ``{X: 1, Y: 0, Z: 0}``.
        name: The setting, for errors.
        parts: The mapping's keys: ``XYZ``, or ``XYZW`` for a quaternion.

    Raises:
        Error: It is not a mapping, or has not all parts.
    """
    if not isinstance(value, dict) or any(part not in value for part in parts):
        raise Error(f"{name}: expected a mapping of {', '.join(parts)}, got {shown(value)}")
    return tuple(float(read_number(value[part], f"{name}/{part}")) for part in parts)


# -- topics ----------------------------------------------------------------------------------------

_SYSTEM = "System Default"
_RELIABILITIES = {"Reliable": Reliability.RELIABLE, "Best Effort": Reliability.BEST_EFFORT}
_DURABILITIES = {
    "Volatile": Durability.VOLATILE,
    "Transient Local": Durability.TRANSIENT_LOCAL,
}
_HISTORIES = {"Keep Last": History.KEEP_LAST, "Keep All": History.KEEP_ALL}
#: Names of the setting ``Topic`` in RViz 1, by type of display.
_ROS1_TOPICS = {
    "Camera": "Image Topic",
    "Image": "Image Topic",
    "Marker": "Marker Topic",
    "MarkerArray": "Marker Topic",
}


class TopicSetting(NamedTuple):
    """A topic and its QoS; None for what the file leaves to the display's default.

    Of policies that are written, None stays as the file has it, and an empty text is left out.
    """

    #: The topic; empty if none is chosen.
    name: str = ""
    #: Messages that are kept.
    depth: int | None = None
    #: ``Reliable``, ``Best Effort`` or ``System Default``.
    reliability: str | None = None
    #: ``Volatile``, ``Transient Local`` or ``System Default``.
    durability: str | None = None
    #: ``Keep Last``, ``Keep All`` or ``System Default``.
    history: str | None = None
    #: Messages that wait for their transform (RViz 2).
    filter_size: int | None = None

    def qos(self, default: QoS | None = None) -> QoS:
        """Return the QoS of a subscription.

        Args:
            default: The display's default, for what the file does not say.
        """
        base = default or QoS()
        return QoS(
            depth=self.depth or base.depth,
            reliability=_RELIABILITIES.get(self.reliability or "", base.reliability),
            durability=_DURABILITIES.get(self.durability or "", base.durability),
            history=_HISTORIES.get(self.history or "", base.history),
        )


def read_topic(settings: Mapping[str, Any], name: str = "Topic") -> TopicSetting:
    """Return a topic of a display or tool, in either RViz's form.

    Args:
        settings: The settings that it is one of, because RViz 1 keeps ``Queue Size`` and
            ``Unreliable`` beside it.
        name: The setting. For ``Topic``, also ``Marker Topic`` and ``Image Topic`` of RViz 1.

    Raises:
        Error: It is not a topic, or its QoS is not valid.
    """
    keys = dict.fromkeys([name, *(_ROS1_TOPICS.values() if name == "Topic" else ())])
    key = next((key for key in keys if key in settings), name)
    value = settings.get(key)
    if isinstance(value, (list, tuple)):
        raise Error(f"{key}: expected a topic, got {shown(value)}")
    if not isinstance(value, dict):
        # RViz 1 writes false by itself: that must not refuse the publishers of ROS 2.
        unreliable = read_bool(settings.get("Unreliable") or False, "Unreliable")
        return TopicSetting(
            setting_text(value),
            _count(settings, "Queue Size"),
            "Best Effort" if unreliable else None,
        )
    inner = value.get("Value")
    if isinstance(inner, (dict, list)):
        raise Error(f"{key}/Value: expected a topic, got {shown(inner)}")
    return TopicSetting(
        setting_text(inner),
        _count(value, "Depth", f"{key}/"),
        _policy(value, "Reliability Policy", _RELIABILITIES, key),
        _policy(value, "Durability Policy", _DURABILITIES, key),
        _policy(value, "History Policy", _HISTORIES, key),
        _count(value, "Filter size", f"{key}/"),
    )


def write_topic(
    settings: dict[str, Any], topic: TopicSetting, ros: int, name: str = "Topic"
) -> None:
    """Change a topic of a display or tool, in the form of one RViz.

    Args:
        settings: The settings that it is one of, with ``Class``.
        topic: The topic; what is None stays as it is.
        ros: The RViz, 1 or 2.
        name: The setting; ``Topic`` also for what RViz 1 calls ``Marker Topic`` or ``Image Topic``.
    """
    if require_ros(ros) == 1:
        if name == "Topic":
            name = _ROS1_TOPICS.get(display_type(setting_text(settings.get("Class"))), name)
        settings[name] = topic.name
        if topic.depth is not None:
            settings["Queue Size"] = topic.depth
        unreliable = topic.reliability == "Best Effort"
        if unreliable or (topic.reliability is not None and "Unreliable" in settings):
            settings["Unreliable"] = unreliable
        return
    known = settings.get(name)
    policies = {
        "Durability Policy": topic.durability,
        "History Policy": topic.history,
        "Reliability Policy": topic.reliability,
    }
    changed = {"Depth": topic.depth, "Filter size": topic.filter_size, "Value": topic.name}
    kept = {
        **(known if isinstance(known, dict) else {}),
        **{key: value for key, value in {**changed, **policies}.items() if value is not None},
    }
    settings[name] = {key: value for key, value in kept.items() if value or key not in policies}


def _count(settings: Mapping[str, Any], key: str, prefix: str = "") -> int | None:
    if settings.get(key) is None:
        return None
    number = read_number(settings[key], prefix + key, minimum=0, maximum=2**31 - 1)
    if number != int(number):
        raise Error(f"{prefix}{key}: expected a whole number, got {shown(settings[key])}")
    return int(number)


def _policy(
    topic: Mapping[str, Any], key: str, policies: Mapping[str, Any], name: str
) -> str | None:
    if topic.get(key) is None:
        return None
    return read_choice(topic[key], [*policies, _SYSTEM], f"{name}/{key}")


# -- settings that both RViz have in different forms -----------------------------------------------


class DescriptionSetting(NamedTuple):
    """The source of a robot's description (URDF)."""

    #: ``parameter`` (RViz 1), ``topic`` or ``file`` (RViz 2).
    source: str
    #: Name of the parameter or topic, or path of the file.
    name: str
    #: The topic with its QoS; None for other sources.
    topic: TopicSetting | None = None


def read_description(settings: Mapping[str, Any]) -> DescriptionSetting:
    """Return where a display's robot description comes from.

    Args:
        settings: Settings of a RobotModel or Effort display: ``Robot Description`` in RViz 1,
            ``Description Source``, ``Description Topic`` and ``Description File`` in RViz 2.

    Raises:
        Error: A setting is not valid.
    """
    if "Robot Description" in settings:
        name = setting_text(settings["Robot Description"])
        # RViz 2's Effort display has a topic of that name.
        if ros_of(setting_text(settings.get("Class"))) == 2:
            return DescriptionSetting("topic", name, TopicSetting(name))
        return DescriptionSetting("parameter", name)
    key = "Description Source"
    if read_choice(settings.get(key, "Topic"), ("Topic", "File"), key) == "File":
        return DescriptionSetting("file", setting_text(settings.get("Description File")))
    topic = read_topic(settings, "Description Topic")
    return DescriptionSetting("topic", topic.name, topic)


def write_description(settings: dict[str, Any], description: DescriptionSetting, ros: int) -> None:
    """Change where a RobotModel's description comes from, in the form of one RViz.

    Raises:
        Error: That RViz has no such source.
    """
    if require_ros(ros) == 1:
        if description.source != "parameter":
            raise Error(f"RViz 1 reads a parameter, no {description.source} {description.name}")
        settings["Robot Description"] = description.name
        return
    if description.source == "file":
        settings["Description File"] = description.name
    elif description.source == "topic":
        topic = description.topic or TopicSetting(description.name)
        write_topic(settings, topic, ros, "Description Topic")
    else:
        raise Error(f"RViz 2 reads a topic or a file, no {description.source} {description.name}")
    settings["Description Source"] = description.source.capitalize()


def read_marker_namespace(settings: Mapping[str, Any]) -> str:
    """Return the namespace of an interactive marker server.

    Args:
        settings: Settings of an InteractiveMarkers display: ``Update Topic`` in RViz 1
            (``/server/update``), ``Interactive Markers Namespace`` in RViz 2 (``/server``).
    """
    found = settings.get("Interactive Markers Namespace")
    if found is not None:
        return setting_text(found)
    return setting_text(settings.get("Update Topic")).removesuffix("/update")


def write_marker_namespace(settings: dict[str, Any], namespace: str, ros: int) -> None:
    """Change the namespace of an interactive marker server, in the form of one RViz."""
    if require_ros(ros) == 1:
        settings["Update Topic"] = f"{namespace}/update" if namespace else ""
    else:
        settings["Interactive Markers Namespace"] = namespace


#: The settings of `SetInitialPose`, and its default deviations.
_DEVIATIONS = ("X std deviation", "Y std deviation", "Theta std deviation")
_COVARIANCES = ("Covariance x", "Covariance y", "Covariance yaw")
_DEFAULT_DEVIATIONS = (0.5, 0.5, math.pi / 12)


def read_deviations(settings: Mapping[str, Any]) -> tuple[float, float, float]:
    """Return the standard deviations of an initial pose: x and y in metres, yaw in radians.

    Args:
        settings: Settings of a SetInitialPose tool: deviations in RViz 1, covariances in RViz 2.

    Raises:
        Error: One is not a number of 0 or more.
    """
    found = []
    for ros1, ros2, default in zip(_DEVIATIONS, _COVARIANCES, _DEFAULT_DEVIATIONS, strict=True):
        if ros2 in settings:
            found.append(math.sqrt(read_number(settings[ros2], ros2, minimum=0)))
        else:
            found.append(float(read_number(settings.get(ros1, default), ros1, minimum=0)))
    return found[0], found[1], found[2]


def write_deviations(settings: dict[str, Any], deviations: Sequence[float], ros: int) -> None:
    """Change the standard deviations of an initial pose, in the form of one RViz.

    Raises:
        Error: One is not a number of 0 or more.
    """
    keys = _DEVIATIONS if require_ros(ros) == 1 else _COVARIANCES
    for key, deviation in zip(keys, deviations, strict=True):
        number = float(read_number(float(deviation), key, minimum=0))
        settings[key] = number if ros == 1 else number * number
