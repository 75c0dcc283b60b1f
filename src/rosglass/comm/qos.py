"""Quality of service: what a publisher offers and a subscription requests.

Policies and presets follow ROS 2's (design article "ROS 2 Quality of Service policies", rmw's
``qos_profiles.h``). ROS 1 maps them: transient local is latching, depth is the queue size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from rosglass.comm.time import Duration
from rosglass.errors import UnsupportedError

__all__ = ["Durability", "History", "Liveliness", "QoS", "Reliability"]


#: What rmw's profile can carry (a signed 32-bit integer in every middleware).
_MAX_DEPTH = 2**31 - 1


class Reliability(Enum):
    """Whether samples may get lost on the way."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"


class Durability(Enum):
    """Whether late subscriptions get earlier samples."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"


class History(Enum):
    """Which samples are kept while nobody has taken them."""

    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"


class Liveliness(Enum):
    """How a publisher shows that it is alive."""

    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"


@dataclass(frozen=True, slots=True)
class QoS:
    """A quality-of-service profile.

    Attributes:
        depth: Samples kept with keep-last history, at least 1.
        reliability: Reliable or best effort.
        durability: Volatile or transient local (ROS 1: latched).
        history: Keep last or keep all.
        deadline: Longest time between two samples, None for no limit.
        lifespan: Age at which a sample is worthless, None for no limit.
        liveliness: How a publisher's liveliness is asserted.
        lease_duration: Time without assertion after which it counts as dead, None for no limit.

    Raises:
        UnsupportedError: A policy has a value that it cannot have.
    """

    depth: int = 10
    reliability: Reliability = Reliability.RELIABLE
    durability: Durability = Durability.VOLATILE
    history: History = History.KEEP_LAST
    deadline: Duration | None = None
    lifespan: Duration | None = None
    liveliness: Liveliness = Liveliness.AUTOMATIC
    lease_duration: Duration | None = None

    def __post_init__(self) -> None:
        if type(self.depth) is not int or not 1 <= self.depth <= _MAX_DEPTH:
            raise UnsupportedError(
                f"QoS depth must be an integer from 1 to {_MAX_DEPTH}, got {self.depth!r}; "
                "use History.KEEP_ALL to keep every sample"
            )
        for name, kind in (
            ("reliability", Reliability),
            ("durability", Durability),
            ("history", History),
            ("liveliness", Liveliness),
        ):
            value = getattr(self, name)
            if not isinstance(value, kind):
                choices = " or ".join(f"{kind.__name__}.{member.name}" for member in kind)
                raise UnsupportedError(f"QoS {name} must be {choices}, got {value!r}")
        for name in ("deadline", "lifespan", "lease_duration"):
            value = getattr(self, name)
            if value is not None and not (isinstance(value, Duration) and value > Duration()):
                raise UnsupportedError(
                    f"QoS {name} must be a Duration above zero, e.g. "
                    f"Duration.from_seconds(0.5), or None for no limit; got {value!r}"
                )

    @classmethod
    def sensor_data(cls) -> QoS:
        """Best effort, the newest 5: camera images, scans."""
        return cls(depth=5, reliability=Reliability.BEST_EFFORT)

    @classmethod
    def latched(cls, depth: int = 1) -> QoS:
        """Reliable and transient local: maps, robot descriptions, ``/tf_static``."""
        return cls(depth=depth, durability=Durability.TRANSIENT_LOCAL)

    @classmethod
    def services(cls) -> QoS:
        """Reliable, volatile, the newest 10."""
        return cls()

    @classmethod
    def clock(cls) -> QoS:
        """Best effort, only the newest: ``/clock``."""
        return cls(depth=1, reliability=Reliability.BEST_EFFORT)

    def with_depth(self, depth: int) -> QoS:
        """Return a copy with another depth."""
        return replace(self, depth=depth)

    def incompatibility(self, offered: QoS) -> str:
        """Say why a subscription asking for this profile cannot match a publisher's `offered` one.

        Returns:
            The policies in conflict, in words; empty when the two match. The rules are DDS's
            request/offer rules (OMG DDS 1.4, section 2.2.3).
        """
        problems = []
        if (self.reliability, offered.reliability) == (
            Reliability.RELIABLE,
            Reliability.BEST_EFFORT,
        ):
            problems.append("reliability: reliable requested, best effort offered")
        if (self.durability, offered.durability) == (
            Durability.TRANSIENT_LOCAL,
            Durability.VOLATILE,
        ):
            problems.append("durability: transient local requested, volatile offered")
        problems += _too_long("deadline", self.deadline, offered.deadline)
        if (self.liveliness, offered.liveliness) == (
            Liveliness.MANUAL_BY_TOPIC,
            Liveliness.AUTOMATIC,
        ):
            problems.append("liveliness: manual by topic requested, automatic offered")
        problems += _too_long("lease duration", self.lease_duration, offered.lease_duration)
        return "; ".join(problems)


def _too_long(what: str, requested: Duration | None, offered: Duration | None) -> list[str]:
    if requested is None or (offered is not None and offered <= requested):
        return []
    told = "none" if offered is None else f"{offered.seconds} s"
    return [f"{what}: {requested.seconds} s requested, {told} offered"]
