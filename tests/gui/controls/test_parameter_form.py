"""The control ParameterForm."""

from __future__ import annotations

from typing import Any

import pytest
from hands import click, key

from rosglass.comm.parameters import ParameterDescriptor, ParameterType, Range
from rosglass.qt import QtCore

pytestmark = pytest.mark.both_qt


@pytest.fixture
def robot(controls: Any, bench: Any) -> Any:
    node = bench.world.connect(None, "arm", own_services=True)
    parameters = node.parameters
    parameters.declare(
        "speed", 1.5, ParameterDescriptor(description="Highest speed", range=Range(0.0, 2.0, 0.5))
    )
    parameters.declare("serial", "A-7", ParameterDescriptor(read_only=True))
    parameters.declare("lights", False)
    parameters.declare("gains", [1.0, 2.0])
    parameters.declare("arm.count", 3)
    parameters.declare("mode", "slow", ParameterDescriptor(constraints="One of: ['slow', 'fast']."))
    return node


def row(controls: Any, name: str) -> Any:
    return controls.find(f"row_{name}")


def shown(controls: Any, name: str) -> str:
    return row(controls, name).property("text")


def show(controls: Any, wait: Any, more: str = "") -> Any:
    form = controls.show(
        f'ParameterForm {{ nodeName: "/arm"; anchors.fill: parent; {more} }}', 500, 500
    )
    wait(lambda: form.property("ready") and form.property("total") >= 6)
    wait(lambda: row(controls, "speed").property("value") == 1.5)
    return form


def test_text_being_entered_stays_when_a_parameter_appears(
    controls: Any, robot: Any, wait: Any
) -> None:
    show(controls, wait)
    field = controls.find("editor", row(controls, "gains"))
    field.forceActiveFocus()
    field.setProperty("text", "[3.0, ")
    robot.parameters.declare("depth", 7)
    wait(lambda: row_or_none(controls, "depth"))
    assert field.property("activeFocus")
    assert field.property("text") == "[3.0, "


def test_form_shows_all_parameters_with_their_editors(controls: Any, robot: Any, wait: Any) -> None:
    show(controls, wait)
    speed = row(controls, "speed")
    assert speed.property("ranged")
    slider = controls.find("editor", speed)
    assert (slider.property("from"), slider.property("to")) == (0, 2)
    assert slider.property("stepSize") == 0.5
    assert row(controls, "serial").property("locked")
    assert shown(controls, "gains") == "[1.0, 2.0]"
    assert shown(controls, "arm.count") == "3"
    assert controls.find("editor", row(controls, "mode")).property("count") == 2


def test_values_are_set(controls: Any, robot: Any, wait: Any) -> None:
    show(controls, wait)
    write_row(controls, "gains", "[0.5, 2, 3]")
    wait(lambda: robot.parameters.get("gains") == [0.5, 2.0, 3.0])
    write_row(controls, "arm.count", "-4")
    wait(lambda: robot.parameters.get("arm.count") == -4)
    controls.find("editor", row(controls, "lights")).forceActiveFocus()
    key(controls, "Space")
    wait(lambda: robot.parameters.get("lights") is True)
    controls.find("editor", row(controls, "speed")).forceActiveFocus()
    key(controls, "Right")
    wait(lambda: robot.parameters.get("speed") == 2.0)


def write_row(controls: Any, name: str, text: str) -> None:
    editor = controls.find("editor", row(controls, name))
    editor.forceActiveFocus()
    editor.setProperty("text", text)
    key(controls, "Return")


def test_refused_value_is_shown_with_the_reason(controls: Any, robot: Any, wait: Any) -> None:
    robot.parameters.on_set(lambda values: "<b>not now</b>" if "arm.count" in values else "")
    form = show(controls, wait)
    write_row(controls, "arm.count", "5")
    detail = controls.find("detail", row(controls, "arm.count"))
    wait(lambda: "REFUSED: " in detail.property("text"))
    assert "<b>not now</b>" in detail.property("text")
    assert shown(controls, "arm.count") == "3"
    write_row(controls, "arm.count", "many")
    wait(lambda: "'many' is not an integer" in detail.property("text"))
    form.setValue("speed", 99)
    wait(lambda: "REFUSED" in controls.find("detail", row(controls, "speed")).property("text"))
    assert robot.parameters.get("speed") == 1.5


