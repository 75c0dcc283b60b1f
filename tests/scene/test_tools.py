"""Tools of a view: by real events of mouse, touch and keys, and what the robot receives."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import endpoint_of
from nav2_server import Driver
from scene_mouse import Hand, has_color

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rosmaster import RosMaster

    from conftest import SceneBench

pytestmark = pytest.mark.filterwarnings("error")


def listen(bench: SceneBench, topic: str, message_type: str) -> list[Any]:
    received: list[Any] = []
    bench.robot.create_subscription(topic, message_type, received.append)
    return received


def add_box(view: Any, position: Any = (0, 0, 0), owner: Any = "box") -> Any:
    from rosglass.scene.render.drawing import Mesh
    from rosglass.scene.render.matrices import instance_matrix
    from rosglass.scene.render.mesh_shapes import BOX

    box = Mesh(BOX, (1, 0, 0, 1))
    box.owner = owner
    box.pose = instance_matrix(position)
    view.scene.root.add(box)
    return box


# -- the list ------------------------------------------------------------------------------------


def test_a_view_has_the_tools_of_rviz(bench: SceneBench) -> None:
    view = bench.load()
    tools = view.tools
    assert [tool.TYPE for tool in tools] == [
        "Interact", "MoveCamera", "Select", "FocusCamera", "Measure", "SetInitialPose", "SetGoal",
        "PublishPoint",
    ]  # fmt: skip
    assert view.tool == "Interact"
    assert tools.default is tools.current
    assert tools.current.selected
    assert "Rotate" in view.statusText
    for name in ("Measure", "rviz/Measure", "rviz_default_plugins/Measure"):
        assert tools.find(name) is tools.all[4]
    assert tools.find("2D Goal Pose") is tools.all[6]
    assert tools.find_key("G") is tools.all[6]
    tools.select("Measure")
    assert view.tool == "Measure"
    assert not tools.default.selected


def test_unknown_tools_and_settings_are_errors(bench: SceneBench) -> None:
    from rosglass.errors import Error

    tools = bench.load().tools
    count = len(tools)
    with pytest.raises(Error, match="there is no tool 'Mesure' in this view; did you mean Measure"):
        tools.select("Mesure")
    with pytest.raises(Error, match="there is no tool 'rviz/Nothing'"):
        tools.add("rviz/Nothing")
    with pytest.raises(Error, match="has no property 'topik'; did you mean topic"):
        tools.add("SetGoal", topik="/goal")
    with pytest.raises(Error, match="Topic: expected the name of a topic"):
        tools.add("SetGoal", topic="/no topic")
    with pytest.raises(Error, match="a Tool, a class of it or the name of one"):
        tools.add(3)
    assert len(tools) == count


def test_a_panel_shows_and_changes_settings(bench: SceneBench) -> None:
    pose = bench.load().tools.find("SetInitialPose")
    shown = {one["name"]: one for one in pose.settings()}
    assert shown["Topic"]["value"] == ""
    assert shown["Topic"]["placeholder"] == "/initialpose"
    assert shown["X std deviation"]["value"] == "0.5"
    assert shown["X std deviation"]["kind"] == "float"
    assert pose.setSetting("X std deviation", "0.25") == ""
    assert pose.xDeviation == 0.25
    assert "expected a finite number" in pose.setSetting("X std deviation", "wide")
    assert "is not from 0" in pose.setSetting("X std deviation", "-1")
    assert "has no setting 'Y'" in pose.setSetting("Y", "1")
    assert bench.view.tools.find("PublishPoint").setSetting("Single click", "false") == ""
    assert not bench.view.tools.find("PublishPoint").singleClick


def test_the_panel_follows_settings_that_a_program_changes(bench: SceneBench) -> None:
    view = bench.load("ToolsPanel { width: 200; height: 300; view: parent }")
    bench.picture()
    view.tools.find("SetInitialPose").xDeviation = 0.125
    bench.wait(lambda: any(one.property("text") == "0.125" for one in items_of(view)))


def items_of(item: Any) -> Iterator[Any]:
    yield item
    for child in item.childItems():
        yield from items_of(child)


def test_panels_change_settings_and_list_the_selection(bench: SceneBench, hand: Hand) -> None:
    from PySide6.QtTest import QTest

    view = bench.load(
        'ToolsPanel { objectName: "tools"; width: 200; height: 300; view: parent }\n'
        "SelectionPanel { x: 200; width: 200; height: 300; view: parent }"
    )
    bench.picture()
    field = next(one for one in items_of(view) if one.property("placeholderText") == "/goal_pose")
    centre = field.mapToScene(field.boundingRect().center())
    hand.click((round(centre.x()), round(centre.y())))
    for letter in "/dock":
        QTest.keyClick(bench.window, letter)
    hand.key(hand.keys.Key_Return)
    assert view.tools.find("SetGoal").topic == "/dock"
    box = next(one for one in items_of(view) if one.property("checked") and one.isVisible())
    centre = box.mapToScene(box.boundingRect().center())
    hand.click((round(centre.x()), round(centre.y())))
    assert not view.tools.find("Interact").hideInactiveObjects
    # Letters in a field select no tools.
    assert view.tool == "Interact"
    add_box(view, owner=view.scene.add("Path", "Way"))
    view.selection.select_between((0, 0), (400, 300))
    bench.picture()
    texts = [one.property("text") for one in items_of(view)]
    assert "1 selected" in texts
    assert texts.index("Way") < texts.index("0") < texts.index("Position: 0; 0; 0")


def test_a_text_of_the_view_stays_while_the_camera_moves(bench: SceneBench, hand: Hand) -> None:
    view = bench.load("ViewsPanel { width: 200; height: 300; view: parent }")
    bench.picture()

    def field(text: str) -> Any:
        shown = (one for one in items_of(view) if one.isVisible())
        return next((one for one in shown if one.property("text") == text), None)

    distance = field("10")
    centre = distance.mapToScene(distance.boundingRect().center())
    hand.click((round(centre.x()), round(centre.y())))
    hand.key(hand.keys.Key_End)
    hand.key(hand.keys.Key_Backspace)
    assert distance.property("text") == "1"
    view.controller.set("Yaw", 1.25)
    view.camera_moved()
    bench.wait(lambda: field("1.25"))
    assert distance.property("text") == "1"
    hand.key(hand.keys.Key_Return)
    assert view.controller.get("Distance") == 1.0
    boxes = [one for one in items_of(view) if one.property("checked") and one.isVisible()]
    centre = boxes[0].mapToScene(boxes[0].boundingRect().center())
    hand.click((round(centre.x()), round(centre.y())))
    assert not view.controller.get("Focal Shape Fixed Size")


def test_editing_one_coordinate_keeps_the_others(bench: SceneBench) -> None:
    view = bench.load()
    at = (500123.4567891, 5400987.6543219, 0.1234567891)
    view.controller.set("Focal Point", at)
    shown = next(one["value"] for one in view.viewSettings() if one["name"] == "Focal Point")
    assert shown == "500123.45679; 5400987.65432; 0.12346"
    assert view.setViewSetting("Focal Point", shown) == ""
    assert view.controller.get("Focal Point") == at
    assert view.setViewSetting("Focal Point", shown.replace("0.12346", "2")) == ""
    assert view.controller.get("Focal Point") == (*at[:2], 2.0)


def test_tools_are_added_and_removed(bench: SceneBench) -> None:
    view = bench.load()
    changes: list[int] = []
    view.tools.changed.connect(lambda: changes.append(len(view.tools)))
    goal = view.tools.add("rviz/SetGoal", "Dock", topic="/dock", shortcutKey="d")
    assert (goal.name, goal.topic, goal.class_id) == ("Dock", "/dock", "rviz/SetGoal")
    assert view.tools.find("Dock") is goal
    view.tools.select("Dock")
    view.tools.remove(goal)
    assert view.tool == "Interact"
    view.tools.clear()
    assert view.tools.current is None
    assert view.tool == ""
    assert changes[:2] == [9, 8]


def test_display_or_tool_removed_at_once_does_not_come_back(
    bench: SceneBench, hand: Hand, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    topics = ["/first", "/second"]
    goals = [listen(bench, topic, "geometry_msgs/PoseStamped") for topic in topics]
    for topic in topics:
        tools = f"[{{Class: rviz/Interact}}, {{Class: rviz/SetGoal, Topic: {topic}}}]"
        text = f"Visualization Manager: {{Displays: [], Tools: {tools}}}"
        (tmp_path / f"{topic}.rviz".lstrip("/")).write_text(text)
    # As right after Application.load(): nothing of it has run in the event loop.
    with monkeypatch.context() as at_once:
        at_once.setattr(bench, "wait", lambda *_: None)
        view = bench.load('GridDisplay { } SetInitialPoseTool { topic: "/own" }')
    assert [one.TYPE for one in view.scene.displays] == ["Grid"]
    own = view.tools.find("SetInitialPose")
    for topic in ("first", "second"):
        view.load_config(tmp_path / f"{topic}.rviz")
        view.scene.remove(view.scene.add("Axes"))
        view.tools.remove(view.tools.add("Measure"))
        bench.wait.settled(bench.session)
        assert [tool.TYPE for tool in view.tools] == ["Interact", "SetGoal", "SetInitialPose"]
        assert view.tools.find("SetInitialPose") is own
        assert view.scene.displays == []
    view.tool = "SetGoal"
    hand.drag(hand.at((0, 0, 0)), hand.at((1, 0, 0)))
    bench.wait(lambda: goals[1])
    assert not goals[0]
    view.tools.clear()
    bench.wait.settled(bench.session)
    assert len(view.tools) == 0


def test_qml_selects_and_declares_tools(bench: SceneBench, caplog: Any) -> None:
    view = bench.load(
        'tool: "Mark"; property var marks: []\n'
        'SetGoalTool { topic: "/robot1/goal_pose" }\n'
        'Tool { name: "Mark"; shortcutKey: "k"; onReleased: (event) => marks.push(event.point) }\n'
        "property int count: tools.all.length; property string now: tools.current.name"
    )
    assert view.tool == "Mark"
    assert view.tools.find("SetGoal").topic == "/robot1/goal_pose"
    assert [tool.TYPE for tool in view.tools].count("SetGoal") == 1
    assert view.property("count") == 9
    assert view.property("now") == "Mark"
    view.setProperty("tool", "Mesure")
    assert "SceneView: tool: there is no tool 'Mesure' in this view; did you mean" in caplog.text


def test_keys_select_tools(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    view.forceActiveFocus()
    hand.key(hand.keys.Key_M)
    assert view.tool == "MoveCamera"
    hand.key(hand.keys.Key_M)
    assert view.tool == "Interact"
    hand.key(hand.keys.Key_S, hand.CTRL)
    assert view.tool == "Interact"
    hand.key(hand.keys.Key_P)
    assert view.tool == "SetInitialPose"
    assert "Click and drag" in view.statusText
    hand.key(hand.keys.Key_Escape)
    assert view.tool == "Interact"


# -- the camera ----------------------------------------------------------------------------------


@pytest.mark.parametrize("policy", ["", "focusOnClick: true"])
def test_a_click_leaves_the_keyboard_to_the_interface(
    bench: SceneBench, hand: Hand, policy: str
) -> None:
    from PySide6.QtCore import QObject
    from PySide6.QtTest import QTest

    around = bench.load(
        'property string keys: ""\n'
        'Item { objectName: "drive"; focus: true; Keys.onPressed: event => keys += event.text }\n'
        f'SceneView {{ objectName: "inner"; anchors.fill: parent; {policy} }}'
    )
    inner: Any = around.findChild(QObject, "inner")
    around.findChild(QObject, "drive").forceActiveFocus()
    bench.picture()
    hand.drag((100, 100), (150, 120))
    for key in (hand.keys.Key_G, hand.keys.Key_Space):
        QTest.keyClick(bench.window, key)
    if policy:
        assert inner.hasActiveFocus()
        assert inner.tool == "SetGoal"
    else:
        assert around.property("keys") == "g "
        assert inner.tool == "Interact"


def test_the_mouse_moves_the_camera(bench: SceneBench, hand: Hand) -> None:
    view = bench.load("GridDisplay {}")
    yaw, distance = view.controller.yaw, view.controller.distance
    hand.press((200, 150))
    hand.move((240, 150))
    assert list(view.overlay.drawables()), "the ball at the focal point"
    assert has_color(bench.picture(), 255, 255, 0, 130) > 0
    hand.release((240, 150))
    assert not list(view.overlay.drawables())
    assert view.controller.yaw == pytest.approx(yaw - 0.2)
    hand.drag((200, 150), (200, 170), hand.RIGHT)
    assert view.controller.distance > distance


def test_the_wheel_zooms(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    distance = view.controller.distance
    hand.wheel((200, 150), 1)
    assert view.controller.distance == pytest.approx(distance * 0.88)


def test_a_change_of_the_view_draws(bench: SceneBench) -> None:
    view = bench.load("GridDisplay {}")
    bench.picture()
    before = bench.drawn()
    view.controller.yaw = 2.0
    bench.wait(lambda: bench.drawn() > before)


def test_f_and_focus_camera_turn_the_camera(
    bench: SceneBench, hand: Hand, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = bench.load()
    add_box(view, (1, 1, 0))
    hand.move(hand.at((1, 1, 0)))
    view.forceActiveFocus()
    start = view.camera().focus
    # It turns, and does not jump.
    with monkeypatch.context() as patch:
        patch.setattr("rosglass.scene.view.scene_view._TURN_S", 3600.0)
        hand.key(hand.keys.Key_F)
        assert view.is_turning
        assert np.linalg.norm(np.array(view.camera().focus) - start) < 0.5
    bench.wait(lambda: not view.is_turning)
    assert np.array(view.camera().focus) == pytest.approx(np.array((1, 1, 0)), abs=0.9)
    hand.key(hand.keys.Key_Z)
    bench.wait(lambda: not view.is_turning)
    assert view.camera().focus == pytest.approx((0, 0, 0))
    view.tool = "FocusCamera"
    hand.move(hand.at((0, 0, 0)))  # where the mouse is already, Qt reports no move
    hand.move(hand.at((1, 1, 0)))
    bench.wait(lambda: "Focus on this point. [" in view.statusText, lambda: view.statusText)
    hand.click(hand.at((1, 1, 0)))
    assert view.tool == "Interact"
    bench.wait(lambda: not view.is_turning)
    assert np.array(view.camera().focus) == pytest.approx(np.array((1, 1, 0)), abs=0.9)


def test_object_that_appears_under_a_still_mouse_is_found(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    view.tool = "FocusCamera"
    hand.move((5, 5))  # Qt drops a move to where the last test has left it
    hand.move(hand.at((1, 1, 0)))
    assert "Look in this direction" in view.statusText
    box = add_box(view, (1, 1, 0))
    bench.wait(lambda: "Focus on this point. [" in view.statusText)
    box.remove()
    bench.wait(lambda: "Look in this direction" in view.statusText)
    # What a tool draws there is no reason to draw again and again.
    view.tool = "Measure"
    add_box(view, (1, 1, 0))
    hand.press(hand.at((1, 1, 0)))
    hand.release(hand.at((1, 1, 0)))
    hand.move(hand.at((1.1, 1, 0)))
    bench.wait.nothing_happens(0.3)
    before = bench.drawn()
    bench.wait.nothing_happens(0.3)
    assert bench.drawn() < before + 2


# -- poses ---------------------------------------------------------------------------------------


def test_a_goal_is_published(bench: SceneBench, hand: Hand) -> None:
    view = bench.load("GridDisplay {}")
    goals = listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    set_poses: list[Any] = []
    view.tools.find("SetGoal").poseSet.connect(lambda *pose: set_poses.append(pose))
    view.tool = "SetGoal"
    start, end = hand.at((1, 0.5, 0)), hand.at((1, 2.5, 0))
    before = bench.robot.now().nanoseconds
    hand.press(start)
    hand.move(end)
    assert has_color(bench.picture(), 0, 200, 0, 80) > 50
    assert "degrees" in view.statusText
    hand.release(end)
    assert view.tool == "Interact"
    bench.wait(lambda: goals)
    goal = goals[0]
    assert goal.header.frame_id == "map"
    stamp = goal.header.stamp.sec * 10**9 + goal.header.stamp.nanosec
    assert before <= stamp <= bench.robot.now().nanoseconds
    position, turn = goal.pose.position, goal.pose.orientation
    assert (position.x, position.y, position.z) == pytest.approx((1, 0.5, 0), abs=0.05)
    assert 2 * math.atan2(turn.z, turn.w) == pytest.approx(math.pi / 2, abs=0.05)
    assert set_poses[0] == pytest.approx((position.x, position.y, 2 * math.atan2(turn.z, turn.w)))
    bench.wait(lambda: "sent on /goal_pose" in view.statusText)
    assert has_color(bench.picture(), 0, 200, 0, 80) == 0


def test_an_initial_pose_has_the_covariance(bench: SceneBench, hand: Hand) -> None:
    view = bench.load('tool: "SetInitialPose"; SetInitialPoseTool { xDeviation: 0.1 }')
    poses = listen(bench, "/initialpose", "geometry_msgs/PoseWithCovarianceStamped")
    hand.drag(hand.at((0, 0, 0)), hand.at((-1, 0, 0)))
    bench.wait(lambda: poses)
    covariance = poses[0].pose.covariance
    assert covariance[0] == pytest.approx(0.01)
    assert covariance[7] == pytest.approx(0.25)
    assert covariance[35] == pytest.approx(0.06853892)
    assert sum(covariance) == pytest.approx(0.01 + 0.25 + 0.06853892)
    turn = poses[0].pose.pose.orientation
    assert abs(2 * math.atan2(turn.z, turn.w)) == pytest.approx(math.pi, abs=0.05)
    assert view.tool == "Interact"


def test_escape_and_another_button_cancel_a_goal(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    goals = listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    view.tool = "SetGoal"
    for cancel in (lambda: hand.key(hand.keys.Key_Escape), lambda: hand.press((9, 9), hand.RIGHT)):
        hand.press((200, 150))
        hand.move((250, 150))
        cancel()
        hand.move((260, 150))
        hand.release((260, 150), hand.RIGHT)
        hand.release((260, 150))
        assert view.tool == "SetGoal"
    bench.wait.settled(bench.session)
    assert goals == []


def test_one_finger_sets_a_goal_and_two_move_the_camera(bench: SceneBench, hand: Hand) -> None:
    from PySide6.QtCore import QPoint
    from PySide6.QtTest import QTest

    view = bench.load()
    goals = listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    device = QTest.createTouchDevice()
    view.tool = "SetGoal"
    start, end = QPoint(*hand.at((0, 0, 0))), QPoint(*hand.at((2, 0, 0)))
    yaw = view.controller.yaw
    QTest.touchEvent(bench.window, device).press(0, start, bench.window).commit()
    QTest.touchEvent(bench.window, device).move(0, end, bench.window).commit()
    QTest.touchEvent(bench.window, device).release(0, end, bench.window).commit()
    bench.wait(lambda: goals)
    assert goals[0].pose.orientation.w == pytest.approx(1, abs=0.02)
    assert view.controller.yaw == yaw
    # A second finger drops the goal.
    view.tool = "SetGoal"
    focus, distance = view.camera().focus, view.controller.distance
    other = QPoint(50, 50)
    QTest.touchEvent(bench.window, device).press(0, start, bench.window).commit()
    QTest.touchEvent(bench.window, device).stationary(0).press(1, other, bench.window).commit()
    QTest.touchEvent(bench.window, device).move(0, end, bench.window).move(
        1, QPoint(20, 20), bench.window
    ).commit()
    QTest.touchEvent(bench.window, device).release(0, end, bench.window).release(
        1, QPoint(20, 20), bench.window
    ).commit()
    assert view.controller.distance != distance
    assert view.camera().focus != focus
    bench.wait.settled(bench.session)
    assert len(goals) == 1
    # One finger rotates where the tool does not take it.
    view.tool = "MoveCamera"
    QTest.touchEvent(bench.window, device).press(0, start, bench.window).commit()
    QTest.touchEvent(bench.window, device).move(0, end, bench.window).commit()
    QTest.touchEvent(bench.window, device).release(0, end, bench.window).commit()
    assert view.controller.yaw != yaw


def test_another_fixed_frame_drops_points_of_the_one_before(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    goals = listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    view.tool = "SetGoal"
    hand.press(hand.at((1, 0, 0)))
    view.fixedFrame = "odom"
    assert view.statusText == "2D Goal Pose: dropped: the fixed frame has changed"
    hand.release(hand.at((1, 0, 0)))
    bench.wait.settled(bench.session)
    assert goals == []
    add_box(view)
    view.tool = "Measure"
    measure = view.tools.current
    hand.click(hand.at((0, 0, 0.5)))
    hand.move(hand.at((0, 0.2, 0.5)))
    assert measure.length > 0
    view.tool = "Interact"
    view.fixedFrame = "map"
    assert measure.length == -1


def test_a_finger_that_stays_after_a_pinch_sends_no_goal(bench: SceneBench, hand: Hand) -> None:
    from PySide6.QtCore import QPoint
    from PySide6.QtTest import QTest

    view = bench.load()
    goals = listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    device = QTest.createTouchDevice()
    view.tool = "SetGoal"
    first, second, drifted = QPoint(150, 150), QPoint(250, 150), QPoint(251, 150)

    def fingers() -> Any:
        return QTest.touchEvent(bench.window, device)

    fingers().press(0, first, bench.window).commit()
    fingers().stationary(0).press(1, second, bench.window).commit()
    fingers().release(0, first, bench.window).stationary(1).commit()
    yaw = view.controller.yaw
    fingers().move(1, drifted, bench.window).commit()
    fingers().release(1, drifted, bench.window).commit()
    bench.wait.settled(bench.session)
    assert goals == []
    assert view.tool == "SetGoal"
    assert view.controller.yaw != yaw  # it has moved the camera
    # The next finger sets a goal again.
    fingers().press(0, first, bench.window).commit()
    fingers().release(0, first, bench.window).commit()
    bench.wait(lambda: goals)


def test_goal_without_subscribers_is_reported(bench: SceneBench, hand: Hand, caplog: Any) -> None:
    view = bench.load('SetGoalTool { topic: "/gaol_pose" }')
    listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    view.tool = "SetGoal"
    goal = view.tools.current
    hand.drag(hand.at((0, 0, 0)), hand.at((1, 0, 0)))
    bench.wait(lambda: "has no subscriber; did you mean /goal_pose" in view.statusText)
    assert "sent on /gaol_pose, which has no subscriber" in goal.problem
    assert "tool '2D Goal Pose': Goal at [" in caplog.text


def test_a_goal_while_disconnected_is_not_sent(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    view.tool = "SetGoal"
    goal = view.tools.current
    bench.wait(lambda: endpoint_of(goal) is not None)
    bench.session.shutdown()
    bench.wait(lambda: endpoint_of(goal) is None)
    hand.drag(hand.at((0, 0, 0)), hand.at((1, 0, 0)))
    assert "not sent: the robot is not connected" in view.statusText
    assert "not connected" in goal.problem


def test_a_goal_has_simulated_time(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    goals = listen(bench, "/goal_pose", "geometry_msgs/PoseStamped")
    clock = bench.robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    node = bench.session.node
    node.parameters.set({"use_sim_time": True})

    def tick() -> bool:
        clock.publish({"clock": {"sec": 42, "nanosec": 7}})
        return bool(node.now().nanoseconds == 42_000_000_007)

    bench.wait(tick)
    view.tool = "SetGoal"
    hand.drag(hand.at((0, 0, 0)), hand.at((1, 0, 0)))
    bench.wait(lambda: goals)
    assert (goals[0].header.stamp.sec, goals[0].header.stamp.nanosec) == (42, 7)


def test_the_status_is_plain_text(bench: SceneBench) -> None:
    view = bench.load()
    for tool in view.tools.all:
        tool.select()
        assert view.statusText
        assert not re.search("[<&]", view.statusText), tool.name
    view.tools.announce('<img src="http://robot/x">')
    assert view.statusText == '<img src="http://robot/x">'


def test_a_goal_is_sent_to_an_action(bench: SceneBench, hand: Hand, nav2: Any) -> None:
    view = bench.load('Nav2GoalTool { name: "Go" }\ntool: "Go"')
    poses: list[Any] = []

    def execute(goal: Any) -> dict[str, Any]:
        poses.append(goal.goal.pose)
        return {}

    nav2.create_action_server("/navigate_to_pose", "nav2_msgs/action/NavigateToPose", execute)
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: "Goal: succeeded" in view.statusText, lambda: view.statusText)
    assert poses[0].header.frame_id == "map"
    assert poses[0].pose.orientation.z == pytest.approx(math.sqrt(0.5), abs=0.05)
    assert view.tool == "Interact"


def test_the_goal_before_does_not_speak_for_the_next(
    bench: SceneBench, hand: Hand, nav2: Any
) -> None:
    view = bench.load('Nav2GoalTool { name: "Go" }\ntool: "Go"')
    goal, driver, statuses = view.tools.current, Driver(nav2), []
    goal.goalStatusChanged.connect(statuses.append)
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: "executing" in statuses)
    first = goal.goal
    del statuses[:]
    view.tools.select("Go")
    hand.drag(hand.at((1, 0, 0)), hand.at((1, 1, 0)))
    bench.wait(lambda: first.done.done() and "executing" in statuses)
    bench.wait.settled(bench.session)
    assert len(driver.goals) == 2
    assert first.status.value == "aborted"
    assert "aborted" not in statuses
    assert "executing" in view.statusText
    goal.goal.cancel()
    bench.wait(lambda: "canceled" in statuses)


def test_a_goal_of_an_action_is_canceled(bench: SceneBench, hand: Hand, nav2: Any) -> None:
    view = bench.load(
        'id: top; property bool going: go.goalActive; tool: "Go"\n'
        'Nav2GoalTool { id: go; name: "Go" }\nfunction halt() { go.cancelGoal() }'
    )
    driver, goal = Driver(nav2), view.tools.current
    view.halt()
    assert view.statusText == "There is no goal to cancel."
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: driver.goals)
    assert view.property("going")
    view.halt()
    assert view.statusText == "Goal: requested to cancel it"
    bench.wait(lambda: view.statusText == "Goal: canceled", lambda: view.statusText)
    bench.wait(lambda: not view.property("going"))
    # A server may refuse.
    driver.server.close()
    nav2.create_action_server(
        "/navigate_to_pose", "nav2_msgs/action/NavigateToPose", driver.execute,
        cancel=lambda _: False,
    )  # fmt: skip
    bench.wait(lambda: endpoint_of(goal).ready)
    view.tools.select("Go")
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: len(driver.goals) == 2)
    view.halt()
    bench.wait(lambda: "navigate_to_pose: not canceled: " in view.statusText)
    assert view.property("going")
    driver.goals.append(None)  # ends it


def test_escape_drops_a_goal_that_waits_for_its_server(
    bench: SceneBench, hand: Hand, nav2: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.scene.tools.publishing_tools._MATCH_TIMEOUT_S", 60.0)
    view = bench.load('Nav2GoalTool { name: "Go" }\ntool: "Go"')
    goal = view.tools.current
    bench.wait(lambda: endpoint_of(goal) is not None)
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    assert "looking for a server" in view.statusText
    hand.key(hand.keys.Key_Escape)
    assert "not sent: it was dropped" in view.statusText
    driver = Driver(nav2)
    bench.wait(lambda: endpoint_of(goal).ready)
    bench.wait.settled(bench.session)
    assert not driver.goals
    assert goal.goal is None


def test_cancel_stops_the_robot_while_another_goal_waits(
    bench: SceneBench, hand: Hand, nav2: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.scene.tools.publishing_tools._MATCH_TIMEOUT_S", 60.0)
    view = bench.load('Nav2GoalTool { name: "Go" }\ntool: "Go"')
    driver, goal = Driver(nav2), view.tools.current
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: driver.goals)
    # As over a bad connection.
    monkeypatch.setattr(type(endpoint_of(goal)), "ready", False)
    view.tools.select("Go")
    hand.drag(hand.at((1, 0, 0)), hand.at((1, 1, 0)))
    assert "looking for a server" in view.statusText
    goal.cancelGoal()
    bench.wait(lambda: goal.goal.status.value == "canceled")
    assert len(driver.goals) == 1


def test_a_config_does_not_silently_drop_a_goal_that_waits(
    bench: SceneBench, hand: Hand, monkeypatch: pytest.MonkeyPatch, caplog: Any
) -> None:
    monkeypatch.setattr("rosglass.scene.tools.publishing_tools._MATCH_TIMEOUT_S", 60.0)
    view = bench.load()
    view.tools.add("GoalTool")
    view.tools.select("GoalTool")
    goal = view.tools.current
    bench.wait(lambda: endpoint_of(goal) is not None)
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    assert "looking for a server" in view.statusText
    view.tools.load_configs([{"Class": "rviz_default_plugins/Interact"}])
    assert "not sent: the tool was removed" in view.statusText
    assert "not sent: the tool was removed" in caplog.text


def test_qml_does_not_silently_destroy_a_tool_with_a_goal(
    bench: SceneBench, nav2: Any, monkeypatch: pytest.MonkeyPatch, caplog: Any
) -> None:
    from rosglass.qt import send_deferred_deletes

    monkeypatch.setattr("rosglass.scene.tools.publishing_tools._MATCH_TIMEOUT_S", 60.0)
    view = bench.load(
        "id: top; property bool wanted: true\n"
        "Loader { active: top.wanted; sourceComponent: Item { \n"
        '  SetGoalTool { name: "Drive"; action: "/navigate_to_pose" }\n'
        '  SetGoalTool { name: "Later"; topic: "/later" } } }'
    )
    bench.wait(lambda: view.tools.find("Later") is not None)
    drive, later = view.tools.find("Drive"), view.tools.find("Later")
    driver = Driver(nav2)
    for tool in (drive, later):
        view.tools.select(tool)
        bench.wait(lambda tool=tool: endpoint_of(tool) is not None)
        tool.send_pose(1.0, 2.0, 0.0)
    bench.wait(lambda: driver.goals)
    view.setProperty("wanted", False)
    send_deferred_deletes()
    assert "/navigate_to_pose: the tool was destroyed: its goal continues" in caplog.text
    assert "Goal at [1, 2] m, 0.0 degrees: not sent: the tool was destroyed" in caplog.text
    driver.goals.append(None)  # ends it


def test_a_config_does_not_silently_end_the_reports_of_a_goal(
    bench: SceneBench, hand: Hand, nav2: Any, caplog: Any
) -> None:
    view = bench.load()
    driver = Driver(nav2)
    view.tools.add("GoalTool")
    view.tools.select("GoalTool")
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: driver.goals)
    view.tools.load_configs([{"Class": "rviz_default_plugins/Interact"}])
    assert "navigate_to_pose: the tool was removed: its goal continues" in view.statusText
    assert "its goal continues" in caplog.text
    driver.goals.append(None)  # ends it


def test_goal_to_an_action_without_server_is_reported(
    bench: SceneBench, hand: Hand, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = bench.load('Nav2GoalTool { name: "Go" }\ntool: "Go"')
    goal = view.tools.current
    bench.wait(lambda: endpoint_of(goal) is not None)
    said: list[str] = []
    view.statusTextChanged.connect(lambda: said.append(view.statusText))
    monkeypatch.setattr("rosglass.scene.tools.publishing_tools._MATCH_TIMEOUT_S", 0.2)
    hand.drag(hand.at((0, 0, 0)), hand.at((0, 1, 0)))
    bench.wait(lambda: "not sent" in goal.problem, lambda: goal.problem)
    assert "/navigate_to_pose" in goal.problem
    assert goal.goal is None
    assert not [text for text in said if "sent to" in text]


# -- points, distances, selections ---------------------------------------------------------------


def test_a_clicked_point_is_published(bench: SceneBench, hand: Hand) -> None:
    view = bench.load('tool: "PublishPoint"')
    points = listen(bench, "/clicked_point", "geometry_msgs/PointStamped")
    add_box(view)
    hand.move((5, 5))
    assert "Move over an object" in view.statusText
    hand.click((5, 5))
    assert view.tool == "PublishPoint"
    hand.click(hand.at((0, 0, 0.5)))
    bench.wait(lambda: points)
    assert points[0].header.frame_id == "map"
    point = points[0].point
    assert (point.x, point.y, point.z) == pytest.approx((0, 0, 0.5), abs=0.05)
    assert view.tool == "Interact"
    view.tools.find("PublishPoint").singleClick = False
    view.tool = "PublishPoint"
    hand.click(hand.at((0, 0, 0.5)))
    assert view.tool == "PublishPoint"


def test_a_distance_is_measured(bench: SceneBench, hand: Hand) -> None:
    view = bench.load('tool: "Measure"; background: "white"')
    add_box(view, (-2, 0, -0.5))
    add_box(view, (2, 0, -0.5))
    measure = view.tools.current
    measured: list[float] = []
    measure.measured.connect(measured.append)
    hand.click(hand.at((-2, 0, 0)))
    hand.move(hand.at((2, 0, 0)))
    assert "Length: 4" in view.statusText or "Length: 3.9" in view.statusText
    hand.click(hand.at((2, 0, 0)))
    assert measured == [pytest.approx(4, abs=0.1)]
    assert measure.length == measured[0]
    assert has_color(bench.picture(), 255, 213, 0) > 100
    # Its white letters have dark edges.
    assert has_color(bench.picture(), 0, 0, 0) > 20
    hand.click((200, 150), hand.RIGHT)
    assert measure.length == -1
    assert has_color(bench.picture(), 255, 213, 0) == 0


def test_a_rectangle_selects(bench: SceneBench, hand: Hand) -> None:
    from rosglass.scene.render.drawing import Points
    from rosglass.scene.render.matrices import instance_matrix

    view = bench.load('tool: "Select"; property int count: selection.count')

    class Part:
        name = "arm_link"
        display = view.scene.add("Path", "Robot")

        def describe(self) -> list[tuple[str, str]]:
            return [("Mass", "3 kg")]

    box = add_box(view, (-2, 0, 0), Part())
    cloud = Points()
    cloud.owner = view.scene.add("Path", "Cloud")
    cloud.set_points([[2, 0, 0], [2.2, 0, 0], [3, 3, 5]])
    view.scene.root.add(cloud)
    selection = view.selection
    x, y = hand.at((2, 0, 0))
    hand.press((x - 40, y - 40))
    hand.move((x + 60, y + 40))
    bench.picture()
    assert has_color(bench.picture(), 0x60, 0xA0, 0xFF) > 100
    hand.release((x + 60, y + 40))
    assert has_color(bench.picture(), 0x60, 0xA0, 0xFF, 20) == 0
    assert selection.count == 2
    assert view.property("count") == 2
    first = selection.items()[0]
    assert (first.display, first.part) == ("Cloud", "0")
    assert first.lines[0] == ("Position", "2; 0; 0")
    hand.click(hand.at((-2, 0, 0)), keys=hand.SHIFT)
    assert selection.count == 3
    part = selection.items()[-1]
    assert (part.display, part.part, part.lines[-1]) == ("Robot", "arm_link", ("Mass", "3 kg"))
    assert "3 selected" in view.statusText
    assert selection.parts[-1]["lines"][-1]["value"] == "3 kg"
    assert has_color(bench.picture(), 153, 204, 255, 30) > 20
    hand.drag((x - 40, y - 40), (x + 60, y + 40), keys=hand.CTRL)
    assert selection.count == 1
    # The box is followed, and forgotten with the drawable.
    before = selection.middle()
    box.pose = instance_matrix((-2, 1, 0))
    bench.wait(lambda: [pose[1, 3] for _, pose, _ in view.overlay.drawables()] == [1])
    assert before.y == pytest.approx(0)
    box.set_instances([])
    # Before it has followed.
    assert selection.middle() is None
    assert selection.items()[0].part == "arm_link"
    box.remove()
    bench.wait(lambda: selection.count == 0)
    assert not list(view.overlay.drawables())


def test_a_cell_of_a_large_map_is_selected_without_the_others(bench: SceneBench) -> None:
    import tracemalloc

    from rosglass.scene.render.drawing import MapImage
    from rosglass.scene.render.picking import Selected

    view = bench.load()
    image = MapImage()
    image.owner = view.scene.add("Map", "Floor")
    image.set_cells(np.zeros((16384, 16384), np.uint8), 0.05)
    cell = 16384 * 16000 + 5
    tracemalloc.start()
    try:
        view.selection.apply([Selected(image, np.array([cell]))])
        view.selection.apply([Selected(image, np.array([cell + 3, cell + 1]))], "add")
        view.selection.apply([Selected(image, np.array([cell]))], "remove")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert view.selection.count == 2
    assert [part.part for part in view.selection.items()] == [str(cell + 1), str(cell + 3)]
    assert peak < 1 << 20


def test_the_panel_follows_what_is_selected(bench: SceneBench) -> None:
    from rosglass.scene.render.matrices import instance_matrix

    view = bench.load("SelectionPanel { width: 200; height: 300; view: parent }")
    box = add_box(view, owner=view.scene.add("Path", "Way"))
    view.selection.select_between((0, 0), (400, 300))

    def is_shown(text: str) -> bool:
        return any(one.property("text") == text for one in items_of(view))

    bench.wait(lambda: is_shown("Position: 0; 0; 0"))
    box.pose = instance_matrix((0, 0, 0.5))
    bench.wait(lambda: is_shown("Position: 0; 0; 0.5"))


def test_parts_are_listed_by_display_and_expanded_by_a_click(bench: SceneBench, hand: Hand) -> None:
    view = bench.load("SelectionPanel { width: 200; height: 300; view: parent }")

    class Link:
        display = view.scene.add("Path", "Robot")

        def __init__(self, name: str) -> None:
            self.name = name

        def describe(self) -> list[tuple[str, str]]:
            return [("Position", f"{self.name}; 0; 0")]

    # A link of two meshes is one part.
    for owner in [Link("1")] * 2 + [Link("2")]:
        add_box(view, owner=owner)
    view.selection.select_between((0, 0), (400, 300))
    assert view.selection.count == 2
    assert [part.lines for part in view.selection.items()] == [
        [("Position", "1; 0; 0")],
        [("Position", "2; 0; 0")],
    ]

    def texts() -> list[str]:
        bench.picture()
        shown = [one.property("text") for one in items_of(view) if one.isVisible()]
        return [text for text in shown if text and text[0] in "R12P"]

    def click(text: str) -> None:
        row = next(one for one in items_of(view) if one.property("text") == text)
        centre = row.mapToScene(row.boundingRect().center())
        hand.click((round(centre.x()), round(centre.y())))

    assert texts() == ["2 selected", "Robot (2)", "1", "2"]
    click("2")
    assert texts() == ["2 selected", "Robot (2)", "1", "2", "Position: 2; 0; 0"]
    click("Robot (2)")
    assert texts() == ["2 selected", "Robot (2)"]


def test_selected_points_are_dropped_with_their_cloud(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Points

    view = bench.load()
    cloud = Points()
    cloud.owner = "cloud"
    cloud.set_points([[0, 0, 0]])
    view.scene.root.add(cloud)
    view.selection.select_between((0, 0), (400, 300))
    assert view.selection.count == 1
    cloud.set_points([[0, 0, 1]])
    bench.wait(lambda: view.selection.count == 0)


def test_interactive_object_gets_the_mouse(bench: SceneBench, hand: Hand) -> None:
    view = bench.load()
    seen: list[str] = []

    class Marker:
        help = ""

        def handle_pointer(self, what: str, event: Any) -> bool:
            seen.append(what)
            return True

    add_box(view, (0, 0, 0), Marker())
    yaw = view.controller.yaw
    middle = hand.at((0, 0, 0))
    hand.move(middle)
    hand.drag(middle, (middle[0] + 100, middle[1]))
    hand.move((5, 5))
    assert seen == ["enter", "move", "press", "move", "move", "release", "leave"]
    assert view.controller.yaw == yaw
    del seen[:]
    distance = view.controller.distance
    hand.move(middle)
    hand.wheel(middle, 1)
    view.tool = "Measure"
    assert seen == ["enter", "move", "wheel", "leave"]
    assert view.controller.distance == distance
    view.tool = "Interact"
    hand.drag((5, 5), (50, 5))
    assert view.controller.yaw != yaw


# -- own tools -----------------------------------------------------------------------------------


def test_an_own_tool_in_qml_gets_points(bench: SceneBench, hand: Hand) -> None:
    view = bench.load(
        'tool: "Mark"; property var seen: []; property string keys\n'
        'Tool { name: "Mark"\n'
        " onPressed: (event) => seen.push(event.ground.x)\n"
        " onMoved: (event) => { if (event.buttons) seen.push(event.point) }\n"
        " onReleased: (event) => { seen.push(event.point.z); seen.push(event.display) }\n"
        " onKeyPressed: (event) => { keys += event.key } }"
    )
    yaw = view.controller.yaw
    add_box(view, (0, 0, 0), view.scene.add("Path", "Tower"))
    hand.press(hand.at((3, 0, 0)))
    hand.move((5, 5))
    hand.release(hand.at((0, 0, 0.5)))
    seen = view.property("seen").toVariant()
    assert seen[0] == pytest.approx(3, abs=0.05)
    assert seen[1] is None
    assert seen[-2] == pytest.approx(0.5, abs=0.05)
    assert seen[-1] == "Tower"
    hand.key(hand.keys.Key_X)
    assert view.property("keys") == "x"
    assert view.controller.yaw == yaw


def test_points_keep_the_digits_of_utm_coordinates(bench: SceneBench, hand: Hand) -> None:
    view = bench.load(
        'tool: "Mark"; property var seen: []\n'
        'Tool { name: "Mark"; onReleased: (event) => seen.push(event.point.x, event.ground.y) }'
    )
    at = (500123.4, 5400987.6, 0.0)
    view.controller.focal_point = at
    add_box(view, at)
    hand.click((200, 150))
    seen = view.property("seen").toVariant()
    assert seen == [view.pick(200, 150).point[0], pytest.approx(at[1], abs=1e-5)]
    points: list[Any] = []
    tool = view.tools.find("PublishPoint")
    tool.pointSet.connect(points.append)
    view.tools.select(tool)
    hand.move((200, 150))
    hand.click((200, 150))
    assert points[0]["x"] == seen[0]
    view.tool = "SetGoal"
    hand.press((200, 150))
    assert "[500123.4, 5400987.6] m, 0.0 degrees" in view.statusText


def test_an_own_tool_in_python_may_fail(bench: SceneBench, hand: Hand, caplog: Any) -> None:
    from rosglass.scene.tools.tool import Tool

    class Broken(Tool):
        NAME = "Broken"

        def on_press(self, event: Any) -> bool:
            raise ValueError("a mistake")

    view = bench.load()
    view.tools.add(Broken)
    view.tools.select("Broken")
    hand.click((200, 150))
    assert "ValueError('a mistake')" in view.statusText
    assert "a mistake" in caplog.text
    assert view.tool == "Broken"


def test_an_own_tool_may_fail_when_it_is_selected_or_not(
    bench: SceneBench, hand: Hand, caplog: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.tools.tool import Tool

    monkeypatch.setattr("rosglass.scene.tools.tool_manager._OUTCOME_MS", 100)

    class Broken(Tool):
        NAME = "Broken"

        def activate(self) -> None:
            raise ValueError("no start")

        def deactivate(self) -> None:
            raise ValueError("no end")

        def help(self, modifiers: Any) -> str:
            raise ValueError("no help")

        def cursor(self, event: Any) -> Any:
            raise ValueError("no cursor")

        def drop_waiting(self) -> bool:
            raise ValueError("no drop")

    view = bench.load()
    view.tools.add(Broken)
    view.tools.select("Broken")
    assert view.tool == "Broken"
    assert "ValueError('no start')" in view.statusText
    bench.wait(lambda: "ValueError('no help')" in view.statusText)
    hand.click((200, 150))
    hand.key(hand.keys.Key_Escape)
    assert view.tool == "Interact"
    assert view.tools.current.selected
    for what in ("start", "end", "help", "cursor", "drop"):
        assert f"ValueError: no {what}" in caplog.text


def test_a_destroyed_tool_is_forgotten(bench: SceneBench) -> None:
    view = bench.load(
        'id: top; tool: "Mark"; property bool wanted: true\n'
        "Loader { active: top.wanted; sourceComponent: Item { \n"
        '  SetGoalTool { name: "Inner"; topic: "/inner" } } }\n'
        'Tool { name: "Mark" }'
    )
    bench.wait(lambda: view.tools.find("Inner") is not None)
    view.tools.select("Inner")
    view.setProperty("wanted", False)
    bench.wait(lambda: view.tools.find("Inner") is None)
    bench.wait(lambda: view.tool == "Interact")


# -- files ---------------------------------------------------------------------------------------


def test_tools_of_config_files(bench: SceneBench) -> None:
    tools = bench.load('Tool { name: "Mark" }').tools
    notes = tools.load_configs(
        [
            {"Class": "rviz/MoveCamera"},
            {"Class": "rviz/SetInitialPose", "Topic": "/pose", "X std deviation": 0.2, "Own": 1},
            {
                "Class": "rviz_default_plugins/SetInitialPose",
                "Topic": {"Value": "/pose2", "Depth": 5},
                "Covariance x": 0.25,
                "Covariance y": 4.0,
                "Covariance yaw": 0.01,
            },
            {"Class": "rviz_default_plugins/SetGoal"},
            {"Class": "rviz/SetGoal", "Topic": "goal"},
            {"Class": "jsk_rviz_plugin/CloseAll", "Name": "Close"},
        ]
    )
    assert len(notes) == 1
    assert "tool 'jsk_rviz_plugin/CloseAll': rosglass has no such tool; it is kept" in notes[0]
    assert tools.current is tools.all[0]
    assert [tool.name for tool in tools][-2:] == ["2D Goal Pose", "Mark"]
    first, second = tools.all[1:3]
    assert (first.topic, first.xDeviation, first.yDeviation) == ("/pose", 0.2, 0.5)
    assert (second.topic, second.xDeviation, second.yDeviation) == ("/pose2", 0.5, 2.0)
    assert tools.save_configs(2)[2]["Covariance y"] == 4.0
    second.yDeviation = 3.0
    saved = tools.save_configs(1)
    assert saved[1] == {
        "Class": "rviz/SetInitialPose",
        "Topic": "/pose",
        "X std deviation": 0.2,
        "Own": 1,
    }
    assert saved[4] == {"Class": "rviz/SetGoal", "Topic": "goal"}
    assert saved[5] == {"Class": "jsk_rviz_plugin/CloseAll", "Name": "Close"}
    saved = tools.save_configs(2)
    assert saved[2]["Covariance y"] == pytest.approx(9)
    assert "Y std deviation" not in saved[2]
    assert saved[2]["Topic"] == {"Value": "/pose2", "Depth": 5}
    assert saved[3] == {"Class": "rviz_default_plugins/SetGoal"}
    assert saved[4]["Class"] == "rviz_default_plugins/SetGoal"
    assert saved[4]["Topic"] == {"Value": "goal"}
    tools.find("SetGoal").topic = "/dock"
    assert tools.save_configs(2)[3]["Topic"]["Value"] == "/dock"


def test_a_declared_tool_replaces_that_of_a_file(bench: SceneBench) -> None:
    tools = bench.load(
        'SetGoalTool { topic: "/robot1/goal_pose" }\nSetGoalTool { name: "Two"; topic: "/two" }'
    ).tools
    saved = [
        {"Class": "rviz_default_plugins/MoveCamera"},
        {"Class": "rviz_default_plugins/SetGoal", "Topic": {"Value": "/goal_pose"}, "Own": 1},
        {"Class": "rviz_default_plugins/Measure"},
    ]
    for _ in range(2):
        assert tools.load_configs(saved) == []
        shown = [(tool.TYPE, getattr(tool, "topic", "")) for tool in tools]
        assert shown == [
            ("MoveCamera", ""),
            ("SetGoal", "/robot1/goal_pose"),
            ("Measure", ""),
            ("SetGoal", "/two"),
        ]
        # What the file has stays in it; the interface has its own.
        assert tools.save_configs(2)[:3] == saved
    tools.find("SetGoal").topic = "/robot2/goal_pose"
    changed = tools.save_configs(2)[1]
    assert (changed["Topic"]["Value"], changed["Own"]) == ("/robot2/goal_pose", 1)
    tools.load_configs(saved[:1])
    assert [(tool.TYPE, tool.saved) for tool in tools][1:] == [("SetGoal", {})] * 2


def test_a_publisher_has_the_qos_of_the_file(bench: SceneBench) -> None:
    from rosglass.comm.qos import Durability, QoS

    tools = bench.load().tools
    topic = {"Value": "/dock", "Depth": 3, "Durability Policy": "Transient Local"}
    assert tools.load_configs([{"Class": "rviz_default_plugins/SetGoal", "Topic": topic}]) == []
    goal = tools.find("SetGoal")
    tools.select(goal)
    bench.wait(lambda: endpoint_of(goal) is not None)
    goal.send_pose(1.0, 2.0, 0.0)
    bench.wait(lambda: "has no subscriber" in goal.problem)
    # Kept for those who come later.
    received: list[Any] = []
    qos = QoS(durability=Durability.TRANSIENT_LOCAL)
    bench.robot.create_subscription("/dock", "geometry_msgs/PoseStamped", received.append, qos=qos)
    bench.wait(lambda: received)


def test_a_goal_goes_to_the_topic_that_was_just_set(bench: SceneBench, nav2: Any) -> None:
    view = bench.load('SetGoalTool { topic: "/robot1/goal_pose" }')
    before = listen(bench, "/robot1/goal_pose", "geometry_msgs/PoseStamped")
    after = listen(bench, "/robot2/goal_pose", "geometry_msgs/PoseStamped")
    view.tool = "SetGoal"
    goal = view.tools.current
    bench.wait(lambda: (publisher := endpoint_of(goal)) and publisher.subscription_count())
    goal.topic = "/robot2/goal_pose"
    goal.send_pose(1.0, 2.0, 0.0)
    bench.wait(lambda: after)
    driver = Driver(nav2)
    goal.action = "navigate_to_pose"
    goal.send_pose(3.0, 2.0, 0.0)
    bench.wait(lambda: driver.goals)
    goal.cancelGoal()
    bench.wait(lambda: not goal.goalActive)
    goal.action = "without_server"
    goal.send_pose(3.0, 2.0, 0.0)
    bench.wait(lambda: "looking for a server" in view.tools.outcome)
    goal.action = ""
    goal._on_tick()  # before what sends has followed
    bench.wait(lambda: "the topic was changed" in view.tools.outcome, lambda: view.tools.outcome)
    assert (len(before), len(after)) == (0, 1)


def test_default_topic_of_the_other_rviz_is_replaced(bench: SceneBench) -> None:
    tools = bench.load().tools
    old = {"Class": "rviz/SetGoal", "Topic": "/move_base_simple/goal"}
    own = {"Class": "rviz_default_plugins/SetGoal", "Topic": {"Value": "/move_base_simple/goal"}}
    tools.load_configs([old, own])
    bench.wait(lambda: bench.view.scene.node is not None)
    for tool in tools:
        tool.activate()
    bench.wait(lambda: all(endpoint_of(tool) is not None for tool in tools))
    assert [endpoint_of(tool).topic for tool in tools] == ["/goal_pose", "/move_base_simple/goal"]
    assert tools.save_configs(1)[0] == old
    assert tools.save_configs(2)[0]["Topic"]["Value"] == "/goal_pose"


# -- ROS 1 ---------------------------------------------------------------------------------------


def test_the_first_saved_view_begins_a_config_of_rviz_1(ros1_bench: SceneBench) -> None:
    view = ros1_bench.load()
    ros1_bench.wait(lambda: view.scene.node is not None)
    assert view.saveView("start") == ""
    assert view.collect_config().ros == 1
    assert view.config.saved_views[0].class_id == "rviz/Orbit"


def test_ros_1_has_topics_of_its_own(ros1_bench: SceneBench) -> None:
    bench = ros1_bench
    hand, view = Hand(bench), bench.load()
    add_box(view, (0, 0, 0))
    goals = listen(bench, "/move_base_simple/goal", "geometry_msgs/PoseStamped")
    poses = listen(bench, "/initialpose", "geometry_msgs/PoseWithCovarianceStamped")
    points = listen(bench, "/clicked_point", "geometry_msgs/PointStamped")
    start, end = hand.at((0, 0, 0)), hand.at((2, 0, 0))
    for tool, received in (("SetGoal", goals), ("SetInitialPose", poses), ("PublishPoint", points)):
        view.tool = tool
        hand.drag(start, end) if received is not points else hand.click(start)
        bench.wait(lambda received=received: received)
        assert received[0].header.frame_id == "map"
        assert received[0].header.stamp.secs > 1e9
    assert goals[0].pose.orientation.w == pytest.approx(1, abs=0.01)


def test_a_goal_of_an_action_is_not_sent_while_disconnected(
    ros1_bench: SceneBench, ros_master: RosMaster
) -> None:
    bench = ros1_bench
    view = bench.load('SetGoalTool { name: "Go"; action: "/move_base" }\ntool: "Go"')
    hand, goal = Hand(bench), view.tools.current
    bench.wait(lambda: endpoint_of(goal) is not None)
    ros_master.kill()
    bench.wait(lambda: bench.session.state != "connected")
    hand.drag(hand.at((0, 0, 0)), hand.at((1, 0, 0)))
    assert "not sent: the robot is not connected" in view.statusText
    assert view.tool == "Interact"
    ros_master.start()
