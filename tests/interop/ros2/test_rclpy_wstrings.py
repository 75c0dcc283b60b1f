"""wstring, both ways: rclpy writes and reads each UTF-16 unit in 4 bytes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

from rosglass.comm import Durability, QoS
from rosglass.messages import MessageType

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable
    from pathlib import Path

    from rosglass.comm import Node

pytestmark = pytest.mark.peers

WSTRINGS = "test_msgs/msg/WStrings"
# Latin, Japanese, beyond the basic plane (two units each), and lengths of every rest modulo 4.
TEXTS = ["", "a", "Grüße", "日本語", "🤖", "a🤖b日𝄞"]


def test_wstrings_reach_rclpy_and_come_back(
    rclpy_python: Path,
    start_rclpy: Callable[..., subprocess.Popen[str]],
    dds_connect: Callable[..., Node],
) -> None:
    file = rclpy_python.parents[1] / "share/test_msgs/msg/WStrings.msg"
    kind = MessageType.from_text(WSTRINGS, file.read_text(encoding="utf-8"))
    peer = start_rclpy("rclpy_wstrings")
    assert peer.stdout is not None
    node = dds_connect("panel")
    answers: list[Any] = []
    kept = QoS(depth=10, durability=Durability.TRANSIENT_LOCAL)
    node.create_subscription("/answered", kind, answers.append, kept)
    asked = node.create_publisher("/asked", kind, kept)
    for count, text in enumerate(TEXTS, 1):
        asked.publish(wstring_value=text, unbounded_sequence_of_wstrings=TEXTS)
        eventually(lambda count=count: len(answers) == count, what=f"the answer to {text!r}")
        assert json.loads(peer.stdout.readline()) == [text, *TEXTS]
        message = answers[-1]
        assert message.wstring_value == text
        assert message.unbounded_sequence_of_wstrings == TEXTS
        assert message.wstring_value_default3 == "ハローワールド"
