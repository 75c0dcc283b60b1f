"""Playing recordings back, at their own pace or another."""

from __future__ import annotations

import logging
import re
import threading
import time
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import TYPE_CHECKING, Any

from rosglass.comm import Durability, Handle, QoS
from rosglass.errors import BagError, Error, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rosglass.bags.bag import Bag, BagMessage, Channel
    from rosglass.comm import Node, Publisher

__all__ = ["Player", "PlayerState", "PlayerStatus"]


class PlayedTime:
    """Seconds by which ages are told; none pass while a recording stands still.

    They never run back, so that nothing old becomes new: to go to another place of the recording
    makes what is shown older by the distance. Methods may be called in any thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._value, self._since, self._speed = 0.0, time.monotonic(), 0.0

    def run(self, rate: float) -> None:
        """Pass at a recording's rate from now on, 0 for not at all.

        Never faster than for the operator: at ten times the speed, what is shown once per second
        would look ten seconds old.
        """
        with self._lock:
            self._settle()
            self._speed = min(rate, 1.0)

    def jump(self, seconds: float) -> None:
        """Pass by the distance to another place, in either direction."""
        with self._lock:
            self._value += abs(seconds)

    def now(self) -> float:
        """Return the seconds since the beginning."""
        with self._lock:
            self._settle()
            return self._value

    def _settle(self) -> None:
        now = time.monotonic()
        self._value += (now - self._since) * self._speed
        self._since = now


_log = logging.getLogger("rosglass.bags")
_NS = 1_000_000_000
#: Longest sleep in seconds.
_NAP = 0.5
#: Seconds that a lap of a loop lasts at least, however short the recording is.
_SHORTEST_LAP_S = 0.1
#: Seconds that closing waits for the player's thread.
_PATIENCE = 5.0
#: Undecodable messages that are logged for each topic.
_MAX_BAD = 3


class PlayerState(Enum):
    """What a player does."""

    STARTING = "starting"
    PLAYING = "playing"
    PAUSED = "paused"
    FINISHED = "finished"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class PlayerStatus:
    """How playing is going.

    Attributes:
        state: What the player does.
        position: Seconds since the recording's first message.
        sent: Messages sent so far.
        lag: Seconds by which sending is behind, because a message takes longer than its pause.
        rate: How fast time passes.
    """

    state: PlayerState
    position: float
    sent: int
    lag: float
    rate: float


class Player(Handle):
    """Publishes what a recording holds, until its end or until it is closed.

    ROS 1 recordings are played to ROS 2 graphs and the reverse, too: messages are translated on
    the way.

    Args:
        node: Who publishes.
        bag: The recording; the player does not close it.
        topics: Which topics; empty for all.
        exclude: Regular expression; topics whose whole name matches are left out.
        remap: New names of topics.
        rate: How fast time passes: 2 is twice as fast.
        loop: Whether to begin again at the end. A lap lasts as long as what was selected, whenever
            its last message comes, and 0.1 s at least.
        clock: Publish ``/clock`` so many times a second, so that nodes with ``use_sim_time``
            follow the recording; 0 for not at all. A recorded ``/clock`` is left out then.
        start: Seconds into the recording at which to begin.
        duration: Seconds of the recording to play; None for all.
        delay: Seconds to wait before the first message, so that subscriptions are linked.
        paused: Whether to begin paused.
        hold: Whether to pause at the end, for :meth:`seek` and :meth:`resume`, instead of ending.
        context: After :meth:`seek`, the newest message of each topic is sent at once if it is not
            older than so many seconds: what a display showed at that place.

    Attributes:
        channels: What is played.
        problems: What is not played and why, and what else publishes there, by topic.
        played: How much time has passed for those who watch.

    Raises:
        BagError: An argument makes no sense, or nothing is left to play.
    """

    def __init__(
        self,
        node: Node,
        bag: Bag,
        *,
        topics: Iterable[str] = (),
        exclude: str = "",
        remap: Mapping[str, str] | None = None,
        rate: float = 1.0,
        loop: bool = False,
        clock: float = 0.0,
        start: float = 0.0,
        duration: float | None = None,
        delay: float = 1.0,
        paused: bool = False,
        hold: bool = False,
        context: float = 0.0,
    ) -> None:
        _check("rate", rate, 1e-3, 1e3)
        _check("clock", clock, 0.0, 1e4)
        _check("start", start, 0.0, max(bag.duration, 0.0))
        _check("delay", delay, 0.0, 3600.0)
        _check("context", context, 0.0, 3600.0)
        if duration is not None:
            _check("duration", duration, 0.0, 1e9)
        self._node, self._bag = node, bag
        self._rate, self._loop = float(rate), loop
        self._begin = bag.start + int(start * _NS)
        self._end = None if duration is None else self._begin + int(duration * _NS)
        #: Where what was selected ends.
        self._last = bag.end if self._end is None else min(self._end, bag.end)
        self._delay, self._hold, self._context = delay, hold, int(context * _NS)
        self.problems: dict[str, str] = {}
        self.played = PlayedTime()
        self.channels = self._choose(topics, exclude, clock)
        self._send: dict[Channel, Callable[[bytes], None]] = {}
        self._publishers: list[Publisher] = []
        self._bad: dict[str, int] = {}
        self._lock = threading.Condition()
        self._paused, self._closed, self._finished = paused, False, False
        self._started = False
        self._steps = 0
        self._target: int | None = None
        self._position = self._begin
        self._anchor = (0.0, self._begin)
        self._sent, self._lag = 0, 0.0
        self._clock_period = 1.0 / clock if clock else 0.0
        self._clock_due = 0.0
        self._clock: Publisher | None = None
        try:
            self._advertise(remap or {})
        except BaseException:
            self._withdraw()
            raise
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)
        self._thread.start()

    @property
    def position(self) -> float:
        """Seconds since the recording's first message."""
        target = self._target
        return ((self._position if target is None else target) - self._bag.start) / _NS

    @property
    def moment(self) -> int:
        """Where it is, as recorded: nanoseconds since the Unix epoch."""
        return self._position

    @property
    def is_paused(self) -> bool:
        """Whether time stands still."""
        return self._paused

    @property
    def loop(self) -> bool:
        """Whether it begins again at the end."""
        return self._loop

    def status(self) -> PlayerStatus:
        """Return what the player does now."""
        with self._lock:
            if self._closed:
                state = PlayerState.CLOSED
            elif self._finished:
                state = PlayerState.FINISHED
            elif not self._started:
                state = PlayerState.STARTING
            else:
                state = PlayerState.PAUSED if self._paused else PlayerState.PLAYING
            return PlayerStatus(state, self.position, self._sent, self._lag, self._rate)

    def pause(self) -> None:
        """Let time stand still."""
        self._change(paused=True)

    def resume(self) -> None:
        """Go on after :meth:`pause`."""
        self._change(paused=False)

    def step(self) -> None:
        """Send one message more, and stay paused."""
        with self._lock:
            self._steps += 1
            self._paused = True
            self._set_anchor(self._position)
            self._lock.notify_all()

    def set_rate(self, rate: float) -> None:
        """Let time pass faster or slower from now on; raises BagError."""
        _check("rate", rate, 1e-3, 1e3)
        with self._lock:
            self._rate = float(rate)
            self._set_anchor(self._position)
            self._lock.notify_all()

    def set_loop(self, loop: bool) -> None:
        """Begin again at the end, or not."""
        with self._lock:
            self._loop = loop

    def seek(self, seconds: float) -> None:
        """Go on at another place of the recording; latched messages from before are sent again.

        Raises:
            BagError: The recording has no such place.
        """
        _check("position", seconds, 0.0, max(self._bag.duration, 0.0))
        with self._lock:
            self._target = self._bag.start + int(seconds * _NS)
            self._lock.notify_all()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the end; return whether it was reached within `timeout` seconds.

        Raises:
            BagError: The recording is damaged.
        """
        with self._lock:
            self._lock.wait_for(lambda: self._finished or self._closed, timeout)
            ended = self._finished or self._closed
        if "" in self.problems:
            raise BagError(self.problems[""])
        return ended

    def close(self) -> None:
        """Stop, and withdraw the publishers; safe to call twice."""
        with self._lock:
            self._closed = True
            self._lock.notify_all()
        if self._thread is not threading.current_thread():
            self._thread.join(_PATIENCE)
        self._withdraw()

    def _choose(self, topics: Iterable[str], exclude: str, clock: float) -> tuple[Channel, ...]:
        if isinstance(topics, str):
            raise BagError(f"topics are given as a list, e.g. [{topics!r}]")
        wanted = {self._node.resolve(topic) for topic in topics}
        try:
            excluded = re.compile(exclude) if exclude else None
        except re.error as error:
            raise BagError(f"exclude {exclude!r} is no regular expression: {error}") from error
        names = {channel.topic for channel in self._bag.channels}
        for missing in sorted(wanted - names):
            raise BagError(
                f"{self._bag.path} has no topic {missing}; it has {', '.join(sorted(names))}"
            )
        chosen = []
        for channel in self._bag.channels:
            if wanted and channel.topic not in wanted:
                continue
            if excluded is not None and excluded.fullmatch(channel.topic):
                continue
            if clock and channel.topic == "/clock":
                self.problems[channel.topic] = "left out: the player publishes its own"
                continue
            chosen.append(channel)
        return tuple(chosen)

    def _advertise(self, remap: Mapping[str, str]) -> None:
        new_names = {self._node.resolve(a): self._node.resolve(b) for a, b in remap.items()}
        for channel in self.channels:
            topic = new_names.get(channel.topic, channel.topic)
            try:
                self._send[channel] = self._publisher(channel, topic)
            except NodeClosedError:
                raise
            except Error as error:
                self.problems[channel.topic] = f"not played: {error}"
                _log.warning("%s is not played: %s", channel.topic, error)
        self.channels = tuple(c for c in self.channels if c in self._send)
        if not self.channels:
            told = "; ".join(f"{topic}: {why}" for topic, why in self.problems.items())
            raise BagError(f"{self._bag.path} has nothing to play{': ' + told if told else ''}")
        if self._clock_period:
            self._clock = self._node.create_publisher(
                "/clock", "rosgraph_msgs/msg/Clock", QoS.clock()
            )
            self._publishers.append(self._clock)

    def _publisher(self, channel: Channel, topic: str) -> Callable[[bytes], None]:
        found = channel.type()
        convert = None
        if channel.wire != self._node.wire:
            from rosglass.messages import Translation  # noqa: PLC0415 - only for the other ROS's

            translation = Translation(found)
            found, convert = translation.type, translation.encode
        publisher = self._node.create_publisher(topic, found, channel.profile())
        self._publishers.append(publisher)
        if convert is None:
            return publisher.publish_serialized
        return lambda data: publisher.publish_serialized(convert(data))

    def _withdraw(self) -> None:
        for publisher in self._publishers:
            publisher.close()

    def _run(self) -> None:
        with self._lock:
            self._lock.wait_for(lambda: self._closed, self._delay)
            self._started = True
            self._set_anchor(self._begin)
        self._look_around()
        try:
            self._play(self._begin)
        except NodeClosedError:
            pass  # the node went first
        except Exception as error:
            self.problems[""] = str(error)
            _log.exception("playing %s failed", self._bag.path)
        with self._lock:
            self._finished = True
            self._lock.notify_all()

    def _look_around(self) -> None:
        """Note who else publishes: mixing a recording with a robot's own data is dangerous."""
        ours = {publisher.topic for publisher in self._publishers}
        me = self._node.resolve(self._node.name)
        for topic in sorted(ours):
            others = {p.node.full for p in self._node.publishers(topic)} - {me}
            if others:
                told = f"{', '.join(sorted(others))} publishes here, too: messages get mixed"
                self.problems.setdefault(topic, told)
                _log.warning("%s: %s", topic, told)

    def _play(self, start: int) -> None:
        place: int | None = start
        while place is not None and not self._closed:
            if self._clock:
                self._tell_time()
            if place > self._bag.start:
                self._send_context(place)
            place = self._pass(place)
            if place is None and self._loop and not self._closed:
                place = self._begin
                with self._lock:
                    self._jump(place)

    def _pass(self, start: int) -> int | None:
        """Play from a place to the end; returns where to go on if there was a seek."""
        again_at = time.monotonic() + _SHORTEST_LAP_S
        for message in self._bag.messages(self.channels, start, self._end):
            if not self._wait_for(message.time):
                return self._take_target()
            self._publish(message)
        if self._loop and not self._wait_for_lap(again_at):
            return self._take_target()
        with self._lock:
            holds = self._hold and not self._loop
            if holds and self._target is None and not self._closed:
                self._paused = True
                self._position = self._last
                self._set_anchor(self._position)
        if holds and self._clock:
            self._tell_time()
        with self._lock:
            # At the end, a player that was paused can still be sent elsewhere.
            self._lock.wait_for(
                lambda: self._closed or self._target is not None or not self._paused
            )
            if holds and self._target is None:
                self._target = self._begin
        return self._take_target()

    def _wait_for_lap(self, again_at: float) -> bool:
        """Wait until the next lap is due; returns False when something else is to be done."""
        if not self._wait_for(self._last, is_message=False):
            return False
        with self._lock:
            left = again_at - time.monotonic()
            return not self._lock.wait_for(lambda: self._closed or self._target is not None, left)

    def _wait_for(self, moment: int, *, is_message: bool = True) -> bool:
        """Wait until a message is due; returns False when something else is to be done."""
        while True:
            with self._lock:
                if self._closed or self._target is not None:
                    return False
                now = time.monotonic()
                if self._paused:
                    if self._steps:
                        self._steps -= is_message
                        self._jump(moment)
                        return True
                    self._lock.wait(_NAP)
                    self._set_anchor(self._position)
                    continue
                place = self._place(now)
                left = (moment - place) / _NS / self._rate
                if left <= 0:
                    self._position, self._lag = moment, -left
                    return True
                self._position = max(self._position, place)
                tick = self._clock_due - now if self._clock else left
                if tick > 0:
                    self._lock.wait(min(left, tick, _NAP))
                    continue
            self._tell_time()

    def _publish(self, message: BagMessage) -> None:
        if self._clock and time.monotonic() >= self._clock_due:
            self._tell_time()
        try:
            self._send[message.channel](message.data)
        except NodeClosedError:
            raise
        except Error as error:
            topic = message.channel.topic
            self._bad[topic] = self._bad.get(topic, 0) + 1
            self.problems[topic] = f"{self._bad[topic]} messages not played, the last: {error}"
            if self._bad[topic] <= _MAX_BAD:
                _log.warning("%s: a message is not played: %s", topic, error)
            return
        self._sent += 1

    def _tell_time(self) -> None:
        assert self._clock is not None
        seconds, rest = divmod(self._position, _NS)
        words = ("secs", "nsecs") if self._node.wire == "ros1" else ("sec", "nanosec")
        self._clock.publish(clock={words[0]: seconds, words[1]: rest})
        self._clock_due = time.monotonic() + self._clock_period

    def _send_context(self, place: int) -> None:
        """Send what a display shows of what came before the place where playing begins."""
        latched: list[Channel] = []
        others: list[Channel] = []
        for channel in self.channels:
            kept = channel.profile().durability is Durability.TRANSIENT_LOCAL
            (latched if kept else others).append(channel)
        last: dict[Channel, BagMessage] = {}
        for message in self._bag.messages(latched, None, place) if latched else ():
            last[message.channel] = message
        if others and self._context:
            for message in self._bag.messages(others, place - self._context, place):
                last[message.channel] = message
        for message in sorted(last.values(), key=lambda message: message.time):
            self._publish(message)

    def _take_target(self) -> int | None:
        with self._lock:
            target, self._target = self._target, None
            if target is not None:
                self._jump(target)
            return None if self._closed else target

    def _change(self, paused: bool) -> None:
        with self._lock:
            self._paused = paused
            self._steps = 0
            self._set_anchor(self._position)
            self._lock.notify_all()

    def _jump(self, position: int) -> None:
        self.played.jump((position - self._position) / _NS)
        self._position = position
        self._set_anchor(position)

    def _set_anchor(self, position: int) -> None:
        self._anchor = (time.monotonic(), position)
        self.played.run(self._rate if self._started and not self._paused else 0.0)

    def _place(self, now: float) -> int:
        began, position = self._anchor
        return position + int((now - began) * self._rate * _NS)


def _check(what: str, value: Any, low: float, high: float) -> None:
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value)
    if not good or not low <= value <= high:
        raise BagError(f"{what} must be a number from {low:g} to {high:g}, got {value!r}")
