"""The display Camera: a camera's images with the scene in them.

A :class:`CameraView` draws the scene from the camera that ``CameraInfo`` describes.
"""
# ruff: noqa: N815, N802 - the names of properties, signals and events are Qt's

from __future__ import annotations

import logging
import time
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor

from rosglass.comm.names import similar
from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.errors import Error
from rosglass.images.transports import camera_info_topic
from rosglass.qml.elements.message_queue import MessageQueue, Subscriptions, drop_oldest
from rosglass.qml.engine.properties import Writable
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QtCore, QtQml, Signal, Slot, is_alive
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.image import PictureDisplay, fit_into, picture_bytes
from rosglass.scene.displays.parts import Parts
from rosglass.scene.render.camera import PinholeCamera
from rosglass.scene.view.scene_view import SceneView

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from rosglass.qml.elements.image_rendering import Picture
    from rosglass.qml.elements.image_stream import SharedStream
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.scene.displays.display import Display
    from rosglass.scene.displays.scene import Scene
    from rosglass.scene.displays.scene_frames import SceneFrames
    from rosglass.scene.render.camera import Camera
    from rosglass.scene.render.renderer import Frame
    from rosglass.scene.render.scene_tree import Item

__all__ = ["CameraDisplay", "CameraView"]

_CAMERA_INFO = "sensor_msgs/CameraInfo"

#: Seconds for which a camera's images wait for their transform; then they are shown alone.
_TRANSFORM_WAIT_S = 1.0
#: Milliseconds until displays that a camera hides must exist.
_HIDDEN_CHECK_MS = 1000

#: Limits of numbers in a CameraInfo; beyond them, positions on the screen would not be finite.
_MIN_FOCAL_PIXELS, _MAX_PIXELS = 0.001, 1e9
#: From a camera (x right, y down, looking along z) to OpenGL's (y up, looking along -z).
_OPTICAL = np.diag([1.0, -1.0, -1.0, 1.0])


