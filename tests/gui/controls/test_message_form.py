"""The control MessageForm, and its element MessageFields."""

from __future__ import annotations

import json
import os
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import pytest
from hands import click, key, write

from rosglass.controls.lists.message_store import run_later

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.both_qt
POSE, BATTERY = "geometry_msgs/msg/PoseStamped", "sensor_msgs/msg/BatteryState"
JOINTS, IMAGE = "trajectory_msgs/msg/JointTrajectory", "sensor_msgs/msg/CameraInfo"


@pytest.fixture(autouse=True)
def state(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The folder of the kept messages."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state/rosglass/messages"


class Form:
    """A form in a window."""

    def __init__(self, controls: Any, wait: Any) -> None:
        self.controls, self.wait = controls, wait

    def show(self, kind: str) -> Any:
        self.item = self.controls.show(f'MessageForm {{ type: "{kind}"; anchors.fill: parent }}')
        self.model = self.item.property("messageFields")
        self.wait(lambda: self.model.property("ready"))
        return self.model

    def rows(self, *roles: str) -> list[Any]:
        model = self.model.property("rows")
        found = [[model.value(row, role) for role in roles] for row in range(model.rowCount())]
        return [one[0] for one in found] if len(roles) == 1 else [tuple(one) for one in found]

    def row(self, name: str, role: str) -> Any:
        return dict(self.rows("key", role))[name]

    def fields(self) -> Any:
        """Return the message as it is sent."""
        found = self.model.message()
        return None if found.isUndefined() else found.toVariant()


@pytest.fixture
def form(controls: Any, wait: Any) -> Form:
    return Form(controls, wait)


def test_all_fields_of_a_short_type_are_unfolded(form: Form) -> None:
    form.show(POSE)
    assert form.rows("key") == [
        "header", "header.stamp", "header.frame_id", "pose", "pose.position", "pose.position.x",
        "pose.position.y", "pose.position.z", "pose.orientation", "pose.orientation.x",
        "pose.orientation.y", "pose.orientation.z", "pose.orientation.w",
    ]  # fmt: skip
    assert form.row("pose.orientation.w", "text") == "1.0"
    form.model.toggle("pose")
    assert form.rows("key")[-1] == "pose"


def test_entered_values_are_in_the_message(form: Form, controls: Any) -> None:
    form.show(POSE)
    form.wait(lambda: controls.find("field_pose.position.x").isVisible())
    write(controls, "field_pose.position.x", "-2.5")
    write(controls, "field_header.frame_id", "map")
    sent = form.fields()
    assert (sent["pose"]["position"]["x"], sent["header"]["frame_id"]) == (-2.5, "map")


def test_a_misfit_is_said_at_its_field_and_there_is_no_message(form: Form, controls: Any) -> None:
    form.show(POSE)
    form.wait(lambda: controls.find("field_pose.position.x").isVisible())
    write(controls, "field_pose.position.x", "fast")
    assert not form.item.property("valid")
    assert form.fields() is None
    said = "pose.position.x: expected a number (float64), got 'fast'"
    assert form.row("pose.position.x", "problem") == said
    assert controls.find("detail_pose.position.x").property("text") == said
    assert controls.find("field_pose.position.x").property("text") == "fast"
    write(controls, "field_pose.position.x", "3")
    assert form.fields()["pose"]["position"]["x"] == 3


@pytest.mark.parametrize("text", ["24.1", "1e-30", "0.3333333", "3.4e+38", "inf", "nan", "-0.0"])
def test_numbers_of_float32_are_shown_as_entered(form: Form, text: str) -> None:
    form.show("std_msgs/msg/Float32")
    assert form.model.setText("data", text)
    shown = form.row("data", "text")
    assert shown == text or float(shown) == pytest.approx(float(text), rel=1e-7)


@pytest.mark.parametrize(
    ("kind", "field", "text", "expected"),
    [
        ("std_msgs/msg/UInt8", "data", "256", "data: expected"),
        ("std_msgs/msg/UInt8", "data", "1.5", "a whole number (uint8)"),
        ("std_msgs/msg/Bool", "data", "maybe", "true or false"),
        ("std_msgs/msg/Header", "stamp", "soon", 'seconds, such as 1.5, or "now"'),
        ("std_msgs/msg/Header", "stamp", "-1", "seconds"),
        ("std_msgs/msg/Header", "stamp", "9" * 40, "seconds"),
    ],
)
def test_conversion_is_strict(form: Form, kind: str, field: str, text: str, expected: str) -> None:
    form.show(kind)
    assert not form.model.setText(field, text)
    assert expected in form.row(field, "problem")


def test_constants_are_choices_and_can_be_entered_by_name(form: Form, controls: Any) -> None:
    form.show(BATTERY)
    name = "power_supply_status"
    assert {"text": "POWER_SUPPLY_STATUS_FULL", "value": "4", "comment": ""} in form.row(
        name, "choices"
    )
    assert form.model.setText(name, "POWER_SUPPLY_STATUS_FULL")
    assert form.fields()[name] == 4
    form.wait(
        lambda: controls.find(f"detail_{name}").property("text").startswith("POWER_SUPPLY_STATUS_F")
    )


def test_units_and_comments_are_shown(form: Form) -> None:
    form.show("sensor_msgs/msg/LaserScan")
    assert form.row("angle_min", "unit") == "rad"
    assert "of the first range" in form.row("angle_min", "comment")


def test_elements_are_added_moved_and_removed(form: Form, controls: Any) -> None:
    form.show("geometry_msgs/msg/PoseArray")
    for _ in range(3):
        assert form.model.insert("poses")
    form.model.toggle("poses[0]")
    form.model.toggle("poses[0].position")
    assert form.model.setText("poses[0].position.x", "1")
    assert form.model.move("poses[0]", 1)
    assert [one["position"]["x"] for one in form.fields()["poses"]] == [0, 1, 0]
    assert form.model.move("poses[1]", 1)
    assert not form.model.move("poses[2]", 1)
    assert form.model.remove("poses[0]")
    assert [one["position"]["x"] for one in form.fields()["poses"]] == [0, 1]
    form.wait(lambda: controls.find("insert_poses").isVisible())
    controls.find("insert_poses").forceActiveFocus()
    key(controls, "Return")
    assert len(form.fields()["poses"]) == 3


def test_arrays_of_numbers_and_texts(form: Form) -> None:
    form.show(JOINTS)
    assert form.model.insert("joint_names")
    assert form.model.setText("joint_names[0]", "arm")
    assert form.model.insert("points")
    form.model.toggle("points[0]")
    assert form.model.insert("points[0].positions")
    assert form.model.setText("points[0].positions[0]", "0.5")
    assert form.model.setText("points[0].time_from_start", "1.25")
    sent = form.fields()
    assert sent["joint_names"] == ["arm"]
    assert sent["points"][0]["positions"] == [0.5]
    assert sent["points"][0]["time_from_start"] == {"sec": 1, "nanosec": 250000000}


def test_fixed_and_bounded_arrays_keep_their_length(form: Form, tmp_path: Path) -> None:
    form.show(IMAGE)
    assert not form.model.insert("k")
    form.model.toggle("k")
    assert form.model.setText("k[4]", "2")
    assert not form.model.remove("k[4]")
    assert not form.model.insert("k[4]")
    assert list(form.fields()["k"])[4] == 2
    form.show("shape_msgs/msg/SolidPrimitive")
    for _ in range(3):
        assert form.model.insert("dimensions")
    assert not form.model.insert("dimensions")


def test_now_is_the_time_of_sending(form: Form, controls: Any) -> None:
    form.show(POSE)
    form.wait(lambda: controls.find("now_header.stamp").isVisible())
    controls.find("now_header.stamp").forceActiveFocus()
    key(controls, "Return")
    assert form.row("header.stamp", "text") == "now"
    first = form.fields()["header"]["stamp"]
    assert first["sec"] > 1_600_000_000
    form.wait(lambda: form.fields()["header"]["stamp"] != first)
    assert json.loads(form.model.json())["header"]["stamp"] == "now"
    form.model.clear()
    assert form.row("header.stamp", "text") == "0"


def test_request_and_goal_are_filled_in(form: Form) -> None:
    form.show("std_srvs/srv/SetBool")
    assert form.rows("key") == ["data"]
    assert form.model.property("messageType") == "std_srvs/srv/SetBool_Request"
    form.show("example_interfaces/action/Fibonacci")
    assert form.rows("key") == ["order"]
    form.show("std_srvs/srv/Trigger")
    assert form.rows("key") == []
    assert form.fields() == {}


def test_another_type_replaces_the_fields(form: Form) -> None:
    form.show("std_msgs/msg/Bool")
    form.model.setText("data", "maybe")
    form.item.setProperty("type", POSE)
    form.wait(lambda: form.model.property("messageType") == POSE)
    assert form.item.property("valid")
    form.item.setProperty("type", "")
    form.wait(lambda: form.rows("key") == [])
    assert form.fields() is None


@pytest.mark.parametrize("kind", ["nowhere/msg/Nothing", "no type", "std_msgs/Bool/x/y"])
def test_unknown_type_is_named(form: Form, controls: Any, kind: str) -> None:
    item = controls.show(f'MessageForm {{ type: "{kind}"; anchors.fill: parent }}')
    form.wait(lambda: kind in item.property("problem"))
    assert not item.property("ready")


def test_history_and_favourites_survive_a_restart(form: Form, controls: Any, state: Path) -> None:
    form.show(POSE)
    form.model.setText("pose.position.x", "1")
    form.model.setText("header.stamp", "now")
    form.model.remember()
    form.wait(lambda: len(form.model.property("history")) == 1)
    form.model.setText("pose.position.x", "nan")
    form.model.addFavourite("Dock")
    form.wait(lambda: list(form.model.property("favourites")) == ["Dock"])
    form.model.remember()
    form.wait(lambda: len(form.model.property("history")) == 2)
    form.show(POSE)
    form.wait(lambda: len(form.model.property("history")) == 2)
    assert form.model.recall(1)
    assert form.row("pose.position.x", "text") == "1.0"
    assert form.row("header.stamp", "text") == "now"
    assert form.model.recallFavourite("Dock")
    assert form.row("pose.position.x", "text") == "nan"
    form.model.removeFavourite("Dock")
    form.wait(lambda: list(form.model.property("favourites")) == [])
    assert [file.name for file in state.iterdir()] == ["geometry_msgs__msg__PoseStamped.json"]


def test_history_is_bounded_and_has_no_doubles(form: Form, state: Path) -> None:
    form.show("std_msgs/msg/Int32")
    for number in (*range(25), 24):
        form.model.setText("data", str(number))
        form.model.remember()
    form.wait(lambda: list(form.model.property("history"))[:2] == ["data: 24", "data: 23"])
    assert len(form.model.property("history")) == 20


@pytest.mark.parametrize("text", ["", "[]", '{"history": 3}', '{"history": [1]}', "[" * 9999])
def test_broken_file_is_named_and_left_alone(form: Form, state: Path, text: str) -> None:
    state.mkdir(parents=True)
    file = state / "std_msgs__msg__Bool.json"
    file.write_text(text)
    form.show("std_msgs/msg/Bool")
    form.wait(lambda: str(file) in form.model.property("keepProblem"))
    form.model.remember()
    form.wait.settled(form.controls.bench.session)
    assert file.read_text() == text
    assert form.fields() == {"data": False}


def test_lost_disk_blocks_only_the_history(form: Form, state: Path) -> None:
    state.mkdir(parents=True)
    disk = state / "std_msgs__msg__Bool.json"
    # Opening it waits for a writer.
    os.mkfifo(disk)
    try:
        form.show("std_msgs/msg/Bool")
        assert form.model.setText("data", "true")
        assert form.fields() == {"data": True}
        form.model.remember()
        form.show("std_msgs/msg/Int32")
        assert form.fields() == {"data": 0}
    finally:
        # Not only once: it is opened for each job.
        stop = threading.Event()

        def release() -> None:
            while not stop.is_set():
                with suppress(OSError):
                    os.close(os.open(disk, os.O_WRONLY | os.O_NONBLOCK))

        releasing = threading.Thread(target=release)
        releasing.start()
        done = threading.Event()
        run_later(done.set)
        assert done.wait(30)
        stop.set()
        releasing.join()


def test_favourite_is_kept_by_the_keyboard(form: Form, controls: Any) -> None:
    form.show("std_msgs/msg/Bool")
    form.wait(lambda: controls.find("star").isVisible())
    click(controls, "star")
    write(controls, "favouriteName", "Dock")
    form.wait(lambda: list(form.model.property("favourites")) == ["Dock"])


def test_hostile_json_is_refused(form: Form) -> None:
    form.show(POSE)
    for text in ("[" * 100_000, '{"pose": 3}', '{"nothing": 1}', "3", '{"header": {"stamp": "x"}}'):
        assert not form.model.loadJson(text)
        assert form.model.property("refusal")
    assert form.fields()["pose"]["orientation"]["w"] == 1


def test_long_arrays_do_not_fill_the_form(form: Form) -> None:
    form.show("std_msgs/msg/Float64MultiArray")
    assert form.model.loadJson(json.dumps({"data": list(range(5000))}))
    for name in ("data", "data[0:100]", "data[100:200]", "data[200:300]", "data[300:400]"):
        form.model.toggle(name)
    assert "too many rows" in form.model.property("refusal")
    assert len(form.rows("key")) <= 400


def test_texts_of_several_lines_are_kept(form: Form) -> None:
    form.show("std_msgs/msg/String")
    assert form.model.loadJson(json.dumps({"data": "a\nb"}))
    assert form.row("data", "kind") == "long"
    assert form.fields()["data"] == "a\nb"
