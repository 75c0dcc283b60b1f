"""The topics of an action as its client has them: who is connected, and what is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Publisher, Subscription
from rosglass.ros1.action_types import CANCEL, FEEDBACK, GOAL, QUEUE, RESULT, STATUS, goal_id, part

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from rosglass.comm import Sample, Time
    from rosglass.ros1.action_types import ActionTypes
    from rosglass.ros1.core import Core
    from rosglass.ros1.topics import Topics

__all__ = ["ActionEnds"]


class ActionEnds:
    """A client's two publishers and three subscriptions.

    Args:
        core: The node.
        topics: Its topics.
        name: Absolute action name.
        types: Of the topics.
        heard: Told what comes on the topics, by their names, in the loop's thread.

    Raises:
        DefinitionConflictError: The node publishes another type on one of the topics.
    """

    def __init__(
        self,
        core: Core,
        topics: Topics,
        name: str,
        types: ActionTypes,
        heard: Mapping[str, Callable[[Sample], None]],
    ) -> None:
        self._topics = topics
        self._names = {
            word: core.resolve(part(name, word))
            for word in (GOAL, CANCEL, STATUS, RESULT, FEEDBACK)
        }
        self._publishers: dict[str, Publisher] = {}
        self._subscriptions: dict[str, Subscription] = {}
        try:
            for word in (GOAL, CANCEL):
                kind = getattr(types, word)
                self._publishers[word] = Publisher(core, self._names[word], kind, QUEUE)
        except BaseException:
            self.close()
            raise
        for word, callback in heard.items():
            subscription = Subscription(
                self._names[word], getattr(types, word), QUEUE, IMMEDIATE, raw_callback=callback
            )
            self._subscriptions[word] = subscription
            topics.subscribe(subscription, False)

    def send_goal(self, goal: dict[str, Any]) -> None:
        """Publish a goal; raises ConversionError."""
        self._publishers[GOAL].publish(goal)

    def send_cancel(self, id: str, time: Time) -> bool:
        """Ask for goals to be cancelled: one, those until a time, or all.

        Returns:
            Whether somebody is connected to hear it.
        """
        self._publishers[CANCEL].publish(goal_id(id, time))
        return self._publishers[CANCEL].subscription_count() > 0

    def tellers(self) -> dict[str, str]:
        """Return the nodes that are connected to tell the status of goals, with their URIs."""
        shared = self._topics.subscribed().get(self._names[STATUS])
        links = [] if shared is None else shared.links()
        return {link.name: link.uri for link in links if link.connected}

    def missing(self, server: str) -> list[str]:
        """Return the topics on which a node is not connected (yet)."""
        names = []
        for word in (GOAL, CANCEL):
            publication = self._topics.published().get(self._names[word])
            there = [] if publication is None else publication.connected()
            if all(end.node.full != server for end in there):
                names.append(self._names[word])
        for word in (STATUS, RESULT, FEEDBACK):
            shared = self._topics.subscribed().get(self._names[word])
            links = [] if shared is None else shared.links()
            understood = self._subscriptions[word].publisher_count() > 0
            if not understood or all(n.name != server or not n.connected for n in links):
                names.append(self._names[word])
        return names

    def troubles(self) -> list[str]:
        """Say what a person has to mend."""
        if not self.tellers():
            return []  # what the topics say is that nobody is there
        problems = [end.problem for end in self._subscriptions.values()]
        problems += [end.problem for end in self._publishers.values()]
        return list(dict.fromkeys(problem for problem in problems if problem))

    def absence(self, heard: Collection[str]) -> str:
        """Say why none of the nodes that are connected is a server yet; empty when there is none.

        Args:
            heard: Those that have told the status of their goals.
        """
        for server in self.tellers():
            missing = ", ".join(self.missing(server))
            if missing:
                return f"the server {server} is not connected on {missing} (yet)"
            if server not in heard:
                return f"the server {server} does not tell the status of its goals"
        return ""

    def close(self) -> None:
        """End them all; safe to call twice."""
        for end in (*self._publishers.values(), *self._subscriptions.values()):
            end.close()