class _Lens(NamedTuple):
    """The parameters of a camera with rectified images, from a ``CameraInfo``.

    Attributes:
        width: Width of the image in pixels; 0 if the camera does not give it.
        height: Height of the image in pixels; 0 if the camera does not give it.
        fx: Focal length in pixels, to the right.
        fy: The same, downwards.
        cx: Position of the optical axis, pixels from the left.
        cy: The same, from the top.
        right: Metres from its frame to the camera, for the right camera of a stereo pair.
        down: The same, downwards.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    right: float
    down: float


def _read_lens(message: Any) -> _Lens:
    """Return the parameters in a ``CameraInfo``.

    Raises:
        Error: The camera is not calibrated, or numbers are not finite.
    """
    name = "P" if "P" in message else "p"
    numbers = [float(number) for number in message[name]]
    if not np.isfinite(numbers).all():
        raise Error(f"CameraInfo/{name}: contains NaN or infinite numbers: {numbers}")
    if max(map(abs, numbers)) > _MAX_PIXELS:
        raise Error(f"CameraInfo/{name}: {max(numbers, key=abs):g} is not a number of pixels")
    fx, _, cx, tx, _, fy, cy, ty = numbers[:8]
    if min(fx, fy) < _MIN_FOCAL_PIXELS:
        raise Error(
            f"CameraInfo/{name}: expected focal lengths above 0 pixels, got fx {fx:g} and fy "
            f"{fy:g}; calibrate the camera"
        )
    # Images show the region of interest; the pixels of binned ones are larger.
    roi = message.roi
    size = (roi.width or message.width, roi.height or message.height)
    return _Lens(*size, fx, fy, cx - roi.x_offset, cy - roi.y_offset, -tx / fx, -ty / fy)


class CameraDisplay(PictureDisplay):
    """The scene as a camera of the robot sees it, with its image. See ``docs/scene.md``."""

    TYPE = "Camera"

    imageRendering = Setting(
        "Image Rendering", "enum", "background and overlay",
        "Show the image behind the scene, over it, or both.",
        choices=["background", "overlay", "background and overlay"], then="_emit_changed",
    )  # fmt: skip
    overlayAlpha = Setting(
        "Overlay Alpha", "float", 0.5, "Opacity of the image over the scene.", min=0.0, max=1.0,
        then="_emit_changed", shown_if={"imageRendering": ("overlay", "background and overlay")},
    )  # fmt: skip
    zoomFactor = Setting(
        "Zoom Factor", "float", 1.0, "Above 1 magnifies, below 1 shows more around the image.",
        min=1e-5, max=1e5, then="_emit_changed",
    )  # fmt: skip
    #: Displays that are not drawn from the camera: names, or paths as ``/Group/Name``.
    hiddenDisplays = Writable(list, [], then="_on_hidden")

    isCamera = Property(bool, lambda _: True, constant=True)

    if TYPE_CHECKING:
        scene: Scene | None

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._waiting: deque[Picture] = deque()
        #: The queue of CameraInfo; None without a topic.
        self.infos: MessageQueue | None = None
        self._info_topic = ""
        self._lens: _Lens | None = None
        #: Pose of the camera's frame at the time of the image, in the fixed frame.
        self._pose: NDArray[np.float64] | None = None
        self._placed_at = 0.0
        super().__init__(parent, runtime)
        self.parts: Parts = _Visibility(self)

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file, with the displays that are hidden."""
        refused = super().load_settings(saved)
        self.hiddenDisplays = list(_hidden_paths(saved.get("Visibility")))
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz."""
        kept = super().save_settings(older, ros)
        kept["Visibility"] = {"Value": True, **self._visibility(kept.get("Visibility"), None)}
        return kept

    def _visibility(self, before: Any, group: Display | None) -> dict[str, Any]:
        """Return which displays of a group are shown, beside those that a file had."""
        found = dict(before) if isinstance(before, dict) else {}
        for one in self.scene.displays if self.scene is not None else ():
            if one.group is not group or one is self:
                continue
            shown = not self.hides(one)
            if one.TYPE == "Group":
                inner = self._visibility(found.get(one.name), one)
                found[one.name] = {**inner, "Value": shown}
            else:
                found[one.name] = shown
        return found

    def hides(self, display: Display) -> bool:
        """Return whether a display is not drawn from the camera; those in groups, by themselves."""
        return display.name in self.hiddenDisplays or _path_of(display) in self.hiddenDisplays

    # -- CameraInfo ------------------------------------------------------------------------------

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        super()._create_endpoint(wanted)
        session = self._session
        if self._endpoint is None or session is None:
            return
        node, topic = wanted[:2]
        topic = self._info_topic = camera_info_topic(topic)
        self._placed_at = time.monotonic()
        self._miss_info()
        queue = self.infos = MessageQueue(
            _read_lens, (_CAMERA_INFO,), session.executor, weak_callback(self._on_info), 1
        )
        qos = QoS(
            depth=1, reliability=Reliability.BEST_AVAILABLE, durability=Durability.BEST_AVAILABLE
        )

        def done(result: Any) -> None:
            if isinstance(result, Error):
                if is_alive(self) and self.infos is queue:
                    self.set_status("Camera Info", "error", str(result))
            elif is_alive(self) and self.infos is queue:
                self._cleanup["camera info"] = lambda: session.background(result.close)
            else:
                session.background(result.close)

        session.background(lambda: Subscriptions(node, {topic: qos}, queue), done)

    def _miss_info(self) -> None:
        text = f"no CameraInfo received on {self._info_topic}; the image is shown alone"
        self.set_status("Camera Info", "warn", text)

    def _on_closed(self, endpoint: SharedStream | None) -> None:
        self.infos = self._lens = None
        close = self._cleanup.pop("camera info", None)
        if close is not None:
            close()
        self.delete_status("Camera Info")
        super()._on_closed(endpoint)

    def _on_info(self) -> None:
        if not is_alive(self) or self.infos is None:
            return
        items, error = self.infos.drain()
        before = self._lens
        if error:
            # Another lens would draw the scene at wrong positions.
            self._lens = None
            self.set_status("Camera Info", "error", error)
        elif items:
            self._lens = items[-1].data
            self.set_status("Camera Info", "ok", "CameraInfo OK")
        if self._lens != before:
            self._place_waiting()
            self.pictureChanged.emit()

    # -- images ----------------------------------------------------------------------------------

    def _take_picture(self, picture: Picture) -> None:
        self._waiting.append(picture)
        drop_oldest(self._waiting, self.depth, picture_bytes)
        self._place_waiting()

    def _place_waiting(self) -> None:
        """Show the newest image whose transform is known; without one for a while, alone."""
        for at in range(len(self._waiting) - 1, -1, -1):
            picture = self._waiting[at]
            pose = self._pose_of(picture)
            if pose is not None:
                self._placed_at = time.monotonic()
            elif self._lens is not None and time.monotonic() - self._placed_at < _TRANSFORM_WAIT_S:
                continue
            for _ in range(at + 1):
                self._waiting.popleft()
            self._pose = pose
            self._present(picture)
            return

    def _pose_of(self, picture: Picture) -> NDArray[np.float64] | None:
        stamp = picture.frame.stamp
        frame = picture.frame.frame_id.lstrip("/")
        if not frame:
            self.set_status("Transform", "error", "header.frame_id of the image is empty")
            return None
        return self.place_of(frame, 0 if stamp is None else stamp.nanoseconds)

    def on_transforms(self) -> None:
        """Show images that waited for transforms, and add the scene to one that is shown alone."""
        if self._waiting:
            self._place_waiting()
        elif self._picture is not None and self._pose is None:
            self._pose = self._pose_of(self._picture)
            if self._pose is not None:
                self.pictureChanged.emit()

    def check_frames(self) -> None:
        """Show an image alone that has waited for long, also if no transform is received."""
        if self._waiting:
            self._place_waiting()
        super().check_frames()

    def on_fixed_frame(self) -> None:
        """Look at the scene from the camera's pose in the new fixed frame."""
        if self._picture is not None:
            self._pose = self._pose_of(self._picture)
            self.pictureChanged.emit()
        self.on_transforms()

    def join(self, scene: SceneFrames) -> None:
        """Start to be shown in a scene."""
        super().join(scene)
        self.pictureChanged.emit()

    def reset(self) -> None:
        """Remove the image and the scene in it."""
        self._waiting.clear()
        self._pose = None
        super().reset()

    # -- the camera ------------------------------------------------------------------------------

    def _on_hidden(self) -> None:
        self._emit_changed()
        # Files may name displays that are gone; QML may declare them further down.
        if QtQml.QQmlEngine.contextForObject(self) is not None:
            QtCore.QTimer.singleShot(_HIDDEN_CHECK_MS, self, self._check_hidden)

    @Slot()
    def _check_hidden(self) -> None:
        """Log hidden displays that do not exist."""
        if not is_alive(self) or self.scene is None:
            return
        names = [one.name for one in self.scene.displays]
        paths = [_path_of(one) for one in self.scene.displays]
        for name in self.hiddenDisplays:
            if name not in (*names, *paths):
                hint = similar(str(name), names)
                text = f"{self.label}: hiddenDisplays: there is no display {name!r}{hint}"
                self._log(text, logging.ERROR)

    def _emit_changed(self) -> None:
        self._update_look()
        self.pictureChanged.emit()

    def _zoom(self) -> float:
        return float(self.zoomFactor)

    def _is_behind(self) -> bool:
        return bool(self.imageRendering != "overlay")

    def _overlay_alpha(self) -> float:
        return 0.0 if self.imageRendering == "background" else float(self.overlayAlpha)

    def _size(self) -> tuple[int, int] | None:
        """Return width and height of the image that the lens belongs to."""
        picture, lens = self._picture, self._lens
        if picture is None or lens is None:
            return None
        whole = picture.whole or picture.frame
        return lens.width or whole.width, lens.height or whole.height

    def picture_place(self, width: float, height: float) -> QtCore.QRectF:
        """Return the image's rectangle in an item, which it may exceed."""
        size, lens = self._size(), self._lens
        if size is None or lens is None:
            place = super().picture_place(width, height)
            return fit_into(width, height, place.width() / max(place.height(), 1e-9), self._zoom())
        # Equal angles are equally large, also of pixels that are not square.
        return fit_into(width, height, (size[0] / lens.fx) / (size[1] / lens.fy), self._zoom())

    def camera_for(self, width: float, height: float) -> PinholeCamera | None:
        """Return the camera that sees the scene as the image does; None while it is unknown.

        Args:
            width: Width of the item that shows it.
            height: Height of the item.
        """
        size, lens, pose = self._size(), self._lens, self._pose
        if size is None or lens is None or pose is None or min(width, height) <= 0:
            return None
        place = self.picture_place(width, height)
        across, down = place.width() / size[0], place.height() / size[1]
        moved = np.eye(4)
        moved[:2, 3] = lens.right, lens.down
        return PinholeCamera(
            pose @ moved @ _OPTICAL,
            (width, height),
            focal=(lens.fx * across, lens.fy * down),
            # Coordinates of pixels are those of their middles.
            centre=(place.x() + (lens.cx + 0.5) * across, place.y() + (lens.cy + 0.5) * down),
        )


