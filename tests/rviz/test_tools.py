"""Tools as the operator adds, removes and chooses them: by RViz's dialog, tool bar and keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import Error
from rosglass.rviz.host import pyqt

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture
def tools(app: Any) -> Any:
    tools = app.rviz.tools
    tools.remove_all()
    for class_id in ("rviz/Interact", "rviz/MoveCamera", "rviz/Measure"):
        tools.add(class_id)
    yield tools
    tools.remove_all()


@pytest.fixture
def log(tools: Any) -> list[str]:
    log: list[str] = []
    tools.added.connect(lambda tool: log.append(f"added {tool.name}"))
    tools.removed.connect(lambda tool: log.append(f"removed {tool.name}"))
    tools.selected.connect(
        lambda: log.append(f"selected {tools.current.name if tools.current else None}")
    )
    return log


def dialog() -> Any:
    """Return RViz's dialog, as its own binding knows it; None while there is none."""
    return pyqt("QtWidgets").QApplication.activeModalWidget()


def choose(class_name: str | None) -> None:
    """Choose a class in RViz's dialog, or none."""
    core, widgets = pyqt(), pyqt("QtWidgets")
    box = dialog()
    buttons = box.findChild(widgets.QDialogButtonBox)
    if class_name is None:
        buttons.button(buttons.Cancel).click()
        return
    tree = box.findChild(widgets.QTreeWidget)
    (item,) = tree.findItems(class_name, core.Qt.MatchExactly | core.Qt.MatchRecursive)
    tree.setCurrentItem(item)
    buttons.button(buttons.Ok).click()


@pytest.mark.parametrize("chosen", ["PublishPoint", None])
def test_the_dialog_for_a_new_tool(
    app: Any, tools: Any, log: list[str], show: Any, wait: Any, chosen: str | None
) -> None:
    from rosglass.qt import QtCore

    root = show(
        """Item { property var added: []
        function ask() { return rviz.toolManager.addTool() === null }
        Connections { target: rviz.toolManager
            function onToolAdded(tool) { added.push(tool.classId) } } }"""
    )
    tried: list[Any] = []

    # The dialog has a loop of its own.
    def look() -> None:
        if dialog() is None:
            QtCore.QTimer.singleShot(50, look)
        else:
            tried.append(dialog().windowTitle())
            choose(chosen)

    QtCore.QTimer.singleShot(50, look)
    assert root.ask() is True
    # It comes once the function has returned.
    assert dialog() is None
    wait(lambda: tried)
    wait(lambda: dialog() is None)
    wait.frames(3)
    added = root.property("added")
    added = added.toVariant() if hasattr(added, "toVariant") else added
    if chosen is None:
        assert (log, added, len(tools.all)) == ([], [], 3)
    else:
        assert log[0] == "added Publish Point"
        assert added == ["rviz/PublishPoint"]
        assert tools.all[-1].class_id == "rviz/PublishPoint"


def test_tools_of_one_name(app: Any, tools: Any, log: list[str], wait: Any) -> None:
    first = tools.find("rviz/Measure")
    second = tools.add("rviz/Measure")
    third = tools.add("rviz/Measure")
    assert first.name == second.name == third.name
    second.select()
    assert [tool.selected for tool in (first, second, third)] == [False, True, False]
    tools.remove(second)
    assert [tool.exists for tool in (first, second, third)] == [True, False, True]
    assert tools.find("rviz/Measure") is first
    tools.remove(first)
    assert tools.find("rviz/Measure") is third
    with pytest.raises(Error, match="the tool Measure was removed"):
        first.select()
    third.select()
    assert tools.current is third
    # The one that is gone was followed by the first tool.
    assert log.count("selected Interact") == 1


def tool_bar(app: Any) -> Any:
    bars = app.window.frame.findChildren(pyqt("QtWidgets").QToolBar)
    return next(bar for bar in bars if bar.windowTitle() == "Tools")


def test_the_tool_bar_removes_tools(app: Any, tools: Any, log: list[str], wait: Any) -> None:
    """By the menu behind its minus sign."""
    widgets = pyqt("QtWidgets")
    buttons = tool_bar(app).findChildren(widgets.QToolButton)
    (remove,) = [button for button in buttons if "emove" in button.toolTip()]
    menu = remove.menu()
    menu.aboutToShow.emit()
    (action,) = [action for action in menu.actions() if action.text() == "Measure"]
    measure = tools.find("rviz/Measure")
    measure.select()
    menu.triggered.emit(action)
    wait(lambda: "removed Measure" in log)
    assert not measure.exists
    wait(lambda: log[-1] == "selected Interact")
    assert [tool.class_id for tool in tools.all] == ["rviz/Interact", "rviz/MoveCamera"]


def test_keys_select_tools(
    app: Any, tools: Any, log: list[str], hand: Any, wait: Any, show: Any
) -> None:
    root = show(
        """Item { property string now: rviz.toolManager.currentTool.shortcutKey
        TextField { objectName: "field"; x: 300; y: 100; width: 200 } }"""
    )
    panel = app.window.panel
    x, y = panel.width() // 2, panel.height() - 60
    hand.click(x, y)
    for name in ("MoveCamera", "Interact", "MoveCamera", "Interact"):
        tool = tools.find(f"rviz/{name}")
        hand.key(tool.shortcut_key)
        wait(lambda tool=tool: tools.current is tool)
        wait(lambda tool=tool: root.property("now") == tool.shortcut_key)
    # What is typed into an interface is for it alone.
    hand.click(400, 120)
    hand.key("m")
    from rosglass.rviz.qt5 import QtCore

    field: Callable[[], Any] = lambda: root.findChild(QtCore.QObject, "field").property("text")  # noqa: E731
    wait(lambda: field() == "m")
    assert tools.current.name == "Interact"
    # Of two tools with one key, RViz takes the later one, and does without when that is gone.
    again = tools.add("rviz/MoveCamera")
    hand.click(x, y)
    hand.key("m")
    wait(lambda: tools.current is again)
    tools.remove(again)
    wait(lambda: tools.current is tools.all[0])
    hand.key("m")
    wait.frames(3)
    assert tools.current is tools.all[0]
    hand.key("i")
    wait.frames(3)
    assert tools.current.shortcut_key == "i"
