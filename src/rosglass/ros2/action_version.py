"""Which type an action has, in the version that its server announces, part by part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm import EndpointKind
from rosglass.errors import Error
from rosglass.ros2.action_types import (
    FEEDBACK,
    GET_RESULT,
    SEND_GOAL,
    ActionTypes,
    assemble,
    part,
)
from rosglass.ros2.announced import Announced, choose, mismatches, missing, rivals

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.messages import ActionType, MessageType, ServiceType
    from rosglass.ros2.core import Core

__all__ = ["ActionVersion"]


class ActionVersion:
    """Follows the type of one action.

    Two versions of an action often differ in one part only, and each part has a hash of its own:
    the goal's shows at the service ``send_goal``, the result's at ``get_result``, the feedback's
    at the topic.

    Args:
        core: The node.
        name: Absolute name of the action.
        wanted: The type, or its name: then the announced version of it is taken; None takes
            whatever type is announced.

    Attributes:
        types: The types in use; None while nobody has told them.

    Raises:
        TypeNotFoundError: No definition of the given type is known.
    """

    def __init__(self, core: Core, name: str, wanted: ActionType | str | None) -> None:
        self._core, self._name = core, name
        self._discovers = wanted is None
        self._fixed = wanted is not None and not isinstance(wanted, str)
        self.types: ActionTypes | None = None
        self._choice = self._missing = self._failure = ""
        self._fetching = False
        self._send_goal: Announced[ServiceType]
        self._get_result: Announced[ServiceType]
        self._feedback: Announced[MessageType]
        if wanted is not None:
            self._begin(core.types.action(wanted))

    def follow(self, *, retry: bool) -> bool:
        """Take the type that the server announces, and its version of it.

        Args:
            retry: Whether to look again for definitions that were not found before.

        Returns:
            Whether it is another one now.
        """
        before = self.types
        try:
            if self._discovers:
                self._discover()
            if self.types is not None:
                self._adopt(self.types.action, retry)
            self._failure = ""
        except Error as error:
            self._failure = str(error)
        return self.types is not before

    @property
    def pending(self) -> bool:
        """Whether a definition is being fetched from the robot."""
        types = self.types
        return self._fetching or (
            types is not None and any(version.pending for version, _ in self._parts())
        )

    def conflicts(self) -> list[str]:
        """Say what a person has to mend."""
        types = self.types
        problems = [self._choice, self._missing, self._failure]
        if types is not None:
            problems += [version.failure for version, _ in self._parts()]
        problems = [text for text in problems if text]
        if not problems and types is not None:
            for version, name in self._parts():
                effect = "its feedback is lost" if name == FEEDBACK else "it gets no goals"
                problems += mismatches(version, self._peers(name), "offers", effect)
            servers = [peer for peer in self._peers(SEND_GOAL) if self._send_goal.fits(peer)]
            problems += rivals(servers, self._name)
        return problems

    def _discover(self) -> None:
        servers = self._peers(SEND_GOAL)
        names = [s.type.removesuffix("_SendGoal") for s in servers if s.type.endswith("_SendGoal")]
        current = "" if self.types is None else self.types.action.name
        example = f"create_action_client({self._name!r}, {{}})"
        name, self._choice = choose(names, current, example)
        if not name or name == current:
            self._missing, self._fetching = "", False
            return
        try:
            found = self._core.types.action(name)
        except Error as error:
            self._missing, self._fetching = missing(self._core, name, "", servers, error)
        else:
            self._missing, self._fetching = "", False
            self._begin(found)

    def _begin(self, action: ActionType) -> None:
        core, find, fixed = self._core, self._core.types, self._fixed
        types = ActionTypes.of(action, find)
        self._send_goal = Announced(core, find.service, types.send_goal, fixed)
        self._get_result = Announced(core, find.service, types.get_result, fixed)
        self._feedback = Announced(core, find.message, types.feedback, fixed)
        self.types = types

    def _adopt(self, action: ActionType, retry: bool) -> None:
        changed = [
            self._send_goal.follow(f"{action.name}_SendGoal", self._peers(SEND_GOAL), retry),
            self._get_result.follow(f"{action.name}_GetResult", self._peers(GET_RESULT), retry),
            self._feedback.follow(f"{action.name}_FeedbackMessage", self._peers(FEEDBACK), retry),
        ]
        if not any(changed):
            return
        goal, result, feedback = self._send_goal.type, self._get_result.type, self._feedback.type
        assert goal is not None  # each began with a type
        assert result is not None
        assert feedback is not None
        self.types = ActionTypes.of(assemble(action, goal, result, feedback), self._core.types)

    def _parts(self) -> list[tuple[Announced[Any], str]]:
        return [
            (self._send_goal, SEND_GOAL),
            (self._get_result, GET_RESULT),
            (self._feedback, FEEDBACK),
        ]

    def _peers(self, name: str) -> list[EndpointInfo]:
        kind = EndpointKind.PUBLISHER if name == FEEDBACK else EndpointKind.SERVICE_SERVER
        return self._core.graph.endpoints(kind, part(self._name, name))
