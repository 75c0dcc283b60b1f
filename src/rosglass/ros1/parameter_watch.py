"""Following parameters: the master tells who subscribed to them.

API: ROS wiki, "ROS/Parameter Server API" (subscribeParam) and "ROS/Slave_API" (paramUpdate). What
the master tells only makes us ask: it tells neither its caller's own changes nor a namespace that
became a plain value, gives up after one attempt, and forgets everybody when it is restarted.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import Executor, Handle, Listeners
from rosglass.comm.inorder import InOrder
from rosglass.comm.promise import check_timeout
from rosglass.comm.receiving import check_may_wait
from rosglass.errors import Error
from rosglass.ros1.core import Member
from rosglass.ros1.parameter_values import from_wire, pruned, same

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master

__all__ = ["ParameterSubscription", "ParameterWatch", "ParameterWatches"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds after which the master is asked again, should a change not have reached us.
_LOOK = 10.0
#: Longest sleep in seconds of a thread that waits.
_SLICE = 0.1


class ParameterSubscription(Handle):
    """A parameter, or a namespace of them, as the master has it; made by :meth:`subscribe`.

    Attributes:
        name: Its absolute name.
    """

    def __init__(self, watches: ParameterWatches, name: str) -> None:
        self.name = name
        self._watches = watches
        self._changed = threading.Condition()
        self._known = self._closed = False
        self._value: Any = None
        self.listeners: Listeners[Any] = Listeners(where=name)

    def __repr__(self) -> str:
        shown = repr(self._value) if self.is_set else "not set" if self._known else "not known yet"
        return f"<{type(self).__name__} of {self.name}: {shown:.80}>"

    @property
    def known(self) -> bool:
        """Whether the master has told what it is."""
        return self._known

    @property
    def is_set(self) -> bool:
        """Whether it is set, as far as is known."""
        return self._known and self._value is not None

    @property
    def value(self) -> Any:
        """What it is, a dict for a namespace; None while it is not set, or not known yet.

        It stays as it is while the master is away; :meth:`Node.status` tells that.
        """
        return self._value

    def wait(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds, None for ever, until it is known; return whether it is."""
        timeout = check_timeout(timeout, self.name)
        deadline = None if timeout is None else time.monotonic() + timeout
        while not (self._known or self._closed):
            check_may_wait(self.name)
            left = _SLICE if deadline is None else deadline - time.monotonic()
            if left <= 0:
                break
            with self._changed:
                if not self._known:
                    self._changed.wait(min(left, _SLICE))
        return self._known

    def tell(self, value: Any) -> None:
        """Take a value; for the watch."""
        if self._closed:
            return
        self._value = value
        with self._changed:
            self._known = True
            self._changed.notify_all()
        self.listeners.notify(value)

    def close(self) -> None:
        """Follow it no more; safe to call twice."""
        if not self._closed:
            self._closed = True
            self.listeners.clear()
            self._watches.leave(self)


