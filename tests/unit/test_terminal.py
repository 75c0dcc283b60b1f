"""What the library warns of is seen in programs that have not configured logging."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import logging
from rosglass.comm.terminal import warn_on_terminal
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
