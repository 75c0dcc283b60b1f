"""YAML files read and written by interfaces."""

from __future__ import annotations

import json
import logging
import threading
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path


def read(bench: Any, path: Any, then: str = "v", module: str = "Ros2") -> Any:
    bench.module = f"{module} 1.0"
    return bench.run(f"const v = {module}.io.readYaml({json.dumps(str(path))}); return {then}")


def write(bench: Any, path: Any, value: str, module: str = "Ros2") -> Any:
    bench.module = f"{module} 1.0"
    imports = "import QtQuick 2.15"
    return bench.run(f"return {module}.io.writeYaml({json.dumps(str(path))}, {value})", imports)


@pytest.mark.both_qt
@pytest.mark.parametrize("module", ["Ros", "Ros2"])
@pytest.mark.parametrize(
    "value",
    [
        "{a: 1, b: -2.5, c: [true, false, 'x', {d: [[1], []]}], e: {}}",
        "'42'",
        "['yes', 'null', '1e5', '2026-01-01', '~', '', ' x ', 'a: b', 'ü\\nz', '0x1F', '-']",
        "9007199254740991",
        "'9007199254740993'",
        "1e300",
        "-0.1",
        "[]",
        "{'1': 2, 'true': 3}",
        "{type: 'time', label: 'mine'}",
        "{sec: 1}",
    ],
)
def test_values_come_back(bench: Any, tmp_path: Path, module: str, value: str) -> None:
    file = tmp_path / "a.yaml"
    assert write(bench, file, value, module) is True
    expected = bench.run(f"return {value}")
    assert read(bench, file, module=module) == expected
    assert read(bench, file.as_uri(), module=module) == expected


def test_dates_and_numbers_that_json_lacks_come_back(bench: Any, tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    assert write(bench, file, "{d: new Date(1234567), n: NaN, i: -Infinity, u: null}") is True
    then = "[v.d instanceof Date, v.d.getTime(), isNaN(v.n), v.i === -Infinity, v.u === undefined]"
    assert read(bench, file, then) == [True, 1234567, True, True, True]


def test_times_come_back(bench: Any, tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    assert write(bench, file, "{t: Ros2.time(5, 6), d: Ros2.duration(-1.5)}") is True
    assert "type: time" in file.read_text()
    assert read(bench, file, "[v.t.nanosec, v.t.seconds(), v.d.toJSDuration()]") == [
        6,
        5.000000006,
        -1500,
    ]
    assert write(bench, file, "{t: Time.create(5, 6)}", "Ros") is True
    assert file.read_text() == "t:\n  sec: 5\n  nsec: 6\n"
    assert read(bench, file, "v.t.toSec()", "Ros") == 5.000000006


@pytest.mark.both_qt
def test_messages_models_and_objects_are_written(bench: Any, tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    root = bench.load(
        f"""Item {{
        property var model: ListModel {{ id: list
            ListElement {{ name: "a"; on: true }} ListElement {{ name: "b"; on: false }} }}
        property QtObject bag: QtObject {{ property int x: 1; property var y: [2] }}
        function go() {{
            const m = Ros2.createEmptyMessage("sensor_msgs/msg/JointState")
            m.position = new Float32Array([1, 2.5])
            m.name = Array.from({{length: 40}}, (_, i) => "j" + i)
            return Ros2.io.writeYaml("{file}", {{m: m, list: list, bag: bag, u: Qt.point(1, 2)}})
        }} }}""",
        "import QtQuick 2.15",
    )
    assert root.go() is True
    shown = read(bench, file)
    assert shown["m"]["position"] == [1, 2.5]
    assert shown["m"]["name"][39] == "j39"
    assert shown["list"] == [{"name": "a", "on": True}, {"name": "b", "on": False}]
    assert shown["bag"] == {"x": 1, "y": [2]}


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("value", "text", "back"),
    [
        ("new Map([['a', 1], ['b', [2, {c: 3}]], [4, true]])", "a: 1\nb:\n- 2\n- c: 3\n'4': true\n",
         {"a": 1, "b": [2, {"c": 3}], "4": True}),
        ("{m: new Map(), s: new Set([1, new Map([['x', 'y']])])}", "m: {}\ns:\n- 1\n- x: y\n",
         {"m": {}, "s": [1, {"x": "y"}]}),
        ("[new String('a'), new Number(2), new Boolean(false)]", "- a\n- 2\n- false\n",
         ["a", 2, False]),
        ("{constructor: {name: 'RegExp'}, n: 1}", "constructor:\n  name: RegExp\nn: 1\n",
         {"constructor": {"name": "RegExp"}, "n": 1}),
        ("Object.create(null)", "{}\n", {}),
    ],
)  # fmt: skip
def test_maps_and_sets_are_written(
    bench: Any, tmp_path: Path, value: str, text: str, back: Any
) -> None:
    file = tmp_path / "a.yaml"
    assert write(bench, file, value) is True
    assert file.read_text() == text
    assert read(bench, file) == back


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("/x/", "a RegExp"),
        ("{a: new WeakMap()}", "a: expected a value, got a WeakMap"),
        ("[Promise.resolve(1)]", "a Promise"),
        ("new Map([[{}, 1]])", "expected texts as keys of a Map"),
        ("new Map([[1, 1], ['1', 2]])", "expected keys that differ as texts"),
        ("(() => { const m = new Map(); m.set('m', m); return m })()", "not referring to"),
    ],
)
def test_value_without_content_is_refused(
    bench: Any, tmp_path: Path, caplog: Any, value: str, reason: str
) -> None:
    assert write(bench, tmp_path / "a.yaml", value) is False
    assert reason in caplog.records[-1].getMessage()


