"""Quality of service (QoS): profiles that publishers offer and subscriptions request.

Policies and presets follow ROS 2's (design article "ROS 2 Quality of Service policies", rmw's
``types.h`` and ``qos_profiles.h``). ROS 1: transient local is latching, depth is the queue size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, TypeVar

from rosglass.comm.time import Duration
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

__all__ = ["BEST_AVAILABLE", "Durability", "History", "Liveliness", "QoS", "Reliability"]

_Policy = TypeVar("_Policy", bound=Enum)
#: Limit of rmw's profile (a signed 32-bit integer in every middleware).
_MAX_DEPTH = 2**31 - 1
#: Seconds of :meth:`QoS.command`: longer than most round trips, shorter than robots' watchdogs.
_COMMAND_TIMEOUT_S = 0.3
#: A deadline or lease duration as strict as all peers allow (rmw's ``..._BEST_AVAILABLE``).
BEST_AVAILABLE = Duration(2**63 - 2)


class Reliability(Enum):
    """The retransmission of lost samples."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"
    #: The middleware's default; reliable everywhere in rosglass.
    SYSTEM_DEFAULT = "system_default"
    #: Reliable if that matches all endpoints on the topic.
    BEST_AVAILABLE = "best_available"


class Durability(Enum):
    """The delivery of earlier samples to late subscriptions."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"
    #: The middleware's default; volatile everywhere in rosglass.
    SYSTEM_DEFAULT = "system_default"
    #: Transient local if that matches all endpoints on the topic.
    BEST_AVAILABLE = "best_available"


class History(Enum):
    """The samples that are kept until they are read."""

    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"
    #: The middleware's default; keep last everywhere in rosglass.
    SYSTEM_DEFAULT = "system_default"


class Liveliness(Enum):
    """The way in which a publisher asserts that it is alive."""

    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"
    #: The middleware's default; automatic everywhere in rosglass.
    SYSTEM_DEFAULT = "system_default"
    #: Manual by topic if all publishers of the topic offer it, or a subscription requests it.
    BEST_AVAILABLE = "best_available"


@dataclass(frozen=True, slots=True)
class QoS:
    """A quality-of-service profile.

    Attributes:
        depth: Samples kept with keep-last history, at least 1.
        reliability: Reliable or best effort.
        durability: Volatile or transient local (ROS 1: latched).
        history: Keep last or keep all.
        deadline: Longest time between two samples; None for no limit.
        lifespan: Age at which a sample expires; None for no limit.
        liveliness: How a publisher's liveliness is asserted.
        lease_duration: Time without assertion after which liveliness is lost; None for no limit.
        send_timeout: For publishers: time that a message may wait on this machine until earlier
            ones have left; then it is dropped and counted. By this machine's steady clock; peers
            are not informed of it. None for no limit.

    The constant :data:`BEST_AVAILABLE` may stand for a deadline or a lease duration.

    Raises:
        ArgumentError: A policy has an invalid value.
    """

    depth: int = 10
    reliability: Reliability = Reliability.RELIABLE
    durability: Durability = Durability.VOLATILE
    history: History = History.KEEP_LAST
    deadline: Duration | None = None
    lifespan: Duration | None = None
    liveliness: Liveliness = Liveliness.AUTOMATIC
    lease_duration: Duration | None = None
    send_timeout: Duration | None = None

    def __post_init__(self) -> None:
        depth = self.depth
        if isinstance(depth, str) and depth in _PRESETS:
            expected = (
                f"a number of samples; for the profile of that name use QoS.preset({depth!r})"
            )
            raise ArgumentError("depth", depth, expected, "QoS")
        if type(depth) is not int or not 1 <= depth <= _MAX_DEPTH:
            expected = (
                f"an integer from 1 to {_MAX_DEPTH}; use History.KEEP_ALL to keep every sample, or "
                "a profile such as QoS.sensor_data()"
            )
            raise ArgumentError("depth", depth, expected, "QoS")
        for name, kind in (
            ("reliability", Reliability),
            ("durability", Durability),
            ("history", History),
            ("liveliness", Liveliness),
        ):
            value = getattr(self, name)
            if not isinstance(value, kind):
                choices = " or ".join(f"{kind.__name__}.{member.name}" for member in kind)
                raise ArgumentError(name, value, choices, "QoS")
        for name in ("deadline", "lifespan", "lease_duration", "send_timeout"):
            value = getattr(self, name)
            if value is None:
                continue
            if not (isinstance(value, Duration) and Duration() < value <= BEST_AVAILABLE):
                expected = (
                    "a Duration above zero and below 292 years, e.g. Duration.from_seconds(0.5), "
                    "or None for no limit"
                )
                raise ArgumentError(name, value, expected, "QoS")
            if name in ("lifespan", "send_timeout") and value == BEST_AVAILABLE:
                expected = "a Duration, or None for no limit, as it is the publisher's alone"
                raise ArgumentError(name, value, expected, "QoS")
        if self.send_timeout is None:
            return
        # Latched messages, and those of which none may be lost, are meant to be received late.
        if self.durability not in (Durability.VOLATILE, Durability.SYSTEM_DEFAULT):
            expected = "None, or volatile durability: latched messages are received late"
            raise ArgumentError("send_timeout", self.send_timeout, expected, "QoS")
        if self.history is History.KEEP_ALL:
            expected = "None, or keep-last history: keep all drops nothing"
            raise ArgumentError("send_timeout", self.send_timeout, expected, "QoS")

    @classmethod
    def command(cls) -> QoS:
        """Reliable, volatile, only the newest, sent within 0.3 s or dropped here: ``/cmd_vel``.

        It has no lifespan: by DDS's specification, readers compare that with the stamp of the
        sending machine, and would drop the commands of one whose clock is wrong.
        """
        return cls(depth=1, send_timeout=Duration.from_seconds(_COMMAND_TIMEOUT_S))

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
    def parameters(cls) -> QoS:
        """Reliable, volatile, the newest 1000: a node's parameter services."""
        return cls(depth=1000)

    @classmethod
    def parameter_events(cls) -> QoS:
        """Reliable, volatile, the newest 1000: ``/parameter_events``."""
        return cls(depth=1000)

    @classmethod
    def rosout(cls) -> QoS:
        """Reliable and transient local, the newest 1000 of the last 10 s: ``/rosout``."""
        return cls(1000, durability=Durability.TRANSIENT_LOCAL, lifespan=Duration(10_000_000_000))

    @classmethod
    def action_status(cls) -> QoS:
        """Reliable and transient local, only the newest: an action's list of goals."""
        return cls(depth=1, durability=Durability.TRANSIENT_LOCAL)

    @classmethod
    def clock(cls) -> QoS:
        """Best effort, only the newest: ``/clock``."""
        return cls(depth=1, reliability=Reliability.BEST_EFFORT)

    @classmethod
    def system_default(cls) -> QoS:
        """The middleware's defaults: reliable, volatile, the newest 10."""
        return cls(
            reliability=Reliability.SYSTEM_DEFAULT,
            durability=Durability.SYSTEM_DEFAULT,
            history=History.SYSTEM_DEFAULT,
            liveliness=Liveliness.SYSTEM_DEFAULT,
        )

    @classmethod
    def best_available(cls, depth: int = 10) -> QoS:
        """The strongest profile that matches all endpoints on the topic: for generic tools."""
        return cls(
            depth=depth,
            reliability=Reliability.BEST_AVAILABLE,
            durability=Durability.BEST_AVAILABLE,
            liveliness=Liveliness.BEST_AVAILABLE,
            deadline=BEST_AVAILABLE,
            lease_duration=BEST_AVAILABLE,
        )

    @classmethod
    def preset(cls, name: str) -> QoS:
        """Return the preset with a name, e.g. ``sensor_data``.

        Raises:
            ArgumentError: No preset has that name; the message lists them.
        """
        if not isinstance(name, str) or name not in _PRESETS:
            raise ArgumentError("name", name, f"one of {', '.join(_PRESETS)}", "QoS.preset()")
        return _PRESETS[name]()

    def with_depth(self, depth: int) -> QoS:
        """Return a copy with another depth."""
        return replace(self, depth=depth)

    @property
    def is_decided(self) -> bool:
        """True if no policy is a middleware default or best available."""
        return (
            self.reliability in (Reliability.RELIABLE, Reliability.BEST_EFFORT)
            and self.durability in (Durability.VOLATILE, Durability.TRANSIENT_LOCAL)
            and self.history is not History.SYSTEM_DEFAULT
            and self.liveliness in (Liveliness.AUTOMATIC, Liveliness.MANUAL_BY_TOPIC)
            and BEST_AVAILABLE not in (self.deadline, self.lease_duration)
        )

    def for_subscription(self, offered: Collection[QoS] = ()) -> QoS:
        """Return this profile with all policies decided, for a subscription.

        Args:
            offered: Profiles of the topic's publishers. Best-available policies become the
                strongest that match all of them; without any, reliable and transient local.
        """
        if self.is_decided:
            return self
        latched = (Durability.TRANSIENT_LOCAL, Durability.BEST_AVAILABLE)
        best_effort = any(o.reliability is Reliability.BEST_EFFORT for o in offered)
        volatile = any(o.durability not in latched for o in offered)
        manual = offered and all(o.liveliness is Liveliness.MANUAL_BY_TOPIC for o in offered)
        return self._decided(
            Reliability.BEST_EFFORT if best_effort else Reliability.RELIABLE,
            Durability.VOLATILE if volatile else Durability.TRANSIENT_LOCAL,
            Liveliness.MANUAL_BY_TOPIC if manual else Liveliness.AUTOMATIC,
            # A publisher without a limit matches no limit.
            _limit([o.deadline for o in offered], max, weakest=True),
            _limit([o.lease_duration for o in offered], max, weakest=True),
        )

    def for_publisher(self, requested: Collection[QoS] = ()) -> QoS:
        """Return this profile with all policies decided, for a publisher.

        Args:
            requested: Profiles of the topic's subscriptions. Best-available policies become the
                weakest that match all of them; reliable and transient local always do.
        """
        if self.is_decided:
            return self
        manual = any(r.liveliness is Liveliness.MANUAL_BY_TOPIC for r in requested)
        return self._decided(
            Reliability.RELIABLE,
            Durability.TRANSIENT_LOCAL,
            Liveliness.MANUAL_BY_TOPIC if manual else Liveliness.AUTOMATIC,
            _limit([r.deadline for r in requested], min),
            _limit([r.lease_duration for r in requested], min),
        )

    def _decided(
        self,
        reliability: Reliability,
        durability: Durability,
        liveliness: Liveliness,
        deadline: Duration | None,
        lease_duration: Duration | None,
    ) -> QoS:
        """Replace default policies, and best-available ones with the given values."""
        return replace(
            self,
            reliability=_decide(self.reliability, Reliability.RELIABLE, reliability),
            durability=_decide(self.durability, Durability.VOLATILE, durability),
            history=_decide(self.history, History.KEEP_LAST, History.KEEP_LAST),
            liveliness=_decide(self.liveliness, Liveliness.AUTOMATIC, liveliness),
            deadline=deadline if self.deadline == BEST_AVAILABLE else self.deadline,
            lease_duration=(
                lease_duration if self.lease_duration == BEST_AVAILABLE else self.lease_duration
            ),
        )

    def conflicts(self, offered: QoS) -> dict[str, str]:
        """Return why a subscription with this profile does not match a publisher's `offered` one.

        Returns:
            The conflict in words by policy, e.g. ``{"reliability": "reliable requested, best effort
            offered"}``; empty if the two match. The rules are DDS's request/offer rules (OMG DDS
            1.4, section 2.2.3).
        """
        offered = offered.for_publisher((self,))
        ours = self.for_subscription((offered,))
        found = {}
        if (ours.reliability, offered.reliability) == (
            Reliability.RELIABLE,
            Reliability.BEST_EFFORT,
        ):
            found["reliability"] = "reliable requested, best effort offered"
        if (ours.durability, offered.durability) == (
            Durability.TRANSIENT_LOCAL,
            Durability.VOLATILE,
        ):
            found["durability"] = "transient local requested, volatile offered"
        if conflict := _too_long(ours.deadline, offered.deadline):
            found["deadline"] = conflict
        if (ours.liveliness, offered.liveliness) == (
            Liveliness.MANUAL_BY_TOPIC,
            Liveliness.AUTOMATIC,
        ):
            found["liveliness"] = "manual by topic requested, automatic offered"
        if conflict := _too_long(ours.lease_duration, offered.lease_duration):
            found["lease duration"] = conflict
        return found

    def incompatibility(self, offered: QoS) -> str:
        """Return :meth:`conflicts` as one line; empty if the two profiles match."""
        return "; ".join(f"{policy}: {text}" for policy, text in self.conflicts(offered).items())


