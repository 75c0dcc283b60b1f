"""Messages as dicts, JSON and YAML."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from rosglass.messages import MessageType, load

JOINTS = load("sensor_msgs/msg/JointState")


def test_dict_keeps_arrays_and_wire_names() -> None:
    data = JOINTS.encode(name=["a"], position=[1.0, float("nan")])
    value = JOINTS.decode(data).to_dict()
    assert list(value) == ["header", "name", "position", "velocity", "effort"]
    assert isinstance(value["position"], np.ndarray)
    assert value["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert JOINTS.encode(value) == data


def test_json_is_strict_and_says_what_it_cannot() -> None:
    message = JOINTS.create(
        name=["grüße", "\udcff"], position=[float("nan"), float("inf"), float("-inf"), 0.1]
    )
    text = message.to_json()
    value = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert value["position"] == ["NaN", "Infinity", "-Infinity", 0.1]
    assert value["name"] == ["grüße", "\N{REPLACEMENT CHARACTER}"]
    assert "grüße" in text
    assert text.encode()
    assert message.to_json(indent=2).count("\n") > 10


@pytest.mark.parametrize("width", [2, 4])
@pytest.mark.parametrize("unit", [0xD800, 0xDBFF, 0xDC00, 0xDC80, 0xDFFF])
def test_wide_strings_with_half_a_pair_are_shown(unit: int, width: int) -> None:
    kind = MessageType.from_text("t/msg/W", "wstring a\nwstring[] b\nuint8 c")
    value = {"a": f"x{chr(unit)}y🤖", "b": [chr(unit)], "c": 1}
    message = kind.decode(kind.encode(value, wstring_width=width), wstring_width=width)
    assert message.to_dict() == value
    shown = {"a": "x\N{REPLACEMENT CHARACTER}y🤖", "b": ["\N{REPLACEMENT CHARACTER}"], "c": 1}
    assert json.loads(message.to_json().encode()) == shown
    assert yaml.safe_load(message.to_yaml().encode()) == shown
    assert str(message).encode()


def test_json_of_bytes_and_nested_messages() -> None:
    image = load("sensor_msgs/msg/Image").create(data=b"\1\2", header={"frame_id": "cam"})
    value = json.loads(image.to_json())
    assert value["data"] == [1, 2]
    assert value["header"]["frame_id"] == "cam"
    old = load("std_msgs/Header", ros=1).create(stamp={"secs": 1, "nsecs": 2})
    assert json.loads(old.to_json())["stamp"] == {"secs": 1, "nsecs": 2}


def test_yaml_reads_back() -> None:
    path = load("nav_msgs/msg/Path").create(
        poses=[{"header": {"frame_id": "on"}}, {"pose": {"position": {"x": float("inf")}}}]
    )
    assert yaml.safe_load(path.to_yaml()) == path.to_dict()
    scan = load("sensor_msgs/msg/LaserScan").create(ranges=[0.5, float("inf")])
    assert "ranges: [0.5, .inf]\n" in scan.to_yaml()
    assert scan.to_yaml().startswith("header:\n  stamp:\n    sec: 0\n")


def test_text_reads_messages_with_dicts_inside() -> None:
    path = load("nav_msgs/msg/Path").create()
    path.header = {"frame_id": "map"}
    path.poses = [{"pose": {}}]
    value = path.to_dict()
    assert value == {"header": {"frame_id": "map"}, "poses": [{"pose": {}}]}
    assert json.loads(path.to_json()) == value
    assert "frame_id" in repr(path)
