"""``TfBuffer`` (transforms in a namespace) and ``TfTransformListener`` (those of the robot)."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import rosglass
from rosglass.comm.names import expand
from rosglass.comm.time import Time
from rosglass.errors import ConversionError, Error, TransformException
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.js_values import time_from_js
from rosglass.qml.engine.properties import Writable
from rosglass.qml.engine.session import weak_callback
from rosglass.qml.engine.waiting import wait_for
from rosglass.qt import QJSValue, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.comm.promise import Promise
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session
    from rosglass.tf import FrameInfo, Transform, TransformBuffer, TransformListener

__all__ = [
    "RosTfBuffer",
    "RosTfTransformListener",
    "TfBuffer",
    "TfLink",
    "TfTransformListener",
    "shown_transform",
]

_log = logging.getLogger("rosglass.qml")
_USAGE = "(target, source, time, timeout) or (target, time, source, time, fixedFrame, timeout)"


def _checked_namespace(namespace: str) -> str:
    namespace = namespace.rstrip("/")
    if namespace:
        try:
            expand(namespace, "node", "/")
        except Error as error:
            raise Error(f"ns: {error}") from None
    return namespace


class TfLink:
    """Receives the transforms of one namespace while elements use them; on the GUI thread only.

    Attributes:
        buffer: The transforms.
    """

    def __init__(self, session: Session, node: Node, namespace: str) -> None:
        self._session, self._key = session, (type(self), node, namespace)
        self._users: set[Any] = set()
        self._listener: TransformListener | None = None
        self._closed = False
        self.buffer = rosglass.tf.TransformBuffer()
        self._topic, self._failure = "", ""

        def work() -> None:
            # Not on the GUI thread: the next job on this thread may be the one that closes it.
            self._listener = rosglass.tf.TransformListener(node, self.buffer, namespace)

        session.background(work, self._opened)

    @property
    def problem(self) -> str:
        """Why transforms are not received, or mixed with another robot's; empty for no problem."""
        return self._failure or self._session.mixing(self._topic)

    @classmethod
    def join(cls, session: Session, node: Node, namespace: str, user: Any) -> TfLink:
        """Return the link of a namespace; it stays open for `user`."""
        key = (cls, node, namespace)
        link = session.shared.get(key)
        if link is None:
            link = session.shared[key] = cls(session, node, namespace)
        made: TfLink = link
        made._users.add(user)
        return made

    def leave(self, user: Any) -> None:
        """Remove a user; the last one closes the link."""
        self._users.discard(user)
        if not self._users and not self._closed:
            self._closed = True
            self._session.shared.pop(self._key, None)
            self._session.background(self._shut)

    def _opened(self, result: Error | None) -> None:
        if result is not None:
            self._failure = f"transforms are not received: {result}"
            _log.warning("%s", self._failure)
        elif self._listener is not None:
            # Not the static ones: nodes of the same name may publish different ones.
            self._topic = self._listener.subscriptions[0].topic

    def _shut(self) -> None:
        if self._listener is not None:
            self._listener.close()
        self.buffer.close()


class _Watches(NamedTuple):
    """A link, and the callbacks registered with its buffer."""

    link: TfLink
    watches: list[Handle]


#: The reason of the reference plugins while there is no node.
_UNINITIALIZED = "Uninitialized"


