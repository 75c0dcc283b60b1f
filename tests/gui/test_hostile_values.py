"""Values made to confuse: none may crash, hang, or get through."""

from __future__ import annotations

import time
from typing import Any

import pytest
from values import convert, show

from rosglass.errors import ConversionError
from rosglass.messages import MessageType
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import fields_from_js
from rosglass.qml.engine.runtime import runtime_of

SCAN, HEADER = "sensor_msgs/msg/LaserScan", "std_msgs/msg/Header"
#: A few values, each in the next one twice: who follows them all never comes to the end.
WEB = "(() => { let a = [1]; for (let i = 0; i < 60; i++) a = [a, a]; return a })()"
OBJECTS = "(() => { let a = {x: 1}; for (let i = 0; i < 60; i++) a = {x: a, y: a}; return a })()"


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("type_name", "script"),
    [
        (SCAN, "{ranges: {constructor: {name: 'Float32Array'}, length: 5}}"),
        (SCAN, "{ranges: {constructor: {name: 'ArrayBuffer'}}}"),
        (
            SCAN,
            "{ranges: {constructor: {name: 'Int8Array'}, buffer: new ArrayBuffer(2), length: 9}}",
        ),
        (SCAN, "{ranges: {'#index': 3}}"),
        (SCAN, "{ranges: {'#index': 3, toArray: () => 5}}"),
        (SCAN, "{ranges: {'#index': 3, toArray: () => { throw new Error('no') }}}"),
        (SCAN, "{ranges: Object.assign([null], {'#source': 5, '#index': 9})}"),
        (SCAN, "{ranges: new Map([[0, 1]])}"),
        (SCAN, "{ranges: new Set([1])}"),
        (SCAN, "{ranges: Symbol.iterator}"),
        (SCAN, "{ranges: [[1]]}"),
        (SCAN, "{ranges: [{}]}"),
        (HEADER, "{stamp: {nanoseconds: 'x'}}"),
        (HEADER, "{stamp: {nanoseconds: 1.5}}"),
        (HEADER, "{stamp: {sec: {}}}"),
        (HEADER, "{stamp: {'#kind': 'time', toString: 5, valueOf: 5, x: 1}}"),
        (HEADER, "{stamp: {sec: 1, get nanosec() { return '5' }}}"),
        (HEADER, "(() => { const a = {}; a.stamp = a; return a })()"),
        (SCAN, f"{{ranges: {WEB}}}"),
        (SCAN, f"{{ranges: Array(50).fill({WEB})}}"),
        (SCAN, f"{{ranges: {OBJECTS}}}"),
        (SCAN, f"{{unknown: {WEB}}}"),
        (HEADER, f"{{frame_id: {WEB}}}"),
        (HEADER, WEB),
        (HEADER, f"{{stamp: {WEB}}}"),
        ("geometry_msgs/msg/Quaternion", f"{{scalar: {OBJECTS}}}"),
        (HEADER, "{frame_id: {toString: () => 'map'}}"),
        (HEADER, "{__proto__: {frame_id: 5}, frame_id: []}"),
    ],
)
def test_disguises_are_refused(bench: Any, type_name: str, script: str) -> None:
    with pytest.raises(ConversionError):
        convert(bench, type_name, script, module=1)


@pytest.mark.both_qt
def test_a_foreign_source_gives_nothing(bench: Any) -> None:
    bench.load("Item {}", "import QtQuick 2.15")
    script = """(() => { const s = m.ranges['#source']
        return [s.at(9, 0) === undefined, s.at(0, -1) === undefined, s.at(0, 99999) === undefined,
                !s.buffer(7), !s.buffer(-1)] })()"""
    shown = show(bench, SCAN, {"ranges": [1.0] * 70_000}, script)
    assert shown == [True] * 5


@pytest.mark.both_qt
@pytest.mark.parametrize(
    "call",
    [
        "Ros2.constants(undefined)",
        "Ros2.documentation({})",
        "Ros2.time(() => 1)",
        "Ros2.time({sec: 1e300})",
        "Ros2.time({sec: '1'})",
        "Ros2.time(1e300)",
        "Ros2.time('1e999')",
        "Ros2.time('9'.repeat(100))",
        "Ros2.duration(new Map())",
        "Ros2.duration(1, 0.5)",
        "Ros2.duration(1).add({get sec() { throw new Error('no') }})",
        "Ros2.duration(1).multiply({})",
        "Ros2.duration(1).seconds.call(5).toFixed(1000)",
        "Ros2.duration.call(null, null)",
    ],
)
def test_functions_throw_what_javascript_can_catch(bench: Any, call: str) -> None:
    script = f"try {{ {call} }} catch (e) {{ return String(e).includes('Error') }}"
    assert bench.run(script) is True


