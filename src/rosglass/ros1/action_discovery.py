"""Learning the type of an action from its topics: names from the master, the rest from the server.

A server tells the definitions of its results and feedback when it is subscribed to. That of goals
nobody tells but other clients; it comes from the library, or from them.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import QoS, Subscription
from rosglass.errors import Error
from rosglass.interfaces import ros1_name
from rosglass.ros1.action_types import (
    FEEDBACK,
    GOAL,
    RESULT,
    ActionTypes,
    announced,
    assemble,
    part,
)

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
        goal = told[GOAL] or self._goal(kind)
        if goal is None:
            short = ros1_name(kind.replace("/action/", "/msg/"))
            self.problem = (
                f"no definition of {short}Goal is known, and the server of {self._name} does not "
                f"tell it: add the folder of its package with Library.add_path(), or "
                "--definitions FOLDER on the command line"
            )
            return None
        action = assemble(kind, goal, result, feedback)
        self.problem = ""
        return ActionTypes.of(action, self._core.types)

    def close(self) -> None:
        """Listen no more; safe to call twice."""
        for probe in self._probes.values():
            probe.close()

    def _told(self, word: str, kind: str) -> MessageType | None:
        """Return what the topic's publisher says its type is, if it is one of this action."""
        found = self._probes[word].type
        name = kind.replace("/action/", "/msg/") + _LABELS[word]
        return found if found is not None and found.name == name else None

    def _goal(self, kind: str) -> MessageType | None:
        with suppress(Error):
            return self._core.types.message(kind.replace("/action/", "/msg/") + "ActionGoal")
        return None
