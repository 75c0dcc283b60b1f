"""Times and durations in both modules, whatever the robot speaks."""

from __future__ import annotations

from typing import Any

import pytest
from values import caught, convert, show

from rosglass.comm import Duration, Time
from rosglass.errors import ConversionError

STAMP = {1: {"secs": 12, "nsecs": 345_678_901}, 2: {"sec": 12, "nanosec": 345_678_901}}
HEADER = "std_msgs/msg/Header"


def header(bench: Any, script: str, module: int = 2, ros: int = 2) -> Any:
    return show(bench, HEADER, {"stamp": STAMP[ros]}, script, module=module, ros=ros)


@pytest.mark.both_qt
@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize(
    ("module", "script", "expected"),
    [
        (1, "m.stamp", {"sec": 12, "nsec": 345_678_901}),
        (2, "m.stamp", {"sec": 12, "nanosec": 345_678_901}),
        (1, "m.stamp.toSec()", 12.345678901),
        (1, "m.stamp.toNSec()", 12_345_678_901),
        (2, "m.stamp.nanoseconds()", 12_345_678_901),
        (2, "m.stamp.seconds()", 12.345678901),
        (2, "m.stamp.seconds * 2", 24.691357802),
        (2, "m.stamp.seconds.toFixed(2)", "12.35"),
        (2, "'t = ' + m.stamp.seconds", "t = 12.345678901"),
        (2, "[m.stamp.seconds < 13, m.stamp.seconds > 13]", [True, False]),
        (2, "m.stamp.seconds", 12.345678901),
        (
            2,
            "[m.stamp.clockType() == 1, m.stamp.clockType == 1, m.stamp.clockType]",
            [True, True, 1],
        ),
        (1, "[m.stamp.isZero(), m.stamp.toJSDate().getTime()]", [False, 12345]),
        (1, "m.stamp.getTime()", 12345),
        (1, "[m.stamp.getMilliseconds(), m.stamp.getSeconds()]", [345, 12]),
        (1, "m.stamp.getYear() === m.stamp.toJSDate().getYear()", True),
        (2, "m.stamp.getTime === undefined", True),
        (2, "[m.stamp.isZero(), m.stamp.toJSDate().getTime()]", [False, 12345]),
        (1, "m['#messageType']", "std_msgs/Header"),
        (2, "m['#messageType']", "std_msgs/msg/Header"),
        (1, "m.seq", 0),
    ],
)
def test_times_are_those_of_the_module(
    bench: Any, ros: int, module: int, script: str, expected: Any
) -> None:
    assert header(bench, script, module, ros) == expected


def test_the_counter_of_ros1_headers_is_there(bench: Any) -> None:
    shown = show(bench, HEADER, {"seq": 7}, "m.seq", module=1, ros=1)
    assert shown == 7


@pytest.mark.parametrize("count", [2, 100])
def test_durations_of_ros1_are_milliseconds(bench: Any, count: int) -> None:
    points = [{"time_from_start": {"sec": -2, "nanosec": 500_000_000}}] * count
    trajectory = {"points": points}
    kind = "trajectory_msgs/msg/JointTrajectory"
    script = "m.points.at(1).time_from_start"
    assert show(bench, kind, trajectory, script, module=1) == -1500
    script += ".toJSDuration()"
    assert show(bench, kind, trajectory, script) == -1500


def test_fields_that_ros2_renamed_answer_to_the_name_of_the_module(bench: Any) -> None:
    k = [float(i) for i in range(9)]
    assert show(bench, "sensor_msgs/msg/CameraInfo", {"k": k}, "m.K", module=1) == k
    assert show(bench, "sensor_msgs/msg/CameraInfo", {"K": k}, "m.k", ros=1) == k
    info = convert(bench, "sensor_msgs/msg/CameraInfo", f"{{K: {k}}}", module=1)
    assert list(info["k"]) == k


