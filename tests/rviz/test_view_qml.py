"""``rviz.view`` in QML, beside what every 3D view does: see :mod:`overlay_contract`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


@pytest.fixture
def run(
    app: Any, steered: Any, wait: Callable[..., None], tmp_path: Path
) -> Iterator[Callable[[str], Any]]:
    """Run JavaScript in an overlay; returns what it returns, or the error that it throws."""
    file = tmp_path / "View.qml"
    file.write_text(
        "import QtQuick 2.15\nItem { property var log: []\n"
        "Connections { target: rviz.view\n"
        "function onAnimationDurationChanged() { log.push(rviz.view.animationDuration) }\n"
        "function onTrackingGainChanged() { log.push(rviz.view.trackingGain) }\n"
        "function onMoved() { log.push('moved') } } }"
    )
    overlay = app.add_qml(file)
    wait.frames(3)
    engine = overlay.engine
    engine.globalObject().setProperty("rviz", engine.newQObject(overlay.properties))
    engine.globalObject().setProperty("root", engine.newQObject(overlay.root))

    def run(script: str) -> Any:
        tried = f"try {{ return JSON.stringify([{script}]) }} catch (e) {{ return '' + e }}"
        text = engine.evaluate(f"(function () {{ {tried} }})()").toString()
        return json.loads(text)[0] if text.startswith("[") else text

    yield run
    engine.globalObject().deleteProperty("rviz")
    engine.globalObject().deleteProperty("root")


def test_errors_list_the_known_frames(
    run: Any, app: Any, steered: Any, wait: Callable[..., None]
) -> None:
    from rosglass.tf import Transform

    buffer = app.rviz.frames.buffer
    buffer.set_transform(Transform(frame_id="map", child_frame_id="rover"), static=True)
    assert run("rviz.view.track('rowver')").endswith("no frame 'rowver'; did you mean rover?")
    # Tests before have left theirs, of which the first ones are named.
    assert "no frame 'xyz'; there are " in run("rviz.view.track('xyz')")
    app.window.manager.setFixedFrame("world")
    error = run("rviz.view.track('rover')")
    assert "the fixed frame 'world'" in error
    assert "does not exist; there are " in error
    app.window.manager.setFixedFrame("map")
    assert run("rviz.view.track('rover')") is None
    run("rviz.view.track('')")


def test_changes_by_the_operator_are_signalled(
    run: Any, app: Any, steered: Any, wait: Callable[..., None]
) -> None:
    wait.frames(2)
    run("root.log = []")
    app.view_entry.shown = True
    group = app.window.manager.getRootDisplayGroup()
    shown = [group.getDisplayAt(at) for at in range(group.numDisplays())]
    (entry,) = (display for display in shown if display.getName() == "View Controller")
    entry.subProp("Animation Duration").setValue(2.5)
    entry.subProp("Tracking Gain").setValue(5.0)
    assert run("root.log") == [2.5, 5.0]
    run("rviz.view.animationDuration = 0.5")
    assert entry.subProp("Animation Duration").getValue() == 0.5
    app.view_entry.shown = False


def test_the_view_is_read_once_per_frame(
    run: Any, app: Any, steered: Any, monkeypatch: pytest.MonkeyPatch, wait: Callable[..., None]
) -> None:
    wait.frames(9)
    reads, frames = [], []
    view = steered._current
    read = view.read
    monkeypatch.setattr(view, "read", lambda: reads.append(1) or read())
    app.window.before_frame.connect(lambda: frames.append(1))
    wait(lambda: len(frames) >= 5)
    assert len(reads) <= len(frames) + 1
