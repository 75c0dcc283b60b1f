"""Items published as images, on real middleware and, where pixels matter, a real window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.images import PixelFormat, RawImage, convert, decompress

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from conftest import Bench

IMPORTS = "import QtQuick 2.15\nimport QtQuick.Window 2.15"
IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
#: Red with a blue bar at the top, a gap in it that shows nothing, and half-transparent white below.
PANEL = """
    Item {
        id: panel
        width: 64; height: 48
        Rectangle { width: 64; height: 32; color: "#dc1e1e" }
        Rectangle { width: 64; height: 16; color: "#2832e6" }
        Rectangle { y: 32; width: 64; height: 8; color: "#80ffffff" }
    }
"""


def window(publisher: str, more: str = "") -> str:
    return f"""
        Window {{
            id: root
            width: 200; height: 150; visible: true; color: "black"
            property alias pub: pub
            {PANEL}
            ImagePublisher {{ id: pub; source: panel; topic: "/panel/image"; {publisher} }}
            function state() {{
                return [pub.publishing, pub.frequency > 0, pub.dropped, pub.problem].join()
            }}
            function problem() {{ return pub.problem }}
            function publish() {{ return pub.publish() }}
            {more}
        }}
    """


class Robot:
    """Keeps what it receives."""

    def __init__(self, live: Bench, wait: Any) -> None:
        self.node, self.wait = live.robot, wait
        self.got: dict[str, list[Any]] = {}
        self.open: list[Any] = []

    def listen(self, topic: str, kind: str) -> list[Any]:
        found = self.got.setdefault(topic, [])
        self.open.append(self.node.create_subscription(topic, kind, found.append))
        return found

    def picture(self, found: list[Any]) -> np.ndarray:
        self.wait(lambda: found)
        return pixels(found[-1])


@pytest.fixture
def robot(live: Bench, wait: Any) -> Iterator[Robot]:
    made = Robot(live, wait)
    yield made
    for subscription in made.open:
        subscription.close()


def pixels(message: Any) -> np.ndarray:
    """Return a received image as rows x columns x channels, red first."""
    data = np.asarray(message.data)
    if hasattr(message, "format"):
        return shown(decompress(data, message.format))
    step, encoding = message.step, message.encoding
    return shown(RawImage(message.width, message.height, encoding, step, data))


def shown(raw: RawImage) -> np.ndarray:
    frame = convert(raw)
    found = np.asarray(frame.planes[0]).reshape(frame.height, frame.width, -1)
    return found[..., [2, 1, 0, 3]] if frame.format is PixelFormat.BGRA else found


def near(found: Any, wanted: tuple[int, ...], off: int = 2) -> bool:
    return bool(np.all(np.abs(np.asarray(found, int)[: len(wanted)] - wanted) <= off))


@pytest.mark.both_qt
@pytest.mark.parametrize("module", ["Ros2 1.0", "Ros 1.0"])
def test_a_panel_as_images(live: Bench, robot: Robot, module: str, wait: Any) -> None:
    live.module = module
    found = robot.listen("/panel/image", IMAGE)
    root: Any = live.load(window('frameId: "screen"; rate: 30'), IMPORTS)
    picture = robot.picture(found)
    message = found[-1]
    assert picture.shape[:2] == (48, 64)
    assert (message.encoding, message.step, message.header.frame_id) == ("rgb8", 192, "screen")
    assert near(picture[8, 32], (40, 50, 230))
    assert near(picture[24, 32], (220, 30, 30))
    # What is transparent is over black.
    assert near(picture[36, 32], (128, 128, 128))
    assert near(picture[44, 32], (0, 0, 0))
    wait(lambda: root.state() == "true,true,0,")
    wait(lambda: len(found) > 3)
    stamps = [m.header.stamp.nanoseconds for m in found]
    assert stamps == sorted(stamps)
    assert stamps[0] > 0


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("encoding", "bar"),
    [("bgr8", (40, 50, 230, 255)), ("rgba8", (40, 50, 230, 255)), ("mono8", (68,))],
)
def test_encodings(
    live: Bench, robot: Robot, encoding: str, bar: tuple[int, ...], wait: Any
) -> None:
    found = robot.listen("/panel/image", IMAGE)
    live.load(window(f'encoding: "{encoding}"; size: Qt.size(31, 24)'), IMPORTS)
    picture = robot.picture(found)
    assert (found[-1].encoding, picture.shape[:2]) == (encoding, (24, 31))
    assert near(picture[4, 16], bar, 4), picture[4, 16]


@pytest.mark.both_qt
@pytest.mark.parametrize(("kind", "encoding"), [("jpeg", "rgb8"), ("png", "rgba8")])
def test_compressed(live: Bench, robot: Robot, kind: str, encoding: str, wait: Any) -> None:
    found = robot.listen("/panel/image/compressed", COMPRESSED)
    setting = f'transport: "compressed"; format: "{kind}"; encoding: "{encoding}"; quality: 95'
    live.load(window(setting), IMPORTS)
    picture = robot.picture(found)
    assert near(picture[8, 32], (40, 50, 230), 12), (found[-1].format, picture[8, 32])
    assert near(picture[24, 32], (220, 30, 30), 12)


@pytest.mark.parametrize(("module", "name"), [("Ros2 1.0", "k"), ("Ros 1.0", "K")])
def test_camera_info_has_the_stamp_of_its_image(
    live: Bench, robot: Robot, module: str, name: str, wait: Any
) -> None:
    live.module = module
    infos, found = robot.listen("/panel/camera_info", INFO), robot.listen("/panel/image", IMAGE)
    matrix = "[50, 0, 32, 0, 50, 24, 0, 0, 1]"
    live.load(
        window(f'frameId: "eye"; cameraInfo: ({{ {name}: {matrix}, distortion_model: "none" }})'),
        IMPORTS,
    )
    wait(lambda: infos and found)

    def common() -> set[int]:
        return {m.header.stamp.nanoseconds for m in infos} & {
            m.header.stamp.nanoseconds for m in found
        }

    wait(lambda: len(common()) > 2)
    info = infos[-1]
    assert (info.width, info.height, info.header.frame_id) == (64, 48, "eye")
    assert info.distortion_model == "none"
    given = info.k if hasattr(info, "k") else info.K
    assert list(given) == [50, 0, 32, 0, 50, 24, 0, 0, 1]


def test_nothing_is_drawn_without_subscribers(live: Bench, robot: Robot, wait: Any) -> None:
    other = robot.listen("/elsewhere", IMAGE)
    root: Any = live.load(
        window("rate: 50", "function lazy() { pub.always = false }"),
        IMPORTS,
    )
    wait(lambda: "/panel/image" in live.robot.topics())
    live.load(
        window('rate: 50; topic: "/elsewhere"').replace('topic: "/panel/image";', ""), IMPORTS
    )
    wait(lambda: len(other) > 5)
    assert root.state() == "false,false,0,"
    assert root.publish() is False
    found = robot.listen("/panel/image", IMAGE)
    wait(lambda: found)
    wait(lambda: root.state().startswith("true,true"))


def test_always_and_rate_zero(live: Bench, robot: Robot, wait: Any) -> None:
    root: Any = live.load(window("rate: 0; always: true"), IMPORTS)
    wait(lambda: root.publish() is True)
    wait(lambda: root.state().startswith("true"))
    wait(lambda: root.state() == "false,false,0,")
    found = robot.listen("/panel/image", IMAGE)
    wait(lambda: found or not root.publish())


def test_frames_beyond_the_rate_are_dropped_and_the_newest_is_sent(
    live: Bench, robot: Robot, wait: Any
) -> None:
    found = robot.listen("/panel/image", IMAGE)
    root: Any = live.load(
        window(
            "rate: 0; always: true",
            "function burst() { for (let i = 0; i < 10; ++i) pub.publish(); return pub.dropped }",
        ),
        IMPORTS,
    )
    wait(lambda: root.publish() and found)
    wait(lambda: root.burst() >= 8)
    before = len(found)
    wait(lambda: len(found) > before)


def test_changes_while_it_runs(live: Bench, robot: Robot, wait: Any) -> None:
    found, others = robot.listen("/panel/image", IMAGE), robot.listen("/other", IMAGE)
    root: Any = live.load(
        window(
            "rate: 30",
            """
            Rectangle { id: second; y: 60; width: 20; height: 10; color: "lime" }
            function other() { pub.source = second; pub.topic = "/other" }
            function disable() { pub.enabled = false }
            function empty() { pub.source = null }
            """,
        ),
        IMPORTS,
    )
    robot.picture(found)
    root.other()
    picture = robot.picture(others)
    assert picture.shape[:2] == (10, 20)
    assert near(picture[5, 10], (0, 255, 0))
    root.empty()
    wait(lambda: "no source" in root.problem())
    root.disable()
    wait(lambda: root.state() == "false,false,0,")
    wait(lambda: not live.robot.publishers("/other"))
    live.session.shutdown()
    live.session.init("again")
    wait(lambda: live.session.state == "connected")
    assert root.state() == "false,false,0,"


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("rate: -1", "rate -1 is not from 0 to 120"),
        ("rate: NaN", "rate nan is not"),
        ('encoding: "yuv"', "encoding 'yuv' is not one of rgb8, bgr8, rgba8, mono8"),
        ('transport: "theora"', "transport 'theora' is not one of raw, compressed"),
        ('format: "gif"', "format 'gif' is not one of jpeg, png"),
        ("quality: 0", "quality 0 is not from 1 to 100"),
        ("size: Qt.size(-3, 100)", "size -3x100 is not from 1"),
        ("cameraInfo: 7", "cameraInfo must be an object"),
    ],
)
def test_impossible_values_are_refused(
    live: Bench, caplog: Any, wait: Any, setting: str, message: str
) -> None:
    live.load(window(setting), IMPORTS)
    assert message in caplog.text


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("source: null", "there is no source"),
        ('encoding: "rgba8"; transport: "compressed"', "JPEG has no transparency"),
        ("cameraInfo: ({ widht: 3 })", "widht"),
        ('topic: "/no topic"', "no topic"),
    ],
)
def test_problems_are_reported(
    live: Bench, robot: Robot, wait: Any, setting: str, message: str
) -> None:
    text = window("always: true; rate: 20; " + setting)
    name = setting.partition(":")[0]
    for given in ("source: panel;", 'topic: "/panel/image";'):
        if given.startswith(name + ":"):
            text = text.replace(given, "")
    root: Any = live.load(text, IMPORTS)
    wait(lambda: message in root.problem())


def test_images_that_subscribers_do_not_receive_are_a_problem(running: Bench, wait: Any) -> None:
    root: Any = running.load(window("always: true; rate: 30"), IMPORTS)
    with running.robot.create_subscription("/panel/image", COMPRESSED, print):
        wait(lambda: "subscribes to sensor_msgs/msg/CompressedImage here" in root.problem())
        assert root.problem().startswith("/panel/image: ")
    wait(lambda: root.problem() == "")


def test_item_without_window_is_a_problem(live: Bench, wait: Any) -> None:
    root: Any = live.load(
        """
        Item {
            width: 10; height: 10
            id: root
            ImagePublisher { id: pub; source: root; topic: "/x"; always: true }
            function problem() { return pub.problem }
        }
        """,
        "import QtQuick 2.15",
    )
    wait(lambda: "in no window that is shown" in root.problem())


@pytest.mark.both_qt
def test_a_screen_with_large_pixels(
    url: str, start: Any, screen: str, tmp_path: Path, wait: Any
) -> None:
    import rosglass

    file = tmp_path / "panel.qml"
    text = window('rate: 20; encoding: "rgba8"').replace(
        "id: root", 'Component.onCompleted: NAME.init("p"); id: root'
    )
    file.write_text(f"import Ros2 1.0\n{IMPORTS}\n{text.replace('NAME', 'Ros2')}")
    node = rosglass.connect(url, "eye")
    found: list[Any] = []
    with node, node.create_subscription("/panel/image", IMAGE, found.append):
        program = start("run", file, "--url", url, display=screen, QT_SCALE_FACTOR="2")
        wait(lambda: found)
        picture = pixels(found[-1])
        assert picture.shape[:2] == (96, 128)
        assert near(picture[16, 64], (40, 50, 230))
        assert near(picture[48, 64], (220, 30, 30))
        # Straight alpha, as everywhere in ROS.
        assert near(picture[72, 64], (255, 255, 255, 128))
        assert picture[90, 64, 3] == 0
        program.kill(15)
        program.end()
