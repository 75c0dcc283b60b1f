"""Misspelled members of objects for QML over RViz are reported, with place and nearest name."""

from __future__ import annotations

import gc
import logging
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

OBJECTS = {
    "rviz": ("rviz", "fixedFrame"),
    "rviz.toolManager": ("rviz.toolManager", "currentTool"),
    "rviz.view": ("rviz.view", "animationDuration"),
    "rviz.toolManager.tools[0]": ("tool", "shortcutKey"),
    "rviz.displays[0]": ("display", "enabled"),
    "rviz.createPositionTracker(0, 0, 0)": ("tracker", "position"),
    "rviz.registerIntProperty('Count', 3)": ("property", "readOnly"),
}


@pytest.fixture
def said(caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    """Return what was said with a place in QML, as ``line: text``."""
    caplog.set_level(logging.WARNING)
    return lambda: [
        f"{r.lineno}: {r.getMessage()}" for r in caplog.records if r.pathname.endswith(".qml")
    ]


@pytest.mark.parametrize("what", OBJECTS)
def test_each_object_reports_misspelled_members(
    what: str, tools: Any, show: Any, said: Any
) -> None:
    called, member = OBJECTS[what]
    wrong = f"{member}s"
    root = show(
        f"""Item {{
        property string caught
        property string known
        Component.onCompleted: {{
            const it = {what}
            try {{ it.{wrong} = 1 }} catch (error) {{ caught = error.lineNumber + " " + error }}
            known = typeof it.{member}
            known += typeof it.{wrong} + typeof it.toString + typeof it.hasOwnProperty
        }} }}"""
    )
    hint = f"{called} has no member '{wrong}'; did you mean {member}"
    assert root.property("caught").startswith(f"8 Error: {hint}")
    assert root.property("known").endswith("undefinedfunctionfunction")
    assert not root.property("known").startswith("undefined")
    (line,) = said()
    assert line.startswith(f"10: {hint}")
    assert line.endswith("it is undefined")


def test_an_uncaught_assignment_is_reported_with_its_place(
    show: Any, said: Any, app: Any, wait: Any
) -> None:
    from rosglass.qml.engine.log import install_message_handler
    from rosglass.qt import QtCore

    install_message_handler()
    try:
        show("Item {\nComponent.onCompleted: rviz.misspelled = 1 }")
    finally:
        QtCore.qInstallMessageHandler(None)
    assert said() == ["4: Error: rviz has no member 'misspelled'"]


def test_reported_once_per_place_even_after_collecting(
    app: Any, show: Any, said: Any, wait: Any
) -> None:
    root = show(
        """Item { property int again: 0
        property string a: again + " " + rviz.fixedFrme
        function write() { try { rviz.view.mod = 1 } catch (error) { return "" + error } } }"""
    )
    (overlay,) = app.overlays
    for count in range(5):
        root.setProperty("again", count)
        overlay.engine.collectGarbage()
        gc.collect()
        wait.frames(1)
    assert len([line for line in said() if "fixedFrme" in line]) == 1
    assert "did you mean mode" in root.write()


def test_members_that_javascript_looks_up_are_not_reported(show: Any, said: Any) -> None:
    root = show(
        """Item { property var made: [JSON.stringify(rviz).length > 0, "" + rviz, rviz == rviz,
            "nothing" in rviz, Object.keys(rviz).length > 5, rviz instanceof Object]
        Component.onCompleted: { Promise.resolve(rviz); console.info(rviz, [rviz.view]) }
        Connections { target: rviz; function onConfigLoaded(file) {} }
        Connections { target: rviz.view; function onModeChanged() {} } }"""
    )
    made = root.property("made")
    made = made.toVariant() if hasattr(made, "toVariant") else made
    assert [made[0], *made[2:]] == [True, True, False, True, True]
    assert said() == []
