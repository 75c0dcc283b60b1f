"""The end of a process that does not end by itself."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import threading, time
from rosglass.qml.interrupt import end_process_within

def fail(_):
    raise OSError(22, "Invalid argument")  # as under libfaketime, when a clock is set

time.sleep = fail
end_process_within(0.1, 7)
threading.Event().wait(60)
"""


def test_the_process_ends_even_where_sleeping_fails() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], timeout=120, check=False)
    assert done.returncode == 7
