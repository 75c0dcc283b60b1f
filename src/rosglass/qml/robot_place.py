"""Which recording an interface shows in the robot's place, of all that want one shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from rosglass.qml.session import Session

__all__ = ["RobotPlace"]


class RobotPlace:
    """The address of a session, taken by recordings in turn; on the GUI thread only."""

    def __init__(self, session: Session) -> None:
        self._session = session
        #: Who wants which recording; the last one is shown.
        self._wanted: dict[Any, str] = {}
        #: Address before the first recording, and the one that was put in its place.
        self._before, self._ours = "", ""

    @classmethod
    def of(cls, session: Session) -> RobotPlace:
        """Return the one of a session."""
        place: RobotPlace = session.shared.setdefault(cls, cls(session))
        return place

    def take(self, user: Any, file: str) -> str:
        """Show a recording; returns why it is not shown, empty when it is."""
        if not self._session.owns_node:
            return "the program brought its own node, which stays"
        if self._wanted.get(user) != file:
            self._wanted.pop(user, None)
            self._wanted[user] = file
        shown = self._settle()
        return "" if shown == file else f"another Replay shows {shown} meanwhile"

    def leave(self, user: Any) -> None:
        """Show it no longer; what was shown before comes back."""
        if self._wanted.pop(user, None) is not None:
            self._settle()

    def leave_soon(self, user: Any) -> None:
        """Do so unless the program ends."""

        def leave() -> None:
            if is_alive(self._session):
                self.leave(user)

        QtCore.QTimer.singleShot(0, leave)

    def _settle(self) -> str:
        """Have the session connect to what is wanted; returns the recording that is."""
        session = self._session
        if not self._wanted:
            if session.url == self._ours:
                session.url = self._before
            self._ours = ""
            return ""
        from rosglass.bags.replay_node import replay_url  # noqa: PLC0415 - few ever need it

        file = [*self._wanted.values()][-1]
        if session.url != self._ours or not self._ours:
            self._before = session.url
        self._ours = url = replay_url(file)
        session.url = url
        return file
