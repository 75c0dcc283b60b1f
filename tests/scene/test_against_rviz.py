"""The 3D view against real RViz: the same config and the same messages give the same image."""

from __future__ import annotations

import json
import math
import os
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from pictures import drawn, patches, unmatched
from rosmaster import RosMaster
from rospy_markers import INSTALLED, RospyServer
from rviz_cases import (
    CASES,
    INTERACTIVE_MARKERS,
    LINKS,
    ROBOTS,
    VIEWS,
    Case,
    controlled,
    marker,
    pose,
)
from rviz_cases import display as display_config
from scene_mouse import Hand

from rosglass.comm.qos import QoS
from rosglass.demo.processes import VirtualScreen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray
    from qt_waiting import QtWaiting

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-system" / "bin" / "python"
PLUGINS = Path("/usr/share/rviz/plugin_description.xml")
SIZE = (640, 480)
#: Seconds for messages to arrive in both, and for both to draw them.
TIMEOUT_S = 15.0


class Pair:
    """An RViz in a process of its own, a view of ours, and a robot."""

    def __init__(self, wait: QtWaiting, folder: Path, master: RosMaster) -> None:
        from PySide6.QtQuick import QQuickItem, QQuickView

        import rosglass
        from rosglass.qml import Session, install

        self.wait, self.folder, self._config = wait, folder, folder / "judge.rviz"
        self.master = master
        self.robot = rosglass.connect(master.url, "robot")
        self.session = Session(master.url)
        self.window = QQuickView()
        install(self.window.engine(), self.session)
        self.session.init("view")
        wait(lambda: self.session.node is not None)
        file = folder / "View.qml"
        file.write_text(
            "import QtQuick\nimport RosScene 1.0\n"
            "Item { property alias display: panel.display\n"
            'SceneView { objectName: "view"; anchors.fill: parent }\n'
            "ImagePanel { id: panel; anchors.fill: parent } }"
        )
        self.window.setResizeMode(QQuickView.ResizeMode.SizeRootObjectToView)
        self.window.resize(*SIZE)
        self.window.setSource(file.as_uri())
        self.view = self.window.rootObject().findChild(QQuickItem, "view")
        self.window.show()
        self._screen = VirtualScreen(SIZE[0] + 200, SIZE[1] + 200)
        self._log = (folder / "rviz.log").open("w")
        environment = {
            **master.env(),
            "DISPLAY": self._screen.display,
            "QT_QPA_PLATFORM": "xcb",
            "ROSGLASS_QT": "pyside2",
            "XDG_RUNTIME_DIR": str(folder),
        }
        self._rviz = subprocess.Popen(
            [PYTHON, Path(__file__).with_name("rviz_pictures.py"), *map(str, SIZE)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
        )
        self._answer("READY")
        self._publish_frames()

    def _answer(self, expected: str) -> None:
        assert self._rviz.stdout is not None
        for line in self._rviz.stdout:
            if line.strip() == expected:
                return
        raise AssertionError((self.folder / "rviz.log").read_text()[-3000:])

    def _publish_frames(self) -> None:
        from rosglass.tf import StaticTransformBroadcaster, Transform

        self._frames = StaticTransformBroadcaster(self.robot)
        stamp = self.robot.now()
        turn = (0.0, 0.0, math.sin(0.3), math.cos(0.3))
        self._frames.send_transform(
            [
                Transform((-1.0, 0.5, 0.3), turn, stamp, "map", "base"),
                Transform((1.5, 0.5, 0.4), turn, stamp, "base", "arm"),
                Transform((-4.0, 0.0, 1.5), (-0.5, 0.5, -0.5, 0.5), stamp, "map", "camera"),
                *(
                    Transform((0.0, y, 0.0), (0.0, 0.0, 0.0, 1.0), stamp, "map", f"{prefix}{link}")
                    for prefix, y in ROBOTS.items()
                    for link in LINKS
                ),
            ]
        )

    def show(self, case: Case, view: dict[str, Any], tool: str = "MoveCamera") -> None:
        """Have both open a config, with one tool."""
        config = {
            "Visualization Manager": {
                "Class": "",
                "Displays": case.displays,
                "Enabled": True,
                "Global Options": {
                    "Background Color": "48; 48; 48",
                    "Fixed Frame": "map",
                    "Frame Rate": 30,
                },
                "Name": "root",
                "Tools": [{"Class": f"rviz/{tool}"}],
                "Value": True,
                "Views": {"Current": view, "Saved": None},
            }
        }
        self._config.write_text(yaml.safe_dump(config))
        notes = self.view.load_config(self._config)
        assert not notes
        shown = [one for one in self.view.scene.displays if one.name == case.panel]
        assert bool(shown) == bool(case.panel)
        self.window.rootObject().setProperty("display", shown[0] if shown else None)
        self._panel = shown[0] if shown else None
        self._order(config=str(self._config), panel=case.panel)

    def repeat(self, publish: Callable[[], None]) -> None:
        """Publish again; wait for our image of the panel, which fades otherwise."""
        before = 0 if self._panel is None else self._panel.received
        publish()
        self.wait(lambda: self._panel is None or self._panel.received > before)

    def _order(self, **order: str) -> None:
        assert self._rviz.stdin is not None
        self._rviz.stdin.write(json.dumps(order) + "\n")
        self._rviz.stdin.flush()
        self._answer("DONE")

    def theirs(self) -> NDArray[np.uint8]:
        """Return RViz's frame."""
        from PySide6.QtGui import QImage

        file = self.folder / "rviz.png"
        self._order(into=str(file))
        return _pixels(QImage(str(file)))

    def ours(self) -> NDArray[np.uint8]:
        """Return our frame."""
        from PySide6.QtCore import QCoreApplication

        from rosglass.qml.elements.image_sinks import grab

        QCoreApplication.processEvents()
        return _pixels(grab(self.window))

    def close(self) -> None:
        from rosglass.qt import send_deferred_deletes

        self._rviz.kill()
        self._rviz.wait()
        self._log.close()
        self._screen.close()
        self.window.close()
        self.window.deleteLater()
        send_deferred_deletes()
        self.session.close()
        self.robot.close()


def _pixels(image: Any) -> NDArray[np.uint8]:
    from PySide6.QtGui import QImage

    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : image.width() * 3].reshape(image.height(), image.width(), 3).copy()


