"""The elements of a layout in use mode: pages, splits, tabs, panels, windows."""

from __future__ import annotations

import logging
from typing import Any

import pytest

pytestmark = pytest.mark.both_qt


def panel(name: str, more: str = "") -> str:
    inside = f'Item {{ objectName: "in_{name}" }}'
    return f'Panel {{ objectName: "{name}"; title: "{name}"; {more} {inside} }}'


def test_split_shares_the_room(layouts: Any) -> None:
    layouts.show(
        f"""Page {{ spacing: 10
        Split {{ spacing: 10; {panel("a", "share: 3;")}
            Split {{ spacing: 10; orientation: Qt.Vertical; {panel("b")} {panel("c")} }} }} }}"""
    )
    # 800x600 with a margin of 10 around the page.
    assert layouts.place("a") == (10, 10, 578, 580)
    assert layouts.place("b") == (598, 10, 192, 285)
    assert layouts.place("c") == (598, 305, 192, 285)
    layouts.window.setWidth(500)
    layouts.wait(lambda: layouts.place("a")[2] == 353)
    assert layouts.place("c")[2] == 117


def test_a_changed_share_is_laid_out(layouts: Any) -> None:
    layouts.show(f"Page {{ spacing: 0; {panel('a')} {panel('b')} }}")
    assert layouts.place("a")[2] == 400
    layouts.find("a").setProperty("share", 3.0)
    layouts.wait(lambda: layouts.place("a")[2] == 600)


def test_a_wrong_share_is_reported(layouts: Any, caplog: Any, messages: None) -> None:
    layouts.show(f"Page {{ spacing: 0; {panel('a', 'share: 0;')} {panel('b')} }}")
    assert "Panel.share is a number above 0, such as 1 or 2.5; got 0" in caplog.text
    assert layouts.place("a")[2] == 400


@pytest.mark.parametrize("width", [800, 300, 120, 40, 10])
def test_nothing_overlaps_however_small(layouts: Any, width: int) -> None:
    layouts.show(
        f"""Page {{ Split {{ {panel("a", "minimumSize: Qt.size(200, 100);")}
            {panel("b", "share: 9;")} {panel("c", "minimumSize: Qt.size(100, 100);")} }} }}""",
        width,
        200,
    )
    a, b, c = (layouts.place(name) for name in "abc")
    assert a[0] + a[2] <= b[0]
    assert b[0] + b[2] <= c[0]
    assert min(a[2], b[2], c[2]) >= 0
    if width == 800:
        assert (a[2], c[2]) == (200, 100)


def test_content_fills_the_panel_unless_it_has_anchors(layouts: Any) -> None:
    layouts.show(
        """Page { spacing: 0
        Panel { objectName: "a"; Rectangle { objectName: "fills" } }
        Panel { Item { objectName: "placed"; anchors.centerIn: parent; width: 30; height: 20 } }
        Panel { Rectangle { objectName: "one"; width: 5; height: 6 } Rectangle { width: 5 } }
        }"""
    )
    _, y, width, height = layouts.place("a")
    assert layouts.place("fills") == (1, y + 25, width - 2, height - 26)
    assert layouts.place("placed")[2:] == (30, 20)
    assert layouts.place("one")[2:] == (5, 6)


def test_an_empty_panel_and_one_with_a_problem_say_it(layouts: Any) -> None:
    layouts.show('Page { Panel { objectName: "a" } }')
    text = layouts.find("panelText")
    assert text.property("text") == "This panel is empty. Edit the layout to say what it shows."
    layouts.root.setProperty("editing", True)
    assert "Empty: choose what it shows" in text.property("text")
    layouts.find("a").setProperty("problem", "x.qml:3: no such type")
    assert text.property("text") == "x.qml:3: no such type"


def test_pages_by_keys_and_bar(layouts: Any) -> None:
    root = layouts.show(
        f'Page {{ title: "One"; {panel("a")} }} Page {{ title: "Two"; {panel("b")} }}'
        f' Page {{ title: "Three"; {panel("c")} }}'
    )

    def shown() -> list[str]:
        return [name for name in "abc" if layouts.find("in_" + name).isVisible()]

    assert shown() == ["a"]
    layouts.key("Ctrl+3")
    assert shown() == ["c"]
    layouts.key("Ctrl+PgDown")
    assert shown() == ["a"]
    layouts.key("Ctrl+PgUp")
    assert shown() == ["c"]
    layouts.click("page1")
    assert shown() == ["b"]
    assert root.property("pageIndex") == 1


