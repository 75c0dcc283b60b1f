"""Messages as trees that views show and edit."""

from __future__ import annotations

import logging
from typing import Any

import pytest

MODEL = """MessageItemModel {
    property var log: []
    property int edits: 0
    property int messages: 0
    property var renamed: []
    onModified: edits += 1
    onMessageChanged: messages += 1
    onRowsInserted: (parent, first, last) => log.push(["in", first, last])
    onRowsRemoved: (parent, first, last) => log.push(["out", first, last])
    onDataChanged: (first, last) => { if (first.column === 0) renamed.push(first.row, last.row) }
    onModelReset: log.push(["reset"])
    // The index of a path of rows: at([0, 1], 1) is the value of the first field's second.
    function at(rows, column) {
        let found = index(rows[0], rows.length === 1 ? column : 0)
        for (let i = 1; i < rows.length; ++i)
            found = index(rows[i], i === rows.length - 1 ? column : 0, found)
        return found
    }
    function tree(parent) {
        const out = []
        for (let r = 0; r < (parent ? rowCount(parent) : rowCount()); ++r) {
            const i = parent ? index(r, 0, parent) : index(r, 0)
            const v = parent ? index(r, 1, parent) : index(r, 1)
            out.push(rowCount(i) ? [data(i, 0), data(i, 257), tree(i)]
                                 : [data(i, 0), data(i, 257), data(v, 0)])
        }
        return out
    }
    function go() { return JSON.stringify((function () { SCRIPT })()) }
}"""
JOINTS = "{'#messageType': 'sensor_msgs/msg/JointState', name: ['a', 'b'], position: [1, 2]}"


def run(bench: Any, script: str) -> Any:
    """Return what a script makes that runs inside a model."""
    import json

    root = bench.load(MODEL.replace("SCRIPT", script))
    text = root.go()
    return None if text is None else json.loads(text)


@pytest.mark.both_qt
def test_the_tree_of_a_message(bench: Any) -> None:
    script = """message = Ros2.createEmptyMessage('geometry_msgs/msg/PointStamped')
        return [messageType, columnCount(), tree()]"""
    name, columns, tree = run(bench, script)
    assert (name, columns) == ("geometry_msgs/msg/PointStamped", 2)
    stamp = ["stamp", "compound", [["sec", "int32", 0], ["nanosec", "uint32", 0]]]
    point = [[axis, "double", 0] for axis in "xyz"]
    assert tree == [
        ["header", "compound", [stamp, ["frame_id", "string", ""]]],
        ["point", "compound", point],
    ]


def test_arrays_and_their_elements(bench: Any) -> None:
    script = f"""message = {JOINTS}
        return [tree().slice(1, 4), data(at([1, 0], 0), 259), data(at([1], 0), 259)]"""
    tree, element, field = run(bench, script)
    assert tree == [
        ["name", "array", [[0, "string", "a"], [1, "string", "b"]]],
        ["position", "array", [[0, "double", 1], [1, "double", 2]]],
        ["velocity", "array", ""],
    ]
    assert (element, field) == (True, False)


def test_the_tree_index_is_the_row(bench: Any) -> None:
    script = f"message = {JOINTS}; return data(data(at([2], 1), 258), 0)"
    assert run(bench, script) == "position"


@pytest.mark.both_qt
def test_only_values_have_an_edit_role(bench: Any) -> None:
    """Editors for qml6_ros2_plugin, such as RQml's, distinguish names from fields by it."""
    script = """message = {"#messageType": "geometry_msgs/msg/PointStamped", point: {x: 1.5}}
        const cells = [at([1, 0], 0), at([1, 0], 1)]
        const edit = Qt.EditRole
        return [cells.map(cell => data(cell)), cells.map(cell => data(cell, edit) === undefined),
                data(cells[1], edit)]"""
    names, missing, value = run(bench, script)
    assert names == ["x", 1.5]
    assert missing == [True, False]
    assert value == 1.5


@pytest.mark.both_qt
def test_arrays_that_may_grow_have_an_edit_role(bench: Any) -> None:
    """Editors for qml6_ros2_plugin offer to add an element by it."""
    script = """message = Ros2.createEmptyMessage("sensor_msgs/msg/Imu")
        const fixed = data(at([2], 1), Qt.EditRole)
        message = Ros2.createEmptyMessage("sensor_msgs/msg/JointState")
        const edit = Qt.EditRole, cells = [at([0], 1), at([1], 1), at([1], 0)]
        return [fixed === undefined, cells.map(cell => data(cell, edit) === undefined)]"""
    assert run(bench, script) == [True, [True, False, True]]


