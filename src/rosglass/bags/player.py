"""Playing recordings at any speed, with pause, seek and loop."""

from __future__ import annotations

import logging
import os
import re
import threading
import time
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.bags.recorder import MARKS_TOPIC
from rosglass.comm import Durability, Handle, QoS
from rosglass.comm.handle import undo_on_error
from rosglass.errors import BagError, Error, NodeClosedError
from rosglass.messages import Translation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rosglass.bags.bag import Bag, BagMessage, Channel
    from rosglass.comm import Node, Publisher

__all__ = [
    "Playback",
    "Player",
    "PlayerState",
    "PlayerStatus",
    "TopicDensity",
    "open_bag",
    "read_density",
    "read_marks",
]


_log = logging.getLogger("rosglass.bags")
_NS = 1_000_000_000
#: Longest sleep in seconds.
_MAX_SLEEP_S = 0.5
#: Shortest duration of a loop in seconds, for very short recordings.
_MIN_LOOP_S = 0.1
#: Seconds that closing waits for the player's thread.
_CLOSE_TIMEOUT_S = 5.0
#: The magic number of MCAP files.
_MCAP = b"\x89MCAP0\r\n"
#: Number of failed messages that are logged for each topic.
_MAX_LOGGED = 3
#: Event marks of a recording that are read.
_MAX_MARKS = 1000


class PlayerState(Enum):
    """The state of a player."""

    STARTING = "starting"
    PLAYING = "playing"
    PAUSED = "paused"
    FINISHED = "finished"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class PlayerStatus:
    """The progress of a player.

    Attributes:
        state: The state.
        position: Seconds since the recording's first message.
        sent: Messages sent so far.
        lag: Seconds by which sending is late, if it takes longer than the time between messages.
        rate: Speed; 2 is twice as fast.
    """

    state: PlayerState
    position: float
    sent: int
    lag: float
    rate: float