def test_one_page_needs_no_bar(layouts: Any) -> None:
    layouts.show(f"Page {{ {panel('a')} }}")
    assert not layouts.find("pageBar").isVisible()


def test_tabs_by_keys_and_mouse(layouts: Any) -> None:
    layouts.show(f"Page {{ {panel('x')}\nTabs {{ {panel('a')} {panel('b')} {panel('c')} }} }}")

    def shown() -> list[str]:
        return [name for name in "abc" if layouts.find("in_" + name).isVisible()]

    assert shown() == ["a"]
    layouts.key("Ctrl+Tab")
    assert shown() == ["b"]
    layouts.key("Ctrl+Shift+Tab")
    layouts.key("Ctrl+Shift+Tab")
    assert shown() == ["c"]
    layouts.click("tab0")
    layouts.wait(lambda: shown() == ["a"])


def test_maximised_by_key_and_double_click(layouts: Any) -> None:
    from rosglass.qt import QtCore, optional

    root = layouts.show(
        f"""Page {{ spacing: 0; {panel("a")}
        Split {{ orientation: Qt.Vertical; {panel("b")}
            Tabs {{ {panel("c")} {panel("d")} }} }} }}"""
    )
    before = {name: layouts.place(name) for name in "abc"}
    layouts.key("F6")
    layouts.key("F6")
    layouts.key("F11")
    assert layouts.place("b") == (0, 0, 800, 600)
    assert [n for n in "abcd" if layouts.find("in_" + n).isVisible()] == ["b"]
    layouts.key("F11")
    layouts.wait(lambda: {name: layouts.place(name) for name in "abc"} == before)
    assert [n for n in "abcd" if layouts.find("in_" + n).isVisible()] == ["a", "b", "c"]
    point = layouts.point("a", 0.5, 0) + QtCore.QPoint(0, 12)
    left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
    test = optional("QtTest").QTest
    test.mouseClick(layouts.window, left, none, point)
    test.mouseDClick(layouts.window, left, none, point)
    layouts.wait(lambda: layouts.place("a") == (0, 0, 800, 600))
    assert root.property("maximized") is not None


def test_a_panel_in_a_window_of_its_own_and_back(layouts: Any) -> None:
    from rosglass.qt import QtCore, QtGui

    layouts.show(f"Page {{ spacing: 0; {panel('a')} {panel('b')} }}")
    content, one = layouts.find("in_a"), layouts.find("a")
    QtCore.QMetaObject.invokeMethod(one, "detach")
    assert one.property("detached")
    layouts.wait(lambda: content.window() is not None and content.window() is not layouts.window)
    window = content.window()
    layouts.wait(window.isExposed)
    layouts.wait(lambda: layouts.place("b")[2] == 800)
    assert window.title() == "a"
    window.close()
    layouts.wait(lambda: not one.property("detached"))
    assert content.window() is layouts.window
    layouts.wait(lambda: layouts.place("a") == (0, 0, 400, 600))
    layouts.wait(
        lambda: len(QtGui.QGuiApplication.topLevelWindows()) == 1 or not window.isVisible()
    )


def test_a_window_on_a_screen_that_is_not_there(layouts: Any, caplog: Any, messages: None) -> None:
    from rosglass.qt import QtGui

    with caplog.at_level(logging.WARNING):
        layouts.show(
            f"Page {{ {panel('a')} }}"
            f' PanelWindow {{ objectName: "w"; title: "Second"; screenName: "HDMI-9"; x: 40; y: 30;'
            f" width: 300; height: 200; {panel('b')} }}"
        )
    content = layouts.find("w")
    found = [w for w in QtGui.QGuiApplication.topLevelWindows() if w.title() == "Second"]
    layouts.wait(lambda: found and found[0].isExposed())
    # Qt's offscreen screen has no name.
    name = QtGui.QGuiApplication.primaryScreen().name() or "the primary screen"
    assert content.property("problem") == f"The screen HDMI-9 is not there: shown on {name}"
    assert "PanelWindow Second: The screen HDMI-9 is not there" in caplog.text
    assert (found[0].width(), found[0].height()) == (300, 200)
    inside = layouts.find("in_b", found[0].contentItem())
    assert inside.isVisible()


