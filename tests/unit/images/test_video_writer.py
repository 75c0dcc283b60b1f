"""Videos that are written, decoded again."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.errors import Error, UnsupportedError
from rosglass.extras import install_command
from rosglass.images import video_writer
from rosglass.images.video_writer import VideoWriter

if TYPE_CHECKING:
    from pathlib import Path

av = pytest.importorskip("av", reason='needs pip install "rosglass[video]"')
RED, GREEN, BLUE = (200, 20, 20), (20, 180, 20), (30, 30, 220)


def picture(*colours: tuple[int, int, int], size: tuple[int, int] = (64, 48)) -> Any:
    """Return stripes of colours, from left to right, RGBA."""
    width, height = size
    made = np.full((height, width, 4), 255, np.uint8)
    for at, colour in enumerate(colours):
        made[:, at * width // len(colours) : (at + 1) * width // len(colours), :3] = colour
    return made


def add(writer: VideoWriter, *pictures: tuple[Any, float], **options: Any) -> None:
    from waiting import eventually

    for pixels, time in pictures:
        eventually(lambda: not writer.is_full)
        assert writer.add(pixels, time, **options)


def decode(path: Path) -> list[tuple[float, Any]]:
    """Return times and images of the frames of a video."""
    with av.open(str(path)) as container:
        return [(frame.time, frame.to_ndarray(format="rgb24")) for frame in container.decode()]


def near(found: Any, colour: tuple[int, int, int]) -> bool:
    return bool(np.abs(found.astype(int) - colour).max() <= 12)


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".webm"])
def test_frames_keep_times_and_colours(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"video{suffix}"
    writer = VideoWriter(path)
    assert not path.exists()
    add(writer, (picture(RED, BLUE), 10.0), (picture(GREEN), 10.25), (picture(BLUE), 13.0))
    status = writer.close(14.5)
    assert (status.frames, status.dropped, status.duration, status.problem) == (4, 0, 4.5, "")
    found = decode(path)
    # The last frame is shown until the end.
    assert [round(time, 2) for time, _ in found] == [0.0, 0.25, 3.0, 4.5]
    assert found[0][1].shape == (48, 64, 3)
    assert near(found[0][1][20, 8], RED)
    assert near(found[0][1][20, 56], BLUE)
    assert near(found[1][1][20, 30], GREEN)
    assert near(found[3][1][20, 30], BLUE)


def test_blue_before_red(tmp_path: Path) -> None:
    writer = VideoWriter(tmp_path / "video.mp4")
    add(writer, (picture(RED)[..., [2, 1, 0, 3]], 0.0), format="bgra")
    writer.close()
    ((_, found),) = decode(writer.path)
    assert near(found[20, 30], RED)


def test_window_that_is_resized(tmp_path: Path) -> None:
    writer = VideoWriter(tmp_path / "video.mp4")
    add(
        writer,
        (picture(RED, size=(65, 49)), 0.0),
        (picture(GREEN, size=(200, 50)), 1.0),
        (picture(BLUE, size=(64, 49)), 2.0),
    )
    writer.close()
    (_, one), (_, two), (_, three) = decode(writer.path)
    assert one.shape == two.shape == three.shape == (48, 64, 3)
    # As a whole, between black bars.
    assert near(two[24, 2], GREEN)
    assert near(two[24, 61], GREEN)
    assert near(two[2, 30], (0, 0, 0))
    assert near(two[45, 30], (0, 0, 0))
    assert near(three[2, 30], BLUE)


def test_no_frames_no_file(tmp_path: Path) -> None:
    writer = VideoWriter(tmp_path / "video.mp4")
    assert writer.close().frames == 0
    assert list(tmp_path.iterdir()) == []
    assert not writer.add(picture(RED), 0.0)


def test_frames_are_dropped_and_counted_while_the_encoder_is_busy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video_writer, "_CLOSE_TIMEOUT_S", 60.0)
    writer = VideoWriter(tmp_path / "video.mp4")
    large = np.zeros((2160, 3840, 4), np.uint8)
    sent = 100
    added = sum(writer.add(large, at / 1000) for at in range(sent))
    status = writer.close()
    assert status.dropped == sent - added > 0
    assert status.frames == added == len(decode(writer.path))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("video.avi", "video.avi: the name of a video ends in one of .mp4, .mkv, .webm"),
        ("video", "the name of a video ends in one of"),
        ("nowhere/video.mp4", "video.mp4 cannot be written: No such file or directory"),
        ("there.mp4", "there.mp4 exists already; choose another name"),
        ("folder.mp4", "folder.mp4 exists already"),
    ],
)
def test_mistakes_are_explained_at_once(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / "there.mp4").write_text("kept")
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(Error, match=text.replace(".", r"\.")):
        VideoWriter(tmp_path / name)
    assert (tmp_path / "there.mp4").read_text() == "kept"


def test_without_pyav_the_error_says_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> None:
        raise UnsupportedError("no PyAV")

    monkeypatch.setattr(video_writer, "pyav", missing)
    with pytest.raises(UnsupportedError, match=re.escape(install_command("video"))):
        VideoWriter(tmp_path / "video.mp4")


def test_full_disk_ends_the_file(tmp_path: Path) -> None:
    from pathlib import Path

    from waiting import eventually

    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    writer = VideoWriter(tmp_path / "video.mkv")
    writer.path.symlink_to("/dev/full")
    shown = np.random.default_rng(0).integers(0, 255, (480, 640, 4), np.uint8)
    at = 0
    while not writer.status().problem and at < 500:
        eventually(lambda: not writer.is_full or writer.status().problem)
        writer.add(shown, at := at + 1)
    status = writer.close()
    assert "video.mkv cannot be written: " in status.problem
    assert "No space left on device" in status.problem
