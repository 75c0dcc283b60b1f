"""Cameras as each viewer wants them: turned, enlarged, in colours, rarely, paused, saved."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import pytest
from inside import image_of

from rosglass.comm import Time
from rosglass.qml.elements.image_sinks import ImageItem

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

RAW = "sensor_msgs/msg/Image"
#: Red, green / blue, yellow.
QUARTERS = np.array([[[220, 30, 30], [30, 200, 40]], [[40, 50, 230], [230, 220, 60]]], np.uint8)
ELEMENTS = {"Ros 1.0": "ImageTransportSubscriber", "Ros2 1.0": "ImageTransportSubscription"}


@pytest.fixture(params=ELEMENTS)
def module(request: Any, running: Any) -> str:
    running.module = request.param
    return ELEMENTS[request.param]


@pytest.fixture
def camera(running: Any) -> Any:
    return running.robot.create_publisher("/cam", RAW)


def load(bench: Any, properties: str = "", count: int = 1) -> Any:
    """Show the camera in items called `view0`, `view1` ..., by elements `sub0`, `sub1` ..."""
    element = ELEMENTS[bench.module]
    body = "".join(
        f"""property QtObject view{i}: ImageItem {{ id: item{i}; width: 64; height: 48 }}
        property QtObject sub{i}: {element} {{
            topic: "/cam"; videoSink: item{i}.videoSink; {properties}
        }}
        """
        for i in range(count)
    )
    return bench.load(f"Item {{ {body} }}", "import QtQuick 2.15")


def message(pixels: np.ndarray, encoding: str = "rgb8", **more: Any) -> dict:
    data = np.ascontiguousarray(pixels)
    return {
        "header": {"stamp": Time.now().to_dict()},
        "width": pixels.shape[1],
        "height": pixels.shape[0],
        "encoding": encoding,
        "step": data.nbytes // pixels.shape[0],
        "data": data.reshape(-1).view(np.uint8),
        **more,
    }


def quarters() -> dict:
    return message(QUARTERS.repeat(8, 0).repeat(8, 1))


def seen(root: Any, view: int = 0) -> np.ndarray | None:
    """Return the colours in the middle of the four quarters that an item shows."""
    item = root.property(f"view{view}")
    assert isinstance(item, ImageItem)
    image = image_of(item)
    if image is None:
        return None
    width, height = image.width(), image.height()
    places = [(x, y) for y in (height // 4, 3 * height // 4) for x in (width // 4, 3 * width // 4)]
    colours = [image.pixelColor(x, y).getRgb()[:3] for x, y in places]
    return np.array(colours, np.uint8).reshape(2, 2, 3)


def show(running: Any, camera: Any, wait: Any, root: Any, picture: dict) -> np.ndarray:
    wait(lambda: root.property("sub0").property("subscribed") and camera.subscription_count())
    camera.publish(picture)
    wait(lambda: seen(root) is not None)
    found = seen(root)
    assert found is not None
    return found


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("properties", "expected"),
    [
        ("", QUARTERS),
        ("rotation: 90", np.rot90(QUARTERS, -1)),
        ("rotation: 180", np.rot90(QUARTERS, 2)),
        ("rotation: -90", np.rot90(QUARTERS, 1)),
        ("mirrored: true", QUARTERS[:, ::-1]),
        ("flipped: true", QUARTERS[::-1]),
        ("regionOfInterest: Qt.rect(8, 0, 8, 16)", QUARTERS[:, [1, 1]]),
        ("zoom: 2", QUARTERS),
        ("regionOfInterest: Qt.rect(0, 0, 8, 8); mirrored: true", QUARTERS[[0, 0]][:, [0, 0]]),
    ],
)
def test_turned_mirrored_cut(
    running: Any, module: str, camera: Any, wait: Any, properties: str, expected: np.ndarray
) -> None:
    root = load(running, properties)
    np.testing.assert_array_equal(show(running, camera, wait, root, quarters()), expected)
    assert root.property("sub0").property("problem") == ""


def test_a_view_changes_without_a_gap(running: Any, camera: Any, wait: Any) -> None:
    root = load(running)
    sub = root.property("sub0")
    show(running, camera, wait, root, quarters())
    sub.setProperty("rotation", 180)
    wait.settled(running.session)
    assert seen(root) is not None
    assert not sub.property("stale")
    assert len(running.world.subscriptions) == 1
    camera.publish(quarters())
    wait(lambda: np.array_equal(seen(root), np.rot90(QUARTERS, 2)))


def test_viewers_of_one_camera_look_at_it_differently(
    running: Any, camera: Any, wait: Any, monkeypatch: Any
) -> None:
    from rosglass.qml.elements import image_rendering

    conversions: list[Any] = []
    real = image_rendering.convert

    def convert(image: Any, *rest: Any) -> Any:
        conversions.append(image)
        return real(image, *rest)

    monkeypatch.setattr(image_rendering, "convert", convert)
    root = load(running, count=4)
    root.property("sub1").setProperty("rotation", 90)
    root.property("sub3").setProperty("mirrored", True)
    for i in range(4):
        wait(
            lambda i=i: (
                root.property(f"sub{i}").property("subscribed") and camera.subscription_count()
            )
        )
    camera.publish(quarters())
    wait(lambda: all(seen(root, i) is not None for i in range(4)))
    np.testing.assert_array_equal(seen(root, 0), QUARTERS)
    np.testing.assert_array_equal(seen(root, 1), np.rot90(QUARTERS, -1))
    np.testing.assert_array_equal(seen(root, 2), QUARTERS)
    np.testing.assert_array_equal(seen(root, 3), QUARTERS[:, ::-1])
    assert len(running.world.subscriptions) == 1
    assert len(conversions) == 1
    # Those that want the same are given the very same.
    images = [image_of(root.property(f"view{i}")) for i in (0, 2)]
    assert images[0] is images[1]


def test_a_region_outside_the_image_concerns_only_its_viewer(
    running: Any, camera: Any, wait: Any
) -> None:
    root = load(running, count=2)
    wrong = root.property("sub1")
    wrong.setProperty("regionOfInterest", _rect(10, 10, 100, 100))
    wait(lambda: wrong.property("subscribed") and camera.subscription_count())
    show(running, camera, wait, root, quarters())
    wait(lambda: "not within the image of 16x16" in wrong.property("problem"))
    assert seen(root, 1) is None
    assert wrong.property("stale")
    assert root.property("sub0").property("problem") == ""
    wrong.setProperty("regionOfInterest", _rect(0, 0, 16, 16))
    wait(lambda: camera.publish(quarters()) or seen(root, 1) is not None)
    wait(lambda: wrong.property("problem") == "")


def _rect(*edges: float) -> Any:
    from rosglass.qt import QtCore

    return QtCore.QRectF(*edges)


@pytest.mark.parametrize(
    ("properties", "named"),
    [
        ("rotation: 45", "rotation 45"),
        ("zoom: 0.5", "zoom 0.5"),
        ("zoom: NaN", "zoom nan"),
        ("regionOfInterest: Qt.rect(-1, 0, 4, 4)", "regionOfInterest"),
        ("throttleRate: -1", "throttleRate -1"),
        ("throttleRate: Infinity", "throttleRate inf"),
        ("minimumDepth: NaN", "minimumDepth nan"),
        ("timeout: -1", "timeout -1"),
    ],
)
def test_impossible_values_are_refused_and_the_image_is_shown_as_before(
    running: Any,
    module: str,
    camera: Any,
    wait: Any,
    caplog: Any,
    properties: str,
    named: str,
) -> None:
    root = load(running, properties)
    assert any(named in r.getMessage() and module in r.getMessage() for r in caplog.records)
    np.testing.assert_array_equal(show(running, camera, wait, root, quarters()), QUARTERS)


@pytest.mark.both_qt
class TestDepth:
    def depths(self) -> dict:
        near, far = np.full((8, 8), 500), np.full((8, 8), 3000)
        unknown = np.zeros((8, 8))
        rows = [np.hstack([near, far]), np.hstack([unknown, far])]
        return message(np.vstack(rows).astype(np.uint16), "16UC1")

    def test_near_and_far_have_different_colors_and_unknown_is_black(
        self, running: Any, module: str, camera: Any, wait: Any
    ) -> None:
        root = load(running, 'colorMap: "turbo"; minimumDepth: 0.5; maximumDepth: 3')
        (near, far), (unknown, again) = show(running, camera, wait, root, self.depths())
        assert tuple(unknown) == (0, 0, 0)
        assert near[2] > near[0], "blue is near"
        assert far[0] > far[2], "red is far"
        np.testing.assert_array_equal(far, again)

    def test_metres_and_millimetres_get_the_same_colours(
        self, running: Any, camera: Any, wait: Any
    ) -> None:
        root = load(running, 'colorMap: "gray"; minimumDepth: 0; maximumDepth: 5')
        wait(lambda: root.property("sub0").property("subscribed") and camera.subscription_count())
        for millimetres in (500, 2500, 4800):
            shown = []
            for encoding, unit, kind in (("16UC1", 1, np.uint16), ("32FC1", 0.001, np.float32)):
                camera.publish(message(np.full((4, 4), millimetres * unit, kind), encoding))
                wait(lambda e=encoding: root.property("sub0").property("encoding") == e)
                shown.append(seen(root))
            np.testing.assert_allclose(shown[0], shown[1], atol=1)
            np.testing.assert_allclose(shown[0], 255 * millimetres / 5000, atol=1)

    def test_images_without_depths_are_shown_as_they_are(
        self, running: Any, camera: Any, wait: Any
    ) -> None:
        root = load(running, 'colorMap: "turbo"')
        np.testing.assert_array_equal(show(running, camera, wait, root, quarters()), QUARTERS)

    def test_a_wrong_setting_is_said_and_the_last_good_one_kept(
        self, running: Any, camera: Any, wait: Any
    ) -> None:
        root = load(running, 'colorMap: "gray"; minimumDepth: 0; maximumDepth: 5')
        sub = root.property("sub0")
        show(running, camera, wait, root, self.depths())
        before = seen(root)
        sub.setProperty("colorMap", "rainbow")
        wait(lambda: "'rainbow' is unknown" in sub.property("problem"))
        camera.publish(self.depths())
        wait.settled(running.session)
        np.testing.assert_array_equal(seen(root), before)
        sub.setProperty("colorMap", "viridis")
        wait(lambda: sub.property("problem") == "")
        sub.setProperty("minimumDepth", 6.0)
        wait(lambda: "far must be beyond near" in sub.property("problem"))


class Filming:
    """Publishes numbered images at a rate, in a thread."""

    def __init__(self, camera: Any, rate: float) -> None:
        self.count = 0
        self._camera, self._period = camera, 1 / rate
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._film)
        self._thread.start()

    def _film(self) -> None:
        due = time.monotonic()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            self._camera.publish(quarters())
            self.count += 1
            due += self._period

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()


@pytest.fixture
def filming(camera: Any) -> Iterator[Filming]:
    made = Filming(camera, 40)
    yield made
    made.stop()


class TestThrottle:
    def test_rarely_wanted_images_are_fetched_one_by_one(
        self, running: Any, module: str, camera: Any, wait: Any, filming: Filming
    ) -> None:
        root = load(running, "throttleRate: 2")
        sub = root.property("sub0")
        shown: list[float] = []
        view = root.property("view0")
        view.present = lambda image: shown.append(time.monotonic())
        wait(lambda: len(shown) >= 3)
        # Between two images nothing is received: the robot need not send, nor compress.
        wait(lambda: not running.world.subscriptions)
        assert sub.property("subscribed"), "it is about to be fetched"
        stream = next(iter(running.session.streams.values())).stream
        sent, got, received = filming.count, len(shown), stream.statistics().received
        wait(lambda: len(shown) >= got + 4)
        assert not sub.property("stale")
        assert stream.statistics().received - received < (filming.count - sent) / 3
        assert shown[-1] - shown[0] > (len(shown) - 1) / 2 * 0.8

    def test_one_viewer_that_wants_all_gets_all(
        self, running: Any, camera: Any, wait: Any, filming: Filming
    ) -> None:
        root = load(running, "throttleRate: 2", count=2)
        slow, fast = root.property("sub0"), root.property("sub1")
        wait(lambda: not running.world.subscriptions and seen(root) is not None)
        fast.setProperty("throttleRate", 0)
        wait(lambda: fast.property("framerate") > 20)
        assert running.world.subscriptions
        wait(lambda: 0 < slow.property("framerate") < 4)
        fast.setProperty("enabled", False)
        wait(lambda: not running.world.subscriptions)

    def test_without_load_balancing_the_rest_is_not_decoded(
        self, running: Any, module: str, camera: Any, wait: Any, filming: Filming
    ) -> None:
        uri = running.module
        running.load("QtObject { property var m: ImageTransportManager }")
        assert running.run(
            "let before = ImageTransportManager.loadBalancingEnabled;"
            "ImageTransportManager.setLoadBalancingEnabled(false);"
            "return [before, ImageTransportManager.loadBalancingEnabled]"
        ) == [True, False]
        assert running.module == uri
        root = load(running, "throttleRate: 4")
        sub = root.property("sub0")
        wait(lambda: filming.count > 60)
        assert len(running.world.subscriptions) == 1
        stream = next(iter(running.session.streams.values()))
        counts = stream.stream.statistics()
        assert counts.shown < counts.received / 3
        assert sub.property("dropped") < counts.received / 3, (
            "images beyond the throttle rate do not count as dropped"
        )
        assert 0 < sub.property("framerate") < 8

    def test_repeated_image_is_not_a_new_one(self, running: Any, camera: Any, wait: Any) -> None:
        """Latched ROS 1 publishers send their last image to each new subscriber."""
        root = load(running, "throttleRate: 50; timeout: 500")
        sub = root.property("sub0")
        wait(lambda: sub.property("subscribed") and camera.subscription_count())
        old = quarters()
        camera.publish(old)
        wait(lambda: seen(root) is not None)
        until = time.monotonic() + 10
        while seen(root) is not None:
            camera.publish(old)
            wait.nothing_happens(0.02)
            assert time.monotonic() < until, "it was shown as live again and again"
        assert sub.property("stale")

    def test_throttled_images_do_not_time_out_between_their_turns(
        self, running: Any, camera: Any, wait: Any, filming: Filming
    ) -> None:
        root = load(running, "throttleRate: 0.5; timeout: 1500")
        sub = root.property("sub0")
        wait(lambda: seen(root) is not None)
        until = time.monotonic() + 5
        while time.monotonic() < until and filming.count:
            assert seen(root) is not None or time.monotonic() > until
            wait.nothing_happens(0.02)
        filming.stop()
        wait(lambda: seen(root) is None and sub.property("stale"))


class TestPlayback:
    def test_pause_keeps_the_image_and_says_that_it_is_old(
        self, running: Any, module: str, camera: Any, wait: Any
    ) -> None:
        root = load(running)
        sub = root.property("sub0")
        assert sub.property("playbackState") == 1
        show(running, camera, wait, root, quarters())
        sub.pause()
        assert sub.property("playbackState") == 2
        assert sub.property("stale")
        camera.publish(message(np.zeros((16, 16, 3), np.uint8)))
        # Nothing is received any more, after a moment in which changing one's mind costs nothing.
        wait(lambda: not running.world.subscriptions)
        np.testing.assert_array_equal(seen(root), QUARTERS)
        sub.play()
        wait(lambda: sub.property("subscribed") and camera.subscription_count())
        camera.publish(message(np.zeros((16, 16, 3), np.uint8)))
        wait(lambda: np.array_equal(seen(root), np.zeros((2, 2, 3))))
        assert not sub.property("stale")

    def test_stop_takes_it_off_the_screen(
        self, running: Any, module: str, camera: Any, wait: Any
    ) -> None:
        root = load(running)
        sub = root.property("sub0")
        show(running, camera, wait, root, quarters())
        sub.pause()
        wait.settled(running.session)
        sub.stop()
        assert (sub.property("playbackState"), sub.property("enabled")) == (0, False)
        wait(lambda: seen(root) is None)
        sub.play()
        assert (sub.property("playbackState"), sub.property("enabled")) == (1, True)
        show(running, camera, wait, root, quarters())

    def test_another_topic_does_not_show_the_paused_image(
        self, running: Any, camera: Any, wait: Any
    ) -> None:
        root = load(running)
        show(running, camera, wait, root, quarters())
        root.property("sub0").pause()
        root.property("sub0").setProperty("topic", "/other")
        assert seen(root) is None

    def test_the_states_have_names(self, running: Any, module: str) -> None:
        names = ", ".join(f"{module}.{name}State" for name in ("Stopped", "Playing", "Paused"))
        assert running.run(f"return [{names}]") == [0, 1, 2]


@pytest.mark.both_qt
class TestSnapshot:
    def load(self, running: Any, properties: str = "") -> Any:
        element = ELEMENTS[running.module]
        return running.load(
            f"""Item {{
                property QtObject view0: ImageItem {{ id: item; width: 64; height: 48 }}
                property var results: []
                property QtObject sub0: {element} {{
                    id: camera; topic: "/cam"; videoSink: item.videoSink; {properties}
                    onSnapshotSaved: (path) => results.push("saved " + path)
                    onSnapshotFailed: (reason) => results.push("failed " + reason)
                }}
                function save(path) {{
                    camera.saveSnapshot(path).then((p) => results.push("kept " + p),
                                                   (e) => results.push("refused " + e.message))
                }}
                function list() {{ return results.join("|") }}
            }}""",
            "import QtQuick 2.15",
        )

    def test_shown_image_is_saved(
        self, running: Any, module: str, camera: Any, wait: Any, tmp_path: Path
    ) -> None:
        root = self.load(running, "rotation: 90")
        show(running, camera, wait, root, quarters())
        plain, url = tmp_path / "a b.png", tmp_path / "c.jpg"
        root.save(str(plain))
        root.save(f"file://{url}")
        wait(lambda: root.list().count("kept") == 2)
        assert f"saved {plain}|" in root.list()
        assert f"kept {url}" in root.list()
        pixels = cv2.imread(str(plain))[..., ::-1]
        np.testing.assert_array_equal(pixels[4::8, 4::8], np.rot90(QUARTERS, -1))
        assert cv2.imread(str(url)).shape == (16, 16, 3)

    def test_snapshot_errors_are_reported(
        self, running: Any, module: str, camera: Any, wait: Any, tmp_path: Path
    ) -> None:
        root = self.load(running)
        root.save(str(tmp_path / "early.png"))
        wait(lambda: "refused" in root.list())
        assert "no image is shown" in root.list()
        show(running, camera, wait, root, quarters())
        root.save(str(tmp_path / "a.gif"))
        root.save(str(tmp_path / "nowhere" / "a.png"))
        wait(lambda: root.list().count("failed") == 3)
        assert "cannot be saved as '.gif'" in root.list()
        assert "nowhere/a.png: cannot be written" in root.list()

    def test_depths_are_saved_with_all_their_bits(
        self, running: Any, camera: Any, wait: Any, tmp_path: Path
    ) -> None:
        root = self.load(running)
        depths = np.arange(64, dtype=np.uint16).reshape(8, 8) * 1000
        show(running, camera, wait, root, message(depths, "16UC1"))
        file = tmp_path / "depth.png"
        root.save(str(file))
        wait(lambda: "kept" in root.list())
        np.testing.assert_array_equal(cv2.imread(str(file), cv2.IMREAD_UNCHANGED), depths)


def test_the_namespace_of_ros_1(running: Any, wait: Any) -> None:
    running.module = "Ros 1.0"
    arm = running.robot.create_publisher("/arm/cam", RAW)
    root = load(running, 'ns: "arm"')
    sub = root.property("sub0")
    sub.setProperty("topic", "cam")
    np.testing.assert_array_equal(show(running, arm, wait, root, quarters()), QUARTERS)
    assert sub.property("topic") == "/arm/cam"
    assert sub.property("ns") == "/arm"


class TestReduction:
    """Images have no more pixels than the screen shows of them."""

    @pytest.fixture
    def window(self, app: Any) -> Iterator[Any]:
        from rosglass.qt import QtQuick

        made = QtQuick.QQuickWindow()
        made.resize(200, 200)
        yield made
        made.close()

    def width(self, root: Any) -> int:
        image = image_of(root.property("view0"))
        return 0 if image is None else image.width()

    def test_large_image_is_reduced_until_it_is_needed_whole(
        self, running: Any, module: str, camera: Any, wait: Any, window: Any, tmp_path: Path
    ) -> None:
        root = load(running)
        item, sub = root.property("view0"), root.property("sub0")
        item.setParentItem(window.contentItem())
        large = message(QUARTERS.repeat(96, 0).repeat(128, 1))

        def shown(width: int) -> bool:
            camera.publish(large)
            return self.width(root) == width

        wait(lambda: shown(64))
        np.testing.assert_array_equal(seen(root), QUARTERS)
        file = tmp_path / "whole.png"
        sub.saveSnapshot(str(file))
        wait(file.exists)
        assert cv2.imread(str(file)).shape == (192, 256, 3)
        # Enlarged by whatever means, it needs more of them.
        item.setScale(2)
        wait(lambda: shown(128))
        item.setScale(1)
        item.setWidth(256)
        item.setHeight(192)
        wait(lambda: shown(256))
        item.setWidth(64)
        item.setHeight(48)
        wait(lambda: shown(64))
        sub.setProperty("fullResolution", True)
        wait(lambda: shown(256))

    def test_turned_images_are_measured_against_their_other_side(
        self, running: Any, camera: Any, wait: Any, window: Any
    ) -> None:
        root = load(running, "rotation: 90")
        item = root.property("view0")
        item.setParentItem(window.contentItem())
        item.setWidth(48)
        item.setHeight(64)
        large = message(QUARTERS.repeat(96, 0).repeat(128, 1))
        # 256 x 192 on 48 x 64: a quarter of each side.
        wait(lambda: camera.publish(large) or self.width(root) == 48)

    def test_a_part_of_an_image_is_not_reduced(
        self, running: Any, camera: Any, wait: Any, window: Any
    ) -> None:
        root = load(running, "regionOfInterest: Qt.rect(0, 0, 128, 96)")
        root.property("view0").setParentItem(window.contentItem())
        large = message(QUARTERS.repeat(96, 0).repeat(128, 1))
        wait(lambda: camera.publish(large) or self.width(root) == 128)


@pytest.mark.both_qt
@pytest.mark.usefixtures("running")
def test_an_item_lets_a_source_go_that_is_gone_already() -> None:
    from rosglass.qt import QtCore, send_deferred_deletes

    item, source = ImageItem(), QtCore.QObject()
    item.setProperty("source", source)
    assert source.property("videoSink") is item
    source.deleteLater()
    send_deferred_deletes()
    item.setProperty("source", None)
    assert item.property("source") is None
