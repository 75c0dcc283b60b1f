"""The examples of the guide, run as they are printed, with a robot that has what they name."""

from __future__ import annotations

import asyncio
import concurrent.futures
import inspect
import logging
import os
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from documentation import Reader
from waiting import eventually

import rosglass
from rosglass.comm import ParameterDescriptor, Range
from rosglass.interfaces import Library, type_description
from rosglass.wires.dds.domain import DdsOptions
from rosglass.wires.zenoh.options import ZenohOptions

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[3]
PAGES = [
    "README.md",
    *(f"docs/{name}.md" for name in ("index", "interfaces", "messages", "ros2", "topics")),
    *(f"docs/{name}.md" for name in ("services", "parameters", "unknown_types", "recording")),
]
#: Those in which nothing is connected.
ALONE = {"docs/interfaces.md", "docs/messages.md"}
#: Types that a robot's own packages define.
PACKAGES = {
    "my_robot_msgs/msg/State": "uint8 CHARGING=1\nfloat32 battery 0.5\n",
    "my_robot_msgs/srv/Ask": "string question\n---\nstring answer\n",
    "my_robot_msgs/action/Go": "float32 speed\n---\n---\nfloat32 left\n",
    "my_robot_msgs/action/Dock": "int8 station\n---\nbool docked\n---\nfloat32 distance\n",
    "secret_msgs/msg/Thing": "int32 secret 7\n",
}
ADD, FIBONACCI = "example_interfaces/srv/AddTwoInts", "example_interfaces/action/Fibonacci"


@pytest.fixture(scope="module")
def robot_library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    folder = tmp_path_factory.mktemp("packages")
    for name, text in PACKAGES.items():
        package, kind, base = name.split("/")
        (folder / package / kind).mkdir(parents=True, exist_ok=True)
        (folder / package / kind / f"{base}.{kind}").write_text(text)
        (folder / package / "package.xml").write_text(f"<package><name>{package}</name></package>")
    library = Library()
    library.add_path(str(folder))
    return library


class Robot:
    """Everything that the examples talk to; publishes 20 times per second.

    Args:
        url: Where it is.
        library: Has the definitions of its own types.
    """

    def __init__(self, url: str, library: Library) -> None:
        def connect(name: str, namespace: str = "/") -> Any:
            return rosglass.connect(url, name, namespace, library=library)

        self.base, self.left = connect("robot"), connect("robot", "/left")
        self.arm, self.camera = connect("robot", "/arm"), connect("camera")
        self.nodes = [self.base, self.left, self.arm, self.camera]
        self._publish()
        self._serve()
        self._lifecycle()

    def close(self) -> None:
        for node in self.nodes:
            node.close()

    def _publish(self) -> None:
        base = self.base
        topics = {
            "/odom": "nav_msgs/msg/Odometry",
            "/scan": "sensor_msgs/msg/LaserScan",
            "/pose": "geometry_msgs/msg/PoseStamped",
            "/state": "my_robot_msgs/msg/State",
            "/secret": "secret_msgs/msg/Thing",
        }
        publishers = [base.create_publisher(topic, kind) for topic, kind in topics.items()]
        base.create_timer(0.05, lambda: [publisher.publish() for publisher in publishers])
        latched = rosglass.QoS.latched()
        base.create_publisher("/map", "nav_msgs/msg/OccupancyGrid", latched).publish()
        self.left.create_publisher("state", "my_robot_msgs/msg/State")
        self.arm.create_publisher("state", "std_msgs/msg/String")

    def _serve(self) -> None:
        def add(request: Any) -> dict[str, int]:
            return {"sum": request.a + request.b}

        def count(goal: Any) -> dict[str, Any]:
            goal.publish_feedback(sequence=[0, 1])
            goal.wait_for_cancel(0.2)
            return {"sequence": [0] * goal.goal.order}

        def dock(goal: Any) -> dict[str, Any]:
            goal.publish_feedback(distance=0.5)
            return {"docked": goal.goal.station == 3}

        for node, name in ((self.base, "/add"), (self.arm, "add")):
            node.create_service_server(name, ADD, add)
        for node, name in ((self.base, "/fibonacci"), (self.arm, "count")):
            node.create_action_server(name, FIBONACCI, count)
        self.base.create_action_server("/dock", "my_robot_msgs/action/Dock", dock)
        ask = "my_robot_msgs/srv/Ask"
        for node in (self.base, self.left):
            node.create_service_server("ask", ask, lambda request: {"answer": request.question})
        self.base.create_action_server("/go", "my_robot_msgs/action/Go", lambda goal: None)

        parameters = self.camera.parameters
        slow = ParameterDescriptor(range=Range(1, 60, 1))
        parameters.declare("fps", 30, slow)
        parameters.declare("exposure", 0.01)
        parameters.on_set(lambda new: "too long" if new.get("exposure", 0) > 1 else "")

    def _lifecycle(self) -> None:
        labels = {1: "unconfigured", 2: "inactive", 3: "active"}
        steps = {"configure": (1, 1, 2), "deactivate": (4, 3, 2), "activate": (3, 2, 3)}
        now = [1]

        def state(number: int) -> dict[str, Any]:
            return {"id": number, "label": labels[number]}

        def described(only: int | None) -> list[dict[str, Any]]:
            return [
                {
                    "transition": {"id": number, "label": label},
                    "start_state": state(start),
                    "goal_state": state(goal),
                }
                for label, (number, start, goal) in steps.items()
                if only in (None, start)
            ]

        def change(request: Any) -> dict[str, bool]:
            wanted = request.transition
            for label, (number, start, goal) in steps.items():
                if start == now[0] and (wanted.label == label or wanted.id == number):
                    now[0] = goal
                    return {"success": True}
            return {"success": False}

        kind = "lifecycle_msgs/srv/"
        transitions = kind + "GetAvailableTransitions"
        self.camera.create_publisher("~/transition_event", "lifecycle_msgs/msg/TransitionEvent")
        for name, type_, callback in (
            ("get_state", kind + "GetState", lambda _: {"current_state": state(now[0])}),
            ("change_state", kind + "ChangeState", change),
            ("get_available_states", kind + "GetAvailableStates", lambda _: None),
            (
                "get_available_transitions",
                transitions,
                lambda _: {"available_transitions": described(now[0])},
            ),
            (
                "get_transition_graph",
                transitions,
                lambda _: {"available_transitions": described(None)},
            ),
        ):
            self.camera.create_service_server(f"~/{name}", type_, callback)


