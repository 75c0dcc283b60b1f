"""The controls Recorder and Timeline."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest
from hands import click, key, press, release
from mcap.reader import make_reader

import rosglass
from rosglass.bags import MARKS_TOPIC, Recorder, read_marks

pytestmark = pytest.mark.both_qt
ODOM = "nav_msgs/msg/Odometry"


def publisher(controls: Any, topic: str = "/odom") -> Any:
    return controls.robot.create_publisher(topic, ODOM)


def show(controls: Any, folder: Path, more: str = "") -> Any:
    return controls.show(
        f'Recorder {{ anchors.fill: parent; folder: "{folder}"; {more}\n'
        "property var ends: []; property var errors: []\n"
        "onFinished: function(path, reason) { ends = ends.concat([path, reason]) }\n"
        "onFailed: function(reason) { errors = errors.concat([reason]) } }"
    )


def ends(recorder: Any) -> list[str]:
    return list(recorder.property("ends").toVariant())


def sending(wait: Any, sender: Any, condition: Any) -> None:
    """Publish until a condition holds."""

    def is_so() -> bool:
        sender.publish(child_frame_id="x" * 100)
        return bool(condition())

    wait(is_so)


def test_recording_is_read_by_an_independent_reader(
    controls: Any, wait: Any, tmp_path: Path
) -> None:
    sender = publisher(controls)
    recorder = show(controls, tmp_path, 'markTexts: ["<b>Hit</b>"]')
    click(controls, "record")
    wait(sender.subscription_count)
    sending(wait, sender, lambda: recorder.property("messageCount") >= 10)
    click(controls, "mark_0")
    wait(lambda: recorder.property("markCount") == 1)
    click(controls, "record")
    wait(lambda: ends(recorder))
    file = Path(ends(recorder)[0])
    assert file.parent == tmp_path
    assert file == Path(recorder.property("file"))
    with file.open("rb") as stream:
        reader = make_reader(stream)
        found = [(channel.topic, schema.name) for schema, channel, _ in reader.iter_messages()]
        summary = reader.get_summary()
    assert summary is not None
    assert found.count(("/odom", ODOM)) == recorder.property("messageCount") >= 10
    assert found.count((MARKS_TOPIC, "std_msgs/msg/String")) == 1
    ((time, text),) = read_marks(file)
    assert text == "<b>Hit</b>"
    assert 0 <= time < 60
    assert not recorder.property("recording")


def test_only_chosen_topics_are_recorded(controls: Any, wait: Any, tmp_path: Path) -> None:
    sender, other = publisher(controls), publisher(controls, "/other")
    recorder = show(controls, tmp_path, 'topics: ["/odom", "/missing"]; fileName: "run.mcap"')
    recorder.start()
    wait(sender.subscription_count)
    sending(wait, sender, lambda: recorder.property("messageCount"))
    assert not other.subscription_count()
    assert "/missing: no publisher" in controls.find("warning").property("text")
    recorder.stop()
    wait(lambda: ends(recorder))
    assert (tmp_path / "run.mcap").exists()
    recorder.start()
    wait(lambda: "choose another name" in recorder.property("status"))
    assert not recorder.property("recording")


def test_recording_ends_at_its_limits(controls: Any, wait: Any, tmp_path: Path) -> None:
    sender = publisher(controls)
    recorder = show(controls, tmp_path, 'timeLimit: 0.5; fileName: "time"')
    recorder.start()
    wait(sender.subscription_count)
    sending(wait, sender, lambda: ends(recorder))
    assert ends(recorder)[1] == "the limit of 0.5 s is reached"
    assert not recorder.property("recording")
    recorder.setProperty("timeLimit", 0)
    recorder.setProperty("sizeLimit", 20_000)
    recorder.setProperty("fileName", "size")
    recorder.start()
    wait(sender.subscription_count)
    sending(wait, sender, lambda: len(ends(recorder)) == 4)
    assert "MB is reached" in ends(recorder)[3]
    assert 20_000 <= Path(ends(recorder)[2]).stat().st_size < 3_000_000


def test_recording_of_nothing_leaves_no_file(controls: Any, wait: Any, tmp_path: Path) -> None:
    recorder = show(controls, tmp_path)
    recorder.start()
    wait(lambda: recorder.property("elapsed") > 0)
    recorder.stop()
    wait(lambda: ends(recorder))
    assert list(tmp_path.glob("*.mcap")) == []
    assert "nothing was recorded" in controls.find("file").property("text")


def test_folder_that_is_missing_is_named(controls: Any, wait: Any, tmp_path: Path) -> None:
    recorder = show(controls, tmp_path / "missing")
    click(controls, "record")
    wait(lambda: "make the folder" in recorder.property("status"))
    assert not recorder.property("recording")
    assert recorder.property("errors").toVariant()


def test_full_disk_is_named(controls: Any, wait: Any, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["/bin/mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)],
        check=False,
        capture_output=True,
    )
    if mounted.returncode:
        pytest.skip("a small file system cannot be mounted here: run as root")
    try:
        sender = publisher(controls)
        recorder = show(controls, disk)
        recorder.start()
        wait(sender.subscription_count)

        def is_full() -> bool:
            for _ in range(20):
                # Not compressible.
                sender.publish(child_frame_id=os.urandom(2000).hex())
            return "No space left" in recorder.property("status")

        wait(is_full)
        assert not recorder.property("recording")
        wait(lambda: not recorder.property("completing"))
        assert "No space left" in recorder.property("status")
        assert "DISK NEARLY FULL" in controls.find("warning").property("text")
    finally:
        subprocess.run(["/bin/umount", "-l", str(disk)], check=True)


def test_recording_over_a_real_middleware(
    live_controls: Any, url: str, wait: Any, tmp_path: Path
) -> None:
    ros1 = url.startswith("ros1")
    sender = live_controls.robot.create_publisher("/odom", ODOM)
    more = f'topics: ["/odom"]; format: "{"bag" if ros1 else "mcap"}"'
    recorder = show(live_controls, tmp_path, more)
    recorder.start()
    wait(sender.subscription_count)
    sending(wait, sender, lambda: recorder.property("messageCount") >= 5)
    assert recorder.mark("here")
    wait(lambda: recorder.property("markCount") == 1)
    recorder.stop()
    wait(lambda: ends(recorder))
    file = Path(ends(recorder)[0])
    assert file.suffix == (".bag" if ros1 else ".mcap")
    with rosglass.bags.open_bag(file) as bag:
        topics = [message.channel.topic for message in bag.messages()]
    assert topics.count("/odom") >= 5
    assert [text for _, text in read_marks(file)] == ["here"]


def test_recording_is_completed_when_the_node_goes(
    controls: Any, wait: Any, tmp_path: Path
) -> None:
    sender = publisher(controls)
    recorder = show(controls, tmp_path, 'fileName: "gone"')
    recorder.start()
    wait(sender.subscription_count)
    sending(wait, sender, lambda: recorder.property("messageCount"))
    controls.engine_session.shutdown()
    wait(lambda: ends(recorder))
    assert not recorder.property("recording")
    assert recorder.property("ending") == "the robot was changed"
    with (tmp_path / "gone.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None


def test_program_that_ends_completes_its_recording(start: Any, wait: Any, tmp_path: Path) -> None:
    """Marks alone are enough for a file, which has its index if the program ends by itself."""
    file = tmp_path / "program.qml"
    file.write_text(
        f"""import QtQuick 2.15
        import Ros2 1.0
        import RosControls 1.0
        Recorder {{
            folder: "{tmp_path}"; fileName: "end"; recording: true
            Component.onCompleted: Ros2.init("operator")
            onElapsedChanged: if (elapsed > 0 && !markCount && mark("here")) quit.start()
            Timer {{ id: quit; interval: 100; onTriggered: Qt.quit() }}
        }}"""
    )
    program = start("run", file, "--url", "local://no_robot")
    assert program.end(60) == 0, program.text
    with (tmp_path / "end.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert [text for _, text in read_marks(tmp_path / "end.mcap")] == ["here"]


# -- Timeline ------------------------------------------------------------------------------------


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Ten seconds of odometry with two marks, at 3 s and 7 s."""
    from mcap.writer import Writer

    kind: Any = rosglass.load(ODOM)
    text: Any = rosglass.load("std_msgs/msg/String")
    path = tmp_path / "drive.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")

        def channel(topic: str, type: Any) -> int:
            from rosglass.interfaces import schema_text

            language, definition = schema_text(type.definition)
            schema = writer.register_schema(type.name, f"ros2{language}", definition.encode())
            return writer.register_channel(topic, "cdr", schema)

        odom, marks = channel("/odom", kind), channel(MARKS_TOPIC, text)
        start = 1_700_000_000_000_000_000
        for at in range(101):
            data = bytes(kind.encode({"child_frame_id": str(at)}, wire="cdr"))
            time = start + at * 100_000_000
            writer.add_message(odom, log_time=time, data=data, publish_time=time)
            if at in (30, 70):
                note = bytes(text.encode({"data": f"event <i>{at}</i>"}, wire="cdr"))
                writer.add_message(marks, log_time=time, data=note, publish_time=time)
        writer.finish()
    return path


