"""Base classes of displays: settings, status, the topic, and the place in the fixed frame.

A display is a QML object inside a ``SceneView``, or is added with ``view.scene.add``. It fills its
:attr:`Display.root` with drawables (:mod:`rosglass.scene.render.drawing`). One that shows messages
derives from :class:`TopicDisplay` and implements :meth:`TopicDisplay.show`.
"""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

import numpy as np

from rosglass.comm.names import similar
from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.errors import ArgumentError, Error, TransformException
from rosglass.interfaces.names import ros1_name
from rosglass.qml.elements.element import TopicElement, single_shot
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtQml, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import FIXED_FRAME, TopicSetting, read_topic, write_topic
from rosglass.scene.configs.settings import Configurable, Setting
from rosglass.scene.displays.declared import expect_view, find_view
from rosglass.scene.render.drawing import Group, check_numbers, instance_matrix

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from rosglass.comm.handle import Executor
    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.messages import Message
    from rosglass.qml.engine.log import Caller
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.displays.parts import Parts
    from rosglass.scene.displays.scene import Scene

__all__ = [
    "MOST_WAITING",
    "OUTDATED_ALPHA",
    "Display",
    "MessageQueue",
    "OneTopicDisplay",
    "Status",
    "Subscriptions",
    "TopicDisplay",
    "drop_oldest",
    "frame_and_stamp",
    "matrix_of",
]

_log = logging.getLogger("rosglass.scene")
_T = TypeVar("_T")

_LEVELS = ("ok", "warn", "error")
#: The policy that matches every publisher; RViz does not have it.
BEST_AVAILABLE = "Best Available"
#: QoS policies by RViz's words.
_RELIABILITY = {
    BEST_AVAILABLE: Reliability.BEST_AVAILABLE,
    "Best Effort": Reliability.BEST_EFFORT,
    "Reliable": Reliability.RELIABLE,
    "System Default": Reliability.SYSTEM_DEFAULT,
}
_DURABILITY = {
    BEST_AVAILABLE: Durability.BEST_AVAILABLE,
    "Volatile": Durability.VOLATILE,
    "Transient Local": Durability.TRANSIENT_LOCAL,
    "System Default": Durability.SYSTEM_DEFAULT,
}
#: Messages that wait for the GUI thread or their transforms, of displays that show each.
MOST_WAITING = 1000
#: Bytes of what waits there: 1000 clouds may be 10 GB. The newest one waits in any case.
_MAX_WAITING_BYTES = 256 << 20
#: Lookups that may fail each time that messages are placed, from either end.
_MOST_MISSES = 25
#: Seconds for which data may wait for its transform before that is an error.
_LATE_S = 1.0
#: Seconds without a message after which data that is sent all the time is out of date.
_CONTINUOUS_S = 3.0
#: Seconds without a transform after which a frame that is followed may be somewhere else.
_FRAME_TIMEOUT_S = 5.0
#: The same where transforms have no publisher any more.
_UNPUBLISHED_TIMEOUT_S = 0.5
#: Letters of a line of the status: what robots name may be of any length.
_MAX_NAME, _MAX_TEXT = 200, 1000
#: Milliseconds for which something may be wrong with a display before that is logged.
_LOGGED_MS = 3000
#: Lines of the status that are logged at a time.
_MAX_LOGGED = 3
#: Names of parts in an error.
_MAX_NAMES = 20
#: Opacity of data whose publisher or connection is gone.
OUTDATED_ALPHA = 0.35


class Status(NamedTuple):
    """One line of a display's status.

    Attributes:
        level: ``ok``, ``warn`` or ``error``.
        text: In words.
    """

    level: str
    text: str


def matrix_of(pose: Any) -> NDArray[np.float64]:
    """Return the matrix of a ``geometry_msgs/Pose``.

    Raises:
        Error: It has numbers that cannot be drawn, or a quaternion that is none.
    """
    at, turn = pose.position, pose.orientation
    position, rotation = (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)
    check_numbers("pose.position", position)
    check_numbers("pose.orientation", rotation)
    length = sum(number * number for number in rotation)
    if length and abs(length - 1.0) > 0.1:
        raise Error(f"pose: the quaternion {rotation} is not normalised")
    return instance_matrix(position, rotation)


def frame_and_stamp(message: Message) -> tuple[str, int]:
    """Return the frame and the time in nanoseconds of a message's header; without one "", 0."""
    if "header" not in message:
        return "", 0
    header = message.header
    stamp = header.stamp
    old = "secs" in stamp
    seconds, rest = (stamp.secs, stamp.nsecs) if old else (stamp.sec, stamp.nanosec)
    return header.frame_id.lstrip("/"), seconds * 1_000_000_000 + rest