def test_f1_asks_for_help_on_the_current_panel(layouts: Any) -> None:
    root = layouts.show(
        f"""property string asked
        onHelpRequested: function(panel) {{ asked = panel.title }}
        Page {{ {panel("a")} {panel("b")} }}"""
    )
    layouts.click("in_b")
    layouts.key("F1")
    assert root.property("asked") == "b"


def test_the_menu_by_keys(layouts: Any) -> None:
    root = layouts.show(
        f"""property string asked
        onHelpRequested: function(panel) {{ asked = panel.title }}
        Page {{ {panel("a")} {panel("b")} }}"""
    )
    layouts.key("F6")
    layouts.key("Shift+F10")
    # Maximise, own window, help.
    layouts.wait(lambda: layouts.search("menu_help") is not None)
    layouts.key("Down")
    layouts.key("Down")
    layouts.key("Return")
    assert root.property("asked") == "a"
    layouts.key("Shift+F10")
    layouts.key("Return")
    assert root.property("maximized") is layouts.find("a")


DRIVE = """
    TwistCommand { id: command; objectName: "command"; topic: "cmd_vel" }
    Page { title: "One"
        Panel { objectName: "a"; DriveStick { objectName: "stick"; command: command } }
        Panel { objectName: "b"; Item {} } }
    Page { title: "Two"; Panel { Item {} } }
"""


@pytest.mark.parametrize("change", ["page", "maximize", "detach", "edit", "tab"])
def test_commands_halt_at_every_change(layouts: Any, change: str) -> None:
    from rosglass.qt import QtCore, optional

    received: list[float] = []
    subscription = layouts.robot.create_subscription(
        "/cmd_vel", "geometry_msgs/msg/Twist", lambda message: received.append(message.linear.x)
    )
    body = DRIVE
    if change == "tab":
        body = DRIVE.replace(
            'Panel { objectName: "b"; Item {} }', f"Tabs {{ {panel('t')} {panel('u')} }}"
        )
    layouts.show(body)
    stick, command = layouts.find("stick"), None
    test: Any = optional("QtTest").QTest
    left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
    layouts.wait(lambda: stick.property("command") is not None)
    command = stick.property("command")
    layouts.wait(lambda: bool(layouts.robot.publishers("/cmd_vel")))

    def is_driving() -> bool:
        # A busy machine may have halted it.
        if not command.property("active"):
            test.mouseRelease(layouts.window, left, none, layouts.point(stick, 0.5, 0.1))
            test.mousePress(layouts.window, left, none, layouts.point(stick, 0.5, 0.1))
        return bool(command.property("active") and received and received[-1] > 0)

    layouts.wait(is_driving)
    change_ = {
        "page": lambda: layouts.key("Ctrl+2"),
        "maximize": lambda: layouts.key("F11"),
        "detach": lambda: QtCore.QMetaObject.invokeMethod(layouts.find("a"), "detach"),
        "edit": lambda: layouts.root.setProperty("editing", True),
        "tab": lambda: layouts.key("Ctrl+Tab"),
    }[change]
    change_()
    assert not command.property("active")
    layouts.wait(lambda: received[-1] == 0)
    subscription.close()


def test_a_framed_control_leaves_title_and_status_to_its_panel(layouts: Any) -> None:
    layouts.show(
        """Page {
            Panel { objectName: "alone"
                LiveFrame { title: "Battery"; problem: "no such topic" } }
            Panel { objectName: "plain"; title: "P"
                LiveFrame { objectName: "content"; framed: false; problem: "lost" } }
            Tabs {
                Panel { title: "Good"; LiveFrame {} }
                Panel { title: "Bad"; LiveFrame { problem: "no such topic" } } } }"""
    )
    alone, plain = layouts.find("alone"), layouts.find("plain")
    assert (alone.property("title_"), alone.property("status_")) == ("Battery", "no such topic")
    assert alone.property("wrong_")
    assert not layouts.find("aside", alone.property("only_")).isVisible()
    # Unframed, it shows them itself.
    assert (plain.property("status_"), plain.property("wrong_")) == ("", False)
    assert layouts.find("aside", layouts.find("content")).isVisible()
    # A tab that is not shown says it, too.
    assert not layouts.find("tab0").property("wrong")
    assert layouts.find("tab1").property("wrong")


