"""The display RobotModel."""

from __future__ import annotations

import itertools
import math
import struct
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.scene.render.mesh_shapes import BOX, CYLINDER, SPHERE

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import SceneBench

URDF = """<robot name="rover">
  <material name="blue"><color rgba="0 0 1 1"/></material>
  <link name="base_link">
    <visual><geometry><box size="2 1 0.5"/></geometry><material name="blue"/></visual>
    <collision><geometry><sphere radius="1"/></geometry></collision>
  </link>
  <link name="mast">
    <visual><origin xyz="0 0 1"/><geometry><cylinder radius="0.2" length="2"/></geometry></visual>
  </link>
  <joint name="j" type="fixed"><parent link="base_link"/><child link="mast"/></joint>
</robot>"""


def publish(bench: SceneBench, text: str) -> Any:
    return bench.latch("/robot_description", "std_msgs/String", {"data": text})


def test_a_description_may_come_from_a_publisher_that_does_not_keep_it(bench: SceneBench) -> None:
    display = bench.show("RobotModelDisplay {}")
    publisher = bench.robot.create_publisher("/robot_description", "std_msgs/String")
    bench.wait(lambda: publisher.publish({"data": URDF}) or display.robotName)


def shapes(display: Any) -> set[Any]:
    return {one.shape for one, _, _ in display.root.drawables()}


def test_a_robot_is_shown_where_tf_has_its_links(bench: SceneBench) -> None:
    view = bench.load("RobotModelDisplay {}")
    (robot,) = view.scene.displays
    publish(bench, URDF)
    bench.wait(lambda: robot.links == ["base_link", "mast"])
    assert robot.robotName == "rover"
    bench.wait(lambda: "Link mast: no transform" in robot.statusText)
    assert shapes(robot) == set()
    bench.place("base_link", "mast")
    bench.wait(lambda: shapes(robot) == {BOX, CYLINDER})
    assert robot.statusLevel == "ok", robot.statusText
    assert "URDF: URDF parsed OK" in robot.statusText
    blue = (bench.picture().astype(int) - (0, 0, 255)).clip(0).max(axis=2) < 30
    assert blue.sum() > 300
    robot.collisionEnabled = True
    assert shapes(robot) == {BOX, CYLINDER, SPHERE}
    robot.visualEnabled = False
    assert shapes(robot) == {SPHERE}
    robot.visualEnabled, robot.collisionEnabled = True, False
    robot.setLinkEnabled("mast", False)
    assert shapes(robot) == {BOX}
    middle = view.camera().project((0, 0, 0.25))
    hit = view.pick(middle.x, middle.y)
    (position, _), *_, (_, name) = hit.drawable.owner.describe()
    assert (position, name) == ("Position", "rover")


def test_a_prefix_names_the_frames(bench: SceneBench) -> None:
    robot = bench.show('RobotModelDisplay { tfPrefix: "/r1/" }')
    publish(bench, URDF)
    bench.place("r1/base_link", "r1/mast")
    bench.wait(lambda: shapes(robot) == {BOX, CYLINDER})


def test_a_new_description_replaces_the_old_one(bench: SceneBench) -> None:
    robot = bench.show("RobotModelDisplay {}")
    publisher = publish(bench, URDF)
    bench.wait(lambda: robot.robotName == "rover")
    publisher.publish({"data": '<robot name="other"><link name="only"/></robot>'})
    bench.wait(lambda: robot.robotName == "other")
    assert robot.links == ["only"]


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "the robot description is empty"),
        ("<robot", "robot_description:1"),
        ('<robot name="a"><link name="l"/><link name="l"/></robot>', "robot_description"),
    ],
)
def test_a_broken_description_is_an_error_in_words(
    bench: SceneBench, text: str, error: str
) -> None:
    robot = bench.show("RobotModelDisplay {}")
    publish(bench, text)
    bench.wait(lambda: robot.statusLevel == "error")
    assert error in robot.statusText


