"""JavaScript of an overlay that loops without end: RViz and the other overlays live on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

IMPORTS = "import QtQuick 2.15\nimport QtQuick.Controls 2.15\n"
UI = """Item {
    property int ticks: 0
    property bool went: false
    Timer { interval: 20; running: true; repeat: true; onTriggered: ticks++ }
    Timer { interval: 600; running: true; onTriggered: { while (true) {} went = true } }
}"""


def test_an_endless_loop_is_ended_and_reported_in_the_overlay(
    app: Any,
    wait: Callable[..., None],
    frames: Callable[[int], None],
    show_file: Any,
    caplog: Any,
    monkeypatch: Any,
    error_panels: Any,
) -> None:
    monkeypatch.setattr(app.session, "longest_script", 0.5)
    overlay = show_file(UI)
    wait(lambda: overlay.problem)
    place = f"{overlay.file}:7"
    assert place in overlay.problem
    assert f"called at {place}" not in overlay.problem
    assert "let it end" in overlay.problem
    (record,) = [r for r in caplog.records if "computed for" in r.getMessage()]
    assert f"{record.pathname}:{record.lineno}" == place
    ticks = overlay.root.property("ticks")
    frames(3)
    wait(lambda: overlay.root.property("ticks") > ticks)
    assert not overlay.root.property("went")
    (panel,) = error_panels()
    assert panel.property("text") == overlay.problem
    # The interface that is mended has nothing to say.
    overlay.file.write_text(IMPORTS + "Item {}")
    assert overlay.reload()
    assert not overlay.problem
    wait(lambda: not error_panels())


LOADED = """Item {
    property int ticks: 0
    Component.onCompleted: { while (true) {} }
    Timer { interval: 20; running: true; repeat: true; onTriggered: ticks++ }
}"""


def test_a_loop_without_end_while_an_overlay_is_loaded_is_ended(
    app: Any, wait: Callable[..., None], show_file: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr(app.session, "longest_script", 0.5)
    overlay = show_file(LOADED)
    wait(lambda: overlay.problem)
    assert f"{overlay.file}:5" in overlay.problem
    wait(lambda: overlay.root.property("ticks") > 3)
    # It is no worse when it is shown anew.
    assert overlay.reload()
    wait(lambda: overlay.problem)
    wait(lambda: overlay.root.property("ticks") > 3)