class Player(Handle):
    """Publishes the messages of a recording, until its end or until it is closed.

    Messages of ROS 1 recordings are translated for ROS 2 graphs, and the reverse.

    Args:
        node: Node that publishes.
        bag: The recording; the player does not close it.
        topics: Topics to play; empty for all.
        exclude: Regular expression; topics whose full name matches are left out.
        remap: New names of topics.
        rate: Speed; 2 is twice as fast.
        loop: Whether to start again at the end. A loop lasts as long as the selected part of the
            recording, even if its last message is earlier, and at least 0.1 s.
        clock: Rate in Hz at which to publish ``/clock``, so that nodes with ``use_sim_time``
            follow the recording; 0 to publish none. A recorded ``/clock`` is left out then.
        start: Start position in seconds.
        duration: Seconds of the recording to play; None for all.
        delay: Seconds to wait before the first message, so that subscriptions can match.
        paused: Whether to start paused.
        hold: Whether to pause at the end, for :meth:`seek` and :meth:`resume`, instead of ending.
        context: After :meth:`seek`, the newest message of each topic is sent at once if it is not
            older than this, in seconds: what a display showed at that position.

    Attributes:
        channels: The channels that are played.
        problems: Why topics are not played, and which other nodes publish there, by topic.

    Raises:
        BagError: An argument is invalid, or nothing is left to play.
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
        #: End of the selected part.
        self._last = bag.end if self._end is None else min(self._end, bag.end)
        self._delay, self._hold, self._context = delay, hold, int(context * _NS)
        self.problems: dict[str, str] = {}
        self.channels = self._choose(topics, exclude, clock)
        self._send: dict[Channel, Callable[[bytes], None]] = {}
        self._publishers: list[Publisher] = []
        self._failed: dict[str, int] = {}
        #: Guards the state below; notified when it changes.
        self._lock = threading.Condition()
        #: The viewer's time: a value in seconds, the monotonic time it is of, and its speed.
        self._played = (0.0, time.monotonic(), 0.0)
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
        with undo_on_error(self._close_publishers):
            self._advertise(remap or {})
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)
        self._thread.start()

    @property
    def position(self) -> float:
        """Seconds since the recording's first message."""
        target = self._target
        return ((self._position if target is None else target) - self._bag.start) / _NS

    @property
    def moment(self) -> int:
        """The position as recorded, in nanoseconds since the Unix epoch."""
        return self._position

    @property
    def played(self) -> float:
        """A monotonic time in seconds that measures the age of messages for a viewer.

        It stands still while the player is paused. It never runs backwards, so that nothing old
        becomes new: seeking adds the distance. It passes at real time at most: at ten times the
        speed, a topic of 1 Hz would look ten seconds old.
        """
        with self._lock:
            return self._read_played(time.monotonic())

    @property
    def is_paused(self) -> bool:
        """True while the player is paused."""
        return self._paused

    @property
    def loop(self) -> bool:
        """True if the player starts again at the end."""
        return self._loop

    def status(self) -> PlayerStatus:
        """Return the state and progress."""
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
        """Pause."""
        self._change(paused=True)

    def resume(self) -> None:
        """Continue after :meth:`pause`."""
        self._change(paused=False)

    def step(self) -> None:
        """Send the next message, and stay paused."""
        with self._lock:
            self._steps += 1
            self._paused = True
            self._set_anchor(self._position)
            self._lock.notify_all()

    def set_rate(self, rate: float) -> None:
        """Set the speed; raises BagError if it is invalid."""
        _check("rate", rate, 1e-3, 1e3)
        with self._lock:
            self._rate = float(rate)
            self._set_anchor(self._position)
            self._lock.notify_all()

    def set_loop(self, loop: bool) -> None:
        """Set whether to start again at the end."""
        with self._lock:
            self._loop = loop

    @property
    def range(self) -> tuple[float, float]:
        """First and last position of the part that is played, in seconds."""
        return (self._begin - self._bag.start) / _NS, (self._last - self._bag.start) / _NS

    def set_range(self, start: float, end: float) -> None:
        """Play, and repeat, a part only; a position outside of it moves into it.

        Args:
            start: First position in seconds.
            end: Position in seconds where the part ends.

        Raises:
            BagError: The recording has no such part.
        """
        length = max(self._bag.duration, 0.0)
        _check("start", start, 0.0, length)
        _check("end", end, 0.0, length)
        if not start < end:
            raise BagError(f"the end of the part, {end:g} s, must be after its start, {start:g} s")
        with self._lock:
            self._begin = self._bag.start + int(start * _NS)
            last = self._bag.start + int(end * _NS)
            # At the recording's end, its last message belongs to the part.
            self._end = None if end >= length else last
            self._last = min(last, self._bag.end)
            now = self._position if self._target is None else self._target
            self._target = min(max(now, self._begin), self._last)
            self._lock.notify_all()

    def seek(self, seconds: float) -> None:
        """Move to a position in seconds; earlier latched messages are sent again.

        Raises:
            BagError: The recording has no such position.
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
            self._thread.join(_CLOSE_TIMEOUT_S)
        self._close_publishers()

    def _choose(self, topics: Iterable[str], exclude: str, clock: float) -> tuple[Channel, ...]:
        if isinstance(topics, str):
            raise BagError(f"topics are given as a list, e.g. [{topics!r}]")
        wanted = {self._node.resolve(topic) for topic in topics}
        try:
            excluded = re.compile(exclude) if exclude else None
        except re.error as error:
            raise BagError(f"exclude {exclude!r} is not a regular expression: {error}") from error
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
            reasons = "; ".join(f"{topic}: {why}" for topic, why in self.problems.items())
            raise BagError(f"{self._bag.path} has nothing to play{reasons and ': ' + reasons}")
        if self._clock_period:
            self._clock = self._node.create_publisher(
                "/clock", "rosgraph_msgs/msg/Clock", QoS.clock()
            )
            self._publishers.append(self._clock)

    def _publisher(self, channel: Channel, topic: str) -> Callable[[bytes], None]:
        found = channel.type()
        convert = None
        if channel.wire != self._node.wire:
            translation = Translation(found)
            found, convert = translation.type, translation.encode
        publisher = self._node.create_publisher(topic, found, channel.profile())
        self._publishers.append(publisher)
        if convert is None:
            return publisher.publish_serialized
        return lambda data: publisher.publish_serialized(convert(data))

    def _close_publishers(self) -> None:
        for publisher in self._publishers:
            publisher.close()

    def _run(self) -> None:
        with self._lock:
            self._lock.wait_for(lambda: self._closed, self._delay)
            self._started = True
            self._set_anchor(self._begin)
        self._check_publishers()
        try:
            self._play(self._begin)
        except NodeClosedError:
            pass  # the node was closed first
        except Exception as error:  # noqa: BLE001 - damaged data; shown as the problem
            self.problems[""] = str(error)
            _log.exception("playing %s failed", self._bag.path)
        with self._lock:
            self._finished = True
            self._lock.notify_all()

    def _check_publishers(self) -> None:
        """Warn of other publishers: mixing a recording with a robot's own data is dangerous."""
        ours = {publisher.topic for publisher in self._publishers}
        me = self._node.resolve(self._node.name)
        for topic in sorted(ours):
            others = {p.node.full for p in self._node.publishers(topic)} - {me}
            if others:
                problem = f"{', '.join(sorted(others))} publishes here, too: messages get mixed"
                self.problems.setdefault(topic, problem)
                _log.warning("%s: %s", topic, problem)

    def _play(self, start: int) -> None:
        position: int | None = start
        while position is not None and not self._closed:
            if self._clock:
                self._publish_clock()
            if position > self._bag.start:
                self._send_context(position)
            position = self._play_from(position)
            if position is None and self._loop and not self._closed:
                position = self._begin
                with self._lock:
                    self._jump(position)

    def _play_from(self, start: int) -> int | None:
        """Play from a position to the end; return the target of a seek, if there was one."""
        again_at = time.monotonic() + _MIN_LOOP_S
        for message in self._bag.messages(self.channels, start, self._end):
            # A damaged index may name an end before the last messages.
            if not self._wait_for(min(message.time, self._bag.end)):
                return self._take_target()
            self._publish(message)
        if self._loop and not self._wait_for_loop(again_at):
            return self._take_target()
        with self._lock:
            holds = self._hold and not self._loop
            if holds and self._target is None and not self._closed:
                self._paused = True
                self._position = self._last
                self._set_anchor(self._position)
        if holds and self._clock:
            self._publish_clock()
        with self._lock:
            # A player that is paused at the end can still seek.
            self._lock.wait_for(
                lambda: self._closed or self._target is not None or not self._paused
            )
            if holds and self._target is None:
                self._target = self._begin
        return self._take_target()

    def _wait_for_loop(self, again_at: float) -> bool:
        """Wait until the next loop is due; return False if it was closed or sought instead."""
        if not self._wait_for(self._last, is_message=False):
            return False
        with self._lock:
            left = again_at - time.monotonic()
            return not self._lock.wait_for(lambda: self._closed or self._target is not None, left)

    def _wait_for(self, moment: int, *, is_message: bool = True) -> bool:
        """Wait until a message is due; return False if it was closed or sought instead."""
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
                    self._lock.wait(_MAX_SLEEP_S)
                    self._set_anchor(self._position)
                    continue
                position = self._position_at(now)
                left = (moment - position) / _NS / self._rate
                if left <= 0:
                    self._position, self._lag = moment, -left
                    return True
                self._position = max(self._position, position)
                tick = self._clock_due - now if self._clock else left
                if tick > 0:
                    self._lock.wait(min(left, tick, _MAX_SLEEP_S))
                    continue
            self._publish_clock()

    def _publish(self, message: BagMessage) -> None:
        if self._clock and time.monotonic() >= self._clock_due:
            self._publish_clock()
        try:
            self._send[message.channel](message.data)
        except NodeClosedError:
            raise
        except Error as error:
            topic = message.channel.topic
            self._failed[topic] = self._failed.get(topic, 0) + 1
            self.problems[topic] = f"{self._failed[topic]} messages not played, the last: {error}"
            if self._failed[topic] <= _MAX_LOGGED:
                _log.warning("%s: a message is not played: %s", topic, error)
            return
        self._sent += 1

    def _publish_clock(self) -> None:
        assert self._clock is not None
        seconds, rest = divmod(self._position, _NS)
        names = ("secs", "nsecs") if self._node.wire == "ros1" else ("sec", "nanosec")
        self._clock.publish(clock=dict(zip(names, (seconds, rest), strict=True)))
        self._clock_due = time.monotonic() + self._clock_period

    def _send_context(self, start: int) -> None:
        """Send the earlier messages that a display shows at a start position."""
        latched: list[Channel] = []
        others: list[Channel] = []
        for channel in self.channels:
            kept = channel.profile().durability is Durability.TRANSIENT_LOCAL
            (latched if kept else others).append(channel)
        last: dict[Channel, BagMessage] = {}
        for message in self._bag.messages(latched, None, start) if latched else ():
            last[message.channel] = message
        if others and self._context:
            for message in self._bag.messages(others, start - self._context, start):
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
        value, at, speed = self._played
        self._played = (value + abs(position - self._position) / _NS, at, speed)
        self._position = position
        self._set_anchor(position)

    def _set_anchor(self, position: int) -> None:
        now = time.monotonic()
        self._anchor = (now, position)
        runs = self._started and not self._paused
        self._played = (self._read_played(now), now, min(self._rate, 1.0) if runs else 0.0)

    def _read_played(self, now: float) -> float:
        value, at, speed = self._played
        return value + (now - at) * speed

    def _position_at(self, now: float) -> int:
        began, position = self._anchor
        return position + int((now - began) * self._rate * _NS)


