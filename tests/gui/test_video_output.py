"""Frames reach the pixels of a VideoOutput, on a virtual screen, drawn by each renderer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.xvfb

QUARTERS = [(220, 30, 30), (30, 200, 40), (40, 50, 230), (230, 220, 60)]
COLOURS = ["rgb8", "bgr8", "rgba8", "bgra8", "yuv422", "yuv422_yuy2", "nv12", "nv21"]
GREYS = ["mono8", "mono16"]
HEADS = {
    "Ros2": """import QtQuick 2.15
    MULTIMEDIA
    import Ros2 1.0
    Rectangle {
        color: "black"
        Component.onCompleted: Ros2.init("ui")
        ImageTransportSubscription { id: sub; objectName: "camera"; topic: "/cam" }
    """,
    "Ros": """import QtQuick 2.2
    import QtMultimedia 5.10
    import Ros 1.0
    Rectangle {
        color: "black"
        Component.onCompleted: Ros.init("ui")
        ImageTransportSubscriber { id: sub; objectName: "camera"; topic: "/cam" }
    """,
}
FORMS = {
    "native": """
        VideoOutput { id: out; anchors.fill: parent }
        Binding { target: sub; property: "videoSink"; value: out.videoSink }""",
    "source": """
        VideoOutput { anchors.fill: parent; source: sub
                      fillMode: VideoOutput.PreserveAspectCrop }""",
    "painted": """
        ImageItem { anchors.fill: parent; source: sub }""",
    "both": """
        VideoOutput { width: 160; height: parent.height; source: sub
                      fillMode: VideoOutput.Stretch }
        ImageTransportSubscription { id: other; topic: "/cam" }
        ImageItem { x: 160; width: 160; height: parent.height; source: other
                    fillMode: ImageItem.Stretch }""",
}


def interface(folder: Path, form: str, module: str = "Ros2") -> Path:
    from rosglass.qt import QT6

    file = folder / "View.qml"
    multimedia = "import QtMultimedia" if QT6 else "import QtMultimedia 5.15"
    file.write_text(HEADS[module].replace("MULTIMEDIA", multimedia) + FORMS[form] + "}")
    return file


def show(file: Path, screen: str, encodings: list[str], renderer: str = "") -> dict[str, list]:
    gone = {"QT_QPA_PLATFORM", "WAYLAND_DISPLAY"}
    environment = {k: v for k, v in os.environ.items() if k not in gone} | {"DISPLAY": screen}
    environment["QT_QUICK_BACKEND"] = renderer
    done = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("video_app.py")), str(file), *encodings],
        env=environment,
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    return {entry["encoding"]: entry["seen"] for entry in found}


SHOWN = [("Ros2", "native"), ("Ros2", "painted"), ("Ros2", "source"), ("Ros", "source")]


@pytest.mark.both_qt
@pytest.mark.parametrize("renderer", ["", "software"])
@pytest.mark.parametrize(("module", "form"), SHOWN)
def test_every_encoding_shows_the_right_colours(
    tmp_path: Path, screen: str, module: str, form: str, renderer: str
) -> None:
    from rosglass.qt import QT6

    if form == "native" and not QT6:
        pytest.skip("Qt 5 has no video sinks; its VideoOutput takes a source")
    seen = show(interface(tmp_path, form, module), screen, COLOURS + GREYS, renderer)
    for number, encoding in enumerate(COLOURS + GREYS):
        expected = np.roll(QUARTERS, -number, axis=0)
        if encoding in GREYS:
            expected[:] = expected[:, :1]
        exact = encoding in {*GREYS, "rgb8", "bgr8", "rgba8", "bgra8"}
        np.testing.assert_allclose(
            seen[encoding], expected, atol=1 if exact else 9, err_msg=encoding
        )
    assert seen["timeout"] == [[0, 0, 0]] * 4
    if form != "painted":
        assert seen["size with a picture"] == [64, 48]
        # What stands beside it stays where it is when the signal is lost.
        assert seen["size without"] == [64, 48]


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_a_turned_output_looks_the_same_with_every_renderer(
    tmp_path: Path, screen: str, turn: int
) -> None:
    form = FORMS["source"].replace("source: sub", f"source: sub; orientation: {turn}")
    file = interface(tmp_path, "source")
    file.write_text(file.read_text().replace(FORMS["source"], form))
    by_opengl, painted = (show(file, screen, ["rgb8"], renderer) for renderer in ("", "software"))
    np.testing.assert_allclose(painted["rgb8"], by_opengl["rgb8"], atol=1)


@pytest.mark.both_qt
def test_the_rotation_of_the_camera_is_that_of_every_qt(tmp_path: Path, screen: str) -> None:
    """Qt 5 turns by `orientation` against the clock, Qt 6 with it: docs/elements/VideoOutput.md."""
    from rosglass.qt import QT6

    clockwise = [QUARTERS[index] for index in (2, 0, 3, 1)]
    seen = {}
    for name, old, new in (
        ("rotation", 'topic: "/cam"', 'topic: "/cam"; rotation: 90'),
        ("orientation", "source: sub", f"source: sub; orientation: {90 if QT6 else -90}"),
    ):
        file = interface(tmp_path, "source")
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new, 1))
        seen[name] = show(file, screen, ["rgb8"])["rgb8"]
    for name, found in seen.items():
        np.testing.assert_allclose(found, clockwise, atol=1, err_msg=name)


@pytest.mark.both_qt
def test_a_stream_shown_in_both_ways_at_once(tmp_path: Path, screen: str) -> None:
    seen = show(interface(tmp_path, "both"), screen, ["rgb8", "yuv422", "mono8"])
    # Each half shows the whole image: left column of each is its middle.
    for encoding in ("rgb8", "yuv422", "mono8"):
        left, right, below_left, below_right = seen[encoding]
        np.testing.assert_allclose(left, right, atol=12)
        np.testing.assert_allclose(below_left, below_right, atol=12)
        assert sum(left) > 0