def test_meshes_come_from_files_and_missing_ones_are_named(
    bench: SceneBench,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    from rosglass.scene.displays import display

    monkeypatch.setattr(display, "_LOGGED_MS", 50)
    corners = ((0, 0, 0), (2, 0, 0), (0, 2, 0))
    triangle = struct.pack("<12fH", 0, 0, 1, *(n for corner in corners for n in corner), 0)
    (tmp_path / "part.stl").write_bytes(bytes(80) + struct.pack("<I", 1) + triangle)
    urdf = tmp_path / "robot.urdf"
    urdf.write_text(
        f"""<robot name="meshes"><link name="base_link">
        <visual><geometry><mesh filename="file://{tmp_path}/part.stl"/></geometry>
          <material name="m"><color rgba="0 1 0 1"/></material></visual>
        <visual><geometry><mesh filename="package://nowhere/gone.stl"/></geometry></visual>
        </link></robot>"""
    )
    bench.place("base_link")
    view = bench.load(
        f'RobotModelDisplay {{ descriptionSource: "File"; descriptionFile: "{urdf}" }}'
    )
    (robot,) = view.scene.displays
    bench.wait(lambda: len(list(robot.root.drawables())) == 1)
    ((mesh, _, _),) = robot.root.drawables()
    assert mesh.color == (0, 1, 0, 1)
    assert mesh.shape.rows["position"].tolist() == [list(map(float, c)) for c in corners]
    assert robot.statusLevel == "error"
    assert "package://nowhere/gone.stl" in robot.statusText
    # It is logged for interfaces that show no status, once, with the line that declares it.
    start = "display 'RobotModel': Mesh gone.stl: package://nowhere/gone.stl: there is no package"

    def logged() -> list[str]:
        return [one.getMessage() for one in caplog.records if start in one.getMessage()]

    bench.wait(logged)
    for number in range(5):
        robot.set_status(f"Part {number}", "error", "wrong as well")
    bench.wait(lambda: "display 'RobotModel': 2 more errors, see its statusText" in caplog.text)
    assert "display 'RobotModel': Part 0: wrong as well" in caplog.text
    assert "Part 3" not in caplog.text
    assert len(logged()) == 1
    # A fixed frame that does not exist is one error, not one of each display.
    monkeypatch.setattr(display, "_LOGGED_MS", 10_000)
    view.fixedFrame = "nowhere"
    bench.wait(lambda: "the fixed frame [nowhere] does not exist" in caplog.text)
    bench.wait(lambda: "Link base_link" in robot.status_lines)
    robot._log_errors()
    assert "Link base_link" not in caplog.text
    view.fixedFrame = "map"
    green = (bench.picture().astype(int) - (0, 255, 0)).clip(0).max(axis=2) < 30
    assert green.sum() > 100


STL = bytes(80) + struct.pack("<I12fH", 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0)
OBJ = b"""mtllib paint.mtl
v 0 0 0\nv 2 0 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl wood\nf 1/1 2/2 3/3
"""
MTL = b"newmtl wood\nKd 1 1 1\nmap_Kd textures/wood.png\n"


def with_meshes(*uris: str) -> str:
    visuals = "".join(
        f'<visual><geometry><mesh filename="{uri}"/></geometry></visual>' for uri in uris
    )
    return f'<robot name="far"><link name="base_link">{visuals}</link></robot>'


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)


def picture(width: int, height: int, color: int) -> bytes:
    """Return a PNG of one colour."""
    from PySide6.QtCore import QBuffer, QByteArray, QIODevice
    from PySide6.QtGui import QImage

    image, file = QImage(width, height, QImage.Format.Format_RGB32), QByteArray()
    image.fill(color)
    buffer = QBuffer(file)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    assert image.save(buffer, "PNG")
    return bytes(file.data())


