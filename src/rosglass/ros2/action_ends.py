"""What an action client listens and talks through: three service clients and two readers."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Protocol

from rosglass.comm import EndpointInfo, EndpointKind, Handle, QoS
from rosglass.comm.complaints import Complaints
from rosglass.errors import DecodeError
from rosglass.ros2.action_types import (
    CANCEL_GOAL,
    FEEDBACK,
    GET_RESULT,
    SEND_GOAL,
    STATUS,
    STATUSES,
    part,
    stamp_of,
)
from rosglass.ros2.repeats import Repeats
from rosglass.ros2.service_client import Ros2ServiceClient

if TYPE_CHECKING:
    from rosglass.comm import GoalStatus, Time
    from rosglass.messages import Message, MessageType
    from rosglass.ros2.action_types import ActionTypes
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnSample, Reader

__all__ = ["ActionEnds", "GoalNews"]

_log = logging.getLogger("rosglass.ros2")
#: What feedback and status are received with. The status topic's latched array is not asked for:
#: a client needs none from before its goals, and some servers' topic is volatile.
_QOS = QoS()
#: Where a goal's id is in feedback: behind the encapsulation header.
_ID = slice(4, 20)


class GoalNews(Protocol):
    """A goal, as far as its topics are concerned."""

    def hear(self, status: GoalStatus, accepted: Time) -> None:
        """Take what the status topic says of it."""

    def hear_feedback(self, feedback: Message) -> None:
        """Take feedback for it."""


class ActionEnds(Handle):
    """Speaks one version of an action's type.

    Args:
        core: The node.
        name: Absolute name of the action.
        types: The types to speak.
        goals: The goals to tell of feedback and status, by their ids; changed by others.
    """

    def __init__(
        self, core: Core, name: str, types: ActionTypes, goals: dict[bytes, GoalNews]
    ) -> None:
        self._core, self._name, self._goals = core, name, goals
        self._complaints = Complaints()
        self.types = types
        self.send_goal = Ros2ServiceClient(core, part(name, SEND_GOAL), types.send_goal, quiet=True)
        self.cancel_goal = Ros2ServiceClient(
            core, part(name, CANCEL_GOAL), types.cancel_goal, quiet=True
        )
        self.get_result = Ros2ServiceClient(
            core, part(name, GET_RESULT), types.get_result, patient=True, quiet=True
        )
        self.services = (self.send_goal, self.cancel_goal, self.get_result)
        self._readers = [
            self._read(FEEDBACK, types.feedback),
            self._read(STATUS, types.status),
        ]

    def flush(self) -> None:
        """Take what has arrived on the topics and waits to be taken, in the calling thread."""
        for reader in self._readers:
            reader.flush()

    def close(self) -> None:
        """Listen and talk no longer; calls that have not ended fail."""
        for end in (*self.services, *self._readers):
            end.close()

    def _read(self, topic: str, kind: MessageType) -> Reader:
        """Listen to one of the action's topics."""
        core, full = self._core, part(self._name, topic)
        endpoint = EndpointInfo(
            EndpointKind.SUBSCRIPTION, full, kind.name, core.name, _QOS, kind.rihs01
        )
        return core.middleware.create_reader(endpoint, self._taker(topic, kind))

    def _taker(self, topic: str, kind: MessageType) -> OnSample:
        """Return what takes a topic's samples from the middleware."""
        ours, repeats, feedback = kind.rihs01, Repeats(), topic == FEEDBACK

        def receive(
            data: bytes | memoryview,
            received: int,  # noqa: ARG001 - more is told than needed
            sent: int | None,
            gid: bytes,
            sequence: int,
            hash: str,
        ) -> None:
            try:
                if hash not in ("", ours):
                    told = f"another definition of {kind.name} ({hash}, ours is {ours})"
                    self._complain(topic, gid, told)
                elif not repeats.seen(gid, sequence, sent):
                    if feedback:
                        self._take_feedback(kind, data)
                    else:
                        self._take_status(kind, data)
            except DecodeError as error:
                self._complain(topic, gid, str(error))
            except Exception:
                _log.exception("%s: taking %s failed", self._name, topic)

        return receive

    def _take_feedback(self, kind: MessageType, data: bytes | memoryview) -> None:
        goal = self._goals.get(bytes(data[_ID]))
        if goal is None and len(data) >= _ID.stop:
            return  # another client's
        kind.validate(data)
        if goal is not None:
            goal.hear_feedback(kind.decode(data).feedback)

    def _take_status(self, kind: MessageType, data: bytes | memoryview) -> None:
        kind.validate(data)
        for entry in kind.decode(data).status_list:
            goal = self._goals.get(bytes(entry.goal_info.goal_id.uuid))
            status = STATUSES.get(int(entry.status))
            if goal is not None and status is not None:
                goal.hear(status, stamp_of(entry.goal_info.stamp))

    def _complain(self, topic: str, gid: bytes, reason: str) -> None:
        """Name rubbish in the log, once for each publisher."""
        if not self._complaints.fresh((topic, gid)):
            return
        publishers = self._core.graph.endpoints(EndpointKind.PUBLISHER, part(self._name, topic))
        who = [found.node.full for found in publishers if found.gid == gid] or [f"gid {gid.hex()}"]
        _log.warning("%s: ignoring %s of %s: %s", self._name, topic, who[0], reason)
