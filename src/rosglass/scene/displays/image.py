"""The display Image, and what it has in common with Camera: a camera's images.

They are shown by ``ImagePanel`` (``panels/ImagePanel.qml``), whose :class:`PictureItem` paints the
images.
"""
# ruff: noqa: N815 - the names of properties, signals and events are Qt's

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.images import TRANSPORTS
from rosglass.images.depth import GreyRange
from rosglass.interfaces.names import ros1_name
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS
from rosglass.qml.elements.image_sinks import ImageItem, Sink
from rosglass.qml.engine.log import declared_at, log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import Property, QtCore, QtGui, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import read_number
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.display import Display

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.qml.elements.image_rendering import Look, Picture
    from rosglass.qml.elements.image_stream import SharedStream
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session

__all__ = ["ImageDisplay", "PictureDisplay", "PictureItem", "fit_into", "picture_bytes"]

#: Seconds after which an image is no longer live.
_MAX_AGE_S = DEFAULT_TIMEOUT_MS / 1000

#: Largest factor by which images are kept larger than a panel, for a zoom.
_MOST_ZOOM = 8.0

#: Key of a panel's geometry in config files; RViz does not read it.
_PANEL, _SIDES = "Panel Geometry", ("X", "Y", "Width", "Height")
_NO_PANEL = "no panel shows it: declare ImagePanel { display: ... }"


