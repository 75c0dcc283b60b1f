"""Settings of displays: what they take from ``.rviz`` files."""

from __future__ import annotations

import pytest

from rosglass.errors import Error
from rosglass.scene.configs.rviz_config import RvizConfig
from rosglass.scene.configs.settings import Setting


def value(text: str) -> object:
    """Return a value as a config has it."""
    found = RvizConfig.parse(
        f"Visualization Manager:\n  Displays:\n    - {{Class: rviz/TF, V: {text}}}\n"
    )
    return found.displays[0].settings["V"]


@pytest.mark.parametrize("kind", ["string", "frame"])
@pytest.mark.parametrize("text", ["12", "true", "0.5", "1.10", "007", "arm_1"])
def test_names_that_yaml_takes_for_numbers_are_texts(kind: str, text: str) -> None:
    assert Setting("TF Prefix", kind, "").restore(value(text)) == text


@pytest.mark.parametrize("text", ["0.5", "0.50", "5e-1", "'0.5'"])
def test_numbers_that_a_config_keeps_as_text(text: str) -> None:
    assert Setting("Alpha", "float", 1.0).restore(value(text)) == 0.5


def test_colors_are_written_as_rviz_does() -> None:
    setting = Setting("Max Color", "color", "#000000")
    for text in ("255; 128; 0", "'#ff8000'", "300; 128; -5"):
        assert setting.saved(setting.restore(value(text))) == "255; 128; 0"
    with pytest.raises(Error, match=r"Max Color: expected a colour, .*, got '1; 2'"):
        setting.restore("1; 2")


def test_an_empty_choice_is_named_beside_the_others() -> None:
    setting = Setting("Color Transformer", "enum", "", choices=["", "AxisColor", "RGB8"])
    with pytest.raises(Error, match="expected one of '', AxisColor, RGB8, got 'AxisColour'; did y"):
        setting.kind.read("AxisColour")
