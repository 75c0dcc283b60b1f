"""The built-in parts of a node: remote parameters, log, simulated time, remapping."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest

from rosglass import Time
from rosglass.comm import (
    ConnectionState,
    ParameterDescriptor,
    State,
    Transition,
)
from rosglass.errors import (
    Error,
    NodeClosedError,
    ParameterError,
    RosArgumentError,
    ServiceUnavailableError,
    TransitionError,
)
from rosglass.ros2 import Ros2Node
from rosglass.ros2.ros_arguments import Arguments

from .steered import SteeredMiddleware

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


LOG, CLOCK = "rcl_interfaces/msg/Log", "rosgraph_msgs/msg/Clock"


@pytest.fixture
def start(url: str) -> Iterator[Callable[..., Ros2Node]]:
    """Start a node with the built-in services that connect() gives it, with --ros-args."""
    made: list[Ros2Node] = []

    def start(
        *arguments: str, name: str = "robot", namespace: str = "/", own_services: bool = True
    ) -> Ros2Node:
        parsed = Arguments.parse(["--ros-args", *arguments])
        name = parsed.node_name(name)
        namespace = parsed.namespace(name, namespace)
        middleware = SteeredMiddleware(url)
        node = Ros2Node(
            middleware, "fake://", name, namespace, None, parsed, own_services=own_services
        )
        node.fake = middleware
        made.append(node)
        return node

    yield start
    for node in made:
        node.close()


def received(node: Ros2Node, topic: str, kind: str) -> list[Any]:
    messages: list[Any] = []
    node.create_subscription(topic, kind, messages.append)
    return messages


# -- parameters --------------------------------------------------------------------------------


def test_services_have_ros_names_types_and_profiles(start, eventually) -> None:
    robot = start(namespace="/arm")
    ends = robot.fake.repliers
    eventually(lambda: [end for end in ends if end.info.name.endswith("_atomically")])
    offered = {end.info.name: end.info for end in ends if "parameter" in end.info.name}
    assert {name: info.type for name, info in offered.items()} == {
        "/arm/robot/describe_parameters": "rcl_interfaces/srv/DescribeParameters",
        "/arm/robot/get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
        "/arm/robot/get_parameters": "rcl_interfaces/srv/GetParameters",
        "/arm/robot/list_parameters": "rcl_interfaces/srv/ListParameters",
        "/arm/robot/set_parameters": "rcl_interfaces/srv/SetParameters",
        "/arm/robot/set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
    }
    assert {info.qos.depth for info in offered.values()} == {1000}
    topics = {writer.info.name: writer.info.qos for writer in robot.fake.writers}
    assert topics.keys() == {"/rosout", "/parameter_events"}
    assert topics["/parameter_events"].depth == 1000
    assert topics["/rosout"].durability.value == "transient_local"
    assert topics["/rosout"].lifespan.seconds == 10


def test_types_are_described_unless_the_parameter_says_otherwise(start, eventually) -> None:
    def offered(robot: Ros2Node) -> list[str]:
        ends = robot.fake.repliers
        eventually(lambda: [end for end in ends if end.info.name.endswith("_atomically")])
        return [end.info.name for end in ends if "parameter" not in end.info.name]

    assert offered(start()) == ["/robot/get_type_description"]
    assert offered(start("-p", "start_type_description_service:=false", name="quiet")) == []


def test_waiting_callback_does_not_block_the_parameter_services(start, node) -> None:
    robot = start()
    waits, release = threading.Event(), threading.Event()
    robot.create_timer(0.001, lambda: waits.set() or release.wait(30))
    assert waits.wait(30)
    client = node.create_parameter_client("/robot")
    assert client.get(["use_sim_time"], timeout=30) == {"use_sim_time": False}
    release.set()


def test_remotely_set_values_are_validated(start, node) -> None:
    robot = start()
    robot.parameters.declare("a", 1)
    robot.parameters.on_set(lambda values: "too much" if values["a"] > 5 else "")
    client = node.create_parameter_client("/robot")
    assert client.set({"a": 6})["a"] == (False, "too much")
    assert client.set({"a": 5})["a"] == (True, "")


def test_empty_list_for_a_parameter_that_is_not_there(start, node) -> None:
    start()
    client = node.create_parameter_client("/robot")
    with pytest.raises(ParameterError, match="/robot does not know the types of nix"):
        client.set({"nix": []})
    with pytest.raises(ParameterError, match="a parameter is a bool"):
        client.set({"nix": object()})


def test_nodes_that_answer_all_or_nothing(connect, node) -> None:
    # rclcpp's say nothing at all when one of the parameters is not declared.
    robot = connect("robot")
    values = {"a": 1, "b": 2}

    def get(request: Any) -> dict[str, Any]:
        known = all(name in values for name in request.names)
        answer = [{"type": 2, "integer_value": values[n]} for n in request.names] if known else []
        return {"values": answer}

    robot.create_service_server("~/get_parameters", "rcl_interfaces/srv/GetParameters", get)
    robot.create_service_server(
        "~/list_parameters",
        "rcl_interfaces/srv/ListParameters",
        lambda _: {"result": {"names": list(values)}},
    )
    client = node.create_parameter_client("/robot")
    assert client.get(["b", "nix", "a"]) == {"b": 2, "nix": None, "a": 1}
    assert client.get(["nix"]) == {"nix": None}


def test_parameter_files_of_another_node(start, node, tmp_path: Path) -> None:
    robot = start(namespace="/arm")
    robot.parameters.declare("a.b", 1.0)
    robot.parameters.declare("c", "x", ParameterDescriptor(read_only=True))
    client = node.create_parameter_client("/arm/robot")
    file = tmp_path / "robot.yaml"
    client.save(file)
    assert file.read_text() == (
        "/arm/robot:\n  ros__parameters:\n    a:\n      b: 1.0\n    c: x\n"
        "    start_type_description_service: true\n    use_sim_time: false\n"
    )
    client.set({"a.b": 2.0})
    assert len(client.load(file)) == 4
    assert robot.parameters.get("a.b") == 1.0
    file.write_text("/**: {ros__parameters: {a: {b: 3.0}, c: y, nix: 1}}")
    with pytest.raises(ParameterError, match=r"/arm/robot refuses c: .*read-only; nix: .*declared"):
        client.load(file)
    assert robot.parameters.get("a.b") == 3.0
    file.write_text("/other: {ros__parameters: {a: 1}}")
    with pytest.raises(ParameterError, match="has no parameters for /arm/robot"):
        client.load(file)


# -- --ros-args --------------------------------------------------------------------------------


def test_names_are_remapped_everywhere(start) -> None:
    robot = start(
        *("-r", "chatter:=talk", "-r", "~/state:=/state", "-r", "rosservice://add:=/plus"),
        *("-r", "rostopic://add:=/sum", "-r", "__node:=arm", "-r", "__ns:=/left"),
        own_services=False,
    )
    assert (robot.name, robot.namespace) == ("arm", "/left")
    assert robot.resolve("chatter") == robot.resolve("/left/chatter") == "/left/talk"
    assert robot.resolve("/chatter") == "/chatter"
    publisher = robot.create_publisher("~/state", "std_msgs/msg/String")
    assert publisher.topic == "/state"
    assert robot.create_subscription("add", "std_msgs/msg/String").topic == "/sum"
    kind = "example_interfaces/srv/AddTwoInts"
    assert robot.create_service_client("add", kind).name == "/plus"
    assert robot.create_service_server("add", kind, lambda _: None).name == "/plus"
    assert repr(robot) == "<Ros2Node /left/arm on fake://>"


def test_parameters_are_given_from_outside(start, tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text("/robot: {ros__parameters: {gains: {p: 2.0}}}\n/*: {ros__parameters: {n: 1}}")
    robot = start("-p", "robot:rate:=30", "--params-file", str(file), own_services=False)
    assert robot.parameters.declare("rate", 10) == 30
    assert robot.parameters.declare("gains.p", 1.0) == 2.0
    assert robot.parameters.overrides == {"rate": 30, "gains.p": 2.0, "n": 1}


def test_rules_that_do_not_fit_the_node_are_refused(start) -> None:
    with pytest.raises(RosArgumentError, match="cannot be applied"):
        start("-r", f"a:={'x' * 240}", namespace="/" + "n" * 20)


# -- logging -----------------------------------------------------------------------------------


def test_log_goes_to_rosout_as_ros_2_has_it_and_to_python(start, node, caplog, eventually):
    robot = start(namespace="/arm")
    messages = received(node, "/rosout", LOG)
    with caplog.at_level(logging.INFO):
        robot.logger.info("hello %s", "you")
    robot.logger.getChild("drive.left").error("bad")
    robot.logger.critical("worse")
    eventually(lambda: len(messages) == 3)
    assert [(message.name, message.level) for message in messages] == [
        ("arm.robot", 20),
        ("arm.robot.drive.left", 40),
        ("arm.robot", 50),
    ]
    assert abs(messages[0].stamp.sec - time.time()) < 5
    assert "hello you" in caplog.text


def test_levels_come_from_the_command_line(start) -> None:
    robot = start("--log-level", "warn", "--log-level", "robot.drive:=debug", own_services=False)
    assert not robot.logger.isEnabledFor(logging.INFO)
    assert robot.logger.getChild("drive").isEnabledFor(logging.DEBUG)
    assert robot.logger.getChild("drive.left").isEnabledFor(logging.DEBUG)
    assert not robot.logger.getChild("arm").isEnabledFor(logging.INFO)
    robot.logger.setLevel(logging.DEBUG)
    assert robot.logger.getChild("arm").isEnabledFor(logging.DEBUG)
    assert not start("--log-level", "robot:=error").logger.isEnabledFor(logging.WARNING)
    assert robot.logger.getChild("arm") is robot.logger.getChild("arm")


def test_librarys_own_loggers_have_levels_too(start) -> None:
    logger = logging.getLogger("rosglass.test.levels")
    start("--log-level", "rosglass.test.levels:=debug", own_services=False)
    assert logger.level == logging.DEBUG


def test_logs_can_be_switched_off(start, node, caplog, eventually) -> None:
    robot = start("--disable-rosout-logs", "--disable-stdout-logs")
    messages = received(node, "/rosout", LOG)
    robot.logger.error("not published")
    eventually(lambda: node.logger.error("of another node") or messages)
    assert {message.msg for message in messages} == {"of another node"}
    assert "not published" not in caplog.text
    assert not [writer for writer in robot.fake.writers if writer.info.name == "/rosout"]


# -- simulated time ----------------------------------------------------------------------------


def test_time_is_simulated_from_the_start_or_switched_remotely(start, node, eventually) -> None:
    robot = start("-p", "use_sim_time:=true")
    assert robot.clock.is_simulated
    assert robot.now() == Time(0)
    client = node.create_parameter_client("/robot")
    assert client.set({"use_sim_time": False}, timeout=30)["use_sim_time"].successful
    eventually(lambda: not robot.clock.is_simulated)


# -- lifecycle ---------------------------------------------------------------------------------


class Camera:
    """A node with a lifecycle, as rclcpp's are."""

    LABELS = ("unknown", "unconfigured", "inactive", "active", "finalized")
    WAYS = (
        (1, "configure", 1, 2),
        (3, "activate", 2, 3),
        (4, "deactivate", 3, 2),
        (2, "cleanup", 2, 1),
        (5, "unconfigured_shutdown", 1, 4),
        (6, "inactive_shutdown", 2, 4),
        (7, "active_shutdown", 3, 4),
    )

    def __init__(self, node: Ros2Node) -> None:
        self.state, self.fails = 1, False
        kind = "lifecycle_msgs/srv/"
        self.events = node.create_publisher(
            "~/transition_event", "lifecycle_msgs/msg/TransitionEvent"
        )
        for name, service, answer in (
            ("get_state", "GetState", lambda _: {"current_state": self.known(self.state)}),
            ("change_state", "ChangeState", self.change),
            (
                "get_available_states",
                "GetAvailableStates",
                lambda _: {"available_states": [self.known(i) for i in range(5)]},
            ),
            (
                "get_available_transitions",
                "GetAvailableTransitions",
                lambda _: self.ways(lambda way: way[2] == self.state),
            ),
            ("get_transition_graph", "GetAvailableTransitions", lambda _: self.ways(bool)),
        ):
            node.create_service_server(f"~/{name}", kind + service, answer)

    def known(self, state: int) -> dict[str, Any]:
        return {"id": state, "label": self.LABELS[state]}

    def ways(self, wanted: Callable[[Any], bool]) -> dict[str, Any]:
        return {
            "available_transitions": [
                {
                    "transition": {"id": number, "label": label},
                    "start_state": self.known(start),
                    "goal_state": self.known(goal),
                }
                for number, label, start, goal in filter(wanted, self.WAYS)
            ]
        }

    def change(self, request: Any) -> dict[str, Any]:
        for number, label, start, goal in self.WAYS:
            if (number, start) == (request.transition.id, self.state):
                if self.fails:
                    return {"success": False}
                self.state = goal
                self.events.publish(
                    timestamp=5,
                    transition={"id": number, "label": label},
                    start_state=self.known(start),
                    goal_state=self.known(goal),
                )
                return {"success": True}
        return {"success": False}


