"""Comments and units, which user interfaces show."""

from __future__ import annotations

import pytest

from rosglass.interfaces import parse_message

TEXT = """\
# What it is about.
#   Indented.

# Above,
# in two lines
float64 speed # beside [m/s]
              # and continued

# Section

#

int32 A=1    ## one
float64 none
  # still about none
# not about none any more
int32 last
"""


def comments() -> dict[str, str]:
    definition = parse_message(TEXT, "my_msgs/Odd")
    return {item.name: item.comment for item in (*definition.fields, *definition.constants)}


def test_comments_go_to_what_they_are_about() -> None:
    assert comments() == {
        "speed": "Above,\nin two lines\nbeside [m/s]\nand continued",
        "A": "Section\n\none",
        "none": "still about none",
        "last": "not about none any more",
    }


def test_comment_about_the_message() -> None:
    assert parse_message(TEXT, "my_msgs/Odd").comment == "What it is about.\n  Indented."


def test_leading_comment_that_touches_the_first_field_is_about_both() -> None:
    definition = parse_message("# A speed [m/s]\nfloat64 value\nfloat64 other", "my_msgs/Odd")
    assert definition.comment == definition.fields[0].comment == "A speed [m/s]"
    assert definition.fields[0].unit == ""  # it may be about the whole message


def test_leading_comment_of_a_single_field_gives_its_unit() -> None:
    assert parse_message("# Speed [m/s]\nfloat64 value", "my_msgs/Odd").fields[0].unit == "m/s"


@pytest.mark.parametrize(
    ("comment", "unit"),
    [
        ("[m]", "m"),
        ("angle [rad]", "rad"),
        ("[rad/s] about z", "rad/s"),
        ("[m/s^2]", "m/s^2"),
        ("[kg-m^2]", "kg-m^2"),
        ("[kg*m^2]", "kg*m^2"),
        ("[m / s]", "m / s"),
        ("[1/s]", "1/s"),
        ("[°C]", "°C"),
        ("[%]", "%"),
        ("[Ω]", "Ω"),
        ("[degrees]", "degrees"),
        ("from [0, 1] in [m]", "m"),
        ("[m], again in [m]", "m"),
        ("x [m] and y [s]", ""),
        ("[0, 1]", ""),
        ("[0..1]", ""),
        ("[0]", ""),
        ("[-pi/2]", ""),
        ("[see the manual]", ""),
        ("[enum]", ""),
        ("[optional]", ""),
        ("m", ""),
        ("[]", ""),
    ],
)
def test_units(comment: str, unit: str) -> None:
    assert parse_message(f"float64 x # {comment}", "my_msgs/Odd").fields[0].unit == unit
