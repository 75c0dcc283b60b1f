"""Recordings in the window of ``rosglass cockpit``, and recording from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

from mcap import writer as mcap_writer
from rosbags import rosbag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import rosglass
from rosglass.bags import MARKS_TOPIC, open_bag, read_marks
from rosglass.interfaces import full_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


@pytest.fixture
def running(bench: Any, tmp_path: Path, wait: Any) -> Iterator[Any]:
    """A bench whose session connects to addresses; at first to a robot in memory."""
    from rosglass.qml import Session, install
    from rosglass.qt import QtQml, send_deferred_deletes

    session = Session("local://robot")
    engine = QtQml.QQmlEngine()
    install(engine, session)
    made = type(bench)(session, engine, bench.world, tmp_path / "qml")
    made.robot.close()
    made.robot = rosglass.connect("local://robot", "robot")
    session.init("ui")
    wait(lambda: session.node is not None)
    yield made
    made.close()
    made.robot.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()


SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
BATTERY = "sensor_msgs/msg/BatteryState"


def write_mcap(path: Path, seconds: int = 10) -> Path:
    """A battery that is discharged, ten times a second, and a mark in the middle."""
    battery: Any = rosglass.load(BATTERY)
    text: Any = rosglass.load("std_msgs/msg/String")
    with path.open("wb") as stream:
        writer = mcap_writer.Writer(stream, chunk_size=4096)
        writer.start("ros2")

        def channel(topic: str, kind: Any) -> int:
            schema = writer.register_schema(
                kind.name, "ros2msg", full_text(kind.definition).encode()
            )
            return writer.register_channel(topic, "cdr", schema)

        number, marks = channel("/battery", battery), channel(MARKS_TOPIC, text)
        for at in range(seconds * 10 + 1):
            time = START + at * SECOND // 10
            stamp = {"sec": time // SECOND, "nanosec": time % SECOND}
            fields = {"header": {"stamp": stamp}, "percentage": 1 - at / (seconds * 10)}
            writer.add_message(number, time, battery.encode(fields), time)
            if at == seconds * 5:
                writer.add_message(marks, time, text.encode({"data": "half"}), time)
        writer.finish()
    return path


def write_rosbags(path: Path) -> Path:
    """The same battery as a ROS 1 bag or in SQLite, by the ``rosbags`` package."""
    ros1 = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    with (
        rosbag1.Writer(path)
        if ros1
        else Writer2(path.parent / "bag", version=8, storage_plugin=StoragePlugin.SQLITE3)
    ) as writer:
        number = writer.add_connection("/imu", "geometry_msgs/msg/Vector3", typestore=store)
        for at in range(50):
            value = store.types["geometry_msgs/msg/Vector3"](float(at), 0.0, 0.0)
            serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
            data = serialize(value, "geometry_msgs/msg/Vector3")
            writer.write(number, START + at * SECOND // 10, data)
    return path if ros1 else next((path.parent / "bag").glob("*.db3"))


def asked(editor: Any, text: str) -> None:
    editor.wait(
        lambda: text in editor.program.property("question"),
        lambda: editor.program.property("question"),
    )


def test_a_recording_opens_with_panels_and_a_timeline(
    edit: Callable[..., Any],
    tmp_path: Path,
) -> None:
    editor = edit(write_mcap(tmp_path / "drive.mcap"))
    editor.wait(lambda: editor.program.property("recording") == "drive.mcap")
    assert "Battery" in editor.text
    timeline = editor.find("timeline")
    editor.wait(lambda: timeline.property("ready"))
    assert timeline.property("duration") == pytest.approx(10)
    editor.wait(lambda: len(timeline.property("marks").toVariant()) == 1)
    replay = timeline.property("replay_")
    editor.wait(lambda: len(replay.property("density").toVariant()) == 2)
    assert replay.property("density").toVariant()[0]["count"] == 101
    assert sum(replay.partsOf(0)) == 101
    editor.click("play")
    editor.wait(lambda: not timeline.property("playing"))
    timeline.seek(4)
    editor.click("from")
    editor.wait(lambda: timeline.property("rangeStart") == pytest.approx(4, abs=0.01))
    timeline.seek(6)
    editor.click("until")
    editor.wait(lambda: timeline.property("rangeEnd") == pytest.approx(6, abs=0.01))
    editor.click("whole")
    editor.wait(lambda: not timeline.property("hasRange"))
    timeline.seek(2.05)
    editor.wait(lambda: timeline.property("position") == pytest.approx(2.05))
    editor.click("step")
    editor.wait(lambda: timeline.property("position") == pytest.approx(2.1))
    editor.program.run("record")
    assert "this is a recording" in editor.program.property("message")
    editor.program.run("close recording")
    editor.wait(lambda: editor.program.property("recording") == "")


@pytest.mark.parametrize("name", ["a.bag", "a.db3"])
def test_bags_of_both_ros_open(
    edit: Callable[..., Any],
    tmp_path: Path,
    name: str,
) -> None:
    from rosglass.qt import QtCore

    editor = edit()
    path = write_rosbags(tmp_path / name)
    editor.program.useFile("open recording", QtCore.QUrl.fromLocalFile(str(path)), False)
    editor.wait(lambda: editor.program.property("recording") == path.name)
    timeline = editor.find("timeline")
    editor.wait(lambda: timeline.property("ready"))
    assert timeline.property("duration") == pytest.approx(4.9)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "not an MCAP file"),
        (b"\x89MCAP0\r\n", "not an MCAP file"),
        (b"\x00" * 5000, "not an MCAP file"),
        (None, "does not exist"),
    ],
    ids=["empty", "without messages", "zeros", "missing"],
)
def test_recordings_that_cannot_be_shown_say_why_and_the_robot_stays(
    edit: Callable[..., Any],
    tmp_path: Path,
    content: bytes | None,
    said: str,
) -> None:
    from rosglass.qt import QtCore

    editor = edit()
    before = editor.bench.session.url
    path = tmp_path / "bad.mcap"
    if content is not None:
        path.write_bytes(content)
    editor.program.useFile("open recording", QtCore.QUrl.fromLocalFile(str(path)), False)
    asked(editor, said)
    editor.answer(0)
    assert editor.bench.session.url == before
    assert editor.bench.session.state == "connected"
    assert editor.program.property("recording") == ""


def test_a_cut_recording_is_shown_as_far_as_it_goes(
    edit: Callable[..., Any],
    tmp_path: Path,
) -> None:
    path = write_mcap(tmp_path / "cut.mcap")
    path.write_bytes(path.read_bytes()[:-3000])
    editor = edit(path)
    editor.wait(lambda: editor.program.property("recording") == "cut.mcap")
    assert "not closed properly" in editor.program.property("message")
    timeline = editor.find("timeline")
    editor.wait(lambda: timeline.property("ready"))
    assert 1 < timeline.property("duration") < 10


def test_the_robot_is_recorded_from_the_window(
    edit: Callable[..., Any],
    tmp_path: Path,
) -> None:
    editor = edit()
    editor.program.run("new")
    recorder = editor.window.findChild(object, "recorder")
    recorder.setProperty("folder", str(tmp_path))
    publisher = editor.bench.robot.create_publisher("/text", "std_msgs/msg/String")
    editor.key("Ctrl+R")
    editor.wait(lambda: recorder.property("recording") and recorder.property("elapsed") > 0)
    assert recorder.property("sizeLimit") == 4e9
    publisher.publish(data="hello")
    editor.wait(lambda: recorder.property("messageCount") > 0)
    assert "Stop" in editor.find("recordButton").property("text")
    assert editor.find("file").property("text").startswith(str(tmp_path))
    editor.program.run("mark")
    editor.wait(lambda: recorder.property("markCount") == 1)
    editor.key("Ctrl+R")
    editor.wait(lambda: "recorded to" in editor.program.property("message"))
    path = recorder.property("file")
    assert path in editor.program.property("message")
    assert [text for _, text in read_marks(path)] == ["Mark"]
    with open_bag(path) as bag:
        assert "/text" in [channel.topic for channel in bag.channels]
    editor.program.run("mark")
    assert editor.program.property("message") == "nothing is being recorded"


def test_images_of_a_recording_are_late_by_what_was_recorded(
    edit: Callable[..., Any], tmp_path: Path
) -> None:
    kind: Any = rosglass.load("sensor_msgs/msg/Image")
    path = tmp_path / "camera.mcap"
    with path.open("wb") as stream:
        writer = mcap_writer.Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema(kind.name, "ros2msg", full_text(kind.definition).encode())
        number = writer.register_channel("/camera", "cdr", schema)
        for at in range(100):
            time = START + at * SECOND // 10
            stamp = {"sec": time // SECOND, "nanosec": time % SECOND}
            image = {"width": 4, "height": 4, "encoding": "mono8", "step": 4, "data": bytes(16)}
            data = kind.encode({"header": {"stamp": stamp}, **image})
            writer.add_message(number, time + SECOND // 5, data, time)
        writer.finish()
    editor = edit(path)
    editor.wait(lambda: editor.program.property("hasLayout"))
    assert "CameraView" in editor.text

    def view() -> Any:
        waiting = [editor.root]
        while waiting:
            one = waiting.pop()
            if one.metaObject().className().startswith("CameraView"):
                return one
            waiting += one.childItems()
        return None

    editor.wait(lambda: view() is not None and view().property("latency") > 0)
    assert view().property("latency") == pytest.approx(200, abs=50)
    assert not view().property("late")
