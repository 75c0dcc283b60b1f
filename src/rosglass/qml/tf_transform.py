"""The element ``TfTransform``: where one frame is, seen from another, as it moves."""
# ruff: noqa: N815 - the names of signals are QML's

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from rosglass.errors import TransformException
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import DEFAULT_TIMEOUT, Element
from rosglass.qml.tf_buffer import TfBuffer
from rosglass.qml.tf_queries import shown_transform
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.handle import Handle
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.tf_link import TfLink
    from rosglass.tf import Transform, TransformBuffer

__all__ = ["RosTfTransform", "TfTransform"]

#: Updates a second unless another rate is asked for: one per 16 ms.
_RATE = 62.5
#: Seconds after which the reason why there is no transform is looked up again.
_AGAIN = 1.0


class TfTransform(Element):
    """Follows a transform. See its page in ``docs/elements``."""

    sourceFrameChanged = Signal()
    targetFrameChanged = Signal()
    enabledChanged = Signal()
    rateChanged = Signal()
    timeoutChanged = Signal()
    bufferChanged = Signal()
    messageChanged = Signal()
    translationChanged = Signal()
    rotationChanged = Signal()
    validChanged = Signal()
    staleChanged = Signal()
    ageChanged = Signal()
    problemChanged = Signal()

    _HOLDS = ("_shown", "_link", "_have")
    #: Whether a rate of 0 means no limit; otherwise it stops the updates.
    _ZERO_IS_UNLIMITED = False

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._source = self._target = ""
        self._enabled, self._rate, self._timeout = True, _RATE, DEFAULT_TIMEOUT
        self._own_buffer: TfBuffer | None = None
        self._link: TfLink | None = None
        self._watch: Handle | None = None
        #: What is wrong with the names of the frames; empty when they are good.
        self._bad_frames = ""
        self._have: tuple[TransformBuffer, str, str] | None = None
        self._transform: Transform | None = None
        self._exception, self._why = "Uninitialized", "nothing was looked up yet"
        self._shown: QJSValue | None = None
        self._updated = 0.0
        #: When it was seen to move; None before.
        self._arrived: float | None = None
        #: When the connection was lost; what comes all the same is live, as without ROS 1's master.
        self._lost: float | None = None
        self._valid, self._stale, self._age = False, True, -1.0
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._refresh)
        self._look_again = lambda *_: self._schedule() if is_alive(self) else None

    # Properties that QML sets.

    def _set_source(self, frame: str) -> None:
        if frame != self._source:
            self._source = frame
            self.sourceFrameChanged.emit()
            self._schedule()

    def _set_target(self, frame: str) -> None:
        if frame != self._target:
            self._target = frame
            self.targetFrameChanged.emit()
            self._schedule()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _set_rate(self, rate: float) -> None:
        if not math.isfinite(rate):
            self._refuse(f"TfTransform: rate {rate} is no number of updates per second")
        elif rate != self._rate:
            self._rate = rate
            self.rateChanged.emit()
            self._schedule()

    def _set_timeout(self, timeout: int) -> None:
        if timeout < 0:
            self._refuse(f"TfTransform: timeout {timeout} ms is negative")
        elif timeout != self._timeout:
            self._timeout = timeout
            self.timeoutChanged.emit()
            self._judge()

    def _set_buffer(self, buffer: QtCore.QObject | None) -> None:
        if buffer is not None and not isinstance(buffer, TfBuffer):
            self._refuse("TfTransform: buffer is not a TfBuffer")
            return
        if buffer is self._own_buffer:
            return
        self._own_buffer = buffer
        if buffer is not None:
            # Signals do not reach methods of objects that QML extends; they do reach functions.
            buffer.bufferChanged.connect(self._look_again)
            buffer.destroyed.connect(self._look_again)
        self.bufferChanged.emit()
        self._schedule()

    sourceFrame = Property(str, lambda self: self._source, _set_source, notify=sourceFrameChanged)
    targetFrame = Property(str, lambda self: self._target, _set_target, notify=targetFrameChanged)
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    active = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    rate = Property(float, lambda self: self._rate, _set_rate, notify=rateChanged)
    timeout = Property(int, lambda self: self._timeout, _set_timeout, notify=timeoutChanged)
    buffer = Property(
        QtCore.QObject, lambda self: self._own_buffer, _set_buffer, notify=bufferChanged
    )

    # Properties that QML reads.

    def _get_message(self) -> QJSValue:
        if self._shown is None:
            runtime = self._find_runtime()
            if runtime is None:
                return QJSValue()
            self._shown = shown_transform(runtime, self._known(), self._exception, self._why, self)
        return self._shown

    def _known(self) -> Transform:
        from rosglass.tf import Transform  # noqa: PLC0415 - brings in the transforms

        if self._transform is not None:
            return self._transform
        return Transform(frame_id=self._target, child_frame_id=self._source)

    def _part(self, name: str) -> QJSValue:
        message: QJSValue = self._get_message()
        return message.property("transform").property(name)

    message = Property(QJSValue, _get_message, notify=messageChanged)
    transform = Property(QJSValue, _get_message, notify=messageChanged)
    translation = Property(
        QJSValue, lambda self: self._part("translation"), notify=translationChanged
    )
    rotation = Property(QJSValue, lambda self: self._part("rotation"), notify=rotationChanged)
    valid = Property(bool, lambda self: self._valid, notify=validChanged)
    stale = Property(bool, lambda self: self._stale, notify=staleChanged)
    age = Property(float, lambda self: self._age, notify=ageChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    # Following.

    def _buffer_now(self) -> TransformBuffer | None:
        if self._own_buffer is not None:
            return self._own_buffer.buffer if is_alive(self._own_buffer) else None
        node, session = self.node, self._session
        if node is None or session is None or not self._wanted():
            self._let_go()
            return None
        if self._link is None:
            from rosglass.qml.tf_link import TfLink  # noqa: PLC0415 - brings in the transforms

            link = self._link = TfLink.join(session, node, "/", self)
            self._at_end["link"] = lambda: link.leave(self)
        return self._link.buffer

    def _let_go(self) -> None:
        link, self._link = self._link, None
        self._at_end.pop("link", None)
        if link is not None:
            link.leave(self)

    def _wanted(self) -> bool:
        return bool(self._enabled and self._source and self._target)

    def _update(self) -> None:
        if self._own_buffer is not None or self.node is None:
            self._let_go()
        buffer = self._buffer_now()
        want = None
        if buffer is not None and self._wanted() and (self._rate > 0 or self._ZERO_IS_UNLIMITED):
            want = (buffer, self._target, self._source)
        if want != self._have:
            self._unwatch()
            self._have, self._arrived, self._bad_frames = want, None, ""
            if want is not None and self._session is not None:
                try:
                    watch = self._watch = want[0].on_change(
                        self._target, self._source, self._on_change, self._session.executor
                    )
                    self._at_end["watch"] = watch.close
                except TransformException as error:
                    self._bad_frames = f"TfTransform: {error}"
                    self._say(self._bad_frames)
        if want is not None:
            # What the buffer has already may be of a robot that is gone: it has to move first.
            self._look(moved=False)
        elif buffer is None and self._enabled:
            self._take(None, "Uninitialized", "there is no node yet")

    def _unwatch(self) -> None:
        self._timer.stop()
        watch, self._watch = self._watch, None
        self._at_end.pop("watch", None)
        if watch is not None:
            watch.close()

    def _on_change(self) -> None:
        if not is_alive(self) or self._have is None:
            return
        if self._timer.isActive():
            return
        wait = self._updated + self._interval - time.monotonic()
        if wait > 0.0005:
            self._timer.start(math.ceil(wait * 1000))
        else:
            self._refresh()

    @property
    def _interval(self) -> float:
        """Seconds between two updates at least."""
        return 1 / self._rate if self._rate > 0 else 0.0

    @Slot()
    def _refresh(self) -> None:
        self._look(moved=True)

    def _look(self, *, moved: bool) -> None:
        """Look the transform up; `moved` says whether one of its links came just now."""
        if self._have is None:
            return
        buffer, target, source = self._have
        self._updated = time.monotonic()
        try:
            found = buffer.lookup_transform(target, source)
        except TransformException as error:
            self._take(None, type(error).__name__, str(error))
            return
        # Of a chain whose other links stand still, the newest that is known stays the same.
        if moved and (self._transform is None or found.stamp != self._transform.stamp):
            self._arrived = self._steady()
        self._take(found, "", "")

    def _take(self, found: Transform | None, exception: str, why: str) -> None:
        before, valid = self._transform, self._valid
        if (found, exception, why) == (before, self._exception, self._why):
            self._judge()
            return
        self._transform, self._exception, self._why = found, exception, why
        # Every getter answers for the new transform before the first signal is sent.
        self._shown, self._valid = None, found is not None
        self.messageChanged.emit()
        if before is None or found is None or before.translation != found.translation:
            self.translationChanged.emit()
        if before is None or found is None or before.rotation != found.rotation:
            self.rotationChanged.emit()
        if is_alive(self) and valid != self._valid:
            self.validChanged.emit()
        if is_alive(self):
            self._judge()

    # Judging.

    def _judge(self) -> None:
        """Find out whether what is shown still moves, and tell when that changed."""
        moving = self._transform is not None and self._transform.stamp.nanoseconds > 0
        arrived = self._arrived
        age = self._steady() - arrived if moving and arrived is not None else -1.0
        if age != self._age:
            self._age = age
            self.ageChanged.emit()
        connected = self._session is not None and self._session.state == "connected"
        lost = not connected and (arrived is None or self._lost is None or arrived <= self._lost)
        late = arrived is None or age > self._timeout / 1000 + self._interval
        old = moving and self._timeout > 0 and late
        stale = self._transform is None or self._have is None or lost or old
        if stale != self._stale:
            self._stale = stale
            self.staleChanged.emit()

    @Slot()
    def _on_connection(self) -> None:
        self._lost = self._steady()
        self._judge()

    @Slot()
    def _on_tick(self) -> None:
        missing = self._have is not None and self._transform is None
        if missing and not self._timer.isActive() and time.monotonic() - self._updated > _AGAIN:
            # The reason may be another one by now: frames that are not asked for tell nobody.
            self._refresh()
        own = self._own_buffer
        source = self._link if own is None or not is_alive(own) else own
        self._say(self._bad_frames or (str(source.problem) if source is not None else ""))
        self._judge()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


class RosTfTransform(TfTransform):
    """The element ``TfTransform`` of ``Ros 1.0``, where a rate of 0 means no limit."""

    DIALECT = Dialect.ROS1
    _ZERO_IS_UNLIMITED = True
