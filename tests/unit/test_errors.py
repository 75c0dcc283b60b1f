"""Error messages stay readable, whatever they are about."""

from __future__ import annotations

import pickle

import pytest

import rosglass
from rosglass import errors

LONG = "x" * 100_000


@pytest.mark.parametrize("name", [name for name in errors.__all__ if name != "Error"])
def test_values_of_any_size_are_shown_in_short(name: str) -> None:
    kind = getattr(errors, name)
    more: tuple[str, ...] = ("is wrong",) if kind is errors.DecodeError else ()
    more = (LONG, "a number") if issubclass(kind, errors.ConversionError) else more
    text = str(kind(f"/topic: {LONG!r} is not a number; give one", *more))
    assert len(text) < 1000
    assert "xxx... (10000" in text
    assert isinstance(kind("a", *more), rosglass.Error)


def test_readable_text_is_not_shortened() -> None:
    definition = "\n".join(f"float64 field{number} # metres" for number in range(1000))
    text = f"/topic: theirs:\n{definition}"
    assert str(rosglass.TypeNotFoundError(text)) == text
    path = "/home/" + "robot/" * 40 + "a.yaml: not there"
    assert str(rosglass.ParameterError(path)) == path


def test_long_lines_and_errors_about_errors() -> None:
    words = "word " * 20_000
    text = str(rosglass.ServiceError(words))
    assert text.endswith("... (100000 characters)")
    assert len(text) < 2100
    assert str(rosglass.ServiceError(text)) == text
    assert str(pickle.loads(pickle.dumps(rosglass.ServiceError(text)))) == text
    assert rosglass.ServiceError(1, "two").args == (1, "two")


def test_argument_of_any_size() -> None:
    with pytest.raises(rosglass.Error) as caught:
        rosglass.load(LONG)
    assert len(str(caught.value)) < 1000
    with pytest.raises(rosglass.Error) as caught:
        rosglass.QoS(depth=LONG)  # type: ignore[arg-type]
    assert len(str(caught.value)) < 1000
