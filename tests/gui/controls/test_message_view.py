"""The control MessageView."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hands import clipboard, drag, key
from rows import tree_rows

SCAN, POSE = "sensor_msgs/msg/LaserScan", "geometry_msgs/msg/PoseStamped"
pytestmark = pytest.mark.both_qt


def show(controls: Any, wait: Any, topic: str, kind: str, **fields: Any) -> tuple[Any, Any]:
    """Show a message; return the view and the publisher."""
    publisher = controls.robot.create_publisher(topic, kind)
    view = controls.show(f'MessageView {{ topic: "{topic}"; editable: true }}')
    wait(publisher.subscription_count)
    publisher.publish(**fields)
    wait(lambda: tree_rows(controls, "key"))
    return view, publisher


def unfold(controls: Any, *keys: str) -> None:
    for one in keys:
        controls.find("tree").toggled.emit(one)


def push(controls: Any, button: str) -> None:
    """Push a button by the keyboard."""
    controls.find(button).forceActiveFocus()
    key(controls, "Return")


def test_fields_with_values_units_and_paths(controls: Any, wait: Any) -> None:
    view, publisher = show(controls, wait, "/scan", SCAN, range_max=30.5, ranges=[0.1, 2, math.nan])
    found = {row[0]: row[1:] for row in tree_rows(controls, "key", "value", "unit", "path", "type")}
    assert found["range_max"] == ("30.5", "m", "/scan:range_max", "float32")
    assert found["ranges"] == ("0.1, 2, nan", "m", "/scan:ranges[*]", "float32[]")
    assert found["header"][1:] == ("", "", "std_msgs/msg/Header")
    unfold(controls, "ranges", "header")
    found = dict(tree_rows(controls, "key", "value"))
    assert found["ranges[1]"] == "2"
    assert found["header.stamp"] == "0.000000000 s"
    publisher.publish(range_max=12, ranges=[7])
    wait(lambda: "ranges[1]" not in dict(tree_rows(controls, "key", "value")))
    assert dict(tree_rows(controls, "key", "value"))["ranges[0]"] == "7"
    assert view.property("type") == SCAN


def test_long_arrays_are_counted_and_every_element_is_reached(controls: Any, wait: Any) -> None:
    show(controls, wait, "/scan", SCAN, ranges=[float(number) for number in range(25_000)])
    assert dict(tree_rows(controls, "key", "value"))["ranges"] == "0, 1, 2, 3 and 24,996 more"
    unfold(controls, "ranges")
    assert [one for one in tree_rows(controls, "key") if one.startswith("ranges[")] == [
        "ranges[0:10000]", "ranges[10000:20000]", "ranges[20000:25000]",
    ]  # fmt: skip
    unfold(controls, "ranges[20000:25000]", "ranges[24900:25000]")
    assert dict(tree_rows(controls, "key", "value"))["ranges[24999]"] == "24999"
    assert len(tree_rows(controls, "key")) < 200


def test_text_with_the_mark_of_another_value_is_read_out_as_it_is(controls: Any, wait: Any) -> None:
    show(controls, wait, "/text", "std_msgs/msg/String", data="%3 and %2")
    row = controls.find("rows").property("currentItem")
    assert row.property("label").strip() == "data: %3 and %2"


def test_hostile_texts_stay_in_one_line(controls: Any, wait: Any) -> None:
    show(controls, wait, "/text", "std_msgs/msg/String", data="<b>a</b>\n\x1b" + "x" * 100_000)
    value = tree_rows(controls, "value")[0]
    assert value.startswith("<b>a</b> ⏎ \\u001b")
    assert value.endswith("xxx… (100010 characters)")


def test_the_path_of_a_field_is_copied(controls: Any, wait: Any) -> None:
    view, _ = show(controls, wait, "/pose", POSE)
    unfold(controls, "pose", "pose.position")
    controls.find("rows").forceActiveFocus()
    key(controls, *["Down"] * 3)
    assert view.property("path") == "/pose:pose.position.x"
    key(controls, "C", control=True)
    assert clipboard() == "/pose:pose.position.x"
    key(controls, "Left")
    assert view.property("path") == ""


def test_a_number_is_dragged_onto_a_plot(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/x", "std_msgs/msg/Float64")
    controls.show(
        """Item { anchors.fill: parent
            MessageView { topic: "/x"; width: parent.width; height: 150 }
            Plot { objectName: "plot"; y: 160; width: parent.width; height: 140 }
        }"""
    )
    wait(publisher.subscription_count)
    publisher.publish(data=1.5)
    wait(lambda: tree_rows(controls, "key") == ["data"])
    wait.signals(controls.window.frameSwapped)
    drag(controls, controls.find("hand"), controls.find("plot"))
    wait(lambda: controls.find("plot").property("paths").toVariant() == ["/x:data"])
    # Back in its row.
    wait(lambda: controls.find("dragged", controls.find("tree")).x() == 0)


@pytest.mark.parametrize("control", ["Gauge", "Lamp"])
def test_a_number_is_dragged_onto_a_control_of_one_value(
    controls: Any, wait: Any, control: str
) -> None:
    publisher = controls.robot.create_publisher("/scan", SCAN)
    controls.show(
        """Item { anchors.fill: parent
            MessageView { topic: "/scan"; width: parent.width; height: 400 }
            CONTROL { objectName: "control"; y: 410; width: parent.width; height: 140 }
        }""".replace("CONTROL", control),
        height=560,
    )
    wait(publisher.subscription_count)
    publisher.publish(range_max=30.5, ranges=[7.5])
    wait(lambda: "ranges" in tree_rows(controls, "key"))
    shown = controls.find("control")
    for field, path, value in (
        ("range_max", "/scan:range_max", 30.5),
        ("ranges", "/scan:ranges[0]", 7.5),
    ):
        line = controls.find("rows").property("contentItem")
        wait.signals(controls.window.frameSwapped)
        hands = [one for one in _items(line, "hand") if one.parentItem().isVisible()]
        numbers = [at for at, found in enumerate(tree_rows(controls, "path")) if found]
        assert len(hands) == len(numbers)
        hands.sort(key=lambda hand: hand.mapToScene(hand.position()).y())
        drag(controls, hands[numbers.index(tree_rows(controls, "key").index(field))], shown)
        wait(lambda path=path: shown.property("path") == path)
        wait(lambda: publisher.subscription_count() == 2)
        publisher.publish(range_max=30.5, ranges=[7.5])
        wait(lambda value=value: shown.property("value") == value)


def _items(item: Any, name: str) -> list[Any]:
    found = [item] if item.objectName() == name else []
    return [*found, *(one for child in item.childItems() for one in _items(child, name))]


def test_an_edited_message_is_published(controls: Any, wait: Any) -> None:
    view, _ = show(controls, wait, "/pose", POSE, pose={"position": {"x": 1.0}})
    received: list[Any] = []
    controls.robot.create_subscription("/pose", POSE, received.append)
    push(controls, "edit")
    assert view.property("editing")
    unfold(controls, "pose", "pose.position")
    controls.find("rows").forceActiveFocus()
    key(controls, *["Down"] * 3)
    key(controls, "Return")
    field = controls.find("value")
    assert field.property("text") == "1.0"
    field.setProperty("text", "fast")
    key(controls, "Return")
    assert "expected a number" in controls.find("refusal").property("text")
    field.setProperty("text", "-2.5")
    key(controls, "Return")
    assert dict(tree_rows(controls, "key", "value"))["pose.position.x"] == "-2.5"
    push(controls, "publish")
    wait(lambda: any(one.pose.position.x == -2.5 for one in received))
    push(controls, "publish")
    wait(lambda: controls.find("refusal").property("text").startswith("Sent to "))
    push(controls, "cancel")
    assert not view.property("editing")


def test_received_messages_do_not_disturb_editing(controls: Any, wait: Any) -> None:
    view, publisher = show(controls, wait, "/pose", POSE, pose={"position": {"x": 1.0}})
    push(controls, "edit")
    unfold(controls, "pose", "pose.position")
    for _ in range(5):
        publisher.publish(pose={"position": {"x": 9.0}})
    wait.settled(controls.bench.session)
    assert dict(tree_rows(controls, "key", "value"))["pose.position.x"] == "1.0"
    view.setProperty("topic", "/other")
    wait(lambda: not view.property("editing"))
    assert tree_rows(controls, "key") == []


def test_edited_number_of_float32_is_shown(controls: Any, wait: Any) -> None:
    show(controls, wait, "/scan", SCAN, range_max=30.5)
    push(controls, "edit")
    controls.find("tree").activated.emit("range_max")
    field = controls.find("value")
    field.setProperty("text", "24.1")
    key(controls, "Return")
    assert dict(tree_rows(controls, "key", "value"))["range_max"] == "24.1"


@pytest.mark.parametrize(
    "text", ["x" * 1000, "two\nlines", "y" * 30_000], ids=["long", "lines", "huge"]
)
def test_a_text_is_published_whole_after_it_was_edited(controls: Any, wait: Any, text: str) -> None:
    got: list[str] = []
    _, _publisher = show(controls, wait, "/text", "std_msgs/msg/String", data=text)
    controls.robot.create_subscription(
        "/text", "std_msgs/msg/String", lambda message: got.append(message.data)
    )
    push(controls, "edit")
    controls.find("tree").forceActiveFocus()
    key(controls, "Home", "Return", "Return")
    push(controls, "publish")
    wait(lambda: got)
    assert got[-1] == text


def test_nothing_can_be_edited_by_default(controls: Any, wait: Any) -> None:
    controls.show('MessageView { topic: "/pose" }')
    assert not controls.find("edit").isVisible()


def test_without_a_topic_nothing_is_wrong(controls: Any) -> None:
    view = controls.show("MessageView {}")
    assert view.property("status") == ""
    assert controls.find("heading").property("text") == "No topic is selected."
