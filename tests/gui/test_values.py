"""Messages as JavaScript values, and JavaScript values as messages."""

from __future__ import annotations

import gc
import math
from typing import Any

import numpy as np
import pytest
from values import convert, show

import rosglass
from rosglass.comm import Time
from rosglass.errors import ConversionError

pytestmark = pytest.mark.both_qt

POSE = {
    "header": {"stamp": {"sec": 12, "nanosec": 345_678_901}, "frame_id": "map ü"},
    "pose": {"position": {"x": 1.5, "y": -2.0, "z": 0.1}},
}


def test_nested_messages_become_objects(bench: Any) -> None:
    shown = show(bench, "geometry_msgs/msg/PoseStamped", POSE, "m")
    assert shown["header"] == POSE["header"]
    assert shown["pose"]["position"] == POSE["pose"]["position"]
    assert shown["pose"]["orientation"] == {"x": 0, "y": 0, "z": 0, "w": 1}


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("m['#messageType']", "geometry_msgs/msg/PoseStamped"),
        ("m.header['#messageType']", "std_msgs/msg/Header"),
        ("Object.keys(m)", ["header", "pose"]),
        ("m.header.stamp.seconds()", 12.345678901),
        ("m.header.stamp.toJSDate().getTime()", 12345),
        ("m.header.stamp.isZero()", False),
        ("m.header.stamp.nanosec", 345_678_901),
    ],
)
def test_types_and_times(bench: Any, script: str, expected: Any) -> None:
    assert show(bench, "geometry_msgs/msg/PoseStamped", POSE, script) == expected


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_non_finite_numbers_arrive(bench: Any, value: float) -> None:
    shown = show(
        bench,
        "sensor_msgs/msg/BatteryState",
        {"voltage": value, "cell_voltage": [1.0, value], "location": "#"},
        "[String(m.voltage), String(m.cell_voltage.at(1)), m.cell_voltage[0], m.location]",
    )
    word = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}[str(value)]
    assert shown == [word, word, 1, "#"]


def test_integers_beyond_a_double_stay_exact(bench: Any) -> None:
    kind = "std_msgs/msg/UInt64"
    assert show(bench, kind, {"data": 2**64 - 1}, "m.data") == str(2**64 - 1)
    assert show(bench, kind, {"data": 2**53 - 1}, "m.data") == 2**53 - 1
    data = {"data": [1, -(2**62)]}
    shown = show(bench, "std_msgs/msg/Int64MultiArray", data, "[m.data.at(0), m.data[1]]")
    assert shown == [1, str(-(2**62))]


def test_constants_are_reachable(bench: Any) -> None:
    shown = show(bench, "sensor_msgs/msg/BatteryState", {}, "m.POWER_SUPPLY_STATUS_FULL")
    assert shown == 4


@pytest.mark.parametrize("count", [0, 5, 1000])
@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("m.ranges.length", len),
        ("m.ranges.at(1)", lambda v: v[1] if v else None),
        ("m.ranges[1]", lambda v: v[1] if v else None),
        ("m.ranges.at(-1)", lambda v: v[-1] if v else None),
        ("m.ranges.at(5000) === undefined", lambda v: True),
        ("m.ranges[5000] === undefined", lambda v: True),
        ("Array.isArray(m.ranges)", lambda v: True),
        ("m.ranges.toArray()", lambda v: v),
        ("m.ranges", lambda v: v),
        ("Array.from(m.ranges)", lambda v: v),
        ("m.ranges.map(x => x * 2)", lambda v: [2 * x for x in v]),
        ("m.ranges.filter(x => x > 1).length", lambda v: sum(x > 1 for x in v)),
        ("(() => { let s = 0; for (const x of m.ranges) s += x; return s })()", sum),
        ("Array.from(new Float32Array(m.ranges.buffer()))", lambda v: v),
    ],
)
def test_arrays_answer_alike_whatever_their_length(
    bench: Any, count: int, script: str, expected: Any
) -> None:
    values = [0.5 * i for i in range(count)]
    shown = show(bench, "sensor_msgs/msg/LaserScan", {"ranges": values}, script)
    assert shown == expected(values)


@pytest.mark.parametrize("count", [3, 1000])
def test_arrays_can_be_written(bench: Any, count: int) -> None:
    script = """(() => {
        const r = m.ranges; r[0] = 9; r.push(4); r.splice(1, 1)
        return [r[0], r.at(-1), r.length, new Float32Array(r.buffer()).length] })()"""
    shown = show(bench, "sensor_msgs/msg/LaserScan", {"ranges": [1.0] * count}, script)
    assert shown == [9, 4, count, count]


