"""The singleton Ros2: the node's life, what it says about the connection, the graph."""

from __future__ import annotations

import os
import threading
import time
from typing import Any

import pytest

from rosglass.comm import ConnectionState
from rosglass.errors import ConnectionLostError, Error, UnsupportedError
from rosglass.extras import install_command
from rosglass.qml import IMPORT_PATHS, Session, install
from rosglass.qml.run.modules import register
from rosglass.qt import QtCore, QtQml, send_deferred_deletes

LOG = """QtObject {
    id: root
    property var log: []
    function say(text) { log.push(text) }
    property string state: Ros2.connectionState + "|" + Ros2.connectionDetail
    property var c: Connections {
        target: Ros2
        function onInitialized() { say("initialized " + Ros2.isInitialized() + Ros2.getName()) }
        function onAboutToShutdown() { say("aboutToShutdown " + Ros2.isInitialized()) }
        function onConnectionChanged() { log.push(Ros2.connectionState) }
    }
}"""


def log(root: Any) -> list:
    return root.property("log").toVariant()


def test_an_engine_that_was_not_prepared_says_what_to_do(
    app: Any, tmp_path: Any, wait: Any, caplog: Any
) -> None:
    register()
    engine = QtQml.QQmlEngine()
    for path in IMPORT_PATHS:
        engine.addImportPath(str(path))
    file = tmp_path / "Main.qml"
    file.write_text(
        """import QtQml 2.15
        import Ros2 1.0
        QtObject {
            property QtObject sub: Subscription { topic: "/x" }
            property string error
            Component.onCompleted: try { Ros2.init("ui") } catch (e) { error = String(e) }
        }"""
    )
    component = QtQml.QQmlComponent(engine, QtCore.QUrl.fromLocalFile(str(file)))
    root = component.create()
    assert "Ros2 cannot be used yet: call rosglass.qml.install(engine)" in root.property("error")
    wait(lambda: "rosglass.qml.install" in root.property("sub").property("problem"))
    assert "Ros2 cannot be used yet" in caplog.text


@pytest.mark.both_qt
def test_elements_that_are_gone_at_once_say_nothing(bench: Any, wait: Any, caplog: Any) -> None:
    bench.load(
        """import QtQuick 2.15
        import Ros2 1.0
        Item {
            Repeater { id: some; model: 3; Item { Subscription { topic: "/x" } } }
            Component.onCompleted: { some.model = 2; some.model = 1 }
        }"""
    )
    wait.settled(bench.session)
    assert "cannot be used yet" not in caplog.text


def test_before_init(bench: Any) -> None:
    script = """return [Ros2.isInitialized(), Ros2.ok(), Ros2.getName(), Ros2.getNamespace(),
        Ros2.connectionState, Ros2.queryTopics(), Ros2.hostname.length > 0]"""
    assert bench.run(script) == [False, False, "", "", "uninitialized", [], True]


def test_life(bench: Any, wait: Any) -> None:
    root = bench.load(LOG)
    wait.settled(bench.session)
    script = """Ros2.init('ui');
        return [Ros2.isInitialized(), Ros2.ok(), Ros2.getName(), Ros2.getNamespace()]"""
    assert bench.run(script) == [True, True, "ui", "/"]
    wait(lambda: bench.session.state == "connected")
    bench.run("Ros2.init('ui')")
    assert [n.name for n in bench.world.nodes] == ["robot", "ui"]
    bench.run("Ros2.shutdown(); Ros2.shutdown()")
    wait(lambda: len(bench.world.nodes) == 1)
    assert bench.run("return [Ros2.isInitialized(), Ros2.getName()]") == [False, ""]
    assert log(root) == [
        "connecting",
        "initialized trueui",
        "connected",
        "aboutToShutdown true",
        "uninitialized",
    ]
    bench.run("Ros2.init('ui2', Ros2.createInitOptions().setNamespace('/space'))")
    wait(lambda: bench.session.node is not None)
    assert bench.session.node.namespace == "/space"


def test_a_second_name_is_ignored_with_a_warning(running: Any, caplog: Any) -> None:
    running.run("Ros2.init('other')")
    assert running.session.name == "ui"
    assert "'other'" in caplog.text


@pytest.mark.parametrize(
    ("arguments", "name", "namespace"),
    [
        ("'a', ['--ros-args', '-r', '__node:=b', '-r', '__ns:=/n']", "b", "/n"),
        ("'a', ['x', '--ros-args', '--remap', '__ns:=/n', '--', '-r']", "a", "/n"),
        ("'a', [], Ros2.createInitOptions().setNamespace('/o')", "a", "/o"),
    ],
)
def test_command_lines(bench: Any, wait: Any, arguments: str, name: str, namespace: str) -> None:
    bench.run(f"Ros2.init({arguments})")
    wait(lambda: bench.session.node is not None)
    assert (bench.session.node.name, bench.session.node.namespace) == (name, namespace)


