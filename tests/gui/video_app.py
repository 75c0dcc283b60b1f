"""Run by test_video_output.py on a virtual screen: shows images and prints what pixels became.

Arguments: a QML file with an object called "camera", and names of encodings. Prints a JSON object
per encoding: the colours in the middle of the image's four quarters, each encoding's turned on by
one from those of the encoding before; and the implicit size of the VideoOutput, with an image and
after the signal was lost.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

os.environ["QSG_RENDER_LOOP"] = "basic"
os.environ["QT_LOGGING_RULES"] = "qt.multimedia.*=false"

import cv2
import numpy as np
from local_world import LocalWorld

from rosglass.comm import Time
from rosglass.qml import Session, install
from rosglass.qt import QtCore, QtGui, QtQml, QtQuick

if TYPE_CHECKING:
    from collections.abc import Callable

QUARTERS = [(220, 30, 30), (30, 200, 40), (40, 50, 230), (230, 220, 60)]


def scene(turn: int) -> np.ndarray:
    picture = np.empty((48, 64, 3), np.uint8)
    for index, colour in enumerate(QUARTERS[turn:] + QUARTERS[:turn]):
        row, column = divmod(index, 2)
        picture[24 * row : 24 * row + 24, 32 * column : 32 * column + 32] = colour
    return picture


def message(encoding: str, turn: int) -> dict[str, Any]:
    rgb = scene(turn)
    grey = rgb[..., 0].copy()
    yuv = cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_I420).reshape(-1)
    luma, chroma = yuv[: 48 * 64].reshape(48, 64), yuv[48 * 64 :].reshape(2, 24, 32)
    packed = np.repeat(chroma, 2, axis=1)
    uyvy = np.empty((48, 32, 4), np.uint8)
    uyvy[..., 0], uyvy[..., 2] = packed[0], packed[1]
    uyvy[..., 1], uyvy[..., 3] = luma[:, ::2], luma[:, 1::2]
    pixels = {
        "rgb8": rgb,
        "bgr8": rgb[..., ::-1],
        "rgba8": np.dstack([rgb, np.full((48, 64), 255, np.uint8)]),
        "bgra8": np.dstack([rgb[..., ::-1], np.full((48, 64), 255, np.uint8)]),
        "mono8": grey,
        "mono16": grey.astype(np.uint16) * 257,
        "yuv422": uyvy,
        "yuv422_yuy2": uyvy[..., [1, 0, 3, 2]],
        "nv12": np.vstack([luma, np.dstack([chroma[0], chroma[1]]).reshape(24, 64)]),
        "nv21": np.vstack([luma, np.dstack([chroma[1], chroma[0]]).reshape(24, 64)]),
    }[encoding]
    data = np.ascontiguousarray(pixels)
    return {
        "header": {"stamp": Time.now().to_dict()},
        "width": 64,
        "height": 48,
        "encoding": encoding,
        "step": data.nbytes // data.shape[0],
        "data": data.reshape(-1).view(np.uint8),
    }


def main() -> None:
    file, encodings = Path(sys.argv[1]), sys.argv[2:]
    app = QtGui.QGuiApplication([])
    world = LocalWorld()
    camera = world.connect(None, "robot").create_publisher("/cam", "sensor_msgs/msg/Image")
    session = Session(connect=world.connect)
    # PySide2 forgets an engine that a view has made itself.
    engine = QtQml.QQmlEngine()
    view = QtQuick.QQuickView(engine, None)
    view.setResizeMode(QtQuick.QQuickView.ResizeMode.SizeRootObjectToView)
    install(engine, session)
    view.setSource(QtCore.QUrl.fromLocalFile(str(file)))
    assert view.status() is QtQuick.QQuickView.Status.Ready, [e.toString() for e in view.errors()]
    view.resize(320, 240)
    view.show()
    sub = view.rootObject().findChild(QtCore.QObject, "camera")

    def until(condition: Callable[[], bool]) -> None:
        end = time.monotonic() + 30
        while not condition():
            assert time.monotonic() < end, (sub.property("encoding"), sub.property("problem"))
            app.processEvents()
            time.sleep(0.005)

    def colours() -> list[tuple[int, ...]]:
        shot = view.grabWindow()
        places = [(80, 60), (240, 60), (80, 180), (240, 180)]
        return [shot.pixelColor(x, y).getRgb()[:3] for x, y in places]

    def others_than(last: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Wait until all four colours are others, and return them."""
        seen = last

        def differ() -> bool:
            nonlocal seen
            seen = colours()
            return not any(np.allclose(*pair, atol=8) for pair in zip(seen, last, strict=True))

        until(differ)
        return seen

    def print_size(when: str) -> None:
        for item in view.rootObject().childItems():
            if item.inherits("QQuickVideoOutput") or item.inherits("QDeclarativeVideoOutput"):
                size = [round(item.implicitWidth()), round(item.implicitHeight())]
                print(json.dumps({"encoding": when, "seen": size}), flush=True)

    until(lambda: sub.property("subscribed"))
    sub.setProperty("timeout", 60_000)  # none is blank before it is compared
    seen = colours()
    for turn, encoding in enumerate(encodings):
        camera.publish(message(encoding, turn % 4))
        until(lambda encoding=encoding: sub.property("encoding") == encoding)
        seen = others_than(seen)
        print(json.dumps({"encoding": encoding, "seen": seen}), flush=True)
    print_size("size with a picture")
    sub.setProperty("timeout", 100)
    until(lambda: sub.property("stale"))
    print(json.dumps({"encoding": "timeout", "seen": others_than(seen)}), flush=True)
    print_size("size without")
    view.close()
    session.close()


main()
