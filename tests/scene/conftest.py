"""A real ``SceneView`` in a window under Xvfb, beside a robot made of memory."""

from __future__ import annotations

import os
import sys
import uuid
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

# Python draws: a render thread of its own would wait for the GIL that the GUI thread holds.
os.environ.setdefault("QSG_RENDER_LOOP", "basic")

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray
    from qt_waiting import QtWaiting
    from rosmaster import RosMaster
    from scene_mouse import Hand

HAVE_QT6 = find_spec("PySide6") is not None
SIZE = (400, 300)
UPRIGHT = (0, 0, 0, 1)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = str(Path(__file__).parent)
    for item in items:
        if str(item.path).startswith(here) and not HAVE_QT6:
            item.add_marker(pytest.mark.skip("the 3D view needs Qt 6 (PySide6)"))


@pytest.fixture(scope="session")
def app() -> Iterator[Any]:
    from rosglass.demo.processes import VirtualScreen

    with VirtualScreen() as screen:
        os.environ.update(DISPLAY=screen.display, QT_QPA_PLATFORM="xcb", QT_QUICK_BACKEND="rhi")
        from PySide6.QtGui import QGuiApplication

        import rosglass.scene

        app = QGuiApplication.instance() or QGuiApplication(["test"])
        rosglass.scene.register()
        yield app
        # The screen ends the process with it, if Qt still uses it.
        for window in app.allWindows():
            window.close()
        if "pytest" not in sys.modules:
            app.quit()


@pytest.fixture
def wait(app: Any) -> QtWaiting:
    """Runs the event loop until a condition holds."""
    from qt_waiting import QtWaiting

    return QtWaiting()


class SceneBench:
    """A window with a view, and a robot.

    Attributes:
        view: The ``SceneView``.
        robot: The robot's node.
        url: Where it is.
    """

    def __init__(self, wait: QtWaiting, folder: Path, url: str = "") -> None:
        from PySide6.QtQuick import QQuickView

        import rosglass
        from rosglass.qml import Session, install

        self.wait, self._folder, self._count = wait, folder, 0
        url = url or f"local://scene-{uuid.uuid4().hex}"
        self.url = url
        self.robot = rosglass.connect(url, "robot")
        self.session = Session(url)
        self.window = QQuickView()
        install(self.window.engine(), self.session)
        self.session.init("view")
        wait(lambda: self.session.node is not None)
        self.window.resize(*SIZE)
        self.window.setResizeMode(QQuickView.ResizeMode.SizeRootObjectToView)

    def load(self, body: str = "", imports: str = "") -> Any:
        """Show a view with what is declared in it, and return it."""
        from PySide6.QtCore import QUrl

        self._count += 1
        # The engine remembers what is in a folder.
        file = self._folder / str(self._count) / "View.qml"
        file.parent.mkdir()
        file.write_text(
            f"import QtQuick\nimport RosScene 1.0\n{imports}\n"
            f'SceneView {{ fixedFrame: "map"; focus: true; focusOnClick: true\n{body}\n}}'
        )
        self.window.setSource(QUrl.fromLocalFile(str(file)))
        assert not self.window.errors(), [error.toString() for error in self.window.errors()]
        self.view = self.window.rootObject()
        self.window.show()
        self.wait(self.window.isExposed)
        return self.view

    def show(self, body: str, imports: str = "") -> Any:
        """Show a view with one display, and return the display."""
        (display,) = self.load(body, imports).scene.displays
        return display

    def picture(self) -> NDArray[Any]:
        """Return what the window shows, (height, width, 3)."""
        import numpy as np
        from PySide6.QtGui import QImage

        from rosglass.qml.elements.image_sinks import grab

        # What has changed is drawn after a pause, in which the last frame would be grabbed.
        for view in (self.view, *self.view.findChildren(type(self.view))):
            view.update()
        image = grab(self.window).convertToFormat(QImage.Format.Format_RGB888)
        rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
        return rows[:, : image.width() * 3].reshape(image.height(), image.width(), 3).copy()

    def pixel(self, x: int = 200, y: int = 200) -> tuple[int, ...]:
        """Return the colour of a pixel of the window."""
        return tuple(int(part) for part in self.picture()[y, x])

    def drawn(self) -> int:
        """Return how many frames were drawn."""
        return self.view.pictures_drawn()

    @cached_property
    def moving(self) -> Any:
        """The robot's publisher of `move`."""
        from rosglass.tf import TransformBroadcaster

        return TransformBroadcaster(self.robot)

    def place(
        self, *children: str, at: Any = (0, 0, 0), turn: Any = UPRIGHT, parent: str = "map"
    ) -> None:
        """Publish static transforms."""
        from rosglass import Time
        from rosglass.tf import StaticTransformBroadcaster, Transform

        StaticTransformBroadcaster(self.robot).send_transform(
            [Transform(at, turn, Time(1), parent, child) for child in children]
        )

    def move(
        self, child: str, at: Any, stamp: Any, *, turn: Any = UPRIGHT, parent: str = "map"
    ) -> None:
        """Publish a transform of a time, in seconds or a `Time`."""
        from rosglass import Time
        from rosglass.tf import Transform

        stamp = Time.from_parts(stamp, 0) if isinstance(stamp, int) else stamp
        self.moving.send_transform(Transform(at, turn, stamp, parent, child))

    def publisher(self, topic: str, message_type: str, qos: Any = 10) -> Any:
        """Return a publisher of the robot, once the view subscribes."""
        publisher = self.robot.create_publisher(topic, message_type, qos)
        self.wait(publisher.subscription_count)
        return publisher

    def latch(self, topic: str, message_type: str, message: dict[str, Any]) -> Any:
        """Publish a message that later subscribers receive as well; return the publisher."""
        from rosglass.comm import QoS

        publisher = self.robot.create_publisher(topic, message_type, QoS.latched())
        publisher.publish(message)
        return publisher

    def send(self, publisher: Any, message: dict[str, Any], receiver: Any) -> Any:
        """Publish a message, and return its receiver once it has received and shown it."""
        before = receiver.received
        publisher.publish(message)
        self.wait(lambda: receiver.received > before)
        self.wait.settled(self.session)
        return receiver

    def close(self) -> None:
        from rosglass.qt import send_deferred_deletes

        self.window.close()
        self.window.deleteLater()
        send_deferred_deletes()
        self.session.close()
        self.robot.close()