def _check(what: str, value: Any, low: float, high: float) -> None:
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value)
    if not good or not low <= value <= high:
        raise BagError(f"{what} must be a number from {low:g} to {high:g}, got {value!r}")


#: Rate of ``/clock`` in Hz.
_CLOCK_HZ = 100.0


class Playback(Handle):
    """Plays a recording, which pauses at its end or starts again.

    Args:
        node: Node that publishes.
        bag: The recording; closed together with this, also if it cannot be played.
        rate: Speed; 2 is twice as fast.
        loop: Whether to start again at the end.
        paused: Whether to start paused.
        topics: Topics to play; empty for all.
        clock: Whether to publish ``/clock``, unless it was recorded.
        delay: Seconds until the first message.
        context: As for :class:`Player`.

    Attributes:
        path: Path of the recording.
        start: Time of its start, in nanoseconds since the Unix epoch.
        duration: Its length in seconds.
        has_clock: Whether ``/clock`` was recorded.

    Raises:
        BagError: It holds nothing to play, or an argument is invalid.
    """

    def __init__(
        self,
        node: Node,
        bag: Bag,
        *,
        rate: float = 1.0,
        loop: bool = False,
        paused: bool = False,
        topics: Iterable[str] = (),
        clock: bool = False,
        delay: float = 1.0,
        context: float = 0.0,
    ) -> None:
        self.path, self._bag = bag.path, bag
        self.start, self.duration = bag.start, max(bag.duration, 0.0)
        self.has_clock = any(channel.topic == "/clock" for channel in bag.channels)
        with undo_on_error(bag.close):
            self._player = Player(
                node,
                bag,
                rate=rate,
                loop=loop,
                paused=paused,
                topics=topics,
                clock=_CLOCK_HZ if clock and not self.has_clock else 0.0,
                delay=delay,
                hold=True,
                context=context,
            )

    @property
    def position(self) -> float:
        """Seconds since the start."""
        return self._player.position

    @property
    def moment(self) -> int:
        """The position as recorded, in nanoseconds since the Unix epoch."""
        return self._player.moment

    @property
    def played(self) -> float:
        """A monotonic time in seconds for viewers; see :attr:`Player.played`."""
        return self._player.played

    @property
    def is_playing(self) -> bool:
        """True while messages are played."""
        running = self._player.status().state in {PlayerState.STARTING, PlayerState.PLAYING}
        return running and not self._player.is_paused

    @property
    def is_at_end(self) -> bool:
        """True once it has paused at the end."""
        return not self.is_playing and self.position >= self.duration

    @property
    def rate(self) -> float:
        """The speed; 2 is twice as fast."""
        return self._player.status().rate

    @property
    def loop(self) -> bool:
        """True if the player starts again at the end."""
        return self._player.loop

    @property
    def problem(self) -> str:
        """Why some topics are not played; empty if all are."""
        problems = dict(self._player.problems)
        parts = [self._bag.problem, *(f"{t}: {why}" if t else why for t, why in problems.items())]
        return "; ".join(filter(None, parts))

    def play(self) -> None:
        """Play; from the start if the end was reached."""
        self._player.resume()

    def pause(self) -> None:
        """Pause."""
        self._player.pause()

    def seek(self, seconds: float) -> None:
        """Move to a position in seconds; raises BagError if there is none."""
        self._player.seek(seconds)

    def step(self) -> None:
        """Play the next message, and pause."""
        self._player.step()

    @property
    def range(self) -> tuple[float, float]:
        """First and last position of the part that is played, in seconds."""
        return self._player.range

    def set_range(self, start: float, end: float) -> None:
        """Play a part only; see :meth:`Player.set_range`."""
        self._player.set_range(start, end)

    def set_rate(self, rate: float) -> None:
        """Set the speed; raises BagError if it is invalid."""
        self._player.set_rate(rate)

    def set_loop(self, loop: bool) -> None:
        """Set whether to start again at the end instead of pausing."""
        self._player.set_loop(loop)

    def close(self) -> None:
        """Stop; safe to call twice."""
        self._player.close()
        self._bag.close()


