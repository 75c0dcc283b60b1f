"""Arrays of messages have the methods of the plugins' Array, whatever their length and origin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from values import convert, converted, show

from rosglass.errors import ConversionError

pytestmark = pytest.mark.both_qt

SCAN = "sensor_msgs/msg/LaserScan"


def ranges(bench: Any, count: int, script: str) -> Any:
    body = f"(() => {{ const r = m.ranges; {script} }})()"
    return show(bench, SCAN, {"ranges": [1.0 + i for i in range(count)]}, body)


@pytest.mark.parametrize("count", [3, 200])
@pytest.mark.parametrize(
    ("script", "change"),
    [
        ("r.push(7); r.append(8)", lambda v: [*v, 7, 8]),
        ("r.pop(); r.shift()", lambda v: v[1:-1]),
        ("r.unshift(5)", lambda v: [5, *v]),
        ("r.spliceList(1, 1, [8, 9])", lambda v: [v[0], 8, 9, *v[2:]]),
        ("r.spliceList(-1, 1, [])", lambda v: v[:-1]),
        ("r.replace(1, 6)", lambda v: [v[0], 6, *v[2:]]),
        ("r.replace(r.length + 1, 6)", lambda v: [*v, 0, 6]),
        ("r.length += 2", lambda v: [*v, 0, 0]),
        ("r.length = 1", lambda v: v[:1]),
        ("r[0] = 4", lambda v: [4, *v[1:]]),
        ("r.reverse()", lambda v: v[::-1]),
    ],
)
def test_arrays_change(bench: Any, count: int, script: str, change: Any) -> None:
    expected = change([1.0 + i for i in range(count)])
    ways = "[r.toArray(), r.toVariantList(), Array.from(new Float32Array(r.buffer())), r.length]"
    shown = ranges(bench, count, f"{script}; return {ways}")
    assert shown == [expected, expected, expected, len(expected)]


@pytest.mark.parametrize("count", [3, 200])
def test_removed_elements_are_returned(bench: Any, count: int) -> None:
    script = "return [r.pop(), r.shift(), r.spliceList(0, 1, []) === undefined, r.at(999)]"
    assert ranges(bench, count, script) == [count, 1, True, None]


@pytest.mark.parametrize("count", [3, 200])
def test_growing_pads_with_defaults(bench: Any, count: int) -> None:
    assert ranges(bench, count, "r.length += 2; return [r.at(-1), r.at(r.length - 2)]") == [0, 0]
    script = "(() => { m.name.length += 1; return m.name.at(-1) })()"
    assert show(bench, "sensor_msgs/msg/JointState", {"name": ["a"] * count}, script) == ""
    script = """(() => { const t = m.transforms; t.length += 1
        return [t.at(-1).transform.rotation.w, t.toArray().length] })()"""
    shown = show(bench, "tf2_msgs/msg/TFMessage", {"transforms": [{}] * count}, script)
    assert shown == [1, count + 1]


@pytest.mark.parametrize("index", ["-1", "1.5", "'x'"])
def test_impossible_indices_throw(bench: Any, index: str) -> None:
    script = f"try {{ r.replace({index}, 1) }} catch (e) {{ return String(e) }}"
    assert "index" in ranges(bench, 3, script)


@pytest.mark.parametrize("count", [2, 200])
def test_grown_arrays_can_be_sent(bench: Any, count: int) -> None:
    script = f"(() => {{ const a = [1, 2]; a.length = {count + 2}; return {{ranges: a}} }})()"
    assert list(convert(bench, SCAN, script)["ranges"]) == [1, 2] + [0] * count


@pytest.mark.parametrize("count", [3, 200])
def test_changed_arrays_can_be_sent_back(bench: Any, count: int) -> None:
    import rosglass
    from rosglass.qml.engine.runtime import runtime_of

    kind = rosglass.load(SCAN)
    message = runtime_of(bench.engine).message(kind.create(ranges=[1.0] * count))
    bench.engine.evaluate("(function(m) { m.ranges.push(5); m.ranges.length += 1 })").call(
        [message]
    )
    assert list(converted(message, SCAN)["ranges"]) == [1.0] * count + [5, 0]


@pytest.mark.parametrize("count", [2, 40])
def test_received_arrays_of_messages_can_be_sent_to_the_other_ros(bench: Any, count: int) -> None:
    import rosglass
    from rosglass.qml.engine.dialect import Dialect
    from rosglass.qml.engine.runtime import runtime_of

    kind = rosglass.load("tf2_msgs/msg/TFMessage", ros=1)
    value = {"transforms": [{"header": {"seq": 3, "stamp": {"secs": i}}} for i in range(count)]}
    message = runtime_of(bench.engine).message(kind.create(value), Dialect.ROS1)
    made = converted(message, "tf2_msgs/msg/TFMessage", module=1)
    assert [t["header"]["stamp"]["sec"] for t in made["transforms"]] == list(range(count))


@pytest.mark.parametrize("count", [0, 1, 100])
def test_wide_integers_have_exact_buffers(bench: Any, count: int) -> None:
    value = {"data": [-(2**62) - 1] * count}
    script = """(() => { const whole = m.data.buffer().byteLength; m.data.push('-1', 5);
        return [whole, Array.from(new Int32Array(m.data.buffer())).slice(-4)] })()"""
    shown = show(bench, "std_msgs/msg/Int64MultiArray", value, script)
    assert shown == [8 * count, [-1, -1, 5, 0]]


def test_arrays_without_numbers_have_no_buffer(bench: Any) -> None:
    for count in (1, 100):
        value = {"name": ["a"] * count}
        shown = show(bench, "sensor_msgs/msg/JointState", value, "m.name.buffer() === undefined")
        assert shown is True


@pytest.mark.parametrize(
    ("type_name", "script", "expected"),
    [
        (SCAN, "{ranges: new Float32Array([1, 2.5]).buffer}", [1, 2.5]),
        (SCAN, "{ranges: new Float64Array([1, 2.5])}", [1, 2.5]),
        (SCAN, "{ranges: new Uint8Array([1, 2])}", [1, 2]),
        ("std_msgs/msg/Int64MultiArray", "{data: new Int32Array([-1, 7])}", [-1, 7]),
        ("std_msgs/msg/ByteMultiArray", "{data: new Uint8Array([1, 255])}", [1, 255]),
        ("std_msgs/msg/ByteMultiArray", "{data: new Uint8Array([1, 255]).buffer}", [1, 255]),
    ],
)
def test_typed_arrays_and_buffers_fit(
    bench: Any, type_name: str, script: str, expected: list
) -> None:
    made = convert(bench, type_name, script)
    np.testing.assert_array_equal(made["ranges" if type_name == SCAN else "data"], expected)


@pytest.mark.parametrize(
    ("type_name", "script", "reason"),
    [
        (SCAN, "{ranges: new DataView(new ArrayBuffer(8))}", "buffer"),
        (SCAN, "{ranges: new ArrayBuffer(7)}", "multiple of 4 bytes"),
        (SCAN, "{ranges: 'abc'}", "an array"),
        (SCAN, "{ranges: {length: 2}}", "an array"),
        (SCAN, "{ranges: [1, null]}", r"ranges\[1\]"),
        (SCAN, "{ranges: Array(50).fill(null)}", r"ranges\[0\]"),
        (SCAN, "{ranges: [1, '2']}", r"ranges\[1\]"),
        ("std_msgs/msg/UInt8MultiArray", "{data: new Int16Array([1, 300])}", r"data\[1\]"),
        ("std_msgs/msg/UInt8MultiArray", "{data: new Float32Array([1.5])}", r"data\[0\]"),
        ("geometry_msgs/msg/PoseWithCovariance", "{covariance: new Float64Array(35)}", "36"),
        ("tf2_msgs/msg/TFMessage", "{transforms: new Uint8Array(3)}", "an array"),
    ],
)
def test_value_of_a_wrong_type_is_named(
    bench: Any, type_name: str, script: str, reason: str
) -> None:
    with pytest.raises(ConversionError, match=reason):
        convert(bench, type_name, script)


@pytest.mark.parametrize("module", ["Ros 1.0", "Ros2 1.0"])
def test_empty_messages_have_the_same_arrays(bench: Any, module: str) -> None:
    bench.module = module
    maker = module.split(maxsplit=1)[0]
    script = f"""const m = {maker}.createEmptyMessage('sensor_msgs/JointState');
        m.name.append('a'); m.position.replace(1, 5);
        return [m.name.at(0), m.position.toArray(), m.effort.length]"""
    assert bench.run(script) == ["a", [0, 5], 0]


@pytest.mark.parametrize("count", [3, 5000])
def test_qml_files_see_the_length(running: Any, wait: Any, count: int) -> None:
    """Qt 5 looks a Proxy's ``length`` up elsewhere where QML files ask."""
    joints = running.robot.create_publisher("/joints", "sensor_msgs/msg/JointState")
    root = running.load(
        """QtObject {
            property var sub: Subscription { topic: "/joints" }
            function ready() { return sub.subscribed }
            function lengths() {
                const m = sub.message
                if (!m) return ""
                let n = 0
                for (let i = 0; i < m.position.length; ++i) n += m.position[i]
                m.velocity = [1, 2]
                return [m.position.length, m.name.length, n, m.velocity.length].join()
            }
        }"""
    )
    wait(lambda: root.ready() and joints.subscription_count())
    joints.publish(name=["a"] * count, position=[1.0] * count, velocity=[0.0] * count)
    wait(lambda: root.lengths() == f"{count},{count},{count},2")