def test_textures_beyond_the_limit_are_scaled_down(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The last of ANYmal's 17 textures of 2048 x 2048 pixels was lost."""
    from rosglass.scene.displays import robot_model
    from rosglass.scene.render.drawing import Mesh

    monkeypatch.setattr(robot_model, "MAX_PIXELS", 16 * 64 * 64)
    files = robot_model.MeshFiles(None)  # type: ignore[arg-type] - it reads no file
    meshes = [Mesh(BOX) for _ in range(19)]
    for number, mesh in enumerate(meshes[:17]):
        files.paint(mesh, picture(64, 64, 0x804000 + number), "anymal.dae")
    files.paint(meshes[17], picture(1, 63, 0x804000), "anymal.dae")
    files.paint(meshes[18], picture(64, 64, 0x804000), "anymal.dae")  # a second use of the first
    sizes = [mesh.texture.shape[:2] for mesh in meshes if mesh.texture is not None]
    assert len(sizes) == 19
    assert sorted(sizes[:17]) == [(32, 32)] * 2 + [(64, 64)] * 15
    assert sizes[17] == (63, 1)
    assert meshes[18].texture is meshes[0].texture
    for number, mesh in enumerate(meshes[:17]):
        assert mesh.texture is not None
        assert (mesh.texture == (0x80, 0x40, number, 255)).all()
    assert caplog.text.count("the largest are shown with half of their resolution") == 1
    # Ever smaller, if it has to be.
    meshes += (further := [Mesh(BOX) for _ in range(100)])
    for number, mesh in enumerate(further):
        files.paint(mesh, picture(63, 1000, number), "anymal.dae")
    textures = {id(mesh.texture): mesh.texture for mesh in meshes if mesh.texture is not None}
    assert sum(math.prod(texture.shape[:2]) for texture in textures.values()) <= 16 * 64 * 64


@pytest.mark.usefixtures("cache")
def test_meshes_and_what_they_name_come_from_the_robot(bench: SceneBench) -> None:
    files = {"arm.obj": OBJ, "paint.mtl": MTL, "textures/wood.png": picture(4, 4, 0x00FF00)}

    def answer(request: Any) -> dict[str, Any]:
        found = files.get(request.path.removeprefix("package://far/meshes/"))
        if found is None:
            return {"status_code": 0, "error_reason": f"no file {request.path}"}
        return {"status_code": 1, "body": np.frombuffer(found, np.uint8)}

    kind = "rviz_resource_interfaces/srv/GetResource"
    server = bench.robot.create_service_server("/rviz/get_resource", kind, answer)
    view = bench.load("RobotModelDisplay {}")
    (robot,) = view.scene.displays
    publish(bench, with_meshes("package://far/meshes/arm.obj", "package://far/meshes/gone.stl"))
    bench.place("base_link")
    bench.wait(lambda: len(list(robot.root.drawables())) == 1)
    ((mesh, _, _),) = robot.root.drawables()
    assert mesh.texture is not None
    assert mesh.texture[0, 0].tolist() == [0, 255, 0, 255]
    green = (bench.picture().astype(int) - (0, 255, 0)).clip(0).max(axis=2) < 30
    assert green.sum() > 100
    line = robot.status_lines["Mesh gone.stl"]
    assert line.level == "error"
    assert "there is no package 'far' in ROS_PACKAGE_PATH" in line.text
    assert "nor does the robot serve it: the service /rviz/get_resource does not have it" in (
        line.text
    )
    # It is there now: Reset asks again.
    files["gone.stl"] = STL
    view.reset()
    bench.wait(lambda: len(list(robot.root.drawables())) == 2)
    assert robot.statusLevel == "ok", robot.statusText
    server.close()


@pytest.mark.usefixtures("cache")
def test_meshes_come_from_web_servers(bench: SceneBench) -> None:
    from web_server import WebServer

    with WebServer() as web:
        web.files["/arm.stl"] = STL
        robot = bench.show("RobotModelDisplay {}")
        publish(bench, with_meshes(*[f"{web.url}/arm.stl"] * 3, f"{web.url}/gone.stl?token=1"))
        bench.place("base_link")
        bench.wait(lambda: len(list(robot.root.drawables())) == 3)
        assert sorted(path for path, _ in web.requests) == ["/arm.stl", "/gone.stl?token=1"]
        (line,) = (one for name, one in robot.status_lines.items() if name.startswith("Mesh"))
        assert f"{web.url}/gone.stl?token=1: the server answers 404 Not Found" in line.text


@pytest.mark.usefixtures("cache")
def test_a_web_server_that_was_down_is_asked_again(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from web_server import WebServer

    monkeypatch.setattr("rosglass.scene.displays.scene_frames._ASK_AGAIN_S", 0.1)
    with WebServer() as web:
        web.files["/arm.stl"] = web.files["/hand.stl"] = lambda request: request.send_error(503)
        view = bench.load("RobotModelDisplay {}")
        view.scene.ask_again_s = 0.1
        (robot,) = view.scene.displays
        publish(bench, with_meshes(f"{web.url}/arm.stl", f"{web.url}/hand.stl"))
        bench.place("base_link")
        bench.wait(lambda: len(web.requests) >= 4)
        line = robot.status_lines["Mesh arm.stl"]
        assert line.level == "error"
        assert line.text == (
            f"{web.url}/arm.stl: the server answers 503 Service Unavailable; it is retried "
            "later, or at once by Reset"
        )
        # Less and less often, and for one file only.
        assert view.scene.ask_again_s >= 0.4
        assert [path for path, _ in web.requests].count("/hand.stl") == 1
        web.files["/arm.stl"] = web.files["/hand.stl"] = STL
        bench.wait(lambda: len(list(robot.root.drawables())) == 2)
        bench.wait(lambda: robot.statusLevel == "ok", lambda: robot.statusText)
        assert view.scene.ask_again_s == 0.1
        # One that is hidden is loaded once it is shown.
        web.files["/foot.stl"] = lambda request: request.send_error(503)
        publish(bench, with_meshes(f"{web.url}/foot.stl"))
        bench.wait(lambda: "Mesh foot.stl" in robot.status_lines)
        robot.enabled = False
        web.files["/foot.stl"] = STL
        bench.wait(lambda: robot.statusText == "")
        robot.enabled = True
        bench.wait(lambda: len(list(robot.root.drawables())) == 1)


@pytest.mark.usefixtures("cache")
def test_missing_meshes_of_the_same_name_are_all_in_the_status(bench: SceneBench) -> None:
    robot = bench.show("RobotModelDisplay {}")
    publish(bench, with_meshes("file:///left/hand.stl", "file:///right/hand.stl"))
    bench.wait(lambda: "/right/hand.stl: there is no such file" in robot.statusText)
    assert "/left/hand.stl: there is no such file" in robot.statusText
    publish(bench, with_meshes(*(f"file:///{number}.stl" for number in range(30))))
    bench.wait(lambda: "Meshes: 30 meshes and textures could not be loaded" in robot.statusText)
    assert sum(line.startswith("Mesh ") for line in robot.status_lines) == 10


def test_settings_are_written_for_either_rviz(bench: SceneBench) -> None:
    view = bench.load()
    robot = view.scene.add("RobotModel", alpha=0.5)
    assert robot.save_settings({"Class": "rviz/RobotModel"}, 1)["Robot Description"] == (
        "robot_description"
    )
    saved = robot.save_settings({"Class": "rviz_default_plugins/RobotModel"}, 2)
    assert saved["Description Source"] == "Topic"
    assert saved["Description Topic"]["Value"] == "/robot_description"
    assert saved["Alpha"] == 0.5
    other = view.scene.add("RobotModel")
    links = {"arm": {"Value": False}, "Link Tree Style": ""}
    assert other.load_settings({**saved, "Links": links, "Description Source": "Topic"}) == []
    assert (other.alpha, other.parts.is_enabled("arm")) == (0.5, False)
    assert other.save_settings(saved, 2)["Links"]["arm"] == {"Value": False}
    # A file of RViz 1 shows robots with ROS 2 as well, whose description is on a topic.
    old = {"Class": "rviz/RobotModel", "Robot Description": "arm_description"}
    assert other.load_settings(old) == []
    assert (other.descriptionSource, other.robotDescription) == ("Automatic", "arm_description")
    assert other.save_settings(old, 1)["Robot Description"] == "arm_description"


def test_links_have_settings_of_their_own(bench: SceneBench) -> None:
    from rosglass import Time
    from rosglass.scene.render.drawing import Lines

    view = bench.load("RobotModelDisplay {}")
    (robot,) = view.scene.displays
    tip = '<joint name="k" type="fixed"><parent link="mast"/><child link="tip"/></joint>'
    publish(bench, URDF.replace("</robot>", f'<link name="tip"/>{tip}</robot>'))
    bench.wait(lambda: robot.links == ["base_link", "mast", "tip"])

    def move(x: int) -> None:
        for link in robot.links:
            bench.move(link, (x, 0, 0), Time(1 + x))

    def opacities() -> dict[Any, float]:
        return {
            one.shape: alpha for one, _, alpha in robot.root.drawables() if hasattr(one, "shape")
        }

    def trail() -> Any:
        return next((one for one, _, _ in robot.root.drawables() if isinstance(one, Lines)), None)

    move(0)
    bench.wait(lambda: shapes(robot) == {BOX, CYLINDER})
    assert [robot.parts.can_switch(name) for name in robot.links] == [True, True, False]
    robot.parts.set("base_link", "Alpha", 0.25)
    robot.alpha = 0.5
    assert opacities() == {BOX: 0.125, CYLINDER: 0.5}
    robot.allLinksEnabled = False
    assert shapes(robot) == set()
    robot.parts.set("tip", "Show Axes", True)
    assert shapes(robot) == {CYLINDER}
    robot.parts.set("tip", "Show Axes", False)
    robot.parts.set_enabled("mast", True)
    assert shapes(robot) == {CYLINDER}
    robot.parts.set("mast", "Show Trail", True)
    bench.wait(trail)
    move(1)
    bench.wait(lambda: trail().bounds()[1].tolist() == [1, 0, 0])
    assert trail().bounds()[0].tolist() == [0, 0, 0]
    saved = robot.save_settings({"Links": {"base_link": {"Alpha": 1, "Show Axes": False}}})
    assert saved["Links"] == {
        "All Links Enabled": False,
        "base_link": {"Alpha": 0.25, "Show Axes": False},
        "mast": {"Show Trail": True, "Value": True},
        "tip": {"Show Axes": False},
    }
    other = view.scene.add("RobotModel")
    assert other.load_settings(saved) == []
    assert other.parts.get("base_link", "Alpha") == 0.25
    assert [other.parts.is_enabled(name) for name in robot.links] == [False, True, False]
    assert other.load_settings({"Links": {"mast": {"Alpha": "much"}}}) == [
        "Links/mast/Alpha: expected a finite number, got 'much'"
    ]
    view.scene.fixed_frame = "base_link"
    bench.wait(lambda: trail() is None or not trail().bounds()[1].any())


def test_a_robot_whose_transforms_stop_fades(bench: SceneBench, monkeypatch: Any) -> None:
    from rosglass.scene.displays import display

    monkeypatch.setattr(display, "_FRAME_TIMEOUT_S", 0.5)
    robot = bench.show("RobotModelDisplay {}")
    publish(bench, URDF)
    bench.place("mast")
    sent = itertools.count(1)

    def move() -> bool:
        bench.move("base_link", (0, 0, 0), next(sent))
        return shapes(robot) == {BOX, CYLINDER}

    bench.wait(move)
    assert robot.root.alpha == 1.0
    bench.wait(lambda: robot.root.alpha < 1.0)
    assert "[base_link] may be somewhere else: no transform received for" in robot.statusText
    bench.wait(lambda: move() and robot.root.alpha == 1.0)
    assert robot.statusLevel == "ok", robot.statusText


def test_a_robot_fades_when_one_of_its_joints_is_not_updated(
    bench: SceneBench, monkeypatch: Any
) -> None:
    from rosglass.scene.displays import display

    monkeypatch.setattr(display, "_FRAME_TIMEOUT_S", 0.5)
    robot = bench.show("RobotModelDisplay {}")
    publish(bench, URDF)

    def move(*links: tuple[str, str]) -> None:
        stamp = bench.robot.now()
        for parent, child in links:
            bench.move(child, (0, 0, 0), stamp, parent=parent)

    base, mast = ("map", "base_link"), ("base_link", "mast")
    bench.wait(lambda: move(base, mast) or shapes(robot) == {BOX, CYLINDER})
    assert robot.root.alpha == 1.0
    # The odometry goes on without the node that publishes the joints.
    bench.wait(lambda: move(base) or robot.root.alpha < 1.0)
    assert "[mast] may be somewhere else: no transform received for" in robot.statusText
    # One that is hidden is of no account.
    robot.setLinkEnabled("mast", False)
    bench.wait(lambda: move(base) or robot.root.alpha == 1.0)
    robot.setLinkEnabled("mast", True)
    bench.wait(lambda: move(base) or robot.root.alpha < 1.0)
    bench.wait(lambda: move(base, mast) or robot.root.alpha == 1.0)
    assert robot.statusLevel == "ok", robot.statusText


def test_the_status_is_the_same_after_it_was_disabled(bench: SceneBench) -> None:
    robot = bench.show("RobotModelDisplay {}")
    publish(bench, URDF.replace('<sphere radius="1"/>', '<mesh filename="file:///gone.stl"/>'))
    bench.place("base_link", "mast")
    bench.wait(lambda: "Mesh gone.stl" in robot.statusText and "Link" not in robot.statusText)
    before = robot.statusText
    assert "URDF parsed OK" in before
    robot.enabled = False
    assert robot.statusText == ""
    bench.wait.nothing_happens(0.2)
    robot.enabled = True
    bench.wait(lambda: robot.statusText == before)
    bench.wait.nothing_happens(0.3)
    assert robot.statusText == before


def arms(files: list[str]) -> str:
    """Return a robot with a link for each mesh file."""
    links = "".join(
        f'<link name="arm{at}"><visual><geometry><mesh filename="{file}"/></geometry></visual>'
        f"</link>"
        f'<joint name="j{at}" type="fixed"><parent link="base"/><child link="arm{at}"/></joint>'
        for at, file in enumerate(files)
    )
    return f'<robot name="r"><link name="base"/>{links}</robot>'


def triangles(folder: Path, name: str, count: int) -> str:
    corners = [0.0] * 3 + [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    facet = struct.pack("<12fH", *corners, 0)
    (folder / name).write_bytes(b"\0" * 80 + struct.pack("<I", count) + facet * count)
    return f"file://{folder / name}"


def test_links_share_the_mesh_that_they_name(
    bench: SceneBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import robot_model

    read: list[str] = []
    load = robot_model.load_mesh_cached

    def count(path: Any, name: str, *rest: Any) -> Any:
        read.append(name)
        return load(path, name, *rest)

    monkeypatch.setattr(robot_model, "load_mesh_cached", count)
    robot = bench.show("RobotModelDisplay {}")
    bench.place("base", *(f"arm{at}" for at in range(30)))
    publish(bench, arms([triangles(tmp_path, "arm.stl", 2)] * 30))
    bench.wait(lambda: len(list(robot.root.drawables())) == 30)
    assert len(shapes(robot)) == 1
    assert len(read) == 1


def test_screenshots_wait_for_meshes_that_are_being_read(
    bench: SceneBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.cli.run import Screenshot
    from rosglass.qml.elements.image_sinks import is_loading
    from rosglass.scene.displays import robot_model

    may_read, load = threading.Event(), robot_model.load_mesh_cached

    def wait_at_the_third(path: Any, name: str, *rest: Any) -> Any:
        if "third" in name:
            assert may_read.wait(30)
        return load(path, name, *rest)

    monkeypatch.setattr(robot_model, "load_mesh_cached", wait_at_the_third)
    monkeypatch.setattr(robot_model, "_PROGRESS_S", -1.0)
    robot = bench.show("RobotModelDisplay {}")
    assert not is_loading(bench.window)
    meshes = [triangles(tmp_path, f"{name}.stl", 2) for name in ("first", "second", "third")]
    bench.place("base", "arm0", "arm1", "arm2", "arm3")
    publish(bench, arms([*meshes, meshes[0]]))
    text = "URDF: loading 2 of 3 meshes"
    bench.wait(lambda: text in robot.statusText, lambda: robot.statusText)
    saved: list[int] = []
    ended: list[int] = []

    def save(_: Path) -> None:
        saved.append(len(list(robot.root.drawables())))

    Screenshot(tmp_path / "robot.png", 0.0).take(
        ended.append, save, lambda: is_loading(bench.window)
    )
    bench.wait.settled(bench.session)
    assert not saved
    may_read.set()
    bench.wait(lambda: ended == [0])
    assert saved == [4]
    assert "URDF: URDF parsed OK" in robot.statusText


def test_all_meshes_of_a_robot_are_bounded(
    bench: SceneBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.scene.displays.robot_model.MAX_TRIANGLES", 5)
    robot = bench.show("RobotModelDisplay {}")
    small, large = triangles(tmp_path, "small.stl", 2), triangles(tmp_path, "large.stl", 4)
    publish(bench, arms([small, large, small]))
    bench.wait(lambda: "Mesh large.stl: " in robot.statusText, lambda: robot.statusText)
    text = "large.stl: with its 4 triangles, all meshes have more than 5; reduce them"
    assert text in robot.statusText
    bench.place("base", "arm0", "arm1", "arm2")
    bench.wait(lambda: len(list(robot.root.drawables())) == 2)


def test_newest_of_several_descriptions_is_read(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import robot_model

    may_read, read, load = threading.Event(), [], robot_model._load

    def count(text: str, *rest: Any) -> Any:
        read.append(text)
        assert may_read.wait(30)
        return load(text, *rest)

    monkeypatch.setattr(robot_model, "_load", count)
    robot = bench.show("RobotModelDisplay {}")
    texts = [URDF.replace("rover", f"rover{number}") for number in range(6)]
    publisher = publish(bench, texts[0])
    bench.wait(lambda: read == texts[:1])
    for text in texts[1:]:
        publisher.publish({"data": text})
    bench.wait(lambda: robot._text == texts[-1])
    may_read.set()
    bench.wait(lambda: robot.robotName == "rover5", lambda: robot.statusText)
    assert read == [texts[0], texts[-1]]


def test_a_link_that_does_not_exist_is_an_error_with_its_line(
    bench: SceneBench, caplog: pytest.LogCaptureFixture
) -> None:
    robot = bench.show(
        'RobotModelDisplay {\nComponent.onCompleted: setLinkEnabled("mats", false)\n}'
    )

    def errors() -> list[str]:
        return [f"{r.lineno}: {r.getMessage()}" for r in caplog.records if r.levelno >= 40]

    publish(bench, URDF)
    bench.wait(errors)
    end = "Links of display 'RobotModel': there is no 'mats'; there are: base_link, mast"
    assert errors() == [f"6: {end}"]
    robot.setLinkEnabled("mats", True)
    assert errors()[1].endswith(end)
    robot.setLinkEnabled("mast", False)
    assert len(errors()) == 2