class _Queries(Element):
    """Looks up transforms in a buffer filled by the session's node."""

    _endpoint: _Watches | None

    @property
    def buffer(self) -> TransformBuffer | None:
        """The buffer; None while there is no node."""
        if self._endpoint is None:
            # Available immediately after the first use in QML, without waiting for the event loop.
            self._run_update()
        return self._endpoint.link.buffer if self._endpoint is not None else None

    # Transforms.

    @Slot(QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, result=QJSValue)
    def canTransform(self, *given: QJSValue) -> QJSValue:
        """Return true if a transform can be looked up, otherwise the reason as text.

        Before there is a node, that is ``Uninitialized``. Arguments are those of
        :meth:`lookUpTransform`.
        """
        runtime = self._find_runtime()
        result = self._look_up("canTransform", given)
        if runtime is None or isinstance(result, str):
            return QJSValue()
        if not isinstance(result, _Missing):
            return runtime.value(True)
        return runtime.value(_UNINITIALIZED if result.exception == _UNINITIALIZED else result.why)

    @Slot(QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, result=QJSValue)
    def lookUpTransform(self, *given: QJSValue) -> QJSValue:
        """Look up the transform from a source frame to a target frame.

        Arguments are target frame, source frame, and optionally the time (by default the newest)
        and milliseconds to wait; or target frame, target time, source frame, source time, a fixed
        frame, and optionally milliseconds to wait. The interface keeps running during the wait.

        Returns:
            A ``geometry_msgs/TransformStamped`` with ``valid``; if that is false, also with
            ``exception`` and ``message``.
        """
        runtime = self._find_runtime()
        result = self._look_up("lookUpTransform", given)
        if runtime is None or isinstance(result, str):
            return QJSValue()
        if isinstance(result, _Missing):
            return shown_transform(runtime, result.frames, result.exception, result.why, self)
        return shown_transform(runtime, result, "", "", self)

    def _look_up(self, what: str, given: Sequence[QJSValue]) -> Transform | _Missing | str:
        """Return the transform, or why it is missing; an empty text if an error was thrown."""
        runtime = self._find_runtime()
        if runtime is None:
            return ""
        try:
            query = _Query(given)
        except Error as error:
            runtime.throw(f"{what}: {error}")
            return ""
        buffer = self.buffer
        if buffer is None:
            return _Missing(query.frames, _UNINITIALIZED, "there is no node yet")
        try:
            if not query.timeout:
                return query.look_up(buffer)
            promise = query.promise(buffer)
            session = runtime.session

            def begin(end: Callable[[], None]) -> None:
                promise.on_done(lambda _: end(), session.executor)

            wait_for(session, begin)
            promise.cancel()
            return promise.result(0)
        except TransformException as error:
            return _Missing(query.frames, type(error).__name__, str(error))
        except (CancelledError, Error) as error:
            return _Missing(query.frames, "TransformException", str(error) or "given up")

    # The tree.

    @Slot(str, result=str)
    def getFrameAuthority(self, frame: str) -> str:
        """Return the node that publishes a frame; empty if the frame does not exist."""
        info = self._frame(frame)
        return (
            "" if info is None else info.authority or ("unknown_publisher" if info.parent else "")
        )

    @Slot(str, result=QJSValue)
    def getFrame(self, frame: str) -> QJSValue:
        """Return the description of a frame; undefined if the frame does not exist."""
        buffer, info, runtime = self.buffer, self._frame(frame), self._find_runtime()
        if buffer is None or info is None or runtime is None:
            return QJSValue()
        return runtime.value(_described(buffer, info))

    @Slot(result=QJSValue)
    def getAllFrames(self) -> QJSValue:
        """Return the descriptions of all frames."""
        buffer, runtime = self.buffer, self._find_runtime()
        if buffer is None or runtime is None:
            return QJSValue()
        tree = buffer.tree()
        return runtime.value([_described(buffer, tree[name]) for name in sorted(tree)])

    @Slot(str, result=float)
    def getTransformAge(self, frame: str) -> float:
        """Return the time since the stamp of a frame's newest transform, static ones included.

        Returns:
            Seconds; -1 for unknown frames and for roots.
        """
        info, node = self._frame(frame), self.node
        if info is None or node is None:
            return -1.0
        age = info.age(node.now())
        return -1.0 if age is None else age.seconds

    @Slot(str, str, result="QStringList")
    def getChain(self, target: str, source: str) -> list[str]:
        """Return the frames from source to target, inclusive; empty if they are not connected."""
        buffer = self.buffer
        try:
            return [] if buffer is None else buffer.tree().chain(target, source)
        except TransformException:
            return []

    def _frame(self, name: str) -> FrameInfo | None:
        buffer = self.buffer
        return None if buffer is None else buffer.frame(name)


class _Missing:
    """A transform that is not available, with tf2's exception and its text."""

    def __init__(self, frames: Transform, exception: str, why: str) -> None:
        self.frames, self.exception, self.why = frames, exception, why


class _Query:
    """The arguments of a lookup.

    Raises:
        ConversionError: The arguments are invalid.
    """

    def __init__(self, given: Sequence[QJSValue]) -> None:
        self.full = len(given) > 4
        places = (0, 2, 4) if self.full else (0, 1)
        if not all(given[place].isString() for place in places):
            raise ConversionError("", "other arguments", _USAGE)
        self.target, self.source, *fixed = (given[place].toString() for place in places)
        self.fixed = fixed[0] if fixed else ""
        when = [
            _time(given[place]) for place in ((1, 3) if self.full else (2,)) if place < len(given)
        ]
        self.target_time = when[0] if self.full else Time()
        self.time = when[-1] if when else Time()
        last = 5 if self.full else 3
        milliseconds = given[last].toNumber() if len(given) > last else 0.0
        if not milliseconds >= 0:
            raise ConversionError("timeout", milliseconds, "milliseconds from 0 on")
        #: Seconds to wait.
        self.timeout = milliseconds / 1000
        #: The requested frames.
        self.frames = rosglass.tf.Transform(frame_id=self.target, child_frame_id=self.source)

    def look_up(self, buffer: TransformBuffer) -> Transform:
        """Return the transform, or raise one of tf2's exceptions."""
        if self.full:
            return buffer.lookup_transform_full(
                self.target, self.target_time, self.source, self.time, self.fixed
            )
        return buffer.lookup_transform(self.target, self.source, self.time)

    def promise(self, buffer: TransformBuffer) -> Promise[Transform]:
        """Return a promise of the transform within the timeout."""
        if self.full:
            return buffer.lookup_transform_full_async(
                self.target,
                self.target_time,
                self.source,
                self.time,
                self.fixed,
                timeout=self.timeout,
            )
        return buffer.lookup_transform_async(
            self.target, self.source, self.time, timeout=self.timeout
        )


