"""A real RViz in the test's own process, on a real X server and a real ROS master."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import xmlrpc.client
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from overlay_contract import Qml
from rosmaster import RosMaster

from rosglass.demo.processes import VirtualScreen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from qt_waiting import QtWaiting

    from rosglass.rviz import Application

# RViz's own Python has Qt 5 alone; anywhere else, there is nothing to test.
HAVE_RVIZ = find_spec("PySide6") is None and find_spec("rviz") is not None
if HAVE_RVIZ:
    os.environ.setdefault("ROSGLASS_QT", "pyside2")
#: RViz, its master, and the config that it has begun with.
FOUND: list[tuple[Application, str, Path]] = []
IMPORTS = "import QtQuick 2.15\nimport QtQuick.Controls 2.15\n"
SCREEN = (1280, 800)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = str(Path(__file__).parent)
    for item in items:
        if str(item.path).startswith(here) and not HAVE_RVIZ:
            item.add_marker(pytest.mark.skip("RViz's bindings need the system's own Python"))


@pytest.fixture(scope="session")
def screen() -> str:
    """A display of the test's own; Qt would end the tests if it ended before them."""
    read, write = os.pipe()
    # The kernel ends it when the tests end, however they do.
    command = [
        "setpriv",
        "--pdeathsig",
        "TERM",
        "Xvfb",
        "-displayfd",
        str(write),
        "-screen",
        "0",
        f"{SCREEN[0]}x{SCREEN[1]}x24",
    ]
    # Without -noreset it would start over, and refuse others, whenever its last client leaves.
    subprocess.Popen(
        [*command, "-nolisten", "tcp", "-noreset"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as numbers:
        return f":{numbers.readline().strip()}"


@pytest.fixture(scope="session")
def master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The URI of a rosmaster of the test's own."""
    with RosMaster(tmp_path_factory.mktemp("ros_home")) as master:
        yield master.uri


@pytest.fixture(scope="session")
def app(
    screen: str, master: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Application]:
    """RViz, once per process: Ogre can be started only once. Its window fills the screen."""
    home = tmp_path_factory.mktemp("home")
    os.environ.update(
        DISPLAY=screen,
        QT_QPA_PLATFORM="xcb",
        ROS_MASTER_URI=master,
        ROS_IP="127.0.0.1",
        HOME=str(home),
        XDG_RUNTIME_DIR=str(home),
    )
    sys.argv[:] = ["rosglass"]
    from rosglass.rviz import Application

    app = Application(renderer=os.environ.get("TEST_RENDERER", "auto"))
    app.window.widget.setGeometry(0, 0, *SCREEN)
    app.window.widget.show()
    found = home / "found.rviz"
    app.save_config(found)
    FOUND.append((app, master, found))
    yield app
    FOUND.clear()
    app.close()


@pytest.fixture(scope="module", autouse=True)
def as_found() -> Iterator[None]:
    """Leave displays, tools, panels and the robot's description as they were to the next tests."""
    yield
    for app, master, file in FOUND:
        app.overlays.close()
        app.window.fullscreen = app.window.bare.on = False
        # Another file may start an RViz whose interface gives its node the same name.
        app.session.shutdown()
        with xmlrpc.client.ServerProxy(master) as proxy:
            proxy.deleteParam("/test", "/robot_description")
        app.load_config(file)
        # RViz makes some of it by later events.
        from rosglass.qt import QtCore, run_event_loop

        loop = QtCore.QEventLoop()
        QtCore.QTimer.singleShot(1000, loop.quit)
        run_event_loop(loop)


@pytest.fixture
def wait(app: Application) -> QtWaiting:
    """Runs the event loop until a condition holds, or RViz has begun some frames."""
    from qt_waiting import QtWaiting

    return QtWaiting(app.window.before_frame)


@pytest.fixture
def rviz_notices_changes(app: Application) -> Callable[[], bool]:
    """Return whether RViz tracks changes of its config, which it does a second after loading."""
    from rosglass.rviz.host import pyqt

    def notices() -> bool:
        timers = app.window.frame.findChildren(pyqt().QTimer)
        after_loading = [t for t in timers if t.isSingleShot() and t.interval() == 1000]
        assert len(after_loading) == 1
        return not after_loading[0].isActive()

    return notices


@pytest.fixture
def drawn(app: Application) -> Iterator[list[Any]]:
    """The work of overlays in each frame in which any was drawn."""
    works: list[Any] = []
    app.overlays.drawn.connect(works.append)
    yield works
    app.overlays.drawn.disconnect(works.append)


@pytest.fixture
def frames(wait: QtWaiting) -> Callable[[int], None]:
    """See :meth:`QtWaiting.frames`."""
    return wait.frames


@pytest.fixture
def grab(app: Application, frames: Callable[[int], None]) -> Callable[[], Any]:
    """Return an image of the 3D view after RViz has drawn two more frames; QImage."""

    def grab() -> Any:
        frames(3)
        view = app.window.panel
        handle = app.qt.primaryScreen()
        return handle.grabWindow(view.winId()).toImage()

    return grab


class Hand:
    """A mouse and a keyboard, in units of the 3D view."""

    def __init__(self, app: Any, wait: QtWaiting) -> None:
        self.app, self.wait, self.panel = app, wait, app.window.panel
        self._held: dict[tuple[str, str], None] = {}

    def do(self, *words: object) -> None:
        arguments = [str(word) for word in words]
        for act, what in itertools.pairwise(arguments):
            if act in ("mousedown", "keydown"):
                self._held[act.replace("down", "up"), what] = None
            self._held.pop((act, what), None)
        subprocess.run(["xdotool", *arguments], check=True, capture_output=True)
        self.wait.frames(2)

    def let_go(self) -> None:
        """Release held buttons and keys, which would affect later tests."""
        for act, what in list(self._held):
            self.do(act, what)

    def move(self, x: float, y: float) -> None:
        from rosglass.rviz.qt5 import QtCore

        at = self.panel.mapToGlobal(QtCore.QPoint(round(x), round(y)))
        # RViz's tools take two places; one way leads over the place beside it.
        self.do("mousemove", at.x() - 1, at.y(), "mousemove", at.x(), at.y())

    def press(self, button: int = 1) -> None:
        self.do("mousedown", button)

    def release(self, button: int = 1) -> None:
        self.do("mouseup", button)

    def click(self, x: float, y: float, button: int = 1) -> None:
        self.move(x, y)
        self.press(button)
        self.release(button)

    def drag(self, x: float, y: float, to_x: float, to_y: float, button: int = 1) -> None:
        self.move(x, y)
        self.press(button)
        self.move((x + to_x) / 2, (y + to_y) / 2)
        self.move(to_x, to_y)
        self.release(button)

    def wheel(self, x: float, y: float, up: bool = True) -> None:
        self.move(x, y)
        self.do("click", 4 if up else 5)

    def key(self, *keys: str) -> None:
        for key in keys:
            self.do("key", key)


@pytest.fixture
def hand(app: Any, wait: Callable[..., None]) -> Iterator[Hand]:
    hand = Hand(app, wait)
    app.window.widget.activateWindow()
    for button in (1, 2, 3):
        hand.do("mouseup", button)
    hand.move(5, 5)
    yield hand
    hand.let_go()


@pytest.fixture
def view(app: Any) -> Callable[[str], float]:
    """Return a property of RViz's camera."""
    views = app.window.manager.getViewManager()
    before = {"Yaw": 0.8, "Pitch": 0.8, "Distance": 10.0}
    for name, value in before.items():
        views.getCurrent().subProp(name).setValue(value)
    return lambda name: float(views.getCurrent().subProp(name).getValue())


@pytest.fixture
def steered(app: Any, wait: Callable[..., None]) -> Iterator[Any]:
    """The camera as we move it, at (4, 0, 3), within 0.2 s; and a node of ours."""
    app.connect()
    view = app.view
    view.reset()
    view.settings.load({"Animation Duration": 0.2})
    wait(lambda: app.view_services.is_open)
    yield view
    view.settings.by_program.clear()
    view.settings.load({})
    view.reset()
    app.window.manager.setFixedFrame("map")
    wait.frames(2)


@pytest.fixture
def eye(app: Any) -> Callable[[], tuple[float, float, float]]:
    """Return where Ogre's camera is once RViz has drawn."""
    from rosglass.rviz.camera import RvizCamera

    made = RvizCamera(app.window)

    def where() -> tuple[float, float, float]:
        made.update()
        return made.eye

    return where


@pytest.fixture
def show(app: Any, frames: Callable[[int], None], tmp_path: Path) -> Callable[..., Any]:
    """Show QML text over the 3D view; returns its root."""

    def show(text: str, name: str = "Test", **options: Any) -> Any:
        file = tmp_path / f"{name}.qml"
        file.write_text(IMPORTS + text)
        overlay = app.add_qml(file, **options)
        frames(3)
        return overlay.root

    return show


class Panel:
    """RViz's Displays panel; places in it are names, each below the one before."""

    def __init__(self, app: Any) -> None:
        self.app = app

    @property
    def tree(self) -> Any:
        """The view; loading a config replaces it."""
        from rosglass.rviz.host import pyqt

        views = self.app.window.frame.findChildren(pyqt("QtWidgets").QTreeView)
        return next(v for v in views if v.model().index(0, 0).data() == "Global Options")

    @property
    def model(self) -> Any:
        return self.tree.model()

    def rows(self, *path: str) -> Any:
        """Return the index of the name at a path."""
        from rosglass.rviz.host import pyqt

        model, at = self.model, pyqt().QModelIndex()
        for name in path:
            found = [model.index(row, 0, at) for row in range(model.rowCount(at))]
            at = next(one for one in found if one.data() == name)
        return at

    def texts(self, *path: str) -> dict[str, Any]:
        """Return names and values below a place, as they are shown."""
        model, at = self.model, self.rows(*path)
        return {
            model.index(row, 0, at).data(): model.index(row, 1, at).data()
            for row in range(model.rowCount(at))
        }

    def edit(self, value: Any, *path: str) -> None:
        self.model.setData(self.rows(*path).siblingAtColumn(1), value)

    def check(self, on: bool, *path: str) -> None:
        from rosglass.rviz.host import pyqt

        core, at = pyqt().Qt, self.rows(*path).siblingAtColumn(1)
        assert self.model.setData(at, core.Checked if on else core.Unchecked, core.CheckStateRole)

    def select(self, *path: str) -> None:
        from rosglass.rviz.host import pyqt

        # RViz's panel asks for the current one, and crashes without.
        flags = pyqt().QItemSelectionModel
        chosen = flags.ClearAndSelect | flags.Rows
        self.tree.selectionModel().setCurrentIndex(self.rows(*path), chosen)

    def click(self, name: str) -> None:
        """Click a button below the tree."""
        from rosglass.rviz.host import pyqt

        kind = pyqt("QtWidgets").QPushButton
        above = self.tree.parent()
        while not above.findChildren(kind):
            above = above.parent()
        next(b for b in above.findChildren(kind) if b.text() == name).click()

    def drag(self, path: tuple[str, ...], row: int, into: tuple[str, ...] = ()) -> None:
        """Drop the item at a path before a row of another item, like the view."""
        from rosglass.rviz.host import pyqt

        data = self.model.mimeData([self.rows(*path)])
        assert self.model.dropMimeData(data, pyqt().Qt.MoveAction, row, 0, self.rows(*into))


@pytest.fixture
def panel(app: Any) -> Panel:
    return Panel(app)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The file of the interface that `show_file` shows."""
    return tmp_path / "Ui.qml"


@pytest.fixture
def show_file(request: pytest.FixtureRequest, app: Any, file: Path) -> Callable[..., Any]:
    """Show QML text over the 3D view, after the test module's own imports; returns the overlay.

    Errors name the line, so the imports are each module's own.
    """

    def show_file(text: str, **options: Any) -> Any:
        file.write_text(request.module.IMPORTS + text)
        return app.add_qml(file, **options)

    return show_file


@pytest.fixture
def error_panels(app: Any) -> Callable[[], list[Any]]:
    """Return the items over the 3D view that show errors of interfaces."""
    from rosglass.rviz.qt5 import QtQuick

    def error_panels() -> list[Any]:
        windows = [w for w in app.qt.allWindows() if isinstance(w, QtQuick.QQuickWindow)]
        items = [item for window in windows for item in window.contentItem().childItems()]
        return [item for item in items if item.property("heading")]

    return error_panels


@pytest.fixture
def tools(app: Any) -> Any:
    """Return RViz's tools, three of them."""
    tools = app.rviz.tools
    tools.remove_all()
    for class_id in ("rviz/Interact", "rviz/MoveCamera", "rviz/Select"):
        tools.add(class_id)
    return tools


@pytest.fixture
def displays(app: Any, wait: Callable[..., None]) -> Any:
    """Return RViz's displays, a grid alone, and take everything away again."""
    displays = app.rviz.displays
    for display in displays.all:
        displays.remove(display)
    displays.add("rviz/Grid", "Grid")
    yield displays
    for display in displays.all:
        if display.exists:
            displays.remove(display)
    wait.frames(1)


@pytest.fixture
def qml(app: Any, wait: Callable[..., None], tmp_path: Path) -> Callable[..., Qml]:
    """Show QML text over the 3D view."""
    count = iter(range(100))

    def show(text: str = "Item {}", **options: Any) -> Qml:
        name = f"Overlay{next(count)}"
        file = tmp_path / f"{name}.qml"
        file.write_text("import QtQuick 2.15\n" + text)
        overlay = app.add_qml(file, **options)
        wait.frames(3)
        return Qml(overlay, wait)

    return show


@pytest.fixture
def seen(master: str, tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Return the report of a separate program, on a screen of a given pixel ratio."""

    def run(program: str, factor: str, renderer: str) -> dict[str, Any]:
        env = {k: v for k, v in os.environ.items() if k not in ("QT_QPA_PLATFORM", "DISPLAY")}
        env |= {"HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path), "ROS_IP": "127.0.0.1"}
        env |= {"ROS_MASTER_URI": master, "ROSGLASS_QT": "pyside2", "QT_SCALE_FACTOR": factor}
        env |= {"PYTHONFAULTHANDLER": "1"}
        file = Path(__file__).with_name(program)
        with closing(VirtualScreen(1800, 1400)) as screen:
            done = subprocess.run(
                [sys.executable, str(file), str(tmp_path / "Test.qml"), renderer],
                env=env | {"DISPLAY": screen.display},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=90,
                check=False,
            )
        lines = [line for line in done.stdout.splitlines() if line.startswith("SEEN ")]
        assert lines, f"it ended with {done.returncode}: {done.stdout[-3000:]}"
        seen: dict[str, Any] = json.loads(lines[0].removeprefix("SEEN "))
        return seen

    return run


@pytest.fixture(autouse=True)
def clean(request: pytest.FixtureRequest) -> Iterator[None]:
    """Take every overlay away after each test."""
    yield
    if "app" in request.fixturenames:
        request.getfixturevalue("app").overlays.close()
