"""Recordings in a robot's place, and recordings played to a robot."""

from __future__ import annotations

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


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A recording of 3 s: ``/chatter`` says 0 to 30, ``/other`` the same."""
    path = tmp_path / "drive.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    found = load(STRING)
    schema = writer.register_schema(STRING, "ros2msg", full_text(found.definition).encode())
    topics = [writer.register_channel(t, "cdr", schema) for t in ("/chatter", "/other")]
    for i in range(31):
        at = START + i * SECOND // 10
        for number in topics:
            writer.add_message(number, at, found.encode({"data": str(i)}), at)
    writer.finish()
    return path


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
    # At the end nothing moves any more, and what is shown says so.
    wait(root.stale)
    root.setFile("")
    wait(lambda: live.session.url == robot and live.session.state == "connected", 30)
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


def test_what_the_interface_publishes_goes_nowhere_and_says_so(
    live: Bench, drive: Path, wait: Any
) -> None:
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
    wait(lambda: "is a recording, which answers nobody" in root.served())


def test_to_the_robot_only_when_told(live: Bench, drive: Path, wait: Any) -> None:
    got: list[str] = []
    other: list[str] = []
    live.robot.create_subscription("/chatter", STRING, lambda m: got.append(m.data))
    live.robot.create_subscription("/other", STRING, lambda m: other.append(m.data))
    robot = live.session.url
    root = panel(live, f'file: "{drive}"; toRobot: true; rate: 5; topics: ["/chatter"]')
    wait(lambda: root.state() == "true,false,3.0", 30)
    wait(lambda: live.robot.publishers("/chatter"), 30)
    wait(300)
    assert got == []
    root.play()
    wait(lambda: got and got[-1] == "30", 30)
    assert other == []
    assert live.session.url == robot
    wait(lambda: root.property("ends") == 1)
    root.setFile("")
    wait(lambda: not live.robot.publishers("/chatter"), 30)


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
    wait(300)
    assert root.state() == "true,false,3.0"
    root.play()
    wait(lambda: root.state() == "true,true,3.0")


@pytest.mark.parametrize("more", ["", "; toRobot: true"])
def test_problems_are_told(live: Bench, tmp_path: Path, wait: Any, more: str) -> None:
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