def test_every_renamed_field_of_types_that_both_have_is_known() -> None:
    from rosglass.errors import Error
    from rosglass.interfaces import Counterparts, Definition, Library
    from rosglass.messages.schema import schema_of
    from rosglass.qml.engine.dialect import Dialect

    library, found = Library(), set()
    for name in library.names(1, "msg"):
        definition = library.definition(name, ros=1)
        assert isinstance(definition, Definition)
        try:
            pair = Counterparts(library).message(definition)
        except Error:
            continue
        if pair.two.source.provider.startswith("derived from "):
            continue
        fields = [(f.one[0], f.two[0]) for f in pair.fields if len(f.one) == len(f.two) == 1]
        renamed = {one: two for one, two in fields if one != two}
        found |= set(renamed)
        assert Dialect.ROS2.names(schema_of(pair.one)) == renamed, name
        back = {two: one for one, two in renamed.items()}
        assert Dialect.ROS1.names(schema_of(pair.two)) == back, name
    assert found == set("DKRPT")


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("m.stamp.add(0.5)", {"sec": 12, "nanosec": 346_178_901}),
        ("m.stamp.add({sec: 0, nanosec: 999999999})", {"sec": 13, "nanosec": 345_678_900}),
        ("m.stamp.subtract(new Date(12000))", {"sec": 0, "nanosec": 345_678_901}),
        ("m.stamp.subtract(13000)", {"sec": -1, "nanosec": 345_678_901}),
        ("m.stamp.subtract(m.stamp).isZero()", True),
        ("m.stamp.subtract(m.stamp.add(1)).toJSDuration()", -1),
        ("m.stamp.subtract(new Date(0)).multiply(1 / 3)", {"sec": 4, "nanosec": 115_226_300}),
        ("m.stamp.subtract(new Date(0)).multiply(3)", {"sec": 37, "nanosec": 37_036_703}),
        ("m.stamp.compare(m.stamp.add(0.000001))", -1),
        ("m.stamp.equals(m.stamp.add(0))", True),
        ("m.stamp.lessThan(new Date(12345))", False),
        ("m.stamp.greaterThan(new Date(12345))", True),
        ("m.stamp < m.stamp.add(1)", True),
        ("m.stamp.exactNanoseconds()", "12345678901"),
        ("String(m.stamp)", "12.345678901"),
        ("String(m.stamp.subtract(new Date(13000)))", "-0.654321099"),
        ("m.stamp.subtract(new Date(13000)).exactNanoseconds()", "-654321099"),
    ],
)
def test_arithmetic_is_exact(bench: Any, script: str, expected: Any) -> None:
    assert header(bench, script) == expected


@pytest.mark.both_qt
def test_today_is_exact_too(bench: Any) -> None:
    script = """const a = Ros2.time('1795000000.123456789'), b = Ros2.time(1795000000, 123456788);
        return [a.exactNanoseconds(), a.subtract(b).exactNanoseconds(), a.compare(b)]"""
    assert bench.run(script) == ["1795000000123456789", "1", 1]


def test_the_difference_of_two_times_is_milliseconds_in_ros1(bench: Any) -> None:
    assert header(bench, "m.stamp.subtract(m.stamp.add(-2.5))", module=1) == 2.5
    assert header(bench, "m.stamp.add(500)", module=1) == {"sec": 12, "nsec": 845_678_901}


@pytest.mark.parametrize(
    "script",
    [
        "m.stamp.add(new Date())",
        "m.stamp.add(NaN)",
        "m.stamp.add('1')",
        "m.stamp.compare({})",
        "m.stamp.subtract({sec: 1, nanosec: 2})",
        "m.stamp.subtract(m.stamp).subtract(m.stamp)",
        "m.stamp.subtract(m.stamp).multiply('2')",
        "m.stamp.subtract(m.stamp).multiply(Infinity)",
        "(m.stamp.sec = 'x', m.stamp.seconds())",
    ],
)
def test_arithmetic_with_anything_else_throws(bench: Any, script: str) -> None:
    thrown = f"(() => {{ try {{ {script} }} catch (e) {{ return String(e) }} }})()"
    assert "TypeError: expected " in header(bench, thrown)


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("Ros2.time(1.5)", {"sec": 1, "nanosec": 500_000_000}),
        ("Ros2.time(5, 7)", {"sec": 5, "nanosec": 7}),
        ("Ros2.time(new Date(2500))", {"sec": 2, "nanosec": 500_000_000}),
        ("Ros2.time({nanoseconds: '12000000001'})", {"sec": 12, "nanosec": 1}),
        ("Ros2.duration(-0.5)", {"sec": -1, "nanosec": 500_000_000}),
        ("Ros2.duration(90).seconds()", 90),
        ("Ros2.time(1).clockType() === Ros2ClockTypes.Ros", True),
        ("Ros2.time(1).clockType === Ros2ClockTypes.Ros", True),
        ("Ros2.now().clockType === Ros2ClockTypes.System", False),
        ("Ros2.now().clockType() === Ros2ClockTypes.Uninitialized", False),
        (
            (
                "[Ros2ClockTypes.Uninitialized, Ros2ClockTypes.Ros, Ros2ClockTypes.System,"
                " Ros2ClockTypes.Steady]"
            ),
            [0, 1, 2, 3],
        ),
        ("Ros2ClockTypes.Ros == 1 && 'type ' + Ros2ClockTypes.Steady", "type 3"),
        (
            (
                "(function (t) { switch (t.clockType) { case Ros2ClockTypes.System: return 2;"
                " case Ros2ClockTypes.Ros: return 'ros' } })(Ros2.now())"
            ),
            "ros",
        ),
    ],
)
def test_times_can_be_made(bench: Any, script: str, expected: Any) -> None:
    assert bench.run(f"return {script}") == expected


