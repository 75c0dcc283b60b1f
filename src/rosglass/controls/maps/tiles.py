"""Images too large for one texture, as tiles: made on a worker thread, shown by QML's ``Image``.

A :class:`TileSource` divides its image into levels, each of which has half of the pixels per
metre of the one before. A :class:`TileLayer` selects those that are seen, has the missing ones
made, and hands a few of them at a time to QML, so that no frame waits for many uploads. Coarser
tiles lie below finer ones, so that nothing is blank until those are there.
"""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import itertools
import logging
import math
from collections import deque
from threading import Lock
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

from rosglass.comm.handle import guarded
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QtCore, QtGui, QtQuick, Signal, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm.handle import Executor
    from rosglass.controls.maps.camera import MapCamera, Plane
    from rosglass.qt import QtQml

__all__ = ["TILE_PX", "TileImages", "TileKey", "TileLayer", "TileSource"]

_log = logging.getLogger("rosglass.qml")
#: Pixels of a tile's side.
TILE_PX = 512
#: Tiles that are handed to QML at once, and milliseconds until the next ones.
_AT_ONCE, _PAUSE_MS = 1, 6
#: Tiles of a layer that may be seen at once, and further ones that are kept.
_MOST_SEEN, _MOST_KEPT = 160, 24
#: Pixels from the middle of the view to the point that positions are relative to: QML's matrices
#: have single precision.
_MAX_OFFSET_PX = 100_000.0
_numbers = itertools.count(1)


class TileKey(NamedTuple):
    """A tile of a source; level 0 is the finest."""

    level: int
    column: int
    row: int


class TileSource(Protocol):
    """An image in tiles; its own coordinates are metres, with y up."""

    #: How many levels there are.
    levels: int

    def unit(self, level: int) -> float:
        """Return the metres of a pixel."""

    def range(
        self, level: int, box: tuple[float, float, float, float]
    ) -> tuple[int, int, int, int]:
        """Return the first column and row in a box, and those after the last; empty outside."""

    def rect(self, key: TileKey) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of a tile."""

    def version(self, key: TileKey) -> int:
        """Return a number that changes with the tile."""

    def paint(self, key: TileKey) -> QtGui.QImage | None:
        """Return the tile's image, on the worker thread; None without one."""


class _Provider(QtQuick.QQuickImageProvider):
    """Provides the tiles of a control to QML's ``Image``."""

    def __init__(self, images: dict[str, QtGui.QImage]) -> None:
        super().__init__(QtQuick.QQuickImageProvider.ImageType.Image)
        self._images = images

    def requestImage(self, name: str, size: QtCore.QSize, _: QtCore.QSize) -> QtGui.QImage:
        """Return a tile; called by Qt."""
        image = self._images.get(name)
        image = QtGui.QImage() if image is None else image
        size.setWidth(image.width())
        size.setHeight(image.height())
        return image


class TileImages:
    """The images of the tiles of a control, by the names that QML asks for.

    Args:
        engine: The QML engine in which they are shown.
    """

    def __init__(self, engine: QtQml.QQmlEngine | None) -> None:
        self._host = f"rosglass-tiles-{next(_numbers)}"
        self._images: dict[str, QtGui.QImage] = {}
        self._engine = engine
        self._provider = _Provider(self._images)
        if self._engine is not None:
            self._engine.addImageProvider(self._host, self._provider)

    def add(self, image: QtGui.QImage) -> str:
        """Keep an image; return its URL."""
        name = str(next(_numbers))
        self._images[name] = image
        return f"image://{self._host}/{name}"

    def drop(self, url: str) -> None:
        """Forget an image."""
        self._images.pop(url.rpartition("/")[2], None)

    def close(self) -> None:
        """Forget all images."""
        self._images.clear()
        if self._engine is not None and is_alive(self._engine):
            self._engine.removeImageProvider(self._host)
        self._engine = None


class _Work:
    """Has tiles made on the worker thread, one after another, the most wanted first.

    Args:
        worker: The executor of that thread.
        on_ready: Called there when a tile is made.
    """

    def __init__(self, worker: Executor, on_ready: Callable[[], None]) -> None:
        self._worker, self._on_ready = worker, on_ready
        self._lock = Lock()
        self._wanted: deque[tuple[TileSource, TileKey]] = deque()
        self._made: list[tuple[TileSource, TileKey, int, QtGui.QImage | None]] = []
        self._is_running = False

    def ask(self, source: TileSource, keys: Iterable[TileKey]) -> None:
        """Make these tiles, and no others that have been asked for."""
        with self._lock:
            self._wanted = deque((source, key) for key in keys)
            begins = bool(self._wanted) and not self._is_running
            self._is_running |= begins
        if begins:
            self._worker.post(self._run)

    def take(self) -> list[tuple[TileSource, TileKey, int, QtGui.QImage | None]]:
        """Return what has been made since the last time."""
        with self._lock:
            made, self._made = self._made, []
        return made

    def _run(self) -> None:
        with self._lock:
            if not self._wanted:
                self._is_running = False
                return
            source, key = self._wanted.popleft()
        version, image = source.version(key), None
        with guarded(_log, f"tile {key}"):  # a broken one must not end the others
            image = source.paint(key)
        with self._lock:
            self._made.append((source, key, version, image))
            is_first = len(self._made) == 1
        if is_first:
            self._on_ready()
        self._worker.post(self._run)  # behind messages that wait