@pytest.fixture(scope="module")
def pair(app: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pair]:
    from qt_waiting import QtWaiting

    if not PYTHON.exists() or not Path("/usr/lib/python3/dist-packages/rviz").exists():
        pytest.skip("RViz is not installed, or .venv-system not made: scripts/setup.sh test")
    folder = tmp_path_factory.mktemp("judge")
    with RosMaster(folder) as master:
        made = Pair(QtWaiting(), folder, master)
        yield made
        made.close()


def difference(
    ours: NDArray[np.uint8], theirs: NDArray[np.uint8], *, has_texts: bool = False
) -> dict[str, Any]:
    """Return the differences of two images; empty if there are none."""
    found: dict[str, Any] = {}
    # RViz draws its last row and column again and again.
    ours, theirs = ours[4:-4, 4:-4], theirs[4:-4, 4:-4]
    # Texts have another font.
    for name, one, other in (("ours", ours, theirs), ("theirs", theirs, ours)):
        count = int(drawn(one).sum())
        left = int(unmatched(one, other).sum())
        if not count or left / count > (1 if has_texts else 0.01):
            found[f"only {name}"] = f"{left} of {count} pixels"
    mine, its = patches(ours), patches(theirs)
    for hue in sorted(mine.keys() | its.keys()):
        one, two = mine.get(hue), its.get(hue)
        if one is None or two is None:
            found[hue] = f"ours {one}, theirs {two}"
            continue
        wide = max(4, 0.12 * (two.right - two.left)) if has_texts else 4
        if (
            max(abs(one.left - two.left), abs(one.right - two.right)) > wide
            or max(abs(one.top - two.top), abs(one.bottom - two.bottom)) > 4
        ):
            found[hue] = f"\n  ours   {one}\n  theirs {two}"
    return found