class _Visibility(Parts):
    """The displays of a scene, each of which a camera shows or not, in RViz's list."""

    def __init__(self, camera: CameraDisplay) -> None:
        super().__init__("Visibility", self._others, lambda: None)
        self._camera = camera

    def _others(self) -> list[str]:
        others = (one for one in self._displays() if one is not self._camera)
        return [_path_of(one).removeprefix("/") for one in others]

    def is_enabled(self, name: str) -> bool:
        """Return whether a display is shown, by its path without the first slash."""
        return not any(map(self._camera.hides, self._find(name)))

    def set_enabled(self, name: str, enabled: bool) -> None:
        """Show or hide a display, by its path without the first slash."""
        path = f"/{name}"
        hidden = [one for one in self._camera.hiddenDisplays if one != path]
        for one in self._find(name) if enabled else ():
            if one.name in hidden:
                # Others of its name stay hidden.
                others = (other for other in self._displays() if other.name == one.name)
                hidden = [other for other in hidden if other != one.name]
                hidden += [place for place in map(_path_of, others) if place != path]
        self._camera.hiddenDisplays = hidden if enabled else [*hidden, path]

    def _find(self, name: str) -> list[Display]:
        return [one for one in self._displays() if _path_of(one) == f"/{name}"]

    def _displays(self) -> list[Display]:
        scene = self._camera.scene
        return [] if scene is None else scene.displays


