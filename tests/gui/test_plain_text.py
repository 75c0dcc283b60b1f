"""What a robot says is shown as it is, however it looks: at run time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass.demo
from rosglass.qt import QT6

if TYPE_CHECKING:
    from collections.abc import Callable

COCKPIT = Path(rosglass.demo.__file__).with_name("cockpit")
pytestmark = pytest.mark.skipif(not QT6, reason="the demo's cockpit is for Qt 6")
HOSTILE = "<img src='http://0.0.0.0:9/a.png'><b>all good</b>"


def test_a_status_that_looks_like_html_is_shown_as_it_is(
    running: Any, wait: Callable[..., None]
) -> None:
    root = running.load(
        """Item {
            Diagnostics { width: 300; height: 300 }
            function formats() {
                const found = []
                function walk(item) {
                    if (item.textFormat !== undefined && String(item.text).indexOf("<img") >= 0)
                        found.push(item.textFormat === Text.PlainText)
                    for (let n = 0; n < item.children.length; ++n)
                        walk(item.children[n])
                }
                walk(this)
                return JSON.stringify(found)
            }
        }""",
        f'import QtQuick 2.15\nimport "{COCKPIT.as_uri()}"',
    )
    publisher = running.robot.create_publisher(
        "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"
    )
    status = {"name": HOSTILE, "message": HOSTILE, "hardware_id": HOSTILE}
    found: list[bool] = []

    def shown() -> bool:
        publisher.publish({"status": [status]})
        found[:] = json.loads(root.formats())
        return bool(found)

    wait(shown)
    assert len(found) >= 2
    assert all(found)
