"""A QML engine on a robot made of memory, and real windows where pixels matter."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port

sys.path.insert(0, str(Path(__file__).parent))
# Python code that paints would deadlock with grabs under the threaded render loop.
os.environ.setdefault("QSG_RENDER_LOOP", "basic")
# Debian's Python has Qt 5; programs that tests start inherit the choice.
if find_spec("PySide6") is None:
    os.environ.setdefault("ROSGLASS_QT", "pyside2")

from local_world import LocalWorld
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from counting import Counter
    from PySide6.QtCore import QCoreApplication, QObject
    from qt_waiting import QtWaiting

    from rosglass.comm import Node
    from rosglass.qml import Session

QT5 = os.environ.get("ROSGLASS_QT") == "pyside2"
#: Files that take longest, each in one process: begun last, they would keep all others waiting.
LONG = {"test_examples.py", "test_run.py", "test_run_ending.py", "test_video_output.py"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.name not in LONG)


@pytest.fixture(scope="session")
def platform(request: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment in which Qt draws without anybody's screen."""
    if not QT5:
        return {"QT_QPA_PLATFORM": "offscreen"}
    if "XDG_RUNTIME_DIR" not in os.environ:
        # Qt 5 warns if it is missing, as on machines without a login session.
        os.environ["XDG_RUNTIME_DIR"] = str(tmp_path_factory.mktemp("runtime"))
    # Offscreen, Qt 5 needs OpenGL of a display as well, and draws nothing without it.
    display = request.getfixturevalue("screen")
    return {"QT_QPA_PLATFORM": "xcb", "DISPLAY": display, "QT_QUICK_BACKEND": "software"}


@pytest.fixture(scope="session")
def app(platform: dict[str, str]) -> QCoreApplication:
    from rosglass.qt import QtGui

    os.environ.update(platform)
    return QtGui.QGuiApplication.instance() or QtGui.QGuiApplication(["test"])


@pytest.fixture
def wait(app: QCoreApplication) -> QtWaiting:
    """Runs the event loop until a condition holds, a signal has come, or nothing is left to do."""
    from qt_waiting import QtWaiting

    return QtWaiting()


class Bench:
    """A QML engine with our modules, and a robot on the other side of memory.

    Attributes:
        module: What :meth:`load` and :meth:`run` import besides QtQml.
        robot: The robot's node.
    """

    def __init__(self, session: Session, engine: Any, world: Any, folder: Path) -> None:
        self.session, self.engine, self.world, self.folder = session, engine, world, folder
        self.module = "Ros2 1.0"
        self.robot: Any = world.connect(None, "robot")
        self.roots: list[Any] = []
        self._count = 0

    def load(self, body: str, imports: str = "") -> QObject:
        """Create a QML file's root object out of an object declaration.

        Its functions can be called as methods: ``root.send(value)``.
        """
        from rosglass.qt import QtCore, QtQml

        self._count += 1
        # The engine remembers what is in a folder.
        folder = self.folder / str(self._count)
        folder.mkdir(parents=True)
        file = folder / f"Test{self._count}.qml"
        file.write_text(f"import QtQml 2.15\nimport {self.module}\n{imports}\n{body}")
        component = QtQml.QQmlComponent(self.engine, QtCore.QUrl.fromLocalFile(str(file)))
        root = component.create()
        assert root is not None, component.errorString()
        self.roots += [root, component]
        return root

    def run(self, script: str, imports: str = "") -> Any:
        """Run JavaScript in a file of its own and return its result as JSON does it."""
        import json

        body = "QtObject { function go() { return JSON.stringify((function() { SCRIPT })()) } }"
        root: Any = self.load(body.replace("SCRIPT", script), imports)
        text = root.go()
        return None if text is None else json.loads(text)

    def close(self) -> None:
        from rosglass.qt import is_alive

        for item in self.roots:
            if is_alive(item):
                item.deleteLater()
        self.session.close()


@pytest.fixture
def bench(app: QCoreApplication, tmp_path: Path, wait: Callable[..., None]) -> Iterator[Bench]:
    from rosglass.qml import Session, install
    from rosglass.qt import QtQml, send_deferred_deletes

    world = LocalWorld()
    session = Session(connect=world.connect)
    engine = QtQml.QQmlEngine()
    install(engine, session)
    made = Bench(session, engine, world, tmp_path)
    yield made
    made.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()


@pytest.fixture
def running(bench: Bench, wait: Callable[..., None]) -> Bench:
    """A bench whose session is connected."""
    bench.session.init("ui")
    wait(lambda: bench.session.node is not None)
    return bench


@pytest.fixture
def messages(app: QCoreApplication) -> Iterator[None]:
    """Have Qt's own messages logged, as the runner does."""
    from rosglass.qml.engine.log import install_message_handler
    from rosglass.qt import QtCore

    install_message_handler()
    yield
    QtCore.qInstallMessageHandler(None)


class RealWorld:
    """Nodes on a real middleware."""

    def __init__(self, url: str) -> None:
        self.url = url

    def connect(self, url: str | None, name: str, namespace: str = "/") -> Node:
        import rosglass

        return rosglass.connect(url or self.url, name, namespace)


