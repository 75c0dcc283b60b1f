"""Paints the texts of labels into an image, as the GPU draws them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

# Not their classes: PySide prepares each when it is named, in 3 ms; first frames have no text.
from rosglass.qt import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    #: A text, and whether its edges are painted instead of its letters.
    _Text: TypeAlias = tuple[str, bool]
    _Box: TypeAlias = tuple[int, int, int, int]

__all__ = ["TextImage"]

#: Pixels of a line of text.
_LINE_PX = 32
#: Pixels from the top of a line to its baseline: letters are as high up as RViz's.
_BASELINE_PX = 26.5
#: Width of the pen that paints the edges of letters: half of it is outside.
_EDGE_PX = 5.0
#: Pixels between two texts: those at an edge are a mix of both sides.
_GAP_PX = 2


class TextImage:
    """An image of texts. Texts that it has are not painted again when others change.

    Args:
        limit: Largest width and height, in pixels.

    Attributes:
        limit: As given.
        pixels: (h, w), one byte for each pixel.
    """

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.pixels: NDArray[np.uint8] = np.zeros((0, 0), np.uint8)
        #: Left, top, width and height of each text in pixels; the size is 0 if it has no room.
        self._boxes: dict[_Text, _Box] = {}
        #: The position of the next text, x and y, and the height of this row of texts.
        self._free = (0, 0, 0)
        self._left_out = False
        self._font = QtGui.QFont("DejaVu Sans")
        self._font.setPixelSize(int(_LINE_PX * 0.75))
        self._metrics = QtGui.QFontMetricsF(self._font)

    def set_texts(self, texts: Sequence[str], outlined: bool = False) -> tuple[int, int]:
        """Paint those that are new.

        Args:
            texts: All that there are.
            outlined: Whether the edges of their letters are painted as well, as further texts.

        Returns:
            The first row of pixels that has changed, and the one after the last; the image may have
            another size if these are all rows.
        """
        wanted: dict[_Text, None] = dict.fromkeys((text, False) for text in texts)
        if outlined:
            wanted.update(dict.fromkeys((text, True) for text in texts))
        new = [text for text in wanted if text not in self._boxes]
        if not wanted or not (new or self._left_out):
            return 0, 0
        height, width = self.pixels.shape
        top = self._free[1]
        boxes, free = _arrange(self._sizes(new), width, self._free)
        bottom = free[1] + free[2]
        fits = bottom <= height and all(wide <= width for _, _, wide, _ in boxes.values())
        if not fits or self._left_out:
            self._begin_anew(wanted)
            return 0, len(self.pixels)
        self._free = free
        self._boxes.update(boxes)
        self._paint(boxes)
        return top, bottom

    def places(
        self, texts: Sequence[str], *, edges: bool = False
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return where texts, or their edges, are.

        Returns:
            Left, top, width and height of each as shares of the image; width and height of each in
            lines, 0 for those for which there is no room.
        """
        boxes = np.array([self._boxes[text, edges] for text in texts], np.float32).reshape(-1, 4)
        height, width = self.pixels.shape
        whole = np.array([width, height, width, height], np.float32)
        return boxes / whole, boxes[:, 2:] / np.float32(_LINE_PX)

    def _begin_anew(self, texts: Iterable[_Text]) -> None:
        """Paint texts into a new image; if they have changed before, with room for as many more."""
        room = 2 if self._boxes else 1
        # High ones beside high ones: a row is as high as the highest of them.
        sizes = dict(sorted(self._sizes(texts).items(), key=lambda one: -one[1][1]))
        area = sum((wide + _GAP_PX) * (high + _GAP_PX) for wide, high in sizes.values())
        widest = max(wide for wide, _ in sizes.values())
        width = min(max(widest, math.isqrt(area)), self.limit)
        boxes, free = _arrange(sizes, width, (0, 0, 0))
        if free[1] + free[2] > self.limit:
            width = self.limit
            boxes, free = _arrange(sizes, width, (0, 0, 0))
        height = min((free[1] + free[2]) * room, self.limit)
        self.pixels = np.zeros((height, width), np.uint8)
        left_out = [text for text, (_, top, _, high) in boxes.items() if top + high > height]
        self._left_out = bool(left_out)
        self._boxes, self._free = {**boxes, **dict.fromkeys(left_out, (0, 0, 0, 0))}, free
        self._paint(self._boxes)

    def _sizes(self, texts: Iterable[_Text]) -> dict[_Text, tuple[int, int]]:
        """Return width and height of texts in pixels; what is beyond the limit is cut off."""
        found = {}
        for text in texts:
            lines = text[0].split("\n")
            wide = int(max(map(self._metrics.horizontalAdvance, lines))) + 5
            high = len(lines) * _LINE_PX
            found[text] = (min(wide, self.limit - 2), min(high, self.limit - 2))
        return found

    def _paint(self, texts: Iterable[_Text]) -> None:
        height, width = self.pixels.shape
        image = QtGui.QImage(
            self.pixels.data, width, height, width, QtGui.QImage.Format.Format_Alpha8
        )
        painter = QtGui.QPainter(image)
        painter.setFont(self._font)
        painter.setPen(QtCore.Qt.GlobalColor.white)
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        pen = QtGui.QPen(QtCore.Qt.GlobalColor.white, _EDGE_PX)
        for text, edges in texts:
            left, top, wide, high = self._boxes[text, edges]
            if not high:
                continue
            painter.setClipRect(left, top, wide, high)
            for number, line in enumerate(text.split("\n")):
                at = QtCore.QPointF(left + 2, top + number * _LINE_PX + _BASELINE_PX)
                if edges:
                    path = QtGui.QPainterPath()
                    path.addText(at, self._font, line)
                    painter.strokePath(path, pen)
                else:
                    painter.drawText(at, line)
        painter.end()


def _arrange(
    sizes: dict[_Text, tuple[int, int]], width: int, free: tuple[int, int, int]
) -> tuple[dict[_Text, _Box], tuple[int, int, int]]:
    """Return where boxes of these sizes go, in rows, and where the next one would."""
    x, y, row = free
    boxes = {}
    for text, (wide, high) in sizes.items():
        if x and x + wide > width:
            x, y, row = 0, y + row, 0
        boxes[text] = (x, y, wide, high)
        x, row = x + wide + _GAP_PX, max(row, high + _GAP_PX)
    return boxes, (x, y, row)
