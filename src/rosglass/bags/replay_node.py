"""A recording instead of a robot: ``rosglass.connect("replay:drive.mcap")``."""

from __future__ import annotations

import time
import uuid
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn
from urllib.parse import parse_qsl, quote, unquote

from rosglass.bags.player import Playback, open_bag
from rosglass.comm import (
    IMMEDIATE,
    ConnectionState,
    Durability,
    Publisher,
    QoS,
    Status,
    Time,
)
from rosglass.comm.handle import undo_on_error
from rosglass.comm.types import Types
from rosglass.comm.wire import Writer
from rosglass.errors import (
    ConversionError,
    TypeNotFoundError,
    UnsupportedError,
)
from rosglass.interfaces.names import join_name
from rosglass.messages import MessageType, OpaqueType
from rosglass.ros2.node import Ros2Node
from rosglass.wires.local import LocalMiddleware, LocalWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm import EndpointInfo, Executor, NodeName, Sample, Subscription
    from rosglass.messages import Message

__all__ = ["ReplayNode", "connect_replay", "replay_url"]

#: The beginning of a recording's URL.
_SCHEME = "replay:"
#: Seconds until the first message, in which subscriptions are created.
_DELAY_S = 0.5
#: Seconds before the target of a seek whose newest messages are sent.
_CONTEXT_S = 3.0
_OPTIONS = "rate=2, loop=true, paused=true"


def _refusal(what: str) -> Any:
    """Return a method that raises UnsupportedError, as a recording answers no requests."""

    def refuse(self: ReplayNode, *_: Any, **__: Any) -> NoReturn:
        raise UnsupportedError(
            f"{what}: {self.playback.path} is a recording, which answers no requests"
        )

    return refuse


class ReplayNode(Ros2Node):
    """A node that receives a recording.

    Its subscriptions receive the recorded messages, its clock follows the recording, and its own
    messages are discarded. The time is that of a recorded ``/clock``, or else the time at which
    each message was recorded.

    Args:
        path: The recording.
        url: URL that it was created with.
        name: Base name.
        namespace: Absolute namespace.
        rate: Speed; 2 is twice as fast.
        loop: Whether to start again at the end; it pauses there otherwise.
        paused: Whether to start paused.

    Attributes:
        playback: Controls pausing, seeking and speed.

    Raises:
        BagError: The recording cannot be read, or the rate is invalid.
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
        with undo_on_error(bag.close):
            super().__init__(_ReplayWire(local, wire), url, name, namespace)
        self._played = _ReplayWire(local, wire)
        self._played.arrival = lambda: self.clock.now().nanoseconds
        self._recording_node = _RecordingNode(self._played, url, "recording")
        self._recorded_types = _RecordedTypes(url, 1 if ros1 else 2, self._recording_node.types)
        self._core.types = self._recorded_types
        self._core.create_writer = lambda *_: _DiscardingWriter()
        self._core.clock.simulate(True)
        with undo_on_error(self._recording_node.close), undo_on_error(super().close):
            self.playback = Playback(
                self._recording_node,
                bag,
                rate=rate,
                loop=loop,
                paused=paused,
                clock=True,
                delay=_DELAY_S,
                context=_CONTEXT_S,
            )
            if not self.playback.has_clock:
                # The clock advances in steps; messages were recorded between them.
                self._played.arrival = lambda: self.playback.moment
                self._core.clock.advance(Time(self.playback.start))
            super().create_subscription(
                "/clock", "rosgraph_msgs/msg/Clock", qos=QoS.clock(),
                raw_callback=self._on_clock, executor=IMMEDIATE,
            )  # fmt: skip
        self._path = path

    def choose(self, topics: Iterable[str]) -> None:
        """Play these topics only; all topics if there are none."""
        self._played.choose({self.resolve(topic) for topic in topics})

    def status(self) -> Status:
        """Return the state: connected, with the path of the recording."""
        found = super().status()
        if found.state is not ConnectionState.CONNECTED:
            return found
        return Status(ConnectionState.CONNECTED, f"playing the recording {self._path}")

    def steady(self) -> float:
        """Return a monotonic time in seconds that stands still while the recording is paused."""
        return self.playback.played

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Return a publisher that discards its messages; its `problem` reports that."""
        self._core.check_open()
        kind = self._core.types.message(type)
        profile = qos if isinstance(qos, QoS) else QoS(depth=qos)
        return _DiscardingPublisher(self._core, self.resolve(topic), kind, profile)

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
            # The type is known at once, even of a topic that is not selected: a paused recording
            # sends nothing twice.
            known = recorded[0].type if type is None else type
            if callback is None:
                known = self._recorded_types.find_opaque(known) or known
        profile = qos if isinstance(qos, QoS) else QoS(depth=qos)
        # ROS 1 sends latched messages to every subscriber; an unrecorded QoS is not a conflict.
        if self.wire == "ros1" or self.resolve(topic) in self._unprofiled:
            profile = replace(profile, durability=Durability.BEST_AVAILABLE, send_timeout=None)
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

    def _receive(
        self, subscription: Subscription, type: str | MessageType | None, ignore_local: bool
    ) -> None:
        # By its name, so that the subscription reports why the recording cannot be decoded.
        wanted = type.name if isinstance(type, OpaqueType) else type
        super()._receive(subscription, wanted, ignore_local)

    def fetch_type(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,  # noqa: ARG002 - the recording has no nodes
        timeout: float | None = 5.0,  # noqa: ARG002 - it answers at once
    ) -> MessageType:
        """Return a type as recorded, or else as defined on this machine."""
        return self._core.types.message(name, hash)

    def close(self) -> None:
        """Stop playing; safe to call twice."""
        self.playback.close()
        self._recording_node.close()
        super().close()

    create_service_client = _refusal("service clients")
    create_service_server = _refusal("service servers")
    create_action_client = _refusal("action clients")
    create_action_server = _refusal("action servers")
    create_parameter_client = _refusal("parameters")
    create_lifecycle_client = _refusal("lifecycle nodes")
    fetch_type_async = _refusal("types")
    parameters = property(_refusal("parameters"))

    def _on_clock(self, sample: Sample) -> None:
        self._core.clock.advance(Time(sample.message().clock.nanoseconds))