@pytest.fixture
def timeline(bench: Any, controls: Any, recording: Path, tmp_path: Path, wait: Any) -> Any:
    """A bench with a timeline of the recording, paused at its beginning."""

    from rosglass.qml import Session, install
    from rosglass.qt import QtQml, send_deferred_deletes

    session = Session("local://no_robot")
    engine = QtQml.QQmlEngine()
    install(engine, session)
    made = type(bench)(session, engine, bench.world, tmp_path / "qml")
    session.init("ui")
    shown = type(controls)(made, wait)
    control = shown.show(f'Timeline {{ anchors.fill: parent; file: "{recording}" }}', 600, 140)
    wait(lambda: control.property("ready"))
    control.pause()
    wait(lambda: not control.property("playing"))
    control.seek(0)
    yield shown, control
    made.close()
    made.robot.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()


def at(control: Any, wait: Any, seconds: float) -> None:
    wait(
        lambda: abs(control.property("position") - seconds) < 0.05,
        lambda: control.property("position"),
    )


def test_timeline_shows_marks_and_jumps_to_them(timeline: Any, wait: Any) -> None:
    bench, control = timeline
    assert control.property("duration") == pytest.approx(10)
    wait(lambda: len(control.property("marks").toVariant()) == 2)
    assert control.property("marks").toVariant()[0]["text"] == "event <i>30</i>"
    click(bench, "next")
    at(control, wait, 3)
    key(bench, "PageDown") if control.property("activeFocus") else control.seekMark(1)
    at(control, wait, 7)
    click(bench, "previous")
    at(control, wait, 3)


