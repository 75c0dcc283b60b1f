"""Takes the screenshots of the examples for the documentation.

    xvfb-run -s "-screen 0 1280x800x24" python scripts/example_pictures.py [NAME ...]

Starts a Zenoh router, the simulated robot and what else an example needs. Screenshots are reduced
to few colours, and so to few bytes.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from PIL import Image, ImageChops

from rosglass.wires.zenoh.router import Router

ROOT = Path(__file__).parents[1]
EXAMPLES, TARGET = ROOT / "examples", ROOT / "docs" / "images" / "examples"
CONTROLS = ROOT / "docs" / "images" / "controls"
PARTNERS = {
    "figure4": "paper/pose_prediction.py",
    "figure5": "paper/humanoid.py",
    "geo_map": "controls/gps.py",
}
#: Partners that run with their example alone: controls find topics by type, and would show these.
FLEETS = {"robot_tiles": "controls/fleet.py"}
#: Seconds until an example shows what it is about, where it is more than usual.
AFTER = {"replay": 12, "image_publisher": 8, "camera": 8, "geo_map": 8}
ROSGLASS = [sys.executable, "-m", "rosglass.cli"]
#: The program with a virtual gamepad, for which it waits until SDL has been started.
WITH_GAMEPAD = """
import sys, threading, time
sys.path.insert(0, "tests/gui")
from rosglass.cli import main
def plug():
    time.sleep(2)
    from virtual_pads import VirtualPad
    pads.append(VirtualPad("Wireless Controller"))
    pads[0].axis(1, -0.7), pads[0].axis(0, -0.25), pads[0].axis(4, -1), pads[0].axis(5, -1)
    pads[0].button(0), pads[0].button(9)
pads = []
threading.Thread(target=plug, daemon=True).start()
sys.exit(main())
"""
#: Pixels left below what an example shows.
MARGIN = 20
#: Maximum bytes of a screenshot; larger ones, of camera images, are scaled down until they fit.
MOST = 40_000


def main(names: list[str]) -> None:
    """Take these screenshots; all of them without names."""
    for folder in (TARGET, CONTROLS):
        folder.mkdir(parents=True, exist_ok=True)
    patterns = ("*.qml", "ros1/*.qml", "paper/figure*.qml", "controls/*.qml")
    files = [file for pattern in patterns for file in sorted(EXAMPLES.glob(pattern))]
    with Router("tcp/127.0.0.1:0") as router:
        commands = [[*ROSGLASS, "robot", "--url", router.url]]
        commands += [
            [sys.executable, str(EXAMPLES / name), router.url] for name in PARTNERS.values()
        ]
        partners = [subprocess.Popen(command) for command in commands]
        try:
            for file in files:
                if names and file.stem not in names:
                    continue
                folder = CONTROLS if file.parent.name == "controls" else TARGET
                target, after = folder / f"{file.stem}.png", AFTER.get(file.stem, 4)
                picture = ["--screenshot", str(target), "--after", str(after)]
                program = [sys.executable, "-c", WITH_GAMEPAD]
                program = program if file.stem == "gamepad" else ROSGLASS
                command = [*program, "run", str(file), "--url", router.url, *picture]
                fleet = []
                if file.stem in FLEETS:
                    path = str(EXAMPLES / FLEETS[file.stem])
                    fleet.append(subprocess.Popen([sys.executable, path, router.url]))
                    partners += fleet
                subprocess.run(command, check=True, cwd=ROOT)
                for partner in fleet:
                    partner.kill()
                shrink(target)
        finally:
            for partner in partners:
                partner.kill()


def shrink(file: Path) -> None:
    """Crop empty space at the bottom, and reduce the file to 64 colours and the maximum size."""
    whole = Image.open(file).convert("RGB")
    corner = whole.getpixel((whole.width - 1, whole.height - 1))
    assert corner is not None
    content = ImageChops.difference(whole, Image.new("RGB", whole.size, corner)).getbbox()
    if content is not None:
        whole = whole.crop((0, 0, whole.width, min(whole.height, content[3] + MARGIN)))
    scale = 1.0
    while True:
        size = (round(whole.width * scale), round(whole.height * scale))
        small = whole if scale == 1 else whole.resize(size, Image.Resampling.LANCZOS)
        small.quantize(64, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            file, optimize=True
        )
        if file.stat().st_size <= MOST:
            return
        scale *= 0.9


if __name__ == "__main__":
    main(sys.argv[1:])