def test_every_class_of_rviz_is_compared() -> None:
    if not PLUGINS.exists():
        pytest.skip(f"RViz is not installed: there is no {PLUGINS}")
    found = {one.get("name", ""): one for one in ElementTree.parse(PLUGINS).iter("class")}
    drawn = {name for name, one in found.items() if one.get("base_class_type") != "rviz::Tool"}
    compared = {VIEWS[view]["Class"] for case in CASES.values() for view in case.views}
    for one in (one for case in CASES.values() for one in case.displays):
        compared.add(one["Class"])
        for key in ("Color Transformer", "Position Transformer"):
            if key in one:
                compared.add(f"rviz/{one[key]}")
    # Tools draw only while the user uses them: test_tools.py.
    assert compared == drawn


@pytest.mark.parametrize("name", CASES)
def test_frames_are_those_of_rviz(pair: Pair, name: str) -> None:
    case = CASES[name]
    for parameter, value in case.parameters.items():
        pair.robot.parameter_server.set(parameter, value)
    publishers = {
        topic: pair.robot.create_publisher(topic, kind, QoS.latched())
        for topic, kind in {one.topic: one.type for one in case.messages}.items()
    }

    def publish() -> None:
        for one in case.messages:
            publishers[one.topic].publish(one.fields)

    publish()
    try:
        failures = {}
        for view in case.views:
            pair.show(case, VIEWS[view])
            # All interactive markers are received once.
            lasting = [p for topic, p in publishers.items() if not topic.endswith("/update_full")]
            pair.wait(lambda lasting=lasting: all(p.subscription_count() == 2 for p in lasting))
            until = time.monotonic() + TIMEOUT_S
            while True:
                if case.repeats:
                    pair.repeat(publish)
                ours, theirs = pair.ours(), pair.theirs()
                found = difference(ours, theirs, has_texts=case.has_texts)
                if not found or time.monotonic() > until:
                    break
            keep(f"{name} {view}", ours, theirs)
            if found:
                failures[view] = found
        assert not failures, "\n".join(
            f"{view}: {what}: {text}"
            for view, found in failures.items()
            for what, text in found.items()
        )
    finally:
        for publisher in publishers.values():
            publisher.close()


def test_markers_of_a_real_server_are_those_of_rviz_and_can_be_used(pair: Pair) -> None:
    if not INSTALLED:
        pytest.skip("not installed: sudo apt-get install python3-interactive-markers")
    server = RospyServer(pair.master)
    try:
        use_markers(pair, server)
    finally:
        server.kill()


