"""Fields that a message does not have: named once, with place and near name; harmless to ask for.

Qt's engine reads them as undefined without a word, and reports what follows from that with every
message anew, without naming the field.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Bench

pytestmark = pytest.mark.both_qt

#: Read with every message, as a binding of an interface does; what is said is of its lines.
SCREEN = """
    QtObject {
        property int received: 0
        property Subscription s: Subscription { topic: "/odom"; onNewMessage: received++ }
        property var message: s.message
        property var middle: message ? message.pose.pose.positon.x : 0
        property var leaf: message ? message.childFrameId : 0
        property var stamp: message ? message.header.stamp.secs : 0
        property var odd: message ? message.nothing.like : 0
        property bool tested: message && message.foo ? true : false
    }
"""
MESSAGES = 50
MODULES = pytest.mark.parametrize("module", ["Ros2 1.0", "Ros 1.0"])


@pytest.fixture
def said(caplog: pytest.LogCaptureFixture, messages: None) -> Callable[[], list[str]]:
    """Return what was said of QML files, as ``line: text``."""
    caplog.set_level(logging.INFO)
    return lambda: [
        f"{r.lineno}: {r.getMessage()}"
        for r in caplog.records
        if r.pathname.endswith(".qml") and r.levelno >= logging.WARNING
    ]


@MODULES
def test_a_typo_is_named_once_in_all_messages(
    running: Bench, wait: Any, said: Any, module: str, caplog: Any
) -> None:
    running.module = module
    screen = SCREEN.replace("Subscription {", "Subscriber {") if "Ros 1" in module else SCREEN
    root = running.load(screen.replace("property Subscription", "property QtObject"))
    publisher = running.robot.create_publisher("/odom", "nav_msgs/msg/Odometry")

    def enough() -> bool:
        publisher.publish({"pose": {"pose": {"position": {"x": 1}}}})
        return bool(root.property("received") >= MESSAGES)

    wait(enough)
    pose, time, odometry = (
        ("geometry_msgs/msg/Pose", "builtin_interfaces/msg/Time", "nav_msgs/msg/Odometry")
        if "Ros2" in module
        else ("geometry_msgs/Pose", "builtin_interfaces/Time", "nav_msgs/Odometry")
    )
    lines = said()
    undefined = "It is undefined here."
    once = [
        f"9: {pose} has no field 'positon'; did you mean position? It is undefined here.",
        f"10: {odometry} has no field 'childFrameId'; did you mean child_frame_id? {undefined}",
        f"11: {time} has no field 'secs'; did you mean sec? It is undefined here.",
    ]
    lost = f"{odometry} has no field 'nothing'; it has header, child_frame_id, pose, twist"
    once.append(f"12: TypeError: Cannot read property 'like' of undefined; {lost}")
    for line in once:
        assert lines.count(line) == 1, lines
    # What follows from it is said the first, the tenth ... time.
    assert len([line for line in lines if line.startswith("9: TypeError")]) == 2
    assert "(9 more times)" in "".join(lines)
    # Checking for a field is not a mistake.
    assert not [line for line in lines if line.startswith("13:")]
    logged = [r for r in caplog.records if "no field 'foo'" in r.getMessage()]
    assert [(r.lineno, r.levelno) for r in logged] == [(13, logging.INFO)]


@MODULES
def test_messages_are_what_they_were_for_javascript(
    running: Bench, wait: Any, said: Any, module: str
) -> None:
    running.module = module
    name = "Ros" if module == "Ros 1.0" else "Ros2"
    running.robot.create_publisher("/odom", "nav_msgs/msg/Odometry")
    make = f'{name}.createEmptyMessage("nav_msgs/msg/Odometry")'
    found = running.run(
        f"""
        const m = {make}, keys = []
        for (const key in m) keys.push(key)
        const copy = Object.assign({{}}, m)
        const asked = [m.foo, m.name, m.length, m.call, m.bind].every(v => v === undefined)
        const there = ["pose" in m, "foo" in m, m.hasOwnProperty("pose"), m.hasOwnProperty("foo")]
        m.name = "mine"
        m.foo = 3
        return [keys, Object.keys(copy), asked, there, m.name, m.foo, "" + m, m.toString(),
                m.constructor === Object, m.valueOf() === m, m instanceof Object,
                Object.keys(m).slice(-2), JSON.stringify(m.pose.pose.position)]
        """
    )
    fields = ["header", "child_frame_id", "pose", "twist"]
    assert found == [
        *(fields, fields, True, [True, False, True, False], "mine", 3),
        *("[object Object]", "[object Object]", True, True, True, ["name", "foo"]),
        '{"x":0,"y":0,"z":0}',
    ]
    assert said() == []


@MODULES
def test_publishing_and_computing_reads_nothing_that_is_not_there(
    running: Bench, wait: Any, said: Any, module: str
) -> None:
    """A message sent as another type with like fields, and times of all spellings."""
    running.module = module
    name, time, publisher = (
        ("Ros", "Time", 'Ros.advertise("geometry_msgs/Quaternion", "/to", 1)')
        if module == "Ros 1.0"
        else ("Ros2", "Ros2", 'Ros2.createPublisher("/to", "geometry_msgs/msg/Quaternion")')
    )
    root: Any = running.load(
        f"""
        QtObject {{
            property var p: {publisher}
            function is_ready() {{
                return typeof p.isAdvertised === "function" ? p.isAdvertised() : p.isAdvertised
            }}
            function send() {{
                const m = {name}.createEmptyMessage("geometry_msgs/msg/PointStamped")
                const t = {time}.now()
                return [p.publish(m.point), t.add(5), t.subtract(t), m.header.stamp.compare(t),
                        t > m.header.stamp, m.header.stamp.toJSDate()].length
            }}
        }}
        """
    )
    wait(root.is_ready)
    assert root.send() == 6
    assert said() == []