class Display(Configurable, TopicElement):
    """Something that a scene shows.

    Attributes:
        TYPE: Its name in RViz, e.g. ``Grid``.
        root: What it draws, in the fixed frame.
    """

    TYPE: ClassVar[str] = ""
    SETTINGS: ClassVar[dict[str, Setting]] = {}

    nameChanged = Signal()
    statusChanged = Signal()

    #: Its name in the Displays panel; that of its type until it is set.
    name = Writable(str, read=lambda self: self._name or self.TYPE, write="_set_name")
    enabled = Writable(bool, True, then="_on_enabled")
    #: ``ok``, ``warn`` or ``error``: the worst of its lines.
    statusLevel = ReadOnly(str, "ok", notify="statusChanged")
    #: All lines, each with its name.
    statusText = ReadOnly(str, "", notify="statusChanged")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self.root = Group()
        self.scene: Scene | None = None
        #: Whether it was removed, and waits to be destroyed.
        self._is_removed = False
        self.status_lines: dict[str, Status] = {}
        self._name = ""
        #: What a ``.rviz`` file had for it.
        self.saved: dict[str, Any] = {}
        #: When a frame was found last, by the clock of :func:`time.monotonic`.
        self._placed_at = -math.inf
        #: Lines of the status whose error was logged.
        self._logged: set[str] = set()
        #: Frames that it follows and that are not updated any more, and for how many seconds.
        self._outdated_frames: dict[str, float] = {}
        #: What of it is shown and hidden one by one; None for nothing.
        self.parts: Parts | None = None
        #: Parts that QML has switched before they were known, and where.
        self._switched_parts: dict[str, Caller] = {}
        #: The group that it is in; None for none.
        self.group: Display | None = None
        super().__init__(parent, runtime)
        self._log_timer = single_shot(self, self._log_errors)
        state, root = self.__dict__, self.root

        def forget() -> None:
            # PySide never frees the Python half of an object that QML has made.
            root.remove()
            state.clear()

        self.destroyed.connect(forget)

    @property
    def label(self) -> str:
        """The display in error messages."""
        return f"display {self._name or self.TYPE!r}"

    def _set_name(self, name: str) -> None:
        if name != self._name:
            self._name = name
            self.nameChanged.emit()

    @Slot()
    def _run_update(self) -> None:
        if not is_alive(self) or self._is_removed:
            return
        if self.scene is None:
            # Declared in QML inside a view; objects that Python makes are added by it.
            view = find_view(self)
            if view is not None:
                view.adopt_display(self)
            else:
                expect_view(self, "scene")
        if self.scene is not None:
            super()._run_update()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        if self._mixing and self.shown:
            self.set_status("Publishers", "warn", self._mixing)
        else:
            self.delete_status("Publishers")

    def join(self, scene: Scene) -> None:
        """Start to be shown in a scene; called by the scene."""
        self.scene, self._is_removed = scene, False
        self.root.visible = self.enabled
        (scene.root if self.group is None else self.group.root).add(self.root)
        self._schedule()
        self._restyle()

    def leave(self) -> None:
        """Stop being shown; called by the scene, also for a display that QML has destroyed."""
        self.root.remove()
        self.root.clear()
        self.scene, self._is_removed = None, True

    @property
    def shown(self) -> bool:
        """Whether it and its groups are enabled."""
        return bool(self.enabled) and (self.group is None or self.group.shown)

    def _on_enabled(self) -> None:
        self.root.visible = self.enabled
        self.on_group_enabled()

    def on_group_enabled(self) -> None:
        """Receive something, or nothing any more, as it or its group is shown or hidden."""
        if not self.shown:
            self.clear_status()
        self._restyle()
        self._schedule()

    # -- for subclasses --------------------------------------------------------------------------

    def _restyle(self) -> None:
        """Apply changed settings to what is drawn."""

    def on_transforms(self) -> None:
        """Follow frames that have moved; at most 30 times per second, while enabled."""

    def on_fixed_frame(self) -> None:
        """Place everything anew: another frame is the fixed one."""
        self.on_transforms()

    def followed_frames(self) -> Iterable[str]:
        """Return the frames whose newest poses are shown."""
        return ()

    def check_frames(self) -> None:
        """Fade what follows frames that are not updated any more; called by the scene."""
        scene, ages = self.scene, {}
        if scene is not None and self.shown:
            frames = (frame.lstrip("/") for frame in self.followed_frames())
            ages = {
                one: scene.seconds_without_update(one)
                for one in frames
                if one not in ("", FIXED_FRAME)
            }
        published = scene is None or scene.has_tf_publishers
        timeout = _FRAME_TIMEOUT_S if published else _UNPUBLISHED_TIMEOUT_S
        self._outdated_frames = {one: age for one, age in ages.items() if age > timeout}
        self._report_outdated_frames()
        self._fade()

    def _report_outdated_frames(self) -> None:
        frames = self._outdated_frames
        if not frames:
            self.delete_status("Frame")
            return
        # Those behind a joint are as old as it is, but for the time that this takes.
        worst = max(frames, key=lambda one: round(frames[one], 1))
        why = "the robot is not connected"
        if not math.isinf(frames[worst]):
            why = f"no transform has come for {frames[worst]:.0f} s"
        more = f"[{worst}]" if len(frames) == 1 else f"[{worst}] and {len(frames) - 1} more"
        self.set_status("Frame", "warn", f"{more} may be somewhere else: {why}")

    def _fade(self) -> None:
        """Draw what may be out of date as such."""
        self.root.alpha = OUTDATED_ALPHA if self._outdated_frames else 1.0

    def on_files(self, uris: Collection[str]) -> None:
        """Read files again that could not be fetched: their servers answer now."""

    def reset(self) -> None:
        """Drop all data that was received, e.g. as time has jumped back."""

    def _renew_preparer(self) -> None:
        """Prepare further data by changed settings, or for another renderer."""

    def _is_old(self) -> bool:
        return False

    # -- parts -----------------------------------------------------------------------------------

    def switch_part(self, name: str, enabled: bool) -> None:
        """Show or hide a part for QML; logged if there is none of this name once they are known."""
        if self.parts is not None:
            self._switched_parts[name] = self._caller()
            self.parts.set_enabled(name, enabled)
            self.check_parts()

    def check_parts(self) -> None:
        """Log parts that QML has switched and that do not exist, once there are any."""
        names = list(self.parts.names()) if self.parts is not None else []
        if self.parts is None or not names:
            return
        for name, caller in self._switched_parts.items():
            if name not in names:
                hint = similar(name, names) or f"; there are: {', '.join(names[:_MAX_NAMES])}"
                text = f"{self.parts.title} of {self.label}: there is no {name!r}{hint}"
                log_from_qml("", logging.ERROR, text, caller)
        self._switched_parts.clear()

    def placeholder(self, path: str) -> str:  # noqa: ARG002 - for subclasses
        """Return what an empty setting means, for panels; empty for nothing to say."""
        return ""

    # -- status ----------------------------------------------------------------------------------

    def set_status(self, name: str, level: str, text: str) -> None:
        """Set a line of the status.

        Args:
            name: What it is about, e.g. ``Topic``.
            level: ``ok``, ``warn`` or ``error``.
            text: In words: what is wrong, and what to do.

        Raises:
            ArgumentError: There is no such level.
        """
        if level not in _LEVELS:
            raise ArgumentError("level", level, f"one of {', '.join(_LEVELS)}")
        name = name[:_MAX_NAME]
        if len(text) > _MAX_TEXT:
            text = f"{text[:_MAX_TEXT]}... ({len(text)} characters)"
        new = Status(level, text)
        if self.status_lines.get(name) != new:
            self.status_lines[name] = new
            self._report_status()

    def delete_status(self, name: str) -> None:
        """Remove a line of the status, if there is one."""
        if self.status_lines.pop(name[:_MAX_NAME], None) is not None:
            self._report_status()

    def clear_status(self) -> None:
        """Remove all lines."""
        if self.status_lines:
            self.status_lines.clear()
            self._report_status()

    def _report_status(self) -> None:
        if not is_alive(self):
            return
        lines = self.status_lines.items()
        worst = max((_LEVELS.index(one.level) for _, one in lines), default=0)
        text = "\n".join(f"{name}: {one.text}" for name, one in lines)
        report(self, statusLevel=_LEVELS[worst], statusText=text)
        if self.statusLevel == "error" and not self._log_timer.isActive():
            self._log_timer.start(_LOGGED_MS)

    @Slot()
    def _log_errors(self) -> None:
        """Log what is wrong for a while, once: an interface in QML may show no status."""
        if self.scene is None or QtQml.QQmlEngine.contextForObject(self) is None:
            return
        if self.scene.problem:
            # It is logged, and may be the reason: a fixed frame that does not exist.
            self._log_timer.start(_LOGGED_MS)
            return
        errors = {name: one.text for name, one in self.status_lines.items() if one.level == "error"}
        # The topic's own are logged where they occur.
        new = [name for name in errors if name not in self._logged and name != "Topic"]
        self._logged = set(errors)
        for name in new[:_MAX_LOGGED]:
            self._log(f"{self.label}: {name}: {errors[name]}", logging.WARNING)
        if len(new) > _MAX_LOGGED:
            more = f"{len(new) - _MAX_LOGGED} more errors, see its statusText"
            self._log(f"{self.label}: {more}", logging.WARNING)

    # -- frames ----------------------------------------------------------------------------------

    def describe_frame(self, frame: str) -> Iterator[tuple[str, str]]:
        """Iterate over what a panel says of a frame: names and values, in the fixed frame."""
        scene = self.scene
        if scene is None or scene.transforms is None:
            return
        try:
            found = scene.transforms.lookup_transform(scene.fixed_frame, frame)
        except TransformException as error:
            yield "Position", str(error)
            return
        yield "Position", "; ".join(f"{number:.5g}" for number in found.translation)
        yield "Orientation", "; ".join(f"{number:.5g}" for number in found.rotation)

    def place_of(
        self, frame: str, stamp: int = 0, status: str = "Transform"
    ) -> NDArray[np.float64] | None:
        """Return the pose of a frame in the fixed frame; None, with a status, where it is unknown.

        Args:
            frame: The frame; empty or ``<Fixed Frame>`` for the fixed frame itself.
            stamp: Nanoseconds; 0 for the newest.
            status: Name of the line of the status.
        """
        if self.scene is None:
            return None
        frame = frame.lstrip("/")  # files of RViz 1 may have a slash
        if frame in ("", FIXED_FRAME):
            self.delete_status(status)
            return np.eye(4)
        try:
            found = self.scene.look_up(frame, stamp)
        except TransformException as error:
            # Transforms of a moment often come after the data: only a delay is an error.
            if not stamp or time.monotonic() - self._placed_at > _LATE_S:
                self.set_status(status, "error", f"no transform from [{frame}]: {error}")
            return None
        self._placed_at = time.monotonic()
        self.set_status(status, "ok", "Transform OK")
        return found


