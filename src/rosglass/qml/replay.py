"""The element ``Replay``: a recording in place of the robot, or played to the robot."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.element import Element
from rosglass.qml.robot_place import RobotPlace
from rosglass.qml.singleton import strings
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.bags import Playback
    from rosglass.comm.node import Node
    from rosglass.qml.runtime import Runtime

__all__ = ["Replay"]

_SCHEME = "replay:"
_MOST_TOPICS = 10_000


class Replay(Element):
    """Controls the recording that an interface shows. See its page in ``docs/elements``."""

    fileChanged = Signal()
    rateChanged = Signal()
    loopChanged = Signal()
    playingChanged = Signal()
    positionChanged = Signal()
    durationChanged = Signal()
    topicsChanged = Signal()
    toRobotChanged = Signal()
    readyChanged = Signal()
    problemChanged = Signal()
    #: The end was reached, and it stays there.
    finished = Signal()

    _HOLDS = ("_playback", "_have")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._file = ""
        self._topics: list[str] = []
        self._to_robot = False
        # What QML has not set is as the recording's address says.
        self._rate: float | None = None
        self._loop: bool | None = None
        self._wish: bool | None = None
        self._place: float | None = None
        self._shown = (False, 0.0, 0.0)
        #: What stands for it where it must not be kept alive.
        self._user = object()
        self._playback: Playback | None = None
        self._have: tuple[Node, str, tuple[str, ...]] | None = None

    # Properties.

    def _set_file(self, file: str) -> None:
        file = QtCore.QUrl(file).toLocalFile() if file.startswith("file:") else file
        if file != self._file:
            self._file = file
            self.fileChanged.emit()
            self._schedule()

    def _get_rate(self) -> float:
        if self._playback is not None:
            return self._playback.rate
        return 1.0 if self._rate is None else self._rate

    def _set_rate(self, rate: float) -> None:
        if not 1e-3 <= rate <= 1e3:
            self._refuse(f"Replay: rate {rate:g} is not from 0.001 to 1000")
        elif rate != self._rate:
            self._rate = rate
            if self._playback is not None:
                self._playback.set_rate(rate)
            self.rateChanged.emit()

    def _get_loop(self) -> bool:
        return self._playback.loop if self._playback is not None else bool(self._loop)

    def _set_loop(self, loop: bool) -> None:
        if loop != self._loop:
            self._loop = loop
            if self._playback is not None:
                self._playback.set_loop(loop)
            self.loopChanged.emit()

    def _set_playing(self, playing: bool) -> None:
        self._wish = playing
        if self._playback is not None:
            self._obey()

    def _set_position(self, seconds: float) -> None:
        problem = self._seek(seconds)
        if problem:
            self._refuse(f"Replay: {problem}")

    def _get_topics(self) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(self._topics)

    def _set_topics(self, value: QJSValue | None) -> None:
        topics: list[str] = []
        if value is not None and not value.isUndefined() and not value.isNull():
            # A list of Python is none that JavaScript calls an array.
            if not (value.isObject() and value.property("length").toNumber() <= _MOST_TOPICS):
                self._refuse("Replay: topics must be an array of names")
                return
            topics = strings(value)
        if topics != self._topics:
            self._topics = topics
            self.topicsChanged.emit()
            self._schedule()

    def _set_to_robot(self, to_robot: bool) -> None:
        if to_robot != self._to_robot:
            self._to_robot = to_robot
            self.toRobotChanged.emit()
            self._schedule()

    file = Property(str, lambda self: self._file, _set_file, notify=fileChanged)
    rate = Property(float, _get_rate, _set_rate, notify=rateChanged)
    loop = Property(bool, _get_loop, _set_loop, notify=loopChanged)
    playing = Property(bool, lambda self: self._shown[0], _set_playing, notify=playingChanged)
    position = Property(float, lambda self: self._shown[1], _set_position, notify=positionChanged)
    duration = Property(float, lambda self: self._shown[2], notify=durationChanged)
    # Qt 5 ends the program when it makes a list of texts of certain objects.
    topics = Property(QJSValue, _get_topics, _set_topics, notify=topicsChanged)
    toRobot = Property(bool, lambda self: self._to_robot, _set_to_robot, notify=toRobotChanged)
    ready = Property(bool, lambda self: self._playback is not None, notify=readyChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    # Controlling.

    @Slot()
    def play(self) -> None:
        """Let time pass; from the beginning when the end was reached."""
        self._set_playing(True)

    @Slot()
    def pause(self) -> None:
        """Let time stand still."""
        self._set_playing(False)

    @Slot(float)
    def seek(self, seconds: float) -> None:
        """Go on at another place, in seconds from the beginning; what there is none of throws."""
        problem = self._seek(seconds)
        runtime = self._find_runtime()
        if problem and runtime is not None:
            runtime.throw(f"Replay.seek: {problem}")

    def _seek(self, seconds: float) -> str:
        """Return why it cannot be done, empty when it can."""
        if self._playback is None:
            self._place = seconds
            return ""
        try:
            self._playback.seek(seconds)
        except Error as error:
            return str(error)
        self._watch()
        return ""

    def _obey(self) -> None:
        playback, wish = self._playback, self._wish
        if playback is not None and wish is not None and wish != playback.is_playing:
            (playback.play if wish else playback.pause)()
        self._watch()

    # Finding what to control.

    def _update(self) -> None:
        refused = self._take_place()
        node = self.node
        shown = node is not None and node.url.lower().startswith(_SCHEME)
        if self._to_robot:
            key = (node, self._file, tuple(self._topics)) if node is not None else None
            want = key if self._file and not shown else None
            if shown:
                self._say("Replay: toRobot: the interface shows a recording; there is no robot")
        else:
            want = (node, "", ()) if node is not None and shown and not refused else None
            if refused:
                self._say(f"Replay: {refused}")
        if want != self._have:
            self._let_go()
            self._have = want
            if want is not None and self._to_robot:
                self._open(*want)
            elif want is not None:
                self._take(getattr(node, "playback"))  # noqa: B009 - only a recording's node has it
        if not self._to_robot and want is not None:
            self._choose(node)

    def _take_place(self) -> str:
        """Put the recording in the robot's place, or let the robot back; returns why not."""
        session, user = self._session, self._user
        assert session is not None
        place = RobotPlace.of(session)
        if self._to_robot or not self._file:
            self._at_end.pop("place", None)
            place.leave(user)
            return ""
        self._at_end["place"] = lambda: place.leave_soon(user)
        return place.take(user, self._file)

    def _choose(self, node: Any) -> None:
        try:
            node.choose(self._topics)
        except Error as error:
            self._say(f"Replay: topics: {error}")

    def _open(self, node: Node, file: str, topics: tuple[str, ...]) -> None:
        session, want = self._session, self._have
        assert session is not None

        def work() -> Playback:
            from rosglass.bags import Playback, open_bag  # noqa: PLC0415 - few ever need it

            # To a robot nothing is sent before someone says so.
            return Playback(node, open_bag(file), topics=topics, paused=True)

        def done(result: Playback | Error) -> None:
            if not is_alive(self) or self._have is not want:
                if not isinstance(result, Error):
                    session.background(result.close)
            elif isinstance(result, Error):
                self._say(f"Replay: {result}")
            else:
                self._at_end["playback"] = lambda: session.background(result.close)
                self._take(result)

        session.background(work, done)

    def _take(self, playback: Playback) -> None:
        self._playback = playback
        self._say("")
        if self._rate is not None:
            playback.set_rate(self._rate)
        if self._loop is not None:
            playback.set_loop(self._loop)
        place, self._place = self._place, None
        if place is not None:
            self._set_position(place)
        self._obey()
        self.readyChanged.emit()

    def _let_go(self) -> None:
        playback, self._playback = self._playback, None
        end = self._at_end.pop("playback", None)
        if end is not None:
            end()
        if playback is not None:
            self._watch()
            self.readyChanged.emit()

    # Watching.

    @Slot()
    def _on_connection(self) -> None:
        playback, session = self._playback, self._session
        lost = session is not None and session.state != "connected"
        if lost and self._to_robot and playback is not None and playback.is_playing:
            # Nobody expects a robot that is back to go on with commands from a recording.
            self._refuse("Replay: paused, as the connection with the robot was lost")
            self.pause()

    @Slot()
    def _on_tick(self) -> None:
        self._watch()

    def _watch(self) -> None:
        """Tell what changed since the last look."""
        playback = self._playback
        before, now = self._shown, (False, 0.0, 0.0)
        if playback is not None:
            now = (playback.is_playing, playback.position, playback.duration)
            self._say(playback.problem)
        elif self._session is not None and self._session.state == "failed":
            self._say(self._session.detail)
        self._shown = now
        ended = playback is not None and before[0] and playback.is_at_end
        if ended:
            self._wish = None
        if before[2] != now[2]:
            self.durationChanged.emit()
        if before[1] != now[1]:
            self.positionChanged.emit()
        if before[0] != now[0]:
            self.playingChanged.emit()
        if ended and is_alive(self):
            self.finished.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()
