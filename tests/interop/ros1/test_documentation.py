"""The Python examples of the pages about ROS 1, run as they are printed, on a real master."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from documentation import BLOCK, ROOT, Reader
from waiting import eventually

import rosglass
from rosglass.images import DepthColors, RawImage

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from rosmaster import RosMaster

    from rosglass import Node

PAGES = ("docs/ros1.md", "docs/ros1_parameters.md", "docs/images.md")
BLOCKS = [
    pytest.param(page, number, id=f"{page}:{text.count(chr(10), 0, block.start(1))}")
    for page in PAGES
    for text in [(ROOT / page).read_text(encoding="utf-8")]
    for number, block in enumerate(BLOCK.finditer(text))
]


@pytest.fixture(scope="module")
def robot(master: RosMaster) -> Any:
    """A robot with what the pages name."""
    with rosglass.connect(master.url, "robot") as node:
        odometry = node.create_publisher("/odom", "nav_msgs/Odometry")
        images = node.create_publisher("/camera/image_raw", "sensor_msgs/Image")
        image = {"height": 2, "width": 2, "encoding": "rgb8", "step": 6, "data": bytes(12)}
        node.create_timer(0.05, lambda: (odometry.publish(), images.publish(image)))
        node.create_service_server(
            "/add_two_ints", "rospy_tutorials/AddTwoInts", lambda r: {"sum": r.a + r.b}
        )
        node.create_service_server("/arm/home", "std_srvs/Trigger", lambda r: {"success": True})

        def move(goal: Any) -> dict[str, Any]:
            goal.publish_feedback()
            goal.succeed(text="Goal reached.")
            return {}

        node.create_action_server("/move_base", "move_base_msgs/MoveBaseAction", move)
        node.parameter_server.set("/arm", {"speed": 1.5})
        yield node


@pytest.fixture
def given(
    robot: Node, connect: Callable[..., Node], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> dict[str, Any]:
    """Return the names that a block may use: a connected node, and files in the current folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.yaml").write_text("speed: 1.5\n", encoding="utf-8")
    connected = rosglass.connect

    def to_master(url: str, *arguments: Any, **options: Any) -> Node:
        assert url.startswith(("ros1://", "zenoh://"))
        return connected(robot.url, *arguments, **options)

    monkeypatch.setattr(rosglass, "connect", to_master)
    node = to_master("ros1://robot", "reader")
    eventually(lambda: node.status().state.value == "connected", node.status)
    return {
        "DepthColors": DepthColors,
        "__name__": "reader",
        "node": node,
        # What an ImageStream gives to the function of the block before.
        "picture": RawImage(2, 1, "16UC1", 4, b"\0\1\0\2"),
        "rosglass": rosglass,
        "server": getattr(node, "parameter_server", None),
    }


@pytest.mark.parametrize(("page", "number"), BLOCKS)
def test_examples_run_as_printed(
    page: str, number: int, given: dict[str, Any], caplog: pytest.LogCaptureFixture
) -> None:
    node = given["node"]
    assert Reader(page, given, number).read() > 0
    node.close()
    if "taken" in given:
        assert given["taken"].is_set()
    assert [record for record in caplog.records if record.exc_info] == []
