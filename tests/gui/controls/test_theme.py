"""The colours of all controls."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.both_qt


def test_every_colour_follows_the_mode(controls: Any) -> None:
    probe = controls.show(
        """Item {
        property color shown
        function use(mode) { Theme.mode = mode }
        function text(color) { shown = color; return shown.toString() }
        function wrong() {
            return Object.keys(Theme.colors)
                .filter(name => typeof Theme.colors[name] === "string" && name in Theme)
                .filter(name => text(Theme[name]) !== text(Theme.colors[name])).join(" ")
        } }"""
    )
    for mode in ("bright", "contrast", "dark"):
        probe.use(mode)
        assert probe.wrong() == ""
