"""The element ``Replay``: a recording instead of the robot, or played to the robot."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.errors import Error
from rosglass.qml.elements.element import Element
from rosglass.qml.elements.singleton import strings
from rosglass.qml.engine.properties import ReadOnly, Writable, report, within
from rosglass.qml.engine.session import result_of, weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bags import Playback, TopicDensity
    from rosglass.comm.node import Node
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session


__all__ = ["Replay", "RobotPlace"]


class RobotPlace:
    """Replaces the address of a session by recordings; on the GUI thread only."""

    def __init__(self, session: Session) -> None:
        self._session = session
        #: Elements -> the recordings that they want; the last one is shown.
        self._wanted: dict[Any, str] = {}
        #: Address before the first recording, and the address that replaced it.
        self._before, self._ours = "", ""

    @classmethod
    def of(cls, session: Session) -> RobotPlace:
        """Return the instance of a session."""
        place: RobotPlace = session.shared.setdefault(cls, cls(session))
        return place

    def take(self, user: Any, file: str) -> str:
        """Show a recording; return why it is not shown, or an empty text."""
        if not self._session.owns_node:
            return "the program brought its own node, which stays"
        if self._wanted.get(user) != file:
            self._wanted.pop(user, None)
            self._wanted[user] = file
        shown = self._settle()
        return "" if shown == file else f"another Replay shows {shown} now"

    def leave(self, user: Any) -> None:
        """Stop showing a user's recording; show the previous one again."""
        if self._wanted.pop(user, None) is not None:
            self._settle()

    def leave_soon(self, user: Any) -> None:
        """Call :meth:`leave` later, unless the program ends."""

        def leave() -> None:
            if is_alive(self._session):
                self.leave(user)

        QtCore.QTimer.singleShot(0, leave)

    def _settle(self) -> str:
        """Connect the session to the last recording and return it."""
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


_SCHEME = "replay:"
_MAX_TOPICS = 10_000


def _topic_names(value: QJSValue) -> tuple[str, ...]:
    """Return the names in a QML array; raises ValueError for other values."""
    if value.isUndefined() or value.isNull():
        return ()
    # A Python list is not an array in JavaScript.
    if not (value.isObject() and value.property("length").toNumber() <= _MAX_TOPICS):
        raise ValueError("must be an array of names")
    return tuple(strings(value))


