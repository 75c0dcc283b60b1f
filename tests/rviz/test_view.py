"""RViz's camera: moved by Python, by rospy's service calls, by keys and along tf."""

from __future__ import annotations

import json
import math
import queue
import subprocess
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

HERE = Path(__file__).parent
GENPY = Path("/usr/lib/genpy")
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LEFT = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))
#: What the definitions need besides themselves; Debian has no files of them.
NEEDED = {
    "std_msgs/msg/Header": "uint32 seq\ntime stamp\nstring frame_id\n",
    "geometry_msgs/msg/Point": "float64 x\nfloat64 y\nfloat64 z\n",
}


def near(found: Any, wanted: Any, within: float = 0.01) -> bool:
    return all(abs(a - b) < within for a, b in zip(found, wanted, strict=True))


@pytest.fixture
def view(app: Any, wait: Callable[..., None]) -> Any:
    """The camera at (4, 0, 3), moving within 0.2 s, and a node of ours."""
    app.connect()
    app.view.reset()
    app.view.settings.animation_duration = 0.2
    wait(lambda: app.view_services.problem == "" and app.session.node is not None)
    yield app.view
    app.view.reset()
    app.window.manager.setFixedFrame("map")
    wait(50)


@pytest.fixture
def camera(app: Any, wait: Callable[..., None]) -> Callable[[], tuple[float, float, float]]:
    """Return where Ogre's camera is once RViz has drawn."""
    from rosglass.rviz.camera import Camera

    made = Camera(app.window)

    def where() -> tuple[float, float, float]:
        made.update()
        return made.eye

    return where


