"""What the README shows is what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_interface_shown_is_the_example() -> None:
    shown = re.search(r"```qml\n(.*?)```", README, re.DOTALL)
    example = (ROOT / "examples/remote_control.qml").read_text(encoding="utf-8")
    assert shown is not None
    assert shown[1] == example
    assert len(example.splitlines()) <= 36


@pytest.mark.parametrize("link", re.findall(r"\]\((?!http)([^)#]+)\)", README))
def test_links_lead_somewhere(link: str) -> None:
    assert (ROOT / link).exists()


def test_make_targets_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    shown = set(re.findall(r"`?make ([a-z]+)\b[` ]", README))
    assert {"demo", "test"} <= shown
    assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in shown)
