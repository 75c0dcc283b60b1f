"""Each control in every mode and two sizes, drawn by both renderers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytestmark = [pytest.mark.xvfb, pytest.mark.both_qt]

#: They show a recording, a gamepad, and the disk's free space.
LEFT_OUT = {"timeline.qml", "gamepad.qml", "recorder.qml"}
FOLDER = Path(__file__).parents[3] / "examples" / "controls"
EXAMPLES = sorted(file for file in FOLDER.glob("*.qml") if file.name not in LEFT_OUT)
APP = Path(__file__).with_name("themes_app.py")
RENDERERS = {
    "software": {"QT_QUICK_BACKEND": "software"},
    "opengl": {"LIBGL_ALWAYS_SOFTWARE": "1"},
}
#: Controls whose views without data blink, or change with time.
MOVING = ("camera_grid-", "camera_view-", "log_view-", "map_view-")
#: The least contrast of a text to what is behind it, of WCAG 2.1's level AA.
LEAST_CONTRAST = 4.5


@pytest.fixture(scope="module")
def drawn(screen: str, tmp_path_factory: Any) -> dict[str, tuple[Path, str]]:
    """Each renderer's folder of images and its output; both draw at the same time."""
    programs = {}
    for renderer, extra in RENDERERS.items():
        folder = tmp_path_factory.mktemp(renderer)
        gone = {"QT_QPA_PLATFORM", "QT_QUICK_BACKEND", "WAYLAND_DISPLAY", "ROSGLASS_URL"}
        environment = {k: v for k, v in os.environ.items() if k not in gone}
        environment |= {"DISPLAY": screen, "QSG_RENDER_LOOP": "basic", **extra}
        command = [sys.executable, str(APP), str(folder), *map(str, EXAMPLES)]
        programs[renderer] = (
            folder,
            subprocess.Popen(
                command,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            ),
        )
    result = {}
    try:
        for renderer, (folder, program) in programs.items():
            output = program.communicate(timeout=120)[0]
            assert program.returncode == 0, output
            result[renderer] = folder, output
    finally:
        for _, program in programs.values():
            program.kill()
    return result


@pytest.fixture(scope="module")
def texts(drawn: Any) -> list[tuple[str, dict[str, Any]]]:
    """All visible texts with the colours behind them: (name of the image, text)."""
    folder = drawn["software"][0]
    result = []
    for name, found in json.loads((folder / "texts.json").read_text()).items():
        pixels = np.asarray(Image.open(folder / f"{name}.png").convert("RGB"), np.uint32)
        colors = pixels[:, :, 0] << 16 | pixels[:, :, 1] << 8 | pixels[:, :, 2]
        for text in found:
            text["behind"] = behind(colors, text)
            result.append((name, text))
    return result


def behind(colors: Any, text: dict[str, Any]) -> str:
    """Return the commonest colour of a text's place besides its own; empty for an unseen text."""
    place, bounds = text["place"], text["bounds"]
    left, top = (round(max(a, b, 0)) for a, b in zip(place[:2], bounds[:2], strict=True))
    right, bottom = (round(max(0, min(a, b))) for a, b in zip(place[2:], bounds[2:], strict=True))
    seen = colors[top:bottom, left:right]
    values, counts = np.unique(seen[seen != int(text["color"][1:], 16)], return_counts=True)
    return f"#{values[counts.argmax()]:06x}" if len(values) else ""


def luminance(color: str) -> float:
    """Relative luminance of a colour such as ``#ff8080``, from 0 to 1, as WCAG 2.1 defines it."""
    parts = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    """Contrast of two colours, from 1 to 21."""
    darker, brighter = sorted((luminance(one), luminance(other)))
    return (brighter + 0.05) / (darker + 0.05)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_no_error_is_logged(renderer: str, drawn: Any) -> None:
    lines = drawn[renderer][1].splitlines()
    assert [line for line in lines if "ERROR" in line or "RosControls/" in line] == []


def test_renderers_draw_the_same(drawn: Any) -> None:
    images = sorted(file.name for file in drawn["software"][0].glob("*.png"))
    assert len(images) == 3 * len(EXAMPLES)
    different = {}
    for name in (name for name in images if not name.startswith(MOVING)):
        one, other = (coarse(drawn[renderer][0] / name) for renderer in RENDERERS)
        apart = float(np.abs(one - other).max()) if one.shape == other.shape else 255.0
        if apart > 24:
            different[name] = round(apart)
    assert different == {}


def coarse(file: Path) -> Any:
    """Return an image in cells of about 16 pixels: renderers draw glyphs a little differently."""
    image = Image.open(file).convert("RGB")
    size = max(1, image.width // 16), max(1, image.height // 16)
    return np.asarray(image.resize(size, Image.Resampling.BOX), float)


def test_texts_are_readable(texts: Any) -> None:
    faint = {
        f"{name}: {text['text'][:40]!r} {text['color']} on {text['behind']}: {ratio:.1f}"
        for name, text in texts
        if not text["dimmed"] and text["behind"]
        if (ratio := contrast(text["color"], text["behind"])) < LEAST_CONTRAST
    }
    assert sorted(faint) == []


def test_texts_are_inside(texts: Any) -> None:
    outside = {
        f"{name}: {text['text'][:40]!r} at {text['place']} in {text['bounds']}"
        for name, text in texts
        if text["behind"] and not is_inside(text)
    }
    assert sorted(outside) == []


def is_inside(text: dict[str, Any]) -> bool:
    """Return whether all of a text is seen, if need be by scrolling up and down."""
    left, top, right, bottom = text["place"]
    bounds = text["bounds"]
    is_between = left > bounds[0] - 1 and right < bounds[2] + 1
    return is_between and (text["scrolled"] or (top > bounds[1] - 1 and bottom < bounds[3] + 1))
