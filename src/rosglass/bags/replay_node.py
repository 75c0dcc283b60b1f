"""A recording in a robot's place: ``rosglass.connect("replay:drive.mcap")``."""

from __future__ import annotations

import time
import uuid
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, quote, unquote

from rosglass.bags.bag import open_bag
from rosglass.bags.playback import Playback
from rosglass.comm import (
    IMMEDIATE,
    ConnectionState,
    Durability,
    Node,
    Publisher,
    QoS,
    Status,
    Time,
)
from rosglass.comm.types import Types
from rosglass.errors import (
    ConversionError,
    TypeNotFoundError,
    UnsupportedError,
)
from rosglass.interfaces.names import join_name
from rosglass.messages import MessageType, OpaqueType
from rosglass.ros2.node import Ros2Node
from rosglass.wires.base import Writer
from rosglass.wires.local import LocalMiddleware, LocalWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm import EndpointInfo, Executor, NodeName, Sample, Subscription
    from rosglass.messages import Message

__all__ = ["ReplayNode", "connect_replay", "replay_url"]

#: How the address of a recording begins.
_SCHEME = "replay:"
#: Seconds until the first message: subscriptions are made meanwhile.
_DELAY_S = 0.5
#: Seconds of which the newest messages are shown at a place that was sought out.
_CONTEXT_S = 3.0
_OPTIONS = "rate=2, loop=true, paused=true"