class Robot:
    """Asks a rospy process while RViz goes on."""

    def __init__(self, process: Any, answers: queue.Queue[Any]) -> None:
        self._process, self._answers = process, answers
        self.namespace = ""
        self._wait: Any = None

    def begin(self, wait: Callable[..., None], namespace: str) -> Robot:
        self._wait, self.namespace = wait, namespace
        return self

    def ask(self, do: str, **what: Any) -> Any:
        self._process.stdin.write(json.dumps({"do": do, **what}) + "\n")
        self._process.stdin.flush()
        self._wait(lambda: not self._answers.empty() or self._process.poll() is not None)
        return self._answers.get_nowait()

    def call(self, service: str, type: str, **request: Any) -> Any:
        return self.ask("call", service=self.namespace + service, type=type, request=request)

    def tf(self, child: str, *translation: float, rotation: Any = UPRIGHT) -> None:
        self.ask("tf", parent="map", child=child, translation=translation, rotation=rotation)


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python classes that genpy makes of our definitions."""
    import rosglass.interfaces

    if not GENPY.is_dir():
        pytest.skip("genpy is not installed: sudo apt install python3-genpy")
    root = tmp_path_factory.mktemp("generated")
    for name, text in NEEDED.items():
        file = root / "share" / f"{name}.msg"
        file.parent.mkdir(parents=True)
        file.write_text(text)
    package = Path(rosglass.interfaces.__file__).parent / "definitions/ros1/hector_rviz_plugins"
    folders = {name.split("/")[0]: root / "share" / Path(name).parent for name in NEEDED}
    folders[package.name] = package / "msg"
    includes = [f"-I{name}:{folder}" for name, folder in folders.items()]
    made = root / package.name
    made.mkdir()
    (made / "__init__.py").touch()
    for kind, program in (("msg", "genmsg_py.py"), ("srv", "gensrv_py.py")):
        run = ["/usr/bin/python3", str(GENPY / program), "-p", package.name]
        run += ["-o", str(made / kind)]
        for more in ([*map(str, sorted((package / kind).iterdir())), *includes], ["--initpy"]):
            subprocess.run([*run, *more], check=True, capture_output=True, env={})
    return root


@pytest.fixture(scope="module")
def robot_process(app: Any, master: str, generated: Path, tmp_path_factory: Any) -> Iterator[Robot]:
    home = str(tmp_path_factory.mktemp("robot"))
    process = subprocess.Popen(
        ["/usr/bin/python3", str(HERE / "rospy_view.py")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={
            "PATH": "/usr/bin:/bin",
            "HOME": home,
            "ROS_HOME": home,
            "ROS_MASTER_URI": master,
            "ROS_IP": "127.0.0.1",
            "PYTHONPATH": str(generated),
        },
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
def robot(app: Any, view: Any, robot_process: Robot, wait: Callable[..., None]) -> Robot:
    return robot_process.begin(wait, f"{app.node_name}/hector_view_controller/")


# By Python


def test_places_and_modes(view: Any, camera: Any, wait: Callable[..., None]) -> None:
    view.move_eye_and_focus((1, 2, 3), (0, 0, 1))
    wait(lambda: not view.is_moving)
    wait(lambda: near(camera(), (1, 2, 3)))
    assert near(view.focus, (0, 0, 1))
    view.move_eye((3, 2, 3))
    wait(lambda: near(camera(), (3, 2, 3)))
    assert near(view.focus, (2, 0, 1))
    modes: list[int] = []
    view.mode_changed.connect(lambda: modes.append(int(view.mode)))
    view.set_mode(1)
    wait(lambda: not view.is_moving)
    wait(lambda: near(camera(), (2, 0, 500)))
    view.set_mode(0)
    wait(lambda: near(camera(), (3, 2, 3)))
    assert near(view.focus, (2, 0, 1))
    assert modes == [1, 0]


def test_2d_shows_as_much_as_3d_did(app: Any, view: Any, wait: Callable[..., None]) -> None:
    from rosglass.rviz.camera import Camera

    steep = 1e-3
    view.move_eye_and_focus((2 - 10 * steep, 1, 10), (2, 1, 0), animate=False)
    wait(200)
    camera, point = Camera(app.window), (3.0, 2.0, 0.0)
    camera.update()
    before = camera.project(point)
    view.set_mode(1, animate=False)
    wait(200)
    camera.update()
    assert near(camera.project(point)[:2], before[:2], 3.0)


def test_other_views_make_place_and_nothing_crashes_rviz(
    app: Any, view: Any, camera: Any, wait: Callable[..., None]
) -> None:
    manager = app.window.manager.getViewManager()
    # Two views in one event had RViz's panel touch the first one, which was gone.
    for kind in ("rviz/TopDownOrtho", "rviz/FPS", "rviz/ThirdPersonFollower", "rviz/FPS"):
        manager.setCurrentViewControllerType(kind)
    wait(200)
    assert near(view.eye, camera())
    view.move_eye((5, 6, 7))
    wait(lambda: near(camera(), (5, 6, 7)))
    assert manager.getCurrent().getClassId() == "rviz/Orbit"
    view.set_mode(1)
    manager.setCurrentViewControllerType("rviz/FPS")
    assert not view.is_moving
    wait(100)
    assert manager.getCurrent().getClassId() == "rviz/FPS"


def test_what_cannot_be_done_is_an_error(view: Any) -> None:
    from rosglass.errors import Error

    before = view.eye
    for call in (
        lambda: view.move_eye((1, 2)),
        lambda: view.move_eye((1, 2, math.nan)),
        lambda: view.move_eye((1, 2, 1e9)),
        lambda: view.move_eye((1, 2, 3), "nowhere"),
        lambda: view.move_eye((1, 2, 3), 7),
        lambda: view.move_eye_and_focus((1, 2, 3), (1, 2, 3)),
        lambda: view.set_mode(2),
        lambda: view.set_mode(True),
        lambda: view.track("nowhere"),
        lambda: setattr(view.settings, "animation_duration", -1),
        lambda: setattr(view.settings, "tracking_gain", math.nan),
    ):
        with pytest.raises(Error):
            call()
    assert near(view.eye, before)
    assert view.tracked_frame == ""


def test_who_moves_the_camera_otherwise_ends_our_movement(
    app: Any, view: Any, wait: Callable[..., None]
) -> None:
    view.settings.animation_duration = 60.0
    view.move_eye((50, 50, 50))
    wait(100)
    app.window.manager.getViewManager().getCurrent().subProp("Yaw").setValue(1.0)
    wait(lambda: not view.is_moving)
    app.window.manager.setFixedFrame("map")
    view.move_eye((50, 50, 50))
    app.window.manager.setFixedFrame("odom")
    wait(lambda: not view.is_moving)


def test_a_config_that_is_loaded_ends_movement_and_tracking(
    app: Any, view: Any, wait: Callable[..., None], tmp_path: Path
) -> None:
    file = tmp_path / "kept.rviz"
    app.save_config(file)
    view.track("map")
    view.set_mode(1, animate=False)
    view.settings.animation_duration = 60.0
    view.move_eye((50, 50, 50))
    app.load_config(file)
    assert not view.is_moving
    wait(100)
    assert view.tracked_frame == ""
    assert view.mode == 0
    assert near(view.eye, (4, 0, 3))


# Keys


def test_arrow_keys_shift_the_view_and_ctrl_d_changes_the_mode(
    app: Any, view: Any, wait: Callable[..., None]
) -> None:
    from PySide2.QtCore import Qt
    from PySide2.QtTest import QTest

    panel = app.window.panel
    app.window.widget.activateWindow()
    panel.setFocus()
    wait(panel.hasFocus)
    start = view.focus
    QTest.keyPress(panel, Qt.Key_Up)
    wait(lambda: view.focus.x < start.x - 0.5)
    QTest.keyRelease(panel, Qt.Key_Up)
    wait(50)
    stopped = view.focus
    wait(200)
    assert near(view.focus, stopped, 1e-6)
    assert near(stopped[1:], start[1:])
    QTest.keyPress(panel, Qt.Key_Left)
    wait(lambda: view.focus.y < stopped.y - 0.5)
    # Who goes elsewhere with a key down does not leave the camera running.
    panel.clearFocus()
    wait(50)
    stopped = view.focus
    wait(200)
    assert near(view.focus, stopped, 1e-6)
    QTest.keyClick(panel, Qt.Key_D, Qt.ControlModifier)
    assert view.mode == 1
    QTest.keyClick(panel, Qt.Key_D, Qt.ControlModifier)
    assert view.mode == 0
    view.settings.keys = False
    QTest.keyClick(panel, Qt.Key_D, Qt.ControlModifier)
    view.settings.keys = True
    assert view.mode == 0


# By ROS


def test_robots_move_the_camera(
    robot: Robot, view: Any, camera: Any, wait: Callable[..., None]
) -> None:
    def point(x: float, y: float, z: float) -> dict[str, float]:
        return {"x": x, "y": y, "z": z}

    assert robot.call("move_eye_and_focus", "MoveEyeAndFocus", eye=point(1, 2, 3)) == "done"
    wait(lambda: near(camera(), (1, 2, 3)))
    assert near(view.focus, (0, 0, 0))
    assert robot.call("move_eye", "MoveEye", eye=point(2, 2, 3), disable_animation=True) == "done"
    wait(lambda: near(camera(), (2, 2, 3)))
    assert near(view.focus, (1, 0, 0))
    assert robot.call("set_view_mode", "SetViewMode", mode={"mode": 1}) == "done"
    wait(lambda: near(camera(), (1, 0, 500)))
    flags = {"switch_to_3d_mode": True, "stop_tracking": True}
    assert robot.call("move_eye", "MoveEye", eye=point(5, 5, 5), **flags) == "done"
    wait(lambda: near(camera(), (5, 5, 5)))
    assert view.mode == 0


def test_robots_hear_why_the_camera_is_not_moved(robot: Robot, view: Any) -> None:
    away = {"header": {"frame_id": "nowhere"}, "eye": {"x": 1.0}}
    assert "nowhere" in robot.call("move_eye", "MoveEye", **away)
    assert "nowhere" in robot.call("move_eye_and_focus", "MoveEyeAndFocus", **away)
    assert "nowhere" in robot.call("set_tracked_frame", "TrackFrame", frame="nowhere")
    assert "7" in robot.call("set_view_mode", "SetViewMode", mode={"mode": 7})
    assert "finite" in robot.call("move_eye", "MoveEye", eye={"x": math.inf})
    assert "look somewhere" in robot.call("move_eye_and_focus", "MoveEyeAndFocus")
    assert near(view.eye, (4, 0, 3))


def test_late_subscribers_hear_mode_and_tracked_frame(
    robot: Robot, view: Any, wait: Callable[..., None]
) -> None:
    view.set_mode(1, animate=False)
    view.track("map")
    mode, frame = robot.namespace + "view_mode", robot.namespace + "tracked_frame"
    robot.ask("listen", topic=mode, mode=True)
    robot.ask("listen", topic=frame, mode=False)
    wait(lambda: robot.ask("heard", topic=mode) == [1])
    wait(lambda: robot.ask("heard", topic=frame) == ["map"])
    view.set_mode(0)
    view.track("")
    wait(lambda: robot.ask("heard", topic=mode) == [1, 0])
    wait(lambda: robot.ask("heard", topic=frame) == ["map", ""])


def test_the_camera_follows_a_frame(
    app: Any, robot: Robot, view: Any, camera: Any, wait: Callable[..., None]
) -> None:
    view.settings.tracking_gain = 1000.0
    robot.tf("rover", 1.0, 2.0, 0.0)
    wait(lambda: robot.call("set_tracked_frame", "TrackFrame", frame="rover") == "done")
    wait(lambda: near(camera(), (5, 2, 3)))
    # The rover turns to its left, and the camera with it.
    robot.tf("rover", 1.0, 3.0, 0.0, rotation=LEFT)
    wait(lambda: near(camera(), (1, 7, 3)))
    # Moves are held as seen from it, and go on while it drives.
    view.move_eye((1, 7, 5))
    robot.tf("rover", 2.0, 3.0, 0.0, rotation=LEFT)
    wait(lambda: near(camera(), (2, 7, 5)))
    assert not view.is_moving
    # Turning the view keeps it, shifting it does not.
    orbit = app.window.manager.getViewManager().getCurrent()
    orbit.subProp("Pitch").setValue(0.3)
    wait(200)
    assert view.tracked_frame == "rover"
    orbit.subProp("Focal Point").subProp("X").setValue(9.0)
    wait(lambda: view.tracked_frame == "")
    view.settings.tracking_gain = 3.0


def test_a_frame_that_is_lost_is_told_once(
    app: Any, robot: Robot, view: Any, wait: Callable[..., None]
) -> None:
    told: list[str] = []
    view.problem_changed.connect(told.append)
    robot.tf("lost_rover", 1.0, 2.0, 0.0)
    wait(lambda: robot.call("set_tracked_frame", "TrackFrame", frame="lost_rover") == "done")
    app.window.manager.setFixedFrame("elsewhere")
    wait(lambda: view.problem != "")
    wait(300)
    assert len(told) == 1
    assert "elsewhere" in view.problem
    # It can be moved all the same.
    view.move_eye((7, 7, 7), animate=False)
    app.window.manager.setFixedFrame("map")
    wait(lambda: view.problem == "")
    assert view.tracked_frame == "lost_rover"


def test_topics_and_services_can_be_withdrawn(
    app: Any, robot: Robot, view: Any, wait: Callable[..., None]
) -> None:
    service = robot.namespace + "move_eye"
    names = app.session.node.services
    wait(lambda: service in str(names()))
    view.settings.services = False
    wait(lambda: service not in str(names()))
    view.settings.services = True
    wait(lambda: service in str(names()))


def test_the_files_for_robots_are_complete() -> None:
    import rosglass.interfaces

    package = Path(rosglass.interfaces.__file__).parent / "definitions/ros1/hector_rviz_plugins"
    build = (package / "CMakeLists.txt").read_text()
    for kind in ("msg", "srv"):
        for file in (package / kind).iterdir():
            assert file.name in build
