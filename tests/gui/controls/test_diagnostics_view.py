"""The control DiagnosticsView."""

from __future__ import annotations

import random
from typing import Any

import pytest
from rows import DIAGNOSTICS, HOSTILE, part, rows_of

pytestmark = pytest.mark.both_qt


@pytest.fixture
def shown(controls: Any, wait: Any) -> Any:
    def show(control: str = "DiagnosticsView {}") -> Any:
        publisher = controls.robot.create_publisher("/diagnostics", DIAGNOSTICS)
        view = controls.show(control)
        wait(publisher.subscription_count)
        return view, publisher, lambda: rows_of(view.property("reports").property("rows"))

    return show


def test_worst_parts_are_first(shown: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    levels = {"b": 0, "a": 0, "warned": 1, "broken": 2, "stale": 3}
    publisher.publish(status=[part(name, level) for name, level in levels.items()])
    wait(lambda: view.property("total") == 5)
    assert [row["name"] for row in rows()] == ["broken", "stale", "warned", "a", "b"]
    assert view.property("note") == "1 error, 1 stale, 1 warning"
    publisher.publish(status=[part(name) for name in levels])
    wait(lambda: view.property("note") == "all good")


def test_reports_of_all_publishers_are_merged(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    other = controls.robot.create_publisher("/diagnostics", DIAGNOSTICS)
    wait(other.subscription_count)
    for at in range(20):
        publisher.publish(status=[part(f"drive {at}", 0, "spins")])
        other.publish(status=[part(f"arm {at}", 1, "hot", hardware="arm")])
    wait(lambda: view.property("total") == 40)
    assert {row["text"] for row in rows()} == {"spins", "hot"}
    assert view.property("reports").property("lost") == 0


def test_same_names_of_two_devices_are_two_parts(shown: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    publisher.publish(status=[part("motor", 0, "ok", "left"), part("motor", 2, "hot", "right")])
    wait(lambda: view.property("total") == 2)
    assert [row["hardware"] for row in rows()] == ["right", "left"]


def test_silent_part_is_stale_and_the_others_are_not(shown: Any, wait: Any) -> None:
    view, publisher, rows = shown("DiagnosticsView { silentAfter: 0.4 }")
    publisher.publish(status=[part("dead", 0, "well"), part("alive")])
    wait(lambda: view.property("total") == 2)

    def silent() -> bool:
        publisher.publish(status=[part("alive")])
        return view.property("stales") == 1

    wait(silent)
    dead, alive = rows()
    assert (dead["name"], dead["level"], dead["text"]) == ("dead", 3, "well")
    assert dead["silent"] >= 0
    assert (alive["name"], alive["level"], alive["silent"]) == ("alive", 0, -1)


def test_part_unfolds_by_keyboard(shown: Any, controls: Any, wait: Any) -> None:
    from rosglass.qt import QtCore, QtGui

    view, publisher, rows = shown()
    publisher.publish(status=[part("a", 0, "fine", "cpu0", load="3 %", heat="40 C")])
    wait(lambda: view.property("total") == 1)
    listed = controls.find("rows")
    listed.forceActiveFocus()
    before = listed.property("contentHeight")
    app = QtGui.QGuiApplication.instance()
    for key in (QtCore.Qt.Key.Key_Down, QtCore.Qt.Key.Key_Space):
        for kind in (QtCore.QEvent.Type.KeyPress, QtCore.QEvent.Type.KeyRelease):
            modifiers = QtCore.Qt.KeyboardModifier.NoModifier
            app.sendEvent(controls.window, QtGui.QKeyEvent(kind, key, modifiers))
    wait(lambda: rows()[0]["open"])
    wait(lambda: listed.property("contentHeight") > before + 20)
    # The next report changes the values, not what is unfolded.
    publisher.publish(status=[part("a", 0, "fine", "cpu0", load="4 %")])
    wait(lambda: rows()[0]["values"] == [{"key": "load", "value": "4 %"}])
    assert rows()[0]["open"]


def test_nothing_is_cut_without_a_count(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    values = {f"key{at}": "v" for at in range(1000)}
    publisher.publish(status=[part(f"{at:04}", 0, "ok", **values) for at in range(30)])
    wait(lambda: view.property("total") == 30)
    assert (len(rows()[0]["values"]), rows()[0]["more"]) == (200, 800)
    wait(lambda: "more below" in controls.find("more").property("text"))
    publisher.publish(status=[part(f"{at:04}") for at in range(5010)])
    wait(lambda: view.property("total") == 5000)
    wait(lambda: "10 reports of further parts" in controls.find("more").property("text"))


def test_flood_is_merged_in_turns(shown: Any, wait: Any) -> None:
    """The GUI thread is not held for all at once, and the newest message counts."""
    view, publisher, rows = shown()
    values = {f"key{at}": "v" for at in range(20)}
    large = [part(f"{at:04}", 0, "ok", **values) for at in range(1000)]
    for _ in range(110):
        publisher.publish(status=large)
    publisher.publish(status=[part("0500", 2, "the last")])
    wait(lambda: view.property("errors") == 1)
    assert rows()[0]["text"] == "the last"
    assert view.property("total") == 1000
    assert view.property("reports").property("lost") > 0
    kept = [len(row["values"]) for row in rows()]
    assert sum(kept) <= 10_000
    assert sum(kept) + sum(row["more"] for row in rows()) == 19_980


def test_hostile_texts_are_plain_and_bounded(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    publisher.publish(status=[part(HOSTILE, 7, HOSTILE, HOSTILE, k=HOSTILE)])
    wait(lambda: view.property("total") == 1)
    row = rows()[0]
    view.property("reports").toggle(0)
    assert row["level"] == 2
    assert row["text"].startswith("level 7: <b>bold</b>\\u001b[31m\\u202e")
    assert row["text"].endswith("… (1000018 characters)")
    texts = [row["name"], row["hardware"], row["text"], row["values"][0]["value"]]
    assert max(map(len, texts)) < 2100
    assert not controls.grab().isNull()
    # The others live on.
    publisher.publish(status=[part("well")])
    wait(lambda: view.property("total") == 2)


def test_filter_counts_what_it_hides(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown('DiagnosticsView { filter: "MOTOR" }')
    publisher.publish(status=[part("motor left"), part("camera"), part("x", hardware="motor")])
    wait(lambda: view.property("total") == 3)
    assert [row["name"] for row in rows()] == ["motor left", "x"]
    wait(lambda: controls.find("more").property("text") == "1 filtered out")


def test_rows_stay_in_view_while_others_change(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown()
    names = [f"part {at:03}" for at in range(60)]
    publisher.publish(status=[part(name) for name in names])
    wait(lambda: view.property("total") == 60)
    listed = controls.find("rows")
    wait(lambda: listed.property("contentHeight") > 600)
    listed.setProperty("contentY", 300)
    publisher.publish(status=[part("part 050", 2)])
    wait(lambda: view.property("errors") == 1)
    assert rows()[0]["name"] == "part 050"
    assert listed.property("contentY") == pytest.approx(300, abs=40)


def test_model_shows_any_change(controls: Any) -> None:
    """The steps of a RowModel give the order that was asked for, as a view counts them."""
    from rosglass.controls.lists.row_model import RowModel
    from rosglass.qt import QtCore

    chance = random.Random(1)
    rows = {key: {"name": key} for key in range(40)}
    owner = QtCore.QObject()
    model = RowModel(owner, ["name"])
    mirror: list[int] = []

    def moved(_: Any, first: int, last: int, __: Any, to: int) -> None:
        part = mirror[first : last + 1]
        del mirror[first : last + 1]
        at = to if to < first else to - len(part)
        mirror[at:at] = part

    def inserted(_: Any, first: int, last: int) -> None:
        mirror[first:first] = model.keys[first : last + 1]

    def removed(_: Any, first: int, last: int) -> None:
        del mirror[first : last + 1]

    def reset() -> None:
        mirror[:] = model.keys

    model.rowsMoved.connect(moved)
    model.rowsInserted.connect(inserted)
    model.rowsRemoved.connect(removed)
    model.modelReset.connect(reset)
    for _ in range(300):
        if chance.random() < 0.5 and mirror:
            keys = list(mirror)
            keys.insert(chance.randrange(len(keys)), keys.pop(chance.randrange(len(keys))))
        else:
            keys = chance.sample(range(40), chance.randrange(41))
        model.show({key: rows[key] for key in keys})
        assert list(model.keys) == keys == mirror
        assert list(model.rows) == [rows[key] for key in keys]


def test_another_topic_starts_anew(shown: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = shown('DiagnosticsView { topic: "/diagnostics" }')
    publisher.publish(status=[part("old robot")])
    wait(lambda: view.property("total") == 1)
    view.setProperty("topic", "/other/diagnostics")
    wait(lambda: view.property("total") == 0)
    assert rows() == []
