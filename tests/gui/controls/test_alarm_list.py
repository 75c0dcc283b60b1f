"""The control AlarmList."""

from __future__ import annotations

from typing import Any

import pytest
from rows import DIAGNOSTICS, HOSTILE, part, rows_of

pytestmark = pytest.mark.both_qt


@pytest.fixture
def alarms(controls: Any, wait: Any) -> Any:
    def show(
        control: str = "AlarmList {}", kind: str = DIAGNOSTICS, topic: str = "/diagnostics"
    ) -> Any:
        publisher = controls.robot.create_publisher(topic, kind)
        view = controls.show(control)
        wait(publisher.subscription_count)
        model = controls.find("list").property("model")
        return view, publisher, lambda: rows_of(model)

    return show


def test_alarm_stays_until_over_and_acknowledged(alarms: Any, wait: Any) -> None:
    view, publisher, rows = alarms()
    publisher.publish(status=[part("motor", 2, "hot"), part("camera", 1, "slow")])
    wait(lambda: view.property("total") == 1)
    assert (rows()[0]["name"], rows()[0]["active"]) == ("motor", True)
    publisher.publish(status=[part("motor", 0, "cool")])
    wait(lambda: view.property("active") == 0)
    assert view.property("unacknowledged") == 1
    assert rows()[0]["ended"]
    view.acknowledgeAll()
    assert rows() == []
    # The other way around.
    publisher.publish(status=[part("motor", 2, "hot")])
    wait(lambda: view.property("total") == 1)
    view.acknowledgeAll()
    assert (view.property("total"), view.property("unacknowledged")) == (1, 0)
    publisher.publish(status=[part("motor", 0)])
    wait(lambda: view.property("total") == 0)


def test_first_alarm_is_marked(alarms: Any, wait: Any) -> None:
    view, publisher, rows = alarms()
    publisher.publish(status=[part("fuse", 2)])
    wait(lambda: view.property("total") == 1)
    publisher.publish(status=[part("drive", 2), part("arm", 2)])
    wait(lambda: view.property("total") == 3)
    assert {row["name"]: row["first"] for row in rows()} == {
        "fuse": True, "drive": False, "arm": False
    }  # fmt: skip
    assert rows()[0]["name"] == "fuse"
    view.acknowledgeAll()
    publisher.publish(status=[part("lamp", 2)])
    wait(lambda: view.property("total") == 4)
    assert next(row["name"] for row in rows()) == "lamp"
    assert rows()[0]["first"]


def test_alarm_that_comes_again_or_gets_worse_is_news(alarms: Any, wait: Any) -> None:
    view, publisher, rows = alarms('AlarmList { minLevel: "warning" }')
    publisher.publish(status=[part("motor", 1)])
    wait(lambda: view.property("unacknowledged") == 1)
    view.acknowledgeAll()
    publisher.publish(status=[part("motor", 2)])
    wait(lambda: view.property("unacknowledged") == 1)
    publisher.publish(status=[part("motor", 0)])
    wait(lambda: view.property("active") == 0)
    publisher.publish(status=[part("motor", 1)])
    wait(lambda: view.property("active") == 1)
    assert rows()[0]["times"] == 2
    # A report of the same changes nothing.
    view.acknowledgeAll()
    publisher.publish(status=[part("motor", 1, "still")])
    wait(lambda: rows()[0]["text"] == "still")
    assert view.property("unacknowledged") == 0


def test_part_that_falls_silent_is_an_alarm(alarms: Any, wait: Any) -> None:
    view, publisher, rows = alarms()
    publisher.publish(status=[part("camera", 3, "no data")])
    wait(lambda: view.property("total") == 1)
    assert rows()[0]["level"] == 3


BOOL = "std_msgs/msg/Bool"


def test_topic_of_bool_is_an_alarm(alarms: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = alarms(
        'AlarmList { diagnostics: false; topics: [{ topic: "/estop", text: "Stop" }, '
        '{ topic: "/door/closed", when: false, level: "warning" }] }',
        BOOL,
        "/estop",
    )
    door = controls.robot.create_publisher("/door/closed", BOOL)
    wait(door.subscription_count)
    more = controls.find("more")
    assert more.property("text") == "no data yet: /estop, /door/closed"
    publisher.publish(data=False)
    door.publish(data=True)
    wait(lambda: more.property("text") == "")
    assert rows() == []
    publisher.publish(data=True)
    door.publish(data=False)
    wait(lambda: len(rows()) == 2)
    assert {(row["name"], row["level"]) for row in rows()} == {("Stop", 2), ("/door/closed", 1)}
    view.acknowledgeAll()
    publisher.publish(data=False)
    wait(lambda: len(rows()) == 1)
    # A lost publisher raises it, too.
    publisher.close()
    wait(lambda: any(row["level"] == 3 and row["name"] == "Stop" for row in rows()))


def test_enter_acknowledges_the_selected_alarm(alarms: Any, controls: Any, wait: Any) -> None:
    from rosglass.qt import QtCore, QtGui

    view, publisher, rows = alarms()
    publisher.publish(status=[part("a", 2), part("b", 2)])
    wait(lambda: view.property("total") == 2)
    controls.find("rows").forceActiveFocus()
    app = QtGui.QGuiApplication.instance()
    for key in (QtCore.Qt.Key.Key_Down, QtCore.Qt.Key.Key_Return):
        for kind in (QtCore.QEvent.Type.KeyPress, QtCore.QEvent.Type.KeyRelease):
            modifiers = QtCore.Qt.KeyboardModifier.NoModifier
            app.sendEvent(controls.window, QtGui.QKeyEvent(kind, key, modifiers))
    wait(lambda: view.property("unacknowledged") == 1)
    assert {row["name"] for row in rows() if row["acknowledged"]} == {"a"}


def test_new_alarm_ends_the_muting(alarms: Any, controls: Any, wait: Any) -> None:
    view, publisher, _rows = alarms()
    raised = []
    view.raised.connect(raised.append)
    publisher.publish(status=[part("a", 2)])
    wait(lambda: raised == ["a"])
    view.setProperty("muted", True)
    publisher.publish(status=[part("a", 2)])
    publisher.publish(status=[part("a", 2), part("b", 2)])
    wait(lambda: raised == ["a", "b"])
    assert not view.property("muted")


def test_many_and_hostile_alarms_are_bounded(alarms: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = alarms()
    publisher.publish(status=[part(HOSTILE, 2, HOSTILE)])
    wait(lambda: view.property("total") == 1)
    assert len(rows()[0]["name"]) < 600
    publisher.publish(status=[part(str(at), 2) for at in range(1500)])
    wait(lambda: view.property("total") == 1000)
    wait(lambda: "further alarms not shown" in controls.find("more").property("text"))
    assert not controls.grab().isNull()
    view.acknowledgeAll()
    assert view.property("unacknowledged") == 0
