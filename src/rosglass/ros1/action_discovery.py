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
from rosglass.ros1.action_types import (
    FEEDBACK,
    GOAL,
    RESULT,
    ActionTypes,
    announced,
    assemble,
    part,
)
from rosglass.ros1.goal_probe import GoalProbe

if TYPE_CHECKING:
    from rosglass.messages import MessageType
    from rosglass.ros1.core import Core
    from rosglass.ros1.topics import Topics

__all__ = ["ActionDiscovery"]

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

    def __init__(self, core: Core, topics: Topics, name: str) -> None:
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
