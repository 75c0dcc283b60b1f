"""The quality of service that rosbag2 writes beside each topic.

Format: rosbag2's ``offered_qos_profiles``, a YAML list; words since ROS 2 Iron, rmw's numbers
before (``rmw/types.h``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import yaml

from rosglass.comm import Durability, Duration, History, Liveliness, QoS, Reliability
from rosglass.comm.text_files import load_yaml

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["profile", "read_profiles", "write_profiles"]

_NS = 1_000_000_000
_INFINITE = {"sec": 9223372036, "nsec": 854775807}
#: Spans of a century and more mean "infinite".
_CENTURY = 100 * 365 * 86400 * _NS
_HISTORY = {1: History.KEEP_LAST, 2: History.KEEP_ALL}
_RELIABILITY = {1: Reliability.RELIABLE, 2: Reliability.BEST_EFFORT}
_DURABILITY = {1: Durability.TRANSIENT_LOCAL, 2: Durability.VOLATILE}
_LIVELINESS = {1: Liveliness.AUTOMATIC, 3: Liveliness.MANUAL_BY_TOPIC}


def write_profiles(profiles: Iterable[QoS]) -> str:
    """Return the YAML text for publishers' profiles."""
    return str(yaml.safe_dump([_plain(qos) for qos in profiles], sort_keys=False))


def read_profiles(text: str) -> tuple[QoS, ...]:
    """Return the profiles that a recording names; what is not understood counts as the default."""
    try:
        documents = load_yaml(text or "[]")
    except yaml.YAMLError:
        return ()
    entries = documents[0] if documents else None
    if not isinstance(entries, list):
        return ()
    return tuple(profile(entry) for entry in entries if isinstance(entry, dict))


def _plain(qos: QoS) -> dict[str, Any]:
    return {
        "history": qos.history.value,
        "depth": qos.depth,
        "reliability": qos.reliability.value,
        "durability": qos.durability.value,
        "deadline": _span(qos.deadline),
        "lifespan": _span(qos.lifespan),
        "liveliness": qos.liveliness.value,
        "liveliness_lease_duration": _span(qos.lease_duration),
        "avoid_ros_namespace_conventions": False,
    }


def _span(duration: Duration | None) -> dict[str, int]:
    if duration is None:
        return dict(_INFINITE)
    seconds, rest = divmod(duration.nanoseconds, _NS)
    return {"sec": seconds, "nsec": rest}


def profile(entry: dict[str, Any]) -> QoS:
    """Return one profile, given by its parts as in rosbag2's text."""
    depth = entry.get("depth")
    return QoS(
        depth=depth if isinstance(depth, int) and 0 < depth < 2**31 else 10,
        reliability=_pick(entry, "reliability", _RELIABILITY, Reliability.RELIABLE),
        durability=_pick(entry, "durability", _DURABILITY, Durability.VOLATILE),
        history=_pick(entry, "history", _HISTORY, History.KEEP_LAST),
        deadline=_duration(entry.get("deadline")),
        lifespan=_duration(entry.get("lifespan")),
        liveliness=_pick(entry, "liveliness", _LIVELINESS, Liveliness.AUTOMATIC),
        lease_duration=_duration(entry.get("liveliness_lease_duration")),
    )


def _pick(entry: dict[str, Any], key: str, numbers: dict[int, Any], default: Any) -> Any:
    value = entry.get(key)
    for number, member in numbers.items():
        if value in (number, member.value):
            return member
    return default


def _duration(value: object) -> Duration | None:
    if not isinstance(value, dict):
        return None
    try:
        total = int(value.get("sec", 0)) * _NS + int(value.get("nsec", 0))
    except (TypeError, ValueError, OverflowError):
        return None
    return Duration(total) if 0 < total < _CENTURY else None