def test_domain_goes_into_the_address(bench: Any, wait: Any) -> None:
    bench.session.url = "zenoh://robot?mode=client&domain=3"
    bench.run("Ros2.init('a', Ros2.createInitOptions().setDomainId(7))")
    wait(lambda: bench.session.node is not None)
    assert bench.session.node.url == "zenoh://robot?mode=client&domain=7"


@pytest.mark.parametrize(
    ("url", "env", "expected"),
    [
        ("", {}, "dds://?domain=7"),
        ("", {"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}, "dds://?domain=7"),
        ("", {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, "zenoh://?domain=7"),
        ("", {"ROS_DISTRO": "jazzy", "ROS_DOMAIN_ID": "3"}, "dds://?domain=7"),
        ("", {"ROS_MASTER_URI": "http://robot:11311"}, "dds://?domain=7"),
        ("", {"ROSGLASS_URL": "zenoh://robot?domain=3"}, "zenoh://robot?domain=7"),
        ("replay:drive.mcap", {}, "replay:drive.mcap"),
        ("ros1://robot", {}, "ros1://robot"),
    ],
)
def test_the_environment_says_which_middleware_a_domain_is_of(
    url: str, env: dict, expected: str, bench: Any, wait: Any, monkeypatch: Any, caplog: Any
) -> None:
    for name in ("ROSGLASS_URL", "RMW_IMPLEMENTATION", "ZENOH_SESSION_CONFIG_URI", "ROS_DISTRO",
                 "ROS_DOMAIN_ID", "CYCLONEDDS_URI", "ROS_MASTER_URI"):  # fmt: skip
        monkeypatch.delenv(name, raising=False)
    for name, value in env.items():
        monkeypatch.setenv(name, value)
    bench.session.url = url
    bench.run("Ros2.init('a', Ros2.createInitOptions().setDomainId(7))")
    wait(lambda: bench.session.node is not None)
    assert bench.session.node.url == expected
    assert ("has no domains" in caplog.text) == ("domain" not in expected)


def test_a_package_that_is_missing_is_named_with_what_installs_it(
    bench: Any, wait: Any, monkeypatch: Any
) -> None:
    def connect(*_: Any, **__: Any) -> Any:
        raise ModuleNotFoundError("No module named 'mcap'", name="mcap.reader")

    monkeypatch.setattr("rosglass.connection.connect", connect)
    session = type(bench.session)("replay:drive.mcap")
    session.init("a")
    wait(lambda: session.state == "failed")
    assert f"mcap.reader is not installed; install it with: {install_command('bags')}" in (
        session.detail
    )
    session.close()


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ("'bad name'", "bad name"),
        ("''", "must not be empty"),
        ("'a', {namespace: 'x', domain: -1}", "not absolute"),
        ("'a', {}", "createInitOptions"),
        ("'a', Ros2.createInitOptions().setDomainId(999)", "0 to 232"),
        ("'a', ['--ros-args', '--nonsense']", "--nonsense"),
    ],
)
def test_bad_init_throws(bench: Any, arguments: str, reason: str) -> None:
    script = "try { Ros2.init(%s); return 'made' } catch (e) { return String(e) }"
    assert reason in bench.run(script.replace("%s", arguments))
    assert not bench.session.is_initialized


def test_the_state_of_the_connection_is_shown(running: Any, wait: Any) -> None:
    root = running.load(LOG)
    assert root.property("state") == "connected|connected to memory://"
    running.session.node.set_status(ConnectionState.LOST, "no router at x, retrying")
    wait(lambda: root.property("state") == "lost|no router at x, retrying")
    running.session.node.set_status(ConnectionState.CONNECTED)
    wait(lambda: root.property("state") == "connected|")


def test_the_address_can_be_changed_while_running(running: Any, wait: Any) -> None:
    chat = 'Subscription { topic: "/t"; messageType: "std_msgs/String" }'
    root = running.load(f"QtObject {{ property QtObject s: {chat} }}")
    wait(lambda: root.property("s").property("subscribed"))
    running.run("Ros2.url = 'memory://other'")
    wait(lambda: running.session.node is not None and running.session.node.url == "memory://other")
    wait(lambda: root.property("s").property("subscribed"))
    assert len(running.world.nodes) == 2
    assert running.run("return Ros2.url") == "memory://other"
    running.run("Ros2.url = 'memory://operator:secret@other'")
    assert running.run("return Ros2.url") == "memory://operator:***@other"


def engine_with(session: Session, tmp_path: Any) -> Any:
    from local_world import LocalWorld

    from conftest import Bench

    engine = QtQml.QQmlEngine()
    install(engine, session)
    return Bench(session, engine, LocalWorld(), tmp_path)


def test_connecting_never_blocks(app: Any, tmp_path: Any, wait: Any) -> None:
    release = threading.Event()

    def connect(url: Any, name: str, namespace: str) -> Any:
        release.wait(10)
        raise UnsupportedError("no such world")

    made = engine_with(Session(connect=connect), tmp_path)
    started = time.monotonic()
    made.run("Ros2.init('a')")
    assert time.monotonic() - started < 8
    assert made.session.state == "connecting"
    release.set()
    wait(lambda: made.session.state == "failed")
    assert made.run("return [Ros2.connectionDetail, Ros2.ok()]") == ["no such world", False]
    made.close()


def test_an_address_that_cannot_be_used_yet_is_tried_again(
    app: Any, tmp_path: Any, wait: Any
) -> None:
    from local_world import LocalWorld

    world, tries = LocalWorld(), []

    def connect(url: Any, name: str, namespace: str) -> Any:
        tries.append(name)
        if len(tries) == 1:
            raise ConnectionLostError("no network")
        return world.connect(url, name, namespace)

    made = engine_with(Session(connect=connect), tmp_path)
    made.run("Ros2.init('a')")
    wait(lambda: made.session.detail == "no network")
    assert made.session.state == "connecting"
    wait(lambda: made.session.state == "connected")
    made.close()


@pytest.mark.both_qt
def test_engines_share_a_session_and_may_go_first(running: Any, wait: Any, tmp_path: Any) -> None:
    engine = QtQml.QQmlEngine()
    install(engine, running.session)
    with pytest.raises(Error, match="only once"):
        install(engine, running.session)
    from conftest import Bench

    other = Bench(running.session, engine, running.world, tmp_path / "other")
    script = "return [Ros2.getName(), Ros2.createPublisher('/x', 'std_msgs/msg/Bool').topic]"
    assert other.run(script) == ["ui", "/x"]
    other.load('QtObject { property QtObject s: Subscription { topic: "/t" } }')
    engine.deleteLater()
    del engine, other
    wait.settled(running.session)
    assert running.run("return Ros2.getName()") == "ui"


@pytest.mark.both_qt
def test_objects_may_outlive_their_engine(bench: Any, wait: Any) -> None:
    engine = QtQml.QQmlEngine()
    install(engine, bench.session)
    component = QtQml.QQmlComponent(engine)
    text = b'import QtQml 2.15; import Ros2 1.0; Subscription { topic: "x" }'
    component.setData(text, QtCore.QUrl("file:///Main.qml"))
    made: Any = component.create()
    assert made is not None, component.errorString()
    engine.deleteLater()
    send_deferred_deletes()
    # The element looks for its engine in the next turn, and reports afterwards that it has none.
    wait(lambda: made.property("problem"))


@pytest.mark.both_qt
def test_engines_without_a_session_share_the_application_s(app: Any) -> None:
    engines = [QtQml.QQmlEngine(), QtQml.QQmlEngine()]
    sessions = {install(engine) for engine in engines}
    assert sessions == {Session.default()}
    Session.default().close()
    assert Session.default() not in sessions
    Session.default().close()


def test_a_node_made_in_python_can_be_used(bench: Any, wait: Any) -> None:
    node = bench.world.connect("memory://mine", "mine")
    bench.session.adopt(node)
    assert bench.run("return [Ros2.getName(), Ros2.connectionState]") == ["mine", "connected"]
    bench.session.shutdown()
    wait.settled(bench.session)
    assert node in bench.world.nodes


def test_the_graph_can_be_asked(running: Any, wait: Any) -> None:
    running.robot.create_publisher("/a", "std_msgs/msg/String")
    running.robot.create_publisher("/a", "std_msgs/msg/Int32")
    running.robot.create_publisher("/b", "std_msgs/msg/String")
    running.robot.create_publisher("/x/_action/feedback", "std_msgs/msg/String")
    shown = running.run(
        """return [Ros2.queryTopics(), Ros2.queryTopics("std_msgs/Int32"),
            Ros2.queryTopics("std_msgs/msg/Nothing"), Ros2.queryTopicInfo()[1],
            Ros2.getTopicTypes("a"), Ros2.queryTopicTypes("/b"), Ros2.getTopicNamesAndTypes()["/b"],
            Ros2.getTopicTypes("/none"), Ros2.isValidTopic("/a/b"), Ros2.isValidTopic("a b"),
            Ros2.isValidTopic(""), Ros2.getTopicTypes(""), Ros2.getServiceTypes("")]"""
    )
    text, number = "std_msgs/msg/String", "std_msgs/msg/Int32"
    assert shown == [
        ["/a", "/b"],
        ["/a"],
        [],
        {"name": "/b", "datatypes": [text]},
        sorted([text, number]),
        [text],
        [text],
        [],
        True,
        False,
        False,
        [],  # the field of an interface is still empty
        [],
    ]


@pytest.mark.both_qt
def test_empty_messages(bench: Any, caplog: Any) -> None:
    script = """const m = Ros2.createEmptyMessage("geometry_msgs/PoseStamped");
        return [m.pose.orientation.w, m.header.frame_id, m["#messageType"],
                m.header.stamp.isZero()]"""
    assert bench.run(script) == [1, "", "geometry_msgs/msg/PoseStamped", True]
    assert bench.run("return Ros2.createEmptyMessage('no/msg/Type') === undefined") is True
    assert "no/msg/Type" in caplog.text
    assert caplog.records[-1].pathname.endswith(".qml")


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        ("CommandQoS", ["reliable", "volatile", 1]),
        ("SensorDataQoS", ["best_effort", "volatile", 5]),
        ("SystemDefaultsQoS", ["reliable", "volatile", 10]),
        ("ServicesQoS", ["reliable", "volatile", 10]),
        ("ClockQoS", ["best_effort", "volatile", 1]),
        ("BestAvailableQoS", ["best_available", "best_available", 10]),
        ("QoS", ["best_effort", "volatile", 1]),
    ],
)
def test_presets(bench: Any, call: str, expected: list) -> None:
    script = f"const q = Ros2.{call}(); return [q.reliability, q.durability, q.depth()]"
    assert bench.run(script) == expected


