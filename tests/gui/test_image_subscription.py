"""The element ImageTransportSubscription with an ImageItem, which needs no graphics card."""

from __future__ import annotations

import threading
import time
from typing import Any

import cv2
import numpy as np
import pytest
from inside import image_of
from waiting import at_rate

from rosglass.comm import Time

RAW, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
RED, BLUE = (250, 20, 10), (10, 20, 250)


def load(bench: Any, properties: str = 'topic: "/cam"', more: str = "") -> Any:
    return bench.load(
        """Item {
            property QtObject item: ImageItem { id: view; width: 64; height: 48 }
            property QtObject sub: ImageTransportSubscription { videoSink: view.videoSink; %s }
            %s
        }""".replace("%s", properties, 1).replace("%s", more, 1),
        "import QtQuick 2.15",
    )


def picture(colour: tuple = RED, encoding: str = "rgb8", **more: Any) -> dict:
    data = np.full((8, 16, 3), colour, np.uint8).tobytes()
    return {
        "header": {"stamp": Time.now().to_dict()},
        "width": 16,
        "height": 8,
        "encoding": encoding,
        "step": 48,
        "data": data,
        **more,
    }


def jpeg(colour: tuple = RED) -> dict:
    ok, data = cv2.imencode(".jpg", np.full((8, 16, 3), colour[::-1], np.uint8))
    assert ok
    return {"header": {"stamp": Time.now().to_dict()}, "format": "jpeg", "data": data.ravel()}


def colour(root: Any) -> tuple | None:
    """Return the colour that the item shows, None when it is blank."""
    from rosglass.qml.elements.image_sinks import ImageItem

    item = root.property("item")
    assert isinstance(item, ImageItem)
    image = image_of(item)
    return None if image is None else image.pixelColor(3, 3).getRgb()[:3]


@pytest.fixture
def camera(running: Any) -> Any:
    return running.robot.create_publisher("/cam", RAW)


@pytest.mark.both_qt
def test_raw_images_are_shown(running: Any, camera: Any, wait: Any) -> None:
    root = load(running)
    sub = root.property("sub")
    assert sub.property("stale")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    camera.publish(picture())
    wait(lambda: colour(root) == RED)
    assert not sub.property("stale")
    assert (sub.property("encoding"), sub.property("isColor"), sub.property("hasAlpha")) == (
        "rgb8",
        True,
        False,
    )
    camera.publish(picture(BLUE))
    wait(lambda: colour(root) == BLUE)
    wait(lambda: sub.property("latency") >= 0)
    assert sub.property("transport") == "raw"
    assert sub.property("problem") == ""


def test_the_preferred_transport_wins_as_soon_as_it_is_there(
    running: Any, camera: Any, wait: Any
) -> None:
    root = load(running)
    sub = root.property("sub")
    wait(lambda: sub.property("transport") == "raw")
    compressed = running.robot.create_publisher("/cam/compressed", COMPRESSED)
    wait(lambda: sub.property("transport") == "compressed" and compressed.subscription_count())
    compressed.publish(jpeg(BLUE))
    wait(lambda: colour(root) is not None)
    assert np.allclose(colour(root), BLUE, atol=6)
    assert not running.world.nodes[0].subscriptions("/cam")
    sub.setProperty("defaultTransport", "raw")
    wait(lambda: sub.property("transport") == "raw" and camera.subscription_count())
    camera.publish(picture(RED))
    wait(lambda: colour(root) == RED)


def test_all_viewers_share_one_stream(running: Any, camera: Any, wait: Any) -> None:
    roots = [load(running) for _ in range(3)]
    for root in roots:
        wait(
            lambda root=root: (
                root.property("sub").property("subscribed") and camera.subscription_count()
            )
        )
    assert len(running.world.subscriptions) == 1
    camera.publish(picture())
    for root in roots:
        wait(lambda root=root: colour(root) == RED)
    late = load(running)
    wait(lambda: colour(late) == RED)
    for root in (*roots, late):
        root.property("sub").setProperty("enabled", False)
    wait.settled(running.session)
    assert len(running.world.subscriptions) == 1
    roots[0].property("sub").setProperty("enabled", True)
    wait.nothing_happens(1.2)
    assert len(running.world.subscriptions) == 1
    roots[0].deleteLater()
    wait(lambda: not running.world.subscriptions)


def test_nothing_is_received_without_a_sink(running: Any, camera: Any, wait: Any) -> None:
    root = running.load(
        'QtObject { property QtObject sub: ImageTransportSubscription { topic: "/cam" } }'
    )
    wait.settled(running.session)
    assert not root.property("sub").property("subscribed")
    assert not running.world.subscriptions


