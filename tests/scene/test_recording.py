"""``rosglass view --record``: the window as a video, which is decoded again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from lavapipe import lavapipe
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from conftest import SceneBench

av = pytest.importorskip("av", reason='needs pip install "rosglass[video]"')


def decode(path: Path) -> list[tuple[float, Any]]:
    """Return times and frames of a video."""
    with av.open(str(path)) as container:
        return [(frame.time, frame.to_ndarray(format="rgb24")) for frame in container.decode()]


def start_view(*arguments: str, **environment: str) -> subprocess.Popen[str]:
    return start("view", "--url", "local://video", *arguments, **environment)


def start(*arguments: str, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "rosglass", *arguments],
        env={**os.environ, "QT_QUICK_BACKEND": "", **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture
def recorder(bench: SceneBench, tmp_path: Path) -> Iterator[Any]:
    """Records the window of a bench, whose view has a background of one colour."""
    from rosglass.scene.app.window_recorder import WindowRecorder

    bench.load('background: "#c02020"; GridDisplay { color: "#c02020" }')
    made = WindowRecorder(tmp_path / "video.mp4")
    yield made
    made.close()


def test_the_video_shows_the_window(bench: SceneBench, recorder: Any) -> None:
    recorder.start(bench.window)
    bench.wait(lambda: recorder.status().frames)
    bench.view.setProperty("background", "#2020c0")
    bench.wait(lambda: recorder.status().frames > 1)
    # Which side is above.
    before = bench.drawn()
    bench.view.scene.displays[0].enabled = False
    bench.wait(lambda: bench.drawn() > before)
    count = recorder.status().frames
    bench.wait(lambda: bench.window.update() or recorder.status().frames > count)
    seen = bench.picture()
    status = recorder.close()
    assert (status.dropped, status.problem) == (0, "")
    found = [image for _, image in decode(recorder.path)]
    assert found[0].shape == (300, 400, 3)
    assert np.abs(found[0][10, 10].astype(int) - (0xC0, 0x20, 0x20)).max() < 12
    assert np.abs(found[-1].astype(int) - seen).max() < 40


def test_a_window_at_rest_costs_nothing(bench: SceneBench, recorder: Any) -> None:
    recorder.start(bench.window)
    bench.wait(lambda: recorder.status().frames)
    bench.wait.nothing_happens(0.3)
    drawn, frames = bench.drawn(), recorder.status().frames
    bench.wait.nothing_happens(0.5)
    assert bench.drawn() == drawn
    assert recorder.status().frames == frames
    status = recorder.close()
    # It lasts until the end all the same.
    times = [time for time, _ in decode(recorder.path)]
    assert times[-1] == pytest.approx(status.duration, abs=0.01)
    assert times[-1] > 0.7


def test_frame_beyond_the_rate_does_not_count_as_dropped(
    bench: SceneBench, recorder: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.scene.app.window_recorder._MAX_RATE_HZ", 0.01)
    monkeypatch.setattr("rosglass.images.video_writer.VideoWriter.is_full", True)
    recorder.start(bench.window)
    for _ in range(5):
        bench.picture()
    assert recorder.status().dropped == 1


def test_the_command_records_until_ctrl_c(app: Any, tmp_path: Path) -> None:
    video = tmp_path / "out.mp4"
    process = start_view("--record", str(video))
    assert process.stderr is not None
    # It is created before as well, to try whether that is possible.
    assert any("recording to" in line for line in process.stderr)
    eventually(lambda: video.exists() or process.poll() is not None, timeout=60)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "out.mp4: " in said
    assert " frames, " in said
    assert "Traceback" not in said
    frames = decode(video)
    assert frames[0][1].shape == (800, 1280, 3)


def test_interfaces_are_recorded_as_well(app: Any, tmp_path: Path) -> None:
    file, video = tmp_path / "panel.qml", tmp_path / "out.mp4"
    file.write_text(
        "import QtQuick\nWindow { visible: true; width: 200; height: 100; color: '#c02020'\n"
        "Timer { running: true; interval: 500; onTriggered: Qt.quit() } }"
    )
    process = start("run", str(file), "--kiosk", "--record", str(video))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 0, said
    assert f"recording to {video}" in said
    assert "out.mp4: " in said
    picture = decode(video)[0][1]
    assert np.abs(picture[10, 10].astype(int) - (0xC0, 0x20, 0x20)).max() < 12
    process = start("run", str(file), "--renderer", "software", "--record", str(video))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "--record: Qt's software renderer cannot be recorded" in said
    process = start("run", str(tmp_path / "none.qml"), "--record", str(tmp_path / "none.mp4"))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "there is no such file" in said
    assert "recording to" not in said


@pytest.mark.parametrize("interface", ["opengl", "vulkan"])
def test_the_video_is_what_a_screenshot_shows(app: Any, tmp_path: Path, interface: str) -> None:
    from PySide6.QtGui import QImage

    # Vulkan reads back later, blue before red, from above.
    environment = {"VK_ICD_FILENAMES": lavapipe()} if interface == "vulkan" else {}
    video, picture = tmp_path / "out.webm", tmp_path / "out.png"
    process = start_view(
        "--record", str(video), "--screenshot", str(picture), "--after", "3", "--kiosk",
        QSG_RHI_BACKEND=interface, **environment,
    )  # fmt: skip
    _, said = process.communicate(timeout=100)
    assert process.returncode == 0, said
    image = QImage(str(picture)).convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    seen = rows[:, : image.width() * 3].reshape(image.height(), image.width(), 3)
    frames = decode(video)
    height, width, _ = frames[-1][1].shape
    off = np.abs(frames[-1][1].astype(int) - seen[:height, :width])
    assert off.mean() < 4
    assert frames[-1][0] > 1.0


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("out.gif", "out.gif: the name of a video ends in one of .mp4, .mkv, .webm"),
        ("nowhere/out.mp4", "out.mp4 cannot be written: No such file or directory"),
    ],
)
def test_mistakes_end_the_command(app: Any, tmp_path: Path, name: str, text: str) -> None:
    process = start_view("--record", str(tmp_path / name))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert text in said
    assert "Traceback" not in said


def test_the_status_bar_says_so(bench: SceneBench, recorder: Any) -> None:
    from rosglass.scene.app.program import ViewProgram

    program = ViewProgram(recorder=recorder)
    program.begin(bench.view)
    assert program.recording == ""
    recorder.start(bench.window)
    bench.wait(lambda: program.recording.startswith("recording 0:0"))
    recorder._fail("the disk is full")
    assert "the recording has ended: the disk is full" in program.message
    bench.wait(lambda: program.recording == "")
