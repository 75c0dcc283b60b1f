"""Keys that repeat and keys that are let go."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import pytest

pytest.importorskip("PySide6.QtQuick", reason="the cockpit needs the extra `qml`")

from rosglass.demo.app import HeldKeys

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.usefixtures("app")
W, A = 87, 65


@pytest.fixture
def lifted() -> list[int]:
    return []


@pytest.fixture
def keys(lifted: list[int]) -> HeldKeys:
    made = HeldKeys()
    made.lifted.connect(lifted.append)
    return made


def test_a_release_counts_soon_and_a_later_press_is_a_new_one(
    keys: HeldKeys, lifted: list[int], wait: Callable[..., None]
) -> None:
    assert keys.press(W)
    keys.lift(W)
    begin = time.monotonic()
    wait(lambda: lifted)
    assert time.monotonic() - begin < 3
    assert lifted == [W]
    assert keys.press(W)


def test_a_repeat_is_neither_a_release_nor_a_press(
    keys: HeldKeys, lifted: list[int], wait: Callable[..., None]
) -> None:
    assert keys.press(W)
    assert keys.press(A)
    for _ in range(5):
        keys.lift(W)
        assert not keys.press(W)
        wait.nothing_happens(0.025)
    assert lifted == []
    keys.lift(A)
    wait(lambda: lifted)
    assert lifted == [A]


def release_another(keys: HeldKeys, lifted: list[int], wait: Callable[..., None]) -> None:
    """Release a key after all others, and check that it is the only one that was released."""
    keys.press(A)
    keys.lift(A)
    wait(lambda: lifted)
    assert lifted == [A]


def test_a_hiccup_does_not_turn_a_repeat_into_a_release(
    keys: HeldKeys, lifted: list[int], wait: Callable[..., None]
) -> None:
    from PySide6.QtCore import QCoreApplication

    keys.press(W)
    keys.lift(W)
    time.sleep(0.1)
    QCoreApplication.processEvents()
    assert not keys.press(W)
    release_another(keys, lifted, wait)


def test_a_key_pressed_before_does_not_count_until_it_was_let_go(
    keys: HeldKeys, lifted: list[int], wait: Callable[..., None]
) -> None:
    keys.press(W)
    keys.clear()
    for _ in range(3):
        keys.lift(W)
        assert not keys.press(W)
    keys.lift(W)
    release_another(keys, lifted, wait)
    assert keys.press(W)
