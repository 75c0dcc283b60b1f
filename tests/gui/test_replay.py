"""Recordings in a robot's place, and recordings played to a robot."""

from __future__ import annotations

import shutil
import time
from typing import TYPE_CHECKING, Any

import pytest
from mcap import writer as mcap_writer

from rosglass import load
from rosglass.comm import ConnectionState
from rosglass.interfaces import full_text

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import Bench

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
STRING = "std_msgs/msg/String"


def record(path: Path, lengths: dict[str, int]) -> Path:
    """Record topics that count, ten times per second, for so many messages each."""
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    found = load(STRING)
    schema = writer.register_schema(STRING, "ros2msg", full_text(found.definition).encode())
    topics = {name: writer.register_channel(name, "cdr", schema) for name in lengths}
    for i in range(max(lengths.values())):
        at = START + i * SECOND // 10
        for name, number in topics.items():
            if i < lengths[name]:
                writer.add_message(number, at, found.encode({"data": str(i)}), at)
    writer.finish()
    return path


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A recording of 3 s: ``/chatter`` says 0 to 30, ``/other`` the same."""
    return record(tmp_path / "drive.mcap", {"/chatter": 31, "/other": 31})


PANEL = """
    QtObject {
        id: root
        property Replay replay: Replay { PROPERTIES }
        property Subscription sub: Subscription {
            topic: "/chatter"; throttleRate: 0; queueSize: 100; timeout: 1000
            onNewMessage: (message) => root.got.push(message.data)
        }
        property var got: []
        property int ends: 0
        property Connections c: Connections {
            target: root.replay
            function onFinished() { root.ends += 1 }
        }
        function all() { return got.join() }
        function last() { return got.length ? got[got.length - 1] : "" }
        function forget() { got = [] }
        function state() {
            return [replay.ready, replay.playing, replay.duration.toFixed(1)].join()
        }
        function position() { return replay.position }
        function problem() { return replay.problem }
        function subscribed() { return sub.subscribed }
        function stale() { return sub.stale }
        function age() { return sub.age }
        function seconds() { return MODULE.now().sec }
        function play() { replay.play() }
        function pause() { replay.pause() }
        function seek(s) { replay.seek(s) }
        function seekFails(s) { try { replay.seek(s) } catch (e) { return e.message } return "" }
        function setFile(f) { replay.file = f }
        function setTopics(t) { replay.topics = t }
        function setLoop(l) { replay.loop = l }
        function setRate(r) { replay.rate = r }
        function rates() { return [replay.rate, replay.loop].join() }
    }