class ReplayNode(Ros2Node):
    """A node to which a recording is played.

    Its subscriptions receive what was recorded, its clock shows the recording's time, and what it
    publishes is sent nowhere. A recorded ``/clock`` is the time; without one, the times at which
    the messages were recorded.

    Args:
        path: The recording.
        url: What it was connected with.
        name: Base name.
        namespace: Absolute namespace.
        rate: How fast time passes.
        loop: Whether to begin again at the end; otherwise it pauses there.
        paused: Whether to begin paused.

    Attributes:
        playback: Controls the time.

    Raises:
        BagError: It cannot be read, or the rate is none.
    """

    def __init__(
        self,
        path: str,
        url: str,
        name: str,
        namespace: str = "/",
        *,
        rate: float = 1.0,
        loop: bool = False,
        paused: bool = False,
    ) -> None:
        bag = open_bag(path)
        # Messages of both ROS in one recording are translated to ROS 2's.
        ros1 = bool(bag.channels) and all(channel.wire == "ros1" for channel in bag.channels)
        wire = "ros1" if ros1 else "cdr"
        self._unprofiled = {channel.topic for channel in bag.channels if not channel.offered}
        local = f"local://replay-{uuid.uuid4().hex}"
        try:
            super().__init__(_ReplayWire(local, wire), url, name, namespace)
        except BaseException:
            bag.close()
            raise
        self._played = _ReplayWire(local, wire)
        self._played.arrival = lambda: self.clock.now().nanoseconds
        self._stage = _Stage(self._played, url, "recording")
        self._recorded_types = _RecordedTypes(url, 1 if ros1 else 2, self._stage.types)
        self._core.types = self._recorded_types
        self._core.create_writer = lambda *_: _DiscardingWriter()
        self._core.clock.simulate(True)
        try:
            self.playback = Playback(
                self._stage,
                bag,
                rate=rate,
                loop=loop,
                paused=paused,
                clock=True,
                delay=_DELAY_S,
                context=_CONTEXT_S,
            )
            if not self.playback.has_clock:
                # The clock ticks; messages came in between.
                self._played.arrival = lambda: self.playback.moment
                self._core.clock.advance(Time(self.playback.start))
            super().create_subscription(
                "/clock", "rosgraph_msgs/msg/Clock", qos=QoS.clock(),
                raw_callback=self._on_tick, executor=IMMEDIATE,
            )  # fmt: skip
        except BaseException:
            super().close()
            self._stage.close()
            raise
        self._path = path

    def choose(self, topics: Iterable[str]) -> None:
        """Play these topics only; all when there are none."""
        self._played.choose({self.resolve(topic) for topic in topics})

    def status(self) -> Status:
        """Return which recording is played."""
        found = super().status()
        if found.state is not ConnectionState.CONNECTED:
            return found
        return Status(ConnectionState.CONNECTED, f"playing the recording {self._path}")

    def steady(self) -> float:
        """Return seconds that pass only while the recording is played."""
        return self.playback.played

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Return a publisher whose messages reach nobody, and which says so."""
        self._core.check_open()
        kind = self._core.types.message(type)
        profile = qos if isinstance(qos, QoS) else QoS(depth=qos)
        return _UnheardPublisher(self._core, self.resolve(topic), kind, profile)

    def create_subscription(
        self,
        topic: str,
        type: str | MessageType | None = None,
        callback: Callable[[Message], None] | None = None,
        qos: QoS | int = 10,
        *,
        raw_callback: Callable[[Sample], None] | None = None,
        executor: Executor | None = None,
        ignore_local: bool = False,
    ) -> Subscription:
        """Subscribe to a topic; arguments and errors as for every node."""
        recorded, known = self._played.recorded(self.resolve(topic)), type
        if recorded and (type is None or isinstance(type, str)):
            # Known at once, also while the topic is left out: a recording that is paused sends
            # nothing a second time.
            known = recorded[0].type if type is None else type
            if callback is None:
                known = self._recorded_types.find_opaque(known) or known
        profile = qos if isinstance(qos, QoS) else QoS(depth=qos)
        # ROS 1 sends what is latched to every subscriber, and what was not recorded is no conflict.
        if self.wire == "ros1" or self.resolve(topic) in self._unprofiled:
            profile = replace(profile, durability=Durability.BEST_AVAILABLE)
        qos = profile.for_subscription([info.qos for info in recorded])
        return super().create_subscription(
            topic,
            known,
            callback,
            qos,
            raw_callback=raw_callback,
            executor=executor,
            ignore_local=ignore_local,
        )

    def fetch_type(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,  # noqa: ARG002 - the recording has no nodes
        timeout: float | None = 5.0,  # noqa: ARG002 - it answers at once
    ) -> MessageType:
        """Return a type as it was recorded, else as this machine knows it."""
        return self._core.types.message(name, hash)

    def close(self) -> None:
        """Stop playing; safe to call twice."""
        self.playback.close()
        self._stage.close()
        super().close()

    # A recording answers no requests.
    create_service_client = Node.create_service_client
    create_service_server = Node.create_service_server
    create_action_client = Node.create_action_client
    create_action_server = Node.create_action_server
    create_parameter_client = Node.create_parameter_client
    create_lifecycle_client = Node.create_lifecycle_client
    fetch_type_async = Node.fetch_type_async
    parameters = Node.parameters  # type: ignore[assignment]

    def _unsupported(self, what: str) -> UnsupportedError:
        return UnsupportedError(
            f"{what}: {self.playback.path} is a recording, which answers nobody"
        )

    def _on_tick(self, sample: Sample) -> None:
        self._core.clock.advance(Time(sample.message().clock.nanoseconds))


class _Stage(Ros2Node):
    """The node that publishes what was recorded.

    Attributes:
        types: What it publishes.
    """

    def __init__(self, middleware: LocalMiddleware, url: str, name: str) -> None:
        super().__init__(middleware, url, name)
        self.types: list[MessageType] = []

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce a topic of the recording."""
        if isinstance(type, MessageType):
            self.types.append(type)
        return super().create_publisher(topic, type, qos)


