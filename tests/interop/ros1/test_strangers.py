"""Programs on other machines of the network that are not part of the graph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).parent / "peers" / "two_machines_strangers.py"


def test_strangers_reach_no_loopback_node_and_forge_no_publishers(
    on_two_machines: Any, start_master: Any, tmp_path: Path
) -> None:
    start_master()  # skips the test where there is no ROS 1
    seen = on_two_machines(SCRIPT, str(tmp_path))
    assert seen["announced"] == "127.0.0.1"
    assert seen["knocks"] == ["closed", "closed"]
    assert seen["asked"] == []
    assert seen["problem"] == ""
