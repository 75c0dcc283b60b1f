"""Finding the window of an item leaves the window alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.qml.elements.image_sinks import Sink, window_of
from rosglass.qt import is_alive

if TYPE_CHECKING:
    from conftest import Bench

pytestmark = pytest.mark.both_qt

BODY = """
    Window {
        visible: true; width: 100; height: 100
        property alias item: loader.item
        function drop() { loader.active = false }
        Loader { id: loader; sourceComponent: ImageItem { width: 50; height: 50 } }
    }
"""


def test_the_window_outlives_an_item_that_asked_for_it(bench: Bench, wait: Any) -> None:
    window: Any = bench.load(BODY, "import QtQuick 2.15\nimport QtQuick.Window 2.15")
    item: Any = window.property("item")
    assert window_of(item) is window
    assert Sink(item).room() == (56, 56)
    window.drop()
    wait(lambda: not is_alive(item))
    assert is_alive(window)
    assert window.property("item") is None


def test_an_item_in_no_window(bench: Bench) -> None:
    item: Any = bench.load("Item {}", "import QtQuick 2.15")
    assert window_of(item) is None
