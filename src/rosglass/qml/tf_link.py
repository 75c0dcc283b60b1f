"""The transforms of one namespace, for all the elements that look at them."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.tf import TransformBuffer

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.errors import Error
    from rosglass.qml.session import Session
    from rosglass.tf import TransformListener

__all__ = ["TfLink"]

_log = logging.getLogger("rosglass.qml")


class TfLink:
    """A buffer that is filled while anybody looks at it; on the GUI thread only.

    Attributes:
        buffer: The transforms.
    """

    def __init__(self, session: Session, node: Node, namespace: str) -> None:
        self._session, self._key = session, (type(self), node, namespace)
        self._users: set[Any] = set()
        self._listener: TransformListener | None = None
        self._closed = False
        self.buffer = TransformBuffer()
        self._topic, self._failure = "", ""

        def work() -> None:
            from rosglass.tf import TransformListener  # noqa: PLC0415 - loaded with the buffer

            # Here and not on the GUI thread: who shuts it may be next on this one.
            self._listener = TransformListener(node, self.buffer, namespace)

        session.background(work, self._opened)

    @property
    def problem(self) -> str:
        """Why they are not received, or mixed with another robot's; empty when all is well."""
        return self._failure or self._session.mixing(self._topic)

    @classmethod
    def join(cls, session: Session, node: Node, namespace: str, user: Any) -> TfLink:
        """Return the link of a namespace, with `user` among those that keep it open."""
        key = (cls, node, namespace)
        link = session.shared.get(key)
        if link is None:
            link = session.shared[key] = cls(session, node, namespace)
        made: TfLink = link
        made._users.add(user)
        return made

    def leave(self, user: Any) -> None:
        """Let go of it; the last one who does ends it."""
        self._users.discard(user)
        if not self._users and not self._closed:
            self._closed = True
            self._session.shared.pop(self._key, None)
            self._session.background(self._shut)

    def _opened(self, result: Error | None) -> None:
        if result is not None:
            self._failure = str(result)
            _log.warning("transforms are not received: %s", result)
        elif self._listener is not None:
            # Not the static ones: nodes of one name may well send each its own.
            self._topic = self._listener.subscriptions[0].topic

    def _shut(self) -> None:
        if self._listener is not None:
            self._listener.close()
        self.buffer.close()