class Replay(Element):
    """Controls the recording that an interface shows. See its page in ``docs/elements``."""

    #: The recording has reached its end.
    finished = Signal()
    rateChanged = Signal()
    loopChanged = Signal()
    playingChanged = Signal()
    positionChanged = Signal()
    durationChanged = Signal()
    marksChanged = Signal()
    rangeChanged = Signal()
    densityChanged = Signal()

    file = Writable(
        str, "", lambda path: QtCore.QUrl(path).toLocalFile() if path[:5] == "file:" else path
    )
    rate = Writable(float, read="_get_rate", write="_set_rate")
    loop = Writable(bool, read="_get_loop", write="_set_loop")
    playing = Writable(
        bool,
        read=lambda self: self._state[0],
        write="_set_playing",
    )
    position = Writable(
        float,
        read=lambda self: self._state[1],
        write="_set_position",
    )
    duration = ReadOnly(float, read=lambda self: self._state[2])
    # Not a string list: Qt 5 aborts the program when it converts certain objects to one.
    topics = Writable(QJSValue, (), _topic_names, read="_get_topics")
    toRobot = Writable(bool, False)
    ready = ReadOnly(bool, False)
    #: The event marks: ``{time, text}`` of each, in seconds from the beginning.
    marks = ReadOnly(QJSValue, read="_get_marks")
    #: The part that is played, in seconds from the beginning.
    rangeStart = ReadOnly(float, read=lambda self: self._range[0], notify="rangeChanged")
    rangeEnd = ReadOnly(float, read=lambda self: self._range[1], notify="rangeChanged")
    #: Number of parts in which messages are counted; 0 counts none.
    parts = Writable(int, 0, within(0, 10_000), then="_on_parts")
    #: ``{topic, type, count}`` of each recorded topic, once its messages are counted.
    density = ReadOnly(QJSValue, read="_get_density")

    _HOLDS = ("_playback",)
    _topics: tuple[str, ...]

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        # Values that QML has not set are those of the recording's address.
        self._wanted_rate: float | None = None
        self._wanted_loop: bool | None = None
        self._wanted_playing: bool | None = None
        self._wanted_position: float | None = None
        #: Playing, position, duration.
        self._state = (False, 0.0, 0.0)
        #: The key of this element where the element itself must not be kept alive.
        self._user = object()
        self._playback: Playback | None = None
        self._marks: list[tuple[float, str]] = []
        self._range = (0.0, 0.0)
        self._density: list[TopicDensity] = []
        self._ended = threading.Event()

    def _get_rate(self) -> float:
        if self._playback is not None:
            return self._playback.rate
        return 1.0 if self._wanted_rate is None else self._wanted_rate

    def _set_rate(self, rate: float) -> None:
        if not 1e-3 <= rate <= 1e3:
            self._refuse(f"Replay: rate {rate:g} is not from 0.001 to 1000")
        elif rate != self._wanted_rate:
            self._wanted_rate = rate
            if self._playback is not None:
                self._playback.set_rate(rate)
            self.rateChanged.emit()

    def _get_loop(self) -> bool:
        return self._playback.loop if self._playback is not None else bool(self._wanted_loop)

    def _set_loop(self, loop: bool) -> None:
        if loop != self._wanted_loop:
            self._wanted_loop = loop
            if self._playback is not None:
                self._playback.set_loop(loop)
            self.loopChanged.emit()

    def _set_playing(self, playing: bool) -> None:
        self._wanted_playing = playing
        if self._playback is not None:
            self._play_or_pause()

    def _set_position(self, seconds: float) -> None:
        problem = self._seek(seconds)
        if problem:
            self._refuse(f"Replay: {problem}")

    def _get_topics(self) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(list(self._topics))

    def _get_marks(self) -> QJSValue:
        runtime = self._find_runtime()
        if runtime is None:
            return QJSValue()
        return runtime.value([{"time": time, "text": text} for time, text in self._marks])

    def _get_density(self) -> QJSValue:
        runtime = self._find_runtime()
        if runtime is None:
            return QJSValue()
        return runtime.value(
            [
                {"topic": one.topic, "type": one.type_name, "count": one.count}
                for one in self._density
            ]
        )

    @Slot(int, result="QVariantList")
    def partsOf(self, index: int) -> list[int]:  # noqa: N802 - QML's name
        """Return the messages in each part of the recording, of a topic of `density`."""
        return list(self._density[index].parts) if 0 <= index < len(self._density) else []

    # Controlling.

    @Slot()
    def play(self) -> None:
        """Start playing, from the beginning if the end was reached."""
        self._set_playing(True)

    @Slot()
    def pause(self) -> None:
        """Pause playing."""
        self._set_playing(False)

    @Slot(float)
    def seek(self, seconds: float) -> None:
        """Jump to a position in seconds from the beginning; an invalid one throws."""
        problem = self._seek(seconds)
        runtime = self._find_runtime()
        if problem and runtime is not None:
            runtime.throw(f"Replay.seek: {problem}")

    @Slot()
    def step(self) -> None:
        """Play the next message, and pause."""
        if self._playback is not None:
            self._wanted_playing = False
            self._playback.step()

    @Slot(float, float)
    def setRange(self, start: float, end: float) -> None:  # noqa: N802 - QML's name
        """Play and repeat a part only, in seconds; an invalid one throws."""
        if self._playback is None:
            return
        try:
            self._playback.set_range(start, end)
        except Error as error:
            runtime = self._find_runtime()
            if runtime is not None:
                runtime.throw(f"Replay.setRange: {error}")
            return
        self._refresh()

    def _seek(self, seconds: float) -> str:
        """Jump to a position; return why this is impossible, or an empty text."""
        if self._playback is None:
            self._wanted_position = seconds
            return ""
        try:
            self._playback.seek(seconds)
        except Error as error:
            return str(error)
        self._refresh()
        return ""

    def _play_or_pause(self) -> None:
        playback, playing = self._playback, self._wanted_playing
        if playback is not None and playing is not None and playing != playback.is_playing:
            (playback.play if playing else playback.pause)()
        self._refresh()

    # Finding the playback.

    def _wanted(self) -> tuple[Node, str, tuple[str, ...]] | None:
        refused, node = self._set_robot_place(), self.node
        shown = node is not None and node.url.lower().startswith(_SCHEME)
        if not self.toRobot:
            if refused:
                self._set_problem(f"Replay: {refused}")
            return (node, "", ()) if node is not None and shown and not refused else None
        if shown:
            self._set_problem("Replay: toRobot: the interface shows a recording; there is no robot")
        if node is None or shown or not self.file:
            return None
        return node, self.file, self._topics

    def _update(self) -> None:
        super()._update()
        if not self.toRobot and self._config is not None:
            node: Any = self._config[0]
            try:
                node.choose(self._topics)
            except Error as error:
                self._set_problem(f"Replay: topics: {error}")

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        if self.toRobot:
            super()._create_endpoint(wanted)
        else:
            self._on_created(wanted[0].playback)  # belongs to the recording's node

    def _factory(self, node: Node, file: str, topics: tuple[str, ...]) -> Callable[[], Playback]:
        def create() -> Playback:
            bag = rosglass.bags.open_bag(file)
            # Send nothing to a robot before QML calls play().
            return rosglass.bags.Playback(node, bag, topics=topics, paused=True)

        return create

    def _set_robot_place(self) -> str:
        """Replace the robot by the recording, or restore it; return why this failed."""
        session, user = self._session, self._user
        assert session is not None
        place = RobotPlace.of(session)
        if self.toRobot or not self.file:
            self._cleanup.pop("place", None)
            place.leave(user)
            return ""
        self._cleanup["place"] = lambda: place.leave_soon(user)
        return place.take(user, self.file)

    def _on_created(self, endpoint: Playback) -> None:
        playback = self._playback = endpoint
        self._set_problem("")
        if self._wanted_rate is not None:
            playback.set_rate(self._wanted_rate)
        if self._wanted_loop is not None:
            playback.set_loop(self._wanted_loop)
        position, self._wanted_position = self._wanted_position, None
        if position is not None:
            self._set_position(position)
        self._play_or_pause()
        self._read_marks(playback)
        self._count_messages()
        report(self, ready=True)

    def _on_closed(self, endpoint: Playback | None) -> None:  # noqa: ARG002 - the base's signature
        playback, self._playback = self._playback, None
        if playback is not None:
            self._refresh()
            self._show_marks(None, [])
            self._ended.set()
            self._show_density(None, [])
            report(self, ready=False)

    def _read_marks(self, playback: Playback) -> None:
        """Read the marks in a thread of its own: without an index, that takes long."""
        assert self._session is not None
        post, show = self._session.executor.post, weak_callback(self._show_marks)

        def read() -> None:
            found = result_of(lambda: rosglass.bags.read_marks(playback.path), "reading marks")
            if not isinstance(found, Error):
                post(lambda: show(playback, found))

        threading.Thread(target=read, name="marks of a recording", daemon=True).start()

    def _show_marks(self, playback: Playback | None, marks: list[tuple[float, str]]) -> None:
        if is_alive(self) and playback is self._playback and marks != self._marks:
            self._marks = marks
            self.marksChanged.emit()

    def _on_parts(self) -> None:
        self._count_messages()

    def _count_messages(self) -> None:
        """Count messages in a thread of its own: without an index, that takes long."""
        self._ended.set()
        playback, parts = self._playback, self.parts
        if playback is None or self._session is None or parts == 0:
            self._show_density(playback, [])
            return
        self._ended = ended = threading.Event()
        post, show = self._session.executor.post, weak_callback(self._show_density)

        def count() -> None:
            found = result_of(
                lambda: rosglass.bags.read_density(playback.path, parts, ended),
                "counting messages",
            )
            if not isinstance(found, Error) and not ended.is_set():
                post(lambda: show(playback, found))

        threading.Thread(target=count, name="density of a recording", daemon=True).start()

    def _show_density(self, playback: Playback | None, density: list[TopicDensity]) -> None:
        if is_alive(self) and playback is self._playback and density != self._density:
            self._density = density
            self.densityChanged.emit()

    # Watching.

    @Slot()
    def _on_connection(self) -> None:
        playback, session = self._playback, self._session
        lost = session is not None and session.state != "connected"
        if lost and self.toRobot and playback is not None and playback.is_playing:
            # A reconnected robot must not continue with commands from a recording.
            self._refuse("Replay: paused, as the connection with the robot was lost")
            self.pause()

    @Slot()
    def _on_tick(self) -> None:
        self._refresh()

    def _refresh(self) -> None:
        """Emit the signals of properties that changed since the last call."""
        playback = self._playback
        before, now = self._state, (False, 0.0, 0.0)
        if playback is not None:
            now = (playback.is_playing, playback.position, playback.duration)
            self._set_problem(playback.problem)
        elif self._session is not None and self._session.state == "failed":
            self._set_problem(self._session.detail)
        self._state = now
        part = playback.range if playback is not None else (0.0, 0.0)
        moved, self._range = part != self._range, part
        ended = playback is not None and before[0] and playback.is_at_end
        if ended:
            self._wanted_playing = None
        if before[2] != now[2]:
            self.durationChanged.emit()
        if moved:
            self.rangeChanged.emit()
        if before[1] != now[1]:
            self.positionChanged.emit()
        if before[0] != now[0]:
            self.playingChanged.emit()
        if ended and is_alive(self):
            self.finished.emit()