def open_bag(path: str | os.PathLike[str]) -> Bag:
    """Open a recording: an MCAP file, a ROS 2 bag (folder, ``.mcap`` or ``.db3``), a ROS 1 bag.

    Raises:
        BagError: It does not exist, is damaged, or has none of these formats.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise BagError(f"a recording is given by its path, not by {path!r:.80}")
    found = Path(path).expanduser()
    if not found.exists():
        raise BagError(f"{found} does not exist; name an MCAP file, a ROS 2 bag or a ROS 1 bag")
    if found.is_file() and (found.suffix == ".mcap" or _starts_with(found, _MCAP)):
        from rosglass.bags.mcap_file import McapBag  # noqa: PLC0415 - mcap is an extra

        return McapBag(found)
    from rosglass.bags.ros1_bag_file import MAGIC, Ros1CutBag  # noqa: PLC0415 - rosbags is an extra
    from rosglass.bags.rosbags_bag import RosbagsBag  # noqa: PLC0415 - the same

    try:
        return RosbagsBag(found)
    except BagError:
        if not (found.is_file() and _starts_with(found, MAGIC)):
            raise
    return Ros1CutBag(found)


def read_marks(path: str | os.PathLike[str]) -> list[tuple[float, str]]:
    """Return the event marks of a recording: seconds since its start, and texts.

    Without an index of its topics, the whole file is read. At most 1000 are returned.

    Raises:
        BagError: It cannot be read.
    """
    found: list[tuple[float, str]] = []
    bag = open_bag(path)
    try:
        marks = [
            channel
            for channel in bag.channels
            if channel.topic == MARKS_TOPIC and channel.type_name == "std_msgs/msg/String"
        ]
        kinds = {channel: channel.type() for channel in marks}
        for message in bag.messages(marks) if marks else ():
            text = kinds[message.channel].decode(message.data, wire=message.channel.wire).data
            found.append(((message.time - bag.start) / _NS, text))
            if len(found) >= _MAX_MARKS:
                break
    finally:
        bag.close()
    return found


@dataclass(frozen=True)
class TopicDensity:
    """How the messages of a topic are spread over a recording.

    Attributes:
        topic: Absolute name.
        type_name: Type of its messages.
        count: Number of messages.
        parts: Messages in each of the equal parts of the recording.
    """

    topic: str
    type_name: str
    count: int
    parts: tuple[int, ...]


def read_density(
    path: str | os.PathLike[str], parts: int, ended: threading.Event | None = None
) -> list[TopicDensity]:
    """Return how the messages of each topic are spread over a recording, sorted by topic.

    Without an index, the whole file is read.

    Args:
        path: The recording.
        parts: Number of equal parts of its duration, from 1 to 10,000.
        ended: Set to return early, with what was counted so far.

    Raises:
        BagError: It cannot be read, or `parts` is invalid.
    """
    _check("parts", parts, 1, 10_000)
    bag = open_bag(path)
    try:
        counts = {channel: [0] * parts for channel in bag.channels}
        length = max(1, bag.end - bag.start + 1)
        for channel, times in bag.times():
            row = counts[channel]
            for at in times:
                row[min(max((at - bag.start) * parts // length, 0), parts - 1)] += 1
            if ended is not None and ended.is_set():
                break
    finally:
        bag.close()
    return [
        TopicDensity(channel.topic, channel.type_name, sum(row), tuple(row))
        for channel, row in sorted(counts.items(), key=lambda item: item[0].topic)
    ]


def _starts_with(path: Path, magic: bytes) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(magic)) == magic
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from error
