"""Draws each kind of drawable by the graphics interface of its process, for the test beside it.

Its argument is a folder: images go to pictures.npz, and what picks found to found.json. Qt reads
the graphics interface from QSG_RHI_BACKEND.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from qt_waiting import QtWaiting

from conftest import SceneBench
from rosglass.demo.processes import VirtualScreen
from rosglass.scene.render.drawing import Coloring, Labels, Lines, MapImage, Mesh, Points
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.mesh_shapes import BOX, SPHERE
from rosglass.scene.render.scene_tree import Drawable, Group

#: Position at which each drawable is picked: off every axis, so that a mirrored image differs.
PLACE = (1.0, -2.0, 0.5)
#: Times that a view is made and destroyed.
ROUNDS = 5


def points(style: str) -> Points:
    made = Points()
    at = np.stack(np.meshgrid(*[np.arange(-1, 2) * 0.8] * 3), axis=-1).reshape(-1, 3) + PLACE
    made.set_points(at, np.linspace((1, 0, 0, 1), (0, 1, 0.5, 1), len(at)))
    made.set_look(style=style, size=7 if style == "points" else 0.4)
    return made


def by_channel(mode: str) -> Points:
    """Return points that the shader colours by a number of each."""
    made = Points()
    rows = np.zeros((40, 4), np.float32)
    across = np.linspace(-3, 3, 40)
    rows[:, 0], rows[:, 1], rows[:, 2] = PLACE[0] + across, PLACE[1], PLACE[2] + across / 3
    rows[:, 3] = np.arange(40)
    rows[7, 0] = np.nan
    made.set_data(rows, 40, 16, channel=12)
    paint = Coloring(mode, 0, 40, first=(1, 1, 0), last=(0, 0.2, 1), axis=(10, 0, 0, 20))
    made.set_look(style="flat squares", size=0.3, coloring=paint)
    return made


def drawables() -> dict[str, list[Drawable]]:
    """Return the drawables of each image; the first one is picked."""
    lines, strip = Lines(3.0), Lines(0.2, in_metres=True)
    x, y, z = PLACE
    lines.set_segments([[(-3, y, z), (3, y, z)], [(x, -3, 0), (x, 3, 2)]], [[1, 0, 0], [0, 1, 0]])
    strip.set_strip([(-3, 1, 0), (0, 2, 1), (3, 1, 2)], [(1, 0, 1), (0, 1, 1), (1, 1, 0)])
    boxes, ball = Mesh(BOX, (0.9, 0.6, 0.2, 1)), Mesh(SPHERE, (0.2, 0.5, 1, 0.4))
    boxes.set_instances([instance_matrix(PLACE), instance_matrix((-2, 1, 0), (0, 0, 0.6, 0.8), 2)])
    ball.set_instances([instance_matrix((-1, 0.5, 1), scale=2)])
    picture = np.zeros((2, 2, 4), np.uint8)
    picture[..., 3], picture[0, 0], picture[1, 1] = 255, (255, 0, 0, 255), (0, 255, 0, 255)
    textured = Mesh(SPHERE)
    textured.set_instances([instance_matrix(PLACE, scale=2)])
    textured.set_texture(picture)
    cells = MapImage()
    cells.set_cells(np.arange(200).astype(np.uint8).reshape(10, 20), 0.3)
    shades = np.arange(256, dtype=np.uint8)
    cells.set_palette(np.stack([shades, 255 - shades, shades // 2, 100 + shades // 3], axis=1))
    cells.pose = instance_matrix((-2, -4, 0))
    labels, pixels = Labels(), Labels(in_pixels=True, align="left")
    labels.set_texts(["Ahoi", "zwei\nZeilen"], [PLACE, (-2, 2, 1)], 0.8, [(1, 1, 0), (0, 1, 1)])
    pixels.set_texts(["px"], [(0, 3, 0)], 40)
    return {
        **{style: [points(style)] for style in Points.STYLES},
        **{mode: [by_channel(mode)] for mode in ("flat", "rainbow", "gradient", "axis")},
        "lines": [lines, strip],
        "meshes": [boxes, ball],
        "texture": [textured],
        "map": [cells],
        "labels": [labels, pixels],
    }


def main() -> None:
    folder = Path(sys.argv[1])
    pictures: dict[str, Any] = {}
    found: dict[str, Any] = {"picked": {}}
    with VirtualScreen(800, 600) as screen:
        os.environ.update(DISPLAY=screen.display, QT_QPA_PLATFORM="xcb", QT_QUICK_BACKEND="rhi")
        from PySide6.QtGui import QGuiApplication

        import rosglass.scene

        app = QGuiApplication(["pictures"])
        rosglass.scene.register()
        bench = SceneBench(QtWaiting(), folder)
        view = bench.load()
        found["interface"] = bench.window.rendererInterface().graphicsApi().name
        shown = Group()
        view.scene.root.add(shown)
        for name, group in drawables().items():
            shown.clear()
            shown.add(*group)
            group[0].owner = name
            pictures[name] = bench.picture()
            pixel = view.camera().project(PLACE)
            hit = view.pick(pixel.x, pixel.y)
            found["picked"][name] = hit and [hit.number, *hit.point]
        bench.window.resize(300, 420)
        bench.wait(lambda: view.height() == 420)
        pictures["resized"] = bench.picture()
        for _ in range(ROUNDS):
            view = bench.load("AxesDisplay { length: 2 } GridDisplay {}")
            bench.wait(lambda view=view: len(view.scene.displays) == 2)
            pictures["made anew"] = bench.picture()
        found["problem"] = view.problem
        bench.close()
        del app
    np.savez(folder / "pictures.npz", **pictures)
    (folder / "found.json").write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