# ROS 1 alone shows the differences between Qt versions.
@pytest.fixture(scope="module", params=["ros1"] if QT5 else ["zenoh", "ros1"])
def url(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """URL that robot and operator share: of a Zenoh router, a DDS domain, or a ROS 1 master."""
    if request.param == "dds":
        pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
        yield f"dds://?domain={request.getfixturevalue('ros_domains')[0]}"
        return
    if request.param == "zenoh":
        from rosglass.wires.zenoh.router import Router

        with Router(f"tcp/127.0.0.1:{free_port()}") as router:
            yield router.url
        return
    if not Path("/usr/bin/rosmaster").exists():
        pytest.skip("ROS 1 is not installed: sudo apt-get install python3-rosmaster")
    port = free_port()
    home = tmp_path_factory.mktemp("master")
    env = {"PATH": "/usr/bin:/bin", "HOME": str(home), "ROS_HOME": str(home)}
    command = ["/usr/bin/rosmaster", "--core", "-p", str(port)]
    with (home / "output").open("wb") as output:
        master = subprocess.Popen(command, env=env, stdout=output, stderr=output)
        yield f"ros1://127.0.0.1:{port}?ip=127.0.0.1"
        master.kill()
        master.wait()


@pytest.fixture
def live(app: QCoreApplication, url: str, tmp_path: Path, wait: Any) -> Iterator[Bench]:
    """A bench whose session and robot are connected over a real middleware."""
    from rosglass.qml import Session, install
    from rosglass.qt import QtQml, send_deferred_deletes

    session = Session(url)
    engine = QtQml.QQmlEngine()
    install(engine, session)
    made = Bench(session, engine, RealWorld(url), tmp_path)
    session.init("ui")
    wait(lambda: session.state == "connected")
    yield made
    made.close()
    made.robot.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()


@pytest.fixture
def counter(live: Bench, url: str) -> Iterator[Counter]:
    """The server of an action that counts; offered by the test, on the robot."""
    from counting import Counter

    made = Counter(live.robot, url)
    yield made
    made.go.set()
    made.stop.set()
    if made.server is not None:
        made.server.close()


@pytest.fixture(scope="session")
def screen() -> Iterator[str]:
    """A virtual screen of our own; gives the value of DISPLAY."""
    reader, writer = os.pipe()
    command = ["Xvfb", "-displayfd", str(writer), "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    server = subprocess.Popen(
        command, pass_fds=[writer], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(writer)
    with os.fdopen(reader) as numbers:
        number = numbers.readline().strip()
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait(10)


class Program:
    """A program with a user interface in its own process."""

    def __init__(self, command: list[str], environment: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            command,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
        )
        self.pid = self._process.pid
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip("\n"))

    @property
    def text(self) -> str:
        """Everything it has written."""
        return "\n".join(self.lines)

    def until(self, text: str, timeout: float = 30.0) -> str:
        """Wait until a line with `text` is written and return it; later calls want later lines."""

        def line() -> str:
            is_over = self._process.poll() is not None and not self._reader.is_alive()
            for at, line in enumerate(self.lines):
                if text in line:
                    del self.lines[: at + 1]
                    return line
            assert not is_over, self.text
            return ""

        return str(eventually(line, lambda: f"no {text!r} in:\n{self.text}", timeout=timeout))

    def end(self, timeout: float = 30.0) -> int:
        """Wait for its end and return the exit code."""
        code = self._process.wait(timeout)
        self._reader.join(5)
        return code

    def kill(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def close(self) -> None:
        """End it in any case."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait(10)


@pytest.fixture
def start(platform: dict[str, str]) -> Iterator[Callable[..., Program]]:
    """Start ``rosglass`` with arguments; `display` is an unused one if empty, and unset if None."""
    programs = []

    def start(*arguments: Any, display: str | None = "", **extra: str) -> Program:
        gone = {"DISPLAY", "WAYLAND_DISPLAY", "QSG_RENDER_LOOP", "ROSGLASS_URL"}
        gone |= {"QT_QPA_PLATFORM", "QT_QUICK_BACKEND"}
        environment = {k: v for k, v in os.environ.items() if k not in gone} | extra
        if display == "":
            environment = platform | environment
        elif display is not None:
            environment["DISPLAY"] = display
        command = [sys.executable, "-m", "rosglass.cli", *map(str, arguments)]
        programs.append(Program(command, environment))
        return programs[-1]

    yield start
    for program in programs:
        program.close()


@pytest.fixture
def python(platform: dict[str, str], tmp_path: Path) -> Iterator[Callable[[str], Program]]:
    """Start a Python program of its own, given its text."""
    programs = []

    def run(text: str) -> Program:
        file = tmp_path / "program.py"
        file.write_text(text)
        gone = {"DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM", "ROSGLASS_URL"}
        environment = {k: v for k, v in os.environ.items() if k not in gone} | platform
        environment["PYTHONUNBUFFERED"] = "1"
        programs.append(Program([sys.executable, str(file)], environment))
        return programs[-1]

    yield run
    for program in programs:
        program.close()
