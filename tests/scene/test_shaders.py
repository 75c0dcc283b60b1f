"""The compiled shaders are those of the sources."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(
    not Path(sys.executable).with_name("pyside6-qsb").exists(),
    reason="the compiler of shaders comes with PySide6-Addons",
)
def test_shaders_are_up_to_date() -> None:
    command = [sys.executable, str(ROOT / "scripts/shaders.py"), "--check"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}run: python scripts/shaders.py"
