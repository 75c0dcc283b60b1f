"""The element ``TfRows``: the frames of the robot as a tree, with the age of each transform."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.lists.texts import bounded, copy_text
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS
from rosglass.qml.elements.tf_buffer import TfBuffer
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rosglass.errors import Error
    from rosglass.tf import FrameInfo, TransformBuffer

__all__ = ["TfRows"]

#: Frames that are shown at once.
_MAX_FRAMES = 2000
#: Ticks of the session, ten per second, between two updates.
_TICKS = 5
_ROLES = ("key", "name", "depth", "folds", "open", "parentFrame", "authority", "isStatic", "age",
          "rate", "isOld", "fault")  # fmt: skip


class TfRows(TfBuffer):
    """The frames of the robot as the rows of a tree. See its page in ``docs/controls``."""

    #: Text that names of frames contain; empty for all frames.
    filter = Writable(str, "", then="_show")
    #: Milliseconds after which a transform that is not static is old; 0 for never.
    timeout = Writable(int, DEFAULT_TIMEOUT_MS, at_least(0), then="_show", unit="ms")
    #: The rows, for a ListView.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: Frames that match, and all frames.
    count = ReadOnly(int, 0)
    total = ReadOnly(int, 0)
    #: Number of frames with two parents or in a cycle, and of old transforms.
    faults = ReadOnly(int, 0)
    old = ReadOnly(int, 0)
    #: Whether there are no frames, or the robot is not connected.
    stale = ReadOnly(bool, True)

    _HOLDS = (*TfBuffer._HOLDS, "_model", "_tree")

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._model = RowModel(self, _ROLES)
        self._folded: set[str] = set()
        self._ticks = 0
        self._tree = _Tree({}, {}, 0)
        self._looking = False

    def _on_tree(self) -> None:
        super()._on_tree()
        # Frames that appear together are shown together.
        self._ticks = _TICKS

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        self._ticks += 1
        if self._ticks >= _TICKS:
            self._look()

    def _get_problem(self) -> str:
        wrong = self._disconnected() if self._session is not None else ""
        return wrong or super()._get_problem()

    @Slot()
    def _on_connection(self) -> None:
        super()._on_connection()
        self._announce_problem()
        self._look()

    @Slot(str)
    def toggle(self, key: str) -> None:
        """Fold or unfold a frame."""
        self._folded.symmetric_difference_update({key})
        self._show()

    @Slot(str)
    def copy(self, key: str) -> None:
        """Copy the name of a frame."""
        copy_text(key)

    # -- the tree --------------------------------------------------------------------------------

    @Slot()
    def _look(self) -> None:
        """Read the tree on the worker thread, as names of publishers are looked up in the graph."""
        self._ticks = 0
        buffer = self._endpoint.link.buffer if self._endpoint is not None else None
        if buffer is None or self._session is None:
            self._tree = _Tree({}, {}, 0)
            self._show()
        elif not self._looking:
            self._looking = True
            self._session.background(lambda: _read(buffer), weak_callback(self._on_looked))

    def _on_looked(self, result: _Tree | Error) -> None:
        if not is_alive(self):
            return
        self._looking = False
        if isinstance(result, _Tree) and self._endpoint is not None:
            self._tree = result
            self._show()

    def _show(self) -> None:
        frames, faults, total = self._tree
        text = self.filter.strip().lower()
        matching = [name for name in frames if text in name.lower()]
        shown = _with_parents(frames, matching) if text else set(frames)
        rows: dict[str, dict[str, Any]] = {}
        self._collect(_children(frames, shown), frames, faults, bool(text), rows)
        if total > len(frames):
            rows["#more"] = _row(f"and {total - len(frames):,} more frames")
        self._model.show(rows)
        report(
            self,
            count=len(matching) if text else total,
            total=total,
            faults=sum(name in frames for name in faults),
            old=sum(self._is_old(frame) for frame in frames.values()),
            stale=total == 0 or self._disconnected() != "",
        )

    def _is_old(self, frame: FrameInfo) -> bool:
        is_moving = frame.parent != "" and not frame.static
        return is_moving and self.timeout > 0 and frame.silence * 1000 > self.timeout

    def _collect(
        self,
        children: Mapping[str, list[str]],
        frames: Mapping[str, FrameInfo],
        faults: Mapping[str, str],
        unfolded: bool,
        rows: dict[str, dict[str, Any]],
    ) -> None:
        """Add the rows of all frames; not by recursion, as a tree may be 1,000 frames deep."""
        waiting = [(name, 0) for name in reversed(children.get("", []))]
        while waiting:
            name, depth = waiting.pop()
            frame, below = frames[name], children.get(name, [])
            is_open = unfolded or name not in self._folded
            is_moving = frame.parent != "" and not frame.static
            rows[name] = _row(
                bounded(name), depth=depth, folds=bool(below), open=is_open,
                parentFrame=bounded(frame.parent), authority=frame.authority,
                isStatic=frame.static, age=round(frame.silence, 1) if is_moving else -1.0,
                rate=float(f"{frame.rate:.3g}"), isOld=self._is_old(frame),
                fault=bounded(faults.get(name, "")),
            )  # fmt: skip
            if is_open:
                waiting += [(one, depth + 1) for one in reversed(below)]


class _Tree(NamedTuple):
    """The frames by name, what is wrong with them in words, and the number of all frames."""

    frames: Mapping[str, FrameInfo]
    faults: Mapping[str, str]
    total: int


def _read(buffer: TransformBuffer) -> _Tree:
    names = buffer.frame_names()
    tree = buffer.tree(names[:_MAX_FRAMES])
    return _Tree({name: tree[name] for name in tree}, buffer.tree_faults(), len(names))


def _with_parents(frames: Mapping[str, FrameInfo], names: Iterable[str]) -> set[str]:
    """Return frames, and those that they are below."""
    found: set[str] = set()
    for name in names:
        frame = name
        while frame in frames and frame not in found:
            found.add(frame)
            frame = frames[frame].parent
    return found


def _children(frames: Mapping[str, FrameInfo], shown: set[str]) -> dict[str, list[str]]:
    """Return the shown frames by parent; those without one, or below a missing one, by ""."""
    found: dict[str, list[str]] = {}
    for name in sorted(shown):
        parent = frames[name].parent
        found.setdefault(parent if parent in shown else "", []).append(name)
    return found


def _row(name: str, **roles: Any) -> dict[str, Any]:
    return {
        "name": name, "depth": 0, "folds": False, "open": False, "parentFrame": "",
        "authority": "", "isStatic": False, "age": -1.0, "rate": 0.0, "isOld": False,
        "fault": "", **roles,
    }  # fmt: skip
