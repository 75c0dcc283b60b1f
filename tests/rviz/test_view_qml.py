"""``rviz.view`` in QML, asked for what it cannot do: each error says where, what and what would."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

POINT = "expected x, y and z in metres, e.g. Qt.vector3d(1, 2, 0), got "
MODE = "expected rviz.view.MODE_3D (0) or MODE_2D (1), got "
FRAME = "expected the name of a frame, or '' for none, got "
VIEW = "expected a view type, e.g. 'rviz/Orbit', got "
NAME = "expected a name for the view, a text of one line, got "
WRONG = {
    "mode = 7": "rviz.view.mode: there is no view mode 7: expected 0 (3D) or 1 (2D)",
    "mode = 'flat'": f"rviz.view.mode: {MODE}'flat'",
    "mode = null": f"rviz.view.mode: {MODE}null",
    "mode = true": f"rviz.view.mode: {MODE}true",
    "mode = NaN": f"rviz.view.mode: {MODE}NaN",
    "trackedFrame = 'nowhere'": "rviz.view.trackedFrame: there is no frame 'nowhere'",
    "trackedFrame = 5": f"rviz.view.trackedFrame: {FRAME}5",
    "trackedFrame = null": f"rviz.view.trackedFrame: {FRAME}null",
    "animationDuration = -1": "animationDuration: expected a number from 0 to 60, got -1",
    "animationDuration = 'slow'": "animationDuration: expected a number from 0 to 60, got 'slow'",
    "animationDuration = true": "animationDuration: expected a number from 0 to 60, got true",
    "trackingGain = NaN": "rviz.view.trackingGain: expected a number from 0 to 1000, got NaN",
    "trackingGain = []": "rviz.view.trackingGain: expected a number from 0 to 1000, got []",
    "type = 'orbit'": "there is no view type 'orbit'; did you mean rviz/Orbit?; there are",
    "type = 'rviz/Orbi'": "there is no view type 'rviz/Orbi'; did you mean rviz/Orbit",
    "type = 5": f"rviz.view.type: {VIEW}5",
    "eye = Qt.vector3d(1, 2, 3)": "read-only",
    "moveEye()": "rviz.view.moveEye(eye[, options]): eye must be given",
    "moveEye([0, 0, null])": f"rviz.view.moveEye: eye: {POINT}[0, 0, null]",
    "moveEye([1, 2, Infinity])": f"rviz.view.moveEye: eye: {POINT}[1, 2, Infinity]",
    "moveEye([1, 2, 1e9])": "is more than 1e+08 m from the fixed frame's origin",
    "moveEye([1, 2, 3], 'map')": "options: expected {frame, animate, stopTracking, switchTo3D}",
    "moveEye([1, 2, 3], {frame: null})": "rviz.view.moveEye: frame: expected a text, got null",
    "moveEye([1, 2, 3], {frame: 'nowhere'})": "moveEye: there is no frame 'nowhere'",
    "moveEye([1, 2, 3], {animated: true})": "there is no option 'animated'; there are frame,",
    "moveEye([1, 2, 3], {animate: 1})": "animate: expected true or false, got 1",
    "moveEyeAndFocus([1, 2, 3])": "moveEyeAndFocus(eye, focus[, options]): focus must be given",
    "moveEyeAndFocus([1, 2, 3], 5)": f"rviz.view.moveEyeAndFocus: focus: {POINT}5",
    "moveEyeAndFocus([1, 2, 3], [1, 2, 3])": "are both at [1.0, 2.0, 3.0]",
    "moveEyeAndFocus([1, 2, 3], [0, 0, 0], {switchTo3D: true})": "no option 'switchTo3D'",
    "setMode('3D')": f"rviz.view.setMode: {MODE}'3D'",
    "setMode(0, 1)": "rviz.view.setMode: animate: expected true or false, got 1",
    "track(null)": f"rviz.view.track: {FRAME}null",
    "track(['map'])": f"rviz.view.track: {FRAME}['map']",
    "saveView('')": f"rviz.view.saveView: {NAME}''",
    "showView('x')": "rviz.view.showView: there is no saved view 'x'; no views are saved",
    "removeView(null)": "rviz.view.removeView: there is no saved view null; no views are saved",
    "removeView()": "rviz.view.removeView(name): name must be given",
    "misspelled = 1": "rviz.view has no member 'misspelled'",
}


@pytest.fixture
def run(
    app: Any, steered: Any, wait: Callable[..., None], tmp_path: Path
) -> Iterator[Callable[[str], Any]]:
    """Run JavaScript in an overlay; returns what it returns, or the error that it throws."""
    file = tmp_path / "View.qml"
    file.write_text(
        "import QtQuick 2.15\nItem { property var told: []\n"
        "Connections { target: rviz.view\n"
        "function onAnimationDurationChanged() { told.push(rviz.view.animationDuration) }\n"
        "function onTrackingGainChanged() { told.push(rviz.view.trackingGain) }\n"
        "function onMoved() { told.push('moved') } } }"
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


def test_each_error_names_member_value_and_valid_values(run: Any, steered: Any) -> None:
    before = steered.eye
    answers = {script: run(f"rviz.view.{script}") for script in WRONG}
    assert {key: text for key, text in answers.items() if WRONG[key] not in str(text)} == {}
    assert steered.eye == before
    assert steered.mode == 0


def test_errors_list_the_known_frames(
    run: Any, app: Any, steered: Any, wait: Callable[..., None]
) -> None:
    from rosglass.tf import Transform

    buffer = app.rviz.frames.buffer
    buffer.set_transform(Transform(frame_id="map", child_frame_id="rover"), static=True)
    assert run("rviz.view.track('rowver')").endswith("no frame 'rowver'; did you mean rover?")
    # Tests before have left theirs, of which the first ones are told.
    assert "no frame 'xyz'; there are " in run("rviz.view.track('xyz')")
    app.window.manager.setFixedFrame("world")
    told = run("rviz.view.track('rover')")
    assert "the fixed frame 'world'" in told
    assert "does not exist; there are " in told
    app.window.manager.setFixedFrame("map")
    assert run("rviz.view.track('rover')") is None
    run("rviz.view.track('')")


def test_changes_by_the_operator_are_signalled(
    run: Any, app: Any, steered: Any, wait: Callable[..., None]
) -> None:
    wait.frames(2)
    run("root.told = []")
    app.view_entry.shown = True
    group = app.window.manager.getRootDisplayGroup()
    shown = [group.getDisplayAt(at) for at in range(group.numDisplays())]
    (entry,) = (display for display in shown if display.getName() == "View Controller")
    entry.subProp("Animation Duration").setValue(2.5)
    entry.subProp("Tracking Gain").setValue(5.0)
    assert run("root.told") == [2.5, 5.0]
    run("rviz.view.animationDuration = 0.5")
    assert entry.subProp("Animation Duration").getValue() == 0.5
    app.view_entry.shown = False


def test_the_view_is_read_once_per_frame(
    run: Any, app: Any, steered: Any, monkeypatch: pytest.MonkeyPatch, wait: Callable[..., None]
) -> None:
    wait.frames(9)
    reads, frames = [], []
    read = steered._current.read
    monkeypatch.setattr(steered._current, "read", lambda: reads.append(1) or read())
    app.window.before_frame.connect(lambda: frames.append(1))
    wait(lambda: len(frames) >= 5)
    assert len(reads) <= len(frames) + 1
