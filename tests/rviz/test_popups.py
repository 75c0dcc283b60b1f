"""Popups and dialogs of widgets over RViz's 3D view."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import pytest


def label(text: str = "popup") -> Any:
    from rosglass.rviz.qt5 import QtWidgets

    made = QtWidgets.QPushButton(text)
    made.setFixedSize(100, 60)
    return made


def there_is_grey(popup: Any) -> bool:
    """Return whether a popup is greyed out as stale."""
    picture = popup.root.grab().toImage()
    at = popup.content.geometry().topLeft()
    here = picture.pixelColor(at.x() + 10, at.y() + 10)
    return bool(max(here.red(), here.green(), here.blue()) < 200)


def test_popups_are_above_and_the_pressed_one_above_the_others(hand: Any, app: Any) -> None:
    from rosglass.rviz.popup import Popup

    low, middle, high = (app.add(Popup(label(), name)) for name in ("low", "middle", "high"))
    for number, popup in enumerate((low, middle, high)):
        popup.move(150 + 60 * number, 200)
    hand.wait.frames(3)
    clicked: list[str] = []
    for popup in (low, middle, high):
        popup.content.clicked.connect(lambda _=0, name=popup.name: clicked.append(name))
    # At the left edge of the lowest one, and then where it overlaps the next.
    hand.click(110, 200)
    hand.click(180, 200)
    assert clicked == ["low", "low"]
    assert [overlay.name for overlay in app.overlays] == ["middle", "high", "low"]


def test_modal_popup_blocks_what_is_below(hand: Any, app: Any, view: Any) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.popup import Popup

    below: list[bool] = []
    button = label("below")
    button.clicked.connect(below.append)
    app.add(WidgetOverlay(button, "Below"))
    popup = app.add(Popup(label(), "Modal", modal=True))
    hand.wait.frames(3)
    yaw, distance = view("Yaw"), view("Distance")
    hand.drag(400, 400, 500, 400)
    hand.click(50, 30)
    hand.wheel(400, 400)
    assert (view("Yaw"), view("Distance"), below) == (yaw, distance, [])
    assert app.overlays.input.focused is popup
    popup.visible = False
    hand.wheel(400, 400)
    assert view("Distance") < distance


def test_modeless_popup_leaves_the_rest_alone(hand: Any, app: Any, view: Any) -> None:
    from rosglass.rviz.popup import Popup

    app.add(Popup(label(), "Modeless"))
    hand.wait.frames(3)
    yaw = view("Yaw")
    hand.drag(400, 500, 500, 500)
    assert view("Yaw") != yaw


def test_press_beside_dismisses(hand: Any, app: Any) -> None:
    from rosglass.rviz.popup import Popup

    popup = app.add(Popup(label(), "Light", light_dismiss=True))
    popup.move(200, 200)
    dismissals: list[int] = []
    popup.dismissed.connect(lambda: dismissals.append(1))
    hand.wait.frames(3)
    hand.click(200, 200)
    assert popup.visible
    hand.click(400, 400)
    assert (popup.visible, dismissals) == (False, [1])


@pytest.mark.parametrize(
    ("anchor", "corner"),
    [
        ("TOP_LEFT", (300, 200)),
        ("TOP_RIGHT", (200, 200)),
        ("CENTER", (250, 170)),
        ("BOTTOM_LEFT", (300, 140)),
        ("BOTTOM_RIGHT", (200, 140)),
        ("AUTO", (300, 200)),
    ],
)
def test_anchor_is_at_the_place(hand: Any, app: Any, anchor: str, corner: Any) -> None:
    from rosglass.rviz.popup import Anchor, Popup

    popup = app.add(Popup(label(), "Anchored", anchor=Anchor[anchor]))
    popup.move(300, 200)
    hand.wait.frames(3)
    box = popup.content.geometry()
    assert (box.x(), box.y()) == corner
    popup.move(1e4, -50)
    box = popup.content.geometry()
    assert (box.right() + 1, box.top()) == (popup.root.width(), 0)


def test_popup_follows_a_point(hand: Any, app: Any, view: Any) -> None:
    from rosglass.rviz.camera import RvizCamera
    from rosglass.rviz.popup import Popup

    popup = app.add(Popup(label(), "Point"))
    popup.follow(app.rviz.trackers, (1, 0, 0))

    def right() -> bool:
        seen = RvizCamera(app.window).project((1, 0, 0))
        at = popup.content.geometry().center()
        return bool(abs(at.x() - seen.x) < 3 and abs(at.y() - seen.y) < 3)

    hand.wait(right)
    before = popup.content.geometry().center()
    app.window.manager.getViewManager().getCurrent().subProp("Yaw").setValue(view("Yaw") + 1)
    hand.wait(lambda: popup.content.geometry().center() != before and right())
    # Behind the camera, it is not seen.
    x, y, z = RvizCamera(app.window).eye
    popup.follow(app.rviz.trackers, (2 * x, 2 * y, 2 * z))
    assert not popup.content.isVisible()
    # Nor where its frame is unknown, which is a problem.
    popup.follow(app.rviz.trackers, (0, 0, 0), frame="nowhere")
    hand.wait(lambda: "the frame 'nowhere'" in popup.problem)
    assert not popup.content.isVisible()
    popup.move(50, 50)
    assert popup.problem == ""
    assert popup.content.isVisible()


def test_dialog_is_moved_by_its_title_and_reports_its_button(hand: Any, app: Any) -> None:
    from rosglass.rviz.popup import Button, message

    dialog = app.add(message("Title", "Really?", buttons=Button.YES | Button.NO))
    hand.wait.frames(3)
    clicked: list[Any] = []
    dialog.clicked.connect(clicked.append)
    box = dialog.content.geometry()
    hand.drag(box.center().x(), box.y() + 16, box.center().x() + 80, box.y() + 66)
    moved = dialog.content.geometry()
    assert abs(moved.x() - box.x() - 80) <= 2
    assert abs(moved.y() - box.y() - 50) <= 2
    at = dialog.buttons[Button.NO].mapTo(dialog.root, dialog.buttons[Button.NO].rect().center())
    hand.click(at.x(), at.y())
    assert clicked == [Button.NO]
    assert not dialog.visible


def test_bad_popups_are_refused(app: Any) -> None:
    from rosglass import Error
    from rosglass.rviz.popup import Button, Popup, message

    with pytest.raises(Error, match="is not a QWidget"):
        Popup(lambda: None, "None")
    with pytest.raises(Error, match="needs a button"):
        message("Title", "text", buttons=Button(0))
    with pytest.raises(Error, match="not a position"):
        app.add(Popup(label(), "Here")).move(float("nan"), 0)


def test_qml_popup_follows_a_point_and_is_moved(hand: Any, app: Any, show: Any) -> None:
    from rosglass.rviz.camera import RvizCamera

    root = show(
        """import RosRviz 1.0
        Item { property real px: popup.x; property real py: popup.y
            property real wide: popup.width; property real high: popup.height
            AnchoredPopup { id: popup; visible: true; movable: true; width: 120; height: 80
                point: [1, 0, 0] } }"""
    )

    def centre() -> tuple[float, float]:
        left, top, wide, high = (root.property(n) for n in ("px", "py", "wide", "high"))
        return left + wide / 2, top + high / 2

    def right() -> bool:
        seen = RvizCamera(app.window).project((1, 0, 0))
        x, y = centre()
        return abs(x - seen.x) < 2 and abs(y - seen.y) < 2

    hand.wait(right)
    x, y = centre()
    hand.drag(x - 55, y, x + 45, y + 50)
    assert abs(centre()[0] - x - 100) < 3
    assert abs(centre()[1] - y - 50) < 3


def test_qml_message_blocks_until_it_is_answered(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """import RosRviz 1.0
        Item { property bool done: false
            MessageDialog { visible: true; title: "Stop"; text: "Really?"
                onAccepted: parent.done = true } }""".replace("parent.done", "top.done").replace(
            "Item {", "Item { id: top;"
        )
    )
    distance = view("Distance")
    hand.wheel(30, 500)
    hand.drag(30, 500, 130, 500)
    assert view("Distance") == distance
    hand.key("Tab", "space")
    hand.wait(lambda: root.property("done"))
    hand.wheel(30, 500)
    hand.wait(lambda: view("Distance") != distance)


def test_labels_that_pop_up_later_hide_no_question(hand: Any, show: Any, grab: Any) -> None:
    root = show(
        """import RosRviz 1.0
        Item { id: top; property bool both: label.opened
            MessageDialog { visible: true; padding: 0
                contentItem: Rectangle { implicitWidth: 300; implicitHeight: 150; color: "lime" } }
            AnchoredPopup { id: label; padding: 0; x: top.width / 2 - 10; y: top.height / 2 - 10
                contentItem: Rectangle { implicitWidth: 20; implicitHeight: 20; color: "red" } }
            Timer { running: true; interval: 500; onTriggered: label.open() } }"""
    )
    hand.wait(lambda: root.property("both"))
    picture = grab()
    assert picture.pixelColor(picture.width() // 2, picture.height() // 2).name() == "#00ff00"


def test_popup_follows_a_moving_frame(hand: Any, app: Any, master: str, caplog: Any) -> None:
    import rosglass
    from rosglass.comm import Time
    from rosglass.rviz.camera import RvizCamera
    from rosglass.rviz.popup import Popup

    app.fixed_frame = "map"
    app.connect()
    popup = app.add(Popup(label(), "Robot"))
    popup.follow(app.rviz.trackers, (0, 0, 0), frame="popup_test")
    with closing(rosglass.connect(master.replace("http:", "ros1:"), name="popup_test")) as node:
        publisher = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage", 10)
        for x in (0.0, 1.0, 2.0):

            def there(x: float = x) -> bool:
                header = {"frame_id": "map", "stamp": Time.now()}
                place = {"translation": {"x": x}, "rotation": {"w": 1.0}}
                frame = {"header": header, "child_frame_id": "popup_test", "transform": place}
                publisher.publish(transforms=[frame])
                seen = RvizCamera(app.window).project((x, 0, 0))
                at = popup.content.geometry().center()
                near = abs(at.x() - seen.x) < 3 and abs(at.y() - seen.y) < 3
                return near and popup.content.isVisible()

            hand.wait(there)
            assert popup.problem == ""
        live = there_is_grey(popup)
    # The robot is gone, and its transforms stay as they were.
    hand.wait(lambda: popup.problem == "the frame 'popup_test' was not updated for 3 s")
    assert popup.content.isVisible()
    assert (live, there_is_grey(popup)) == (False, True)
    hand.wait.frames(3)
    assert caplog.text.count("popup Robot: the frame 'popup_test' was not") == 1
    # It can be operated all the same.
    clicked: list[str] = []
    popup.content.clicked.connect(lambda *_: clicked.append(popup.name))
    at = popup.content.geometry().center()
    hand.click(at.x(), at.y())
    assert clicked == ["Robot"]
    popup.move(50, 50)
    assert (popup.problem, there_is_grey(popup)) == ("", False)


def test_modal_popup_is_seen_wherever_its_point_is(hand: Any, app: Any) -> None:
    from rosglass.rviz.camera import RvizCamera
    from rosglass.rviz.popup import Popup

    popup = app.add(Popup(label(), "Question", modal=True))
    x, y, z = RvizCamera(app.window).eye
    popup.follow(app.rviz.trackers, (2 * x, 2 * y, 2 * z))
    hand.wait.frames(3)
    assert popup.content.isVisible()
    assert (popup.content.geometry().center() - popup.root.rect().center()).manhattanLength() < 4


def test_popup_may_be_removed_by_its_own_button(hand: Any, app: Any, view: Any) -> None:
    from rosglass.rviz.popup import Popup

    below = app.add(Popup(label("below"), "Below", modal=True))
    above = app.add(Popup(label("above"), "Above", modal=True))
    below.move(200, 200)
    above.move(240, 230)
    clicked: list[str] = []
    for popup in (below, above):
        popup.content.clicked.connect(lambda *_, p=popup: (clicked.append(p.name), remove(p)))

    def remove(popup: Any) -> None:
        app.overlays.remove(popup)

    hand.wait.frames(3)
    assert app.overlays.input.focused is above
    # The lower one is covered, and gets its turn when the upper one has gone.
    hand.click(170, 180)
    assert clicked == []
    hand.click(240, 230)
    assert clicked == ["Above"]
    assert app.overlays.input.focused is below
    distance = view("Distance")
    hand.wheel(500, 400)
    assert view("Distance") == distance
    hand.click(240, 225)
    assert clicked == ["Above", "Below"]
    hand.wheel(500, 400)
    hand.wait(lambda: view("Distance") != distance)


def test_qml_popup_that_is_not_seen_takes_no_mouse(hand: Any, app: Any, show: Any) -> None:
    root = show(
        """import RosRviz 1.0
        Item { id: top; property var at: [0, 0, 0]; property int clicks: 0
            property real seen: popup.opacity
            AnchoredPopup { id: popup; visible: true; point: top.at; padding: 0
                contentItem: Button { implicitWidth: 80; implicitHeight: 60
                    onClicked: top.clicks++ } } }"""
    )
    from rosglass.rviz.camera import RvizCamera

    hand.wait(lambda: root.property("seen") == 1)
    seen = RvizCamera(app.window).project((0, 0, 0))
    hand.click(seen.x, seen.y)
    assert root.property("clicks") == 1
    x, y, z = RvizCamera(app.window).eye
    root.setProperty("at", [2 * x, 2 * y, 2 * z])
    hand.wait(lambda: root.property("seen") == 0)
    hand.click(seen.x, seen.y)
    assert root.property("clicks") == 1
    root.setProperty("at", [0, 0, 0])
    hand.wait(lambda: root.property("seen") == 1)
    hand.click(seen.x, seen.y)
    assert root.property("clicks") == 2


def test_qml_popup_is_half_seen_while_its_place_is_old(
    hand: Any, app: Any, show: Any, caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.comm import Time
    from rosglass.tf import Transform

    app.fixed_frame = "map"
    app.connect()
    hand.wait(lambda: app.rviz.frames.buffer is not None)

    def tell() -> None:
        app.rviz.frames.buffer.set_transform(
            Transform(stamp=Time.now(), frame_id="map", child_frame_id="old_link")
        )

    tell()
    root = show(
        """import RosRviz 1.0
        Item { id: top; property int clicks: 0
            property real seen: popup.opacity; property string problem: popup.problem
            AnchoredPopup { id: popup; visible: true; point: [0, 0, 0]; frame: "old_link"
                contentItem: Button { implicitWidth: 80; implicitHeight: 60
                    onClicked: top.clicks++ } } }"""
    )
    from rosglass.rviz.camera import RvizCamera

    hand.wait(lambda: root.property("seen") == 1)
    hand.wait(lambda: root.property("seen") == 0.5)
    assert root.property("problem") == "the frame 'old_link' was not updated for 3 s"
    assert caplog.text.count("AnchoredPopup: the frame 'old_link' was not") == 1
    # It can be operated all the same.
    seen = RvizCamera(app.window).project((0, 0, 0))
    hand.click(seen.x, seen.y)
    assert root.property("clicks") == 1
    tell()
    hand.wait(lambda: root.property("seen") == 1)
    assert root.property("problem") == ""


def test_qml_popup_with_a_wrong_point_names_the_users_file(
    hand: Any, show: Any, caplog: pytest.LogCaptureFixture
) -> None:
    root = show(
        """import RosRviz 1.0
        Item { property string problem: popup.problem; property real seen: popup.opacity
            AnchoredPopup { id: popup; visible: true; point: ["a", 2] } }"""
    )
    hand.wait(lambda: "expected x, y and z in metres" in root.property("problem"))
    assert root.property("seen") == 0
    errors = [r for r in caplog.records if "expected x, y and z" in r.getMessage()]
    assert len(errors) == 1
    assert "AnchoredPopup: " in errors[0].getMessage()
    assert "Test.qml" in caplog.text
    assert "AnchoredPopup.qml" not in caplog.text