@pytest.mark.both_qt
@pytest.mark.parametrize(
    "arguments", ["'x'", "NaN", "1.5, 2", "{}", "null", "[1]", "Ros2.duration(1)", "undefined"]
)
def test_invalid_arguments_throw(bench: Any, arguments: str) -> None:
    assert caught(bench, f"Ros2.time({arguments})").startswith("Error: Ros2.time: ")


def test_the_singletons_of_ros1(running: Any) -> None:
    running.module = "Ros 1.0"
    script = """const n = Time.now();
        return [n.toSec(), WallTime.now().toSec(), Time.create(1.5), Time.create(5, 7).nsec,
                WallTime.create(3).sec, Time.isSimTime(), Time.isSystemTime(), Time.isValid(),
                Ros.duration(0.5), Ros.time(3).add(500).toSec()]"""
    now, wall, *rest = running.run(script)
    assert abs(now - Time.now().seconds) < 60
    assert abs(wall - Time.now().seconds) < 60
    half = {"sec": 1, "nsec": 500_000_000}
    assert rest == [half, 7, 3, False, True, True, 500, 3.5]


def test_before_init_there_is_no_time_in_ros1(bench: Any) -> None:
    bench.module = "Ros 1.0"
    assert bench.run("return [Time.now().isZero(), Time.isValid()]") == [True, False]


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize("module", [1, 2])
@pytest.mark.parametrize(
    "script",
    [
        "{sec: 12, nsec: 345678901}",
        "{sec: 12, nanosec: 345678901}",
        "{secs: 12, nsecs: 345678901}",
        "{nanoseconds: '12345678901'}",
        "{nanoseconds: 12345678901}",
        "12345.678901",
    ],
)
def test_times_of_both_modules_are_taken(bench: Any, module: int, ros: int, script: str) -> None:
    made = convert(bench, HEADER, f"{{stamp: {script}}}", module=module, ros=ros)
    assert made["stamp"] == STAMP[ros]


def test_a_time_made_by_either_module_can_be_sent(bench: Any) -> None:
    from values import converted

    root = bench.load("QtObject { property var t: ({stamp: Ros2.time(12, 5)}) }")
    value = bench.engine.toScriptValue(root).property("t")
    assert converted(value, HEADER, ros=1)["stamp"] == {"secs": 12, "nsecs": 5}


def test_headers_of_ros1_can_be_sent_to_ros2(bench: Any) -> None:
    made = convert(bench, HEADER, "{seq: 4, stamp: 1000}", module=1)
    assert made == {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": ""}
    with pytest.raises(ConversionError, match="seq"):
        convert(bench, HEADER, "{seq: 4}")


@pytest.mark.both_qt
@pytest.mark.parametrize("module", [1, 2])
def test_arrays_of_times_and_durations(bench: Any, module: int) -> None:
    script = "{points: [{time_from_start: 1500}, {time_from_start: {sec: 1, nsec: 5}}]}"
    made = convert(bench, "trajectory_msgs/msg/JointTrajectory", script, module=module)
    found = [point["time_from_start"] for point in made["points"]]
    assert found == [{"sec": 1, "nanosec": 500_000_000}, {"sec": 1, "nanosec": 5}]


@pytest.mark.parametrize("script", ["new Date(NaN)", "Infinity", "'now'", "[1, 2]", "{hour: 1}"])
def test_invalid_time_is_named(bench: Any, script: str) -> None:
    with pytest.raises(ConversionError) as error:
        convert(bench, HEADER, f"{{stamp: {script}}}")
    assert error.value.path.startswith("stamp")


@pytest.mark.both_qt
def test_python_gives_and_takes_times(bench: Any) -> None:
    from rosglass.qml.engine.dialect import Dialect
    from rosglass.qml.engine.js_values import duration_from_js, time_from_js
    from rosglass.qml.engine.runtime import runtime_of

    runtime = runtime_of(bench.engine)
    for dialect in Dialect:
        time, duration = Time(-1_500_000_001), Duration(-1_500_000_000)
        assert time_from_js(runtime.time(time, dialect)) == time
        assert duration_from_js(runtime.duration(duration, dialect)) == duration
    with pytest.raises(ConversionError, match="target_time"):
        time_from_js(runtime.value("x"), "target_time")
