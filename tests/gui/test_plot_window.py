"""The window of ``rosglass plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.both_qt


def test_plot_opens_a_window(start: Any, tmp_path: Path) -> None:
    shot = tmp_path / "shot.png"
    program = start(
        "plot", "/odom:twist.twist.linear.x", "/scan:ranges[0]", "--window", "5",
        "--url", "local://no_robot", "--screenshot", shot, "--after", "0.5",
    )  # fmt: skip
    assert program.end(60) == 0, program.text
    assert shot.stat().st_size > 0
    assert "WARNING" not in program.text
    assert "Error" not in program.text