_PRESETS: dict[str, Callable[[], QoS]] = {
    "default": QoS,
    "command": QoS.command,
    "sensor_data": QoS.sensor_data,
    "latched": QoS.latched,
    "services": QoS.services,
    "parameters": QoS.parameters,
    "parameter_events": QoS.parameter_events,
    "rosout": QoS.rosout,
    "action_status": QoS.action_status,
    "clock": QoS.clock,
    "system_default": QoS.system_default,
    "best_available": QoS.best_available,
}


def check_profile(qos: QoS | int, place: str) -> QoS:
    """Return the profile for a `qos` argument, which may also be the depth of a default profile.

    Raises:
        ArgumentError: It is neither; the message names the place, such as a topic.
    """
    if isinstance(qos, QoS):
        return qos
    try:
        return QoS(depth=qos)
    except ArgumentError as error:
        raise ArgumentError("qos", error.value, error.expected, place) from None


def _decide(policy: _Policy, default: _Policy, best_available: _Policy) -> _Policy:
    open_policies = {"SYSTEM_DEFAULT": default, "BEST_AVAILABLE": best_available}
    return open_policies.get(policy.name, policy)


def _limit(
    limits: list[Duration | None],
    choose: Callable[[list[Duration]], Duration],
    weakest: bool = False,
) -> Duration | None:
    """Choose one of the limits; None if there are none or, with `weakest`, if one is missing."""
    given = [limit for limit in limits if limit is not None and limit != BEST_AVAILABLE]
    if not given or (weakest and len(given) < len(limits)):
        return None
    return choose(given)


def _too_long(requested: Duration | None, offered: Duration | None) -> str:
    if requested is None or (offered is not None and offered <= requested):
        return ""
    limit = "none" if offered is None else f"{offered.seconds} s"
    return f"{requested.seconds} s requested, {limit} offered"