def _path_of(display: Display) -> str:
    """Return the names of the groups that a display is in, and its own, as ``/Group/Name``."""
    above = "" if display.group is None else _path_of(display.group)
    return f"{above}/{display.name}"


def _hidden_paths(saved: Any, above: str = "") -> Iterator[str]:
    """Iterate over the displays that a file's Visibility hides, also those in groups."""
    for name, value in saved.items() if isinstance(saved, dict) else ():
        if name == "Value":
            continue
        path = f"{above}/{name}"
        if value is False or (isinstance(value, dict) and value.get("Value") is False):
            yield path
        yield from _hidden_paths(value, path)


class CameraView(SceneView):
    """Draws the scene of a :class:`CameraDisplay` from its camera; for ``ImagePanel``."""

    displayChanged = Signal()

    def __init__(self, parent: Any = None, runtime: Runtime | None = None) -> None:
        super().__init__(parent, runtime)
        self._display: CameraDisplay | None = None
        self._set_background(QColor("transparent"))
        self.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
        self.setAcceptHoverEvents(False)
        self.setAcceptTouchEvents(False)

    def _get_display(self) -> QtCore.QObject | None:
        return self._display

    def _set_display(self, display: Any) -> None:
        before = self._display
        if display is before or not (display is None or isinstance(display, CameraDisplay)):
            return
        if before is not None and is_alive(before):
            before.pictureChanged.disconnect(self._on_picture)
        self._display = display
        if display is not None:
            display.pictureChanged.connect(self._on_picture)
        self.displayChanged.emit()
        self._on_picture()

    display = Property(QtCore.QObject, _get_display, _set_display, notify=displayChanged)

    @Slot()
    def _on_picture(self) -> None:
        display = self._display
        if display is not None and display.scene is not None:
            self._set_scene(display.scene)
        self.cameraChanged.emit()
        self.update()

    def wheelEvent(self, event: Any) -> None:
        """Leave the wheel to others: the camera is the robot's."""
        event.ignore()

    def _robot_camera(self) -> PinholeCamera | None:
        display = self._display
        if display is None or not is_alive(display):
            return None
        return display.camera_for(self.width(), self.height())

    def camera(self) -> Camera:
        """Return the robot's camera; any, where that is unknown."""
        return self._robot_camera() or super().camera()

    def _take_frame(self) -> Frame:
        frame, display = super()._take_frame(), self._display
        if display is None:
            return frame
        if not isinstance(frame.camera, PinholeCamera):
            return frame._replace(drawables=[])
        hidden = {one.root for one in self.scene.displays if display.hides(one)}
        if not hidden:
            return frame
        return frame._replace(
            drawables=[one for one in frame.drawables if not _is_in(one[0], hidden)]
        )


def _is_in(item: Item | None, groups: set[Any]) -> bool:
    while item is not None:
        if item in groups:
            return True
        item = item.parent
    return False