def test_an_edit_leaves_the_field_alone_that_is_typed_in(bench: Any) -> None:
    script = """const name = "geometry_msgs/msg/PointStamped"
        if (message === undefined) message = {"#messageType": name}
        else setData(at([1, 0], 1), 2.5)
        return message.point.x"""
    root = bench.load(MODEL.replace("SCRIPT", script))
    assert root.go() == "0"
    changed: list[list[int]] = []
    root.dataChanged.connect(lambda *given: changed.append(list(given[2])))
    assert root.go() == "2.5"
    assert changed == [[0]]  # not the edit role


@pytest.mark.both_qt
def test_leaves_can_be_edited(bench: Any) -> None:
    script = """message = Ros2.createEmptyMessage('geometry_msgs/msg/PointStamped')
        const before = messages
        const done = [setData(at([1, 0], 1), 1.5), setData(at([1, 1], 1), '2.5'),
                      setData(at([0, 1], 1), 'map'), setData(at([0, 0, 0], 1), 4)]
        return [done, edits, messages - before, message.point, message.header.frame_id,
                message.header.stamp.sec, data(at([1, 0], 1), 2)]"""
    done, edits, messages, point, frame, sec, shown = run(bench, script)
    assert done == [True] * 4
    assert (edits, messages) == (4, 4)
    assert point == {"x": 1.5, "y": 2.5, "z": 0}
    assert (frame, sec, shown) == ("map", 4, 1.5)


@pytest.mark.parametrize(
    ("rows", "column", "value"),
    [
        ("[1, 0]", 1, "'fast'"),
        ("[1, 0]", 0, "1"),
        ("[1]", 1, "1"),
        ("[0, 0, 0]", 1, "-1"),
        ("[0, 0, 0]", 1, "1.5"),
        ("[0, 0, 1]", 1, "4294967296"),
        ("[0, 1]", 1, "undefined"),
        ("[7]", 1, "1"),
    ],
)
def test_invalid_value_changes_nothing(bench: Any, rows: str, column: int, value: str) -> None:
    script = f"""message = Ros2.createEmptyMessage('geometry_msgs/msg/PointStamped')
        return [setData(at({rows}, {column}), {value}), edits, message]"""
    done, edits, message = run(bench, script)
    assert (done, edits) == (False, 0)
    assert message["point"] == {"x": 0, "y": 0, "z": 0}
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}


@pytest.mark.both_qt
def test_elements_can_be_edited_inserted_and_removed(bench: Any) -> None:
    script = f"""message = {JOINTS}; log = []
        const names = at([1], 0), positions = at([2], 0)
        const done = [setData(at([1, 1], 1), 'z'), setData(at([2, 0], 1), 7),
                      insertRows(1, 2, positions), removeRows(0, 1, names)]
        const {{name, position}} = message
        return [done, edits, log, name, position, data(at([1, 0], 0), 0), renamed]"""
    done, edits, log, names, positions, index, renamed = run(bench, script)
    assert renamed == [3, 3, 0, 0]
    assert done == [True] * 4
    assert (edits, log) == (4, [["in", 1, 2], ["out", 0, 0]])
    assert (names, positions, index) == (["z"], [7, 0, 0, 2], 0)


def test_arrays_of_messages_grow(bench: Any) -> None:
    script = """message = Ros2.createEmptyMessage('tf2_msgs/msg/TFMessage')
        const done = [insertRows(0, 2, at([0], 0)), setData(at([0, 1, 1], 1), 'child')]
        return [done, message.transforms.map(t => t.child_frame_id),
                message.transforms[0].transform.rotation.w]"""
    assert run(bench, script) == [[True, True], ["", "child"], 1]


@pytest.mark.parametrize(
    ("message", "call"),
    [
        (JOINTS, "insertRows(99, 1, at([2], 0))"),
        (JOINTS, "insertRows(0, 0, at([2], 0))"),
        (JOINTS, "insertRows(0, 1e9, at([2], 0))"),
        (JOINTS, "insertRows('x', 1, at([2], 0))"),
        (JOINTS, "insertRows(0, 1, at([0], 0))"),
        (JOINTS, "insertRows(0, 1)"),
        (JOINTS, "removeRows(1, 2, at([2], 0))"),
        (JOINTS, "removeRows(-1, 1, at([2], 0))"),
        (
            "{'#messageType': 'geometry_msgs/msg/PoseWithCovariance'}",
            "insertRows(0, 1, at([1], 0))",
        ),
        (
            "{'#messageType': 'geometry_msgs/msg/PoseWithCovariance'}",
            "removeRows(0, 1, at([1], 0))",
        ),
    ],
)
def test_lengths_that_the_type_does_not_allow(bench: Any, message: str, call: str) -> None:
    assert run(bench, f"message = {message}; return [{call}, edits]") == [False, 0]