@pytest.fixture
def camera(connect) -> Camera:
    return Camera(connect("camera"))


def test_lifecycle_node_is_driven(node, camera, eventually) -> None:
    client = node.create_lifecycle_client("/camera")
    assert client.wait_for_server(30)
    assert client.ready
    events: list[Any] = []
    client.watch(events.append)
    assert client.state() == State(1, "unconfigured")
    assert [str(state) for state in client.available_states()][:2] == [
        "unknown [0]",
        "unconfigured [1]",
    ]
    assert client.available_transitions()[0] == Transition(
        1, "configure", State(1, "unconfigured"), State(2, "inactive")
    )
    assert len(client.transition_graph()) == 7
    assert client.configure() == State(2, "inactive")
    assert client.change_state(3) == State(3, "active")
    assert client.deactivate() == State(2, "inactive")
    assert client.cleanup() == State(1, "unconfigured")
    assert client.shutdown() == State(4, "finalized")
    eventually(lambda: len(events) == 5)
    assert events[0].time == Time(5)
    assert events[0].transition.label == "configure"
    assert events[-1].transition.goal == State(4, "finalized")


def test_impossible_transitions_are_explained(node, camera) -> None:
    client = node.create_lifecycle_client("/camera")
    with pytest.raises(
        TransitionError,
        match=r"/camera cannot 'activate' now: it is unconfigured \[1\]; possible are: "
        r"configure \[1\], unconfigured_shutdown \[5\]",
    ):
        client.activate()
    camera.fails = True
    with pytest.raises(TransitionError, match=r"/camera failed to configure, and is unconfigured"):
        client.configure()
    client.close()
    client.close()
    assert not client.ready
    with pytest.raises(NodeClosedError):
        client.state()


def test_node_without_lifecycle_is_reported(node) -> None:
    client = node.create_lifecycle_client("/unmanaged")
    with pytest.raises(ServiceUnavailableError, match="/unmanaged/get_available_transitions"):
        client.activate(timeout=0.05)


def test_node_that_fails_to_start_leaves_nothing_behind(middleware):
    threads = set(threading.enumerate())
    wrong = Arguments.parse(["--ros-args", "-p", "use_sim_time:=maybe"])
    with pytest.raises(Error, match="use_sim_time"):
        Ros2Node(middleware, "fake://", "robot", "/", None, wrong, own_services=True)
    assert middleware.status().state is ConnectionState.CLOSED
    assert set(threading.enumerate()) <= threads
