"""Overlays on screens with more pixels than units: each pixel is drawn, clicks hit their target."""

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


@pytest.mark.parametrize(
    ("factor", "renderer"),
    [("1", "opengl"), ("2", "opengl"), ("1.5", "opengl"), ("2", "software"), ("1.5", "software")],
)
def test_clicks_hit_what_is_seen(factor: str, renderer: str, seen: Any) -> None:
    found = seen("screen_input_program.py", factor, renderer)
    for place in found["item"]:
        assert place == pytest.approx([7, 9], abs=1)
    for place in found["widget"]:
        assert place == pytest.approx([93, 51], abs=1)
    # Where Qt says that they are on the screen; in QML drawn by OpenGL, Qt takes pixels for units.
    assert found["screen"] == [[True], [True]]
    for off in found["global"] if factor == "1" or renderer == "software" else []:
        assert off == pytest.approx([0, 0], abs=1)