class PictureDisplay(Display):
    """Base class of the displays of a camera's images, which several panels may show.

    It receives images while a panel shows it.
    """

    MESSAGES = tuple(dict.fromkeys(ros1_name(one.type) for one in TRANSPORTS.values()))

    #: The image, its position or its visibility has changed.
    pictureChanged = Signal()

    TOPIC_KEYS = ("Topic",)
    topic = Setting("Topic", "topic", "", "Topic to subscribe to.", then="_on_topic")
    depth = Setting(
        "Topic/Depth", "int", 2, "Images kept until their transform is known.", min=1, max=100,
        then="",
    )  # fmt: skip
    transport = Setting(
        "Transport Hint", "enum", "raw",
        "Transport of the images; another one is used while this one is not published.",
        choices=list(TRANSPORTS), then="_schedule",
    )  # fmt: skip

    #: Number of received images.
    received = ReadOnly(int, 0)
    #: Position and size of its panel in units of the view; empty until the user moves it.
    panelGeometry = Writable(QtCore.QRectF, QtCore.QRectF(), then="")
    #: True while it and its groups are enabled.
    active = ReadOnly(bool, False)
    isPicture = Property(bool, lambda _: True, constant=True)
    #: True if the scene is drawn in its image.
    isCamera = Property(bool, lambda _: False, constant=True)
    #: True if the image is behind the scene.
    behind = Property(bool, lambda self: self._is_behind(), notify=pictureChanged)
    #: Opacity of the image over the scene.
    overlay = Property(float, lambda self: self._overlay_alpha(), notify=pictureChanged)

    _HOLDS = ("_picture",)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._sinks: list[Sink] = []
        self._shown_look: Look | None = None
        self._picture: Picture | None = None
        self._arrived = 0.0
        super().__init__(parent, runtime)

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file, and the geometry of the panel."""
        refused = super().load_settings(saved)
        place = saved.get(_PANEL)
        if isinstance(place, dict):
            try:
                numbers = [
                    read_number(place.get(side), f"{_PANEL}/{side}", minimum=0, maximum=100_000)
                    for side in _SIDES
                ]
            except Error as error:
                refused.append(str(error))
            else:
                self.panelGeometry = QtCore.QRectF(*numbers)
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz, and where its panel is."""
        kept = super().save_settings(older, ros)
        place: Any = self.panelGeometry
        if not place.isEmpty():
            kept[_PANEL] = dict(zip(_SIDES, place.getRect(), strict=True))
        return kept

    # -- panels ----------------------------------------------------------------------------------

    def add_sink(self, item: ImageItem) -> None:
        """Show the images in an item as well."""
        sink = Sink(item)
        self._sinks.append(sink)
        if self._picture is not None:
            sink.show(self._picture)
        self._schedule()

    def remove_sink(self, item: ImageItem) -> None:
        """Stop showing the images in an item."""
        self._sinks = [one for one in self._sinks if one.item is not item]
        self._schedule()

    def picture_place(self, width: float, height: float) -> QtCore.QRectF:
        """Return the image's rectangle in an item, which it may exceed.

        Args:
            width: Width of the item.
            height: Height of the item.
        """
        picture = self._picture
        aspect = 1.0 if picture is None else picture.frame.width / picture.frame.height
        return fit_into(width, height, aspect, 1.0)

    # -- the stream ------------------------------------------------------------------------------

    def _wanted(self) -> tuple[Any, ...] | None:
        topic = self._find_topic()
        if not topic:
            return None
        if not self._sinks:
            self.set_status("Topic", "warn", _NO_PANEL)
            return None
        return self.node, topic, self.transport

    def on_group_enabled(self) -> None:
        """Show or hide the panels, as it or its group is shown or hidden."""
        super().on_group_enabled()
        if not self.shown:
            self._close_endpoint()
            self.reset()
        if self.scene is not None:
            report(self, active=self.shown)

    def _update(self) -> None:
        super()._update()
        report(self, active=self.shown)

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        from rosglass.qml.elements.image_stream import SharedStream as Stream  # noqa: PLC0415 - QtMultimedia

        session = self._session
        assert session is not None
        node, topic, transport = wanted
        look = self._look()
        try:
            stream = Stream.join(session, node, topic, transport, look, self)
        except Error as error:
            self.set_status("Topic", "error", str(error))
            return
        self._shown_look = look
        self._set_endpoint(stream)

    def _dispose(self, session: Session, endpoint: SharedStream) -> None:  # noqa: ARG002
        endpoint.leave(self)

    def _on_created(self, endpoint: SharedStream) -> None:
        self._publishers = self._count_publishers()
        self._begin_to_wait()
        channel = endpoint.channel(self)
        if channel is not None and channel.last is not None:
            self.show_picture(channel.last)

    def _on_closed(self, endpoint: SharedStream | None) -> None:  # noqa: ARG002
        self._no_publisher.stop()
        self.reset()

    def _count_publishers(self) -> int:
        try:
            return self._endpoint.stream.publisher_count() if self._endpoint is not None else 0
        except Error:
            return 0

    def _grey_range(self) -> GreyRange:
        return GreyRange()

    def _zoom(self) -> float:
        return 1.0

    def _look(self) -> Look:
        """Return how images are converted: not larger than the largest panel shows them."""
        from rosglass.qml.elements.image_rendering import Look  # noqa: PLC0415 - loads QtMultimedia

        rooms = [sink.room() for sink in self._sinks if sink.is_alive]
        known = [room for room in rooms if room is not None]
        room = None
        if known and len(known) == len(rooms):
            zoom = min(max(self._zoom(), 1.0), _MOST_ZOOM)
            sides = zip(*known, strict=True)
            width, height = (round(max(side) * zoom) for side in sides)
            room = (width, height)
        return Look(False, colors=self._grey_range(), room=room)

    def _update_look(self) -> None:
        stream = self._endpoint
        if stream is not None:
            look = self._look()
            if look != self._shown_look:
                self._shown_look = look
                stream.change_look(self, look)

    # -- images ----------------------------------------------------------------------------------

    def show_picture(self, picture: Picture) -> None:
        """Receive an image; called by the stream in the GUI thread."""
        if not is_alive(self) or self.scene is None or not self.shown:
            return
        self._arrived = time.time()
        if self._outdated:
            # Not by the last image of a publisher that is gone.
            self._recheck_outdated()
        report(self, received=self.received + 1)
        self.set_status("Topic", "ok", f"{self.received} images received")
        self.delete_status("Image")
        self._take_picture(picture)

    def stream_changed(self) -> None:
        """Read the stream's problem again; called by the stream in the GUI thread."""
        if not is_alive(self) or self._endpoint is None:
            return
        self._publishers = max(self._publishers, self._count_publishers())
        channel = self._endpoint.channel(self)
        problem = self._endpoint.stream.problem or (channel.problem if channel else "")
        if problem:
            self.set_status("Image", "error", problem)
        else:
            self.delete_status("Image")

    def _take_picture(self, picture: Picture) -> None:
        self._present(picture)

    def _present(self, picture: Picture) -> None:
        self._picture = picture
        for sink in self._sinks:
            if sink.is_alive:
                sink.show(picture)
        self.pictureChanged.emit()
        self._update_stale()

    def reset(self) -> None:
        """Remove the image."""
        super().reset()
        self._picture = None
        for sink in self._sinks:
            sink.clear()
        self.pictureChanged.emit()
        self._update_stale()

    def leave(self) -> None:
        """Stop being shown."""
        super().leave()
        if is_alive(self):
            self._close_endpoint()

    def _is_behind(self) -> bool:
        return True

    def _overlay_alpha(self) -> float:
        return 0.0

    # -- age -------------------------------------------------------------------------------------

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        alive = [sink for sink in self._sinks if sink.is_alive]
        if len(alive) != len(self._sinks):
            self._sinks = alive
            self._schedule()
        # Items have no signal for a size on the screen that has changed.
        self._update_look()

    def _recheck_outdated(self) -> None:
        if self._count_publishers():
            self._outdated = False

    def _is_old(self) -> bool:
        picture = self._picture
        if picture is None:
            return True
        age_s, scene = self._steady() - picture.made + picture.late, self.scene
        # A camera of a simulation that is paused sends nothing.
        return (age_s if scene is None else min(age_s, scene.seconds_running())) > _MAX_AGE_S

    def _update_stale(self) -> None:
        super()._update_stale()
        if self._picture is None or not self.stale:
            self.delete_status("Data")
            return
        when = time.strftime("%H:%M:%S", time.localtime(self._arrived))
        why = "its publisher is gone" if self._outdated else "no new image is shown"
        self.set_status("Data", "warn", f"{why}; the last one is of {when}")