class TestStale:
    @pytest.fixture
    def live(self, running: Any, camera: Any, wait: Any) -> Any:
        root = load(running, 'topic: "/cam"; timeout: 400')
        wait(lambda: root.property("sub").property("subscribed") and camera.subscription_count())
        camera.publish(picture())
        wait(lambda: colour(root) == RED)
        return root

    def test_the_image_goes_blank_after_the_timeout(
        self, live: Any, camera: Any, wait: Any
    ) -> None:
        wait(lambda: colour(live) is None)
        assert live.property("sub").property("stale")
        camera.publish(picture(BLUE))
        wait(lambda: colour(live) == BLUE)
        assert not live.property("sub").property("stale")

    def test_without_timeout_it_stays_but_is_stale(self, live: Any, wait: Any) -> None:
        live.property("sub").setProperty("timeout", 0)
        wait(lambda: live.property("sub").property("stale"))
        assert colour(live) == RED

    def test_it_is_stale_at_once_when_the_camera_goes(
        self, live: Any, camera: Any, wait: Any
    ) -> None:
        live.property("sub").setProperty("timeout", 0)
        camera.close()
        wait(lambda: live.property("sub").property("stale"), timeout=0.5)

    def test_disabling_and_shutdown_take_it_off_the_screen(
        self, live: Any, running: Any, camera: Any, wait: Any
    ) -> None:
        live.property("sub").setProperty("enabled", False)
        wait(lambda: colour(live) is None, timeout=0.3)
        live.property("sub").setProperty("enabled", True)
        wait(lambda: live.property("sub").property("subscribed") and camera.subscription_count())
        camera.publish(picture(BLUE))
        wait(lambda: colour(live) == BLUE)
        running.session.shutdown()
        wait(lambda: colour(live) is None, timeout=0.3)
        assert live.property("sub").property("stale")
        running.session.init("again")
        wait(lambda: live.property("sub").property("subscribed") and camera.subscription_count())
        camera.publish(picture(RED))
        wait(lambda: colour(live) == RED)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (picture(encoding="rgb99"), "'rgb99' cannot be shown"),
        (picture(step=10), "step is 10"),
        (picture(data=b"123"), "data has 3"),
        (picture(width=2**32 - 1, height=2**32 - 1), "more than"),
    ],
)
def test_bad_images_are_named_once_and_the_stream_goes_on(
    running: Any, camera: Any, wait: Any, caplog: Any, bad: dict, reason: str
) -> None:
    root = load(running)
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    for _ in range(5):
        camera.publish(bad)
        wait.settled(running.session)
    wait(lambda: reason in sub.property("problem"))
    assert sub.property("stale")
    assert sum(reason in r.getMessage() for r in caplog.records) == 1
    camera.publish(picture())
    wait(lambda: colour(root) == RED)
    wait(lambda: sub.property("problem") == "")


@pytest.mark.both_qt
def test_malformed_messages_are_named(running: Any, camera: Any, wait: Any) -> None:
    root = load(running)
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    # More than once: the first one may come before the subscription is known everywhere.
    bad = b"\0\1\0\0" + b"\xff" * 30
    wait(lambda: camera.publish_serialized(bad) or sub.property("problem"))
    camera.publish(picture())
    wait(lambda: colour(root) == RED)


@pytest.mark.parametrize(
    ("properties", "reason"),
    [
        ('topic: "/a b"', "/a b"),
        ('topic: "/cam"; defaultTransport: "teleport"', "'teleport' is unknown"),
        ('topic: "/chat"', "not images"),
    ],
)
def test_unusable_topic_is_a_problem(
    running: Any, camera: Any, wait: Any, properties: str, reason: str
) -> None:
    running.robot.create_publisher("/chat", "std_msgs/msg/String")
    sub = load(running, properties).property("sub")
    wait(lambda: reason in sub.property("problem"))


@pytest.mark.both_qt
def test_other_sinks_are_refused(running: Any, caplog: Any) -> None:
    running.load(
        "Item { id: i; property QtObject s: ImageTransportSubscription { videoSink: i } }",
        "import QtQuick 2.15",
    )
    assert "videoSink must be" in caplog.text


def test_the_newest_wins_and_drops_are_counted(running: Any, camera: Any, wait: Any) -> None:
    root = load(running)
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    # The GUI thread is busy: only the last of these can be shown.
    for i in at_rate(0.02, 10):
        camera.publish(picture((i, i, i)))
    wait(lambda: colour(root) == (9, 9, 9))
    wait(lambda: sub.property("dropped") == 9)


