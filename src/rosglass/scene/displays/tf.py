"""The display TF: the robot's frames, their names and parents."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import math
import time
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from rosglass.errors import Error
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import QtCore, Signal, Slot
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.display import OUTDATED_ALPHA, Display
from rosglass.scene.displays.parts import Parts
from rosglass.scene.displays.shapes import ArrowShapes, AxesShapes
from rosglass.scene.render.drawing import Labels
from rosglass.scene.render.matrices import pose_along, stack_poses

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

    from rosglass.errors import TransformException
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.tf import FrameInfo, FrameTree

__all__ = ["TFDisplay"]

#: Frames that are shown, frames of which these are chosen, and lines of the status about them.
_MAX_FRAMES, _MAX_NAMES, _MAX_LINES = 2000, 10_000, 20
#: Steps after which a filter is given up for a name, and letters of names that it is for.
_MAX_STEPS, _MAX_LETTERS = 10_000, 200
_FILTERS = ("Filter (whitelist)", "Filter (blacklist)")
#: Sizes in RViz at a marker scale of 1, metres.
_AXIS_M, _AXIS_RADIUS_M, _NAME_M = 0.2, 0.02, 0.1
_SHAFT_M, _HEAD_M, _HEAD_WIDTH_M = 0.01, 0.1, 0.04
_SHAFT_COLOR, _HEAD_COLOR = (0.8, 0.8, 0.3, 1.0), (1.0, 0.1, 0.6, 1.0)
#: Seconds for which the status says that a transform was refused.
_REFUSED_S = 10.0
#: Seconds between two looks at frames that are not updated any more.
_LOOK_S = 0.5
#: How many times as long as drawing took is left until it is drawn again.
_PAUSE = 4
#: The share of its timeout after which a frame begins to fade.
_FADE_AFTER = 1 / 3


class _Frame(NamedTuple):
    """A frame that is shown.

    Attributes:
        name: Its name.
        pose: In the fixed frame.
        share: Its opacity: less than 1 once it is not updated any more.
        parent: Its parent's name.
    """

    name: str
    pose: NDArray[np.float64]
    share: float
    parent: str


def _filter_of(pattern: str) -> Callable[[str], bool | None]:
    """Return a function that says whether a name of a frame has a match; None if that takes long.

    By Qt's regular expressions, whose steps can be limited: the names are the robot's, and with
    some expressions a name of 30 letters keeps Python's ``re`` busy for hours.

    Raises:
        Error: The pattern is not a regular expression.
    """
    limit = f"(*LIMIT_MATCH={_MAX_STEPS})"
    regex = QtCore.QRegularExpression(limit + pattern)
    if not regex.isValid():
        at = regex.patternErrorOffset() - len(limit)
        raise Error(f"this is not a regular expression: {regex.errorString()}, at letter {at + 1}")

    @lru_cache(2 * _MAX_NAMES)
    def matches(name: str) -> bool | None:
        if len(name) > _MAX_LETTERS:
            return None
        found = regex.match(name)
        return found.hasMatch() if found.isValid() else None

    return matches


class TFDisplay(Display):
    """The frames of the robot. See its page in ``docs/scene.md``."""

    TYPE = "TF"

    showNames = Setting("Show Names", "bool", True, "Show the names of frames.")
    showAxes = Setting("Show Axes", "bool", True, "Show the axes of frames.")
    showArrows = Setting("Show Arrows", "bool", True, "Show arrows to parents.")
    markerScale = Setting(
        "Marker Scale", "float", 1.0, "Size of names, axes and arrows.", min=0.0, max=1e6
    )
    markerAlpha = Setting("Marker Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    updateInterval = Setting(
        "Update Interval", "float", 0.0, "Seconds; 0 for every change.", min=0.0
    )
    frameTimeout = Setting(
        "Frame Timeout", "float", 15.0, "Seconds until a frame without updates is hidden.", min=1.0
    )  # fmt: skip
    whitelist = Setting("Filter (whitelist)", "string", "", "Regular expression of frames to show.")
    blacklist = Setting("Filter (blacklist)", "string", "", "Regular expression of frames to hide.")
    allEnabled = Setting(
        "Frames/All Enabled", "bool", True, "Show or hide all existing frames.",
        then="_on_all_enabled",
    )  # fmt: skip

    framesChanged = Signal()
    #: Names of the frames that are shown.
    frames: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._axes, self._arrows = AxesShapes(self), ArrowShapes(self)
        self._names = Labels(align="below")
        #: When frames were looked at last, and the seconds that this took.
        self._looked_at, self._took_s = -math.inf, 0.0
        #: Whether a frame is not static: it fades without a transform.
        self._moves = False
        #: Whether the robot is not connected: all fade then.
        self._is_lost = False
        #: Those that are set, and the names that take them too long.
        self._filters: dict[str, Callable[[str], bool | None]] = {}
        self._undecided: dict[str, list[str]] = {}
        #: The drawn state, to avoid drawing without a change.
        self._drawn: Any = None
        #: How many transforms were refused, and when the last one was.
        self._refused, self._refused_at = 0, 0.0
        #: Lines of the status about frames.
        self._lines: set[str] = set()
        #: The state of the transforms then.
        self._rest: object = None
        super().__init__(parent, runtime)
        self.parts: Parts = Parts(
            "Frames",
            lambda: self.scene.frames() if self.scene is not None else (),
            self._on_frames_switched,
            describe=self._describe,
            as_mapping=True,
        )
        self.root.add(self._axes, self._arrows, self._names)

    def leave(self) -> None:
        """Stop being shown."""
        super().leave()
        self.root.add(self._axes, self._arrows, self._names)

    @Slot(str, bool)
    def setFrameEnabled(self, frame: str, enabled: bool) -> None:  # noqa: N802 - QML's name
        """Show or hide one frame."""
        self.parts.set_enabled(frame, enabled)

    def _describe(self, frame: str) -> Iterator[tuple[str, str]]:
        buffer = self.scene.transforms if self.scene is not None else None
        info = buffer.frame(frame) if buffer is not None else None
        if info is not None:
            yield "Parent", info.parent or "none"
        yield from self.describe_frame(frame)

    def _on_all_enabled(self) -> None:
        # As in RViz, frames that come later are shown.
        self.parts.set_all(self.allEnabled)

    def _on_frames_switched(self) -> None:
        if self.allEnabled and not all(map(self.parts.is_enabled, self.parts.names())):
            # Only says so: it switches no frame.
            self._allEnabled = False
            self.allEnabledChanged.emit()  # type: ignore[attr-defined]
        self._draw()

    def load_settings(self, saved: Any) -> list[str]:
        """Apply the settings in a file, and the visibility of frames."""
        refused = super().load_settings(saved) + self.parts.load(saved)
        self._draw()
        return refused

    def save_settings(self, older: Any = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file, with the frames that are shown."""
        kept = super().save_settings(older, ros)
        self.parts.save(kept)
        return kept

    def _restyle(self) -> None:
        self._filters.clear()
        for path in _FILTERS:
            pattern = self.get(path)
            self.delete_status(path)
            try:
                if pattern:
                    self._filters[path] = _filter_of(pattern)
            except Error as error:
                self.set_status(path, "error", str(error))
        self._draw()

    def on_transforms(self) -> None:
        """Follow the frames."""
        buffer = None if self.scene is None else self.scene.transforms
        if buffer is not None and self._rest is not None and self._rest == buffer.rest():
            return  # what fades is looked at without a transform
        self._draw_after(0.0)

    def _draw_after(self, seconds: float) -> None:
        """Draw the frames, unless that was done less than so long or the Update Interval ago.

        Many frames take long: the rest of the interface has most of the time.
        """
        pause = max(seconds, self.updateInterval, _PAUSE * self._took_s)
        if time.monotonic() - self._looked_at - self._took_s >= pause:
            self._draw()

    def on_fixed_frame(self) -> None:
        """Place the frames in the new fixed frame, also while none moves."""
        self._draw()

    def check_frames(self) -> None:
        """Fade all frames while the robot is not connected, and say what was refused."""
        self._report_refused()
        why = self._disconnected() if self.shown and self.frames else ""
        self._is_lost = bool(why)
        if why:
            # Their own timeouts count again once it is.
            self.set_status("Connection", "warn", f"frames may be somewhere else: {why}")
        else:
            self.delete_status("Connection")
        self.root.alpha = OUTDATED_ALPHA if why else 1.0

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        if self.shown and self._moves:
            # Frames that are not updated any more fade without a transform.
            self._draw_after(_LOOK_S)
        elif self.shown:
            self.on_transforms()  # what came during the Update Interval, as the last one

    def _report_refused(self) -> None:
        """Report the last refused transform, while there are any."""
        buffer = self.scene.transforms if self.scene is not None else None
        if buffer is None or not self.shown:
            return
        ignored, now = buffer.ignored, time.monotonic()
        count = sum(ignored.values()) - ignored["old"] - ignored["repeated"]
        if count != self._refused:
            self._refused, self._refused_at = count, now
        if count and now - self._refused_at < _REFUSED_S:
            text = f"{count} were refused; the last one: {buffer.last_fault}"
            self.set_status("Refused", "warn", text)
        else:
            self.delete_status("Refused")

    def _is_chosen(self, name: str) -> bool:
        if not self.parts.is_enabled(name):
            return False
        whitelist, blacklist = (self._matches(path, name) for path in _FILTERS)
        return whitelist is not False and not blacklist

    def _matches(self, path: str, name: str) -> bool | None:
        """Return whether a filter has a match in a name; None if it is not known, or not set."""
        matches = self._filters.get(path)
        found = None if matches is None else matches(name)
        if matches is not None and found is None:
            self._undecided.setdefault(path, []).append(name)
        return found

    def _report_undecided(self) -> None:
        for path in self._filters:
            names = self._undecided.get(path)
            if names:
                more = f" and {len(names) - 1} more" if len(names) > 1 else ""
                text = f"it takes too long for [{names[0]}]{more}, to which it is not applied"
                self.set_status(path, "warn", f"{text}; write a simpler expression")
            else:
                self.delete_status(path)

    def _draw(self) -> None:
        scene = self.scene
        buffer = scene.transforms if scene is not None else None
        if scene is None or buffer is None or not self.shown:
            return
        self._rest, self._looked_at = buffer.rest(), time.monotonic()
        names = buffer.frame_names()
        self._undecided.clear()
        chosen = [name for name in sorted(names[:_MAX_NAMES]) if self._is_chosen(name)]
        self._report_undecided()
        if len(chosen) > _MAX_FRAMES or len(names) > _MAX_NAMES:
            del chosen[_MAX_FRAMES:]
            text = f"only {len(chosen)} of {len(names)} frames are shown"
            self.set_status("Frames", "warn", text)
        else:
            self.delete_status("Frames")
        tree = buffer.tree(chosen)
        poses, unknown = scene.look_up_all(chosen)
        shown: list[_Frame] = []
        self._report_unknown(unknown)
        shares = self._shares(tree)
        self._report_outdated([name for name, share in shares.items() if share < 1])
        for name, pose in zip(chosen, poses, strict=True):
            if name in unknown or name not in tree:
                continue
            shown.append(_Frame(name, pose, shares[name], tree[name].parent))
        self._moves = any(frame.parent and not tree[frame.name].static for frame in shown)
        shown = [frame for frame in shown if frame.share > 0]
        self._fill(shown)
        names = [frame.name for frame in shown]
        if names != self.frames:
            report(self, frames=names)
        self._took_s = time.monotonic() - self._looked_at

    def _report_unknown(self, unknown: Mapping[str, TransformException]) -> None:
        """Report frames without a transform, a line for each of the first ones."""
        lines = {name: f"no transform: {unknown[name]}" for name in list(unknown)[:_MAX_LINES]}
        if len(unknown) > _MAX_LINES:
            lines["Transforms"] = f"{len(unknown)} frames have no transform"
        for line in self._lines - lines.keys():
            self.delete_status(line)
        for line, text in lines.items():
            self.set_status(line, "warn", text)
        self._lines = set(lines)

    def _report_outdated(self, names: list[str]) -> None:
        if names:
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            text = f"[{names[0]}]{more} may be somewhere else: no transform received for a while"
            self.set_status("Updates", "warn", text)
        else:
            self.delete_status("Updates")

    def _shares(self, tree: FrameTree) -> dict[str, float]:
        """Return the opacity of each frame: that of the least updated one above it.

        A frame that is fixed on another one is where that is. What is above the fixed frame does
        not count.
        """
        shares: dict[str, float] = {}
        fixed = "" if self.scene is None else self.scene.fixed_frame
        if fixed in tree:
            shares[fixed] = 1.0
        for name in tree:
            way, one = [], name
            while one in tree and one not in shares:
                way.append(one)
                shares[one] = 1.0 if self._is_lost else self._share(tree[one])
                one = tree[one].parent
            share = shares.get(one, 1.0)
            for frame in reversed(way):
                share = shares[frame] = min(share, shares[frame])
        return shares

    def _share(self, info: FrameInfo) -> float:
        """Return the opacity of a frame by its age: 1 while it is updated, 0 after the timeout."""
        if info.static or not info.parent:
            return 1.0
        scene = self.scene
        seconds = min(info.silence, math.inf if scene is None else scene.seconds_running())
        left = (self.frameTimeout - seconds) / (self.frameTimeout * (1 - _FADE_AFTER))
        return float(min(max(left, 0.0), 1.0))

    def _fill(self, frames: list[_Frame]) -> None:
        names = [frame.name for frame in frames]
        poses = stack_poses([frame.pose for frame in frames])
        shares = np.round([frame.share for frame in frames], 2)
        scale, alpha = self.markerScale, self.markerAlpha
        looks = (scale, alpha, self.showNames, self.showAxes, self.showArrows)
        parents = [frame.parent for frame in frames]
        drawn = (names, parents, poses.tobytes(), shares.tobytes(), looks)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        self._axes.visible = self.showAxes
        self._arrows.visible = self.showArrows
        self._names.visible = self.showNames
        self._axes.set_axes(poses, _AXIS_M * scale, _AXIS_RADIUS_M * scale, alpha * shares)
        at = poses[:, :3, 3] if len(poses) else np.zeros((0, 3))
        tint = np.ones((len(names), 4), np.float32)
        tint[:, 3] = shares * alpha
        self._names.set_texts(names, at, _NAME_M * scale, tint if names else (1, 1, 1, 1))
        where = {name: index for index, name in enumerate(names)}
        pairs = [(where[f.name], where[f.parent]) for f in frames if f.parent in where]
        arrows, lengths, opacities = [], [], []
        for child, parent in pairs:
            way = at[parent] - at[child]
            length = float(np.linalg.norm(way))
            if length > 1e-4:
                arrows.append(pose_along(way / length, at[child]))
                lengths.append(length)
                opacities.append(alpha * shares[child])
        far = np.array(lengths)
        head = np.minimum(_HEAD_M * scale, far)
        self._arrows.set_arrows(
            np.array(arrows).reshape(-1, 4, 4),
            (far - head, _SHAFT_M * scale),
            (head, _HEAD_WIDTH_M * scale),
            _with_alpha(_SHAFT_COLOR, opacities),
            _with_alpha(_HEAD_COLOR, opacities),
        )


def _with_alpha(color: tuple[float, ...], opacities: list[float]) -> NDArray[np.float64]:
    """Return a colour with each opacity, (n, 4)."""
    out = np.tile(np.array(color), (max(len(opacities), 1), 1))
    out[: len(opacities), 3] = opacities
    return out