class ParameterWatches:
    """What one node follows, each name subscribed to once.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._watches: dict[str, ParameterWatch] = {}
        #: Held while the master is told that a name is followed, or not any more.
        self.telling = threading.Lock()

    def subscribe(
        self, name: str, callback: Callable[[Any], None] | None, executor: Executor | None
    ) -> ParameterSubscription:
        """Follow an absolute name; raises NodeClosedError, and ConversionError for callbacks."""
        made = ParameterSubscription(self, name)
        if callback is not None:
            made.listeners.add(callback, executor or self._core.dispatcher)
        with self._lock:
            watch = self._watches.get(name)
            new = watch is None
            if watch is None:
                watch = self._watches[name] = ParameterWatch(self._core, self, name)
            watch.join(made)
        if new:
            self._core.add(watch)
        else:
            watch.tell(made)
        return made

    def leave(self, subscription: ParameterSubscription) -> None:
        """Follow its name no more if it was the last one; for subscriptions."""
        with self._lock:
            watch = self._watches.get(subscription.name)
            last = watch is not None and watch.leave(subscription)
            if last:
                del self._watches[subscription.name]
        if watch is not None and last:
            watch.close()

    def current(self, name: str) -> ParameterWatch | None:
        """Return what follows a name, if it is followed."""
        return self._watches.get(name)

    def touched(self, name: str) -> list[ParameterWatch]:
        """Return what follows a name, what is in it, or what it is in."""
        with self._lock:
            watches = list(self._watches.values())
        return [w for w in watches if _within(name, w.name) or _within(w.name, name)]


class ParameterWatch(Member):
    """A name that the node follows: registered with the master like a subscription."""

    def __init__(self, core: Core, watches: ParameterWatches, name: str) -> None:
        self.name = name
        self._core, self._watches = core, watches
        self._turn = InOrder()
        #: Changed under the watches' lock; read by jobs of `_turn`, which own the rest.
        self._subscriptions: tuple[ParameterSubscription, ...] = ()
        self._known, self._value, self._told = False, None, 0
        self._readings = 0
        self._errand = threading.Lock()
        self._asked = self._busy = False
        self._looked = 0.0
        self._closed = False

    def __repr__(self) -> str:
        return f"the subscription to parameter {self.name}"

    def join(self, subscription: ParameterSubscription) -> None:
        """Tell a subscription from now on; under the watches' lock."""
        self._subscriptions += (subscription,)

    def leave(self, subscription: ParameterSubscription) -> bool:
        """Forget a subscription; return whether it was the last one."""
        self._subscriptions = tuple(s for s in self._subscriptions if s is not subscription)
        return not self._subscriptions

    def tell(self, subscription: ParameterSubscription) -> None:
        """Tell a subscription that has just joined what is known."""

        def job() -> None:
            if self._known and not subscription.known:
                subscription.tell(self._value)

        self._turn.add(job)

    def register(self, master: Master) -> None:
        """Subscribe, and read; again after the master's restart."""
        self.read(master)

    def unregister(self, master: Master) -> Member | None:
        """Unsubscribe, unless somebody follows the name again."""
        with self._watches.telling:
            heir = self._watches.current(self.name)
            if heir is None:
                master.call("unsubscribeParam", self._core.uri, self.name)
        return heir

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - not all that moves counts
        """Look now and then whether a change was missed."""
        if idle and time.monotonic() - self._looked > _LOOK:
            self.ask()

    def ask(self) -> None:
        """Read it soon; from any thread, without waiting."""
        with self._errand:
            self._asked = True
            if self._busy or self._closed:
                return
            self._busy = True
        self._core.errands.run(self._run)

    def read(self, master: Master) -> None:
        """Read it, and tell if it has changed.

        Raises:
            ConnectionLostError: The master does not answer.
            MasterError: It refuses.
        """
        with self._watches.telling:
            self._looked = time.monotonic()
            value = pruned(from_wire(master.call("subscribeParam", self._core.uri, self.name)))
            self._readings += 1
            number = self._readings
        value = None if value == {} else value
        self._turn.add(lambda: self._take(number, value))

    def close(self) -> None:
        """Follow it no more; safe to call twice."""
        if not self._closed:
            self._closed = True
            for subscription in self._subscriptions:
                subscription.close()
            self._core.remove(self)

    def _run(self) -> None:
        while True:
            with self._errand:
                if not self._asked or self._closed:
                    self._busy = False
                    return
                self._asked = False
            try:
                self.read(self._core.master)
            except Error:
                pass  # the core looks for a master that is gone, and registers this again
            except Exception:
                _log.exception("%s failed", self)

    def _take(self, number: int, value: Any) -> None:
        """Tell a value; one thread at a time, the newest reading only."""
        if number < self._told:
            return
        self._told = number
        changed = not self._known or not same(value, self._value)
        self._known, self._value = True, value
        for subscription in self._subscriptions:
            if changed or not subscription.known:
                subscription.tell(value)


def _within(name: str, namespace: str) -> bool:
    return name == namespace or name.startswith(namespace.rstrip("/") + "/")
