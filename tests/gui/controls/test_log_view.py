"""The control LogView."""

from __future__ import annotations

from typing import Any

import pytest
from hands import clipboard, key
from rows import HOSTILE, rows_of

pytestmark = pytest.mark.both_qt
TYPE = "rcl_interfaces/msg/Log"


@pytest.fixture
def shown(controls: Any, wait: Any) -> Any:
    def show(control: str = 'LogView { topic: "/log" }', kind: str = TYPE) -> Any:
        publisher = controls.robot.create_publisher("/log", kind, 1000)
        view = controls.show(control, 700, 400)
        wait(publisher.subscription_count)
        model = controls.find("list").property("model")
        return view, publisher, lambda: rows_of(model)

    return show


def numbers(value: Any) -> list[int]:
    """Return a list of QML."""
    return value.toVariant() if hasattr(value, "toVariant") else value


def test_levels_are_named(shown: Any, wait: Any) -> None:
    view, publisher, rows = shown('LogView { topic: "/log"; minLevel: 0 }')
    for level in (10, 20, 30, 40, 50, 7):
        publisher.publish(level=level, name="/node", msg="text", file="a.cpp", line=7, function="f")
    wait(lambda: len(rows()) == 6)
    assert [row["level"] for row in rows()] == [0, 1, 2, 3, 4, 0]
    assert rows()[5]["text"] == "level 7: text"
    assert rows()[0]["where"] == "a.cpp:7 f"
    assert numbers(view.property("counts")) == [2, 1, 1, 1, 1]


def test_log_of_a_node(live_controls: Any, wait: Any) -> None:
    """The logs of ROS 2 and of ROS 1, which has other levels, are found and shown alike."""
    controls = live_controls
    controls.show("LogView { minLevel: 0; nodeFilter: 'robot' }")
    model = controls.find("list").property("model")
    controls.robot.logger.setLevel(10)
    for method in ("debug", "info", "warning", "error", "critical"):
        getattr(controls.robot.logger, method)(f"some {method}")

    def levels() -> dict[str, int]:
        return {row["text"]: row["level"] for row in rows_of(model)}

    wanted = {"some debug": 0, "some info": 1, "some warning": 2, "some error": 3}

    def complete() -> bool:
        controls.robot.logger.critical("some critical")
        return wanted.items() <= levels().items() and levels().get("some critical") == 4

    wait(complete, levels)


def test_filters_hide_and_count(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    for name, text, level in (("/arm", "Hot", 30), ("/base", "hot", 20), ("/arm", "cold", 10)):
        publisher.publish(name=name, msg=text, level=level)
    wait(lambda: len(rows()) == 2)
    wait(lambda: controls.find("more").property("text") == "1 filtered out")
    view.setProperty("textFilter", "HOT")
    view.setProperty("nodeFilter", "arm")
    assert [row["node"] for row in rows()] == ["/arm"]
    wait(lambda: controls.find("more").property("text") == "2 filtered out")
    view.setProperty("minLevel", 3)
    assert rows() == []
    view.setProperty("minLevel", 0)
    view.setProperty("textFilter", "")
    assert [row["text"] for row in rows()] == ["Hot", "cold"]


def test_pause_keeps_the_rows_and_counts_the_new(shown: Any, wait: Any) -> None:
    view, publisher, rows = shown('LogView { topic: "/log"; keep: 10 }')
    for at in range(8):
        publisher.publish(level=20, msg=f"before {at}")
    wait(lambda: len(rows()) == 8)
    view.setProperty("paused", True)
    for at in range(15):
        publisher.publish(level=20, msg=f"after {at}")
    wait(lambda: view.property("note") == "PAUSED · 15 new")
    assert [row["text"] for row in rows()] == [f"before {at}" for at in range(8)]
    view.setProperty("paused", False)
    wait(lambda: [row["text"] for row in rows()] == [f"after {at}" for at in range(5, 15)])


def test_buffer_is_bounded_and_counts_what_it_removes(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown('LogView { topic: "/log"; keep: 100 }')
    for at in range(250):
        publisher.publish(level=20, msg=str(at))
    wait(lambda: rows() and rows()[-1]["text"] == "249")
    assert [row["text"] for row in rows()] == [str(at) for at in range(150, 250)]
    wait(lambda: "150 older ones removed" in controls.find("more").property("text"))
    view.clear()
    assert rows() == []
    publisher.publish(level=20, msg="new")
    wait(lambda: [row["text"] for row in rows()] == ["new"])


def test_flood_is_counted(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown('LogView { topic: "/log"; keep: 50 }')
    for at in range(5000):
        publisher.publish(level=20, msg=str(at))
    wait(lambda: rows() and rows()[-1]["text"] == "4999")
    more = controls.find("more")
    wait(lambda: "lost" in more.property("text"))

    def counted() -> int:
        lost = int(more.property("text").split(" · ")[-1].split()[0])
        return int(sum(numbers(view.property("counts")))) + lost

    # Those that wait for their turn come later, as does the count of those lost in between.
    wait(lambda: counted() == 5000, counted)


def test_hostile_texts_are_plain_and_bounded(shown: Any, controls: Any, wait: Any) -> None:
    _view, publisher, rows = shown()
    publisher.publish(
        level=255, name=HOSTILE, msg=HOSTILE, file=HOSTILE, function=HOSTILE, line=2**32 - 1,
        stamp={"sec": -(2**31), "nanosec": 2**32 - 1},
    )  # fmt: skip
    publisher.publish(level=20, msg="one\ntwo", stamp={"sec": 12, "nanosec": 5_000_000})
    wait(lambda: len(rows()) == 2)
    bad, good = rows()
    assert max(map(len, (bad["node"], bad["text"], bad["line"], bad["where"]))) < 4100
    assert "\x1b" not in bad["text"] + bad["node"]
    assert (good["time"], good["line"]) == ("12.005", "one ⏎ two")
    controls.find("list").setProperty("currentIndex", 0)
    assert controls.find("details").property("visible")
    assert not controls.grab().isNull()


def test_keyboard_selects_copies_and_pauses(shown: Any, controls: Any, wait: Any) -> None:

    view, publisher, rows = shown()
    for text in ("one", "two"):
        publisher.publish(level=40, name="/n", msg=text, stamp={"sec": 3})
    wait(lambda: len(rows()) == 2)
    controls.find("rows").forceActiveFocus()
    key(controls, "End")
    key(controls, "C", control=True)
    wait(lambda: clipboard() == "3.000 ERROR [/n] two")
    key(controls, "Escape")
    view.copy()
    assert clipboard().count("\n") == 1
    key(controls, "P")
    assert view.property("paused")


def test_list_follows_the_newest_until_it_is_scrolled(shown: Any, controls: Any, wait: Any) -> None:
    _view, publisher, rows = shown()
    listed = controls.find("rows")
    for at in range(100):
        publisher.publish(level=20, msg=str(at))
    wait(lambda: len(rows()) == 100 and listed.property("contentY") > 500)
    wait(lambda: listed.property("atYEnd"))
    controls.find("list").setProperty("currentIndex", 5)
    place = listed.property("contentY")
    publisher.publish(level=20, msg="new")
    wait(lambda: len(rows()) == 101)
    assert listed.property("contentY") == pytest.approx(place)


def test_robot_that_logs_nothing_more_is_not_stale(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, _rows = shown()
    assert view.property("status") == "NO DATA YET"
    publisher.publish(level=20, msg="up")
    wait(lambda: not view.property("stale"))
    publisher.close()
    wait(lambda: view.property("stale"))