class _Item(NamedTuple):
    """A message on its way to the screen.

    Attributes:
        data: What :meth:`TopicDisplay.preparer` has made of it.
        frame: Its frame.
        stamp: Its time in nanoseconds; 0 for the newest.
        size: Bytes of it as it was received.
    """

    data: Any
    frame: str
    stamp: int
    size: int = 0


def drop_oldest(waiting: deque[_T], most: int, size_of: Callable[[_T], int]) -> int:
    """Drop the oldest of what waits beyond a number, or beyond 256 MiB, but never the newest.

    Args:
        waiting: The newest at the end.
        most: How many may wait.
        size_of: Returns the bytes of one.

    Returns:
        How many were dropped.
    """
    dropped, size = 0, sum(map(size_of, waiting))
    while len(waiting) > most or (len(waiting) > 1 and size > _MAX_WAITING_BYTES):
        size -= size_of(waiting.popleft())
        dropped += 1
    return dropped


def _size_of(item: _Item) -> int:
    return item.size


class MessageQueue:
    """Decodes messages in the node's thread, and hands them to the GUI thread.

    Args:
        prepare: Turns a message into what is shown; knows nothing of the display itself.
        types: Names of the types that it accepts.
        executor: Of the GUI thread.
        on_ready: Called there when messages have arrived.
        depth: How many wait there at most; older ones, and those beyond 256 MiB, are dropped and
            counted.
        eager: Whether all fields are decoded at once.
        needs_frame: Whether a message whose header names no frame is refused.
    """

    def __init__(
        self,
        prepare: Callable[[Message], Any],
        types: tuple[str, ...],
        executor: Executor,
        on_ready: Callable[[], None],
        depth: int,
        eager: bool = False,
        needs_frame: bool = False,
    ) -> None:
        self.prepare, self._types, self._eager = prepare, types, eager
        self._needs_frame = needs_frame
        self._executor, self._on_ready = executor, on_ready
        self._lock = threading.Lock()
        self._depth = depth
        self._items: deque[_Item] = deque()
        self._error = ""
        #: Whether the GUI thread is about to drain it: however much a robot sends, one job waits.
        self._is_posted = False
        self.received = self.dropped = 0
        #: Identity of the publisher of the last message; empty if the wire has none.
        self.publisher = b""
        #: Seconds by which the last message was delayed on its way.
        self.late = 0.0

    def receive(self, sample: Sample, late: float = 0.0) -> None:
        """Decode and queue a sample that was delayed by `late` seconds, in the node's thread."""

        def decode() -> Message:
            name = sample.type.name
            if self._types and ros1_name(name) not in self._types:
                raise Error(f"the topic's type is {name}, not {' or '.join(self._types)}")
            if self._eager:
                return sample.type.decode_all(sample.data, wire=sample.wire)
            return sample.message()

        self.publisher, self.late = sample.publisher, late
        self.put(decode, sample.type.name, len(sample.data))

    def put(self, decode: Callable[[], Message], what: str, size: int = 0) -> None:
        """Decode and queue a message, in the node's thread.

        Args:
            decode: Returns it.
            what: The name of its type.
            size: Its bytes.
        """
        item, error = None, ""
        try:
            message = decode()
            data = self.prepare(message)
            if data is not None:
                whole = getattr(data, "source", None)
                whole = message if whole is None else whole
                item = _Item(data, *frame_and_stamp(whole), size)
                if self._needs_frame and not item.frame and "header" in whole:
                    item = None
                    raise Error("header.frame_id is empty: the publisher has to name the frame")
        except Error as reason:
            error = str(reason)
        except Exception as reason:  # what peers send never ends the thread
            _log.exception("a %s", what)
            error = f"this message could not be shown: {reason!r}"
        with self._lock:
            is_posted, self._is_posted = self._is_posted, True
            self.received += 1
            self._error = error
            if item is not None:
                if getattr(item.data, "replaces_all", False):
                    self._items.clear()
                self._items.append(item)
                self.dropped += drop_oldest(self._items, self._depth, _size_of)
        if not is_posted:
            self._executor.post(self._on_ready)

    def drain(self) -> tuple[list[_Item], str]:
        """Return and forget what has arrived, and why the last message could not be used."""
        with self._lock:
            items, error = list(self._items), self._error
            self._items.clear()
            self._error, self._is_posted = "", False
        return items, error