def test_bounded_arrays_stay_within_their_bound(bench: Any) -> None:
    script = """message = {'#messageType': 'shape_msgs/msg/SolidPrimitive', dimensions: [1, 2]}
        const rows = at([1], 0)
        return [insertRows(0, 2, rows), insertRows(0, 1, rows), message.dimensions]"""
    assert run(bench, script) == [False, True, [0, 1, 2]]


def test_new_messages_of_the_same_type_keep_the_tree(bench: Any) -> None:
    script = f"""message = {JOINTS}; tree(); log = []
        const first = at([1, 0], 1)
        message = {{name: ['q', 'r', 's'], position: [9]}}
        return [log, data(first, 0), tree()[1][2].length]"""
    log, first, names = run(bench, script)
    assert sorted(log) == [["in", 2, 2], ["out", 1, 1]]
    assert (first, names) == ("q", 3)


def test_another_type_starts_anew(bench: Any) -> None:
    script = f"""message = {JOINTS}
        messageType = 'geometry_msgs/msg/Twist'
        const empty = [rowCount(), message === undefined]
        message = {{linear: {{x: 5}}}}
        return [empty, message.linear.x, message['#messageType'], rowCount()]"""
    assert run(bench, script) == [[0, True], 5, "geometry_msgs/msg/Twist", 2]


def test_the_type_may_be_set_after_the_message(bench: Any) -> None:
    script = """message = {x: 3}
        const before = rowCount(); messageType = 'geometry_msgs/msg/Point'
        return [before, rowCount(), message.x]"""
    assert run(bench, script) == [0, 3, 3]


@pytest.mark.parametrize(
    "value", ["{linear: {q: 1}}", "{'#messageType': 'nope/msg/X'}", "5", "'x'", "function() {}"]
)
def test_invalid_message_leaves_the_last_one(bench: Any, caplog: Any, value: str) -> None:
    script = f"""message = {{'#messageType': 'geometry_msgs/msg/Twist', linear: {{x: 5}}}}
        message = {value}; return message.linear.x"""
    assert run(bench, script) == 5
    found = [r for r in caplog.records if r.levelno == logging.ERROR]
    assert len(found) == 1
    assert found[0].getMessage().startswith("MessageItemModel: the message is not shown: ")
    assert found[0].pathname.endswith(".qml")


@pytest.mark.both_qt
def test_wide_integers_and_long_arrays(bench: Any) -> None:
    script = """message = {'#messageType': 'std_msgs/msg/UInt64', data: '18446744073709551615'}
        const i = at([0], 1)
        const wide = [data(i, 0), setData(i, '18446744073709551614'), message.data]
        message = {'#messageType': 'sensor_msgs/msg/Image', data: new Uint8Array(100000)}
        return [wide, rowCount(at([6], 0)), setData(at([6, 99999], 1), 7), message.data.at(-1)]"""
    wide, rows, done, last = run(bench, script)
    assert wide == [str(2**64 - 1), True, str(2**64 - 2)]
    assert (rows, done, last) == (100_000, True, 7)


def test_undefined_clears(bench: Any) -> None:
    script = f"message = {JOINTS}; message = undefined; return [rowCount(), message === undefined]"
    assert run(bench, script) == [0, True]


def test_it_shows_what_a_subscription_receives(running: Any, wait: Any) -> None:
    root = running.load("""QtObject {
        property Subscription sub: Subscription { topic: "/point" }
        function subscribed() { return sub.subscribed }
        property MessageItemModel model: MessageItemModel { message: sub.message }
        function shown() { return model.rowCount() ? model.data(model.index(0, 1), 0) : -1 } }""")
    from rosglass.comm import QoS

    publisher = running.robot.create_publisher("/point", "geometry_msgs/msg/Point", QoS())
    wait(lambda: root.subscribed() and publisher.subscription_count())
    publisher.publish({"x": 4.5})
    wait(lambda: root.shown() == 4.5)


@pytest.mark.both_qt
def test_qts_own_checks_of_models_pass(bench: Any) -> None:
    from rosglass.qml.elements.message_item_model import MessageItemModel
    from rosglass.qt import optional

    test = optional("QtTest")
    if test is None or not hasattr(test, "QAbstractItemModelTester"):
        pytest.skip("this Qt binding brings no QAbstractItemModelTester")
    root = bench.load(MODEL.replace("SCRIPT", f"message = {JOINTS}; return tree()"))
    assert isinstance(root, MessageItemModel)
    mode = test.QAbstractItemModelTester.FailureReportingMode.Fatal
    tester = test.QAbstractItemModelTester(root, mode)
    root.go()
    names = root.index(1, 0)
    # Only at the end: the tester expects that rows keep what they show, but names are indices.
    assert root.insertRows(2, 3, names)
    assert root.removeRows(3, 2, names)
    assert root.setData(root.index(0, 1, names), "x")
    assert tester.model() is root
