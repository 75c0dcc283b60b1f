"""The base class of displays: settings, status, frames, and the life in a scene.

A display is a QML object inside a ``SceneView``, or is added with ``view.scene.add``. It fills its
:attr:`Display.root` with drawables (:mod:`rosglass.scene.render.drawing`). One that shows messages
derives from :class:`~rosglass.scene.displays.topic_display.TopicDisplay`.
"""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import logging
import math
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from rosglass.comm.names import similar
from rosglass.errors import ArgumentError, Error, TransformException
from rosglass.interfaces.names import ros1_name
from rosglass.qml.elements.element import TopicElement, single_shot
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QtQml, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import FIXED_FRAME, TopicSetting, read_topic, write_topic
from rosglass.scene.configs.settings import Configurable, Setting
from rosglass.scene.displays.declared import expect_view, find_view
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from rosglass.qml.engine.log import Caller
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.displays.parts import Parts
    from rosglass.scene.displays.scene_frames import SceneFrames

__all__ = ["LATE_S", "OUTDATED_ALPHA", "Display", "Status"]


_LEVELS = ("ok", "warn", "error")

#: Seconds for which data may wait for its transform before that is an error.
LATE_S = 1.0

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


class Display(Configurable, TopicElement):
    """Something that a scene shows.

    Attributes:
        TYPE: Its name in RViz, e.g. ``Grid``.
        MESSAGES: Names of the message types that it shows, without ``msg/``.
        SUGGESTED: Those of topics that panels suggest for it, if these are fewer.
        TOPIC_KEYS: Entries of a file that name its topic; empty for a display without the settings
            `topic` and `depth`.
        root: Its drawables, in the fixed frame.
    """

    TYPE: ClassVar[str] = ""
    SETTINGS: ClassVar[dict[str, Setting]] = {}
    MESSAGES: ClassVar[tuple[str, ...]] = ()
    SUGGESTED: ClassVar[tuple[str, ...]] = ()
    TOPIC_KEYS: ClassVar[tuple[str, ...]] = ()

    nameChanged = Signal()
    statusChanged = Signal()

    #: Its name in the Displays panel; that of its type until it is set.
    name = Writable(str, read=lambda self: self._name or self.TYPE, write="_set_name")
    enabled = Writable(bool, True, then="_on_enabled")
    #: ``ok``, ``warn`` or ``error``: the worst of its lines.
    statusLevel = ReadOnly(str, "ok", notify="statusChanged")
    #: All lines, each with its name.
    statusText = ReadOnly(str, "", notify="statusChanged")

    if TYPE_CHECKING:
        topic: Any
        depth: Any
    #: Whether the topic has had the time to be found.
    _is_searched = False
    #: The depth of a file, and the one that is used for it: RViz has no limit, and 0 for any.
    _depth_of_file: tuple[int | None, int | None] = (None, None)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self.root = Group()
        self.scene: SceneFrames | None = None
        #: True once it was removed and waits to be destroyed.
        self._is_removed = False
        self.status_lines: dict[str, Status] = {}
        self._name = ""
        #: The display's entry in a ``.rviz`` file.
        self.saved: dict[str, Any] = {}
        #: When a frame was found last, by the clock of :func:`time.monotonic`.
        self._placed_at = -math.inf
        #: Lines of the status whose error was logged.
        self._logged: set[str] = set()
        #: Followed frames that are no longer updated, and for how many seconds.
        self._outdated_frames: dict[str, float] = {}
        #: The parts that are shown and hidden one by one; None without any.
        self.parts: Parts | None = None
        #: Parts that QML has switched before they were known, and the caller.
        self._switched_parts: dict[str, Caller] = {}
        #: The group that it is in; None without one.
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

    def join(self, scene: SceneFrames) -> None:
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
        """True while it and its groups are enabled."""
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
        """Fade parts whose frames are no longer updated; called by the scene."""
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
            why = f"no transform received for {frames[worst]:.0f} s"
        more = f"[{worst}]" if len(frames) == 1 else f"[{worst}] and {len(frames) - 1} more"
        self.set_status("Frame", "warn", f"{more} may be somewhere else: {why}")

    def _fade(self) -> None:
        """Draw outdated parts faded."""
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
        """Return the meaning of an empty setting, for panels; empty without one."""
        return ""

    # -- status ----------------------------------------------------------------------------------

    def set_status(self, name: str, level: str, text: str) -> None:
        """Set a line of the status.

        Args:
            name: Name of the line, e.g. ``Topic``.
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
        """Log errors that have lasted, once: an interface in QML may show no status."""
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

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file of either RViz, which write topics differently."""
        keys = self.TOPIC_KEYS
        refused = super().load_settings({k: v for k, v in saved.items() if k not in keys})
        if keys:
            try:
                refused += self._load_topic(saved)
            except Error as error:
                refused.append(str(error))
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz."""
        keys, before = self.TOPIC_KEYS, older or {}
        topic = {key: before[key] for key in keys if before.get(key) is not None}
        kept = super().save_settings({k: v for k, v in before.items() if k not in keys}, ros)
        if keys:
            for key in keys:
                kept.pop(key, None)
            self._save_topic(kept, topic, ros)
        return kept

    def _load_topic(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the topic in a file, with its settings; return what does not fit.

        Raises:
            Error: The file does not say which topic.
        """
        given = read_topic(saved)
        self.set("Topic", given.name)
        if given.depth:
            limits = self.SETTINGS["Topic/Depth"].kind.options
            self.depth = min(max(given.depth, limits["min"]), limits["max"])
        self._depth_of_file = (given.depth, self.depth)
        if given.depth and given.depth != self.depth:
            text = f"Depth: {given.depth} is out of range; {self.depth} is used"
            return [f"{text}, and the file keeps it"]
        return []

    def _save_topic(self, kept: dict[str, Any], before: Mapping[str, Any], ros: int) -> None:
        """Write the topic for a file of one RViz, beside what the file had."""
        kept.update(before)
        write_topic(kept, self._saved_topic(), ros)

    def _saved_topic(self) -> TopicSetting:
        given, used = self._depth_of_file
        depth = self.depth if given is None or self.depth != used else given
        return TopicSetting(self.topic, depth)

    # -- the topic, of displays that have one ----------------------------------------------------

    def suggested(self, path: str) -> tuple[str, ...]:  # noqa: ARG002 - for subclasses
        """Return the types of the topics that panels suggest for a setting."""
        return self.SUGGESTED or self.MESSAGES

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
        """Report that nothing was received, and after a while that there is no publisher."""
        self._is_searched = False
        self.delete_status("Topic")
        self._report_waiting()
        self._expect_publishers()

    def _is_waiting(self) -> bool:
        """Return whether nothing was received yet."""
        line = self.status_lines.get("Topic")
        is_open = bool(self.TOPIC_KEYS) and self._endpoint is not None
        return is_open and (line is None or line.level != "ok")

    def _report_waiting(self) -> None:
        """Report in the status that nothing is received, and why."""
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
            if not stamp or time.monotonic() - self._placed_at > LATE_S:
                self.set_status(status, "error", f"no transform from [{frame}]: {error}")
            return None
        self._placed_at = time.monotonic()
        self.set_status(status, "ok", "Transform OK")
        return found