def test_timeline_is_operated_by_keys(timeline: Any, wait: Any) -> None:
    bench, control = timeline
    control.forceActiveFocus()
    key(bench, "Right", "Right")
    at(control, wait, 2)
    key(bench, "Left")
    at(control, wait, 1)
    key(bench, "End")
    at(control, wait, 10)
    key(bench, "Home")
    at(control, wait, 0)
    key(bench, "PageDown")
    wait(lambda: len(control.property("marks").toVariant()) == 2)
    key(bench, "Home", "PageDown")
    at(control, wait, 3)
    key(bench, "Plus")
    wait(lambda: control.property("replay_").property("rate") == 2)
    key(bench, "Minus", "Minus")
    wait(lambda: control.property("replay_").property("rate") == 0.5)
    key(bench, "L")
    wait(lambda: control.property("replay_").property("loop"))
    key(bench, "Space")
    wait(lambda: control.property("playing"))
    key(bench, "Space")
    wait(lambda: not control.property("playing"))


def test_timeline_is_dragged(timeline: Any, wait: Any) -> None:
    bench, control = timeline
    press(bench, "slider")
    release(bench, "slider")
    wait(lambda: abs(control.property("position") - 5) < 0.5)
    wait(lambda: bench.find("time").property("text").startswith("00:0"))
    assert bench.find("time").property("text").endswith("/ 00:10.0")


def test_timeline_controls_a_replay_of_the_interface(
    timeline: Any, recording: Path, wait: Any
) -> None:
    bench, _ = timeline
    control = bench.show(
        f"""Item {{
            property alias line: line
            Replay {{ id: other; file: "{recording}"; playing: false }}
            Timeline {{ id: line; objectName: "line"; replay: other; width: 300; height: 120 }}
        }}"""
    )
    line = bench.find("line", control)
    wait(lambda: line.property("ready"))
    line.pause()
    line.seek(99)
    at(line, wait, 10)
    line.seek(-1)
    at(line, wait, 0)


def test_timeline_without_a_recording_says_so(controls: Any) -> None:
    control = controls.show("Timeline { anchors.fill: parent }")
    assert control.property("note") == "no recording is shown"
    control.seek(5)
    control.toggle()


# -- the recorder of Python ----------------------------------------------------------------------


def test_limits_and_marks_of_the_python_recorder(tmp_path: Path) -> None:
    with rosglass.connect("local://marks", name="r", own_services=False) as node:
        with pytest.raises(rosglass.Error, match="max_size"):
            Recorder(node, tmp_path / "a.mcap", max_size=-1)
        recorder = Recorder(node, tmp_path / "a.mcap")
        with pytest.raises(rosglass.Error, match="1000 characters"):
            recorder.mark("x" * 1001)
        recorder.mark("ok")
        recorder.close()
        with pytest.raises(rosglass.Error, match="complete"):
            recorder.mark("late")
    assert [text for _, text in read_marks(tmp_path / "a.mcap")] == ["ok"]
