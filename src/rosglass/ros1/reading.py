"""Keeping one subscription fed: its type, and what stands in the way of its messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, Matched, NodeName, Sample, Source
from rosglass.errors import DefinitionError, InvalidNameError, TypeNotFoundError
from rosglass.interfaces import ros1_name
from rosglass.ros1.names import split
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Subscription
    from rosglass.messages import MessageType
    from rosglass.ros1.core import Core
    from rosglass.ros1.intake import Intake, Link

__all__ = ["Reading"]


class Reading(Source):
    """Serves a subscription from its creation to its end.

    Args:
        core: The node it belongs to.
        intake: The node's connections for the topic.
        subscription: Whom to serve.
        ignore_local: Whether to leave out what this node publishes itself.
        on_close: Called once when the subscription is closed.
    """

    def __init__(
        self,
        core: Core,
        intake: Intake,
        subscription: Subscription,
        ignore_local: bool,
        on_close: Callable[[Reading], None],
    ) -> None:
        self.subscription = subscription
        self._core, self._intake, self._on_close = core, intake, on_close
        self._ignored = core.name.full if ignore_local else ""
        #: The type of each publisher that is understood, and what is wrong with the others.
        self._accepted: dict[Link, tuple[MessageType, bytes]] = {}
        self._refused: dict[Link, str] = {}
        self._fixed = subscription.type is not None
        subscription.source, subscription.on_close = self, self.close
        subscription.set_qos(subscription.qos.for_subscription([]))

    # -- in the loop's thread --------------------------------------------------------------------

    def meet(self, link: Link) -> None:
        """Look whether a publisher's messages are understood."""
        name, md5 = link.header.get("type", ""), link.header.get("md5sum", "")
        if self._ignored and link.name == self._ignored:
            return
        wanted = self.subscription.type
        try:
            if wanted is None or not self._fixed:
                kind = self._core.types.learn(name, md5, link.header.get("message_definition", ""))
                if wanted is None:
                    self.subscription.set_type(kind)
            elif md5 in (ANY, wanted.md5) and name in (ANY, ros1_name(wanted.name)):
                kind = wanted
            else:
                self._refused[link] = self._mismatch(link, wanted)
                return
        except (TypeNotFoundError, DefinitionError, InvalidNameError) as error:
            self._refused[link] = str(error)
            return
        self._accepted[link] = (kind, link.name.encode())

    def take(self, link: Link, data: bytes | bytearray, received: int) -> None:
        """Hand on a message."""
        known = self._accepted.get(link)
        if known is not None:
            view = data if type(data) is bytes else memoryview(data).toreadonly()
            self.subscription.deliver(
                tuple.__new__(Sample, (view, "ros1", known[0], received, None, known[1], -1))
            )

    # -- what the subscription asks --------------------------------------------------------------

    def publisher_count(self) -> int:
        """Return how many publishers are connected and understood."""
        return len(self._matching())

    def hint(self) -> str:
        """Say what may be wrong when nobody publishes the topic; empty when somebody does."""
        topic, graph = self._intake.topic, self._core.graph
        if graph.endpoints(EndpointKind.PUBLISHER, topic):
            return ""
        return f"nobody publishes {topic}"

    def inform(self) -> None:
        """Look at the subscription soon."""
        self._core.wake()

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - links change by themselves
        """Tell what has changed; on the node's own thread."""
        links = self._intake.links()
        there = set(links)
        for known in (self._accepted, self._refused):
            for link in [link for link in list(known) if link not in there or not link.connected]:
                known.pop(link, None)
        problems = [link.problem for link in links if link.problem]
        problems += [text for link, text in list(self._refused.items()) if link in there]
        self.subscription.set_problem("; ".join(dict.fromkeys(problems)))
        self.subscription.events.matched.update(self._matching(), Matched)

    def close(self) -> None:
        """Stop receiving."""
        self.subscription.close()
        self._on_close(self)

    def _matching(self) -> list[EndpointInfo]:
        return [
            EndpointInfo(
                EndpointKind.PUBLISHER,
                self._intake.topic,
                kind.name,
                NodeName(*split(link.name)),
                type_hash=link.header.get("md5sum", ""),
                gid=gid,
            )
            for link, (kind, gid) in list(self._accepted.items())
            if link.connected
        ]

    def _mismatch(self, link: Link, wanted: MessageType) -> str:
        header = link.header
        theirs = header.get("message_definition", "").strip() or "(it sends no definition)"
        return (
            f"{link.name} publishes {self._intake.topic} as {header.get('type')} with md5 "
            f"{header.get('md5sum')}, asked for was {ros1_name(wanted.name)} with md5 "
            f"{wanted.md5}: nothing is received from it; subscribe without a type to take what it "
            f"sends, or add its definition to the library.\nTheirs:\n{theirs}\nOurs:\n"
            f"{self._core.types.text(wanted).strip()}"
        )
