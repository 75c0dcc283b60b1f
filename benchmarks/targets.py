"""The targets of the codec, and the figures of the C++ library elsewhere.

The absolute figures were set on an idle 2-core AMD EPYC with Python 3.11; the ratios to a named
peer in the same run are what can be held against any machine.
"""

from __future__ import annotations

from dataclasses import dataclass, field

FLAT = ("Image", "PointCloud2", "Twist", "PoseStamped", "LaserScan", "OccupancyGrid")
BIG_ARRAYS = ("Image", "PointCloud2", "OccupancyGrid")


@dataclass(frozen=True)
class Target:
    """The target of one figure.

    Attributes:
        limit: Highest value on the reference machine (us, or bytes for memory), None if not set.
        ratios: How many times faster than each peer, by the peer's name.
        copies: Highest multiple of a plain copy of the encoded bytes, None if not set.
    """

    limit: float | None = None
    ratios: dict[str, float] = field(default_factory=dict)
    copies: float | None = None


_LISTS = {
    "TFMessage": (1.0, 100.0),
    "Path": (1.0, 2000.0),
    "MarkerArray": (4.0, 300.0),
    "DiagnosticArray": (7.0, 25.0),
    "JointState": (2.5, 5.0),
}
_ATTRIBUTE = {"PoseStamped": 0.8, "Twist": 0.5, "Image": 1.3}
_EVERY_LEAF = {
    "PoseStamped": 1.0,
    "Twist": 0.5,
    "TFMessage": 50.0,
    "MarkerArray": 800.0,
    "Path": 1500.0,
    "DiagnosticArray": 130.0,
    "JointState": 9.0,
}
_EVERY_LEAF_RATIO = {"DiagnosticArray": 1.7, "JointState": 1.4, "PointCloud2": 1.4, "Image": 1.4}
_ENCODE = {
    "Twist": 0.3,
    "PoseStamped": 0.7,
    "TFMessage": 40.0,
    "MarkerArray": 550.0,
    "Path": 650.0,
}


def target(metric: str, sample: str, ros: int) -> Target:
    """The target of a metric for a sample; an empty one where none is set."""
    if metric == "decode":
        ratios = {"rosbags": 8.0 if sample == "Twist" else 20.0}
        if sample == "Image" and ros == 2:
            ratios = {"rosbags": 700.0, "rosbags view": 20.0}
        return Target(0.15, ratios)
    if metric == "path":
        if sample in FLAT:
            other = {"genpy": 7.0} if ros == 1 else {"mcap-ros2": 30.0}
            return Target(0.2, {"rosbags": 12.0, **other})
        limit, ratio = _LISTS[sample]
        return Target(limit, {"rosbags": ratio})
    if metric == "attribute" and sample in _ATTRIBUTE:
        return Target(_ATTRIBUTE[sample], {"rosbags": 2.0})
    if metric == "every leaf":
        other = {"genpy": 1.0} if ros == 1 else {"mcap-ros2": 2.5}
        ratio = _EVERY_LEAF_RATIO.get(sample, 2.0)
        return Target(_EVERY_LEAF.get(sample), {"rosbags": ratio, **other})
    if metric == "encode":
        if sample in BIG_ARRAYS:
            return Target(copies=1.25)
        if sample in {"DiagnosticArray", "JointState"}:
            return Target(ratios={"rosbags": 2.2})
        if sample in _ENCODE:
            return Target(_ENCODE[sample], {"rosbags": 6.0})
    if metric == "parts" and sample in {"Image", "PointCloud2"}:
        limit, ratio = (1.5, 100.0) if sample == "Image" else (3.0, 15.0)
        return Target(limit, {"rosbags": ratio})
    if metric == "first use":
        return Target(8_000.0 if sample == "MarkerArray" else 3_000.0, {"rosbags": 2.0})
    if metric == "memory":
        return Target(200.0)
    return Target()


#: ros_babel_fish (C++, ROS 1 bytes), microseconds, measured elsewhere on the same kind of machine:
#: receive + translate, receive + translate + read every value, build + serialize.
CPLUSPLUS = {
    "PoseStamped": (0.416, 0.447, 0.686),
    "JointState": (0.368, 0.760, 0.751),
    "TFMessage": (15.4, 17.6, 29.1),
    "MarkerArray": (144.0, 163.3, 284.4),
    "DiagnosticArray": (16.3, 20.5, 32.2),
    "OccupancyGrid": (16.0, 16.1, 750.1),
    "PointCloud2": (20.2, 20.3, 733.5),
    "Image": (104.1, 104.2, 9545.7),
}
_CPLUSPLUS_COLUMN = {"decode": 0, "every leaf": 1, "encode": 2}


def cplusplus(metric: str, sample: str) -> float | None:
    """The C++ library's figure in microseconds, None where it has none."""
    if metric == "path":
        return 0.011 if sample in CPLUSPLUS else None  # 7-15 ns by its extractor
    column = _CPLUSPLUS_COLUMN.get(metric)
    return CPLUSPLUS[sample][column] if column is not None and sample in CPLUSPLUS else None
