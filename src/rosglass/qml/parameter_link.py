"""The parameters of one node, for all the elements that show them."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import Dispatcher
from rosglass.comm.parameters import ParameterType
from rosglass.errors import Error, ParameterError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Handle, Node
    from rosglass.comm.parameters import ParameterClient, ParameterDescriptor, ParameterEvent
    from rosglass.qml.session import Session

__all__ = ["ParameterLink"]

_log = logging.getLogger("rosglass.qml")
#: Seconds that a node is given to answer.
_PATIENCE = 5.0


class ParameterLink:
    """Asks one node for its parameters on a thread of its own, and follows their changes.

    Made by :meth:`join`, and ended when the last listener has left; on the GUI thread only.
    """

    def __init__(self, session: Session, node: Node, name: str) -> None:
        self._session, self._node, self._name = session, node, name
        self._listeners: dict[Any, Callable[[str, Any], None]] = {}
        self._worker = Dispatcher(f"rosglass-qml parameters of {name}")
        self._client: ParameterClient | None = None
        self._watch: Handle | None = None
        self._closed = False
        #: Why the node cannot be asked; empty when it can.
        self.problem = ""
        self._worker.post(self._open)

    @classmethod
    def join(
        cls,
        session: Session,
        node: Node,
        name: str,
        listener: Any,
        changed: Callable[[str, Any], None],
    ) -> ParameterLink:
        """Return the link to a node with a listener told of every change.

        Args:
            session: The session.
            node: Its node.
            name: Full name of the other node.
            listener: Who listens; told to :meth:`leave`.
            changed: Told a parameter's name and new value, None for a deleted one, on the GUI
                thread.
        """
        key = (cls, node, name)
        link = session.shared.get(key)
        if link is None:
            link = session.shared[key] = cls(session, node, name)
        made: ParameterLink = link
        made._listeners[listener] = changed
        return made

    def leave(self, listener: Any) -> None:
        """Tell a listener no more."""
        self._listeners.pop(listener, None)
        if not self._listeners:
            self.close()

    def close(self) -> None:
        """End it; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._session.shared.pop((type(self), self._node, self._name), None)
        # A question may be on its way, which the GUI thread must not wait for.
        self._session.background(self._shut)

    @property
    def ready(self) -> bool:
        """Whether the node is there and serves its parameters."""
        client = self._client
        try:
            return client is not None and client.ready
        except Error:
            return False

    def read(
        self,
        name: str,
        done: Callable[[tuple[Any, ParameterDescriptor] | Error], None],
    ) -> None:
        """Ask for a parameter's value and description."""

        def work(client: ParameterClient) -> tuple[Any, ParameterDescriptor]:
            values = client.get([name], timeout=_PATIENCE)
            return values[name], client.describe([name], timeout=_PATIENCE)[name]

        self._ask(work, done)

    def write(self, name: str, value: Any, done: Callable[[str | Error], None]) -> None:
        """Set a parameter; `done` is told why the node refused, or an empty text."""

        def work(client: ParameterClient) -> str:
            wanted = client.describe([name], timeout=_PATIENCE)[name].type
            result = client.set({name: _as(value, wanted)}, timeout=_PATIENCE)[name]
            return "" if result.successful else result.reason or "refused without a reason"

        self._ask(work, done)

    def _ask(self, work: Callable[[ParameterClient], Any], done: Callable[[Any], None]) -> None:
        def run() -> None:
            client, result = self._client, None
            try:
                if client is None:
                    raise ParameterError(f"the parameters of {self._name}: {self.problem}")
                result = work(client)
            except Error as error:
                result = error
            except Exception as error:
                _log.exception("asking for parameters failed")
                result = Error(f"internal error: {error}")
            self._session.executor.post(lambda: None if self._closed else done(result))

        self._worker.post(run)

    def _open(self) -> None:
        try:
            self._client = self._node.create_parameter_client(self._name)
            self._watch = self._client.watch(self._changed, self._session.executor)
        except Error as error:
            self.problem = str(error)
            _log.warning("the parameters of %s: %s", self._name, error)

    def _shut(self) -> None:
        self._worker.close()
        for part in (self._watch, self._client):
            if part is not None:
                part.close()

    def _changed(self, event: ParameterEvent) -> None:
        changes = {**event.new, **event.changed, **dict.fromkeys(event.deleted)}
        for name, value in changes.items():
            for changed in list(self._listeners.values()):
                changed(name, value)


def _as(value: Any, wanted: ParameterType) -> Any:
    """Return a number of JavaScript, which has only one kind, as the type of the parameter."""
    if wanted is ParameterType.DOUBLE and type(value) is int:
        return float(value)
    if wanted is ParameterType.DOUBLE_ARRAY and isinstance(value, list):
        return [float(one) if type(one) is int else one for one in value]
    return value