def test_changes_are_undone(controls: Any, robot: Any, wait: Any) -> None:
    form = show(controls, wait)
    form.setValue("arm.count", 7)
    wait(lambda: form.property("undoText") == "arm.count: 3")
    form.setValue("speed", 1)
    wait(lambda: form.property("undoText") == "speed: 1.5")
    click(controls, "undo")
    wait(lambda: robot.parameters.get("speed") == 1.5)
    wait(lambda: form.property("undoText") == "arm.count: 3")
    # Another client has changed it since.
    robot.parameters.set({"arm.count": 8})
    wait(lambda: shown(controls, "arm.count") == "8")
    click(controls, "undo")
    detail = controls.find("detail", row(controls, "arm.count"))
    wait(lambda: "another client" in detail.property("text"))
    assert robot.parameters.get("arm.count") == 8


def test_changes_of_others_are_shown_but_not_under_the_hands(
    controls: Any, robot: Any, wait: Any
) -> None:
    show(controls, wait)
    editor = controls.find("editor", row(controls, "gains"))
    editor.forceActiveFocus()
    editor.setProperty("text", "[9")
    robot.parameters.set({"gains": [4.0], "arm.count": 12})
    wait(lambda: shown(controls, "gains") == "[4.0]")
    assert editor.property("text") == "[9"
    wait(lambda: shown(controls, "arm.count") == "12")
    assert "another client" in controls.find("detail", row(controls, "arm.count")).property("text")
    key(controls, "Escape")
    assert editor.property("text") == "[4.0]"


def test_node_that_appears_later_and_leaves(controls: Any, wait: Any, bench: Any) -> None:
    form = controls.show('ParameterForm { nodeName: "/arm" }')
    assert form.property("status") == "waiting for /arm"
    arm = bench.world.connect(None, "arm", own_services=True)
    arm.parameters.declare("reach", 2)
    wait(lambda: form.property("ready"))
    wait(lambda: form.property("total") >= 1)
    arm.parameters.declare("grip", ParameterType.BOOL and True)
    wait(lambda: row_or_none(controls, "grip"))
    arm.close()
    wait(lambda: not form.property("ready"))
    assert form.property("stale")


def row_or_none(controls: Any, name: str) -> Any:
    try:
        return row(controls, name)
    except AssertionError:
        return None


def test_search_and_choice_of_a_node(controls: Any, robot: Any, wait: Any) -> None:
    form = controls.show("ParameterForm { anchors.fill: parent }", 500, 500)
    picker = controls.find("picker")
    wait(lambda: picker.property("count") == 2)
    form.setProperty("picked_", "/arm")
    wait(lambda: form.property("ready"))
    controls.find("search").setProperty("text", "ARM")
    wait(lambda: controls.find("list").property("count") == 1)
    wait(lambda: row_or_none(controls, "arm.count"))
    assert shown(controls, "arm.count") == "3"


def test_parameters_over_a_real_middleware(live_controls: Any, url: str, wait: Any) -> None:
    robot = live_controls.robot
    robot.parameters.declare("speed", 1.5)
    robot.parameters.declare("label", "x")
    form = live_controls.show(
        'ParameterForm { nodeName: "/robot"; anchors.fill: parent }', 500, 500
    )
    wait(lambda: form.property("ready") and row_or_none(live_controls, "speed"))
    form.setValue("speed", 1)
    wait(lambda: robot.parameters.get("speed") == 1.0)
    write_row(live_controls, "label", "left")
    wait(lambda: robot.parameters.get("label") == "left")
    robot.parameters.set({"speed": 0.25})
    wait(lambda: shown(live_controls, "speed") == "0.25")
    if url.startswith("ros1"):
        whole = live_controls.show(
            'ParameterForm { nodeName: "/"; anchors.fill: parent }', 500, 500
        )
        wait(lambda: whole.property("ready"))
        assert row_or_none(live_controls, "robot/speed") is not None


def test_ranges_are_given_where_the_node_has_none(controls: Any, robot: Any, wait: Any) -> None:
    show(controls, wait, 'ranges: ({"arm.count": [1, 9], speed: [0, 99]})')
    slider = controls.find("editor", row(controls, "arm.count"))
    assert (slider.property("from"), slider.property("to")) == (1, 9)
    speed = controls.find("editor", row(controls, "speed"))
    assert speed.property("to") == 2, "the node's own range counts"


def test_names_are_above_the_values_in_a_narrow_form(controls: Any, robot: Any, wait: Any) -> None:
    show(controls, wait)
    wide, slider = row(controls, "speed"), controls.find("editor", row(controls, "speed"))
    assert slider.mapToItem(wide, QtCore.QPointF()).y() == 0
    controls.window.setWidth(230)
    wait(lambda: slider.mapToItem(wide, QtCore.QPointF()).y() > 10)
    assert slider.width() > 100
    assert slider.mapToItem(wide, QtCore.QPointF()).y() + slider.height() < wide.height()
