"""Learning the type of an action from its topics: names from the master, the rest from the server.

A server tells the definitions of its results and feedback when it is subscribed to. That of goals
comes from the library, from other clients, or from servers that tell it (those in Python).
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import QoS, Subscription
from rosglass.errors import Error
from rosglass.interfaces import adding_definitions, ros1_name
from rosglass.ros1.actionlib_types import (
    FEEDBACK,
    GOAL,
    RESULT,
    ActionTypes,
    announced,
    assemble,
    part,
)
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from rosglass.messages import MessageType
    from rosglass.wires.tcpros.connection import Connection
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master
    from rosglass.wires.tcpros.topics import Topics

__all__ = ["ActionDiscovery"]

#: Subscribers that are kept waiting for an answer at most.
_MOST = 100
_LABELS = {GOAL: "ActionGoal", RESULT: "ActionResult", FEEDBACK: "ActionFeedback"}


class ActionDiscovery:
    """Listens to an action's topics until they have told its type.

    Args:
        core: The node.
        topics: Its topics.
        name: Absolute action name.

    Attributes:
        problem: What a person has to mend, in words; empty while something may come yet.
    """

    def __init__(self, core: TcprosCore, topics: Topics, name: str) -> None:
        self._core, self._name = core, name
        self.problem = ""
        self._topics = topics
        self._goal_probe: GoalProbe | None = None
        self._probes: dict[str, Subscription] = {}
        for word in _LABELS:
            topic = core.resolve(part(name, word))
            self._probes[word] = Subscription(topic, None, QoS(depth=1), core.dispatcher)
            topics.subscribe(self._probes[word], True)

    def look(self) -> ActionTypes | None:
        """Return the types of the action, None while they are not known."""
        kind = announced(self._core.graph, self._name)
        if not kind:
            self.problem = ""
            return None
        told = {word: self._told(word, kind) for word in _LABELS}
        result, feedback = told[RESULT], told[FEEDBACK]
        if result is None or feedback is None:
            self.problem = ""
            return None
        with suppress(Error):
            known = ActionTypes.of(self._core.types.action(kind), self._core.types)
            if (known.result.md5, known.feedback.md5) == (result.md5, feedback.md5):
                return known
        goal = told[GOAL] or self._goal(kind.replace("/action/", "/msg/") + "ActionGoal")
        if goal is None:
            short = ros1_name(kind.replace("/action/", "/msg/"))
            self.problem = (
                f"no definition of {short}Goal is known, and the server of {self._name} does not "
                f"tell it: {adding_definitions(kind, 1)}"
            )
            return None
        action = assemble(kind, goal, result, feedback)
        self.problem = ""
        return ActionTypes.of(action, self._core.types)

    def close(self) -> None:
        """Listen no more; safe to call twice."""
        for probe in self._probes.values():
            probe.close()
        if self._goal_probe is not None:
            self._goal_probe.close()

    def _told(self, word: str, kind: str) -> MessageType | None:
        """Return what the topic's publisher says its type is, if it is one of this action."""
        found = self._probes[word].type
        name = kind.replace("/action/", "/msg/") + _LABELS[word]
        return found if found is not None and found.name == name else None

    def _goal(self, name: str) -> MessageType | None:
        """Return the type of goals: from the library, or as the server tells it."""
        with suppress(Error):
            return self._core.types.message(name)
        if self._goal_probe is None:
            topic = self._core.resolve(part(self._name, GOAL))
            self._goal_probe = GoalProbe(self._core, self._topics, topic, name)
        return self._goal_probe.look()


class GoalProbe(Member):
    """Stands in for a publisher of goals until their type is known.

    Servers in Python send the definition when they connect to a publisher, and they connect to
    each one that the master knows. Servers in C++ send the md5 sum only.

    A subscriber that connects waits meanwhile, and gets its answer from the next publisher.

    Args:
        core: The node.
        topics: Its topics.
        topic: The topic of the goals.
        name: Full name of their type.
    """

    def __init__(self, core: TcprosCore, topics: Topics, topic: str, name: str) -> None:
        self._core, self._topics, self._topic, self._name = core, topics, topic, name
        #: Replaced, never changed, and in the loop's thread only.
        self._waiting: list[tuple[Connection, dict[str, str]]] = []
        self._closed = False
        topics.stand_in(topic, self._accept)
        core.add(self)

    def look(self) -> MessageType | None:
        """Return the type, None while it is not known."""
        for _, header in self._waiting:
            text = header.get("message_definition", "")
            if header.get("type") == ros1_name(self._name) and text.strip():
                with suppress(Error):
                    return self._core.types.learn(self._name, header.get("md5sum", ""), text)
        return None

    def _accept(self, link: Connection, header: dict[str, str]) -> str:
        waiting = [each for each in self._waiting[-_MOST:] if not each[0].closed]
        self._waiting = [*waiting, (link, header)]
        self._core.wake()
        return ""

    def register(self, master: Master) -> None:
        """Tell the master."""
        if self._topic not in self._topics.published():
            name = ros1_name(self._name)
            master.call("registerPublisher", self._topic, name, self._core.uri)

    def unregister(self, master: Master) -> Member | None:
        """Tell the master that goals are not published here, unless they are by now."""
        heir = self._topics.published().get(self._topic)
        if self._core.closed or heir is None:
            master.call("unregisterPublisher", self._topic, self._core.uri)
            return None
        return heir

    def close(self) -> None:
        """Hand over the subscribers that wait; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._topics.stand_in(self._topic, None)
        self._core.loop.call(self._hand_over)
        self._core.remove(self)

    def _hand_over(self) -> None:
        waiting, self._waiting = self._waiting, []
        for link, header in waiting:
            reason = "" if link.closed else self._topics.accept(link, header)
            if reason:
                link.send_header({"error": reason})
                link.finish(1.0)