@pytest.mark.parametrize("ns", ['"/bert"', "robots.selected"])
def test_a_tile_leads_to_the_page_of_its_robot(layouts: Any, ns: str) -> None:
    layouts.show(
        f"""Page {{ Panel {{ RobotTiles {{
            id: robots; objectName: "tiles"; namespaces: ["/anna", "/bert"] }} }} }}
        Page {{ ns: "/anna"; {panel("a")} }}
        Page {{ ns: {ns}; {panel("b")} }}"""
    )
    tiles = layouts.find("tiles")
    cockpit = tiles.property("shell_").property("cockpit_")
    tiles.choose_(1)
    assert tiles.property("selected") == "/bert"
    assert cockpit.property("pageIndex") == 2
    cockpit.showPage(0)
    tiles.choose_(0)
    assert cockpit.property("pageIndex") == 1
    # While the layout is edited, pages stay.
    cockpit.showPage(0)
    cockpit.setProperty("editing", True)
    tiles.choose_(1)
    assert cockpit.property("pageIndex") == 0


@pytest.mark.parametrize("change", ["page", "maximize", "edit"])
def test_an_input_beside_the_pages_halts_until_it_is_let_go(layouts: Any, change: str) -> None:
    """Such as a gamepad: its own window and visibility stay as they are."""
    root = layouts.show(
        f"""property bool driving: command.active
        property bool held: true
        TwistCommand {{ id: command; topic: "cmd_vel" }}
        Item {{
            id: input
            Timer {{
                interval: 40; repeat: true; running: true
                onTriggered: made.held ? command.steer(input, 1, 0) : command.release(input)
            }}
        }}
        Page {{ {panel("a")} {panel("b")} }}
        Page {{ {panel("c")} }}"""
    )
    subscription = layouts.robot.create_subscription(
        "/cmd_vel", "geometry_msgs/msg/Twist", lambda _: None
    )

    letting_go = 0

    def is_driving() -> bool:
        # A busy machine may halt it; then it is let go for some turns.
        nonlocal letting_go
        if root.property("driving"):
            return True
        letting_go = (letting_go + 1) % 60
        root.setProperty("held", letting_go < 40)
        return False

    layouts.wait(is_driving)
    root.setProperty("held", True)
    layouts.key("F6")
    if change == "page":
        layouts.key("Ctrl+2")
    elif change == "maximize":
        layouts.key("F11")
    else:
        root.setProperty("editing", True)
    assert not root.property("driving")
    # Still held: nothing moves.
    layouts.wait.nothing_happens(0.3)
    assert not root.property("driving")
    layouts.wait(is_driving)
    subscription.close()


def test_the_program_ends_with_the_main_window(start: Any, tmp_path: Any) -> None:
    file = tmp_path / "layout.qml"
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        import RosCockpit 1.0
        Cockpit {
            id: root_
            Page { Panel { Item {} } Panel { id: other; Item {} } }
            PanelWindow { id: second; title: "second"; Panel { Item {} } }
            Timer {
                interval: 100; repeat: true; running: true
                onTriggered: {
                    if (!other.detached)
                        other.detach()
                    else if (second.holder_.Window.window.visible)
                        root_.Window.window.close()
                }
            }
        }"""
    )
    program = start("run", file, "--url", "local://x")
    assert program.end(30) == 0, program.text


def test_a_closed_window_is_opened_by_the_bar(layouts: Any) -> None:
    from rosglass.qt import QtGui

    layouts.show(f'Page {{ {panel("a")} }} PanelWindow {{ title: "Second"; {panel("b")} }}')
    window = next(one for one in QtGui.QGuiApplication.topLevelWindows() if one.title() == "Second")
    layouts.wait(window.isExposed)
    assert not layouts.find("pageBar").isVisible()
    window.close()
    layouts.wait(lambda: layouts.search("window0") is not None)
    assert layouts.find("window0").property("text") == "Second"
    layouts.wait(lambda: layouts.find("window0").property("width") > 0)
    layouts.click("window0")
    layouts.wait(window.isExposed)
    layouts.wait(lambda: not layouts.find("pageBar").isVisible())
