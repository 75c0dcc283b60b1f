"""The form of a panel's properties."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass
from rosglass.cockpit import panels

if TYPE_CHECKING:
    from collections.abc import Callable

FORM = Path(rosglass.__file__).parent / "cockpit/PropertyForm.qml"
BATTERY = "sensor_msgs/msg/BatteryState"


class Form:
    """A property form in a window, on a robot made of memory."""

    def __init__(self, running: Any, wait: Any) -> None:
        from rosglass.cockpit.property_form import PropertyModel
        from rosglass.controls import register
        from rosglass.qml.engine.runtime import runtime_of

        register()
        self.bench, self.wait, self.robot = running, wait, running.robot
        body = (
            "Window { width: 420; height: 900; visible: true; color: Theme.background\n"
            "id: top; property QtObject model: null\n"
            "PropertyForm { anchors.fill: parent; model: top.model } }"
        )
        self.window: Any = running.load(
            body,
            "import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport RosControls 1.0\n"
            f'import "{FORM.parent.as_uri()}"',
        )
        self.model = PropertyModel(self.window, runtime_of(self.window))
        self.edits: list[tuple[str, str]] = []
        self.model.edited.connect(lambda name, expression: self.edits.append((name, expression)))
        self.window.setProperty("model", self.model)
        wait(self.window.isExposed)
        wait(lambda: self.model.node is not None)

    def show(self, name: str, **values: str) -> None:
        self.model.show(panels.find(name), values)

    def row(self, name: str) -> dict[str, Any]:
        """Return the roles of a property."""
        model = self.model.property("rows")
        names = {role: bytes(text).decode() for role, text in model.roleNames().items()}
        at = model.keys.index(name)
        return {text: model.data(model.index(at, 0), role) for role, text in names.items()}

    def find(self, name: str, within: str = "") -> Any:
        """Return an item by its ``objectName``, once there is one."""

        def look(item: Any) -> Any:
            if item.objectName() == name:
                return item
            return next((one for one in map(look, item.childItems()) if one is not None), None)

        item = self.find(within) if within else self.window.contentItem()
        self.wait(lambda: look(item) is not None, f"an item {name!r}")
        return look(item)

    def press(self, key: str, text: str = "") -> None:
        from rosglass.qt import QtCore, QtGui

        kinds, qt = QtCore.QEvent.Type, QtCore.Qt
        for kind in (kinds.KeyPress, kinds.KeyRelease):
            event = QtGui.QKeyEvent(
                kind, getattr(qt.Key, f"Key_{key}"), qt.KeyboardModifier.NoModifier, text
            )
            QtCore.QCoreApplication.sendEvent(self.window, event)


@pytest.fixture
def form(running: Any, wait: Callable[..., None]) -> Form:
    return Form(running, wait)


def test_properties_are_shown_with_their_defaults_and_meanings(form: Form) -> None:
    form.show("Battery", low="0.4")
    low, empty = form.row("low"), form.row("empty")
    assert (low["text"], low["isSet"], low["fallback"]) == ("0.4", True, "0.3")
    assert (empty["text"], empty["isSet"], empty["low"], empty["high"]) == ("0.15", False, 0, 1)
    assert form.model.property("title") == "Battery"
    form.wait(lambda: form.find("detail", "property_low").property("text").endswith("default: 0.3"))
    assert "0 … 1" in form.find("detail", "property_low").property("text")


@pytest.mark.parametrize(
    ("panel", "name", "text", "expression"),
    [
        ("Battery", "low", "0.5", "0.5"),
        ("CameraView", "timeout", "800 ms", "800"),
        ("Gauge", "warnAbove", "nan", "NaN"),
        ("Attitude", "convention", "NED", '"NED"'),
        ("CameraView", "imageRotation", "90", "90"),
        ("Battery", "topic", "battery", '"battery"'),
        ("ModeSwitch", "service", "set_%1", '"set_%1"'),
        ("Gauge", "path", "/odom:twist.twist.linear.x", '"/odom:twist.twist.linear.x"'),
        ("Battery", "title", 'a "b"\\', r'"a \"b\"\\"'),
        ("SceneView", "background", "#102030", '"#102030"'),
        ("SceneView", "background", "Theme.panel", "Theme.panel"),
        ("MapView", "robotFrame", "base_footprint", '"base_footprint"'),
        ("Plot", "paths", '["/a:b"]', '["/a:b"]'),
        ("DriveStick", "command", "command", "command"),
    ],
)
def test_entered_text_becomes_an_expression(
    form: Form, panel: str, name: str, text: str, expression: str
) -> None:
    form.show(panel)
    assert form.model.setText(name, text), form.row(name)["problem"]
    assert form.edits == [(name, expression)]


@pytest.mark.parametrize(
    ("panel", "name", "text", "reason"),
    [
        ("Battery", "low", "full", "expected a number, got 'full'"),
        ("Battery", "low", "1.5", "1.5 is more than 1"),
        ("CameraView", "timeout", "1.5", "expected a whole number"),
        ("CameraView", "timeout", "99999999999", "does not fit"),
        ("CameraView", "imageRotation", "45", "expected one of 0, 90, 180, 270"),
        ("Attitude", "convention", "XYZ", "expected one of ENU, NED"),
        ("Battery", "topic", "/a b", "' '"),
        ("Battery", "topic", 'x" + evil() + "', "contains"),
        ("Gauge", "path", "/odom", "expected topic:field"),
        ("SceneView", "background", "reddish", "is not a colour"),
        ("MapView", "robotFrame", "/base link", "is not the name of a frame"),
        ("Plot", "paths", "/a:b", "expected a list"),
        ("Plot", "paths", "[evil()]", "expected a list"),
        ("ServiceButton", "request", "evil()", "write expressions in the file"),
        ("Battery", "title", "x" * 30_000, "too many"),
    ],
)
def test_misfits_are_refused_at_their_field(
    form: Form, panel: str, name: str, text: str, reason: str
) -> None:
    form.show(panel)
    assert not form.model.setText(name, text)
    assert reason in form.row(name)["problem"]
    assert form.edits == []
    assert form.model.setText(name, "") is (form.row(name)["problem"] == "")


def test_a_binding_is_kept_until_its_replacement_is_agreed_to(form: Form) -> None:
    form.show("Battery", topic='robots.current + "/battery"')
    row = form.row("topic")
    assert (row["isBound"], row["expression"]) == (True, 'robots.current + "/battery"')
    form.wait(lambda: form.find("bound").property("text").startswith("bound: robots.current"))
    assert not form.model.setText("topic", "/battery")
    form.model.reset("topic")
    assert form.edits == []
    form.find("replace").forceActiveFocus()
    form.press("Return")
    assert form.row("topic")["isReplacing"]
    assert form.model.setText("topic", "/battery")
    assert form.edits == [("topic", '"/battery"')]


def test_a_translated_text_stays_translated(form: Form) -> None:
    form.show("Battery", title='qsTr("Akku")')
    assert form.row("title")["text"] == "Akku"
    form.model.setText("title", "Batterie")
    assert form.edits == [("title", 'qsTr("Batterie")')]


def test_a_reset_removes_the_property(form: Form) -> None:
    form.show("Battery", low="0.5")
    form.wait(lambda: form.find("reset", "property_low").isEnabled())
    form.find("reset", "property_low").forceActiveFocus()
    form.press("Return")
    assert form.edits == [("low", "")]


def test_a_value_is_typed_and_entered_by_the_keyboard(form: Form) -> None:
    form.show("Battery", low="0.5")
    form.wait(lambda: form.find("editor", "property_low").property("text") == "0.5")
    field = form.find("editor", "property_low")
    field.forceActiveFocus()
    field.setProperty("text", "7")
    form.press("Return")
    assert form.find("detail", "property_low").property("text").startswith("NOT CHANGED: 7 is more")
    form.press("Escape")
    assert field.property("text") == "0.5"
    field.setProperty("text", "0.25")
    form.press("Return")
    assert form.edits == [("low", "0.25")]
    form.show("Battery", low="0.25")
    assert form.row("low")["problem"] == ""


def test_search_forgives_typos(form: Form) -> None:
    form.show("CameraView")
    form.model.filter = "latancy"
    assert form.model.property("rows").keys[0] == "maxLatency"
    form.model.filter = ""
    assert form.model.property("count") == form.model.property("total")


def test_topics_of_the_right_type_come_first(form: Form) -> None:
    made = [form.robot.create_publisher("/a", "std_msgs/msg/String")]
    made.append(form.robot.create_publisher("/z/battery", BATTERY))
    form.show("Battery")
    form.wait(lambda: len(form.model.suggestions("topic", "")) >= 2)
    found = form.model.suggestions("topic", "")
    assert (found[0]["text"], found[0]["detail"], found[0]["suits"]) == (
        "/z/battery", "sensor_msgs/BatteryState", True,
    )  # fmt: skip
    assert found[1]["suits"] is False
    made.append(form.robot.create_publisher("/b/battery", BATTERY))
    form.wait(lambda: form.model.suggestions("topic", "")[0]["text"] == "/b/battery")
    assert [one["text"] for one in form.model.suggestions("topic", "baterry")] == [
        "/b/battery", "/z/battery",
    ]  # fmt: skip


def test_a_suggestion_is_taken_by_the_keyboard(form: Form) -> None:
    publisher = form.robot.create_publisher("/z/battery", BATTERY)
    form.show("Battery")
    form.wait(lambda: len(form.model.suggestions("topic", "z/bat")) == 1)
    field = form.find("editor", "property_topic")
    field.forceActiveFocus()
    form.press("Down")
    form.press("Return")
    assert form.edits == [("topic", '"/z/battery"')]
    publisher.close()


def test_2000_topics_are_bounded_in_a_list(form: Form) -> None:
    class Many:
        def topics(self) -> dict[str, list[str]]:
            return {f"/robot{at}/topic": ["std_msgs/msg/String"] for at in range(2000)}

    form.show("Battery")
    session = form.model._session
    form.model._session = type("Fake", (), {"node": Many()})()
    try:
        assert len(form.model.suggestions("topic", "")) == 50
        assert form.model.suggestions("topic", "robot1999")[0]["text"] == "/robot1999/topic"
    finally:
        form.model._session = session


def test_properties_of_every_panel_are_shown(form: Form) -> None:
    for panel in panels.controls():
        form.model.show(panel, {"unknown": "3 + x"})
        assert form.row("unknown")["expression"] == "3 + x"
        form.wait.signals(form.window.frameSwapped)
    form.model.show(None, {})
    assert form.model.property("total") == 0
