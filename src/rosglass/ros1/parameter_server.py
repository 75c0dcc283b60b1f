"""The parameter server, which is a part of the master: one tree of settings for all nodes.

API: ROS wiki, "ROS/Parameter Server API"; names: "Names".
"""

from __future__ import annotations

import os
import re
import threading
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm import Handle
from rosglass.comm.promise import check_timeout
from rosglass.comm.receiving import check_may_wait
from rosglass.comm.similar import similar
from rosglass.errors import (
    InvalidNameError,
    MasterError,
    ParameterError,
)
from rosglass.ros1.core import Member
from rosglass.ros1.parameter_values import from_wire, to_wire
from rosglass.ros1.parameter_watch import ParameterSubscription, ParameterWatches
from rosglass.ros1.questions import Questions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from os import PathLike

    from rosglass.comm import Executor, Promise
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master

__all__ = ["ParameterServer", "StartParameters"]

_T = TypeVar("_T")
#: Tells "no default" from the default None.
_REQUIRED: Any = object()
#: Seconds that the master may take to answer, unless told otherwise.
_TIMEOUT = 5.0
#: The shortest: none at all would be no question.
_LEAST = 0.001
_CONTROL = re.compile("[^\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class ParameterServer(Handle):
    """The master's parameter server; :attr:`Ros1Node.parameter_server`.

    A parameter is a bool, int (32 bits), float, str, bytes, datetime (whole seconds), a list of
    such values, or a dict, which is a namespace: ``set("/arm", {"speed": 1.5})`` sets
    ``/arm/speed``, and ``get("/arm")`` returns it and whatever else is in ``/arm``.

    Names are absolute, relative to the node's namespace, or private (``~gain``), and may be
    remapped. Whatever is on the server, :meth:`names` and :meth:`get` take, even names against
    ROS's rules; what is set keeps to them.

    Every method that asks the master takes `timeout`, seconds to wait for each of its answers, and
    raises ConnectionLostError when there is none, NodeClosedError, and InvalidNameError. Those
    whose names end in ``_async`` return a :class:`rosglass.comm.Promise` at once, for user
    interfaces, and for callbacks in threads that must not wait; the master gets them in order.

    Args:
        core: The node.
        start: Private parameters that the program was started with, by their names.
    """

    def __init__(self, core: Core, start: Mapping[str, Any]) -> None:
        self._core, self._start = core, start
        self._beginning = threading.Lock()
        self._begun = not start
        self._questions = Questions(core)
        self._watches = ParameterWatches(core)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._core.master.uri}>"

    # -- reading ---------------------------------------------------------------------------------

    def get(self, name: str, default: Any = _REQUIRED, *, timeout: float = _TIMEOUT) -> Any:
        """Return a parameter, or a namespace as a dict.

        Args:
            name: Its name.
            default: Returned when it is not set.
            timeout: Seconds to wait.

        Raises:
            ParameterError: It is not set, and there is no default; similar names are told.
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

    def has(self, name: str, *, timeout: float = _TIMEOUT) -> bool:
        """Return whether a parameter or namespace is there."""
        return bool(self._call("hasParam", self.resolve(name), timeout=timeout))

    def search(self, name: str, *, timeout: float = _TIMEOUT) -> str | None:
        """Return the closest parameter of that name, from the node's private namespace upwards.

        As in ROS, only the first part of `name` is looked for: what is found of ``a/b`` is where
        ``a`` is, with or without ``b``.

        Args:
            name: A relative name; an absolute or private one is only looked for where it says.
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

    def names(self, namespace: str = "/", *, timeout: float = _TIMEOUT) -> list[str]:
        """Return the absolute names of all parameters in a namespace, sorted."""
        prefix = self.resolve(namespace).rstrip("/") + "/"
        return [name for name in self._known(timeout) if name.startswith(prefix)]

    # -- writing ---------------------------------------------------------------------------------

    def set(self, name: str, value: Any, *, timeout: float = _TIMEOUT) -> None:
        """Set a parameter; a dict replaces the whole namespace of that name.

        Raises:
            ParameterError: The value can be no parameter's; nothing is sent.
        """
        full = self.resolve(name, strict=True)
        if full == "/" and not isinstance(value, dict):
            raise ParameterError(f"parameter /: the root is a namespace, got {value!r:.60}")
        wire = to_wire(full, value)
        self._change("setParam", full, wire, timeout=timeout)

    def delete(self, name: str, *, timeout: float = _TIMEOUT) -> None:
        """Delete a parameter, or a namespace with all that is in it.

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

    # -- following -------------------------------------------------------------------------------

    def subscribe(
        self,
        name: str,
        callback: Callable[[Any], None] | None = None,
        executor: Executor | None = None,
    ) -> ParameterSubscription:
        """Follow a parameter, or a namespace; returns at once, and is told when the master answers.

        The master is asked again after it was restarted, so that the value is always what it has.

        Args:
            name: Its name; it need not be set yet.
            callback: Called with the value, None when it is not set: once when it is known first,
                and after each change. Changes in quick succession may be merged.
            executor: Where `callback` runs; None for the node's own dispatcher thread.
        """
        self._check_open()
        return self._watches.subscribe(self.resolve(name), callback, executor)

    def changed(self, name: str) -> None:
        """Look at a name that the master says has changed; for the node."""
        for watch in self._watches.touched(name.rstrip("/") or "/"):
            watch.ask()

    # -- files -----------------------------------------------------------------------------------

    def load(
        self, path: str | PathLike[str], namespace: str = "", *, timeout: float = _TIMEOUT
    ) -> list[str]:
        """Set what a file has, as ``rosparam load`` does; what else is there stays.

        The node's own subscriptions are told once, when all is set.

        Args:
            path: A YAML file; ``_ns``, ``!degrees``, ``!radians``, ``deg()``, ``rad()`` count.
            namespace: Where to; the node's namespace unless given.
            timeout: Seconds to wait for each answer.

        Returns:
            The absolute names of what was set.

        Raises:
            ParameterError: The file cannot be read, or a value can be no parameter's; nothing is
                set then.
        """
        from rosglass.ros1 import parameter_files  # noqa: PLC0415 - yaml

        wanted: dict[str, Any] = {}
        place = self.resolve(namespace or self._core.name.namespace)
        found = parameter_files.read(path)
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
            self._look_again(sent)
        return list(wanted)

    def save(
        self, path: str | PathLike[str], namespace: str = "/", *, timeout: float = _TIMEOUT
    ) -> None:
        """Write a namespace into a file that can be loaded, as ``rosparam dump`` does.

        Raises:
            ParameterError: It is not there, or the file cannot be written.
        """
        from rosglass.ros1 import parameter_files  # noqa: PLC0415 - yaml

        parameter_files.write(path, self.get(namespace, timeout=timeout))

    # -- without waiting -------------------------------------------------------------------------

    def get_async(self, name: str, default: Any = _REQUIRED) -> Promise[Any]:
        """Ask for a parameter; see :meth:`get`."""
        self.resolve(name)
        return self.later(f"parameter {name}", lambda: self.get(name, default))

    def set_async(self, name: str, value: Any) -> Promise[None]:
        """Set a parameter; see :meth:`set`. What is wrong with the value is raised at once."""
        to_wire(self.resolve(name, strict=True), value)
        return self.later(f"parameter {name}", lambda: self.set(name, value))

    def delete_async(self, name: str) -> Promise[None]:
        """Delete a parameter; see :meth:`delete`."""
        self.resolve(name)
        return self.later(f"parameter {name}", lambda: self.delete(name))

    def has_async(self, name: str) -> Promise[bool]:
        """Ask whether a parameter is there; see :meth:`has`."""
        self.resolve(name)
        return self.later(f"parameter {name}", lambda: self.has(name))

    def search_async(self, name: str) -> Promise[str | None]:
        """Search a parameter; see :meth:`search`."""
        return self.later(f"parameter {name}", lambda: self.search(name))

    def names_async(self, namespace: str = "/") -> Promise[list[str]]:
        """Ask for names; see :meth:`names`."""
        self.resolve(namespace)
        return self.later(f"parameters in {namespace}", lambda: self.names(namespace))

    def later(self, what: str, job: Callable[[], _T]) -> Promise[_T]:
        """Run `job`, which waits for the master, after what was asked before; return at once."""
        self._check_open()
        return self._questions.ask(what, job)

    # -- the node's ------------------------------------------------------------------------------

    def begin(self) -> None:
        """Set the parameters that the program was started with, in its private namespace.

        The first time they win over what is set, as in ROS; once the master was restarted, they
        are set again where they are missing.

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
            strict: Whether absolute names must keep to ROS's rules.

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
        """Give up what was asked without waiting; safe to call twice."""
        self._questions.close()

    def _leaves(self, place: str, value: Any) -> Iterator[tuple[str, Any]]:
        """Yield name and wire value of each single parameter that a file has for `place`."""
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
        """Return a hint at a parameter or namespace that may be meant."""
        names = self._known(timeout)
        parts = [name.split("/") for name in names]
        spaces = {"/".join(p[:end]) for p in parts for end in range(2, len(p))}
        return similar(full, [*names, *sorted(spaces)])

    def _change(self, method: str, full: str, *arguments: Any, timeout: float) -> None:
        self._send(method, full, *arguments, timeout=timeout)
        self._look_again([full])

    def _send(self, method: str, full: str, *arguments: Any, timeout: float) -> None:
        try:
            self._call(method, full, *arguments, timeout=timeout)
        except MasterError as error:
            raise ParameterError(f"parameter {full}: {error}") from error

    def _look_again(self, names: list[str]) -> None:
        """Read what is followed of these: the master tells everybody but who made the change."""
        for watch in {watch for name in names for watch in self._watches.touched(name)}:
            watch.ask()

    def _call(self, method: str, *arguments: Any, timeout: float) -> Any:
        self._check_open()
        seconds = check_timeout(timeout, "timeout")
        check_may_wait(f"the parameter server {self._core.master.uri}")
        if not self._begun:
            self.begin()
        seconds = _TIMEOUT if seconds is None else max(seconds, _LEAST)
        return self._core.master.call(method, *arguments, timeout=seconds)

    def _check_open(self) -> None:
        self._core.check_open()


class StartParameters(Member):
    """Lets the master know the parameters that a program was started with, when it is there.

    Args:
        server: The node's view of the parameter server.
    """

    def __init__(self, server: ParameterServer) -> None:
        self._server = server

    def __repr__(self) -> str:
        return "the parameters that the program was started with"

    def register(self, _: Master) -> None:
        """Set them."""
        self._server.begin()

    def close(self) -> None:
        """Leave them as they are: other nodes may read them."""
