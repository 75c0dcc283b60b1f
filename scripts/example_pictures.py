"""Take the pictures of the examples that the documentation shows.

    xvfb-run -s "-screen 0 1280x800x24" python scripts/example_pictures.py

Starts a Zenoh router, the simulated robot and what an example needs besides.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from rosglass.ros2.zenoh.router import Router

ROOT = Path(__file__).parents[1]
EXAMPLES, TARGET = ROOT / "examples", ROOT / "docs" / "images" / "examples"
PARTNERS = {"figure4": "pose_prediction.py", "figure5": "humanoid.py"}
ROSGLASS = [sys.executable, "-m", "rosglass.cli"]


def main() -> None:
    """Take them all."""
    TARGET.mkdir(parents=True, exist_ok=True)
    files = [*sorted(EXAMPLES.glob("*.qml")), *sorted(EXAMPLES.glob("paper/figure*.qml"))]
    with Router("tcp/127.0.0.1:0") as router:
        commands = [[*ROSGLASS, "robot", "--url", router.url]]
        commands += [
            [sys.executable, str(EXAMPLES / "paper" / name), router.url]
            for name in PARTNERS.values()
        ]
        partners = [subprocess.Popen(command) for command in commands]
        try:
            for file in files:
                picture = ["--screenshot", str(TARGET / f"{file.stem}.png"), "--after", "4"]
                command = [*ROSGLASS, "run", str(file), "--url", router.url, *picture]
                subprocess.run(command, check=True)
        finally:
            for partner in partners:
                partner.kill()


if __name__ == "__main__":
    main()