class _ReplayWire(LocalMiddleware):
    """A node's end of the wire between a recording and those who watch it.

    Args:
        url: ``local://NAME``.
        wire: Wire format of the recording.

    Attributes:
        arrival: Returns when a message that is sent now arrived, nanoseconds since the Unix epoch.
    """

    # Recorded are messages that were received, whatever was asked for then.
    matches_qos = False

    arrival: Callable[[], int] = time.time_ns

    def __init__(self, url: str, wire: str) -> None:
        super().__init__(url, wire)
        self._writers: list[LocalWriter] = []

    def create_writer(self, endpoint: EndpointInfo) -> LocalWriter:
        """Announce a recorded topic."""
        self._writers.append(super().create_writer(endpoint))
        return self._writers[-1]

    def stamp(self) -> tuple[int, int | None]:
        """Return when the sample that is sent now was recorded."""
        return self.arrival(), None

    def choose(self, topics: set[str]) -> None:
        """Show these topics, and ``/clock``; all when there are none."""
        for writer in self._writers:
            if not topics or writer.info.name in {*topics, "/clock"}:
                writer.show()
            else:
                writer.hide()

    def recorded(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic, also while it is left out."""
        return [writer.info for writer in self._writers if writer.info.name == topic]


class _RecordedTypes(Types):
    """Finds types as they were recorded, others in the library.

    Args:
        url: The node's URL, for messages.
        ros: The ROS of the recording.
        recorded: The types that are played.
    """

    def __init__(self, url: str, ros: int, recorded: list[MessageType]) -> None:
        super().__init__(None, url, ros)
        self._recorded = recorded

    def message(self, wanted: str | MessageType, hash: str = "") -> MessageType:
        """Return a message type; arguments and errors as for :class:`Types`."""
        if isinstance(wanted, str):
            found = self._find_recorded(join_name(wanted), hash)
            if isinstance(found, OpaqueType):
                raise TypeNotFoundError(found.reason)
            if found is not None:
                return found
        return super().message(wanted, hash)

    def opaque(self, name: str, hash: str, reason: str) -> OpaqueType:
        """Return what stands for a message type without definition."""
        found = self._find_recorded(name, hash)
        return found if isinstance(found, OpaqueType) else super().opaque(name, hash, reason)

    def find_opaque(self, name: str) -> OpaqueType | None:
        """Return what stands for a type that was recorded without definition."""
        found = self._find_recorded(join_name(name), "")
        return found if isinstance(found, OpaqueType) else None

    def request(self, *_: Any) -> str:
        """Say that no robot is there to be asked."""
        return "a recording cannot be asked for it"

    def _find_recorded(self, name: str, hash: str) -> MessageType | None:
        for found in self._recorded:
            if found.name == name and hash in ("", found.type_hash):
                return found
        return None


class _UnheardPublisher(Publisher):
    """Checks what an interface publishes while it shows a recording."""

    @property
    def problem(self) -> str:
        """Why no robot gets anything."""
        return "this is a recording: what is published reaches no robot"

    @property
    def hint(self) -> str:
        """Nothing: the recording has no subscriptions."""
        return ""


class _DiscardingWriter(Writer):
    """The sending end of a publisher without robot."""

    def write(self, data: bytes | bytearray) -> None:
        """Send nothing."""

    def subscribers(self) -> list[EndpointInfo]:
        """Return none."""
        return []

    def close(self) -> None:
        """Do nothing."""


def connect_replay(url: str, name: str, namespace: str) -> ReplayNode:
    """Connect to a recording: ``replay:drive.mcap``, ``replay:/data/drive.bag?rate=2&loop=true``.

    In the path, ``%3F``, ``%23`` and ``%25`` are ``?``, ``#`` and ``%``, as in every URL.

    Raises:
        ConversionError: An option is not valid.
        BagError: The recording cannot be read.
    """
    path, _, query = url[len(_SCHEME) :].partition("?")
    path = unquote(path.removeprefix("//"))
    options: dict[str, Any] = {}
    for key, text in parse_qsl(query, keep_blank_values=True):
        if key == "rate":
            try:
                options[key] = float(text)
            except ValueError:
                raise ConversionError("rate", text, "a number such as 0.5", url) from None
        elif key in {"loop", "paused"} and text in {"true", "false"}:
            options[key] = text == "true"
        else:
            raise ConversionError("url", f"{key}={text}", f"options such as {_OPTIONS}", url)
    if not path:
        raise ConversionError("url", url, "a recording such as replay:drive.mcap")
    return ReplayNode(path, url, name, namespace, **options)


def replay_url(path: str) -> str:
    """Return the address of a recording, whatever characters its path has."""
    # What is no part of a URL's syntax stays readable.
    return _SCHEME + "".join(quote(c, safe="") if c in "?#%" else c for c in path)
