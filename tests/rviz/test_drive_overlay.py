"""Controls that steer a robot, in overlays over RViz."""

from __future__ import annotations

from typing import Any


def test_stick_and_keys_steer_and_a_dialog_halts(seen: Any) -> None:
    """PySide 2 deleted RViz's window when its parent was asked for: it crashed at a click."""
    assert seen("drive_overlay_program.py", "1", "software") == [True] * 6
