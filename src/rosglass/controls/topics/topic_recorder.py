"""The element ``TopicRecorder``: records topics to a file, off the GUI thread."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
import os
import shutil
import threading
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.errors import BagError, Error
from rosglass.qml.elements.element import Element
from rosglass.qml.elements.singleton import strings
from rosglass.qml.engine.log import plain_path
from rosglass.qml.engine.properties import ReadOnly, Writable, one_of, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bags import Recorder
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session

__all__ = ["TopicRecorder"]

#: Ticks (a tenth of a second) between two looks at the progress, and at the disk.
_PROGRESS_TICKS, _DISK_TICKS = 3, 30
_MAX_TOPICS = 10_000
#: Seconds that the end of the program, or of a connection, waits for a file to be completed.


def _limit(value: float) -> float:
    if not 0 <= value < math.inf:
        raise ValueError("is not a limit; give 0 for none")
    return value


def _names(value: QJSValue) -> tuple[str, ...]:
    if value.isUndefined() or value.isNull():
        return ()
    if not (value.isObject() and value.property("length").toNumber() <= _MAX_TOPICS):
        raise ValueError("must be an array of names")
    return tuple(strings(value))


class TopicRecorder(Element):
    """Records topics to files. See its page in ``docs/controls``."""

    #: A recording is complete: its file (empty if nothing was recorded), and why it ended.
    finished = Signal(str, str, arguments=["file", "reason"])
    #: A recording did not begin, or ended by this error.
    failed = Signal(str, arguments=["reason"])
    recordingChanged = Signal()

    #: Folder of the files; empty for the home folder.
    folder = Writable(str, "", then="_look_at_disk")
    #: Name of the next file; empty for one with date and time.
    fileName = Writable(str, "", then="")
    format = Writable(str, "mcap", one_of("mcap", "bag"), then="")
    #: Topics to record; empty for all.
    topics = Writable(QJSValue, (), _names, read="_get_topics", then="")
    #: Regular expression for topics that are never recorded.
    exclude = Writable(str, "", then="")
    #: Bytes and seconds after which a recording ends; 0 for no limit.
    sizeLimit = Writable(float, 0.0, _limit, then="", unit="bytes")
    timeLimit = Writable(float, 0.0, _limit, then="", unit="s")
    #: Whether it records; setting it starts and stops.
    recording = Writable(bool, read=lambda self: self._active, write="_set_recording")
    #: Whether a file is being completed.
    completing = ReadOnly(bool, False)
    #: The file of the present or last recording.
    file = ReadOnly(str, "")
    #: Why the last recording ended.
    ending = ReadOnly(str, "")
    #: Seconds, bytes and counts of the present or last recording.
    elapsed = ReadOnly(float, 0.0)
    size = ReadOnly(float, 0.0)
    messageCount = ReadOnly(int, 0)
    lost = ReadOnly(int, 0)
    markCount = ReadOnly(int, 0)
    topicCount = ReadOnly(int, 0)
    #: Why topics are not recorded, such as ``/scan: no publisher``.
    missing = ReadOnly(str, "")
    #: Bytes that are free on the disk; -1 while unknown.
    free = ReadOnly(float, -1.0)

    _endpoint: Recorder | None
    _topics: tuple[str, ...]

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._active = False
        self._file: str
        self._ticks = self._unfinished = 0
        self._looking = False
        self._reason = ""

    def _get_topics(self) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(list(self._topics))

    def _folder_path(self) -> Path:
        # Unlike pathlib's, this never raises.
        return Path(os.path.expanduser(plain_path(self.folder) or "~")).absolute()  # noqa: PTH111

    # Starting and stopping.

    @Slot()
    def start(self) -> None:
        """Start a recording in a new file."""
        self._set_recording(True)

    @Slot()
    def stop(self) -> None:
        """Stop, and complete the file in the background."""
        self._set_recording(False)

    def _set_recording(self, wanted: bool) -> None:
        if wanted == self._active:
            return
        self._active = wanted
        if wanted:
            self._begin()
        else:
            self._reason = self._reason or "stopped"
        self.recordingChanged.emit()
        self._schedule()

    def _begin(self) -> None:
        self._reason = ""
        self._set_problem("")
        report(
            self,
            file="",
            ending="",
            elapsed=0.0,
            size=0.0,
            messageCount=0,
            lost=0,
            markCount=0,
            topicCount=0,
            missing="",
        )

    @Slot(str, result=bool)
    def mark(self, text: str) -> bool:
        """Write an event mark; return whether it was written."""
        recorder = self._endpoint
        try:
            if recorder is None:
                raise BagError("nothing is being recorded")
            recorder.mark(text)
        except Error as error:
            self._refuse(f"TopicRecorder: no mark was written: {error}")
            return False
        self._refresh()
        return True

    # The recorder.

    def _wanted(self) -> tuple[Any, ...] | None:
        node = self.node
        if node is None or not self._active:
            return None
        if self._config is not None:
            # What is changed while it records counts for the next recording.
            return self._config
        # Not when `recording` is set: an interface may set it before the file's name.
        name = self.fileName or f"recording_{datetime.now():%Y-%m-%d_%H-%M-%S}"
        suffix = f".{self.format}"
        path = self._folder_path() / (name if name.endswith(suffix) else name + suffix)
        report(self, file=str(path))
        return node, path, self._topics, self.exclude, int(self.sizeLimit), self.timeLimit

    def _update(self) -> None:
        node = self.node
        if self._config is not None and self._config[0] is not node:
            self._reason = "the robot was changed"
            self._end()
        super()._update()

    def _factory(self, *wanted: Any) -> Callable[[], Recorder]:
        node, path, topics, exclude, size, seconds = wanted

        def create() -> Recorder:
            return rosglass.bags.Recorder(
                node, path, topics, exclude=exclude, max_size=size, max_duration=seconds
            )

        return create

    def _on_created(self, endpoint: Recorder) -> None:  # noqa: ARG002 - the base's signature
        self._set_problem("")
        self._refresh()

    def _on_create_failed(self, error: Error) -> None:
        self._set_problem(str(error))
        self._end()
        self.failed.emit(str(error))

    def _end(self) -> None:
        if self._active:
            self._active = False
            self.recordingChanged.emit()
            self._schedule()

    def _dispose(self, session: Session, endpoint: Recorder) -> None:
        """Complete the file in a thread of its own, which the program waits for at its end."""
        self._unfinished += 1
        report(self, completing=True)
        post, reason = session.executor.post, self._reason or "the interface was closed"
        done = weak_callback(self._on_completed)

        def complete() -> None:
            error = _complete(endpoint)
            post(lambda: done(endpoint, reason, error))

        thread = threading.Thread(target=complete, name="recording", daemon=True)
        thread.start()
        # The session waits for its worker before the program ends.

    def _on_completed(self, endpoint: Recorder, reason: str, error: str) -> None:
        if not is_alive(self):
            return
        self._unfinished -= 1
        report(self, completing=self._unfinished > 0)
        if error:
            self._set_problem(error)
            self.failed.emit(error)
            return
        path = endpoint.path
        if str(path) == self._file:
            size = float(path.stat().st_size) if path.exists() else 0.0
            status = endpoint.status()
            report(
                self,
                ending=reason if size else "nothing was recorded, and no file is left",
                size=size,
                messageCount=status.messages,
                markCount=status.marks,
            )
        self.finished.emit(str(path) if path.exists() else "", reason)

    # Watching.

    @Slot()
    def _on_tick(self) -> None:
        self._ticks += 1
        if self._endpoint is not None and self._ticks % _PROGRESS_TICKS == 0:
            self._refresh()
        if self._ticks % _DISK_TICKS == 1:
            self._look_at_disk()

    def _refresh(self) -> None:
        recorder = self._endpoint
        if recorder is None:
            return
        try:
            status = recorder.status()
        except Error as error:
            # The file is closed already; completing it reports the error.
            self._reason = str(error)
            self._set_problem(str(error))
            self._end()
            return
        missing = [f"{topic}: {why}" for topic, why in sorted(status.problems.items())]
        report(
            self,
            elapsed=round(status.duration, 1),
            size=float(status.size),
            messageCount=status.messages,
            lost=status.dropped,
            markCount=status.marks,
            topicCount=len(status.topics),
            missing="; ".join(missing)[:2000],
        )
        if status.ended and is_alive(self):
            self._reason = status.ended
            self._end()

    def _look_at_disk(self) -> None:
        """Find out how much is free, in a thread of its own: a lost network disk may block it."""
        session = self._session
        if session is None or self._looking:
            return
        self._looking = True
        folder, post = self._folder_path(), session.executor.post
        show = weak_callback(self._show_free)

        def look() -> None:
            try:
                free = float(shutil.disk_usage(folder).free)
            except OSError:
                free = -1.0
            post(lambda: show(free))

        threading.Thread(target=look, name="free disk space", daemon=True).start()

    def _show_free(self, free: float) -> None:
        self._looking = False
        if is_alive(self):
            report(self, free=free)


def _complete(recorder: Recorder) -> str:
    """Complete a file, and delete it if it holds nothing; return the error."""
    try:
        recorder.close()
        status = recorder.status()
        if not status.messages and not status.marks:
            recorder.path.unlink(missing_ok=True)
    except (Error, OSError) as error:
        return str(error)
    return ""
