"""The tests of test_rendering.py with OpenGL, and items that only OpenGL can draw."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent


def test_with_opengl_overlays_look_the_same_and_shaders_and_video_are_drawn() -> None:
    # RViz, and Qt's choice of a renderer, are there once per process.
    files = [str(HERE / name) for name in ("test_rendering.py", "opengl_rendering.py")]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *files],
        env={**os.environ, "TEST_RENDERER": "opengl"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=110,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-5000:]
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed is not None
    assert int(passed[1]) >= 10
