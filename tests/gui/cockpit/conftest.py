"""Benches that show layouts of ``RosCockpit 1.0``, and the window of the editor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


class LayoutBench:
    """A layout in a window, on a robot made of memory.

    Attributes:
        window: The main window.
        root: The layout's Cockpit.
        bench: The bench with the engine, its session, and the nodes in memory.
    """

    def __init__(self, running: Any, wait: Any) -> None:
        self.bench, self.wait = running, wait
        self.robot, self.window, self.root = running.robot, None, None

    def show(self, body: str, width: int = 800, height: int = 600, imports: str = "") -> Any:
        """Show a Cockpit with members, such as ``Page { Panel {} }``; return it."""
        self.window = self.bench.load(
            f"Window {{ width: {width}; height: {height}; visible: true\n"
            f"property Item cockpit: made\n"
            f'Cockpit {{ id: made; nodeName: "ui"; anchors.fill: parent\n{body} }} }}',
            "import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport RosControls 1.0\n"
            f"import RosCockpit 1.0\n{imports}",
        )
        self.wait(self.window.isExposed)
        self.root = self.window.property("cockpit")
        self.window.requestActivate()
        self.wait(self.window.isActive)
        return self.root

    def find(self, name: str, item: Any = None) -> Any:
        """Return the visual item with an ``objectName``."""
        found = self.search(name, item)
        assert found is not None, f"no item {name!r}"
        return found

    def search(self, name: str, item: Any = None) -> Any:
        """Return the visual item with an ``objectName``; None if there is none."""
        waiting = [item or self.window.contentItem()]
        while waiting:
            one = waiting.pop()
            if one.objectName() == name:
                return one
            waiting += one.childItems()
        return None

    def place(self, item: Any) -> tuple[int, int, int, int]:
        """Return x, y, width and height of an item, or the one with a name, in its window."""
        from rosglass.qt import QtCore

        item = self.find(item) if isinstance(item, str) else item
        at = item.mapToScene(QtCore.QPointF(0, 0))
        return round(at.x()), round(at.y()), round(item.width()), round(item.height())

    def point(self, item: Any, across: float = 0.5, down: float = 0.5) -> Any:
        """Return a point of an item, in its window."""
        from rosglass.qt import QtCore

        item = self.find(item) if isinstance(item, str) else item
        return item.mapToScene(
            QtCore.QPointF(item.width() * across, item.height() * down)
        ).toPoint()

    def key(self, text: str, window: Any = None) -> None:
        """Press keys, such as ``Ctrl+2``."""
        from rosglass.qt import QtCore, QtGui, optional

        pressed = QtGui.QKeySequence(text)[0]
        if hasattr(pressed, "key"):
            key, modifiers = pressed.key(), pressed.keyboardModifiers()
        else:
            mask = int(QtCore.Qt.KeyboardModifierMask)
            key = QtCore.Qt.Key(int(pressed) & ~mask)
            modifiers = QtCore.Qt.KeyboardModifiers(int(pressed) & mask)
        optional("QtTest").QTest.keyClick(window or self.window, key, modifiers)

    def click(self, item: Any, across: float = 0.5, down: float = 0.5, window: Any = None) -> None:
        """Click on an item."""
        from rosglass.qt import QtCore, optional

        optional("QtTest").QTest.mouseClick(
            window or self.window,
            QtCore.Qt.MouseButton.LeftButton,
            QtCore.Qt.KeyboardModifier.NoModifier,
            self.point(item, across, down),
        )


@pytest.fixture
def layouts(running: Any, wait: Callable[..., None]) -> LayoutBench:
    """A bench to show layouts on, connected to the robot."""
    from rosglass.cockpit.modules import register

    register()
    return LayoutBench(running, wait)


class Editor:
    """The editor's window, on a robot made of memory."""

    def __init__(
        self, running: Any, wait: Any, layout: str | Path = "", panels: tuple[Path, ...] = ()
    ) -> None:
        from rosglass.cockpit.modules import register
        from rosglass.cockpit.program import WINDOW, CockpitProgram
        from rosglass.qt import QtCore, QtQml

        register()
        self.bench, self.wait = running, wait
        self.program: Any = CockpitProgram(layout, panels=panels)
        running.engine.rootContext().setContextProperty("program", self.program)
        component = QtQml.QQmlComponent(running.engine, QtCore.QUrl.fromLocalFile(str(WINDOW)))
        self.window: Any = component.create()
        assert self.window is not None, component.errorString()
        running.roots += [self.window, component]
        wait(self.window.isExposed)
        self.window.requestActivate()
        wait(self.window.isActive)

    @property
    def text(self) -> str:
        return str(self.program._live.document.text)

    @property
    def root(self) -> Any:
        return self.program._live.root

    def find(self, name: str) -> Any:
        """Return the item with an ``objectName``, once there is one."""

        def look() -> Any:
            waiting = [self.window.contentItem()]
            while waiting:
                one = waiting.pop()
                if one.objectName() == name and one.isVisible():
                    return one
                waiting += one.childItems()
            return None

        self.wait(look)
        return look()

    def click(self, name: str) -> None:
        from rosglass.qt import QtCore, optional

        item = self.find(name)
        at = item.mapToScene(QtCore.QPointF(item.width() / 2, item.height() / 2)).toPoint()
        left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
        optional("QtTest").QTest.mouseClick(self.window, left, none, at)

    def answer(self, index: int) -> None:
        """Click on an answer of the question, once it can be clicked."""
        from rosglass.qt import QtCore

        box = self.window.findChild(QtCore.QObject, "question")
        self.wait(lambda: box.property("opened"))
        item = self.find(f"answer{index}")
        place: list[float] = []

        def stands() -> bool:
            place.append(item.mapToScene(QtCore.QPointF(0, 0)).x())
            return len(place) > 3 and place[-1] == place[-3]

        self.wait(stands)
        self.click(f"answer{index}")
        assert self.program.property("question") == ""

    def key(self, text: str) -> None:
        from rosglass.qt import QtGui, optional

        pressed = QtGui.QKeySequence(text)[0]
        optional("QtTest").QTest.keyClick(self.window, pressed.key(), pressed.keyboardModifiers())

    def type(self, text: str) -> None:
        from rosglass.qt import optional

        for letter in text:
            optional("QtTest").QTest.keyClick(self.window, letter)

    def select(self, title: str) -> None:
        """Select the panel with a title."""
        live = self.program._live
        found = next(
            one
            for one in live.document.objects()
            if one.type == "Panel" and one.get("title") and one.get("title").value == title
        )
        self.root.setProperty("current", live.item_of(found))


@pytest.fixture
def edit(
    running: Any, wait: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., Editor]]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("ROSGLASS_URL", "local://empty")
    made: list[Editor] = []

    def start(layout: str | Path = "", panels: tuple[Path, ...] = ()) -> Editor:
        made.append(Editor(running, wait, layout, panels))
        return made[-1]

    yield start
    from rosglass.qt import QtGui, send_deferred_deletes

    for one in made:
        one.program.close()
    # A window's shortcuts are those of the whole application; its Python half may be gone.
    for window in QtGui.QGuiApplication.topLevelWindows():
        if window.title().endswith("rosglass"):
            window.deleteLater()
    send_deferred_deletes()


@pytest.fixture(autouse=True)
def toured(request: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A state folder of the test's own, in which the cockpit's tour has been seen."""
    state = tmp_path / "state" / "rosglass" / "cockpit"
    state.mkdir(parents=True, exist_ok=True)
    if request.node.get_closest_marker("first_start") is None:
        (state / "tour_seen").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