@pytest.fixture
def make_bench(wait: QtWaiting, tmp_path: Path) -> Callable[[str], SceneBench]:
    """Makes a bench for the URL of a robot, which the caller closes."""
    return lambda url: SceneBench(wait, tmp_path, url)


@pytest.fixture
def bench(make_bench: Callable[[str], SceneBench]) -> Iterator[SceneBench]:
    made = make_bench("")
    yield made
    made.close()


@pytest.fixture
def ros_master(tmp_path: Path) -> Iterator[RosMaster]:
    from rosmaster import RosMaster

    with RosMaster(tmp_path / "ros") as master:
        yield master


@pytest.fixture
def ros1_bench(
    make_bench: Callable[[str], SceneBench], ros_master: RosMaster
) -> Iterator[SceneBench]:
    """A bench in ROS 1, closed before the master, which its nodes unregister from."""
    made = make_bench(ros_master.url)
    yield made
    made.close()


@pytest.fixture
def hand(bench: SceneBench) -> Hand:
    from scene_mouse import Hand

    return Hand(bench)


@pytest.fixture
def nav2(bench: SceneBench, tmp_path: Path) -> Iterator[Any]:
    """A node that knows Nav2's action."""
    import rosglass
    from rosglass.interfaces import Library

    file = tmp_path / "nav2_msgs" / "action" / "NavigateToPose.action"
    file.parent.mkdir(parents=True)
    file.write_text("geometry_msgs/PoseStamped pose\nstring behavior_tree\n---\n---\n")
    library = Library()
    library.add_path(tmp_path)
    node = rosglass.connect(bench.session.url, "nav2", library=library)
    yield node
    node.close()
