"""The parameter server of ROS 1's master: one tree of settings for all nodes.

API: ROS wiki, "ROS/Parameter Server API" and "ROS/Slave_API" (paramUpdate); names: "Names"; types:
"Parameter Server", section 3: 32-bit integers, booleans, strings, doubles, ISO 8601 dates, lists,
base64-encoded binary data, and dictionaries, which are namespaces.
"""

from __future__ import annotations

import logging
import os
import re
import threading
import time
import xmlrpc.client
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm import Executor, Handle, Listeners, Promise
from rosglass.comm.executor import InOrder
from rosglass.comm.handle import check_may_wait, guarded
from rosglass.comm.names import similar
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    ConnectionLostError,
    Error,
    InvalidNameError,
    MasterError,
    NodeClosedError,
    ParameterError,
    shown,
)
from rosglass.ros1 import rosparam_files
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from os import PathLike

    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master

__all__ = [
    "ParameterServer",
    "ParameterSubscription",
    "StartParameters",
    "flatten",
    "from_wire",
    "is_same_value",
    "to_wire",
    "without_empty_namespaces",
]

_log = logging.getLogger("rosglass.ros1")
_T = TypeVar("_T")
#: No default: None is a valid one.
_REQUIRED: Any = object()
#: How long the master may take to answer, and the shortest timeout of a call.
_TIMEOUT_S, _MIN_TIMEOUT_S = 5.0, 0.001
#: Time after which a followed parameter is read again, in case a notification was lost.
_REREAD_S = 10.0
#: Longest sleep of a thread that waits.
_WAIT_SLICE_S = 0.1
_CONTROL = re.compile("[^\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_LOWEST, _GREATEST = -(2**31), 2**31 - 1
#: XML 1.0, section 2.2; a carriage return is legal there, but is received as a line feed (2.11).
_NOT_CARRIED = re.compile("[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
#: Levels of a value, far above any written by hand; a list that contains itself has more.
_MAX_DEPTH = 50
_DATE = "%Y%m%dT%H:%M:%S"


class ParameterServer(Handle):
    """The master's parameter server; :attr:`Ros1Node.parameter_server`.

    A parameter is a bool, int (32 bits), float, str, bytes, datetime (whole seconds), a list of
    such values, or a dict, which is a namespace: ``set("/arm", {"speed": 1.5})`` sets
    ``/arm/speed``, and ``get("/arm")`` returns it and whatever else is in ``/arm``.

    Names are absolute, relative to the node's namespace, or private (``~gain``), and may be
    remapped. :meth:`names` and :meth:`get` accept any name that is on the server, even one that
    breaks ROS's rules; :meth:`set` does not.

    Every method that calls the master has `timeout`, seconds to wait for each answer, and raises
    ConnectionLostError when there is none, NodeClosedError, and InvalidNameError. Those whose names
    end in ``_async`` return a :class:`rosglass.comm.Promise` at once, for user interfaces, and for
    callbacks in threads that must not wait; the master receives their calls in order.

    Args:
        core: The node.
        start: Private parameters that the program was started with, by their names.
    """

    def __init__(self, core: TcprosCore, start: Mapping[str, Any]) -> None:
        self._core, self._start = core, start
        #: Guards the start parameters: no thread sets them after another one has changed them.
        self._beginning = threading.Lock()
        self._begun = not start
        self._calls = MasterCallQueue(core)
        self._watches = ParameterWatches(core)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._core.master.uri}>"

    # -- reading ---------------------------------------------------------------------------------

    def get(self, name: str, default: Any = _REQUIRED, *, timeout: float = _TIMEOUT_S) -> Any:
        """Return a parameter, or a namespace as a dict.

        Args:
            name: Its name.
            default: Returned when it is not set.
            timeout: Seconds to wait.

        Raises:
            ParameterError: It is not set, and there is no default; the message names similar ones.
        """
        full = self.resolve(name)
        try:
            return from_wire(self._call("getParam", full, timeout=timeout))
        except MasterError as error:
            if self._call("hasParam", full, timeout=timeout):
                raise ParameterError(f"parameter {full} cannot be read: {error}") from error
        if default is not _REQUIRED:
            return default
        raise ParameterError(
            f"parameter {full} is not set on {self._core.master.uri}{self._similar(full, timeout)}"
        )

    def has(self, name: str, *, timeout: float = _TIMEOUT_S) -> bool:
        """Return whether a parameter or namespace exists."""
        return bool(self._call("hasParam", self.resolve(name), timeout=timeout))

    def search(self, name: str, *, timeout: float = _TIMEOUT_S) -> str | None:
        """Return the closest parameter of that name, from the node's private namespace upwards.

        As in ROS, only the first part of `name` is searched: ``a/b`` is found where ``a`` is, with
        or without ``b``.

        Args:
            name: A relative name; an absolute or private one is only looked up itself.
            timeout: Seconds to wait.

        Returns:
            Its absolute name, None when there is none.
        """
        if not isinstance(name, str) or not name or name[0] in "/~":
            full = self.resolve(name)
            return full if self.has(full, timeout=timeout) else None
        self._core.expand(name)
        try:
            return str(self._call("searchParam", name, timeout=timeout))
        except MasterError:
            return None

    def names(self, namespace: str = "/", *, timeout: float = _TIMEOUT_S) -> list[str]:
        """Return the absolute names of all parameters in a namespace, sorted."""
        prefix = self.resolve(namespace).rstrip("/") + "/"
        return [name for name in self._known(timeout) if name.startswith(prefix)]

    # -- writing ---------------------------------------------------------------------------------

    def set(self, name: str, value: Any, *, timeout: float = _TIMEOUT_S) -> None:
        """Set a parameter; a dict replaces the whole namespace of that name.

        Raises:
            ParameterError: The value is not valid for a parameter; nothing is sent.
        """
        full = self.resolve(name, strict=True)
        if full == "/" and not isinstance(value, dict):
            raise ParameterError(f"parameter /: the root is a namespace, got {value!r:.60}")
        wire = to_wire(full, value)
        self._change("setParam", full, wire, timeout=timeout)

    def delete(self, name: str, *, timeout: float = _TIMEOUT_S) -> None:
        """Delete a parameter, or a namespace with its parameters.

        Raises:
            ParameterError: It is not set, or it is the root, which cannot be deleted.
        """
        full = self.resolve(name)
        if full == "/":
            raise ParameterError("parameter /: the root cannot be deleted; set it to {}")
        try:
            self._change("deleteParam", full, timeout=timeout)
        except ParameterError:
            if self._call("hasParam", full, timeout=timeout):
                raise
            hint = self._similar(full, timeout)
            raise ParameterError(f"parameter {full} is not set{hint}") from None

    # -- subscribing -----------------------------------------------------------------------------

    def subscribe(
        self,
        name: str,
        callback: Callable[[Any], None] | None = None,
        executor: Executor | None = None,
    ) -> ParameterSubscription:
        """Follow a parameter, or a namespace; returns at once, before the master has answered.

        It is read again after a restart of the master, so that the value is always the current one.

        Args:
            name: Its name; it need not be set yet.
            callback: Called with the value, None when it is not set: first when it is known, and
                after each change. Changes in quick succession may be merged.
            executor: Where `callback` runs; None for the node's own dispatcher thread.
        """
        self._check_open()
        return self._watches.subscribe(self.resolve(name), callback, executor)

    def changed(self, name: str) -> None:
        """Read a parameter that has changed; called with the master's notifications."""
        self._reread([name.rstrip("/") or "/"])

    # -- files -----------------------------------------------------------------------------------

    def load(
        self, path: str | PathLike[str], namespace: str = "", *, timeout: float = _TIMEOUT_S
    ) -> list[str]:
        """Set the parameters of a file, as ``rosparam load`` does; others are not changed.

        The node's own subscriptions are called back once, when all are set.

        Args:
            path: A YAML file, with ``_ns``, ``!degrees``, ``!radians``, ``deg()`` and ``rad()``.
            namespace: Target namespace; the node's own unless given.
            timeout: Seconds to wait for each answer.

        Returns:
            The absolute names of the parameters.

        Raises:
            ParameterError: The file cannot be read, or a value is not valid for a parameter; then
                nothing is set.
        """
        wanted: dict[str, Any] = {}
        place = self.resolve(namespace or self._core.name.namespace)
        found = rosparam_files.read(path)
        try:
            for inner, value in found:
                wanted.update(self._leaves(place, {inner: value} if inner else value))
        except (ParameterError, InvalidNameError) as error:
            raise ParameterError(f"{os.fspath(path)}: {error}") from None
        sent = []
        try:
            for full, wire in wanted.items():
                sent.append(full)
                self._send("setParam", full, wire, timeout=timeout)
        finally:
            self._reread(sent)
        return list(wanted)

    def save(
        self, path: str | PathLike[str], namespace: str = "/", *, timeout: float = _TIMEOUT_S
    ) -> None:
        """Write a namespace into a file for :meth:`load`, as ``rosparam dump`` does.

        Raises:
            ParameterError: The namespace does not exist, or the file cannot be written.
        """
        rosparam_files.write(path, self.get(namespace, timeout=timeout))

    # -- without waiting -------------------------------------------------------------------------

    def get_async(self, name: str, default: Any = _REQUIRED) -> Promise[Any]:
        """Read a parameter; see :meth:`get`."""
        self.resolve(name)
        return self.later(f"parameter {name}", lambda: self.get(name, default))

    def set_async(self, name: str, value: Any) -> Promise[None]:
        """Set a parameter; see :meth:`set`. Raises errors of the value at once."""
        to_wire(self.resolve(name, strict=True), value)
        return self.later(f"parameter {name}", lambda: self.set(name, value))

    def delete_async(self, name: str) -> Promise[None]:
        """Delete a parameter; see :meth:`delete`."""
        self.resolve(name)
        return self.later(f"parameter {name}", lambda: self.delete(name))

    def has_async(self, name: str) -> Promise[bool]:
        """Check whether a parameter is set; see :meth:`has`."""
        self.resolve(name)
        return self.later(f"parameter {name}", lambda: self.has(name))

    def search_async(self, name: str) -> Promise[str | None]:
        """Search for a parameter; see :meth:`search`."""
        return self.later(f"parameter {name}", lambda: self.search(name))

    def names_async(self, namespace: str = "/") -> Promise[list[str]]:
        """List names; see :meth:`names`."""
        self.resolve(namespace)
        return self.later(f"parameters in {namespace}", lambda: self.names(namespace))

    def later(self, what: str, job: Callable[[], _T]) -> Promise[_T]:
        """Run `job`, which waits for the master, after earlier ones; returns at once."""
        self._check_open()
        return self._calls.add(what, job)

    # -- the node's ------------------------------------------------------------------------------

    def begin(self) -> None:
        """Set the program's start parameters, in its private namespace.

        The first time they override existing ones, as in ROS; after a restart of the master, only
        missing ones are set.

        Raises:
            ConnectionLostError: The master does not answer.
        """
        with self._beginning:
            for name, value in self._start.items():
                full = self._core.resolve(f"~{name}")
                if not (self._begun and self._core.master.call("hasParam", full)):
                    self._core.master.call("setParam", full, to_wire(full, value))
            self._begun = True

    def resolve(self, name: str, *, strict: bool = False) -> str:
        """Return the absolute name of a parameter.

        Args:
            name: Absolute, relative or private.
            strict: Whether absolute names must follow ROS's rules.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        try:
            return self._core.resolve(name)
        except InvalidNameError:
            lenient = not strict and isinstance(name, str) and name.startswith("/")
            if not lenient or _CONTROL.search(name):
                raise
            return re.sub(r"/{2,}", "/", name).rstrip("/")

    def close(self) -> None:
        """Fail the pending promises; safe to call twice."""
        self._calls.close()

    def _leaves(self, place: str, value: Any) -> Iterator[tuple[str, Any]]:
        """Yield name and wire value of each parameter that a file has for `place`."""
        if not isinstance(value, dict):
            if place == "/":
                raise ParameterError("names of parameters are missing; write 'name: value'")
            yield place, to_wire(place, value)
            return
        for key, item in value.items():
            if not isinstance(key, str) or not key:
                raise ParameterError(
                    f"the name of a parameter in {place} is {key!r}; put it between quotes"
                )
            inner = key if key[0] in "/~" else f"{place.rstrip('/')}/{key}"
            yield from self._leaves(self.resolve(inner), item)

    def _known(self, timeout: float) -> list[str]:
        return sorted(str(name) for name in self._call("getParamNames", timeout=timeout))

    def _similar(self, full: str, timeout: float) -> str:
        """Return a hint at parameters and namespaces with a similar name."""
        names = self._known(timeout)
        parts = [name.split("/") for name in names]
        spaces = {"/".join(p[:end]) for p in parts for end in range(2, len(p))}
        return similar(full, [*names, *sorted(spaces)])

    def _change(self, method: str, full: str, *arguments: Any, timeout: float) -> None:
        self._send(method, full, *arguments, timeout=timeout)
        self._reread([full])

    def _send(self, method: str, full: str, *arguments: Any, timeout: float) -> None:
        try:
            self._call(method, full, *arguments, timeout=timeout)
        except MasterError as error:
            raise ParameterError(f"parameter {full}: {error}") from error

    def _reread(self, names: list[str]) -> None:
        """Read the watches of these names: the master notifies all nodes but the caller."""
        for watch in {watch for name in names for watch in self._watches.touched(name)}:
            watch.read_soon()

    def _call(self, method: str, *arguments: Any, timeout: float) -> Any:
        self._check_open()
        seconds = check_timeout(timeout, "timeout")
        check_may_wait(f"the parameter server {self._core.master.uri}")
        if not self._begun:
            self.begin()
        seconds = _TIMEOUT_S if seconds is None else max(seconds, _MIN_TIMEOUT_S)
        return self._core.master.call(method, *arguments, timeout=seconds)

    def _check_open(self) -> None:
        self._core.check_open()


class MasterCallQueue:
    """Runs calls of the master one after the other, on a thread that may wait.

    In order, so that of two values that are set the second one stays. When the master does not
    answer, all that wait fail at once, instead of one after the other. The I/O loop's thread owns
    the state.

    Args:
        core: The node.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core = core
        self._waiting: deque[tuple[Promise[Any], Callable[[], Any]]] = deque()
        self._current: Promise[Any] | None = None
        self._closed = False

    def add(self, what: str, job: Callable[[], _T]) -> Promise[_T]:
        """Run `job`, which waits for the master; return the promise of its result.

        Args:
            what: The purpose of the call, for messages.
            job: Calls the master.
        """
        made: Promise[_T] = Promise(
            f"{self._core.master.uri} has not answered ({what})",
            self._core.dispatcher,
            cancellable=True,
        )

        def add() -> None:
            self._waiting.append((made, job))
            self._advance()

        self._core.loop.call(add)
        if self._closed:
            made.set_exception(self._closed_error())
        return made

    def close(self) -> None:
        """Fail all promises; safe to call twice."""
        self._closed = True
        self._core.loop.call(self._end)

    def _end(self) -> None:
        current, self._current = self._current, None
        if current is not None:
            current.set_exception(self._closed_error())
        self._fail_waiting(self._closed_error())

    def _fail_waiting(self, error: Error) -> None:
        while self._waiting:
            self._waiting.popleft()[0].set_exception(error)

    def _advance(self) -> None:
        while self._current is None and self._waiting:
            promise, job = self._waiting.popleft()
            if self._closed:
                promise.set_exception(self._closed_error())
            elif not promise.done():  # not cancelled
                self._current = promise
                self._core.pool.run(lambda: self._run(promise, job))  # noqa: B023 - runs once

    def _run(self, promise: Promise[Any], job: Callable[[], Any]) -> None:
        failure: Exception | None = None
        try:
            promise.set_result(job())
        except Exception as error:  # noqa: BLE001 - the promise raises it
            failure = error
            promise.set_exception(error)
        self._core.loop.call(lambda: self._on_done(failure))

    def _on_done(self, failure: Exception | None) -> None:
        self._current = None
        if isinstance(failure, ConnectionLostError):
            self._fail_waiting(failure)
        self._advance()

    def _closed_error(self) -> NodeClosedError:
        return NodeClosedError(f"node {self._core.name} was closed before the master answered")


class StartParameters(Member):
    """Sets the program's start parameters once the master answers.

    Args:
        server: The node's view of the parameter server.
    """

    def __init__(self, server: ParameterServer) -> None:
        self._server = server

    def __repr__(self) -> str:
        return "the program's start parameters"

    def register(self, _: Master) -> None:
        """Set the parameters."""
        self._server.begin()

    def close(self) -> None:
        """Do nothing: the parameters stay, as other nodes may read them."""


# -- subscriptions -----------------------------------------------------------------------------


class ParameterSubscription(Handle):
    """The value of a parameter or namespace; made by :meth:`ParameterServer.subscribe`.

    Attributes:
        name: Its absolute name.
    """

    def __init__(self, watches: ParameterWatches, name: str) -> None:
        self.name = name
        self._watches = watches
        #: Wakes the threads in :meth:`wait`.
        self._known = threading.Event()
        self._closed = False
        self._value: Any = None
        self.listeners: Listeners[Any] = Listeners(where=name)

    def __repr__(self) -> str:
        value = repr(self._value) if self.is_set else "not set" if self.known else "unknown"
        return f"<{type(self).__name__} of {self.name}: {value:.80}>"

    @property
    def known(self) -> bool:
        """True once the master has answered."""
        return self._known.is_set()

    @property
    def is_set(self) -> bool:
        """True if the value is known and set."""
        return self.known and self._value is not None

    @property
    def value(self) -> Any:
        """The value, a dict for a namespace; None while it is not set or unknown.

        It is kept while the master is unreachable, which :meth:`Node.status` reports.
        """
        return self._value

    def wait(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds, None for no limit; return whether it is known."""
        timeout = check_timeout(timeout, self.name)
        deadline = None if timeout is None else time.monotonic() + timeout
        while not (self.known or self._closed):
            check_may_wait(self.name)
            left = _WAIT_SLICE_S if deadline is None else deadline - time.monotonic()
            if left <= 0:
                break
            self._known.wait(min(left, _WAIT_SLICE_S))
        return self.known

    def _on_value(self, value: Any) -> None:
        if self._closed:
            return
        self._value = value
        self._known.set()
        self.listeners.notify(value)

    def close(self) -> None:
        """Stop following it; safe to call twice."""
        if not self._closed:
            self._closed = True
            self.listeners.clear()
            self._watches.leave(self)


class ParameterWatches:
    """The parameters that one node follows, each name subscribed to once.

    A notification only triggers a read: the master leaves out a caller's own changes and a
    namespace that became a plain value, gives up after one attempt, and loses all subscribers when
    it is restarted. The I/O loop's thread owns the watches.

    Args:
        core: The node.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core = core
        self._watches: dict[str, ParameterWatch] = {}
        #: Held while the master is called to subscribe to a name, or to unsubscribe: values are
        #: numbered in the order of the calls.
        self.subscribing = threading.Lock()

    def subscribe(
        self, name: str, callback: Callable[[Any], None] | None, executor: Executor | None
    ) -> ParameterSubscription:
        """Follow an absolute name; raises ConversionError for callbacks."""
        made = ParameterSubscription(self, name)
        if callback is not None:
            made.listeners.add(callback, executor or self._core.dispatcher)
        self._core.loop.call(lambda: self._join(made))
        return made

    def _join(self, subscription: ParameterSubscription) -> None:
        watch = self._watches.get(subscription.name)
        if watch is not None:
            watch.join(subscription)
            return
        watch = self._watches[subscription.name] = ParameterWatch(
            self._core, self, subscription.name
        )
        watch.join(subscription)
        with suppress(NodeClosedError):  # then nothing changes any more
            self._core.add(watch)

    def leave(self, subscription: ParameterSubscription) -> None:
        """Remove a subscription, and its watch if it was the last one; from any thread."""
        self._core.loop.call(lambda: self._leave(subscription))

    def _leave(self, subscription: ParameterSubscription) -> None:
        watch = self._watches.get(subscription.name)
        if watch is not None and watch.leave(subscription):
            del self._watches[subscription.name]
            watch.close()

    def current(self, name: str) -> ParameterWatch | None:
        """Return the watch of a name; None if it is not followed."""
        return self._watches.get(name)

    def touched(self, name: str) -> list[ParameterWatch]:
        """Return the watches of a name, of the names in it, and of the namespaces that it is in."""
        watches = list(self._watches.values())
        return [w for w in watches if _within(name, w.name) or _within(w.name, name)]


class ParameterWatch(Member):
    """The node's subscription to one parameter or namespace."""

    lists_node = True

    def __init__(self, core: TcprosCore, watches: ParameterWatches, name: str) -> None:
        self.name = name
        self._core, self._watches = core, watches
        #: Runs what passes values on; its jobs own the values.
        self._turn = InOrder()
        #: Replaced by the loop's thread.
        self._subscriptions: tuple[ParameterSubscription, ...] = ()
        self._known, self._value, self._newest = False, None, 0
        self._readings = 0
        #: Whether a read is wanted, and whether one is in progress; of the loop's thread.
        self._wanted = self._reading = False
        self._read_at = 0.0
        self._closed = False

    def __repr__(self) -> str:
        return f"the subscription to parameter {self.name}"

    def join(self, subscription: ParameterSubscription) -> None:
        """Pass values on to a subscription from now on, first the one that is known."""
        self._subscriptions += (subscription,)

        def share() -> None:
            if self._known and not subscription.known:
                subscription._on_value(self._value)

        self._turn.add(share)

    def leave(self, subscription: ParameterSubscription) -> bool:
        """Remove a subscription; return whether it was the last one."""
        self._subscriptions = tuple(s for s in self._subscriptions if s is not subscription)
        return not self._subscriptions

    def register(self, master: Master) -> None:
        """Subscribe, and read; again after the master's restart."""
        self._read(master)

    def unregister(self, master: Master) -> None:
        """Unsubscribe."""
        with self._watches.subscribing:
            master.call("unsubscribeParam", self._core.uri, self.name)

    def successor(self) -> Member | None:
        """Return the new watch of the name, if it is followed again."""
        return self._watches.current(self.name)

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - not all that moves counts
        """Read it again now and then, in case a change was missed."""
        if idle and time.monotonic() - self._read_at > _REREAD_S:
            self.read_soon()

    def read_soon(self) -> None:
        """Read it on a thread that may wait; from any thread."""
        self._core.loop.call(self._request_read)

    def _request_read(self) -> None:
        self._wanted = True
        if not self._reading and not self._closed:
            self._reading = True
            self._core.pool.run(self._read_safely)

    def _read_safely(self) -> None:
        self._wanted = False
        # The core looks for a master that is gone, and registers this again.
        with guarded(_log, "%s failed", self), suppress(Error):
            self._read(self._core.master)
        self._core.loop.call(self._on_read)

    def _on_read(self) -> None:
        self._reading = False
        if self._wanted:
            self._request_read()

    def _read(self, master: Master) -> None:
        """Read it, and pass it on if it has changed.

        Raises:
            ConnectionLostError: The master does not answer.
            MasterError: It refuses.
        """
        with self._watches.subscribing:
            self._read_at = time.monotonic()
            value = without_empty_namespaces(
                from_wire(master.call("subscribeParam", self._core.uri, self.name))
            )
            self._readings += 1
            number = self._readings
        value = None if value == {} else value
        self._turn.add(lambda: self._on_value(number, value))

    def _on_value(self, number: int, value: Any) -> None:
        """Pass a value on, unless a newer one was read."""
        if number < self._newest:
            return
        self._newest = number
        changed = not self._known or not is_same_value(value, self._value)
        self._known, self._value = True, value
        for subscription in self._subscriptions:
            if changed or not subscription.known:
                subscription._on_value(value)

    def close(self) -> None:
        """Unsubscribe; safe to call twice."""
        if not self._closed:
            self._closed = True
            for subscription in self._subscriptions:
                subscription.close()
            self._core.remove(self)


def _within(name: str, namespace: str) -> bool:
    return name == namespace or name.startswith(namespace.rstrip("/") + "/")


# -- values ------------------------------------------------------------------------------------


def to_wire(name: str, value: object) -> Any:
    """Convert a value to one that XML-RPC carries; returns a copy.

    Numpy's scalars and arrays, tuples, bytearrays and the like become plain values and lists.

    Args:
        name: The parameter's name, for messages.
        value: A bool, int, float, str, bytes, datetime, or a list or dict of these.

    Raises:
        ParameterError: It is not valid for a parameter; the message gives reason and fix.
    """
    return _to_wire(name, value, 0)


def from_wire(value: Any) -> Any:
    """Convert a value of the parameter server to plain Python values."""
    if isinstance(value, dict):
        return {str(key): from_wire(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [from_wire(item) for item in value]
    if isinstance(value, xmlrpc.client.Binary):
        return bytes(value.data)
    if isinstance(value, xmlrpc.client.DateTime):
        try:
            return datetime.strptime(str(value), _DATE)
        except ValueError:
            return str(value)
    return value


def flatten(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield name and value of each parameter in a namespace, names joined with ``/``."""
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flatten(value, f"{name}/")
        else:
            yield name, value


def without_empty_namespaces(value: Any) -> Any:
    """Return a value without empty namespaces, which the master returns for unset ones."""
    if not isinstance(value, dict):
        return value
    kept = ((key, without_empty_namespaces(item)) for key, item in value.items())
    return {key: item for key, item in kept if item != {}}


def is_same_value(one: Any, other: Any) -> bool:
    """Return whether two values are equal and of the same types, unlike 1, 1.0 and True."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(
            is_same_value(one[key], other[key]) for key in one
        )
    if isinstance(one, list):
        return len(one) == len(other) and all(map(is_same_value, one, other))
    return bool(one == other) or (one != one and other != other)  # noqa: PLR0124 - not a number


def _to_wire(name: str, value: object, depth: int) -> Any:
    if depth > _MAX_DEPTH:
        raise ParameterError(f"parameter {name}: nested more than {_MAX_DEPTH} levels deep")
    if not isinstance(value, (bool, int, float, str, bytes, bytearray, memoryview, list, tuple)):
        plain = getattr(value, "tolist", None)
        value = value if plain is None else plain()
    if isinstance(value, bool):
        return bool(value)
    if isinstance(value, int):
        if not _LOWEST <= value <= _GREATEST:
            raise ParameterError(
                f"parameter {name}: {value} is beyond the 32 bits of an integer on a ROS 1 "
                f"parameter server ({_LOWEST} to {_GREATEST}); set it as a float "
                f"({float(value)!r}) or as a string"
                if abs(value) < 1e300
                else f"parameter {name}: an integer has 32 bits on a ROS 1 parameter server"
            )
        return int(value)
    if isinstance(value, float):
        return float(value)
    if isinstance(value, str):
        return _text(f"parameter {name}", value)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return xmlrpc.client.Binary(bytes(value))
    if isinstance(value, datetime):
        return _date(name, value)
    if isinstance(value, (list, tuple)):
        return [_to_wire(f"{name}[{i}]", item, depth + 1) for i, item in enumerate(value)]
    if isinstance(value, Mapping):
        return {
            _key(name, key): _to_wire(f"{name.rstrip('/')}/{key}", item, depth + 1)
            for key, item in value.items()
        }
    advice = "; to unset it, delete it" if value is None else ""
    raise ParameterError(
        f"parameter {name}: a ROS 1 parameter is a bool, int, float, str, bytes, datetime, or a "
        f"list or dict of these, got {shown(value)}{advice}"
    )


def _text(what: str, text: str) -> str:
    found = _NOT_CARRIED.search(text)
    if found is None:
        return str(text)
    if found.group() == "\r":
        problem = "a carriage return, which XML turns into a line feed; replace '\\r\\n' by '\\n'"
    else:
        problem = f"{found.group()!r}, which XML cannot carry; set bytes instead, or remove it"
    raise ParameterError(f"{what}: at position {found.start()} there is {problem}")


def _key(name: str, key: object) -> str:
    if not isinstance(key, str):
        raise ParameterError(
            f"parameter {name}: the keys of a dict are names of parameters, got {shown(key)}; "
            f"write {str(key)!r} for it"
        )
    if not key or "/" in key:
        parts = "{'a': {'b': 1}} instead of {'a/b': 1}"
        problem = f"{key!r} has a '/'; write {parts}" if key else "there is an empty one"
        raise ParameterError(f"parameter {name}: the keys of a dict are names: {problem}")
    return _text(f"parameter {name}: key {key!r}", key)


def _date(name: str, value: datetime) -> datetime:
    if value.tzinfo is not None or value.microsecond:
        raise ParameterError(
            f"parameter {name}: dates on a ROS 1 parameter server have whole seconds and no time "
            f"zone, got {value.isoformat()}; set it as a string, or as seconds"
        )
    return value