class _Row:
    """A tile that QML shows."""

    __slots__ = ("key", "rect", "url", "version")

    def __init__(
        self, key: TileKey, version: int, url: str, rect: tuple[float, float, float, float]
    ) -> None:
        self.key, self.version, self.url, self.rect = key, version, url, rect


class TileModel(QtCore.QAbstractListModel):
    """The tiles of a layer for a ``Repeater``."""

    _ROLES: ClassVar[list[str]] = ["left", "up", "wide", "high", "image", "order"]

    def __init__(self, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self.rows: list[_Row] = []
        #: The point that positions are relative to.
        self.anchor = (0.0, 0.0)

    def roleNames(self) -> Any:
        """Return the names of the roles; called by Qt."""
        first = int(QtCore.Qt.ItemDataRole.UserRole)
        return {first + n: QtCore.QByteArray(name.encode()) for n, name in enumerate(self._ROLES)}

    def rowCount(self, parent: Any = None) -> int:  # noqa: ARG002 - Qt's
        """Return how many there are; called by Qt."""
        return len(self.rows)

    def data(self, index: Any, role: int = 0) -> Any:
        """Return a value; called by Qt."""
        at = index.row()
        if not 0 <= at < len(self.rows):
            return None
        row, which = self.rows[at], role - int(QtCore.Qt.ItemDataRole.UserRole)
        left, bottom, width, height = row.rect
        if which == 0:
            return left - self.anchor[0]
        if which == 1:
            return self.anchor[1] - bottom - height
        return (
            (width, height, row.url, float(-row.key.level))[which - 2] if 2 <= which < 6 else None
        )

    def add(self, row: _Row) -> None:
        """Show one more tile."""
        at = len(self.rows)
        self.beginInsertRows(QtCore.QModelIndex(), at, at)
        self.rows.append(row)
        self.endInsertRows()

    def remove(self, at: int) -> _Row:
        """Show a tile no longer."""
        self.beginRemoveRows(QtCore.QModelIndex(), at, at)
        row = self.rows.pop(at)
        self.endRemoveRows()
        return row

    def touch(self, first: int, last: int) -> None:
        """Have QML read rows again."""
        self.dataChanged.emit(self.index(first), self.index(last), [])


class TileLayer(QtCore.QObject):
    """An image in tiles as QML shows it; on the GUI thread.

    Args:
        parent: The owner.
        images: The images of its control.
        worker: The executor of the thread that makes tiles.
        executor: The executor of the GUI thread.
    """

    matrixChanged = Signal()
    shownChanged = Signal()
    smoothChanged = Signal()

    #: From the tiles' own coordinates, relative to the model's anchor, to pixels.
    matrix = Property(QtGui.QMatrix4x4, lambda self: self._matrix, notify=matrixChanged)
    shown = Property(bool, lambda self: self._is_shown, notify=shownChanged)
    #: Whether pixels are mixed; cells that are larger than a pixel stay sharp.
    smooth = Property(bool, lambda self: self._is_smooth, notify=smoothChanged)
    tiles = Property(QtCore.QObject, lambda self: self.model, constant=True)

    def __init__(
        self, parent: QtCore.QObject, images: TileImages, worker: Executor, executor: Executor
    ) -> None:
        super().__init__(parent)
        self.model = TileModel(self)
        self._images = images
        self._matrix, self._is_shown, self._is_smooth = QtGui.QMatrix4x4(), False, True
        self._source: TileSource | None = None
        self._pose: Plane | None = None
        self._camera: MapCamera | None = None
        #: Whether cells stay sharp where they are enlarged.
        self.keeps_cells = True
        self._wanted: dict[TileKey, None] = {}
        self._ready: deque[tuple[TileSource, TileKey, int, QtGui.QImage | None]] = deque()
        on_ready = weak_callback(self._on_ready)
        self._work = _Work(worker, lambda: executor.post(on_ready))
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_PAUSE_MS)
        self._timer.timeout.connect(weak_callback(self._hand_over))

    @property
    def is_complete(self) -> bool:
        """True if everything that is seen is shown."""
        shown = {row.key: row.version for row in self.model.rows}
        source = self._source
        return source is None or all(shown.get(k) == source.version(k) for k in self._wanted)

    def set_source(self, source: TileSource | None) -> None:
        """Show another image; None for nothing."""
        if source is self._source:
            return
        self._source = source
        self._ready.clear()
        self._wanted.clear()
        while self.model.rows:
            self._images.drop(self.model.remove(len(self.model.rows) - 1).url)
        self.refresh()

    def set_view(self, camera: MapCamera | None, pose: Plane | None) -> None:
        """Show it as a camera sees it, at a pose; None while that is not known."""
        if camera is not self._camera or pose != self._pose:
            self._camera, self._pose = camera, pose
            self.refresh()

    def refresh(self) -> None:
        """Follow the camera, and ask for what is seen and missing."""
        camera, pose, source = self._camera, self._pose, self._source
        is_shown = camera is not None and pose is not None and source is not None
        if is_shown != self._is_shown:
            self._is_shown = is_shown
            self.shownChanged.emit()
        if camera is None or pose is None or source is None:
            return
        whole = camera.to_screen().after(pose)
        self._place(whole, camera)
        pixels = math.hypot(whole.a, whole.c)
        level = self._level(source, 1 / pixels)
        is_smooth = not self.keeps_cells or source.unit(0) * pixels < 1.5
        if is_smooth != self._is_smooth:
            self._is_smooth = is_smooth
            self.smoothChanged.emit()
        self._select(source, level, whole.inverse().box(camera.width, camera.height))

    def _place(self, whole: Plane, camera: MapCamera) -> None:
        """Set the matrix; move the anchor if it is too far from what is seen."""
        x, y = whole.apply(*self.model.anchor)
        away = max(abs(x - camera.width / 2), abs(y - camera.height / 2))
        if away > _MAX_OFFSET_PX:
            self.model.anchor = whole.inverse().apply(camera.width / 2, camera.height / 2)
            x, y = whole.apply(*self.model.anchor)
            if self.model.rows:
                self.model.touch(0, len(self.model.rows) - 1)
        a, b, c, d = whole[:4]
        self._matrix = QtGui.QMatrix4x4(a, -b, 0, x, c, -d, 0, y, 0, 0, 1, 0, 0, 0, 0, 1)
        self.matrixChanged.emit()

    @staticmethod
    def _level(source: TileSource, metres: float) -> int:
        """Return the level for so many metres in a pixel of the screen."""
        share = metres / source.unit(0)
        level = math.floor(math.log2(share) + 0.25) if share > 1 else 0
        return min(level, source.levels - 1)

    def _select(
        self, source: TileSource, level: int, box: tuple[float, float, float, float]
    ) -> None:
        while True:
            c0, r0, c1, r1 = source.range(level, box)
            if (c1 - c0) * (r1 - r0) <= _MOST_SEEN or level == source.levels - 1:
                break
            level += 1
        x, y = (c0 + c1 - 1) / 2, (r0 + r1 - 1) / 2
        seen = [TileKey(level, c, r) for r in range(r0, r1) for c in range(c0, c1)][:_MOST_SEEN]
        seen.sort(key=lambda key: (key.column - x) ** 2 + (key.row - y) ** 2)
        # The coarsest tiles are below all others.
        top = source.levels - 1
        c0, r0, c1, r1 = source.range(top, box)
        below = [TileKey(top, c, r) for r in range(r0, r1) for c in range(c0, c1)][:4]
        wanted = dict.fromkeys([*below, *seen])
        if [*wanted] == [*self._wanted] and not self._is_changed(source):
            return
        self._wanted = wanted
        self._ask(source)

    def _is_changed(self, source: TileSource) -> bool:
        return any(row.version != source.version(row.key) for row in self.model.rows)

    def _ask(self, source: TileSource) -> None:
        here = {row.key: row.version for row in self.model.rows}
        here |= {key: version for _, key, version, _ in self._ready}
        self._work.ask(source, [k for k in self._wanted if here.get(k) != source.version(k)])
        self._drop(source)

    def _on_ready(self) -> None:
        if not is_alive(self):
            return
        self._ready += self._work.take()
        if not self._timer.isActive():
            self._hand_over()

    def _hand_over(self) -> None:
        """Give QML the next tiles."""
        if not is_alive(self) or self._source is None:
            return
        given = 0
        while self._ready and given < _AT_ONCE:
            source, key, version, image = self._ready.popleft()
            if source is self._source and key in self._wanted:
                self._show(key, version, image)
                given += 1
        if self._ready:
            self._timer.start()
        else:
            self._drop(self._source)

    def _show(self, key: TileKey, version: int, image: QtGui.QImage | None) -> None:
        source = self._source
        assert source is not None
        url = "" if image is None else self._images.add(image)
        for at, row in enumerate(self.model.rows):
            if row.key == key:
                self._images.drop(row.url)
                row.version, row.url = version, url
                self.model.touch(at, at)
                return
        self.model.add(_Row(key, version, url, source.rect(key)))

    def _drop(self, source: TileSource) -> None:
        """Drop tiles that are not seen: those of other levels when all that is seen is there."""
        if self._ready:
            return
        rows = self.model.rows
        here = {row.key for row in rows}
        is_complete = here.issuperset(self._wanted)
        levels = {key.level for key in self._wanted}
        unseen = [at for at, row in enumerate(rows) if row.key not in self._wanted]
        extra = len(unseen) - _MOST_KEPT
        for number, at in reversed([*enumerate(unseen)]):
            row = rows[at]
            is_other = row.key.level not in levels
            # What has changed unseen is made again when it is seen.
            is_old = row.version != source.version(row.key)
            if number < extra or is_old or (is_other and is_complete):
                self._images.drop(self.model.remove(at).url)
