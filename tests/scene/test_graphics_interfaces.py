"""Vulkan draws what OpenGL draws: by Mesa's lavapipe and llvmpipe, which need no graphics card."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from lavapipe import lavapipe
from pictures import drawn, unmatched

if TYPE_CHECKING:
    from numpy.typing import NDArray

HERE = Path(__file__).parent
#: The share of drawn pixels that may have no similar one beside them: edges of letters.
MOST_UNMATCHED = 0.01
_TIMEOUT_S = 60


class Result(NamedTuple):
    """Images and picks by one graphics interface."""

    pictures: dict[str, NDArray[np.uint8]]
    found: dict[str, Any]


def start(interface: str, folder: Path, **variables: str) -> subprocess.Popen[str]:
    folder.mkdir()
    path = os.pathsep.join([str(HERE), str(HERE.parent / "helpers")])
    env = {**os.environ, "PYTHONPATH": path, "QSG_RHI_BACKEND": interface, **variables}
    command = [sys.executable, str(HERE / "graphics_pictures.py"), str(folder)]
    return subprocess.Popen(
        command, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def result(process: subprocess.Popen[str], folder: Path) -> Result:
    try:
        output, _ = process.communicate(timeout=_TIMEOUT_S)
    finally:
        process.kill()
    assert process.returncode == 0, output
    with np.load(folder / "pictures.npz") as file:
        pictures = dict(file)
    return Result(pictures, json.loads((folder / "found.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, Result]:
    """The results of OpenGL and Vulkan, side by side."""
    driver = lavapipe()  # a graphics card would draw other pixels
    folder = tmp_path_factory.mktemp("graphics")
    opengl = start("opengl", folder / "opengl")
    vulkan = start("vulkan", folder / "vulkan", VK_ICD_FILENAMES=driver)
    return result(opengl, folder / "opengl"), result(vulkan, folder / "vulkan")


def test_each_has_drawn_by_its_own_interface(both: tuple[Result, Result]) -> None:
    assert [one.found["interface"] for one in both] == ["OpenGL", "Vulkan"]
    assert [one.found["problem"] for one in both] == ["", ""]


def test_both_draw_the_same(both: tuple[Result, Result]) -> None:
    opengl, vulkan = (one.pictures for one in both)
    assert opengl.keys() == vulkan.keys()
    differing = {}
    for name, picture in opengl.items():
        count = int(drawn(picture).sum())
        assert count > 100, name
        for one, other in ((picture, vulkan[name]), (vulkan[name], picture)):
            # Rounding decides on the edges of small squares, which are a fifth darker.
            tolerance = 52 if name == "squares" else 24
            share = unmatched(one, other, within=1, tolerance=tolerance).sum() / count
            if share > MOST_UNMATCHED:
                differing[name] = share
    assert differing == {}


def test_both_pick_what_they_draw(both: tuple[Result, Result]) -> None:
    opengl, vulkan = (one.found["picked"] for one in both)
    assert opengl.keys() == vulkan.keys()
    for name, place in opengl.items():
        assert place is not None, name
        assert vulkan[name] == pytest.approx(place), name
