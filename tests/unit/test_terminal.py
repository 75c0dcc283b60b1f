"""Warnings and node logs are visible in programs without logging set-up."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from mcap import writer as mcap_writer

import rosglass

if TYPE_CHECKING:
    from pathlib import Path

PROGRAM = """
import logging
from rosglass.comm.log import warn_on_terminal
{0}
warn_on_terminal()
warn_on_terminal()
logging.getLogger("rosglass.comm").warning("it is late")
logging.getLogger("rosglass.comm").info("it is early")
"""


@pytest.mark.parametrize(
    ("arrangement", "seen"),
    [
        ("", "WARNING rosglass.comm: it is late\n"),
        ("logging.basicConfig(format='own %(message)s')", "own it is late\n"),
        ("logging.getLogger('rosglass').addHandler(logging.StreamHandler())", "it is late\n"),
        ("logging.lastResort = None", ""),
    ],
)
def test_warnings_are_seen_once(arrangement: str, seen: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(arrangement)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stderr == seen


def write_recording(path: Path) -> Path:
    """Write a recording of one message."""
    text = rosglass.load("std_msgs/msg/String")
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    schema = writer.register_schema(text.name, "ros2msg", b"string data")
    channel = writer.register_channel("/chat", "cdr", schema)
    writer.add_message(channel, 0, text.encode(data="hello"), 0)
    writer.finish()
    return path


NODE = """
import logging, sys
import rosglass
{0}
node = rosglass.connect({1!r}, name="panel", own_services=False)
{2}
node.logger.error("no brake")
node.logger.getChild("arm").info("ready")
node.logger.debug("details")
node.close()
"""


@pytest.mark.parametrize("url", ["ros1://127.0.0.1:1", "zenoh://127.0.0.1:1", "replay:"])
@pytest.mark.parametrize(
    ("arrangement", "later", "error", "info"),
    [
        ("", "", "ERROR {0}: no brake\n", "INFO {0}.arm: ready\n"),
        ("logging.basicConfig(format='own %(message)s')", "", "own no brake\n", "own ready\n"),
        ("", "node.logger.addHandler(logging.StreamHandler())", "no brake\n", "ready\n"),
        ("logging.lastResort = None", "", "", ""),
    ],
    ids=["nothing configured", "configured", "own handler", "silent"],
)
def test_node_log_is_printed_once(
    url: str, arrangement: str, later: str, error: str, info: str, tmp_path: Path
) -> None:
    if url == "replay:":
        url += str(write_recording(tmp_path / "drive.mcap"))
    done = subprocess.run(
        [sys.executable, "-c", NODE.format(arrangement, url, later)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    name = "ros.panel" if url.startswith("ros1") else "panel"
    lines = [line for line in done.stderr.splitlines(True) if "brake" in line or "ready" in line]
    assert "".join(lines) == error.format(name) + info.format(name)
    assert "details" not in done.stderr
