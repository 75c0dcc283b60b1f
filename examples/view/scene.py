"""A 3D view whose displays, camera and tools Python chooses.

Run it with ``python examples/view/scene.py [URL]``, e.g. against ``rosglass robot --equipped``.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rosglass.qml import Application
from rosglass.scene import SceneView

url = sys.argv[1] if len(sys.argv) > 1 else ""
app = Application(Path(__file__).with_name("scene.qml"), url=url)
app.load()
view = app.window.findChild(SceneView, "view")

view.scene.add("Map", topic="/map", alpha=0.6)
scan = view.scene.add("LaserScan", "Front laser", topic="/scan", sizePixels=4)
scan.statusChanged.connect(lambda: print(f"{scan.name}: {scan.statusLevel}", flush=True))
view.select_view("ThirdPersonFollower")
view.controller.set("Target Frame", "base_link")
view.tools.add("SetGoal", topic="/goal_pose")
sys.exit(app.run())
