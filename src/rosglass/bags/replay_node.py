"""A recording in a robot's place: ``rosglass.connect("replay:drive.mcap")``."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, quote, unquote

from rosglass.bags.bag import open_bag
from rosglass.bags.local_world import LocalNode, LocalWorld, SilentPublisher
from rosglass.bags.playback import Playback
from rosglass.comm import ConnectionState, Publisher, QoS, Status, Time
from rosglass.errors import ConversionError, NodeClosedError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm import NodeName, Sample
    from rosglass.messages import Message, MessageType

__all__ = ["ReplayNode", "connect_replay", "replay_url"]

#: How the address of a recording begins.
_SCHEME = "replay:"
#: Seconds until the first message: whoever connects subscribes meanwhile.
_DELAY = 0.5
#: Seconds of which the newest messages are shown at a place that was sought out.
_CONTEXT = 3.0
_OPTIONS = "rate=2, loop=true, paused=true"


class ReplayNode(LocalNode):
    """A node to which a recording is played.

    Its subscriptions receive what was recorded, its clock shows the recording's time, and what it
    publishes reaches nobody. A recorded ``/clock`` is the time; without one, the times at which
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
        # What is of both worlds is translated.
        ros1 = bool(bag.channels) and all(channel.wire == "ros1" for channel in bag.channels)
        super().__init__(LocalWorld("ros1" if ros1 else "cdr"), url, name, namespace)
        self._stage = LocalNode(self.world, url, "recording")
        self._closing = threading.Lock()
        try:
            self.playback = Playback(
                self._stage,
                bag,
                rate=rate,
                loop=loop,
                paused=paused,
                clock=True,
                delay=_DELAY,
                context=_CONTEXT,
            )
        except BaseException:
            self.world.close()
            raise
        if not self.playback.has_clock:
            # The clock ticks; messages came in between.
            self.world.arrival = lambda: self.playback.moment
            self.world.clock.advance(Time(self.playback.start))
        self._status = Status(ConnectionState.CONNECTED, f"playing the recording {path}")

    def choose(self, topics: Iterable[str]) -> None:
        """Play these topics only; all when there are none."""
        self.world.choose(self.resolve(topic) for topic in topics)

    def steady(self) -> float:
        """Return seconds that pass only while the recording is played."""
        return self.playback.played

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Return a publisher whose messages reach nobody, and which says so."""
        self._check_open()
        kind = self.world.find(type) if isinstance(type, str) else type
        profile = qos if isinstance(qos, QoS) else QoS(depth=qos)
        return _Nowhere(self.resolve(topic), kind, profile)

    def fetch_type(
        self,
        name: str,
        *,
        hash: str = "",  # noqa: ARG002 - a recording has one version
        node: str | NodeName | None = None,  # noqa: ARG002 - the same
        timeout: float | None = 5.0,  # noqa: ARG002 - nobody is waited for
    ) -> MessageType:
        """Return a type as it was recorded, else as this machine knows it."""
        return self.world.find(name)

    def close(self) -> None:
        """Stop playing; safe to call twice."""
        with self._closing:
            if self._closed:
                return
            super().close()
        self.playback.close()
        self._stage.close()
        self.world.close()

    def _unsupported(self, what: str) -> UnsupportedError:
        return UnsupportedError(
            f"{what}: {self.playback.path} is a recording, which answers nobody"
        )


class _Nowhere(SilentPublisher):
    """Takes what an interface publishes while it shows a recording."""

    def __init__(self, topic: str, kind: MessageType, qos: QoS) -> None:
        self.topic, self.type, self.qos = topic, kind, qos.for_publisher()
        self._closed = False

    def publish(self, message: Message | dict[str, Any] | None = None, /, **fields: Any) -> None:
        """Check a message as a robot would."""
        self.publish_serialized(self.type.encode(fields if message is None else message))

    def publish_serialized(
        self,
        data: bytes | bytearray | memoryview | Sample,  # noqa: ARG002 - it goes nowhere
    ) -> None:
        """Take what is encoded already."""
        if self._closed:
            raise NodeClosedError(f"the publisher of {self.topic} is closed")

    def subscription_count(self) -> int:
        """Return that nobody listens."""
        return 0

    @property
    def problem(self) -> str:
        """Why nobody gets anything."""
        return "this is a recording: what is published reaches no robot"

    def close(self) -> None:
        """Take no more; safe to call twice."""
        self._closed = True


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
