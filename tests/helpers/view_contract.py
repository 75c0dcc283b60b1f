"""A 3D view's camera, moved by robots: with rospy, roscpp and ROS's shell tools, built by catkin.

``tests/rviz/test_view_robots.py`` and ``tests/scene/test_view_robots.py`` collect these tests; the
fixture `camera` of each is a :class:`Camera`, the fixture `master` the URI of a ROS master.
"""

from __future__ import annotations

import json
import math
import queue
import shutil
import subprocess
import threading
from abc import ABC, abstractmethod
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosmaster import RosMaster

HERE = Path(__file__).parent
CATKIN, MESSAGES = Path("/usr/bin/catkin_make"), Path("/usr/share/std_msgs/msg")
PACKAGES = (
    "catkin ros-message-generation ros-message-runtime ros-std-msgs ros-geometry-msgs libroscpp-dev"
)
#: Seconds in which a program starts, or finds a master that is started anew.
PROGRAM_TIMEOUT_S = 40.0
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LEFT = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))


def near(found: Any, wanted: Any, within: float = 0.01) -> bool:
    return all(abs(a - b) < within for a, b in zip(found, wanted, strict=True))


def point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


class Camera(ABC):
    """A view controller with robots, at (4, 0, 3), whose movements take 0.2 s.

    Attributes:
        view: Its `View`.
        session: The session of its node.
        wait: Waits for a condition.
        no_frames: Fixed frames that do not exist.
    """

    view: Any
    session: Any
    wait: Any
    no_frames: tuple[str, ...] = ("nowhere_at_all",)

    @property
    @abstractmethod
    def services(self) -> Any:
        """Its `ViewServices`."""

    @abstractmethod
    def eye(self) -> tuple[float, float, float]:
        """Return where the camera that draws is."""

    @abstractmethod
    def set_fixed_frame(self, frame: str) -> None:
        """Choose the frame in which everything is placed."""

    @abstractmethod
    def set_property(self, name: str, value: Any) -> None:
        """Change a property of the 3D view's own view, e.g. ``Focal Point/X``."""

    @abstractmethod
    def select_view(self, class_id: str) -> None:
        """Change to another type of views, by RViz's class id."""

    @abstractmethod
    def save_config(self, file: Path) -> None:
        """Save a ``.rviz`` file."""

    @abstractmethod
    def load_config(self, file: Path) -> None:
        """Load a ``.rviz`` file."""

    @abstractmethod
    def connect(self) -> None:
        """Create the node again."""


class Robot:
    """Asks a rospy process while the 3D view goes on."""

    def __init__(self, process: Any, answers: queue.Queue[Any]) -> None:
        self._process, self._answers = process, answers
        self._camera: Any = None

    def begin(self, camera: Camera) -> Robot:
        self._camera = camera
        return self

    @property
    def namespace(self) -> str:
        return f"{self._camera.services.namespace}/"

    def ask(self, do: str, **what: Any) -> Any:
        self.begin_to_ask(do, **what)
        return self.answer()

    def begin_to_ask(self, do: str, **what: Any) -> None:
        self._process.stdin.write(json.dumps({"do": do, **what}) + "\n")
        self._process.stdin.flush()

    def answer(self) -> Any:
        self._camera.wait(lambda: not self._answers.empty() or self._process.poll() is not None)
        return self._answers.get_nowait()

    def call(self, service: str, type: str, **request: Any) -> Any:
        return self.ask("call", service=self.namespace + service, type=type, request=request)

    def tf(self, child: str, *translation: float, rotation: Any = UPRIGHT) -> None:
        self.ask("tf", parent="map", child=child, translation=translation, rotation=rotation)