"""


def panel(bench: Bench, properties: str, module: str = "Ros2") -> Any:
    bench.module = f"{module} 1.0"
    body = PANEL.replace("PROPERTIES", properties).replace(
        "MODULE", "Time" if module == "Ros" else module
    )
    return bench.load(body.replace("Subscription", "Subscriber") if module == "Ros" else body)


@pytest.mark.parametrize("module", ["Ros2", "Ros"])
def test_watching_a_recording_instead_of_the_robot(
    live: Bench, drive: Path, module: str, wait: Any
) -> None:
    robot = live.session.url
    root = panel(live, f'file: "{drive}"; rate: 5', module)
    wait(lambda: root.state() == "true,true,3.0")
    assert live.session.url == f"replay:{drive}"
    wait(lambda: root.last() == "30")
    wait(lambda: root.property("ends") == 1)
    assert root.state() == "true,false,3.0"
    assert root.position() == pytest.approx(3.0)
    wait(lambda: root.seconds() == 1_700_000_003)
    root.setFile("")
    wait(lambda: live.session.url == robot and live.session.state == "connected")
    assert root.state() == "false,false,0.0"


def test_time_under_control(live: Bench, drive: Path, wait: Any) -> None:
    root = panel(live, f'file: "file://{drive}"; playing: false')
    wait(lambda: root.state() == "true,false,3.0")
    wait(root.subscribed)
    root.forget()
    root.seek(2.05)
    # A display that is sought through shows what was there.
    wait(lambda: root.last() == "20")
    assert root.position() == pytest.approx(2.05)
    assert "from 0 to 3" in root.seekFails(9)
    root.play()
    wait(lambda: root.last() not in ("20", ""))
    root.pause()
    wait(lambda: root.state() == "true,false,3.0")
    root.setTopics(["/other"])
    wait(lambda: not live.session.node.publishers("/chatter"))
    root.setTopics([])
    root.setRate(10)
    root.setLoop(True)
    assert root.rates() == "10,true"
    root.forget()
    root.play()
    wait(lambda: root.all().count("30") >= 2)


def test_a_paused_recording_shows_the_moment_it_is_paused_at(
    live: Bench, tmp_path: Path, wait: Any
) -> None:
    path = record(tmp_path / "gap.mcap", {"/chatter": 20, "/other": 91})
    root = panel(live, f'file: "{path}"')
    wait(lambda: root.last() not in ("", "0"))
    root.pause()
    wait(lambda: root.state() == "true,false,9.0")
    wait.nothing_happens(0.3)
    age = root.age()
    wait.nothing_happens(1.5)
    assert not root.stale()
    assert root.age() == age
    # Where the topic has nothing, what is shown is of another moment.
    root.seek(8)
    wait(root.stale)
    assert root.age() > 5
    root.seek(1)
    wait(lambda: not root.stale())
    # Time that is played passes, with or without messages.
    root.seek(2)
    root.play()
    wait(root.stale)
    # The robot's time passes.
    root.pause()
    root.seek(1)
    wait(lambda: not root.stale())
    root.setFile("")
    wait(root.stale)


def test_ages_follow_slow_time_but_not_fast_time(live: Bench, drive: Path, wait: Any) -> None:
    root = panel(live, f'file: "{drive}"; rate: 0.05; loop: true')
    wait(lambda: root.last() == "1")
    # Messages come every two seconds, which is a tenth of a second of the recording.
    seen = [(wait.nothing_happens(0.05), root.stale(), root.age())[1:] for _ in range(60)]
    assert not any(stale for stale, _ in seen)
    assert max(age for _, age in seen) < 0.5
    steady: Any = live.session.steady
    root.setRate(1000)
    before, began = steady(), time.monotonic()
    wait.nothing_happens(0.2)
    distance = steady() - before
    # In that time, the recording begins again many times, by its three seconds each.
    assert distance % 3 < time.monotonic() - began + 0.5


def test_the_robot_is_back_when_the_element_is_gone(live: Bench, drive: Path, wait: Any) -> None:
    robot = live.session.url
    root: Any = live.load(f"""
        QtObject {{
            id: root
            property Component page: Component {{ Replay {{ file: "{drive}" }} }}
            property var shown: page.createObject(root)
            function leave() {{ shown.destroy() }}
            function ready() {{ return shown.ready }}
        }}
    """)
    wait(root.ready)
    root.leave()
    wait(lambda: live.session.url == robot and live.session.state == "connected")


def test_newer_of_two_replays_wins(live: Bench, drive: Path, tmp_path: Path, wait: Any) -> None:
    other = tmp_path / "other.mcap"
    shutil.copy(drive, other)
    root: Any = live.load(f"""
        QtObject {{
            property Replay a: Replay {{ file: "{drive}" }}
            property Replay b: Replay {{}}
            function setB(file) {{ b.file = file }}
            function state() {{ return [a.ready, b.ready].join() }}
            function problems() {{ return a.problem + b.problem }}
        }}
    """)
    wait(lambda: root.state() == "true,true")
    root.setB(str(other))
    wait(lambda: "another Replay shows" in root.problems() and root.state() == "false,true")
    assert live.session.url == f"replay:{other}"
    root.setB("")
    wait(lambda: live.session.url == f"replay:{drive}" and root.state() == "true,true")
    assert root.problems() == ""


def test_any_path_can_be_named(live: Bench, drive: Path, tmp_path: Path, wait: Any) -> None:
    odd = tmp_path / "100% odd?#%41 ü.mcap"
    shutil.copy(drive, odd)
    root = panel(live, f'file: "{odd}"')
    wait(lambda: root.state().startswith("true"))
    assert live.session.url.endswith("100%25 odd%3F%23%2541 ü.mcap")


def test_publishing_during_replay_is_a_problem(live: Bench, drive: Path, wait: Any) -> None:
    live.session.url = f"replay:{drive}?paused=true"
    live.module = "Ros2 1.0"
    root: Any = live.load("""
        QtObject {
            property Replay replay: Replay {}
            property var pub: Ros2.createPublisher("/stop", "std_msgs/msg/String", 1)
            property ServiceServer server: ServiceServer {
                name: "/s"; serviceType: "std_srvs/srv/Trigger"; handler: () => true
            }
            function publish() { return pub.publish({data: "stop"}) }
            function problem() { return pub.problem }
            function served() { return server.problem }
            function ready() { return replay.ready && !replay.playing }
        }
    """)
    wait(root.ready)
    wait(root.publish)
    wait(lambda: "reaches no robot" in root.problem())
    wait(lambda: "is a recording, which answers no requests" in root.served())


def test_recording_is_sent_to_the_robot_only_on_request(
    live: Bench, drive: Path, wait: Any
) -> None:
    got: list[str] = []
    other: list[str] = []
    live.robot.create_subscription("/chatter", STRING, lambda m: got.append(m.data))
    live.robot.create_subscription("/other", STRING, lambda m: other.append(m.data))
    robot = live.session.url
    root = panel(live, f'file: "{drive}"; toRobot: true; rate: 5; topics: ["/chatter"]')
    wait(lambda: root.state() == "true,false,3.0")
    wait(lambda: live.robot.publishers("/chatter"))
    wait.nothing_happens(0.3)
    assert got == []
    root.play()
    wait(lambda: got and got[-1] == "30")
    assert other == []
    assert live.session.url == robot
    wait(lambda: root.property("ends") == 1)
    root.setFile("")
    wait(lambda: not live.robot.publishers("/chatter"))


def test_commands_do_not_go_on_after_an_outage(
    running: Bench, drive: Path, wait: Any, caplog: Any
) -> None:
    root = panel(running, f'file: "{drive}"; toRobot: true; rate: 0.1; topics: ["/chatter"]')
    wait(lambda: root.state() == "true,false,3.0")
    root.play()
    wait(lambda: root.state() == "true,true,3.0")
    node: Any = running.session.node
    node.set_status(ConnectionState.LOST, "gone")
    wait(lambda: root.state() == "true,false,3.0")
    assert "paused" in caplog.text
    node.set_status(ConnectionState.CONNECTED)
    wait(lambda: running.session.state == "connected")
    wait.settled(running.session)
    assert root.state() == "true,false,3.0"
    root.play()
    wait(lambda: root.state() == "true,true,3.0")


@pytest.mark.parametrize("more", ["", "; toRobot: true"])
def test_problems_are_reported(live: Bench, tmp_path: Path, wait: Any, more: str) -> None:
    root = panel(live, f'file: "{tmp_path / "no.mcap"}"{more}')
    wait(lambda: "no.mcap does not exist" in root.problem())


def test_topics_that_were_not_recorded(live: Bench, drive: Path, wait: Any) -> None:
    root = panel(live, f'file: "{drive}"; toRobot: true; topics: ["/nope"]')
    wait(lambda: "has no topic /nope; it has /chatter, /other" in root.problem())


def test_values_that_are_refused(live: Bench, drive: Path, caplog: Any, wait: Any) -> None:
    root = panel(live, f'file: "{drive}"; rate: 0')
    assert "rate 0 is not from 0.001 to 1000" in caplog.text
    wait(lambda: root.state().startswith("true"))
    assert root.rates() == "1,false"


def test_from_the_command_line(start: Any, drive: Path, tmp_path: Path) -> None:
    file = tmp_path / "panel.qml"
    file.write_text("""
        import QtQuick 2.15
        import Ros2 1.0
        Item {
            Component.onCompleted: Ros2.init("panel")
            Subscription {
                topic: "/chatter"; throttleRate: 0; queueSize: 100
                onNewMessage: (m) => { console.log("heard", m.data); if (m.data == "30") Qt.quit() }
            }
        }
    """)
    program = start("run", file, "--url", f"replay:{drive}?rate=10")
    program.until("heard 15", 30)
    program.until("heard 30", 30)
    assert program.end() == 0


def test_a_topic_that_cannot_be_decoded_says_why(live: Bench, tmp_path: Path, wait: Any) -> None:
    path = tmp_path / "gear.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    schema = writer.register_schema("a_msgs/msg/Nope", "", b"")
    number = writer.register_channel("/gear", "cdr", schema)
    for i in range(20):
        writer.add_message(number, START + i * SECOND // 10, b"\0\1\0\0abcd", START)
    writer.finish()
    live.module = "Ros2 1.0"
    root = live.load(
        """QtObject {
            property Replay replay: Replay { file: "PATH" }
            property Subscription sub: Subscription { topic: "/gear" }
            function problem() { return sub.problem }
            function shown() { return sub.message === undefined }
        }""".replace("PATH", str(path))
    )
    wait(lambda: "the recording has no definition of it" in root.problem())
    assert "Library.add_path('a_msgs')" in root.problem()
    assert root.shown() is True
