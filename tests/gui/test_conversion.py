"""Values that QML gives for messages: all that the plugins take without loss, in both modules."""
# ruff: noqa: N802 - item models have Qt's names

from __future__ import annotations

from typing import Any

import pytest
from values import convert, converted

import rosglass
from rosglass.errors import ConversionError

pytestmark = pytest.mark.both_qt

POINT = {"x": 1.0, "y": 2.0, "z": 3.0}
XYZ, XYZW = "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Quaternion"


def of_property(bench: Any, body: str, type_name: Any, module: int = 2) -> dict:
    """Return the message that the property `v` of a QML object is."""
    root = bench.load(f"Item {{ {body} }}", "import QtQuick 2.15")
    value = bench.engine.toScriptValue(root).property("v")
    return converted(value, type_name, module=module)


@pytest.mark.parametrize("module", [1, 2])
@pytest.mark.parametrize(
    ("type_name", "script", "expected"),
    [
        (XYZ, "Qt.vector3d(1, 2, 3)", POINT),
        (XYZ, "Qt.vector2d(1, 2)", {**POINT, "z": 0.0}),
        (XYZ, "Qt.point(1, 2)", {**POINT, "z": 0.0}),
        (XYZW, "Qt.vector4d(1, 2, 3, 4)", {**POINT, "w": 4.0}),
        (XYZW, "Qt.quaternion(4, 1, 2, 3)", {**POINT, "w": 4.0}),
        ("std_msgs/msg/Int32", "{data: 3.0}", {"data": 3}),
        ("std_msgs/msg/Float32", "{data: 1}", {"data": 1.0}),
        ("std_msgs/msg/Int64", "{data: '-9007199254740993'}", {"data": -(2**53) - 1}),
    ],
)
def test_both_modules_take(
    bench: Any, module: int, type_name: str, script: str, expected: dict
) -> None:
    assert convert(bench, type_name, script, module=module) == expected


@pytest.mark.parametrize("module", [1, 2])
@pytest.mark.parametrize(
    "body",
    [
        "property QtObject v: QtObject { property real x: 1; property int y: 2; property var z: 3}",
        "property vector3d v: Qt.vector3d(1, 2, 3)",
        "property var v: ({x: 1, y: 2, z: 3})",
        """property var v: QtObject { property real x: 1; property real y: 2; property int z: 3
                                      property string other }""",
    ],
)
def test_properties_and_objects_of_qml_are_messages(bench: Any, module: int, body: str) -> None:
    assert of_property(bench, body, XYZ, module) == POINT


@pytest.mark.parametrize("module", [1, 2])
def test_nested_objects_of_qml(bench: Any, module: int) -> None:
    body = """property QtObject v: QtObject {
        property QtObject header: QtObject { property date stamp: new Date(2500)
                                             property string frame_id: "map" }
        property var point: Qt.vector3d(1, 2, 3) }"""
    made = of_property(bench, body, "geometry_msgs/msg/PointStamped", module)
    header = {"stamp": {"sec": 2, "nanosec": 500_000_000}, "frame_id": "map"}
    assert made == {"header": header, "point": POINT}


@pytest.mark.parametrize("module", [1, 2])
def test_urls_are_texts(bench: Any, module: int) -> None:
    body = 'property url u: "file:///a/b"; property var v: ({data: u})'
    assert of_property(bench, body, "std_msgs/msg/String", module) == {"data": "file:///a/b"}


@pytest.mark.parametrize("module", [1, 2])
def test_item_models_are_arrays(bench: Any, module: int) -> None:
    body = """property var keep: ListModel { id: list
                  ListElement { x: 1; y: 2; z: 3 } ListElement { x: 4 } }
              property var v: ({points: list})"""
    polygon = of_property(bench, body, "geometry_msgs/msg/Polygon", module)
    assert polygon["points"] == [POINT, {"x": 4.0, "y": 0.0, "z": 0.0}]
    body = """property var keep: ListModel { id: list
                  ListElement { first: "a" } ListElement { first: "b" } }
              property var v: ({name: list})"""
    assert of_property(bench, body, "sensor_msgs/msg/JointState", module)["name"] == ["a", "b"]


def test_item_models_of_python_are_arrays(bench: Any) -> None:
    from rosglass.qt import QtCore

    class Numbers(QtCore.QAbstractListModel):
        def rowCount(self, parent: Any = None) -> int:
            return 40

        def data(self, index: Any, role: int = 0) -> Any:
            return index.row() * 0.5

        def roleNames(self) -> dict:
            return {256: QtCore.QByteArray(b"value"), 257: QtCore.QByteArray(b"later")}

    model = Numbers(bench.engine)
    value = bench.engine.newObject()
    value.setProperty("ranges", bench.engine.newQObject(model))
    made = converted(value, "sensor_msgs/msg/LaserScan")
    assert list(made["ranges"]) == [0.5 * i for i in range(40)]


@pytest.mark.parametrize("module", [1, 2])
def test_the_single_role_of_an_item_model_holds_the_elements(bench: Any, module: int) -> None:
    from rosglass.qt import QtCore

    class Points(QtCore.QAbstractListModel):
        def rowCount(self, parent: Any = None) -> int:
            return 2

        def data(self, index: Any, role: int = 0) -> Any:
            return {"x": 1.0 + index.row(), "y": 2.0, "z": 3.0}

        def roleNames(self) -> dict:
            return {256: QtCore.QByteArray(b"modelData")}

    model = Points(bench.engine)
    value = bench.engine.newObject()
    value.setProperty("points", bench.engine.newQObject(model))
    made = converted(value, "geometry_msgs/msg/Polygon", module=module)
    assert made["points"] == [POINT, {"x": 2.0, "y": 2.0, "z": 3.0}]