def test_integers_beyond_those_of_javascript_stay_integers_in_the_file(
    bench: Any, tmp_path: Path
) -> None:
    file = tmp_path / "a.yaml"
    text = (
        "stamp: 1700000000123456789\nhash: 18446744073709551615\nlow: -9223372036854775808\n"
        "text: '18446744073709551616'\nserial: 00012345678901234567\nshort: '12'\n"
    )
    file.write_text(text)
    path = json.dumps(str(file))
    script = f"const v = Ros2.io.readYaml({path}); return [Ros2.io.writeYaml({path}, v), v.stamp]"
    assert bench.run(script) == [True, "1700000000123456789"]
    assert file.read_text() == text


@pytest.mark.both_qt
@pytest.mark.parametrize("kind", ["UInt64", "Int64"])
@pytest.mark.parametrize("count", [3, 40])
def test_arrays_of_wide_integers_come_back(
    bench: Any, tmp_path: Path, kind: str, count: int
) -> None:
    file = tmp_path / "a.yaml"
    most = str(2**64 - 1 if kind == "UInt64" else -(2**63))
    import rosglass
    from rosglass.qml.engine.runtime import runtime_of

    values = [1, int(most), *[7] * (count - 2)]
    received = rosglass.load(f"std_msgs/msg/{kind}MultiArray").create(data=values)
    bench.module = "Ros2 1.0"
    root = bench.load(f"""QtObject {{
        function go(m) {{ return Ros2.io.writeYaml("{file}", m) }} }}""")
    assert root.go(runtime_of(bench.engine).message(received)) is True
    assert read(bench, file, "v.data") == [1, most, *[7] * (count - 2)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: !!str 42", {"a": "42"}),
        ("a: 0x1F", {"a": 31}),
        ("a: 12:30", {"a": "12:30"}),
        ("a: 18446744073709551615", {"a": str(2**64 - 1)}),
        ("a: yes", {"a": True}),
        ("[y, n, no, on, off, true, false]", ["y", "n", False, True, False, True, False]),
        ("- &x {b: 1}\n- *x", [{"b": 1}, {"b": 1}]),
        ("<<: {a: 1}\nb: 2", {"a": 1, "b": 2}),
        ("2: a\ntrue: b", {"2": "a", "true": "b"}),
        ("", None),
    ],
)
def test_files_of_others_are_read(bench: Any, tmp_path: Path, text: str, expected: Any) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(text)
    assert read(bench, file) == expected


def test_relative_paths_start_at_the_working_directory(
    bench: Any, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert write(bench, "a.yaml", "5") is True
    assert read(bench, "a.yaml") == 5
    assert [file.name for file in tmp_path.iterdir() if file.is_file()] == ["a.yaml"]


@pytest.mark.parametrize(
    "text",
    [
        "a: [1",
        "a: 1\na: 2",
        "a: !!python/object/apply:os.system ['true']",
        "a: !unknown 1",
        "\x00",
        "a: &a [*a]",
        # Nine levels of ten aliases each: a billion values.
        "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [{f'*a{i - 1}, ' * 10}]\n" for i in range(1, 10)),
        "[" * 5000,
    ],
)
def test_files_that_make_no_sense_are_refused(
    bench: Any, tmp_path: Path, caplog: Any, text: str
) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(text)
    assert read(bench, file) is False
    assert caplog.records[-1].levelno == logging.ERROR
    assert caplog.records[-1].getMessage().startswith("Ros2.io.readYaml: ")


@pytest.mark.parametrize(
    "path", ["/nope/a.yaml", "http://x/a.yaml", "qrc:///a", "file://host/a", "", "/tmp", "a\x00b"]
)
def test_other_places_are_refused(bench: Any, caplog: Any, path: str) -> None:
    assert read(bench, path) is False
    assert write(bench, path, "1") is False
    texts = [r.getMessage() for r in caplog.records if r.levelno == logging.ERROR]
    assert [text[:18] for text in texts] == ["Ros2.io.readYaml: ", "Ros2.io.writeYaml:"]


@pytest.mark.parametrize(
    "value", ["function() {}", "{a: [() => 1]}", "(() => { const a = {}; a.a = a; return a })()"]
)
def test_unwritable_value_leaves_the_file_alone(bench: Any, tmp_path: Path, value: str) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("before: 1\n")
    assert write(bench, file, value) is False
    assert file.read_text() == "before: 1\n"


@pytest.mark.both_qt
def test_wrong_arguments_throw_or_are_refused(bench: Any) -> None:
    assert bench.run("return [Ros2.io.readYaml(5), Ros2.io.readYaml({})]") == [False, False]


def test_a_drive_that_does_not_answer(bench: Any, tmp_path: Path, monkeypatch: Any) -> None:
    go = threading.Event()
    for name in ("_read", "_replace"):
        monkeypatch.setattr(f"rosglass.qml.elements.yaml_io.{name}", lambda *_: go.wait(60))
    monkeypatch.setattr("rosglass.qml.elements.yaml_io.FILE_TIMEOUT_S", 0.1)
    file = tmp_path / "far.yaml"
    assert read(bench, file) is False
    assert write(bench, file, "{a: 1}") is False
    go.set()
