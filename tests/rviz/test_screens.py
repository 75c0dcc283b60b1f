"""Overlays on screens with more pixels than units, and where there is no OpenGL for Qt."""

from __future__ import annotations

from typing import Any

import pytest


@pytest.mark.parametrize(
    ("factor", "renderer"),
    [("2", "opengl"), ("1.5", "opengl"), ("2", "software"), ("1.5", "auto")],
)
def test_overlays_have_every_pixel_of_the_screen(factor: str, renderer: str, seen: Any) -> None:
    found = seen("hidpi_program.py", factor, renderer)
    assert found["ratio"] == float(factor)
    assert found["renderer"] == ("opengl" if renderer == "opengl" else "software")
    assert not found["stretched"]
    assert found["units"] == [True, True]
    assert found["inside"] == ["#0080ff", "#0080ff", "#ff0000"]
    assert not {"#0080ff", "#ff0000"} & set(found["outside"])
    assert found["widget"] == ["#00ff00", "#00ff00"]
    assert "#00ff00" not in found["beside"]
    assert found["problem"] == ""
