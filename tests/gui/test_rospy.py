"""``Ros 1.0`` against rospy: what upstream's own tests ask of it."""

from __future__ import annotations

import json
import subprocess
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest
from counting import Counter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from conftest import Bench

#: ROS 1 alone, of the values of `url`.
ros1 = pytest.mark.parametrize("url", ["ros1"], indirect=True)
RECEIVER = """
import json, sys, rospy
from std_msgs.msg import Header
rospy.init_node("receiver", disable_signals=True)
def report(message):
    print(json.dumps(["got", message.frame_id]), flush=True)
sub = rospy.Subscriber("/head", Header, report)
print(json.dumps(["ready", ""]), flush=True)
for line in sys.stdin:
    if line == "unsubscribe\\n":
        sub.unregister()
    elif line == "subscribe\\n":
        sub = rospy.Subscriber("/head", Header, report)
"""


class Rospy:
    """A program of rospy that prints what it receives as JSON, a line each."""

    def __init__(self, program: str, url: str) -> None:
        port = urlsplit(url).port
        env = {"PATH": "/usr/bin:/bin", "ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
        env |= {"ROS_IP": "127.0.0.1", "HOME": "/tmp", "PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(
            ["/usr/bin/python3", "-c", program],
            env=env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.output: list[Any] = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.output.append(json.loads(line))

    def ask(self, what: str) -> None:
        assert self.process.stdin is not None
        print(what, file=self.process.stdin, flush=True)

    def close(self) -> None:
        self.process.kill()
        self.process.wait(10)


@pytest.fixture
def rospy(url: str) -> Iterator[Callable[[str], Rospy]]:
    made: list[Rospy] = []
    yield lambda program: made.append(Rospy(program, url)) or made[-1]
    for one in made:
        one.close()


PUBLISHING = """
    QtObject {
        property var pub
        property var log: []
        function begin(count, latch) {
            pub = Ros.advertise("std_msgs/Header", "/head", count, latch)
            pub.connected.connect(function () { log.push("connected") })
            pub.disconnected.connect(function () { log.push("disconnected") })
            const message = {}
            const sent = []
            for (let i = 0; i < 5; i++) {
                message.frame_id = "number " + i
                sent.push(pub.publish(message))
            }
            let thrown = ""
            try { pub.publish({frame_id: 5}) } catch (error) { thrown = String(error) }
            return [sent.join(), pub.isAdvertised, thrown].join(" ")
        }
        function send(text) { return pub.publish({frame_id: text}) }
        function changes() { return log.join() }
        function count() { return pub.getNumSubscribers() }
    }
"""


def received(robot: Rospy) -> list[str]:
    return [text for what, text in robot.output if what == "got"]


@ros1
@pytest.mark.parametrize("size", [5, 0])
def test_messages_published_right_after_advertise_arrive(
    live: Bench, rospy: Any, wait: Any, size: int
) -> None:
    live.module = "Ros 1.0"
    robot = rospy(RECEIVER)
    wait(lambda: ["ready", ""] in robot.output)
    root: Any = live.load(PUBLISHING)
    error = root.begin(size, False)
    assert error.startswith("true,true,true,true,true false Error: ")
    assert "frame_id: expected a string, got 5" in error
    wait(lambda: len(received(robot)) >= 5)
    root.send("last")
    wait(lambda: "last" in received(robot))
    assert received(robot) == [*(f"number {n}" for n in range(5)), "last"]


MAKE = {
    "Ros 1.0": 'Ros.advertise("std_msgs/Header", "/head", 5)',
    "Ros2 1.0": 'Ros2.createPublisher("/head", "std_msgs/Header", 5)',
}


@pytest.mark.parametrize("module", MAKE)
def test_messages_published_at_once_arrive_in_ros_1_and_2(
    live: Bench, wait: Any, module: str
) -> None:
    live.module = module
    heard: list[str] = []
    live.robot.create_subscription(
        "/head", "std_msgs/msg/Header", lambda message: heard.append(message.frame_id)
    )
    wait(lambda: live.session.node.subscriptions("/head"))
    root: Any = live.load(f"""
        QtObject {{
            property var pub
            function begin() {{
                pub = {MAKE[module]}
                return [0, 1, 2].map(function (n) {{ return pub.publish({{frame_id: "n" + n}}) }})
                                .join()
            }}
        }}
    """)
    assert root.begin() == "true,true,true"
    wait(lambda: len(heard) >= 3)
    assert heard == ["n0", "n1", "n2"]


def test_messages_published_while_connecting_arrive(
    url: str, app: Any, tmp_path: Path, wait: Any
) -> None:
    import rosglass
    from rosglass.qml import Session, install
    from rosglass.qt import QtQml

    with rosglass.connect(url, name="robot") as robot:
        heard: list[str] = []
        robot.create_subscription("/word", "std_msgs/msg/String", lambda m: heard.append(m.data))
        session, engine = Session(url), QtQml.QQmlEngine()
        install(engine, session)
        file = tmp_path / "Early.qml"
        file.write_text(
            """import QtQml 2.15
            import Ros 1.0
            QtObject {
                property var pub: Ros.advertise("std_msgs/String", "/word", 5)
                property bool sent
                Component.onCompleted: { Ros.init("early"); sent = pub.publish({data: "hello"}) }
            }"""
        )
        component = QtQml.QQmlComponent(engine, str(file))
        root: Any = component.create()
        assert root.property("sent") is True
        wait(lambda: heard == ["hello"])
        root.deleteLater()
        session.close()


@ros1
def test_the_newest_are_held_where_the_queue_is_short(
    live: Bench, rospy: Any, wait: Any, caplog: Any
) -> None:
    live.module = "Ros 1.0"
    robot = rospy(RECEIVER)
    wait(lambda: ["ready", ""] in robot.output)
    root: Any = live.load(PUBLISHING)
    root.begin(2, False)
    wait(lambda: len(received(robot)) >= 2)
    assert received(robot) == ["number 3", "number 4"]
    assert (
        "/head: messages are dropped, the oldest first: more than 2 were published" in caplog.text
    )


@ros1
def test_subscribers_that_come_and_go_are_notified(live: Bench, rospy: Any, wait: Any) -> None:
    live.module = "Ros 1.0"
    root: Any = live.load(PUBLISHING)
    root.begin(5, False)
    robot = rospy(RECEIVER)
    wait(lambda: root.changes() == "connected")
    wait(lambda: root.count() == 1)
    # Also those that stay for less than a tenth of a second.
    for _ in range(5):
        robot.ask("unsubscribe")
        wait(lambda: root.count() == 0)
        robot.ask("subscribe")
        wait(lambda: root.count() == 1)
    robot.close()
    # Also those that a busy node's looks have not found.
    wait(lambda: root.changes() == ",".join(6 * ["connected,disconnected"]))


def test_namespaces_and_queues_without_limit_are_read_back(live: Bench, wait: Any) -> None:
    live.module = "Ros 1.0"
    root: Any = live.load("""
        QtObject {
            property Subscriber plain: Subscriber { topic: "speed"; queueSize: 5 }
            property Subscriber inner: Subscriber { topic: "speed"; ns: "base"; queueSize: 0 }
            property ImageTransportSubscriber camera: ImageTransportSubscriber { topic: "camera" }
            property var made: Ros.subscribe("arm", "speed", 0)
            property var pub: Ros.advertise("std_msgs/String", "/word", 0)
            property int changes: 0
            property Connections c: Connections {
                target: plain
                function onNsChanged() { changes += 1 }
            }
            function set(size) { plain.queueSize = size; return plain.queueSize }
            function shown() {
                return [plain.topic, plain.ns, plain.queueSize, inner.topic, inner.ns,
                        inner.queueSize, made.topic, made.ns, made.queueSize, camera.ns,
                        pub.queueSize, pub.isAdvertised].join()
            }
        }
    """)
    shown = "/speed,/,5,/base/speed,/base,0,/arm/speed,/arm,0,/,0,true"
    wait(lambda: root.shown() == shown)
    assert root.property("changes") == 1
    assert [root.set(0), root.set(-1), root.set(3)] == [0, 0, 3]


def test_many_are_received_without_limit(live: Bench, wait: Any) -> None:
    live.module = "Ros 1.0"
    sender = live.robot.create_publisher("/head", "std_msgs/msg/Header", 1000)
    root: Any = live.load("""
        QtObject {
            property int n: 0
            property var sub: Ros.subscribe("/head", 0)
            Component.onCompleted: {
                sub.throttleRate = 0
                sub.newMessage.connect(function (message) { n += 1 })
            }
        }
    """)
    wait(lambda: sender.subscription_count() == 1)
    for _ in range(500):
        sender.publish(frame_id="x")
    wait(lambda: root.property("n") == 500)


def test_cancelling_is_acknowledged_at_once(live: Bench, url: str, wait: Any) -> None:
    counter = Counter(live.robot, url)
    counter.offer()
    live.module = "Ros 1.0"
    name = "actionlib_tutorials/FibonacciAction" if counter.ros1 else "example_interfaces/Fibonacci"
    root: Any = live.load(f"""
        QtObject {{
            property var client: Ros.createActionClient("{name}", "/count")
            property var handle
            function connected() {{ return client.connected }}
            function send() {{ handle = client.sendGoal({{order: 50}}) }}
            function state() {{ return handle.commState }}
            function cancel() {{
                handle.cancel()
                return handle.commState === ActionCommStates.WAITING_FOR_CANCEL_ACK
            }}
            function done() {{ return handle.commState === ActionCommStates.DONE }}
        }}
    """)
    try:
        wait(root.connected)
        root.send()
        wait(lambda: root.state() == 2)
        assert root.cancel() is True
        counter.stop.set()
        wait(root.done)
    finally:
        counter.go.set()
        counter.stop.set()
        counter.server.close()


def test_debug_reaches_rosout_once_its_level_is_set(live: Bench, wait: Any) -> None:
    heard: list[Any] = []
    live.robot.create_subscription(
        "/rosout",
        "rosgraph_msgs/msg/Log" if live.robot.wire == "ros1" else "rcl_interfaces/msg/Log",
        heard.append,
    )
    wait(lambda: live.session.node.publishers("/rosout"))
    for module, quiet, louder in (
        (
            "Ros 1.0",
            'Ros.debug("Ros hidden"); Ros.debug("Ros hidden", "arm")',
            """
            Ros.console.setLoggerLevel("ros.qml_ros_plugin.arm", RosConsoleLevels.Debug)
            Ros.debug("Ros named", "arm"); Ros.debug("Ros hidden")
            Ros.console.setLoggerLevel(Ros.console.defaultName, RosConsoleLevels.Debug)
            Ros.debug("Ros own")
            Ros.console.setLoggerLevel(Ros.console.defaultName, RosConsoleLevels.Info)
            Ros.console.setLoggerLevel("ros.qml_ros_plugin.arm", RosConsoleLevels.Info)
            """,
        ),
        (
            "Ros2 1.0",
            'Ros2.debug("Ros2 hidden"); Ros2.getLogger("leg").debug("Ros2 hidden")',
            """
            const leg = Ros2.getLogger("leg"), own = Ros2.getLogger()
            leg.setLoggerLevel(Ros2LoggerLevel.Debug)
            leg.debug("Ros2 named"); Ros2.debug("Ros2 hidden")
            own.setLoggerLevel(Ros2LoggerLevel.Debug)
            Ros2.debug("Ros2 own")
            own.setLoggerLevel(Ros2LoggerLevel.Info)
            leg.setLoggerLevel(Ros2LoggerLevel.Info)
            """,
        ),
    ):
        live.module = module
        live.run(quiet)
        live.run(louder)
        name = module.split()[0]
        wait(lambda name=name: {f"{name} named", f"{name} own"} <= {one.msg for one in heard})
    assert not [one.msg for one in heard if "hidden" in one.msg]


@ros1
def test_rosnode_kill_ends_the_interface(
    live: Bench, url: str, start: Any, tmp_path: Path, wait: Any
) -> None:
    if not Path("/usr/bin/rosnode").exists():
        pytest.skip("rosnode is not installed: sudo apt-get install python3-rosnode")
    file = tmp_path / "Ui.qml"
    file.write_text(
        """import QtQuick 2.15
        import Ros 1.0
        Item {
            Connections {
                target: Ros
                function onShutdown() { console.log("shut down", Ros.ok()) }
            }
            Component.onCompleted: Ros.init("victim")
        }"""
    )
    program = start("run", file, "--url", url)
    wait(lambda: "/victim" in map(str, live.robot.nodes()))
    env = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "ROS_IP": "127.0.0.1"}
    env["ROS_MASTER_URI"] = f"http://127.0.0.1:{urlsplit(url).port}"
    subprocess.run(["/usr/bin/rosnode", "kill", "/victim"], env=env, check=True, timeout=60)
    program.until("shut down false")
    program.until("the interface ends with its node: closed by /rosnode")
    assert program.end() == 1


@ros1
def test_a_second_node_of_the_name_leaves_the_screen(
    live: Bench, url: str, wait: Any, caplog: Any
) -> None:
    import rosglass

    live.module = "Ros 1.0"
    root: Any = live.load("""
        QtObject {
            property int n: 0
            property Connections c: Connections { target: Ros; function onShutdown() { n += 1 } }
        }
    """)
    killed: list[int] = []
    live.session.killed.connect(lambda: killed.append(1))
    # The last that the node registers by itself: as it does, it would take its name back.
    wait(lambda: "/ui/set_logger_level" in live.robot.services())
    with rosglass.connect(url, name="ui"):
        wait(lambda: live.session.state == "failed")
        wait(lambda: root.property("n") == 1)
    live.session.shutdown()
    assert root.property("n") == 1, "notified once"
    assert not killed


@pytest.mark.parametrize("module", ["Ros 1.0", "Ros2 1.0"])
def test_type_of_the_robots_workspace_is_reported_with_package_and_command(
    live: Bench, wait: Any, module: str
) -> None:
    live.module = module
    package = "action_tutorials_interfaces"
    make = {
        "Ros 1.0": f'Ros.createActionClient("{package}/FibonacciAction", "/count")',
        "Ros2 1.0": f'Ros2.createActionClient("/count", "{package}/action/Fibonacci")',
    }
    root: Any = live.load(f"""
        QtObject {{
            property var client: {make[module]}
            function problem() {{ return client.problem }}
        }}
    """)
    wait(root.problem)
    find = "rospack find" if live.robot.wire == "ros1" else "ros2 pkg prefix --share"
    message = (
        f"copy the folder of its package {package} from the robot ({find} {package} says where"
    )
    assert message in root.problem()
    assert f"add it: --definitions {package} on the command line" in root.problem()
