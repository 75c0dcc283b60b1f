"""The page on an operator's screen in ten minutes keeps its promises."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LINES = (ROOT / "examples" / "operator_screen.qml").read_text(encoding="utf-8").splitlines()


def test_the_screen_has_less_than_40_lines() -> None:
    assert len(LINES) < 40
    assert max(map(len, LINES)) <= 130


@pytest.mark.parametrize(
    "control",
    [
        "CameraView", "DriveStick", "DriveKeys", "EmergencyStop", "Battery", "MapView", "Plot",
        "ServiceButton",
    ],
)  # fmt: skip
def test_the_screen_has_each_control(control: str) -> None:
    assert any(f"{control} {{" in line for line in LINES)
    assert control in (ROOT / "docs" / "ten_minutes.md").read_text(encoding="utf-8")