class _RecordingNode(Ros2Node):
    """The node that publishes the recorded messages.

    Attributes:
        types: Types of its publishers.
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
    """A connection to the graph between a recording and its viewer.

    Args:
        url: ``local://NAME``.
        wire: Wire format of the recording.

    Attributes:
        arrival: Returns the time of reception for a message that is sent now, in nanoseconds since
            the Unix epoch.
    """

    # The messages were received when they were recorded, whatever their profiles.
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
        """Return the time at which the sample that is sent now was recorded."""
        return self.arrival(), None

    def choose(self, topics: set[str]) -> None:
        """Announce these topics and ``/clock``; all topics if there are none."""
        for writer in self._writers:
            if not topics or writer.info.name in {*topics, "/clock"}:
                writer.show()
            else:
                writer.hide()

    def recorded(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic, even if it is not announced."""
        return [writer.info for writer in self._writers if writer.info.name == topic]


class _RecordedTypes(Types):
    """Finds types as recorded, and others in the library.

    Args:
        url: URL of the node, for error texts.
        ros: ROS version of the recording.
        recorded: Types of the recording.
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
        """Return a placeholder for a message type without definition."""
        found = self._find_recorded(name, hash)
        return found if isinstance(found, OpaqueType) else super().opaque(name, hash, reason)

    def find_opaque(self, name: str) -> OpaqueType | None:
        """Return the placeholder of a type that was recorded without definition."""
        found = self._find_recorded(join_name(name), "")
        return found if isinstance(found, OpaqueType) else None

    def request(self, *_: Any) -> str:
        """Return why the type cannot be requested from a robot."""
        return "a recording cannot be asked for it"

    def _find_recorded(self, name: str, hash: str) -> MessageType | None:
        for found in self._recorded:
            if found.name == name and hash in ("", found.type_hash):
                return found
        return None


class _DiscardingPublisher(Publisher):
    """A publisher that checks messages but discards them."""

    @property
    def problem(self) -> str:
        """Why no robot receives its messages."""
        return "this is a recording: what is published reaches no robot"

    @property
    def hint(self) -> str:
        """Empty: a recording has no subscriptions."""
        return ""


class _DiscardingWriter(Writer):
    """A writer that discards its samples."""

    def write(self, data: bytes | bytearray) -> None:
        """Discard the payload."""

    def subscribers(self) -> list[EndpointInfo]:
        """Return no subscribers."""
        return []

    def close(self) -> None:
        """Do nothing."""


def connect_replay(url: str, name: str, namespace: str) -> ReplayNode:
    """Connect to a recording: ``replay:drive.mcap``, ``replay:/data/drive.bag?rate=2&loop=true``.

    In the path, ``%3F``, ``%23`` and ``%25`` stand for ``?``, ``#`` and ``%``, as in every URL.

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
    """Return the URL of a recording, with special characters of its path escaped."""
    # Escape only the characters of the URL's syntax, to keep it readable.
    return _SCHEME + "".join(quote(c, safe="") if c in "?#%" else c for c in path)
