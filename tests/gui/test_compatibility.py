"""The page that compares our QML modules with the reference plugins says what is registered."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

# PySide2 does not show a type's base; the members are the same files' on both Qt versions.
if find_spec("PySide6") is None:
    pytest.skip("the page is made from the types as Qt 6 sees them", allow_module_level=True)

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def compatibility(app: Any) -> Any:
    sys.path.insert(0, str(ROOT / "scripts"))
    import compatibility as module

    yield module
    sys.path.remove(str(ROOT / "scripts"))


def test_the_page_is_up_to_date(compatibility: Any) -> None:
    text = compatibility.PAGE.read_text(encoding="utf-8")
    assert text == compatibility.page(text), "run scripts/compatibility.py --write"


@pytest.mark.parametrize("module", ["Ros", "Ros2"])
def test_no_member_of_the_references_is_missing(compatibility: Any, module: str) -> None:
    types = compatibility.types(module)
    missing = [
        f"{name}.{member}"
        for name, members in compatibility.REFERENCE[module].items()
        for member in members.split()
        if name not in types or member not in compatibility.members(types[name])
    ]
    assert missing == []


def test_notes_are_about_what_exists(compatibility: Any) -> None:
    for module, name, member in compatibility.NOTES:
        assert member in compatibility.members(compatibility.types(module)[name]), (name, member)
