"""A QML engine on a robot made of memory, and real windows where pixels matter."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
# Python code that paints would deadlock with grabs under the threaded render loop.
os.environ.setdefault("QSG_RENDER_LOOP", "basic")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from memory_world import MemoryNode, MemoryWorld  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from PySide6.QtCore import QCoreApplication, QObject

    from rosglass.qml import Session


@pytest.fixture(scope="session")
def app() -> QCoreApplication:
    from PySide6.QtGui import QGuiApplication

    return QGuiApplication.instance() or QGuiApplication(["test"])


@pytest.fixture
def wait(app: QCoreApplication) -> Callable[..., None]:
    """Run the event loop until a condition holds; without one, for some milliseconds."""
    from PySide6.QtCore import QEvent, QEventLoop

    def turn() -> None:
        app.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 10)
        # Deferred deletions otherwise wait for exec().
        app.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        time.sleep(0.001)

    def wait_until(condition: Callable[[], Any] | int, timeout: float = 5.0) -> None:
        if isinstance(condition, int):
            timeout, until = condition / 1000, time.monotonic() + condition / 1000
            while time.monotonic() < until:
                turn()
            return
        until = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < until, "did not happen in time"
            turn()

    return wait_until


class Bench:
    """A QML engine with our modules, and a robot on the other side of memory."""

    def __init__(self, session: Session, engine: Any, world: MemoryWorld, folder: Path) -> None:
        self.session, self.engine, self.world, self.folder = session, engine, world, folder
        self.robot: MemoryNode = world.connect(None, "robot")
        self._roots: list[Any] = []
        self._count = 0

    def load(self, body: str, imports: str = "") -> QObject:
        """Create a QML file's root object out of an object declaration."""
        from PySide6.QtCore import QUrl
        from PySide6.QtQml import QQmlComponent

        self._count += 1
        # The engine remembers what is in a folder.
        folder = self.folder / str(self._count)
        folder.mkdir(parents=True)
        file = folder / f"Test{self._count}.qml"
        file.write_text(f"import QtQml\nimport Ros2 1.0\n{imports}\n{body}")
        component = QQmlComponent(self.engine, QUrl.fromLocalFile(str(file)))
        root = component.create()
        assert root is not None, component.errorString()
        self._roots += [root, component]
        return root

    def run(self, script: str, imports: str = "") -> Any:
        """Run JavaScript in a file of its own and return its result as JSON does it."""
        import json

        root = self.load(
            "QtObject { function go() { return JSON.stringify((function() { %s })()) } }" % script,
            imports,
        )
        from PySide6.QtCore import Q_RETURN_ARG, QMetaObject

        text = QMetaObject.invokeMethod(root, "go", Q_RETURN_ARG("QVariant"))
        return None if text is None else json.loads(text)

    def close(self) -> None:
        import shiboken6

        for item in self._roots:
            if shiboken6.isValid(item):
                item.deleteLater()
        self.session.close()


@pytest.fixture
def bench(app: QCoreApplication, tmp_path: Path, wait: Callable[..., None]) -> Iterator[Bench]:
    from PySide6.QtCore import QCoreApplication as App
    from PySide6.QtCore import QEvent
    from PySide6.QtQml import QQmlEngine

    from rosglass.qml import Session, install

    world = MemoryWorld()
    session = Session(connect=world.connect)
    engine = QQmlEngine()
    install(engine, session)
    made = Bench(session, engine, world, tmp_path)
    yield made
    made.close()
    App.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    engine.deleteLater()
    App.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def running(bench: Bench, wait: Callable[..., None]) -> Bench:
    """A bench whose session is connected."""
    bench.session.init("ui")
    wait(lambda: bench.session.node is not None)
    return bench