@pytest.mark.parametrize("count", [2, 40])
def test_arrays_of_messages_and_of_text(bench: Any, count: int) -> None:
    transforms = {
        "transforms": [
            {"child_frame_id": f"f{i}", "header": {"stamp": {"sec": i}}} for i in range(count)
        ]
    }
    script = """[m.transforms.length, m.transforms[1].child_frame_id,
                 m.transforms.at(1).header.stamp.seconds()]"""
    assert show(bench, "tf2_msgs/msg/TFMessage", transforms, script) == [count, "f1", 1]
    names = {"name": [f"joint{i}" for i in range(count)]}
    assert show(bench, "sensor_msgs/msg/JointState", names, "m.name.toArray()") == names["name"]


def test_bytes_are_a_buffer(bench: Any) -> None:
    value = {"data": bytes(range(200)), "height": 1}
    script = "[m.data.length, m.data.at(199), new Uint8Array(m.data.buffer())[7]]"
    assert show(bench, "sensor_msgs/msg/Image", value, script) == [200, 199, 7]


def test_long_arrays_are_let_go_when_javascript_has_let_go(bench: Any, wait: Any) -> None:
    from rosglass.qml.engine.runtime import runtime_of

    for _ in range(20):
        show(bench, "sensor_msgs/msg/LaserScan", {"ranges": [1.0] * 500}, "m.ranges.length")
    runtime = runtime_of(bench.engine)
    gc.collect()
    bench.engine.collectGarbage()
    wait(lambda: len(runtime.kept) == 0)


def test_now_and_qos_are_values(bench: Any) -> None:
    script = """const q = Ros2.QoS().reliable().transient_local().keep_last(7);
        const n = Ros2.now();
        const o = Ros2.createInitOptions().setNamespace('/a');
        return [q.depth(), q.reliability, q.durability, n.sec, n.isZero(), o.getNamespace()]"""
    depth, reliability, durability, sec, zero, namespace = bench.run(script)
    assert (depth, reliability, durability) == (7, "reliable", "transient_local")
    assert abs(sec - Time.now().sec) < 5
    assert (zero, namespace) == (False, "/a")


@pytest.mark.parametrize(
    ("type_name", "script", "expected"),
    [
        ("geometry_msgs/msg/Vector3", "{x: 1, z: 2.5}", {"x": 1.0, "y": 0.0, "z": 2.5}),
        ("geometry_msgs/msg/Vector3", "{x: 1, y: undefined}", {"x": 1.0, "y": 0.0, "z": 0.0}),
        ("geometry_msgs/msg/Vector3", "Qt.vector3d(1, 2, 3)", {"x": 1.0, "y": 2.0, "z": 3.0}),
        (
            "geometry_msgs/msg/Quaternion",
            "Qt.quaternion(1, 2, 3, 4)",
            {"x": 2.0, "y": 3.0, "z": 4.0, "w": 1.0},
        ),
        ("std_msgs/msg/UInt32", "{data: 4294967295}", {"data": 2**32 - 1}),
        ("std_msgs/msg/UInt64", "{data: '18446744073709551615'}", {"data": 2**64 - 1}),
        ("std_msgs/msg/Bool", "{data: true, '#messageType': 'x'}", {"data": True}),
        ("std_msgs/msg/String", "{data: 'ü €'}", {"data": "ü €"}),
        ("builtin_interfaces/msg/Time", "{sec: 3, nanosec: 5}", {"sec": 3, "nanosec": 5}),
        ("std_msgs/msg/Empty", "{}", {}),
    ],
)
def test_values_fit(bench: Any, type_name: str, script: str, expected: dict) -> None:
    assert convert(bench, type_name, script) == expected


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("new Date(1500.0)", {"sec": 1, "nanosec": 500_000_000}),
        ("1500.25", {"sec": 1, "nanosec": 500_250_000}),
        ("-1", {"sec": -1, "nanosec": 999_000_000}),
    ],
)
def test_times_take_dates_and_milliseconds(bench: Any, script: str, expected: dict) -> None:
    header = convert(bench, "std_msgs/msg/Header", f"{{stamp: {script}}}")
    assert header["stamp"] == expected


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("[1, 2.5]", [1, 2.5]),
        ("new Float32Array([1, 2.5])", [1, 2.5]),
        ("new Int16Array([1, -2]).subarray(1)", [-2]),
        ("Array.from({length: 300}, (_, i) => i)", list(range(300))),
        ("[]", []),
    ],
)
def test_arrays_fit(bench: Any, script: str, expected: list) -> None:
    scan = convert(bench, "sensor_msgs/msg/LaserScan", f"{{ranges: {script}}}")
    np.testing.assert_array_equal(scan["ranges"], expected)


