"""Quality-of-service profiles of QML: what ``Ros2.QoS()`` gives, and what it means."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import BEST_AVAILABLE, Durability, History, Liveliness, QoS, Reliability
from rosglass.comm.time import Duration
from rosglass.errors import ArgumentError, ConversionError
from rosglass.qml.js_values import shown

if TYPE_CHECKING:
    from rosglass.qt import QJSValue

__all__ = ["qos_from_js", "qos_parts", "queue_from_js"]

_BEST = "best_available"


def qos_parts(qos: QoS) -> tuple[Any, ...]:
    """Return what ``makeQos`` of helpers.js takes; durations are milliseconds, 0 for no limit."""
    limits = (qos.deadline, qos.lifespan, qos.lease_duration)
    head = (qos.reliability.value, qos.durability.value, qos.history.value, qos.depth)
    return (*head, qos.liveliness.value, *map(_milliseconds, limits))


def _milliseconds(limit: Duration | None) -> float | str:
    if limit is None:
        return 0
    return _BEST if limit == BEST_AVAILABLE else limit.nanoseconds / 1e6


def qos_from_js(value: QJSValue | None, default: QoS) -> QoS:
    """Return the profile that QML gave: one made by ``Ros2.QoS()``, or a queue size.

    Raises:
        ConversionError: It is neither, its depth is not a positive integer, or a limit is no
            number of milliseconds.
    """
    if value is None or value.isUndefined() or value.isNull():
        return default
    if value.isNumber():
        return default.with_depth(_depth(value.toNumber()))
    try:
        if not value.hasProperty("reliability"):
            raise ValueError
        liveliness = value.property("liveliness")
        return QoS(
            depth=_depth(value.property("size").toNumber()),
            reliability=Reliability(value.property("reliability").toString()),
            durability=Durability(value.property("durability").toString()),
            history=History(value.property("history").toString()),
            deadline=_limit(value, "deadline"),
            lifespan=_limit(value, "lifespan"),
            liveliness=Liveliness(
                "automatic" if liveliness.isUndefined() else liveliness.toString()
            ),
            lease_duration=_limit(value, "lease"),
        )
    except ArgumentError as error:
        raise ConversionError(f"qos.{error.path}", shown(value), error.expected) from None
    except ValueError:
        raise ConversionError("qos", shown(value), "a queue size or Ros2.QoS()") from None


def queue_from_js(value: QJSValue, default: QoS) -> QoS:
    """Return the profile of a queue size, or one given; 0 means no limit, as in ROS 1.

    Raises:
        ConversionError: As of :func:`qos_from_js`.
    """
    if value.isNumber() and value.toNumber() == 0:
        return replace(default, history=History.KEEP_ALL)
    return qos_from_js(value, default)


def _limit(value: QJSValue, name: str) -> Duration | None:
    """Return a profile's duration; None for no limit, which is 0 or infinity."""
    given = value.property(f"{name}Ms")
    if given.isString() and given.toString() == _BEST:
        return BEST_AVAILABLE
    if given.isUndefined() or (given.isNumber() and given.toNumber() in (0, float("inf"))):
        return None
    milliseconds = given.toNumber() if given.isNumber() else -1.0
    # 292 years, of which nanoseconds can tell.
    if not 1e-6 <= milliseconds < 9e12:
        wanted = "milliseconds above zero, or 0 for no limit"
        raise ConversionError(f"qos.{name}", shown(given), wanted)
    return Duration(round(milliseconds * 1e6))


def _depth(value: float) -> int:
    if not value.is_integer() or not 1 <= value <= 1_000_000:
        raise ConversionError("queue size", value, "an integer of 1 to 1000000")
    return int(value)
