"""Everything that QML can write or get has its page in the documentation, with all its members."""

from __future__ import annotations

import re
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

# PySide2 does not show a type's base; the members are the same files' on both Qt versions.
if find_spec("PySide6") is None:
    pytest.skip("members are read from the types as Qt 6 sees them", allow_module_level=True)

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = {file.stem: file.read_text(encoding="utf-8") for file in DOCS.glob("elements/*.md")}
#: QML files, which have no type of ours.
COMPOSED = {("Ros", "VideoOutput"), ("Ros2", "VideoOutput")}


def named(text: str) -> set[tuple[str, str]]:
    """Return what a page says it is about: module and type."""
    found = set()
    for module, names in re.findall(r"In `(Ros2?) 1\.0`: ([^.]*)\.", text.split("\n")[2]):
        found |= {(module, name) for name in re.findall(r"`(\w+)`", names)}
    return found


@pytest.fixture(scope="module")
def types(app: Any) -> Any:
    sys.path.insert(0, str(ROOT / "scripts"))
    import compatibility

    yield {
        (module, name): compatibility.members(kind)
        for module in ("Ros", "Ros2")
        for name, kind in compatibility.types(module).items()
    }
    sys.path.remove(str(ROOT / "scripts"))


def test_every_type_has_one_page(types: Any) -> None:
    described = [one for text in PAGES.values() for one in named(text)]
    assert sorted(described) == sorted({*types, *COMPOSED})


@pytest.mark.parametrize("name", sorted(PAGES))
def test_page_describes_all_members(name: str, types: Any) -> None:
    text = re.sub(r"```.*?```", "", PAGES[name], flags=re.DOTALL)
    described = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`\n]+)`", text))))
    missing = [
        f"{module}: {kind}.{member}"
        for module, kind in sorted(named(text) - COMPOSED)
        for member in types[module, kind]
        if member not in described
    ]
    assert missing == []


@pytest.mark.parametrize("name", sorted(PAGES))
def test_a_page_has_a_screenshot_an_example_and_its_place(name: str) -> None:
    text = PAGES[name]
    pictures = re.findall(r"!\[[^]]*\]\(\.\./(images/[^)]*)\)", text)
    assert pictures
    assert all((DOCS / picture).is_file() for picture in pictures)
    example = re.search(r'--8<-- "([^"]*)"', text)
    assert example is not None
    assert (ROOT / "examples" / example.group(1)).is_file()
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split()
    assert f"elements/{name}.md" in navigation


def test_screenshots_are_small() -> None:
    sizes = {f.name: f.stat().st_size for f in DOCS.glob("images/examples/*.png")}
    assert [name for name, size in sizes.items() if size > 40_000] == []


def test_every_example_is_shown() -> None:
    page = (DOCS / "examples.md").read_text(encoding="utf-8")
    files = [*ROOT.glob("examples/*.qml"), *ROOT.glob("examples/*/*.qml")]
    # Those over RViz are one interface, and have a page of their own; controls have one each.
    whole = [file for file in files if file.parent.name not in {"controls", "rviz"}]
    assert [file.name for file in whole if file.name not in page] == []
    assert "examples/rviz" in (DOCS / "rviz.md").read_text(encoding="utf-8")
