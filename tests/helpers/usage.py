"""Resources that this process uses, for tests that nothing is left behind."""

from __future__ import annotations

import os
from pathlib import Path


def memory() -> int:
    """Return the bytes of physical memory in use."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def open_files() -> int:
    """Return the number of open files and sockets."""
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def native_threads() -> int:
    """Return the number of threads, those included that are not Python's."""
    return sum(1 for _ in Path("/proc/self/task").iterdir())
