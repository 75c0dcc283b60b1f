"""Fixtures of the interface tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rosglass.interfaces import Library

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

ENVIRONMENT = (
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "ROS_PACKAGE_PATH",
    "ROS_DISTRO",
    "ROSGLASS_PREFER_DEFINITIONS",
)


@pytest.fixture(autouse=True)
def no_workspace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests see no workspace that the developer happens to have sourced."""
    for variable in ENVIRONMENT:
        monkeypatch.delenv(variable, raising=False)


@pytest.fixture
def library() -> Library:
    return Library()


@pytest.fixture(scope="session")
def standard() -> Library:
    """The standard definitions, loaded once for all tests that only read."""
    return Library()


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write files below tmp_path, given as path=text; returns tmp_path."""

    def write_files(files: dict[str, str]) -> Path:
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return tmp_path

    return write_files