@pytest.mark.parametrize("module", [1, 2])
@pytest.mark.parametrize("field", ["Time", "Duration"])
def test_a_role_of_milliseconds_fills_times(bench: Any, module: int, field: str) -> None:
    body = """property var keep: ListModel { id: list
                  ListElement { at: 1500 } ListElement { at: 2000 } }
              property var v: ({times: list})"""
    library = rosglass.Library()
    library.add_text(f"odd_msgs/msg/{field}s", f"builtin_interfaces/{field}[] times\n")
    kind = rosglass.load(f"odd_msgs/msg/{field}s", library=library)
    made = of_property(bench, body, kind, module)
    assert made["times"] == [{"sec": 1, "nanosec": 500_000_000}, {"sec": 2, "nanosec": 0}]


def test_unknown_roles_are_named(bench: Any) -> None:
    body = """property var keep: ListModel { id: list
                  ListElement { x: 1; q: 2 } }
              property var v: ({points: list})"""
    with pytest.raises(ConversionError, match=r"points\[0\]\.q"):
        of_property(bench, body, "geometry_msgs/msg/Polygon")


@pytest.mark.parametrize(
    ("type_name", "script", "expected"),
    [
        ("std_msgs/msg/Int32", "'42'", 42),
        ("std_msgs/msg/Int32", "' -7.0 '", -7),
        ("std_msgs/msg/Int32", "true", 1),
        ("std_msgs/msg/Float64", "'2.5e3'", 2500.0),
        ("std_msgs/msg/Bool", "1", True),
        ("std_msgs/msg/Bool", "'false'", False),
        ("std_msgs/msg/String", "5", "5"),
        ("std_msgs/msg/String", "0.1", "0.1"),
        ("std_msgs/msg/String", "1e-7", "1e-7"),
        ("std_msgs/msg/String", "NaN", "NaN"),
        ("std_msgs/msg/String", "true", "true"),
    ],
)
def test_ros2_takes_texts_for_numbers_where_nothing_is_lost(
    bench: Any, type_name: str, script: str, expected: Any
) -> None:
    assert convert(bench, type_name, f"{{data: {script}}}") == {"data": expected}
    with pytest.raises(ConversionError, match="data: "):
        convert(bench, type_name, f"{{data: {script}}}", module=1)


@pytest.mark.parametrize("module", [1, 2])
def test_texts_in_arrays_take_numbers(bench: Any, module: int) -> None:
    script = "{name: ['a', 3456.0, true, 0.5]}"
    made = convert(bench, "sensor_msgs/msg/JointState", script, module=module)
    assert made["name"] == ["a", "3456", "true", "0.5"]


@pytest.mark.parametrize("module", [1, 2])
@pytest.mark.parametrize(
    ("type_name", "script", "path"),
    [
        ("std_msgs/msg/UInt8", "{data: 300}", "data"),
        ("std_msgs/msg/Int32", "{data: 3.7}", "data"),
        ("std_msgs/msg/Int32", "{data: '3.7'}", "data"),
        ("std_msgs/msg/Int32", "{data: ''}", "data"),
        ("std_msgs/msg/Float64", "{data: '1,5'}", "data"),
        ("std_msgs/msg/Float64", "{data: '0x10'}", "data"),
        ("std_msgs/msg/Bool", "{data: 2}", "data"),
        ("std_msgs/msg/Bool", "{data: 'maybe'}", "data"),
        ("std_msgs/msg/Int32", "{data: new Date()}", "data"),
        ("std_msgs/msg/String", "{data: [1]}", "data"),
        ("std_msgs/msg/String", "{data: null}", "data"),
        ("std_msgs/msg/Int32", "{dta: 1}", "dta"),
        ("std_msgs/msg/Header", "{stamp: {sec: 1, nano: 2}}", "stamp.nano"),
        ("std_msgs/msg/Header", "{stamp: {sec: 'x'}}", "stamp.sec"),
        ("geometry_msgs/msg/Twist", "{linear: Qt.quaternion(1, 2, 3, 4)}", "linear.w"),
        ("geometry_msgs/msg/Twist", "{linear: function() {}}", "linear"),
        ("geometry_msgs/msg/Polygon", "{points: [{}, 5]}", "points[1]"),
        ("geometry_msgs/msg/Polygon", "{points: [{x: 'a'}]}", "points[0].x"),
    ],
)
def test_both_modules_refuse_and_name(
    bench: Any, module: int, type_name: str, script: str, path: str
) -> None:
    with pytest.raises(ConversionError) as error:
        convert(bench, type_name, script, module=module)
    assert error.value.path == path


def test_publishing_what_does_not_fit_throws_into_javascript(running: Any, wait: Any) -> None:
    root = running.load("""QtObject {
        property var pub: Ros2.createPublisher("/t", "geometry_msgs/msg/Twist", 1)
        function go() { try { pub.publish({linear: {x: "fast"}}) } catch (e) { return String(e) } }
    }""")
    wait(lambda: root.property("pub").property("isAdvertised"))
    assert "linear.x: expected a number (float64), got 'fast'" in root.go()
