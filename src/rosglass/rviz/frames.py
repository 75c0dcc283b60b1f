"""Where the robot's frames are, in RViz's fixed frame."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from rosglass.comm.names import similar
from rosglass.errors import Error, LookupException, TransformException
from rosglass.qml.tf_link import TfLink
from rosglass.qt import QtCore, Signal

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.time import Time
    from rosglass.qml.session import Session
    from rosglass.rviz.window import Window
    from rosglass.tf import Transform, TransformBuffer

__all__ = ["FIXED_FRAME", "Frames"]

#: How many frames a message names.
_NAMED = 8
#: Seconds for which a message holds, and how many are kept.
_FRESH, _CASES = 1.0, 100
#: How RViz's properties name the fixed frame.
FIXED_FRAME = "<Fixed Frame>"


class Frames(QtCore.QObject):
    """The transforms that our own node receives: RViz does not share its own with Python.

    Args:
        session: Whose node receives them.
        window: Tells which frame is the fixed one.
    """

    #: The frames are received now, or no longer.
    available_changed = Signal()

    def __init__(self, session: Session, window: Window) -> None:
        super().__init__()
        self._session, self._window = session, window
        self._link: TfLink | None = None
        self._node: Node | None = None
        #: What was told of what is missing, and when.
        self._explained: dict[tuple[str, str, str], tuple[float, str]] = {}
        session.node_changed.connect(self._follow)
        self._follow()

    @property
    def buffer(self) -> TransformBuffer | None:
        """The transforms; None while there is no node."""
        return None if self._link is None else self._link.buffer

    @property
    def fixed(self) -> str:
        """RViz's fixed frame."""
        return str(self._window.manager.getFixedFrame())

    def steady(self) -> float:
        """Return seconds by which ages are told; see :meth:`Session.steady`."""
        return self._session.steady()

    def locate(self, frame: str, time: Time | None = None) -> Transform:
        """Return where a frame is, in RViz's fixed frame.

        Args:
            frame: Its name; empty or :data:`FIXED_FRAME` for the fixed frame itself.
            time: When; None for the newest.

        Raises:
            Error: The frame is not known, or nothing connects the two; the message says which.
        """
        from rosglass.tf import Transform  # noqa: PLC0415 - only once somebody asks

        frame, fixed = frame.lstrip("/"), self.fixed.lstrip("/")
        if frame in ("", FIXED_FRAME, fixed):
            return Transform(frame_id=fixed, child_frame_id=fixed)
        if self._link is None:
            raise LookupException(
                f"the frame {frame!r} is not known yet: there is no connection to the robot"
            )
        if self._link.problem:
            raise Error(f"the frame {frame!r} is not known: {self._link.problem}")
        try:
            return self._link.buffer.lookup_transform(fixed, frame, time)
        except TransformException as error:
            raise type(error)(self._explanation(frame, fixed, error)) from None

    def _explanation(self, frame: str, fixed: str, error: TransformException) -> str:
        """Return :meth:`_explain`'s text of the last second: who follows a frame asks each time."""
        case, now = (frame, fixed, str(error)), time.monotonic()
        told, text = self._explained.get(case, (-math.inf, ""))
        if now - told > _FRESH:
            text = self._explain(frame, fixed, error)
            if len(self._explained) > _CASES:
                self._explained.clear()
            self._explained[case] = (now, text)
        return text

    def _explain(self, frame: str, fixed: str, error: TransformException) -> str:
        """Return what is wrong; it may be the fixed frame, which who asked has not named."""
        known = [] if self._link is None else sorted(self._link.buffer.tree())
        if not fixed:
            return f"RViz has no fixed frame, in which {frame!r} could be placed; choose one"
        if not known:
            return f"there is no frame {frame!r}: nothing is received on /tf and /tf_static"
        there = f"there are {', '.join(known[:_NAMED])}" + (", ..." if known[_NAMED:] else "")
        if frame not in known:
            return f"there is no frame {frame!r}{similar(frame, known) or f'; {there}'}"
        if fixed not in known:
            return (
                f"{frame!r} has no place, as RViz's fixed frame {fixed!r} does not exist; {there}"
            )
        return f"the frame {frame!r} cannot be placed in RViz's fixed frame {fixed!r}: {error}"

    def close(self) -> None:
        """Let the transforms go; safe to call twice."""
        link, self._link, self._node = self._link, None, None
        if link is not None:
            link.leave(self)

    def _follow(self) -> None:
        node = self._session.node
        if node is self._node:
            return
        self.close()
        self._node = node
        if node is not None:
            self._link = TfLink.join(self._session, node, "/", self)
        self.available_changed.emit()
