"""The controls CameraView and CameraGrid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hands import click, key

from rosglass.comm import Time
from rosglass.qt import QtCore, optional

RAW, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
pytestmark = pytest.mark.both_qt


class Camera:
    """Publishes images, each other than the one before unless it is frozen."""

    def __init__(self, controls: Any, topic: str = "/camera/image_raw", type: str = RAW) -> None:
        self.publisher = controls.robot.create_publisher(topic, type)
        self._type, self._count = type, 0

    def send(
        self, frozen: bool = False, late: float = 0.0, size: tuple[int, int] = (48, 64)
    ) -> None:
        self._count += not frozen
        pixels = np.full((*size, 3), self._count % 250, np.uint8)
        now = Time.now()
        stamp = Time(now.nanoseconds - int(late * 1e9))
        header = {"stamp": stamp.to_dict()}
        if self._type == COMPRESSED:
            data = cv2.imencode(".png", pixels)[1]
            self.publisher.publish(header=header, format="png", data=data.reshape(-1))
            return
        self.publisher.publish(
            header=header,
            height=size[0],
            width=size[1],
            encoding="rgb8",
            step=size[1] * 3,
            data=pixels.reshape(-1),
        )


def streaming(wait: Any, camera: Camera, condition: Any, **more: Any) -> None:
    """Send images until a condition holds."""

    def is_so() -> bool:
        camera.send(**more)
        return bool(condition())

    wait(is_so)


def test_camera_is_found_and_shown_live(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { anchors.fill: parent }")
    assert view.property("status").startswith("NO SIGNAL")
    wait(camera.publisher.subscription_count)
    streaming(wait, camera, lambda: view.property("live"))
    assert view.property("topic_") == "/camera/image_raw"
    assert not controls.find("noSignal").property("visible")
    wait(lambda: not view.property("live"))
    assert "last image" in view.property("status")
    assert view.property("received"), "the last image stays under the veil"


def test_camera_that_was_found_is_kept(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { anchors.fill: parent }")
    wait(camera.publisher.subscription_count)
    other = Camera(controls, "/a/image_raw")
    wait(lambda: len(view.property("cameras").toVariant()) == 2)
    wait.settled(controls.engine_session)
    assert view.property("topic_") == "/camera/image_raw"
    assert not other.publisher.subscription_count()


def test_equal_images_are_frozen_not_live(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { anchors.fill: parent; frozenAfter: 0.5 }")
    wait(camera.publisher.subscription_count)
    streaming(wait, camera, lambda: view.property("live"))
    streaming(wait, camera, lambda: view.property("frozen"), frozen=True)
    assert not view.property("live")
    assert view.property("status").startswith("IMAGE FROZEN")
    streaming(wait, camera, lambda: view.property("live"))


def test_late_images_are_not_live(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { anchors.fill: parent }")
    wait(camera.publisher.subscription_count)
    streaming(wait, camera, lambda: view.property("late"), late=5.0)
    assert not view.property("live")
    assert view.property("status").startswith("IMAGE DELAYED")


def test_image_without_pixels_is_named(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { anchors.fill: parent }")
    wait(camera.publisher.subscription_count)
    reason = controls.find("reason")
    streaming(wait, camera, lambda: "0x0" in reason.property("text"), size=(0, 0))
    assert not view.property("live")
    streaming(wait, camera, lambda: view.property("live"))


def test_snapshot_is_saved_and_its_path_shown(controls: Any, wait: Any, tmp_path: Path) -> None:
    camera = Camera(controls)
    view = controls.show(f'CameraView {{ anchors.fill: parent; folder: "{tmp_path}" }}')
    view.snapshot()
    assert controls.find("note").property("text").startswith("NOT SAVED: no image")
    wait(camera.publisher.subscription_count)
    streaming(wait, camera, lambda: view.property("live"))
    click(controls, "snapshot")
    wait(lambda: bool(view.property("snapshotFile")))
    file = Path(view.property("snapshotFile"))
    assert file.parent == tmp_path
    assert cv2.imread(str(file)).shape == (48, 64, 3)
    assert str(file) in controls.find("note").property("text")
    view.setProperty("folder", str(tmp_path / "missing"))
    click(controls, "snapshot")
    wait(lambda: controls.find("note").property("text").startswith("NOT SAVED"))


def test_image_is_turned_and_filled(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { width: 400; height: 300 }")
    wait(camera.publisher.subscription_count)
    streaming(wait, camera, lambda: view.property("live"))
    assert view.property("imageRect").width() > view.property("imageRect").height()
    click(controls, "turn")
    assert view.property("imageRotation") == 90
    streaming(
        wait,
        camera,
        lambda: view.property("imageRect").width() < view.property("imageRect").height(),
    )
    click(controls, "fill")
    assert view.property("fillMode") == "crop"


def test_hidden_camera_is_not_received(controls: Any, wait: Any) -> None:
    camera = Camera(controls)
    view = controls.show("CameraView { anchors.fill: parent }")
    wait(camera.publisher.subscription_count)
    view.setProperty("visible", False)
    wait(lambda: camera.publisher.subscription_count() == 0)


@pytest.mark.parametrize(
    ("kind", "read"),
    [
        ("sensor_msgs/msg/JointState", lambda m: tuple(m.position)),
        ("geometry_msgs/msg/Vector3", lambda m: (m.z, m.y)),
    ],
    ids=["joints", "vector"],
)
def test_arrow_keys_aim_the_camera(controls: Any, wait: Any, kind: str, read: Any) -> None:
    got: list[Any] = []
    controls.robot.create_subscription("/ptz", kind, lambda message: got.append(read(message)))
    view = controls.show('CameraView { anchors.fill: parent; panTilt: "/ptz" }')
    wait(lambda: view.property("panFound_") == kind)
    wait(lambda: view.property("panPublisher_").property("isAdvertised"))
    view.forceActiveFocus()
    key(controls, "Left")
    wait(lambda: got)
    assert got[-1] == pytest.approx((0.05, 0))
    key(controls, "Down", "Right")
    wait(lambda: got[-1] == pytest.approx((0, 0.05)))


def test_speeds_end_with_three_zeros(controls: Any, wait: Any) -> None:
    got: list[tuple[float, float]] = []
    controls.robot.create_subscription(
        "/ptz", "geometry_msgs/msg/Twist", lambda m: got.append((m.angular.z, m.angular.y))
    )
    view = controls.show('CameraView { anchors.fill: parent; panTilt: "/ptz" }')
    wait(
        lambda: (
            view.property("panFound_") and view.property("panPublisher_").property("isAdvertised")
        )
    )
    view.forceActiveFocus()
    test: Any = optional("QtTest").QTest
    test.keyPress(controls.window, QtCore.Qt.Key.Key_Left)
    wait(lambda: len(got) > 3)
    assert set(got) == {(0.5, 0.0)}
    view.setProperty("visible", False)
    wait(lambda: got[-3:] == [(0.0, 0.0)] * 3)
    count = len(got)
    wait.nothing_happens(0.3)
    assert len(got) == count
    assert sum(speed == (0.0, 0.0) for speed in got) == 3


def test_grid_shows_all_cameras_and_makes_one_big(controls: Any, wait: Any) -> None:
    cameras = [
        Camera(controls, "/front/image_raw"),
        Camera(controls, "/left/image/compressed", COMPRESSED),
        Camera(controls, "/rear/image_raw"),
    ]
    grid = controls.show("CameraGrid { anchors.fill: parent }", 800, 600)
    wait(lambda: all(camera.publisher.subscription_count() for camera in cameras))
    streaming(wait, cameras[1], lambda: controls.find("camera_1").property("live"))
    assert controls.find("camera_1").property("topic") == "/left/image"
    click(controls, "cell_1")
    assert grid.property("big") == 1
    assert controls.find("cell_1").width() == 800
    wait(lambda: [c.publisher.subscription_count() for c in cameras] == [0, 1, 0])
    key(controls, "Right")
    assert grid.property("big") == 2
    wait(lambda: [c.publisher.subscription_count() for c in cameras] == [0, 0, 1])
    key(controls, "Escape")
    assert grid.property("big") == -1
    wait(lambda: all(camera.publisher.subscription_count() for camera in cameras))
    Camera(controls, "/a/image_raw")
    wait(lambda: len(grid.property("cameras").toVariant()) == 4)


def test_grid_receives_only_what_is_scrolled_into_view(controls: Any, wait: Any) -> None:
    cameras = [Camera(controls, f"/camera_{at:02}/image_raw") for at in range(12)]
    grid = controls.show(
        "CameraGrid { anchors.fill: parent; columns: 1; cellWidth: 320 }", 320, 400
    )
    wait(cameras[0].publisher.subscription_count)
    wait.settled(controls.engine_session)
    assert not cameras[-1].publisher.subscription_count()
    grid.forceActiveFocus()
    key(controls, *["Down"] * 11)
    wait(cameras[-1].publisher.subscription_count)
    wait(lambda: not cameras[0].publisher.subscription_count())