def test_packages_of_install_spaces(bench: Any, tmp_path: Any, monkeypatch: Any) -> None:
    listed = tmp_path / "share/ament_index/resource_index/packages"
    listed.mkdir(parents=True)
    (listed / "arm_ui").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}")
    shown = bench.run("""
        const a = AmentIndex
        return [a.getPackages(), a.getPackagePrefix("arm_ui"),
                a.getPackageShareDirectory("arm_ui"), a.getPackageShareDirectory("leg"),
                a.getPackagePrefix("../packages")]
    """)
    assert shown == [["arm_ui"], str(tmp_path), f"{tmp_path}/share/arm_ui", "", ""]


def test_install_spaces_that_cannot_be_read(
    bench: Any, tmp_path: Any, monkeypatch: Any, caplog: Any
) -> None:
    listed = tmp_path / "share/ament_index/resource_index/packages"
    listed.mkdir(parents=True)
    (listed / "arm_ui").touch()
    locked, read = "/locked/share/ament_index/resource_index/packages", os.listdir

    def list_folder(path: str) -> list[str]:
        if path == locked:
            raise PermissionError(13, "Permission denied", path)
        return read(path)

    monkeypatch.setattr("os.listdir", list_folder)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/locked:{tmp_path}")
    script = "return [AmentIndex.getPackages(), AmentIndex.getPackagePrefix('x'.repeat(5000))]"
    assert bench.run(script) == [["arm_ui"], ""]
    assert f"{locked} cannot be read: Permission denied" in caplog.text


def test_folders_that_do_not_answer(bench: Any, monkeypatch: Any, caplog: Any) -> None:
    asked = threading.Event()

    def wait_for_ever(path: str) -> list[str]:
        asked.wait(60)
        return []

    monkeypatch.setattr("os.listdir", wait_for_ever)
    monkeypatch.setattr("rosglass.qml.elements.ros2.FOLDER_TIMEOUT_S", 0.1)
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/far/away")
    assert bench.run("return AmentIndex.getPackages()") == []
    assert "AMENT_PREFIX_PATH did not answer within 0.1 s" in caplog.text
    asked.set()


def test_present_graph_and_lost_graph_are_notified(bench: Any, wait: Any) -> None:
    bench.robot.create_publisher("/chatter", "std_msgs/msg/String")
    root: Any = bench.load("""
        QtObject {
            property var topics: []
            property Connections c: Connections {
                target: Ros2
                function onGraphChanged() { topics = Ros2.queryTopics() }
            }
            function names() { return topics.join() }
        }
    """)
    wait.settled(bench.session)
    bench.session.init("ui")
    wait(lambda: "/chatter" in root.names())
    bench.session.shutdown()
    assert root.names() == ""
