"""Build the roscpp peer of all roscpp_*.cpp, unless it is built already; print where it is.

Usage: ``build_roscpp.py FOLDER``. It takes a minute of processor time: what runs all tests begins
with it beside something else, and processes of tests that need it at once wait for one of them.
"""

from __future__ import annotations

import fcntl
import hashlib
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
FLAGS = ["-std=c++17", "-O1", "-DBOOST_BIND_GLOBAL_PLACEHOLDERS", "-I", str(HERE), "-c"]
LIBRARIES = ["-lactionlib", "-lboost_thread", "-lboost_system", "-lpthread"]


def build(folder: Path) -> Path:
    """Return the program in `folder`; what has not changed is not compiled again."""
    shared = b"".join(path.read_bytes() for path in sorted(HERE.glob("roscpp_*.hpp")))
    objects = []
    for source in sorted(HERE.glob("roscpp_*.cpp")):
        version = hashlib.sha256(source.read_bytes() + shared).hexdigest()[:16]
        built = folder / f"{source.stem}_{version}.o"
        objects.append(built)
        if not built.exists():
            made = built.with_suffix(".part")
            subprocess.run(["g++", *FLAGS, str(source), "-o", str(made)], check=True)
            made.rename(built)
    names = hashlib.sha256("".join(path.name for path in objects).encode()).hexdigest()[:16]
    program = folder / f"roscpp_peer_{names}"
    if not program.exists():
        made = program.with_suffix(".part")
        asked = ["pkg-config", "--libs", "roscpp"]
        found = subprocess.run(asked, check=True, capture_output=True, text=True).stdout.split()
        command = ["g++", "-o", str(made), *map(str, objects), *found, *LIBRARIES]
        subprocess.run(command, check=True)
        made.rename(program)
    return program


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        print(build(folder))
