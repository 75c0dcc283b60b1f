"""Shows each example of a control in every mode and size, and writes what is seen.

Run by test_themes.py with a folder for the images and the examples' files; the environment selects
the renderer.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2] / "helpers")]

from local_world import LocalWorld  # noqa: E402
from qt_waiting import QtWaiting  # noqa: E402

from rosglass.controls import register  # noqa: E402
from rosglass.qml import Session, install  # noqa: E402
from rosglass.qml.engine.log import install_message_handler  # noqa: E402
from rosglass.qt import QtCore, QtGui, QtQml, send_deferred_deletes  # noqa: E402

THEME = b"import QtQml 2.15\nimport RosControls 1.0\nQtObject { property var theme: Theme }"
#: Mode and scale of each image.
LOOKS = (("dark", 1), ("bright", 2), ("contrast", 1))
#: Ticks, of a tenth of a second, until controls show why they have no data.
TICKS = 4


def main(folder: Path, files: list[Path]) -> None:
    app = QtGui.QGuiApplication(["themes"])  # noqa: F841 - kept
    install_message_handler()
    register()
    seen: dict[str, Any] = {}
    for file in files:
        seen |= show(file, folder)
    (folder / "texts.json").write_text(json.dumps(seen))


def show(file: Path, folder: Path) -> dict[str, Any]:
    """Write a file's images and return their texts: on a robot of its own, which says nothing."""
    engine = QtQml.QQmlEngine()
    session = Session(connect=LocalWorld().connect)
    install(engine, session)
    themes = QtQml.QQmlComponent(engine)
    themes.setData(THEME, QtCore.QUrl())
    holder = themes.create()
    assert holder is not None, themes.errorString()
    theme = holder.property("theme")
    component = QtQml.QQmlComponent(engine, QtCore.QUrl.fromLocalFile(str(file)))
    window: Any = component.create()
    assert window is not None, component.errorString()
    # Two programs share the pointer: what is below it would differ.
    window.setFlag(QtCore.Qt.WindowType.WindowTransparentForInput, True)
    wait = QtWaiting()
    wait(lambda: window.isExposed() and session.node is not None)
    wait.settled(session)
    session.use_ticks(True)
    wait.signals(session.tick, TICKS)
    plain, seen = window.size(), {}
    for mode, scale in LOOKS:
        theme.setProperty("scale", scale)
        theme.setProperty("mode", mode)
        window.resize(plain * scale)
        wait.settled(session)
        image = settled(wait, window)
        name = f"{file.stem}-{mode}-{scale}"
        assert image.save(str(folder / f"{name}.png"), "PNG", 90)
        seen[name] = texts(window)
    window.deleteLater()
    session.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()
    return seen


def settled(wait: QtWaiting, window: Any) -> Any:
    """Return the window's image, once nothing changes any more."""
    images = [window.grabWindow()]

    def is_settled() -> bool:
        images.append(window.grabWindow())
        is_laid_out = window.contentItem().width() == window.width() == images[-1].width()
        return is_laid_out and bool(images[-1] == images[-2])

    wait(is_settled, "an image that stays as it is")
    return images[-1]


def texts(window: Any) -> list[dict[str, Any]]:
    """Return the visible texts: their places, bounds and colours."""
    found = []
    whole = QtCore.QRectF(0, 0, window.width(), window.height())
    waiting = [(window.contentItem(), whole, False, False)]
    while waiting:
        item, bounds, dimmed, scrolled = waiting.pop()
        if not item.isVisible() or item.opacity() == 0:
            continue
        # What is old, or cannot be used, is dimmed.
        dimmed = dimmed or not item.isEnabled() or item.opacity() < 1
        place = item.mapRectToScene(QtCore.QRectF(0, 0, item.width(), item.height()))
        if item.inherits("QQuickText") and item.property("text"):
            found.append(
                {
                    "text": item.property("text"),
                    "place": rectangle(place),
                    "bounds": rectangle(bounds),
                    "dimmed": dimmed,
                    "scrolled": scrolled,
                    "color": item.property("color").name(),
                }
            )
        if item.clip():
            bounds = bounds.intersected(place)
        scrolled = scrolled or item.inherits("QQuickFlickable")
        waiting += [(child, bounds, dimmed, scrolled) for child in item.childItems()]
    return found


def rectangle(place: Any) -> list[float]:
    return [place.left(), place.top(), place.right(), place.bottom()]


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
