"""The control NodeGraph."""

from __future__ import annotations

from typing import Any

import pytest
from hands import clipboard, key

STRING = "std_msgs/msg/String"
pytestmark = pytest.mark.both_qt


def graph(controls: Any) -> Any:
    """Return the GraphLayout of the control."""
    from rosglass.controls.lists.graph_layout import GraphLayout

    return controls.window.findChildren(GraphLayout)[0]


def items(controls: Any, *roles: str) -> dict[str, Any]:
    model = graph(controls).property("items")
    return {
        model.value(row, "key"): tuple(model.value(row, role) for role in roles)
        for row in range(model.rowCount())
    }


def test_nodes_and_topics_are_laid_out_from_left_to_right(controls: Any, wait: Any) -> None:
    viewer = controls.bench.world.connect(None, "viewer")
    controls.robot.create_publisher("/image", STRING)
    viewer.create_subscription("/image", STRING)
    controls.show("NodeGraph {}")
    wait(lambda: "topic /image" in items(controls))
    found = items(controls, "column", "isNode", "detail")
    assert [found[key][0] for key in ("node /robot", "topic /image", "node /viewer")] == [0, 1, 2]
    assert found["topic /image"][2] == f"{STRING}: from /robot to /viewer"
    assert not [key for key in found if "rosout" in key or "parameter_events" in key]
    assert graph(controls).property("segments").rowCount() == 2


def test_nodes_are_connected_directly_without_topics(controls: Any, wait: Any) -> None:
    viewer = controls.bench.world.connect(None, "viewer")
    controls.robot.create_publisher("/image", STRING)
    viewer.create_subscription("/image", STRING)
    controls.show("NodeGraph { showTopics: false }")
    wait(lambda: graph(controls).property("segments").rowCount() == 1)
    assert set(items(controls)) == {"node /robot", "node /ui", "node /viewer"}


def test_a_filter_keeps_what_is_connected(controls: Any, wait: Any) -> None:
    for name in ("/a", "/b", "/c"):
        controls.robot.create_publisher(name, STRING)
    view = controls.show("NodeGraph {}")
    wait(lambda: "topic /c" in items(controls))
    view.setProperty("filter", "/B")
    wait(lambda: set(items(controls)) == {"node /robot", "topic /b"})
    view.setProperty("filter", "nothing")
    wait(lambda: not items(controls))


def test_keys_select_zoom_and_copy(controls: Any, wait: Any) -> None:
    controls.robot.create_publisher("/image", STRING)
    view = controls.show('NodeGraph { filter: "image" }')
    wait(lambda: len(items(controls)) == 2)
    controls.find("area").forceActiveFocus()
    key(controls, "Right")
    assert view.property("selected") == "/robot"
    key(controls, "Right")
    assert view.property("selected") == "/image"
    assert "from /robot to no subscriber" in controls.find("detail").property("text")
    key(controls, "C", control=True)
    assert clipboard() == "/image"
    before = controls.find("canvas").scale()
    key(controls, "Minus")
    assert controls.find("canvas").scale() == pytest.approx(0.8 * before)
    key(controls, "0")
    assert controls.find("canvas").scale() == before
    key(controls, "Escape")
    assert view.property("selected") == ""


def test_conflicts_are_in_words(controls: Any, wait: Any) -> None:
    from rosglass.comm import QoS

    viewer = controls.bench.world.connect(None, "viewer")
    controls.robot.create_publisher("/image", STRING, QoS.sensor_data())
    viewer.create_subscription("/image", STRING, qos=QoS())
    controls.show("NodeGraph {}")
    wait(lambda: "best effort offered" in items(controls, "conflict").get("topic /image", ("",))[0])


def test_a_hundred_nodes(controls: Any, wait: Any) -> None:
    world = controls.bench.world
    nodes = [world.connect(None, f"n{number}") for number in range(100)]
    for number, node in enumerate(nodes):
        node.create_publisher(f"/t{number}", STRING)
        for other in (number * 7 + 1, number * 3 + 2):
            node.create_subscription(f"/t{other % 100}", STRING)
    view = controls.show("NodeGraph {}")
    wait(lambda: len(items(controls)) >= 200, timeout=60)
    assert graph(controls).property("omitted") == 0
    assert 0 < controls.find("canvas").scale() < 1
    assert view.property("status") == ""


def test_too_many_are_counted(controls: Any, wait: Any) -> None:
    made = [controls.robot.create_publisher(f"/t{number}", STRING) for number in range(450)]
    view = controls.show("NodeGraph {}")
    wait(lambda: graph(controls).property("omitted") > 0)
    assert len(items(controls)) == 400
    assert "not shown: enter a filter" in view.property("note")
    assert len(made) == 450
