"""Measure what importing rosglass costs, against rosbags and genpy, in fresh processes.

    python benchmarks/imports.py [--runs N] [--json FILE]

Prints the median wall time of the import statement and what it adds to the process' memory.
Exits 1 when importing rosglass or its codec pulls in numpy or Qt, or takes 60 ms or more.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

#: `import rosglass` has to stay below this, without Qt and numpy.
LIMIT_MS = 60.0

CASES = {
    "rosglass": "import rosglass",
    "rosglass, codec ready": "import rosglass; rosglass.load",
    "rosglass, first Twist decoded": (
        "import rosglass; "
        "rosglass.load('geometry_msgs/msg/Twist').decode(b'\\0\\1\\0\\0' + bytes(48)).linear.x"
    ),
    "rosbags.typesys": "import rosbags.typesys",
    "rosbags.typesys, first Twist decoded": (
        "from rosbags.typesys import Stores, get_typestore; "
        "get_typestore(Stores.ROS2_JAZZY).deserialize_cdr(b'\\0\\1\\0\\0' + bytes(48), "
        "'geometry_msgs/msg/Twist').linear.x"
    ),
    "mcap_ros2.decoder": "import mcap_ros2.decoder",
    "genpy.dynamic": "import genpy.dynamic",
    "numpy": "import numpy",
}
#: Targets: how many times faster than a peer, and the absolute figure in milliseconds.
TARGETS = {
    "rosglass": (LIMIT_MS, {}),
    "rosglass, codec ready": (20.0, {"rosbags.typesys": 1.9, "genpy.dynamic": 7.0}),
    "rosglass, first Twist decoded": (None, {"rosbags.typesys, first Twist decoded": 3.0}),
}
_PROBE = """
import sys
sys.path.append({debian!r})
from time import perf_counter
def used():
    try:
        with open("/proc/self/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))
    except OSError:
        return 0  # not Linux
before, start = used(), perf_counter()
{statement}
spent = perf_counter() - start
heavy = [m for m in ("numpy", "PySide6", "PySide2", "PyQt5", "PyQt6") if m in sys.modules]
print(spent * 1000, used() - before, ",".join(heavy) or "-")
"""
DEBIAN_PACKAGES = "/usr/lib/python3/dist-packages"


def probe(statement: str, cache: str) -> tuple[float, float, str] | None:
    """Milliseconds, kilobytes (0 if unknown) and heavy modules of a statement, run afresh.

    `cache` is the folder for byte code.
    """
    code = _PROBE.format(statement=statement, debian=DEBIAN_PACKAGES)
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        # Compiled once for everybody, wherever byte code may or may not be written otherwise.
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": cache},
    )
    if run.returncode:
        if "ModuleNotFoundError" in run.stderr:
            return None
        raise SystemExit(f"{statement!r} failed:\n{run.stderr}")
    spent, memory, heavy = run.stdout.split()
    return float(spent), float(memory), "" if heavy == "-" else heavy


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=11, help="fresh processes per statement")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures there")
    options = parser.parse_args()
    taken: dict[str, list[tuple[float, float, str]]] = {name: [] for name in CASES}
    with tempfile.TemporaryDirectory(prefix="rosglass-bytecode-") as cache:
        # One turn that is not counted writes the byte code; then the cases take turns.
        for turn in range(options.runs + 1):
            for name, statement in CASES.items():
                result = probe(statement, cache)
                if result is not None and turn:
                    taken[name].append(result)
    figures = {
        name: (
            statistics.median(r[0] for r in results),
            statistics.median(r[1] for r in results) / 1000,
            results[0][2],
        )
        for name, results in taken.items()
        if results
    }
    failures = []
    print(f"{'import':38} {'ms':>7} {'MB':>6}  pulls in    against")
    for name, (spent, memory, heavy) in figures.items():
        limit, ratios = TARGETS.get(name, (None, {}))
        notes = [f"target {limit:g} ms"] if limit else []
        for peer, wanted in ratios.items():
            if peer in figures:
                ratio = figures[peer][0] / spent
                verdict = "met" if ratio >= wanted else "MISSED"
                notes.append(f"{ratio:.3g}x {peer} (target {wanted:g}x: {verdict})")
        print(f"{name:38} {spent:7.1f} {memory:6.1f}  {heavy or '-':10}  {'; '.join(notes)}")
        if name.startswith("rosglass") and heavy:
            failures.append(f"{name}: pulls in {heavy}")
    for name in CASES.keys() - figures.keys():
        print(f"not measured, since it is not installed: {name}")
    if figures["rosglass"][0] >= LIMIT_MS:
        failures.append(f"import rosglass takes {figures['rosglass'][0]:.1f} ms")
    for failure in failures:
        print(f"FAILED: {failure}", file=sys.stderr)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
