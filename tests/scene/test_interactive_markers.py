"""The display InteractiveMarkers: dragged by real events of the mouse, and what servers receive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import endpoint_of
from rospy_markers import INSTALLED, RospyServer
from scene_mouse import Hand, has_color

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from rosmaster import RosMaster

    from conftest import SceneBench

UPDATE = "visualization_msgs/InteractiveMarkerUpdate"
FEEDBACK = "visualization_msgs/InteractiveMarkerFeedback"
KEEP_ALIVE, POSE_UPDATE, MENU_SELECT, BUTTON_CLICK, MOUSE_DOWN, MOUSE_UP = range(6)
NONE, MENU, BUTTON, MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE = range(7)
MOVE_3D, ROTATE_3D, MOVE_ROTATE_3D = range(7, 10)
FIXED, VIEW_FACING = 1, 2
#: The orientation whose x axis is the z axis.
UPWARDS = {"x": 0.0, "y": -0.7071068, "z": 0.0, "w": 0.7071068}
BOX = {
    "type": 1,
    "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
    "color": {"r": 0.0, "g": 0.0, "b": 1.0, "a": 1.0},
    "pose": {"orientation": {"w": 1.0}},
}


def control(mode: int, name: str = "", boxes: bool = False, **fields: Any) -> dict[str, Any]:
    made = {"name": name or f"mode{mode}", "interaction_mode": mode, "orientation": {"w": 1.0}}
    return {**made, "markers": [BOX] if boxes else [], **fields}


def marker(*controls: dict[str, Any], name: str = "arm", **fields: Any) -> dict[str, Any]:
    made = {
        "name": name,
        "header": {"frame_id": "map"},
        "pose": {"orientation": {"w": 1.0}},
        "scale": 2.0,
        "controls": list(controls),
    }
    return {**made, **fields}


class MarkerServer:
    """An interactive marker server of ROS 2, made of a node."""

    def __init__(self, node: Any, namespace: str = "/server") -> None:
        self.markers: dict[str, dict[str, Any]] = {}
        self.number = self.requests = 0
        #: Whether what clients drag is moved, as servers of the field do.
        self.follows = True
        self.feedback: list[Any] = []
        self._update = node.create_publisher(f"{namespace}/update", UPDATE, qos=100)
        self._service = node.create_service_server(
            f"{namespace}/get_interactive_markers",
            "visualization_msgs/GetInteractiveMarkers",
            self._answer,
        )
        self._feedback = node.create_subscription(
            f"{namespace}/feedback", FEEDBACK, self._take, qos=100
        )

    def _answer(self, _request: Any) -> dict[str, Any]:
        self.requests += 1
        return {"sequence_number": self.number, "markers": list(self.markers.values())}

    def _take(self, feedback: Any) -> None:
        self.feedback.append(feedback)
        if feedback.event_type == POSE_UPDATE and self.follows:
            self.move(feedback.marker_name, feedback.pose)

    def insert(self, *markers: dict[str, Any]) -> None:
        self.markers.update({one["name"]: one for one in markers})
        self.send(markers=list(markers))

    def move(self, name: str, pose: Any) -> None:
        self.markers[name] = {**self.markers[name], "pose": pose}
        moved = {"name": name, "header": self.markers[name]["header"], "pose": pose}
        self.send(poses=[moved])

    def erase(self, name: str) -> None:
        del self.markers[name]
        self.send(erases=[name])

    def send(self, **update: Any) -> None:
        self.number += 1
        self._update.publish({"type": 1, "seq_num": self.number, **update})

    def events(self, kind: int) -> list[Any]:
        return [one for one in self.feedback if one.event_type == kind]

    def ignore_feedback(self) -> None:
        self._feedback.close()

    def close(self) -> None:
        self._update.close()
        self._service.close()


@pytest.fixture
def server(bench: SceneBench) -> MarkerServer:
    return MarkerServer(bench.robot)


@pytest.fixture
def show(bench: SceneBench, server: MarkerServer) -> Callable[..., Any]:
    """Shows markers from above, or at an angle, and returns the display."""

    def load(*markers: dict[str, Any], settings: str = "", view: str = "TopDownOrtho") -> Any:
        server.markers.update({one["name"]: one for one in markers})
        made = bench.load(
            f'view: "{view}"\nInteractiveMarkersDisplay {{ topic: "/server"; {settings} }}'
        )
        if view == "TopDownOrtho":
            made.controller.set("Scale", 40.0)
            made.camera_moved()
        (display,) = made.scene.displays
        bench.wait(lambda: len(display.markers) == len(markers), lambda: display.statusText)
        bench.picture()
        return display

    return load


def shown(display: Any, name: str = "arm") -> Any:
    return next(one for one in display.all_markers() if one.record.name == name)


def place(display: Any, name: str = "arm") -> list[float]:
    return [round(float(number), 3) for number in shown(display, name).pose[:3, 3]]


# -- drags ----------------------------------------------------------------------------------------


def test_an_arrow_is_dragged_and_the_server_moves_the_marker(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    start = hand.at((1.5, 0, 0))
    end = hand.at((3.5, 0.7, 0))
    hand.move(start)
    hand.press(start)
    hand.move(hand.at((2.5, 0.5, 0)))
    hand.move(end)
    # Only along the axis.
    assert place(display)[0] == pytest.approx(2.0, abs=0.06)
    assert place(display)[1:] == [0.0, 0.0]
    bench.wait(lambda: server.events(POSE_UPDATE))
    hand.release(end)
    bench.wait(lambda: server.events(MOUSE_UP))
    (down,) = server.events(MOUSE_DOWN)
    assert (down.marker_name, down.control_name) == ("arm", "mode3")
    assert down.client_id.endswith("/view/InteractiveMarkers")
    assert down.mouse_point_valid
    assert down.mouse_point.x == pytest.approx(1.5, abs=0.1)
    last = server.events(POSE_UPDATE)[-1]
    assert last.header.frame_id == "map"
    assert last.pose.position.x == pytest.approx(2.0, abs=0.06)
    assert [one.event_type for one in server.feedback][-2:] == [POSE_UPDATE, MOUSE_UP]
    # Its own pose, sent back, arrives and changes nothing; another one moves it.
    server.move("arm", {"position": {"x": -1.0}, "orientation": {"w": 1.0}})
    bench.wait(lambda: place(display) == [-1.0, 0.0, 0.0])
    bench.picture()
    hand.press(hand.at((0.5, 0, 0)))
    bench.wait(lambda: len(server.events(MOUSE_DOWN)) == 2)
    hand.release(hand.at((0.5, 0, 0)))


def test_beside_markers_the_mouse_moves_the_camera(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    before = bench.view.camera()
    hand.drag((20, 20), (60, 60))
    assert bench.view.camera() != before
    assert place(display) == [0.0, 0.0, 0.0]
    bench.wait.settled(bench.session)
    assert server.feedback == []


def test_a_plane_is_dragged(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_PLANE, orientation=UPWARDS)))
    hand.drag(hand.at((1.15, 0, 0)), hand.at((2.15, 1, 0)))
    assert place(display) == pytest.approx([1.0, 1.0, 0.0], abs=0.06)
    bench.wait(lambda: server.events(MOUSE_UP))


def test_a_ring_is_rotated(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(ROTATE_AXIS, orientation=UPWARDS)))
    hand.drag(hand.at((1.15, 0, 0)), hand.at((0, 2, 0)))
    assert place(display) == [0.0, 0.0, 0.0]
    assert shown(display).pose[:2, 0] == pytest.approx([0.0, 1.0], abs=0.05)
    bench.wait(lambda: server.events(MOUSE_UP))
    turn = server.events(POSE_UPDATE)[-1].pose.orientation
    assert (turn.z, turn.w) == pytest.approx((0.707, 0.707), abs=0.05)


def test_a_ring_that_moves_as_well_follows_the_mouse(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_ROTATE, orientation=UPWARDS)))
    hand.drag(hand.at((1.15, 0, 0)), hand.at((3.15, 0, 0)))
    assert place(display) == pytest.approx([2.0, 0.0, 0.0], abs=0.06)
    bench.wait(lambda: server.events(MOUSE_UP))


@pytest.mark.parametrize("mode", [MOVE_3D, MOVE_ROTATE_3D])
def test_a_box_is_carried_across_the_view_and_towards_it(
    show: Callable[..., Any], hand: Hand, mode: int
) -> None:
    display = show(marker(control(mode, boxes=True, always_visible=True)))
    hand.drag(hand.at((0, 0, 0)), hand.at((1, 1, 0)))
    assert place(display) == pytest.approx([1.0, 1.0, 0.0], abs=0.06)
    hand.drag(hand.at((1, 1, 0)), hand.at((1, 2, 0)), keys=hand.SHIFT)
    assert place(display)[:2] == pytest.approx([1.0, 1.0], abs=0.06)
    assert abs(place(display)[2]) > 0.3


@pytest.mark.parametrize("mode", [ROTATE_3D, MOVE_ROTATE_3D])
def test_a_box_is_tumbled(show: Callable[..., Any], hand: Hand, mode: int) -> None:
    display = show(marker(control(mode, boxes=True)))
    keys = hand.CTRL if mode == MOVE_ROTATE_3D else None
    x, y = hand.at((0, 0, 0))
    hand.drag((x, y), (x + 30, y), keys=keys)
    assert place(display) == pytest.approx([0.0, 0.0, 0.0], abs=0.01)
    turned = shown(display).pose[:3, :3]
    assert np.trace(turned) == pytest.approx(1 + 2 * np.cos(30 * 2 * np.pi / 300), abs=0.05)


@pytest.mark.parametrize("frame", ["map", "tool"])
def test_drags_in_perspective_and_in_frames_that_are_turned(
    bench: SceneBench, show: Callable[..., Any], hand: Hand, frame: str
) -> None:
    tilt = (0.3, -0.5, 0.1, 0.8)
    display = show(
        marker(
            control(MOVE_AXIS),
            control(ROTATE_AXIS, orientation=UPWARDS),
            header={"frame_id": frame},
            pose={"position": {"x": 0.2}, "orientation": {"z": 0.2, "w": 0.98}},
        ),
        view="Orbit",
    )
    bench.move("tool", (1, -1, 0.5), 1, turn=tilt)
    bench.wait(lambda: shown(display).root.visible)
    arm = shown(display)

    def pixel(*point: float) -> tuple[int, int]:
        return hand.at(tuple((arm.root.pose @ start @ (*point, 1.0))[:3]))

    start = arm.pose
    hand.drag(pixel(1.4, 0, 0), pixel(0.4, 0, 0))
    moved = np.linalg.inv(start) @ arm.pose
    assert moved[:3, 3] == pytest.approx([-1.0, 0.0, 0.0], abs=0.1)
    assert moved[:3, :3] == pytest.approx(np.eye(3), abs=1e-6)
    start = arm.pose
    bench.picture()
    hand.drag(pixel(0, 1.15, 0), pixel(1.4, 1.4, 0))
    turned = np.linalg.inv(start) @ arm.pose
    assert turned[:3, 3] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert turned[:2, 0] == pytest.approx([0.707, -0.707], abs=0.1)
    assert turned[2, 2] == pytest.approx(1.0, abs=1e-6)


def test_a_drag_goes_on_when_its_marker_is_changed(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    server.follows = False
    display = show(marker(control(MOVE_AXIS)))
    hand.press(hand.at((1.5, 0, 0)))
    hand.move(hand.at((2.5, 0, 0)))
    changed = marker(control(MOVE_AXIS), description="changed")
    server.insert(changed)
    bench.wait(lambda: shown(display).record.description == "changed")
    server.move("arm", {"position": {"y": 5.0}, "orientation": {"w": 1.0}})
    bench.wait.settled(bench.session)
    hand.move(hand.at((3.5, 0, 0)))
    assert place(display) == pytest.approx([2.0, 0.0, 0.0], abs=0.06)
    # What the server has said counts at the end.
    hand.release(hand.at((3.5, 0, 0)))
    bench.wait(lambda: place(display) == [0.0, 5.0, 0.0])


def test_a_server_that_answers_late_does_not_move_a_marker_back(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    server.follows = False
    display = show(marker(control(MOVE_AXIS)))
    hand.press(hand.at((1.5, 0, 0)))
    hand.move(hand.at((2.5, 0, 0)))
    bench.wait(lambda: server.events(POSE_UPDATE))
    early = server.events(POSE_UPDATE)[0].pose
    hand.move(hand.at((3.5, 0, 0)))
    received = display.received
    server.move("arm", early)
    bench.wait(lambda: display.received > received)
    hand.release(hand.at((3.5, 0, 0)))
    assert place(display)[0] == pytest.approx(2.0, abs=0.06)
    received = display.received
    server.move("arm", early)
    bench.wait(lambda: display.received > received)
    assert place(display)[0] == pytest.approx(2.0, abs=0.06)
    # What it has decided itself counts.
    server.move("arm", {"position": {"x": 0.1}, "orientation": {"w": 1.0}})
    bench.wait(lambda: place(display)[0] == 0.1)


def test_a_drag_ends_when_its_marker_is_erased(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    hand.press(hand.at((1.5, 0, 0)))
    hand.move(hand.at((2.5, 0, 0)))
    server.follows = False
    bench.wait(lambda: server.events(POSE_UPDATE))
    server.erase("arm")
    bench.wait(lambda: not display.markers)
    hand.move(hand.at((3.5, 0, 0)))
    hand.release(hand.at((3.5, 0, 0)))
    bench.wait.settled(bench.session)
    assert server.events(MOUSE_UP) == []
    assert display.statusLevel == "ok"


def test_a_held_marker_is_kept_alive_and_escape_ends_a_drag(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    hand.press(hand.at((1.5, 0, 0)))
    bench.wait(lambda: len(server.events(KEEP_ALIVE)) > 1)
    assert server.events(POSE_UPDATE) == []
    hand.key(hand.keys.Key_Escape)
    bench.wait(lambda: server.events(MOUSE_UP))
    hand.move(hand.at((3.5, 0, 0)))
    hand.release(hand.at((3.5, 0, 0)))
    assert place(display) == [0.0, 0.0, 0.0]


# -- buttons, menus, hovering ---------------------------------------------------------------------


def test_a_button_is_clicked(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    show(marker(control(BUTTON, "go", boxes=True, always_visible=True)))
    middle = hand.at((0, 0, 0))
    hand.click(middle)
    bench.wait(lambda: server.events(MOUSE_UP))
    kinds = [one.event_type for one in server.feedback]
    assert kinds == [MOUSE_DOWN, BUTTON_CLICK, MOUSE_UP]
    assert server.feedback[1].control_name == "go"
    assert server.feedback[1].mouse_point.z == pytest.approx(0.5, abs=0.05)
    # Released beside it, it was not meant.
    hand.press(middle)
    hand.release((5, 5))
    bench.wait(lambda: len(server.events(MOUSE_UP)) == 2)
    assert len(server.events(BUTTON_CLICK)) == 1


def test_click_without_a_server_is_reported(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand, caplog: Any
) -> None:
    display = show(
        marker(control(BUTTON, "stop", boxes=True, always_visible=True), menu_entries=MENU_ENTRIES)
    )
    middle = hand.at((0, 0, 0))
    hand.click(middle)
    bench.wait(lambda: server.events(MOUSE_UP))
    assert "stop" not in bench.view.statusText
    server.ignore_feedback()
    bench.wait(lambda: not endpoint_of(display).feedback.subscription_count())
    hand.click(middle)
    text = "button stop of marker arm: sent on /server/feedback, which no server receives"
    assert bench.view.statusText == text
    assert f"display 'InteractiveMarkers': {text}" in caplog.text
    assert display.statusLevel == "error"
    assert "which no server receives" in display.statusText
    # The markers of a robot that is gone are still shown, as old ones.
    bench.session.shutdown()
    bench.wait(lambda: display.root.alpha < 1.0)
    hand.click(middle)
    text = "button stop of marker arm: not sent: the robot is not connected"
    assert text in bench.view.statusText
    hand.click(middle, hand.RIGHT)
    open_menu(bench)
    display.selectMenuEntry(4)
    assert "menu entry 4 of marker arm: not sent: the robot" in bench.view.statusText
    assert len(server.events(BUTTON_CLICK)) == 1


def test_drag_without_a_server_is_reported(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    hand.press(hand.at((1.5, 0, 0)))
    bench.wait(lambda: server.events(MOUSE_DOWN))
    server.ignore_feedback()
    bench.wait(lambda: not endpoint_of(display).feedback.subscription_count())
    hand.move(hand.at((2.5, 0, 0)))
    hand.release(hand.at((2.5, 0, 0)))
    assert bench.view.statusText == (
        "drag by mode3 of marker arm: sent on /server/feedback, which no server receives"
    )
    # A marker that is gone under the mouse takes nothing.
    hand.press(hand.at((2.5, 0, 0)))
    server.erase("arm")
    bench.wait(lambda: display.markers == [])
    hand.release(hand.at((2.5, 0, 0)))
    assert "control mode3 of arm was removed: its release was not sent" in bench.view.statusText


MENU_ENTRIES = [
    {"id": 1, "title": "Grasp <b>it</b>"},
    {"id": 2, "title": "More"},
    {"id": 3, "parent_id": 2, "title": "[x] Fast"},
    {"id": 4, "parent_id": 2, "title": "[ ] Slow"},
    {"id": 5, "title": "Run", "command": "rm -rf ~", "command_type": 1},
]


def open_menu(bench: SceneBench) -> Any:
    """Return the menu that is open."""

    def find() -> Any:
        from PySide6.QtCore import QObject

        found = bench.view.findChildren(QObject)
        return next((o for o in found if o.property("entries") and o.property("opened")), None)

    return bench.wait(find)


@pytest.mark.parametrize(("mode", "button"), [(MENU, "LEFT"), (BUTTON, "RIGHT")])
def test_an_entry_of_a_menu_is_chosen(
    bench: SceneBench,
    show: Callable[..., Any],
    server: MarkerServer,
    hand: Hand,
    mode: int,
    button: str,
) -> None:
    from PySide6.QtQuick import QQuickItem

    show(marker(control(mode, "box", boxes=True), menu_entries=MENU_ENTRIES))
    hand.click(hand.at((0, 0, 0)), getattr(hand, button))
    menu = open_menu(bench)
    assert menu.property("count") == 3
    items = menu.property("contentItem").findChildren(QQuickItem)
    first = next(one for one in items if one.property("number") == 1)
    assert first.property("text") == "Grasp <b>it</b>"
    at = first.mapToScene(first.boundingRect().center()).toPoint()
    hand.click((at.x(), at.y()))
    bench.wait(lambda: server.events(MENU_SELECT))
    (chosen,) = server.events(MENU_SELECT)
    assert (chosen.menu_entry_id, chosen.control_name) == (1, "box")
    assert chosen.mouse_point_valid


def test_an_own_menu_in_qml_and_programs_of_menus_are_not_run(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    display = show(
        marker(control(BUTTON, boxes=True), menu_entries=MENU_ENTRIES),
        settings="""
            property var asked: null
            onMenuRequested: (entries, x, y) => {
                asked = entries; selectMenuEntry(entries[1].children[1].id)
            }""",
    )
    hand.click(hand.at((0, 0, 0)), hand.RIGHT)
    bench.wait(lambda: server.events(MENU_SELECT))
    assert server.events(MENU_SELECT)[0].menu_entry_id == 4
    asked = display.property("asked")
    assert [one["title"] for one in asked] == ["Grasp <b>it</b>", "More", "Run"]
    assert [one["title"] for one in asked[1]["children"]] == ["\u2611 Fast", "\u2610 Slow"]
    display.selectMenuEntry(5)
    assert "asks to run 'rm -rf ~' on this computer, which is not done" in display.statusText
    bench.wait.settled(bench.session)
    assert len(server.events(MENU_SELECT)) == 1


def test_hovered_marker_is_lighter_and_the_status_bar_describes_it(
    bench: SceneBench, show: Callable[..., Any], hand: Hand
) -> None:
    show(marker(control(BUTTON, boxes=True), menu_entries=MENU_ENTRIES))
    hand.move((5, 5))
    assert has_color(bench.picture(), 0, 0, 255, 10) > 500
    hand.move(hand.at((0, 0, 0)))
    assert has_color(bench.picture(), 77, 77, 255, 10) > 500
    assert bench.view.statusText == ("Left-Click: Activate. Right-Click: Show context menu.")
    hand.press(hand.at((0, 0, 0)))
    assert has_color(bench.picture(), 128, 128, 255, 10) > 500
    hand.release(hand.at((0, 0, 0)))
    hand.move((5, 5))
    assert has_color(bench.picture(), 0, 0, 255, 10) > 500
    assert "Activate" not in bench.view.statusText


def test_a_menu_without_markers_is_a_text_that_is_clicked(
    bench: SceneBench, show: Callable[..., Any], hand: Hand
) -> None:
    words = control(MENU, description="menu of the arm")
    show(marker(words, menu_entries=MENU_ENTRIES), settings="showDescriptions: false")
    # 1.2 times the scale above it, as the viewer sees it.
    hand.click(hand.at((0, 2.4, 0)))
    assert open_menu(bench).property("count") == 3


# -- what is drawn --------------------------------------------------------------------------------


def drawn(display: Any) -> list[Any]:
    return [one for one, _, _ in display.root.drawables()]


def test_settings(bench: SceneBench, show: Callable[..., Any], hand: Hand) -> None:
    from rosglass.scene.render.drawing import Labels

    display = show(marker(control(MOVE_AXIS), description="the arm"))
    (labels,) = [one for one in drawn(display) if isinstance(one, Labels)]
    assert labels.texts == ("the arm",)
    assert not any(one.opaque for one in drawn(display))
    display.showDescriptions = False
    assert labels not in drawn(display)
    display.enableTransparency = False
    assert all(one.opaque for one in drawn(display))
    count = len(drawn(display))
    display.showAxes = True
    assert len(drawn(display)) == count + 1
    display.showVisualAids = True
    hand.press(hand.at((1.5, 0, 0)))
    assert len(drawn(display)) == count + 2
    hand.release(hand.at((1.5, 0, 0)))
    assert len(drawn(display)) == count + 1


def test_other_tools_and_drags_hide_what_is_not_always_visible(
    bench: SceneBench, show: Callable[..., Any], hand: Hand
) -> None:
    display = show(
        marker(control(MOVE_AXIS), control(NONE, boxes=True, always_visible=True)),
        marker(control(MOVE_AXIS), name="leg", pose={"position": {"y": 2.0}}),
    )
    assert len(drawn(display)) == 5
    hand.press(hand.at((1.5, 0, 0)))
    assert len(drawn(display)) == 3
    hand.release(hand.at((1.5, 0, 0)))
    assert len(drawn(display)) == 5
    bench.view.tools.select("Select")
    assert len(drawn(display)) == 1
    bench.view.tools.select("Interact")
    assert len(drawn(display)) == 5


def test_controls_face_the_viewer_or_stay_fixed_or_turn_with_the_marker(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    turned = {"orientation": {"z": 0.7071068, "w": 0.7071068}}
    display = show(
        marker(
            control(MOVE_AXIS, "inherit"),
            control(MOVE_AXIS, "fixed", orientation_mode=FIXED),
            control(MOVE_PLANE, "facing", orientation_mode=VIEW_FACING),
            control(
                MOVE_PLANE,
                "apart",
                orientation_mode=VIEW_FACING,
                independent_marker_orientation=True,
                boxes=True,
            ),
            pose=turned,
        ),
        view="Orbit",
    )
    controls = shown(display).controls

    def axis(name: str) -> list[float]:
        return [round(float(number), 3) for number in controls[name].frame()[:3, 0]]

    assert axis("inherit") == [0.0, 1.0, 0.0]
    assert axis("fixed") == [1.0, 0.0, 0.0]
    for _ in range(2):
        ahead = -bench.view.camera().pose[:3, 2]
        for name in ("facing", "apart"):
            assert axis(name) == pytest.approx(ahead, abs=0.01)
        group = controls["facing"].shapes.root
        assert group.pose[:3, 0] == pytest.approx(ahead, abs=0.01)
        group = controls["apart"].shapes.root
        assert group.pose[:3, 0] == pytest.approx([0, 1, 0], abs=0.01)
        bench.view.controller.set("Yaw", 2.0)
        bench.view.camera_moved()


def test_markers_fade_when_their_frame_is_not_updated(
    bench: SceneBench, show: Callable[..., Any], monkeypatch: Any
) -> None:
    from rosglass.scene.displays import display as displays

    monkeypatch.setattr(displays, "_FRAME_TIMEOUT_S", 0.5)

    def move() -> None:
        bench.move("gripper", (0, 0, 0), bench.robot.now())

    display = show(
        marker(control(MOVE_AXIS), header={"frame_id": "gripper"}),
        marker(control(MOVE_AXIS), name="goal"),
    )
    arm, goal = shown(display), shown(display, "goal")
    bench.wait(lambda: move() or arm.root.visible)
    assert arm.root.alpha == 1.0
    bench.wait(lambda: arm.root.alpha < 1.0)
    assert goal.root.alpha == 1.0
    assert "[gripper] may be somewhere else: no transform received for" in display.statusText
    bench.wait(lambda: move() or arm.root.alpha == 1.0)


def test_markers_of_a_frame_follow_it_and_stamped_ones_stay(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer, hand: Hand
) -> None:
    def move(x: float, sec: int) -> None:
        bench.move("tool", (x, 0, 0), sec)

    display = show(
        marker(control(BUTTON, boxes=True), header={"frame_id": "tool"}),
        marker(
            control(MOVE_AXIS),
            name="leg",
            header={"frame_id": "tool", "stamp": {"sec": 1, "nanosec": 0}},
            pose={"position": {"y": 2.0}},
        ),
    )
    assert "Marker arm: no transform from [tool]" in display.statusText

    def at(name: str) -> float:
        found = shown(display, name).root
        return round(float(found.pose[0, 3]), 2) if found.visible else -1.0

    move(1.0, 1)
    bench.wait(lambda: (at("arm"), at("leg")) == (1.0, 1.0))
    assert display.statusLevel == "ok"
    move(-2.0, 2)
    bench.wait(lambda: (at("arm"), at("leg")) == (-2.0, 1.0))
    bench.picture()
    hand.click(hand.at((-2, 0, 0)))
    bench.wait(lambda: server.events(BUTTON_CLICK))
    (clicked,) = server.events(BUTTON_CLICK)
    assert (clicked.header.frame_id, clicked.header.stamp.sec) == ("tool", 2)
    assert clicked.mouse_point.x == pytest.approx(0.0, abs=0.05)
    # The place of stamped ones is sent in the fixed frame.
    server.follows = False
    hand.drag(hand.at((2.5, 2, 0)), hand.at((3.5, 2, 0)))
    bench.wait(lambda: server.events(POSE_UPDATE))
    moved = server.events(POSE_UPDATE)[-1]
    assert moved.header.frame_id == "map"
    assert (moved.pose.position.x, moved.pose.position.y) == pytest.approx((2.0, 2.0), abs=0.06)


# -- servers --------------------------------------------------------------------------------------


def test_after_a_gap_all_markers_are_requested_again(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    server.insert(marker(control(MOVE_AXIS), name="leg"))
    bench.wait(lambda: display.markers == ["arm", "leg"])
    requests = server.requests
    del server.markers["leg"]
    server.number += 1  # an update that is lost
    server.insert(marker(control(MOVE_AXIS), name="hand"))
    bench.wait(lambda: display.markers == ["arm", "hand"])
    assert server.requests == requests + 1


def test_updates_that_come_before_the_markers_count_in_their_order(bench: SceneBench) -> None:
    from rosglass.scene.displays.interactive_marker_messages import (
        InteractiveMarkerRecord,
        MarkerUpdate,
        read_interactive_marker,
    )

    display = bench.show("InteractiveMarkersDisplay { }")
    kind = bench.robot.create_publisher("/any", "visualization_msgs/InteractiveMarker").type

    def read(name: str) -> InteractiveMarkerRecord:
        return read_interactive_marker(kind(marker(control(MOVE_AXIS), name=name)))

    def take(number: int, *names: str, full: bool = False, erased: tuple[str, ...] = ()) -> None:
        markers = tuple(read(name) for name in names)
        display._on_update(MarkerUpdate("", number, full, False, markers, (), erased))

    take(3, "c")
    take(4, erased=("a",))
    assert display.markers == []
    # A full update from before a missing change is not used.
    take(1, "a", full=True)
    assert display.markers == []
    assert "waiting for its markers" in display.statusText
    take(2, "a", "b", full=True)
    assert display.markers == ["b", "c"]
    take(6, "d")
    assert display.markers == ["b", "c"]
    take(6, "b", "d", full=True)
    assert display.markers == ["b", "d"]


def test_a_server_that_is_gone_is_said_and_a_new_one_is_shown(
    bench: SceneBench, show: Callable[..., Any], server: MarkerServer
) -> None:
    display = show(marker(control(MOVE_AXIS)))
    bench.wait(lambda: not display.stale)
    server.close()
    bench.wait(lambda: "the server is gone" in display.statusText)
    assert display.stale
    assert display.root.alpha < 1
    other = MarkerServer(bench.robot)
    other.markers["new"] = marker(control(MOVE_AXIS), name="new")
    bench.wait(lambda: display.markers == ["new"], lambda: display.statusText)
    bench.wait(lambda: not display.stale)
    assert display.root.alpha == 1


def test_missing_server_is_in_the_status(bench: SceneBench) -> None:
    display = bench.show('InteractiveMarkersDisplay { topic: "/nowhere/update" }')
    bench.wait(lambda: "no server in /nowhere" in display.statusText)
    assert display.statusLevel == "warn"


def test_a_mesh_that_was_missing_is_read_again(
    bench: SceneBench,
    show: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from web_server import WebServer

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("rosglass.scene.displays.scene_frames._ASK_AGAIN_S", 0.1)
    with WebServer() as web:
        uri = f"{web.url}/flat.obj"
        mesh = {**BOX, "type": 10, "mesh_resource": uri}
        display = show(marker(control(BUTTON) | {"markers": [mesh]}))
        bench.wait(lambda: "Mesh" in display.status_lines)
        assert display.status_lines["Mesh"].text == f"{uri}: the server answers 404 Not Found"
        # Reset reads everything that is missing, and a server that is down is asked again.
        web.files["/flat.obj"] = lambda request: request.send_error(503)
        bench.view.scene.ask_again_s = 0.1
        bench.view.reset()
        bench.wait(lambda: "503" in display.statusText)
        assert drawn(display) == []
        web.files["/flat.obj"] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        bench.wait(lambda: drawn(display))
        bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)


def test_markers_that_cannot_be_read_are_requested_again(
    bench: SceneBench, server: MarkerServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = "rosglass.scene.displays.interactive_marker"
    monkeypatch.setattr(f"{folder}._RETRY_MS", 100)
    monkeypatch.setattr(f"{folder}_messages._MAX_MARKERS", 1)
    server.markers = {name: marker(control(BUTTON), name=name) for name in ("arm", "leg")}
    display = bench.show('InteractiveMarkersDisplay { topic: "/server" }')
    bench.wait(lambda: "markers: 2 are more than the 1" in display.statusText)
    bench.wait(lambda: server.requests >= 3)
    del server.markers["leg"]
    bench.wait(lambda: display.markers == ["arm"])
    bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)


def test_invalid_markers_are_named_and_the_others_are_shown(
    bench: SceneBench,
    show: Callable[..., Any],
    server: MarkerServer,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rosglass.scene.displays.marker_meshes._MAX_READING", 0)
    mesh = {**BOX, "type": 10, "mesh_resource": "file:///gone.obj"}
    display = show(
        marker(control(BUTTON) | {"markers": [mesh, BOX]}, name="mesh"),
        marker(control(ROTATE_AXIS), name="last"),
    )
    server.insert(marker(control(ROTATE_AXIS), name="large", scale=1e30))
    bench.wait(lambda: "Marker large" in display.status_lines)
    lines = {name: one.text for name, one in display.status_lines.items()}
    assert lines["Marker large"] == "scale: 1e+30 is beyond the 1e+18 that is drawn"
    assert lines["Marker mesh"] == "more than 0 meshes are being read; send it again later"
    assert len(drawn(display)) == 2


def test_both_rviz_write_the_namespace_differently(bench: SceneBench) -> None:
    display = bench.show("InteractiveMarkersDisplay { }")
    assert display.load_settings({"Update Topic": "/arm/update", "Show Axes": True}) == []
    assert (display.namespace, display.showAxes) == ("/arm", True)
    assert display.save_settings()["Interactive Markers Namespace"] == "/arm"
    assert display.save_settings(ros=1)["Update Topic"] == "/arm/update"
    assert "Topic" not in display.save_settings()


# -- ROS 1 ----------------------------------------------------------------------------------------


@pytest.fixture
def ros1(
    ros1_bench: SceneBench, ros_master: RosMaster
) -> Iterator[tuple[SceneBench, RospyServer, RosMaster]]:
    if not INSTALLED:
        pytest.skip("not installed: sudo apt-get install python3-interactive-markers")
    server = RospyServer(ros_master)
    yield ros1_bench, server, ros_master
    server.kill()


def test_a_server_of_ros_1(ros1: tuple[SceneBench, RospyServer, RosMaster]) -> None:
    bench, server, master = ros1
    view = bench.load(
        'view: "TopDownOrtho"\nInteractiveMarkersDisplay { topic: "/arm_markers/update" }'
    )
    view.controller.set("Scale", 40.0)
    view.camera_moved()
    (display,) = view.scene.displays
    hand = Hand(bench)
    bench.wait(lambda: display.markers == ["arm"], lambda: display.statusText)
    bench.picture()
    # Dragged, the server's callback gets the pose, and its update moves the marker.
    hand.press(hand.at((1.5, 0, 0)))
    hand.move(hand.at((2.5, 0, 0)))
    bench.wait(
        lambda: any(
            line.startswith(("feedback arm 1 1.0", "feedback arm 1 0.9")) for line in server.lines
        ),
        lambda: (server.lines, display.statusText),
    )
    hand.release(hand.at((2.5, 0, 0)))
    bench.wait(lambda: any(line.startswith("feedback arm 5") for line in server.lines))
    server.send("insert leg 2")
    bench.wait(lambda: display.markers == ["arm", "leg"])
    # The server keeps what was dragged.
    assert place(display)[0] == pytest.approx(1.0, abs=0.06)
    server.send("skip -")
    server.send("insert hand 3")
    bench.wait(lambda: display.markers == ["arm", "hand", "leg"], lambda: display.statusText)
    assert place(display)[0] == pytest.approx(1.0, abs=0.06)
    server.send("erase leg")
    bench.wait(lambda: display.markers == ["arm", "hand"])
    bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)
    assert "Server /marker_server: 2 markers" in display.statusText
    # Killed, it cannot say goodbye: its keep-alives are missed.
    server.kill()
    bench.wait(lambda: "no keep-alive" in display.statusText, lambda: display.statusText)
    assert display.stale
    other = RospyServer(master)
    bench.wait(lambda: display.markers == ["arm"], lambda: display.statusText)
    bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)
    assert place(display) == [0.0, 0.0, 0.0]
    # Without the master it stays connected, but the robot may have another one.
    bench.wait(endpoint_of(display).feedback.subscription_count)
    master.kill()
    bench.wait(lambda: bench.session.state != "connected")
    bench.picture()
    hand.drag(hand.at((1.5, 0, 0)), hand.at((2.5, 0, 0)))
    assert (
        "drag by along of marker arm: sent on /arm_markers/feedback, but the robot is not connected"
    ) in view.statusText
    other.kill()