def test_rate_and_latency_are_not_rounded(running: Any, camera: Any, wait: Any) -> None:
    root = load(running)
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    stop, sent = threading.Event(), []

    def film() -> None:
        due = time.monotonic()
        while not stop.is_set():
            camera.publish(picture())
            sent.append(time.monotonic())
            due += 1 / 33.3
            stop.wait(max(0.0, due - time.monotonic()))

    thread = threading.Thread(target=film)
    thread.start()
    try:
        wait(lambda: len(sent) > 60)
    finally:
        stop.set()
        thread.join()
    rate = (len(sent) - 1) / (sent[-1] - sent[0])  # 33.3 on a machine that is not loaded
    assert sub.property("framerate") == pytest.approx(rate, rel=0.5)
    assert sub.property("framerate") % 1
    assert 0 < sub.property("processingLatency") < 5000
    assert 0 < sub.property("networkLatency") < 5000
    assert sub.property("latency") == pytest.approx(
        sub.property("networkLatency") + sub.property("processingLatency"), abs=0.5
    )
    wait(lambda: sub.property("framerate") < 10)
    # What is not live has no rate and no latency any more.
    wait(lambda: sub.property("stale"))
    wait(lambda: sub.property("framerate") == 0)
    assert sub.property("latency") == sub.property("networkLatency") == -1


@pytest.mark.both_qt
def test_a_sink_that_is_destroyed_ends_the_subscription(
    running: Any, camera: Any, wait: Any
) -> None:
    root = running.load(
        """Item {
            id: root
            property QtObject sub: ImageTransportSubscription { topic: "/cam" }
            property Component maker: Component { ImageItem { } }
            property var view
            Component.onCompleted: { view = maker.createObject(root); view.source = sub }
            function drop() { view.destroy() }
        }""",
        "import QtQuick 2.15",
    )
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    root.drop()
    for _ in range(5):
        camera.publish(picture())
        wait.settled(running.session)
    wait(lambda: not sub.property("subscribed"))
    assert sub.property("videoSink") is None


@pytest.mark.parametrize("timeout", [2000, 0])
def test_images_that_a_silent_link_kept_back_are_not_live(
    running: Any, camera: Any, wait: Any, timeout: int
) -> None:
    root = load(running, f'topic: "/cam"; timeout: {timeout}')
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed") and camera.subscription_count())
    camera.publish(picture(RED))
    wait(lambda: colour(root) == RED)
    running.world.held_back_s = 10
    camera.publish(picture(BLUE))
    if timeout:
        wait.settled(running.session)
        assert colour(root) == RED
    else:
        # It is configured to keep old images on the screen, and marks this one as stale.
        wait(lambda: colour(root) == BLUE)
        assert sub.property("stale")
    running.world.held_back_s = 0
    camera.publish(picture(BLUE))
    wait(lambda: colour(root) == BLUE and not sub.property("stale"))


def test_camera_without_publisher_is_logged(
    running: Any, camera: Any, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr("rosglass.qml.elements.element.NO_PEER_MS", 20)
    caplog.set_level("INFO", "rosglass.qml")
    root = load(running, 'topic: "/camm"')
    wait(lambda: "/camm: this topic has no publisher; did you mean /cam?" in caplog.text)
    caplog.clear()
    root.property("sub").setProperty("topic", "/cam")
    wait(lambda: root.property("sub").property("subscribed") and camera.subscription_count())
    load(running, 'topic: "/camera"')
    # The other one would have been logged before.
    wait(lambda: "/camera: this topic has no publisher" in caplog.text)
    assert caplog.text.count("this topic has no publisher") == 1


def test_image_that_comes_while_its_stream_is_made(
    running: Any, camera: Any, wait: Any, monkeypatch: Any
) -> None:
    from rosglass.qml.elements import image_stream

    answers = []

    class Eager(image_stream.ImageStream):
        def __init__(self, *given: Any, **options: Any) -> None:
            super().__init__(*given, **options)
            answers.append(given[-1]())  # the first image is there already

    monkeypatch.setattr(image_stream, "ImageStream", Eager)
    root = load(running)
    wait(lambda: root.property("sub").property("subscribed") and camera.subscription_count())
    camera.publish(picture(RED))
    wait(lambda: colour(root) == RED)
    # A latched one arrives only once.
    assert answers == [True]


def test_image_whose_stamp_is_old_is_not_shown(running: Any, camera: Any, wait: Any) -> None:
    root, all_shown = load(running), load(running)
    sub = root.property("sub")
    all_shown.property("sub").setProperty("timeout", 0)
    wait(lambda: sub.property("subscribed") and camera.subscription_count())

    def send(color: Any, age: float) -> None:
        stamp = Time(time.time_ns() - round(age * 1e9))
        camera.publish({**picture(color), "header": {"stamp": stamp, "frame_id": "cam"}})

    def is_shown(color: Any, age: float) -> bool:
        send(color, age)
        return bool(colour(root) == color)

    for _ in range(3):
        wait(lambda: is_shown(RED, 0.0))
    send(BLUE, 12.4)
    wait(lambda: colour(all_shown) == BLUE)
    assert colour(root) != BLUE
    wait(lambda: is_shown(RED, 0.0))
    assert not sub.property("stale")