@pytest.fixture(scope="module", params=["zenoh", "dds"])
def robot(request: pytest.FixtureRequest, robot_library: Library) -> Iterator[Robot]:
    if request.param == "zenoh":
        url = request.getfixturevalue("router").url
    else:
        pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
        url = f"dds://?domain={request.getfixturevalue('dds_domain')}"
    made = Robot(url, robot_library)
    yield made
    made.close()


class World:
    """The things that the examples of all pages take for granted: a node, and a folder for files.

    Args:
        robot: The node that every URL leads to.
    """

    def __init__(self, robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
        self.said: list[Any] = []
        self.nodes: list[Any] = []
        self._robot, self._connect = robot, rosglass.connect
        self._names: dict[str, Any] = {}
        self._subscriptions: list[Any] = []
        monkeypatch.setattr(rosglass, "connect", self.connect)

    def connect(self, url: str, *arguments: Any, **options: Any) -> Any:
        """Connect to the robot instead of one that is somewhere else."""
        if url.startswith("replay:"):
            return self._connect(url, *arguments, **options)
        (DdsOptions if url.startswith("dds") else ZenohOptions).parse(url, {})
        node = self._connect(self._robot.base.url, *arguments, **options)
        subscribe = node.create_subscription

        def create_subscription(*arguments: Any, **options: Any) -> Any:
            self._subscriptions.append(subscribe(*arguments, **options))
            return self._subscriptions[-1]

        node.create_subscription = create_subscription
        self.nodes.append(node)
        return node

    def given(self) -> dict[str, Any]:
        node = self.connect("dds://", "cockpit", "/left")
        self._names = {
            "__name__": "cockpit",
            "asyncio": asyncio,
            "concurrent": concurrent,
            "description": type_description(Library().definition("std_msgs/msg/String")),
            "drive": self._drive,
            "here": node,
            "logging": logging,
            "node": node,
            "path_bytes": rosglass.load("nav_msgs/msg/Path").encode(),
            "plan": lambda request: {"success": True},
            "print": self.say,
            "reset": lambda: None,
            "rosglass": rosglass,
            "show": self.say,
            "station": 3,
            "sys": SimpleNamespace(argv=["cockpit.py"]),
            "there": node,
            "update": lambda: self.say("tick"),
        }
        return self._names

    def say(self, *values: Any) -> None:
        """Take what is printed; who loops over a subscription for ever has seen enough then."""
        self.said.append(values)
        frame = inspect.currentframe()
        assert frame is not None
        assert frame.f_back is not None
        if frame.f_back.f_code.co_name == "<module>" and self._subscriptions:
            self._subscriptions[-1].close()

    def _drive(self) -> None:
        """Drive until something of it is recorded."""
        recorder = self._names["recorder"]
        eventually(lambda: recorder.status().messages, recorder.status)

    def close(self) -> None:
        for node in self.nodes:
            node.close()


@pytest.fixture
def bag_of_ros1(tmp_path: Path) -> Path:
    rosbag1 = pytest.importorskip("rosbags.rosbag1", reason='needs pip install "rosglass[bags]"')
    kind = rosglass.load("std_msgs/String", ros=1)
    with rosbag1.Writer(tmp_path / "ros1.bag") as writer:
        text = kind.definition.text
        said = writer.add_connection("/chat", "std_msgs/msg/String", msgdef=text, md5sum=kind.md5)
        writer.write(said, 1_000_000_000, kind.encode(data="hello"))
    return tmp_path / "ros1.bag"


@pytest.fixture
def world(robot: Robot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[World]:
    monkeypatch.chdir(tmp_path)
    made = World(robot, monkeypatch)
    yield made
    made.close()


@pytest.mark.parametrize("page", [page for page in PAGES if page not in ALONE])
def test_examples_run_as_printed(
    page: str, world: World, caplog: pytest.LogCaptureFixture, bag_of_ros1: Path
) -> None:
    if page == "docs/recording.md":
        os.link(bag_of_ros1, "drive.bag")
    if page == "docs/parameters.md":
        Path("cockpit.yaml").write_text("/left/cockpit: {ros__parameters: {speed: 1.0}}\n")
    assert Reader(page, world.given()).read() > 2
    failed = [
        record for record in caplog.records if record.exc_info and "docking" not in record.msg
    ]
    assert not failed, failed


@pytest.mark.parametrize("page", sorted(ALONE))
def test_examples_without_a_robot_run_as_printed(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "my_msgs" / "msg" / "Oven.msg").write_text("float32[] temperatures\n")
    monkeypatch.chdir(tmp_path)
    path = rosglass.load("nav_msgs/msg/Path").encode()
    assert Reader(page, {"rosglass": rosglass, "path_bytes": path}).read() > 2