def _time(value: QJSValue) -> Time:
    """Convert a time; an invalid Date, undefined and null become zero, i.e. the newest."""
    if value.isUndefined() or value.isNull():
        return Time()
    if value.isDate() and value.property("getTime").callWithInstance(value).toString() == "NaN":
        return Time()
    return time_from_js(value)


def shown_transform(
    runtime: Runtime, transform: Transform, exception: str, why: str, element: Element
) -> QJSValue:
    """Convert a transform for QML.

    Args:
        runtime: The engine's runtime.
        transform: The transform; if it is not valid, only its frames are used.
        exception: Name of tf2's exception; empty for a valid transform.
        why: Text of the exception.
        element: The element whose module determines the format.
    """
    kind: Any = rosglass.load("geometry_msgs/msg/TransformStamped", ros=2)
    value = runtime.message(kind.create(transform.to_dict(2)), element.DIALECT)
    value.setProperty("valid", runtime.value(not exception))
    if exception:
        value.setProperty("exception", QJSValue(exception))
        value.setProperty("message", QJSValue(why))
    return value


def _described(buffer: TransformBuffer, info: FrameInfo) -> dict[str, Any]:
    placed = rosglass.tf.Transform()
    if info.parent:
        with suppress(TransformException):  # not connected at a common time
            placed = buffer.lookup_transform(info.parent, info.name)
    return {
        "frameId": info.name,
        "parentId": info.parent,
        "authority": info.authority,
        "translation": dict(zip("xyz", placed.translation, strict=True)),
        "rotation": dict(zip("xyzw", placed.rotation, strict=True)),
        "isStatic": info.static,
        "children": sorted(buffer.tree().children(info.name)),
        "frequency": info.rate,
    }


class _Listening(_Queries):
    """Receives transforms as long as it exists."""

    #: Transforms were received; emitted once for several that arrive together.
    transformChanged = Signal()
    #: Frames appeared, disappeared or changed their parent.
    framesChanged = Signal()
    #: The buffer was replaced or removed.
    bufferChanged = Signal()

    @Slot()
    def clear(self) -> None:
        """Remove all transforms except static ones."""
        buffer = self.buffer
        if buffer is not None:
            buffer.clear()
            self.transformChanged.emit()

    def _namespace(self) -> str:
        return "/"

    def _wanted(self) -> tuple[Node, str] | None:
        node = self.node
        return None if node is None else (node, self._namespace())

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        session = self._session
        assert session is not None
        node, namespace = wanted
        link = TfLink.join(session, node, namespace, self)
        watches = [
            link.buffer.on_update(weak_callback(self._on_update), session.executor),
            link.buffer.on_tree_change(weak_callback(self._on_tree), session.executor),
        ]
        self._set_endpoint(_Watches(link, watches))

    def _dispose(self, session: Session, endpoint: _Watches) -> None:  # noqa: ARG002
        for watch in endpoint.watches:
            watch.close()
        endpoint.link.leave(self)

    def _on_created(self, endpoint: _Watches) -> None:  # noqa: ARG002 - the base's signature
        self.bufferChanged.emit()

    def _on_closed(self, endpoint: _Watches | None) -> None:  # noqa: ARG002 - as above
        if self.node is None:
            self.bufferChanged.emit()

    def _on_update(self) -> None:
        if is_alive(self):
            self.transformChanged.emit()

    def _on_tree(self) -> None:
        if is_alive(self):
            self.framesChanged.emit()

    @Slot()
    def _on_tick(self) -> None:
        self._set_problem(self._endpoint.link.problem if self._endpoint is not None else "")


class TfTransformListener(_Listening):
    """The singleton ``TfTransformListener``: the transforms on ``/tf`` and ``/tf_static``."""

    @Slot()
    def initialize(self) -> None:
        """Start listening; any use of the singleton in QML does this, too."""


class TfBuffer(_Listening):
    """The transforms of one namespace only. See its page in ``docs/elements``."""

    ns = Writable(str, "", _checked_namespace)

    def _namespace(self) -> str:
        return self.ns or "/"


class RosTfTransformListener(TfTransformListener):
    """The singleton ``TfTransformListener`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1


class RosTfBuffer(TfBuffer):
    """The element ``TfBuffer`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