def use_markers(pair: Pair, server: RospyServer) -> None:
    box = marker(0, 1, "red", pose(0, 0), (0.6, 0.4, 0.3), header={})
    server.send("erase arm")
    server.insert(
        *INTERACTIVE_MARKERS[0].fields["markers"],
        controlled("choice", pose(0, 2.2), {"interaction_mode": 1, "markers": [box]}),
    )
    server.send("menu choice Go Stop")
    server.send("settle")
    shown = display_config(
        "InteractiveMarkers", Update_Topic="/arm_markers/update", Show_Descriptions=False,
        Enable_Transparency=False,
    )  # fmt: skip
    pair.show(Case([shown]), VIEWS["TopDownOrtho"], "Interact")
    (display,) = pair.view.scene.displays
    pair.wait(lambda: len(display.markers) == 7, lambda: display.statusText)
    assert pair.view.tool == "Interact"
    hand = Hand(pair)  # type: ignore[arg-type] - it uses the window and the view

    def compared(name: str) -> NDArray[np.uint8]:
        until = time.monotonic() + TIMEOUT_S
        while True:
            ours, theirs = pair.ours(), pair.theirs()
            found = difference(ours, theirs)
            if not found or time.monotonic() > until:
                break
        keep(f"real server {name}", ours, theirs)
        assert not found, found
        return theirs

    before = compared("before")
    pair.wait(lambda: "settled\n" in server.lines)
    # Along its arrow, by a metre: the server moves it in both.
    way = np.array([math.cos(0.4), math.sin(0.4), 0.0])
    grip = np.array([-2.5, -1.5, 0.0]) + 0.9 * way
    hand.press(hand.at(grip))
    hand.move(hand.at(grip + way))
    pair.wait(lambda: server.feedback("arrows", 1), lambda: (server.lines, display.statusText))
    hand.release(hand.at(grip + way))
    pair.wait(lambda: server.feedback("arrows", 5))
    x, y, _ = map(float, server.feedback("arrows", 5)[-1])
    assert (x, y) == pytest.approx((-2.5 + way[0], -1.5 + way[1]), abs=0.06)
    hand.move((2, 2))
    after = compared("after")
    assert unmatched(before, after).sum() > 100
    # The middle of the yellow arrow, and of the box with the menu.
    hand.click(hand.at((0.3 + 0.35 * math.cos(0.5), 1 + 0.35 * math.sin(0.5), 0)))
    pair.wait(lambda: server.feedback("facing", 3), lambda: server.lines)
    asked: list[Any] = []
    display.menuRequested.connect(lambda *menu: asked.append(menu))
    hand.click(hand.at((0, 2.2, 0)))
    pair.wait(lambda: asked)
    display.selectMenuEntry(2)
    pair.wait(lambda: server.feedback("choice", 2), lambda: server.lines)
    assert [entry for *_, entry in server.feedback("choice", 2)] == ["2"]
    assert display.statusLevel == "ok", display.statusText


def test_arrays_and_delete_all_are_those_of_rviz(pair: Pair) -> None:
    # Beside the topic of a display of single markers.
    publisher = pair.robot.create_publisher("/gone_array", "visualization_msgs/MarkerArray", 10)

    def cube(namespace: str, y: float, *rgb: float, action: int = 0) -> dict[str, Any]:
        return {
            "header": {"frame_id": "map"},
            "ns": namespace,
            "type": 1,
            "action": action,
            "pose": {"position": {"y": y}, "orientation": {"w": 1.0}},
            "scale": dict.fromkeys("xyz", 1.0),
            "color": dict(zip("rgba", (*rgb, 1.0), strict=True)),
        }

    def send(*markers: dict[str, Any], until: str) -> tuple[set[str], set[str]]:
        end = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end:
            publisher.publish({"markers": list(markers)})
            ours, theirs = set(patches(pair.ours())), set(patches(pair.theirs()))
            if until in ours & theirs:
                break
        return ours, theirs

    try:
        pair.show(Case([display_config("Marker", "/gone")]), VIEWS["TopDownOrtho"])
        two = cube("a", 1.5, 1.0, 0.0, 0.0), cube("b", -1.5, 0.0, 1.0, 0.0)
        assert send(*two, until="green") == ({"red", "green"}, {"red", "green"})
        blue = cube("c", 0.0, 0.0, 0.0, 1.0)
        ours, theirs = send(cube("a", 0.0, 0.0, 0.0, 0.0, action=3), blue, until="blue")
        assert ours == theirs == {"blue"}
    finally:
        publisher.close()


def keep(name: str, ours: NDArray[np.uint8], theirs: NDArray[np.uint8]) -> None:
    """Save both images side by side, where JUDGE_PICTURES names a folder."""
    folder = os.environ.get("JUDGE_PICTURES")
    if folder:
        from PySide6.QtGui import QImage

        both = np.ascontiguousarray(np.concatenate([ours, theirs], axis=1))
        image = QImage(
            both.data, both.shape[1], both.shape[0], both.strides[0], QImage.Format.Format_RGB888
        )
        image.save(str(Path(folder, f"{name}.png")))