class ImageDisplay(PictureDisplay):
    """A camera's images. See its page in ``docs/scene.md``."""

    TYPE = "Image"

    normalizeRange = Setting(
        "Normalize Range", "bool", True,
        "Adapt black and white to the images, for depths and other numbers.",
        then="_update_range",
    )  # fmt: skip
    minValue = Setting(
        "Min Value", "float", 0.0, "Value that is shown as black.",
        then="_update_range", shown_if={"normalizeRange": False},
    )  # fmt: skip
    maxValue = Setting(
        "Max Value", "float", 1.0, "Value that is shown as white.",
        then="_update_range", shown_if={"normalizeRange": False},
    )  # fmt: skip
    medianWindow = Setting(
        "Median window", "int", 5, "Number of images for the medians of black and white.",
        min=1, max=1000, then="_update_range", shown_if={"normalizeRange": True},
    )  # fmt: skip

    def _grey_range(self) -> GreyRange:
        if self.normalizeRange:
            return GreyRange(window=self.medianWindow)
        return GreyRange(self.minValue, self.maxValue)

    def _update_range(self) -> None:
        if self.normalizeRange or self.minValue < self.maxValue:
            self.delete_status("Range")
        else:
            text = f"Min Value {self.minValue:g} is not below Max Value {self.maxValue:g}"
            self.set_status("Range", "warn", f"{text}: depths are black")
        self._update_look()


def fit_into(width: float, height: float, aspect: float, zoom: float) -> QtCore.QRectF:
    """Return the centred rectangle of an image of an aspect ratio in an item."""
    wide = min(width, height * aspect) * zoom
    high = min(height, width / aspect) * zoom
    return QtCore.QRectF((width - wide) / 2, (height - high) / 2, wide, high)


class PictureItem(ImageItem):
    """Paints the images of a display; for ``ImagePanel``."""

    displayChanged = Signal()

    def __init__(self, parent: Any = None) -> None:
        super().__init__(parent)
        self._display: PictureDisplay | None = None
        state = self.__dict__
        self.destroyed.connect(lambda: state.update(_display=None))

    def _get_display(self) -> QtCore.QObject | None:
        return self._display

    def _set_display(self, display: Any) -> None:
        before = self._display
        if display is before:
            return
        if not (display is None or isinstance(display, PictureDisplay)):
            kind = display.metaObject().className().partition("_QML")[0]
            text = f"display: expected an ImageDisplay or a CameraDisplay, got {kind}"
            log_from_qml("", logging.ERROR, text, declared_at(self.parent() or self))
            return
        if before is not None and is_alive(before):
            before.remove_sink(self)
            before.pictureChanged.disconnect(self.update)
        self._display = display
        if display is not None:
            display.add_sink(self)
            display.pictureChanged.connect(self.update)
        self.displayChanged.emit()

    display = Property(QtCore.QObject, _get_display, _set_display, notify=displayChanged)

    def _is_smooth(self, target: QtCore.QRectF, source: QtCore.QRectF) -> bool:
        """Return whether pixels are mixed: as in RViz, magnified ones are not."""
        return target.width() < source.width()

    def _place(self, image: QtGui.QImage) -> tuple[QtCore.QRectF, QtCore.QRectF]:
        """Return the part of the item that the image covers, and the part of the image in it."""
        display = self._display
        if display is None or not is_alive(display):
            return super()._place(image)
        whole = display.picture_place(self.width(), self.height())
        seen = whole.intersected(QtCore.QRectF(0, 0, self.width(), self.height()))
        across = image.width() / max(whole.width(), 1e-9)
        down = image.height() / max(whole.height(), 1e-9)
        return seen, QtCore.QRectF(
            (seen.x() - whole.x()) * across,
            (seen.y() - whole.y()) * down,
            seen.width() * across,
            seen.height() * down,
        )


def picture_bytes(picture: Picture) -> int:
    """Return the approximate number of bytes of an image."""
    whole = picture.whole
    received = 0 if whole is None else whole.height * whole.step
    return received + sum(plane.nbytes for plane in picture.frame.planes)
