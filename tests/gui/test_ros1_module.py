"""Features of Ros 1.0 alone: its singleton, publishers, subscribers, packages, loggers."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import QoS
from rosglass.comm.qos import Durability

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import Bench


@pytest.fixture
def ros1(bench: Bench) -> Bench:
    bench.module = "Ros 1.0"
    return bench


@pytest.fixture
def up(ros1: Bench, wait: Any) -> Bench:
    ros1.session.init("ui")
    wait(lambda: ros1.session.node is not None)
    return ros1


@pytest.mark.parametrize(
    ("call", "name"),
    [
        ('Ros.init("arm")', "arm"),
        ('Ros.init("arm", 0)', "arm"),
        ('Ros.init([], "arm")', "arm"),
        ('Ros.init(["prog", "--ros-args", "-r", "__node:=left"], "arm")', "left"),
        ('Ros.init([], "arm", RosInitOptions.NoSigintHandler)', "arm"),
    ],
)
def test_init(ros1: Bench, call: str, name: str) -> None:
    script = f"""
        let initialized = []
        Ros.initialized.connect(function () {{ initialized.push(Ros.isInitialized()) }})
        {call}
        return [Ros.getName(), Ros.getNamespace(), Ros.ok(), initialized]
    """
    assert ros1.run(script) == [f"/{name}", "/", True, [True]]


def test_the_name_is_that_of_the_ros_graph(ros1: Bench) -> None:
    """As ``ros::this_node::getName()``; in ``Ros2 1.0`` it is the base name, as in rclcpp."""
    assert ros1.run("return Ros.getName()") == ""
    ros1.session.init("arm", "/left")
    assert ros1.run("return [Ros.getName(), Ros.getNamespace()]") == ["/left/arm", "/left"]


def test_anonymous_names(ros1: Bench) -> None:
    name = ros1.run('Ros.init("arm", RosInitOptions.AnonymousName); return Ros.getName()')
    assert name.startswith("/arm_")
    assert len(name) > 10


@pytest.mark.parametrize("call", ["Ros.init(5)", 'Ros.init("arm", 64)', 'Ros.init("a b")'])
def test_wrong_init(ros1: Bench, call: str) -> None:
    script = f"try {{ {call} }} catch (error) {{ return error.toString() }}"
    assert "Ros.init" in ros1.run(script)
    assert ros1.run("return Ros.isInitialized()") is False


def test_shutdown_is_notified(up: Bench) -> None:
    root: Any = up.load("QtObject { property int n: 0 }", "import QtQuick 2.15")
    up.run("return Ros.ok()")
    other: Any = up.load(
        "QtObject { property int n: 0; property Connections c: Connections { target: Ros; "
        "function onShutdown() { n += 1 } } }"
    )
    up.session.shutdown()
    assert (root.property("n"), other.property("n")) == (0, 1)


@pytest.mark.both_qt
def test_publishing(up: Bench, wait: Any) -> None:
    received: list[Any] = []
    up.robot.create_subscription("/base/speed", "geometry_msgs/msg/Twist", received.append)
    root: Any = up.load("""
        QtObject {
            property var pub: Ros.advertise("base", "geometry_msgs/Twist", "speed", 5)
            property int n: 0
            property Connections c: Connections { target: pub; function onConnected() { n += 1 } }
            function send() { return pub.publish({linear: {x: 0.5}}) }
            function shown() {
                return [pub.type, pub.topic, pub.queueSize, pub.isLatched, pub.isAdvertised,
                        pub.getNumSubscribers()].join()
            }
        }
    """)
    wait(lambda: "true" in root.shown())
    assert root.send() is True
    wait(lambda: received)
    assert received[0].linear.x == 0.5
    assert root.shown() == "geometry_msgs/Twist,/base/speed,5,false,true,1"
    wait(lambda: root.property("n") == 1)


def test_commands(up: Bench, wait: Any) -> None:
    received: list[Any] = []
    up.robot.create_subscription("/speed", "geometry_msgs/msg/Twist", received.append)
    root: Any = up.load("""
        QtObject {
            property var pub: Ros.advertise("geometry_msgs/Twist", "/speed", Ros.CommandQoS())
            function send() { return pub.publish({linear: {x: 0.5}}) }
            function shown() { return [pub.queueSize, pub.isLatched, pub.qos.sendTimeoutMs].join() }
        }
    """)
    wait(lambda: root.send() and received)
    assert root.shown() == "1,false,300"


def test_latched_publishers(up: Bench, wait: Any) -> None:
    root: Any = up.load("""
        QtObject {
            property var pub: Ros.advertise("std_msgs/String", "/mode", 10, true)
            function send() { return pub.publish({data: "auto"}) }
        }
    """)
    wait(root.send)
    late: list[Any] = []
    qos = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
    up.robot.create_subscription("/mode", "std_msgs/msg/String", late.append, qos)
    wait(lambda: late)
    assert late[0].data == "auto"


@pytest.mark.both_qt
@pytest.mark.parametrize(
    "call",
    [
        'Ros.advertise("std_msgs/String", "/mode")',
        'Ros.advertise("std_msgs/String", "/mode", -1)',
        'Ros.advertise("std_msgs/String", "/mode", "ten")',
        'Ros.advertise("std_msgs/String", "/mode", Ros.CommandQoS(), true)',
        'Ros.advertise("", "/mode", 10)',
        'Ros.advertise("std_msgs/String", "no good", 10)',
        'Ros.advertise("/mode", "std_msgs/String", 10)',
        'Ros.createActionClient("/arm", "a/BAction")',
        "Ros.advertise(1, 2, 3)",
        'Ros.subscribe("no good", 1)',
        'Ros.subscribe("/x", -1)',
        "Ros.subscribe(3, 1)",
        "Ros.setThreads(-1)",
        'Ros.logInternal(17, "f", "file", 1, "text")',
    ],
)
def test_misuse_throws(up: Bench, call: str) -> None:
    script = f"try {{ {call} }} catch (error) {{ return error.toString() }}\nreturn ''"
    assert up.run(script).startswith("Error:")


def test_subscribing(up: Bench, wait: Any) -> None:
    sender = up.robot.create_publisher("/base/speed", "std_msgs/msg/String")
    root: Any = up.load("""
        QtObject {
            property var made: Ros.subscribe("base", "speed", 3)
            property Subscriber sub: Subscriber { ns: "/base"; topic: "speed"; running: false }
            property string heard
            property Connections c: Connections {
                target: sub; function onNewMessage(message) { heard = message.data }
            }
            function shown() {
                return [sub.topic, sub.ns, sub.queueSize, sub.running, sub.throttleRate,
                        sub.getNumPublishers(), made.topic, made.queueSize].join()
            }
            function start() { sub.running = true }
        }
    """)
    wait(lambda: "/base/speed,3" in root.shown())
    assert root.shown() == "speed,/base,1,false,20,0,/base/speed,3"
    root.start()
    wait(lambda: root.shown().startswith("/base/speed,/base,1,true,20,1"))
    wait(lambda: sender.publish(data="fast") is None and root.property("heard") == "fast")


def test_the_graph(up: Bench, wait: Any) -> None:
    assert up.run("return Ros.queryTopics()") == []
    up.robot.create_publisher("/mode", "std_msgs/msg/String")
    assert up.run('return Ros.queryTopics("std_msgs/String")') == ["/mode"]
    assert up.run('return Ros.queryTopics("std_msgs/Bool")') == []
    assert up.run('return Ros.queryTopicType("mode")') == "std_msgs/String"
    assert up.run('return Ros.queryTopicType("/other")') == ""
    assert up.run("return Ros.queryTopicInfo()") == [
        {"name": "/mode", "datatype": "std_msgs/String"}
    ]


def test_waiting_for_a_message(up: Bench, wait: Any) -> None:
    sender = up.robot.create_publisher("/mode", "std_msgs/msg/String")
    root: Any = up.load("""
        QtObject {
            property string heard
            property string promised
            property string late: "not yet"
            Component.onCompleted: {
                Ros.waitForMessageAsync("/mode", function (m) { heard = m.data })
                Ros.waitForMessageAsync("/mode").then(function (m) { promised = m.data })
                Ros.waitForMessageAsync("/never", 50, function (m) { late = typeof m })
            }
        }
    """)
    wait(lambda: root.property("late") == "undefined")
    wait(lambda: len(up.robot.subscriptions("/mode")) == 2)
    sender.publish(data="auto")
    wait(lambda: root.property("heard") == "auto" and root.property("promised") == "auto")
    wait(lambda: not up.robot.subscriptions("/mode"))


def test_loggers(ros1: Bench, caplog: Any) -> None:
    caplog.set_level(logging.INFO, "rosglass.qml")
    caplog.handler.setLevel(logging.DEBUG)
    shown = ros1.run("""
        Ros.info("plain %s")
        Ros.warn("named", "arm")
        Ros.debug("hidden", "arm")
        const done = Ros.console.setLoggerLevel("ros.qml_ros_plugin.arm", RosConsoleLevels.Debug)
        Ros.debug("seen", "arm")
        Ros.logInternal(RosConsoleLevels.Error, "go", "panel.qml", 7, "from elsewhere")
        return [done, Ros.console.defaultName, Ros.console.setLoggerLevel("arm", 99)]
    """)
    assert shown == [True, "ros.qml_ros_plugin", False]
    found = {(r.name, r.levelname, r.getMessage()) for r in caplog.records}
    assert ("rosglass.qml", "INFO", "plain %s") in found
    assert ("rosglass.qml.arm", "WARNING", "named") in found
    assert ("rosglass.qml.arm", "DEBUG", "seen") in found
    assert not any("hidden" in text for _, _, text in found)
    last = next(r for r in caplog.records if r.getMessage() == "from elsewhere")
    assert (last.pathname, last.lineno, last.funcName) == ("panel.qml", 7, "go")
    logging.getLogger("rosglass.qml.arm").setLevel(logging.NOTSET)


def test_packages(ros1: Bench, tmp_path: Path, monkeypatch: Any, caplog: Any) -> None:
    folder = tmp_path / "arm_ui"
    folder.mkdir()
    (folder / "package.xml").write_text(
        "<package format='2'><name>arm_ui</name><export><rviz plugin='${prefix}/p.xml'/>"
        "<rviz other='1'/></export></package>"
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.setenv("PATH", "/nowhere")
    shown = ros1.run("""
        const p = Ros.package
        return [p.getPath("arm_ui"), p.getPath("leg_ui"), p.getAll().includes("arm_ui"),
                p.getPlugins("rviz", "plugin"), p.command("list")]
    """)
    assert shown == [str(folder), "", True, {"arm_ui": [f"{folder}/p.xml"]}, ""]
    assert "rospack is not installed" in caplog.text
    # The environment changes while the program runs.
    other = tmp_path / "other" / "leg_ui"
    other.mkdir(parents=True)
    (other / "package.xml").write_text("<package format='2'><name>leg_ui</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(other.parent))
    script = """
        const p = Ros.package
        return [p.getPath("arm_ui"), p.getPath("leg_ui"), p.getAll().includes("leg_ui")]
    """
    assert ros1.run(script) == ["", str(other), True]


def test_the_environment(ros1: Bench, monkeypatch: Any) -> None:
    monkeypatch.setenv("ROBOT_NAME", "Hector")
    script = 'return [Ros.getEnvironmentVariable("ROBOT_NAME"), Ros.getEnvironmentVariable("NO")]'
    assert ros1.run(script) == ["Hector", ""]


def test_types_have_ros1_names_in_messages(running: Any, wait: Any, caplog: Any) -> None:
    running.module = "Ros 1.0"
    root = running.load(
        """QtObject {
            property var word: Ros.advertise("std_msgs/String", "/word", 1)
            property var odd: Ros.advertise("std_msgs/Strin", "/odd", 1)
            function ready() { return word.isAdvertised }
            function send() { try { word.publish({data: 5}) } catch (e) { return String(e) } }
            function shout() { odd.publish({}) }
        }"""
    )
    wait(root.ready)
    message = "nothing was published on /word: std_msgs/String: data: expected a string, got 5"
    assert message in root.send()
    wait(lambda: "/odd: " in caplog.text)
    assert "Did you mean std_msgs/String? " in caplog.text
    root.shout()
    assert "nothing was published on /odd: no definition of std_msgs/Strin" in caplog.text
    assert "/msg/" not in caplog.text