class OneTopicDisplay(Display):
    """A display of one topic, with its settings in the files of either RViz.

    Attributes:
        MESSAGES: Names of the types that it shows, without ``msg/``.
        SUGGESTED: Those of topics that panels suggest for it, if these are fewer.
    """

    MESSAGES: ClassVar[tuple[str, ...]] = ()
    SUGGESTED: ClassVar[tuple[str, ...]] = ()

    topic = Setting("Topic", "topic", "", "Topic to subscribe to.", then="_on_topic")
    depth = Setting(
        "Topic/Depth", "int", 5, "Messages kept until their transform is known.", min=1, max=1000,
        then="_schedule",
    )  # fmt: skip

    #: How many messages were received.
    received = ReadOnly(int, 0)
    #: Whether the topic has had the time to be found.
    _is_searched = False
    #: The depth of a file, and the one that is used for it: RViz has no limit, and 0 for any.
    _depth_of_file: tuple[int | None, int | None] = (None, None)

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Take the settings of a file of either RViz, which write topics differently."""
        refused = super().load_settings({k: v for k, v in saved.items() if k != "Topic"})
        try:
            given = read_topic(saved)
            self._load_topic(given)
            if given.depth and given.depth != self.depth:
                text = f"Depth: {given.depth} is out of range; {self.depth} is used"
                refused.append(f"{text}, and the file keeps it")
        except Error as error:
            refused.append(str(error))
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz."""
        kept = super().save_settings({k: v for k, v in (older or {}).items() if k != "Topic"})
        topic = dict(older or {}).get("Topic")
        kept.pop("Topic", None)
        if topic is not None:
            kept["Topic"] = topic
        write_topic(kept, self._saved_topic(), ros)
        return kept

    def _load_topic(self, given: TopicSetting) -> None:
        self.set("Topic", given.name)
        if given.depth:
            limits = self.SETTINGS["Topic/Depth"].kind.options
            self.depth = min(max(given.depth, limits["min"]), limits["max"])
        self._depth_of_file = (given.depth, self.depth)

    def _saved_topic(self) -> TopicSetting:
        given, used = self._depth_of_file
        return TopicSetting(
            self.topic, self.depth if given is None or self.depth != used else given
        )

    def suggested(self, path: str) -> tuple[str, ...]:  # noqa: ARG002 - for subclasses
        """Return the types of the topics that panels suggest for a setting."""
        return self.SUGGESTED or self.MESSAGES

    def on_group_enabled(self) -> None:
        """Receive something, or nothing any more, as it or its group is shown or hidden."""
        super().on_group_enabled()
        if not self.shown:
            self._close_endpoint()  # not later: messages of it may be on their way
            self.reset()  # it would be old when the display is shown again

    def _find_topic(self) -> str:
        """Return the absolute name of the topic; empty, with a status, while there is none."""
        if self.node is None or not self.shown or self.scene is None:
            return ""
        if not self._topic:
            self.set_status("Topic", "warn", "no topic is chosen")
            return ""
        self._resolved = self._resolve(self._topic)
        if not self._resolved:
            self.set_status("Topic", "error", self._problem)
        return self._resolved

    def _begin_to_wait(self) -> None:
        """Say that nothing was received, and after a while that there is no publisher."""
        self._is_searched = False
        self.delete_status("Topic")
        self._report_waiting()
        self._expect_publishers()

    def _is_waiting(self) -> bool:
        """Return whether nothing was received yet."""
        line = self.status_lines.get("Topic")
        return self._endpoint is not None and (line is None or line.level != "ok")

    def _report_waiting(self) -> None:
        """Say in the status what is received, as long as that is nothing, and why."""
        if self._is_waiting():
            level, text = self._find_reason()
            if level == "error" and Status(level, text) != self.status_lines.get("Topic"):
                # For interfaces that show no status.
                self._log(f"{self._topic_in_logs()}: {text}", logging.WARNING)
            self.set_status("Topic", level, text)

    def _find_reason(self) -> tuple[str, str]:
        """Return why nothing was received: level and text."""
        node, session, topic = self.node, self._session, self._resolved
        text = f"No messages received on {topic}"
        if node is None or session is None or session.state != "connected":
            return "warn", text
        # The node may just have been closed.
        with suppress(Error):
            topics = node.topics()
            types = topics.get(topic, ())
            if types and self.MESSAGES and not set(map(ros1_name, types)) & set(self.MESSAGES):
                wanted = " or ".join(self.MESSAGES)
                return "error", f"the topic's type is {', '.join(types)}, not {wanted}"
            if self._is_searched and not self._count_publishers():
                text = f"{text}: it has no publisher{similar(topic, topics)}"
            elif problem := getattr(self._endpoint, "problem", ""):
                text = f"{text}: {problem}"
            elif self._count_publishers() and (hint := getattr(self._endpoint, "hint", "")):
                text = f"{text}: {hint}"
        return "warn", text

    def _topic_in_logs(self) -> str:
        return f"{self.label}: {self._resolved}"

    @Slot()
    def _log_no_publisher(self) -> None:
        super()._log_no_publisher()
        self._is_searched = True
        self._report_waiting()

    @Slot()
    def _on_graph(self) -> None:
        super()._on_graph()
        self._report_waiting()

    def _on_topic(self) -> None:
        self._topic = self.topic
        self._set_problem("")
        self._resolved = ""
        self._close_endpoint()  # not later: messages of it may be on their way
        self.clear_status()
        self.reset()
        self._schedule()