@pytest.mark.parametrize("count", [3, 500])
def test_exact_integers_fit_into_arrays(bench: Any, count: int) -> None:
    script = f"{{data: Array({count}).fill('{2**63 - 1}')}}"
    data = convert(bench, "std_msgs/msg/Int64MultiArray", script)["data"]
    assert list(data) == [2**63 - 1] * count


def test_byte_buffers_fit(bench: Any) -> None:
    image = convert(bench, "sensor_msgs/msg/Image", "{data: new Uint8Array([1, 2, 255]).buffer}")
    assert bytes(image["data"]) == b"\x01\x02\xff"


@pytest.mark.parametrize("count", [3, 500])
def test_received_messages_can_be_sent_back(bench: Any, count: int) -> None:
    from rosglass.qml.engine.from_js import fields_from_js
    from rosglass.qml.engine.runtime import runtime_of

    kind = rosglass.load("sensor_msgs/msg/LaserScan")
    value = {"header": POSE["header"], "ranges": [0.5 * i for i in range(count)]}
    data = kind.encode(value)
    js = runtime_of(bench.engine).message(kind.decode(data))
    assert kind.encode(fields_from_js(js, kind)) == data


@pytest.mark.parametrize(
    ("type_name", "script", "path", "reason"),
    [
        ("geometry_msgs/msg/Twist", "{linear: {x: 'fast'}}", "linear.x", "'fast'"),
        ("geometry_msgs/msg/Twist", "{linear: 5}", "linear", "geometry_msgs/msg/Vector3"),
        ("geometry_msgs/msg/Twist", "{linear: {q: 1}}", "linear.q", "q"),
        ("geometry_msgs/msg/Twist", "{linear: {q: 'x'}}", "linear.q", "got 'x'"),
        ("geometry_msgs/msg/Twist", "[1]", "", "an object with"),
        ("geometry_msgs/msg/Twist", "undefined", "", "an object with"),
        ("geometry_msgs/msg/Twist", "new Map([[1, 2]])", "", "Map"),
        ("std_msgs/msg/UInt8", "{data: 256}", "data", "256"),
        ("std_msgs/msg/UInt8", "{data: 1.5}", "data", "1.5"),
        ("std_msgs/msg/Int32", "{data: '4.2'}", "data", "'4.2'"),
        ("std_msgs/msg/Int32", "{data: null}", "data", "None"),
        ("std_msgs/msg/Int32", "{data: function() {}}", "data", "a function"),
        ("std_msgs/msg/Int64", "{data: '9'.repeat(5000)}", "data", "'9999"),
        ("std_msgs/msg/Int64MultiArray", "{data: Array(99).fill('x')}", "data[0]", "'x'"),
        ("sensor_msgs/msg/Joy", "{axes: Array(4e9)}", "axes", "4000000000"),
        ("std_msgs/msg/Bool", "{data: 2}", "data", "2"),
        ("std_msgs/msg/String", "{data: {}}", "data", "Object"),
        ("tf2_msgs/msg/TFMessage", "{transforms: 5}", "transforms", "an array"),
        (
            "tf2_msgs/msg/TFMessage",
            "{transforms: [{}, {transform: {rotation: {x: 'a'}}}]}",
            "transforms[1].transform.rotation.x",
            "'a'",
        ),
        ("geometry_msgs/msg/PoseWithCovariance", "{covariance: [1, 2]}", "covariance", "36"),
        ("std_msgs/msg/Header", "{stamp: NaN}", "", "milliseconds"),
    ],
)
def test_invalid_value_is_named(
    bench: Any, type_name: str, script: str, path: str, reason: str
) -> None:
    with pytest.raises(rosglass.Error) as caught:
        convert(bench, type_name, script)
    assert isinstance(caught.value, ConversionError)
    assert caught.value.path.startswith(path)
    assert reason in str(caught.value)