def use_through_restarts(master: RosMaster, namespace: str) -> None:
    """Use the camera of a program as a robot does, before and after the master is started anew."""
    import rosglass

    for mode in (1, 0):
        with rosglass.connect(master.url, "robot") as robot:
            kind = "hector_rviz_plugins/srv/SetViewMode"
            client = robot.create_service_client(f"{namespace}/set_view_mode", kind)
            assert client.wait_for_server(PROGRAM_TIMEOUT_S)
            client.call({"mode": {"mode": mode}}, timeout=PROGRAM_TIMEOUT_S)
            heard: list[int] = []
            robot.create_subscription(
                f"{namespace}/view_mode",
                "hector_rviz_plugins/msg/ViewMode",
                lambda message, heard=heard: heard.append(message.mode),
            )
            eventually(lambda mode=mode, heard=heard: mode in heard, timeout=PROGRAM_TIMEOUT_S)
            assert heard[-1] == mode
        master.restart()


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A catkin workspace with our definitions and a program in C++, built; where it is."""
    import rosglass.interfaces

    for needed in (CATKIN, MESSAGES):
        if not needed.exists():
            pytest.skip(f"{needed} is missing: sudo apt install {PACKAGES}")
    root = tmp_path_factory.mktemp("workspace")
    definitions = Path(rosglass.interfaces.__file__).parent / "definitions/ros1"
    for package in (definitions / "hector_rviz_plugins", HERE / "camera_client"):
        shutil.copytree(package, root / "src" / package.name)
    env = {"PATH": "/usr/bin:/bin", "HOME": str(root), "ROS_LANG_DISABLE": "genlisp"}
    command = [str(CATKIN), "-j2", "-C", str(root)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return root


def environment(master: str, home: str, workspace: Path) -> dict[str, str]:
    """Return what the programs of a robot find, after ``source devel/setup.sh``."""
    return {
        "PATH": "/usr/bin:/bin",
        "HOME": home,
        "ROS_HOME": home,
        "ROS_MASTER_URI": master,
        "ROS_IP": "127.0.0.1",
        "PYTHONPATH": str(workspace / "devel/lib/python3/dist-packages"),
    }


@pytest.fixture(scope="module")
def robot_process(master: str, workspace: Path, tmp_path_factory: Any) -> Iterator[Robot]:
    home = str(tmp_path_factory.mktemp("robot"))
    process = subprocess.Popen(
        ["/usr/bin/python3", str(HERE / "rospy_view.py")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment(master, home, workspace),
    )
    answers: queue.Queue[Any] = queue.Queue()

    def read() -> None:
        for line in process.stdout or ():
            answers.put(json.loads(line))

    threading.Thread(target=read, daemon=True).start()
    yield Robot(process, answers)
    process.kill()
    process.wait()


@pytest.fixture
def robot(camera: Camera, robot_process: Robot) -> Robot:
    return robot_process.begin(camera)


def test_robots_move_the_camera(robot: Robot, camera: Camera) -> None:
    view = camera.view
    assert robot.call("move_eye_and_focus", "MoveEyeAndFocus", eye=point(1, 2, 3)) == "done"
    camera.wait(lambda: near(camera.eye(), (1, 2, 3)))
    assert near(view.focus, (0, 0, 0))
    assert robot.call("move_eye", "MoveEye", eye=point(2, 2, 3), disable_animation=True) == "done"
    camera.wait(lambda: near(camera.eye(), (2, 2, 3)))
    assert near(view.focus, (1, 0, 0))
    assert robot.call("set_view_mode", "SetViewMode", mode={"mode": 1}) == "done"
    camera.wait(lambda: near(camera.eye(), (1, 0, 500)))
    flags = {"switch_to_3d_mode": True, "stop_tracking": True}
    assert robot.call("move_eye", "MoveEye", eye=point(5, 5, 5), **flags) == "done"
    camera.wait(lambda: near(camera.eye(), (5, 5, 5)))
    assert view.mode == 0


def test_service_errors_say_why_the_camera_is_not_moved(
    robot: Robot, camera: Camera, caplog: Any
) -> None:
    view = camera.view
    away = {"header": {"frame_id": "nowhere"}, "eye": {"x": 1.0}}
    assert "nowhere" in robot.call("move_eye", "MoveEye", **away)
    assert "nowhere" in robot.call("move_eye_and_focus", "MoveEyeAndFocus", **away)
    assert "nowhere" in robot.call("set_tracked_frame", "TrackFrame", frame="nowhere")
    assert "7" in robot.call("set_view_mode", "SetViewMode", mode={"mode": 7})
    assert "finite" in robot.call("move_eye", "MoveEye", eye={"x": math.inf})
    assert "finite" in robot.call("move_eye", "MoveEye", eye={"y": math.nan})
    assert "look somewhere" in robot.call("move_eye_and_focus", "MoveEyeAndFocus")
    # A robot's mistakes are not logged as errors of ours.
    assert [record for record in caplog.records if record.levelname == "ERROR"] == []
    assert near(view.eye, (4, 0, 3))


def test_late_subscribers_receive_mode_and_tracked_frame(robot: Robot, camera: Camera) -> None:
    view = camera.view
    view.set_mode(1, animate=False)
    view.track("map")
    mode, frame = robot.namespace + "view_mode", robot.namespace + "tracked_frame"
    robot.ask("listen", topic=mode, mode=True)
    robot.ask("listen", topic=frame, mode=False)
    camera.wait(lambda: robot.ask("heard", topic=mode) == [1])
    camera.wait(lambda: robot.ask("heard", topic=frame) == ["map"])
    view.set_mode(0)
    view.track("")
    camera.wait(lambda: robot.ask("heard", topic=mode) == [1, 0])
    camera.wait(lambda: robot.ask("heard", topic=frame) == ["map", ""])


def test_the_camera_follows_a_frame(robot: Robot, camera: Camera) -> None:
    view = camera.view
    view.settings.tracking_gain = 1000.0
    robot.tf("rover", 1.0, 2.0, 0.0)
    camera.wait(lambda: robot.call("set_tracked_frame", "TrackFrame", frame="rover") == "done")
    camera.wait(lambda: near(camera.eye(), (5, 2, 3)))
    # The rover turns to its left, and the camera with it.
    robot.tf("rover", 1.0, 3.0, 0.0, rotation=LEFT)
    camera.wait(lambda: near(camera.eye(), (1, 7, 3)))
    # Moves are held as seen from it, and go on while it drives.
    view.move_eye((1, 7, 5))
    robot.tf("rover", 2.0, 3.0, 0.0, rotation=LEFT)
    camera.wait(lambda: near(camera.eye(), (2, 7, 5)))
    camera.wait(lambda: not view.is_moving)
    # Turning the view keeps it, shifting it does not.
    camera.set_property("Pitch", 0.3)
    robot.tf("rover", 2.5, 3.0, 0.0, rotation=LEFT)
    camera.wait(lambda: near(view.focus[:2], (2.5, 3)))
    assert view.tracked_frame == "rover"
    camera.set_property("Focal Point/X", 9.0)
    camera.wait(lambda: view.tracked_frame == "")
    view.settings.tracking_gain = 3.0


def test_a_lost_frame_is_reported_once(robot: Robot, camera: Camera) -> None:
    view = camera.view
    problems: list[str] = []
    view.problem_changed.connect(problems.append)
    robot.tf("lost_rover", 1.0, 2.0, 0.0)
    camera.wait(lambda: robot.call("set_tracked_frame", "TrackFrame", frame="lost_rover") == "done")
    camera.set_fixed_frame("elsewhere")
    camera.wait(lambda: view.problem != "")
    camera.wait.nothing_happens(0.3)
    assert len(problems) == 1
    assert "elsewhere" in view.problem
    # It can be moved all the same.
    view.move_eye((7, 7, 7), animate=False)
    camera.set_fixed_frame("map")
    camera.wait(lambda: view.problem == "")
    assert view.tracked_frame == "lost_rover"


def test_topics_and_services_can_be_withdrawn(robot: Robot, camera: Camera) -> None:
    view = camera.view
    service = robot.namespace + "move_eye"
    names = camera.session.node.services
    camera.wait(lambda: service in str(names()))
    view.settings.services = False
    camera.wait(lambda: service not in str(names()))
    view.settings.services = True
    camera.wait(lambda: service in str(names()))


def test_changing_ones_mind_while_they_are_made_leaves_them_there(
    robot: Robot, camera: Camera
) -> None:
    view = camera.view
    for _ in range(3):
        view.settings.topics = False
        view.settings.topics = True
    camera.wait(lambda: camera.services.is_open or camera.services.problem)
    assert not camera.services.problem
    camera.wait(lambda: robot.namespace + "move_eye" in str(camera.session.node.services()))


def test_catkin_makes_the_types_that_we_speak(robot: Robot, camera: Camera) -> None:
    import rosglass

    for name in ("ViewMode", "MoveEye", "MoveEyeAndFocus", "SetViewMode", "TrackFrame"):
        kind = "msg" if name == "ViewMode" else "srv"
        ours = rosglass.load(f"hector_rviz_plugins/{kind}/{name}", ros=1)
        assert robot.ask("md5", kind=kind, type=name) == ours.md5


def test_a_program_in_cpp_moves_the_camera(
    camera: Camera, master: str, workspace: Path, tmp_path: Path
) -> None:
    program = workspace / "devel/lib/camera_client/camera_client"
    client = subprocess.Popen(
        [str(program), camera.services.namespace],
        env=environment(master, str(tmp_path), workspace),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    camera.wait(lambda: client.poll() is not None)
    out, problems = client.communicate()
    assert out.splitlines() == [
        "move_eye refused",
        "set_view_mode done",
        "set_tracked_frame done",
        "heard 1 'map'",
        "move_eye_and_focus done",
        "heard 0 ''",
        "move_eye done",
    ]
    assert "nowhere" in problems
    camera.wait(lambda: near(camera.eye(), (5, 6, 7)))


def test_from_a_shell(camera: Camera, master: str, workspace: Path, tmp_path: Path) -> None:
    def shell(line: str) -> str:
        env = environment(master, str(tmp_path), workspace)
        made = subprocess.Popen(
            line, shell=True, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        camera.wait(lambda: made.poll() is not None)
        return made.communicate()[0]

    call = f"rosservice call {camera.services.namespace}/move_eye"
    assert "ERROR" not in shell(call + " '{eye: {x: 3, y: 2, z: 1}, disable_animation: true}'")
    camera.wait(lambda: near(camera.eye(), (3, 2, 1)))
    assert "nowhere" in shell(call + " '{header: {frame_id: nowhere}}'")


def test_whatever_view_is_shown_calls_are_answered(robot: Robot, camera: Camera) -> None:
    view = camera.view
    for kind in ("rviz/FPS", "rviz/ThirdPersonFollower", "rviz/XYOrbit"):
        camera.select_view(kind)
        assert robot.call("move_eye", "MoveEye", eye=point(1, 2, 3)) == "done"
        camera.wait(lambda: near(camera.eye(), (1, 2, 3)))
        camera.select_view(kind)
        assert robot.call("set_view_mode", "SetViewMode", mode={"mode": 1}) == "done"
        camera.wait(lambda: not view.is_moving)
    robot.tf("rover", 1.0, 2.0, 0.0)
    there = {"header": {"frame_id": "rover"}, "eye": point(1, 2, 3)}
    camera.wait(lambda: robot.call("move_eye", "MoveEye", **there) == "done")
    for fixed in camera.no_frames:
        camera.set_fixed_frame(fixed)
        assert "fixed frame" in robot.call("move_eye", "MoveEye", **there)
        # What is in the fixed frame itself needs no other.
        assert robot.call("move_eye", "MoveEye", eye=point(1, 2, 3)) == "done"


def test_calls_while_a_config_is_loaded(robot: Robot, camera: Camera, tmp_path: Path) -> None:
    file = tmp_path / "kept.rviz"
    camera.save_config(file)
    service = robot.namespace + "move_eye"
    request = {"eye": point(7, 8, 9), "disable_animation": True}
    robot.begin_to_ask("call", service=service, type="MoveEye", request=request, times=30)
    for _ in range(5):
        camera.load_config(file)
        camera.wait.frames(1)
    assert robot.answer() == "done"
    assert robot.call("move_eye", "MoveEye", **request) == "done"
    camera.wait(lambda: near(camera.eye(), (7, 8, 9)))


def test_a_hundred_calls_at_once(robot: Robot, camera: Camera) -> None:
    service = robot.namespace + "move_eye_and_focus"
    request = {"eye": point(3, 4, 5), "focus": point(0, 0, 1)}
    done = robot.ask("call", service=service, type="MoveEyeAndFocus", request=request, times=100)
    assert done == "done"
    service = robot.namespace + "set_view_mode"
    request = {"mode": {"mode": 7}}
    done = robot.ask("call", service=service, type="SetViewMode", request=request, times=100)
    assert "no view mode 7" in done
    camera.wait(lambda: near(camera.eye(), (3, 4, 5)))


def test_another_node_offers_the_same(robot: Robot, camera: Camera, master: str) -> None:
    first = camera.session.node
    camera.session.shutdown()
    camera.wait(lambda: camera.session.node is None)
    assert not camera.services.is_open
    camera.session.init("another_node")
    camera.wait(lambda: camera.services.is_open)
    assert camera.session.node is not first
    assert robot.call("set_view_mode", "SetViewMode", mode={"mode": 1}) == "done"
    mode = robot.namespace + "view_mode"
    robot.ask("listen", topic=mode, mode=True)
    camera.wait(lambda: 1 in robot.ask("heard", topic=mode))
    # Another address.
    second, camera.session.url = camera.session.node, master.replace("http", "ros1") + "/"
    camera.wait(lambda: camera.session.node not in (None, second))
    camera.wait(lambda: camera.services.is_open)
    assert robot.call("set_view_mode", "SetViewMode", mode={"mode": 0}) == "done"
    camera.wait(lambda: robot.ask("heard", topic=mode)[-1] == 0)


def test_a_second_node_of_the_name_ends_ours(camera: Camera, master: str) -> None:
    import rosglass

    session = camera.session
    with closing(rosglass.connect(master.replace("http", "ros1"), name=session.name)):
        camera.wait(lambda: session.state == "failed")
        assert "new node registered with same name" in session.detail
        camera.wait(lambda: not camera.services.is_open)
        assert camera.services.problem == session.detail
    # It does not come back by itself, but on request.
    session.shutdown()
    camera.connect()
    camera.wait(lambda: session.state == "connected" and camera.services.is_open)