class TopicDisplay(OneTopicDisplay):
    """A display of the messages of one topic.

    Attributes:
        KEEPS_ALL: Whether each message counts, as for markers; otherwise the newest does.
        EAGER: Whether all fields of a message are decoded at once, which is faster if all are used.
        IS_CONTINUOUS: Whether publishers send all the time, unless they keep the last message for
            later subscribers; what is shown is out of date after 3 s without a message then, or
            after twice the time between messages.
    """

    KEEPS_ALL: ClassVar[bool] = False
    IS_CONTINUOUS: ClassVar[bool] = False
    #: Whether parts of a message have frames of their own, as markers do.
    HAS_FRAMES: ClassVar[bool] = False
    EAGER: ClassVar[bool] = False
    #: What is requested of the publishers of further topics: the settings are of the topic alone.
    FURTHER_QOS: ClassVar[QoS] = QoS(
        reliability=Reliability.BEST_AVAILABLE, durability=Durability.BEST_AVAILABLE
    )

    reliability = Setting(
        "Topic/Reliability Policy", "enum", BEST_AVAILABLE, "What publishers have to offer.",
        choices=list(_RELIABILITY), then="_schedule",
    )  # fmt: skip
    durability = Setting(
        "Topic/Durability Policy", "enum", BEST_AVAILABLE, "Whether earlier messages are wanted.",
        choices=list(_DURABILITY), then="_schedule",
    )  # fmt: skip

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._queue: MessageQueue | None = None
        self._waiting: deque[_Item] = deque()
        #: Whether the publisher or the connection of what is shown is gone.
        self._is_gone = False
        self._last: _Item | None = None
        #: The newest message, which may still wait for its transform.
        self._newest: _Item | None = None
        #: How many messages were dropped while they waited, and are missed.
        self._dropped = 0
        self._arrived = self._arrived_at = self._message_late = 0.0
        #: Seconds between the last messages.
        self._intervals = deque((0.0, 0.0), maxlen=2)
        super().__init__(parent, runtime)

    def _load_topic(self, given: TopicSetting) -> None:
        super()._load_topic(given)
        self.reliability = given.reliability or self.reliability
        self.durability = given.durability or self.durability

    def _saved_topic(self) -> TopicSetting:
        # What is ours alone, no RViz can read; without a policy, it is that again.
        reliability, durability = (
            "" if value == BEST_AVAILABLE else str(value)
            for value in (self.reliability, self.durability)
        )
        saved = super()._saved_topic()
        return saved._replace(reliability=reliability, durability=durability)

    # -- the subscription ------------------------------------------------------------------------

    def shows_all(self) -> bool:
        """Return whether each message is shown, in order, and not only the newest."""
        return self.KEEPS_ALL

    def most_waiting(self) -> int:
        """Return how many messages may wait for their transforms; older ones are dropped.

        So are those beyond 256 MiB.
        """
        return MOST_WAITING if self.shows_all() else int(self.depth)

    def _is_loss(self) -> bool:
        """Return whether what is dropped while it waits would have been shown."""
        return self.shows_all() and self.most_waiting() == MOST_WAITING

    def _on_length(self) -> None:
        """Show more or fewer messages beside each other."""
        self._restyle()
        self._schedule()  # one that shows each receives more

    def profile(self) -> QoS:
        """Return what is requested of publishers."""
        return QoS(
            depth=MOST_WAITING if self.shows_all() else self.depth,
            reliability=_RELIABILITY[self.reliability],
            durability=_DURABILITY[self.durability],
        )

    def _wanted(self) -> tuple[Any, ...] | None:
        topic = self._find_topic()
        return (self.node, (topic, *self.further_topics(topic)), self.profile()) if topic else None

    def further_topics(self, topic: str) -> tuple[str, ...]:  # noqa: ARG002 - for subclasses
        """Return topics that are received beside `topic`, e.g. of updates."""
        return ()

    def _resolve_further(self, path: str, topic: str) -> tuple[str, ...]:
        """Return the absolute name of a topic; none, with a status, for a name that is none.

        Args:
            path: The setting that names it.
            topic: The name; empty for no topic.
        """
        found = self._resolve(topic)
        if topic and not found:
            self.set_status(path, "error", self._problem)
            return ()
        self._set_problem("")
        self.delete_status(path)
        return (found,) if found else ()

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        node, (topic, *others), qos = wanted
        profiles = {**dict.fromkeys(others, self.FURTHER_QOS.with_depth(qos.depth)), topic: qos}
        queue = self._queue = MessageQueue(
            self.preparer(),
            self.MESSAGES,
            self._executor,
            weak_callback(self._on_items),
            MOST_WAITING if self.shows_all() else max(self.depth, 1),
            self.EAGER,
            needs_frame=not self.HAS_FRAMES,
        )
        return lambda: Subscriptions(node, profiles, queue)

    def _on_created(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._begin_to_wait()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._queue = None
        self._waiting.clear()

    def _on_create_failed(self, error: Error) -> None:
        self.set_status("Topic", "error", str(error))
        super()._on_create_failed(error)

    def _recheck_outdated(self) -> None:
        # The publisher that latched the message still exists and would have sent a newer one.
        queue, node, session = self._queue, self.node, self._session
        if queue is None or not queue.received or node is None or session is None:
            return
        if session.state != "connected":
            return
        if self._is_latched():
            self._outdated = False
            self._show_age()

    def _is_latched(self) -> bool:
        """Return whether the publisher of the last message keeps it for later subscribers."""
        queue, node = self._queue, self.node
        if queue is None or node is None:
            return False
        try:
            publishers = node.publishers(self._resolved)
        except Error:
            return False
        known = any(one.gid for one in publishers)
        return any(
            one.qos.durability is Durability.TRANSIENT_LOCAL
            and (one.gid == queue.publisher or not known)
            for one in publishers
        )

    def _outdated_after_s(self) -> float:
        """Return after how many seconds without a message the last one is out of date."""
        if not self.IS_CONTINUOUS or self._is_latched():
            return math.inf
        # Maps are sent as clouds as well, every few seconds.
        return max(_CONTINUOUS_S, 2 * min(self._intervals))

    def _seconds_without_message(self) -> float:
        seconds, scene = self._steady() - self._arrived_at, self.scene
        return seconds if scene is None else min(seconds, scene.seconds_running())

    def _update_stale(self) -> None:
        super()._update_stale()
        self._show_age()

    def _is_old(self) -> bool:
        return self._last is None

    def _show_age(self) -> None:
        """Fade data that is out of date, and say so."""
        reason = ""
        if self._last is not None and self.enabled:
            seconds = self._seconds_without_message()
            if self._outdated:
                reason = "its publisher is gone"
            elif seconds > _CONTINUOUS_S and seconds > self._outdated_after_s():
                reason = f"no message for {seconds:.0f} s that could be shown"
            elif self._message_late + seconds > max(_CONTINUOUS_S, self._outdated_after_s()):
                reason = f"the newest message was {self._message_late:.0f} s late"
            elif self._is_late():
                reason = "the transform of the newest message is not known"
        self._is_gone = bool(reason)
        self._fade()
        if reason:
            when = time.strftime("%H:%M:%S", time.localtime(self._arrived))
            self.set_status("Data", "warn", f"{reason}; the last message is of {when}")
        else:
            self.delete_status("Data")

    def _is_late(self) -> bool:
        """Return whether the newest message has waited for its transform for long."""
        newest, scene = self._newest, self.scene
        if scene is None or newest is None or not self._waiting or self._waiting[-1] is not newest:
            return False
        # While a simulation or recording is paused, nothing is late.
        # What is stamped ahead, by a clock that has jumped, waits in vain as well.
        age_s = abs(scene.now() - newest.stamp) * 1e-9 if newest.stamp else math.inf
        return min(age_s, time.monotonic() - self._placed_at) > _LATE_S

    def check_frames(self) -> None:
        """Say why nothing is received or shown, and try again to place what is late."""
        self._report_waiting()
        if self.shown and self._is_late():
            self._show_waiting()
        super().check_frames()

    def _fade(self) -> None:
        faded = self._is_gone or self._outdated_frames
        self.root.alpha = OUTDATED_ALPHA if faded else 1.0

    # -- messages --------------------------------------------------------------------------------

    def preparer(self) -> Callable[[Message], Any]:
        """Return a function that decodes a message, for the node's thread.

        It must not refer to the display, only to values of its settings. It returns None where
        there is nothing to show yet. The attribute `source` of what it returns, if there is one, is
        the message whose frame and time count.
        """
        return lambda message: message

    def _renew_preparer(self) -> None:
        """Let further messages be decoded by changed settings, or for another renderer."""
        if self._queue is not None:
            self._queue.prepare = self.preparer()

    def _on_items(self) -> None:
        if not is_alive(self):  # it has no attributes then
            return
        queue = self._queue
        if queue is None or self.scene is None:
            return
        items, error = queue.drain()
        report(self, received=queue.received)
        if error:
            self.set_status("Message", "error", error)
        elif items:
            self.delete_status("Message")
        if items or error:
            self.set_status("Topic", "ok", f"{queue.received} messages received")
        if not items:
            return
        now = self._steady()
        self._intervals.append(now - self._arrived_at)
        self._arrived, self._arrived_at, self._message_late = time.time(), now, queue.late
        self._newest = items[-1]
        self._outdated = False
        self._waiting.extend(items)
        self._show_waiting()
        self._drop_oldest(queue)

    def _drop_oldest(self, queue: MessageQueue) -> None:
        """Drop what waits beside newer messages, and say so if it is missed."""
        most, before = self.most_waiting(), len(self._waiting)
        count = drop_oldest(self._waiting, most, _size_of)
        if self._is_loss() or (self.shows_all() and before <= most):
            self._dropped += count
        dropped = []
        if queue.dropped and self.shows_all():
            dropped.append(f"{queue.dropped} that came faster than they can be shown")
        if self._dropped:
            limit = f"{most}, or {_MAX_WAITING_BYTES >> 20} MiB,"
            dropped.append(f"{self._dropped} while more than {limit} waited for their transforms")
        if dropped:
            self.set_status("Dropped messages", "warn", "; ".join(dropped))

    def _show_waiting(self) -> None:
        """Show what waits for its transform, as far as it is known now."""
        if not self.shows_all():
            # The newest that can be placed; older ones are of no use then.
            for at in range(len(self._waiting) - 1, -1, -1):
                pose = self._place(self._waiting[at])
                if pose is not None:
                    item = self._waiting[at]
                    for _ in range(at + 1):
                        self._waiting.popleft()
                    self._show(item, pose)
                    return
            return
        self._show_all_waiting()

    def _show_all_waiting(self) -> None:
        waiting = list(self._waiting)
        poses: dict[int, NDArray[np.float64]] = {}
        # Lookups that fail take their time; those at one end may fail for ever.
        for order in (range(len(waiting)), range(len(waiting) - 1, -1, -1)):
            misses = 0
            for at in order:
                if at in poses or misses >= _MOST_MISSES:
                    break
                pose = self._place(waiting[at])
                if pose is None:
                    misses += 1
                else:
                    poses[at] = pose
        self._waiting = deque(item for at, item in enumerate(waiting) if at not in poses)
        for at in sorted(poses):
            self._show(waiting[at], poses[at])

    def _place(self, item: _Item) -> NDArray[np.float64] | None:
        """Return the pose of a message's frame at its time; None while it is not known."""
        return self.place_of(item.frame, item.stamp)

    def _show(self, item: _Item, pose: NDArray[np.float64]) -> None:
        self._last = item
        self.root.visible = self.enabled
        try:
            self.show(item.data, pose, item.frame, item.stamp)
        except Error as error:
            self.set_status("Message", "error", str(error))
        except Exception as error:
            _log.exception("%s", self.label)
            self.set_status("Message", "error", f"this message could not be shown: {error!r}")
        self._show_age()

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:
        """Show a message.

        Args:
            data: What :meth:`preparer` has made of it.
            pose: Of its frame in the fixed frame, at its time.
            frame: Its frame.
            stamp: Its time in nanoseconds; 0 for the newest.

        Raises:
            Error: It cannot be shown; the text becomes the status.
        """
        raise NotImplementedError

    def on_transforms(self) -> None:
        """Show what has waited for transforms, and what another fixed frame has hidden."""
        if self.enabled and not self.root.visible:
            self._place_last()
        if self._waiting:
            self._show_waiting()

    def on_fixed_frame(self) -> None:
        """Show the last message in the new fixed frame; where earlier ones are is not known."""
        if self.shows_all():
            last, waiting = self._last, list(self._waiting)
            newest = self._newest
            self.reset()
            self._last, self._newest = last, newest
            self._waiting.extend(waiting)
        self._place_last()
        self._show_waiting()

    def _place_last(self) -> None:
        """Show the last message in this fixed frame; hide it while its frame is not known there."""
        last = self._last
        if last is None:
            return
        pose = self._place(last)
        if pose is None:
            # At its time it is not known any more: rather the newest than a wrong place.
            pose = self.place_of(last.frame, 0)
        self.root.visible = self.enabled and pose is not None
        if pose is not None:
            self._show(last, pose)

    def reset(self) -> None:
        """Drop all messages."""
        self._waiting.clear()
        self._last = self._newest = None
        self._dropped = 0
        self.delete_status("Dropped messages")
        self.root.clear()


class Subscriptions:
    """The subscriptions of a display, all of which feed the same queue.

    Args:
        node: The node.
        profiles: What is requested of publishers, by the absolute name of their topic.
        queue: Receives all messages.

    Raises:
        Error: One of them could not be made.
    """

    def __init__(self, node: Node, profiles: Mapping[str, QoS], queue: MessageQueue) -> None:
        self._open: list[Any] = []
        try:
            for topic, qos in profiles.items():
                self._open.append(self._subscribe(node, topic, qos, queue))
        except Error:
            self.close()
            raise

    @staticmethod
    def _subscribe(node: Node, topic: str, qos: QoS, queue: MessageQueue) -> Any:
        made: list[Any] = []

        def on_sample(sample: Sample) -> None:
            # The first may arrive before the subscription is returned.
            queue.receive(sample, made[0].lateness(sample).seconds if made else 0.0)

        made.append(node.create_subscription(topic, None, qos=qos, raw_callback=on_sample))
        return made[0]

    @property
    def problem(self) -> str:
        """Why messages cannot be received, e.g. by their publishers' policies; empty otherwise."""
        return "; ".join(filter(None, (one.problem for one in list(self._open))))

    @property
    def hint(self) -> str:
        """What may be missing, e.g. that earlier messages are kept which were not asked for."""
        return "; ".join(filter(None, (one.hint for one in list(self._open))))

    def close(self) -> None:
        """Close them; safe to call twice."""
        while self._open:
            self._open.pop().close()