@pytest.mark.both_qt
@pytest.mark.parametrize(
    "text",
    [
        "<img src='file:///etc/passwd'><a href='http://x'>y</a>",
        "file:///etc/passwd",
        "'); Qt.quit(); ('",
        "${Qt.quit()}",
        '"}); Qt.openUrlExternally("http://x"); ({"',
        "__proto__",
        "\\u2028\\x00\\x1b[2J",
        '{"#": "NaN", "#at": 0, "length": 9}',
    ],
)
def test_text_from_the_network_stays_text(running: Any, wait: Any, text: str) -> None:
    root: Any = running.load("""QtObject { id: root
        property Subscription subscription: Subscription {
            topic: "/evil"; throttleRate: 0; onNewMessage: message => root.got = message }
        property var got
        property string bound: subscription.message ? subscription.message.status[0].name : ""
        function same(text) {
            const status = got.status[0]
            return typeof status.name === "string" && status.name === text && bound === text
                && status.values[0].key === text && typeof status.values[0].key === "string"
                && got.header.frame_id === text && Object.keys(got).length === 2 }
    }""")
    publisher = running.robot.create_publisher("/evil", "diagnostic_msgs/msg/DiagnosticArray")
    wait(publisher.subscription_count)
    pair = {"key": text, "value": text}
    publisher.publish(header={"frame_id": text}, status=[{"name": text, "values": [pair]}])
    wait(lambda: root.property("bound"))
    assert root.same(text) is True


@pytest.mark.parametrize("value", [WEB, f"({{a: {OBJECTS}}})"])
def test_exponential_value_is_refused(bench: Any, tmp_path: Any, value: str) -> None:
    text = bench.run(
        f"try {{ Ros2.io.writeYaml('{tmp_path}/web.yaml', {value}) }} catch (e) {{ return '' + e }}"
    )
    assert text is None or "at most 262144 values in all" in text
    assert not (tmp_path / "web.yaml").exists()


def test_value_used_twice_is_written_twice(bench: Any, tmp_path: Any) -> None:
    file = tmp_path / "twice.yaml"
    assert bench.run(f"const a = {{x: [1]}}; return Ros2.io.writeYaml('{file}', [a, {{b: a}}])")
    assert bench.run(f"return Ros2.io.readYaml('{file}')") == [{"x": [1]}, {"b": {"x": [1]}}]


LARGE = {
    "two in the next, 8 levels": "T1 a\nT1 b"
    + "".join(f"\n===\nMSG: t/T{at}\nT{at + 1} a\nT{at + 1} b" for at in range(1, 9))
    + "\n===\nMSG: t/T9\nuint8 x",
    "two sequences in the next, 8 levels": "T1[] a\nT1[] b"
    + "".join(f"\n===\nMSG: t/T{at}\nT{at + 1}[] a\nT{at + 1}[] b" for at in range(1, 9))
    + "\n===\nMSG: t/T9\nuint8 x",
    "2999 texts": "\n".join(f"string s{at}" for at in range(2999)),
    "2999 sequences": "\n".join(f"float64[] s{at}" for at in range(2999)),
    "990 messages": "\n".join(f"T m{at}" for at in range(990))
    + "\n===\nMSG: t/T\nstring x\nuint8 y",
    "49999 messages": "T[49999] m\n===\nMSG: t/T\nuint8 y",
}


@pytest.mark.parametrize("shape", LARGE)
def test_the_largest_types_go_to_javascript_and_back(bench: Any, shape: str) -> None:
    kind = MessageType.from_text("t/msg/Root", LARGE[shape])
    message = kind.create()
    begun = time.process_time()
    shown = runtime_of(bench.engine).message(message)
    there = fields_from_js(shown, message.type, dialect=Dialect.ROS2)
    assert kind.encode(there) == kind.encode(message)
    # A second is the aim, on a machine that has nothing else to do.
    assert time.process_time() - begun < 10


@pytest.mark.both_qt
def test_value_that_blocks_the_interface_is_refused(
    bench: Any, tmp_path: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr("rosglass.qml.engine.from_js._READ_TIMEOUT_S", -1.0)
    path = tmp_path / "slow.yaml"
    text = bench.run(
        f"try {{ Ros2.io.writeYaml('{path}', Array(300).fill(1)) }} catch (e) {{ return '' + e }}"
    )
    assert text is None or "blocks the interface" in text
    assert not path.exists()
    assert bench.run(f"return Ros2.io.writeYaml('{path}', Array(200).fill(1))") is True
    assert path.exists()
