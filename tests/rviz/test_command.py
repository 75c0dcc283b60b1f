"""``rosglass rviz``, as a program of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from rosmaster import RosMaster
from waiting import eventually

import rosglass
from rosglass.demo.processes import VirtualScreen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

PATIENCE = 30
#: Seconds that the program may take to end, on a busy machine, too.
ENDING = 8.0
OVERLAY = """
import QtQuick 2.15
Item {
    Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#00ff00" }
    Timer { running: true; interval: %s; onTriggered: { %s } }
}
"""


class Program:
    """A running ``rosglass rviz``; `output` is its output so far."""

    def __init__(self, process: subprocess.Popen[str], log: Path) -> None:
        self.process, self._log = process, log

    @property
    def output(self) -> str:
        return self._log.read_text()

    def wait_for(self, text: str) -> None:
        def is_there() -> bool:
            found = text in self.output
            assert found or self.process.poll() is None, self.output
            return found

        eventually(is_there, lambda: self.output, timeout=PATIENCE)

    def end(self, number: int = signal.SIGINT) -> int:
        started = time.monotonic()
        self.process.send_signal(number)
        code = self.process.wait(PATIENCE)
        assert time.monotonic() - started < ENDING, self.output
        return code


@pytest.fixture
def start(screen: str, master: str, tmp_path: Path) -> Iterator[Callable[..., Program]]:
    running: list[Program] = []
    home = tmp_path / "home"
    home.mkdir(mode=0o700)

    def start(
        *arguments: Any, program: Sequence[str] = ("-m", "rosglass.cli", "rviz"), **env: str
    ) -> Program:
        log = tmp_path / f"log{len(running)}"
        # Another client of the screen keeps it open after this one; see conftest.
        given = {
            "PATH": os.environ["PATH"],
            "HOME": str(home),
            "XDG_RUNTIME_DIR": str(home),
            "DISPLAY": screen,
            "ROS_MASTER_URI": master,
            "ROS_IP": "127.0.0.1",
            **env,
        }
        command = [sys.executable, *program, *map(str, arguments)]
        with log.open("w") as file:
            process = subprocess.Popen(command, env=given, stdout=file, stderr=file, text=True)
        running.append(Program(process, log))
        return running[-1]

    yield start
    for program in running:
        if program.process.poll() is None:
            program.process.kill()
            program.process.wait()


def interface(folder: Path, code: str, after: int = 500, name: str = "Overlay.qml") -> Path:
    file = folder / name
    file.write_text(OVERLAY % (after, code))
    return file


def test_shows_overlays_over_rviz_and_takes_a_screenshot(
    start: Callable[..., Program], tmp_path: Path
) -> None:
    from rosglass.qt import QtGui

    file = interface(tmp_path, 'console.warn("arguments", Qt.application.arguments)')
    picture = tmp_path / "picture.png"
    program = start(
        *("--overlay", file, "--overlay", file, "--fixed-frame", "odom", "--fullscreen"),
        *("--screenshot", picture, "--after", "3", "--", "--speed=2"),
    )
    assert program.process.wait(PATIENCE) == 0, program.output
    assert "--speed=2" in program.output
    seen = QtGui.QImage(str(picture))
    assert (seen.width(), seen.height()) == (1280, 800)
    colours = {seen.pixelColor(x, y).name() for x in range(0, 1280, 20) for y in range(0, 800, 20)}
    assert "#00ff00" in colours
    assert "#303030" in colours


def test_screenshot_that_was_not_taken_is_missed(
    start: Callable[..., Program], tmp_path: Path
) -> None:
    file, picture = interface(tmp_path, "Qt.quit()"), tmp_path / "picture.png"
    program = start("--overlay", file, "--screenshot", picture, "--after", "600")
    assert program.process.wait(PATIENCE) == 1, program.output
    assert f"{picture} was not written: the program was ended before 600 s" in program.output
    assert not picture.exists()


def test_edges_are_hard_if_asked_for(start: Callable[..., Program], tmp_path: Path) -> None:
    picture = tmp_path / "rviz.png"
    for options in ((), ("--disable-anti-aliasing",)):
        program = start("-v", *options, "--screenshot", picture, "--after", "0.5")
        assert program.process.wait(PATIENCE) == 0, program.output
        # RViz's own words.
        assert ("Disabling Anti-Aliasing" in program.output) is bool(options)


def test_qml_ends_it_with_an_exit_code(start: Callable[..., Program], tmp_path: Path) -> None:
    program = start("--overlay", interface(tmp_path, "Qt.exit(7)"))
    assert program.process.wait(PATIENCE) == 7, program.output


LAST = """
import QtQuick 2.15
import Ros 1.0
Item {
    property var publisher
    Component.onCompleted: {
        Ros.init("overlay")
        publisher = Ros.advertise("std_msgs/String", "/last", 10)
    }
    Component.onDestruction: publisher.publish({data: "destroyed"})
    Timer {
        interval: 100; running: true; repeat: true
        onTriggered: if (publisher.getNumSubscribers()) { console.warn("it may end"); stop() }
    }
}
"""


def test_an_overlay_sends_its_last_message(
    start: Callable[..., Program], master: str, tmp_path: Path
) -> None:
    file, received = tmp_path / "Last.qml", []
    file.write_text(LAST)
    uri = master.removeprefix("http://")
    with rosglass.connect(f"ros1://{uri}?ip=127.0.0.1", "robot") as robot:
        robot.create_subscription(
            "/last", "std_msgs/msg/String", lambda message: received.append(message.data)
        )
        program = start("--overlay", file)
        program.wait_for("it may end")
        program.end()
        eventually(lambda: received == ["destroyed"], lambda: program.output)


def test_logs_nothing_without_a_problem(start: Callable[..., Program], tmp_path: Path) -> None:
    # What a binding reads is there until the binding has gone.
    reads = "Item { property var at: rviz.createPositionTracker(0, 0, 0); x: at.position.x }"
    file = interface(tmp_path, "Qt.quit()")
    file.write_text(file.read_text().replace("Rectangle", reads + "\n    Rectangle"))
    program = start("--overlay", file)
    assert program.process.wait(PATIENCE) == 0
    assert program.output == ""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("after", [0.3, 0.6, 0.9, 1.3, 2.0])
def test_ends_on_signals_at_any_time(
    start: Callable[..., Program], number: int, after: float
) -> None:
    program = start()
    time.sleep(after)
    code = program.end(number)
    assert code in (128 + number, -number), program.output
    assert "Traceback" not in program.output or after < 0.5


def test_waits_for_a_master_and_reports_it(start: Callable[..., Program]) -> None:
    port = free_port()
    program = start("--url", f"ros1://127.0.0.1:{port}")
    program.wait_for(f"start one: roscore -p {port}")
    assert program.end() == 130
    program = start("--url", f"ros1://127.0.0.1:{port}", "--timeout", "0.5")
    assert program.process.wait(PATIENCE) == 1
    assert f"http://127.0.0.1:{port} does not answer" in program.output


def test_ends_when_another_node_takes_its_name(
    start: Callable[..., Program], tmp_path: Path, master: str
) -> None:
    from rosglass.wires.tcpros.master import call_node

    program = start("--name", "rviz_named", "--overlay", interface(tmp_path, "console.warn('up')"))
    program.wait_for("up")
    api = call_node(master, "lookupNode", "/test", "/rviz_named")
    call_node(api, "shutdown", "/test", "another one came")
    assert program.process.wait(PATIENCE) == 0
    assert "/rviz_named was shut down" in program.output


def test_ends_when_the_node_of_overlays_is_killed(
    start: Callable[..., Program], tmp_path: Path, master: str
) -> None:
    from rosglass.wires.tcpros.master import call_node

    file = interface(tmp_path, 'console.warn(Ros.ok() ? "up" : "down")')
    file.write_text("import Ros 1.0\n" + file.read_text())
    text = 'Item {\n    Component.onCompleted: Ros.init("overlay")'
    file.write_text(file.read_text().replace("Item {", text, 1))
    program = start("--overlay", file)
    program.wait_for("up")
    api = call_node(master, "lookupNode", "/test", "/overlay")
    call_node(api, "shutdown", "/rosnode", "user request")
    assert program.process.wait(PATIENCE) == 1, program.output
    assert "the overlays' node was shut down: closed by /rosnode" in program.output


def test_reports_loss_and_restart_of_the_master(
    start: Callable[..., Program], tmp_path: Path
) -> None:
    master = RosMaster(tmp_path / "ros")
    # It waits for the master, and starts as soon as there is one.
    overlay = interface(tmp_path, "console.warn('up')")
    program = start("--overlay", overlay, ROS_MASTER_URI=master.uri)
    program.wait_for(f"start one: roscore -p {master.port}")
    for message in ("up", "was restarted"):
        with master:
            program.wait_for(message)
            # The watch has asked the first one by then, too.
            time.sleep(2.5)
        program.wait_for("new topics are not found")
    assert program.end() == 130


def test_refuses_to_end_its_own_node(start: Callable[..., Program], tmp_path: Path) -> None:
    file = interface(tmp_path, 'Ros.init("rviz_named")', 100)
    file.write_text("import Ros 1.0\n" + file.read_text())
    program = start("--name", "rviz_named", "--overlay", file)
    program.wait_for("/rviz_named is RViz's own node")
    assert program.end() == 130


BROKEN = "a: [1,\n b: }"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{folder}/none.rviz"], "none.rviz does not exist"),
        (["{folder}"], "is a folder"),
        (["{folder}/broken.rviz"], "broken.rviz: RViz cannot read it"),
        (["{folder}/Bad.qml"], "not an RViz config: use rosglass rviz --overlay"),
        (["a.rviz", "b.rviz"], "one file, got a.rviz, b.rviz"),
        (["{folder}/brokn.rviz"], "(.rviz); did you mean broken.rviz?"),
        (["--overlay", "{folder}/None.qml"], "None.qml: there is no such file"),
        (["--overlay", "{folder}/Bat.qml"], "there is no such file; did you mean Bad.qml?"),
        (["--overlay", "{folder}/broken.rviz"], "a config file of RViz, no QML file"),
        (["--overlay", "{folder}/Bad.qml"], "Bad.qml:2:"),
        (["--url", "zenoh://robot"], "expected its master, ros1://..., got zenoh://robot"),
        (["--name", "a-b"], "node name 'a-b' contains '-'"),
        (["--fixed-frame", "/map"], "expected the name of a frame, e.g. 'map', got '/map'"),
        (["-I", "{folder}/none"], "no such folder to import QML modules from"),
        (["__foo:=x"], "__foo is unknown"),
    ],
)
def test_bad_input_is_reported(
    start: Callable[..., Program], tmp_path: Path, arguments: list[str], message: str
) -> None:
    (tmp_path / "broken.rviz").write_text(BROKEN)
    (tmp_path / "Bad.qml").write_text("import QtQuick 2.15\nItem { : }")
    program = start(*[argument.format(folder=tmp_path) for argument in arguments])
    assert program.process.wait(PATIENCE) == 1
    assert message in program.output
    assert "Traceback" not in program.output


def test_without_a_display(start: Callable[..., Program]) -> None:
    program = start(DISPLAY="")
    assert program.process.wait(PATIENCE) == 1
    assert "there is no display" in program.output
    program = start(QT_QPA_PLATFORM="offscreen")
    assert program.process.wait(PATIENCE) == 1
    assert "RViz draws on X11 only" in program.output


def nodes(master: str) -> set[str]:
    """Return the master's registrations."""
    from rosglass.wires.tcpros.master import call_node

    state = call_node(master, "getSystemState", "/test")
    return {node for kind in state for _, found in kind for node in found}


def kill_screen(screen: VirtualScreen) -> None:
    screen.process.kill()


def close_screen(screen: VirtualScreen) -> None:
    screen.process.terminate()


def on_window(command: str) -> Callable[[VirtualScreen], None]:
    """Return a function that runs an xdotool command on RViz's window."""

    def do(screen: VirtualScreen) -> None:
        found = ["search", "--onlyvisible", "--name", "RViz"]
        env = {**os.environ, "DISPLAY": screen.display}
        subprocess.run(["xdotool", *found, command], env=env, timeout=PATIENCE, check=True)

    return do


BROKEN_SCREEN = "the connection to the X server (DISPLAY {display}) is broken: RViz exits"
NO_WINDOW = (
    "RViz's window was destroyed by another program (xdotool windowclose, xkill), or by this one "
    "(e.g. in setWindowFlags()): RViz exits"
)


@pytest.mark.parametrize(
    ("happens", "messages"),
    [
        (kill_screen, {BROKEN_SCREEN}),
        (close_screen, {BROKEN_SCREEN}),
        (on_window("windowclose"), {NO_WINDOW}),
        # The server breaks the connection, and destroys the window.
        (on_window("windowkill"), {BROKEN_SCREEN, NO_WINDOW}),
    ],
    ids=["killed screen", "closed screen", "destroyed window", "killed client"],
)
def test_ends_when_its_screen_or_window_is_lost(
    start: Callable[..., Program],
    tmp_path: Path,
    master: str,
    happens: Callable[[VirtualScreen], None],
    messages: set[str],
) -> None:
    file = interface(tmp_path, "console.warn('up')")
    text = 'import Ros 1.0\nItem { Component.onCompleted: Ros.init("its_overlay")\n'
    file.write_text(file.read_text().replace("Item {", text, 1))
    with VirtualScreen() as screen:
        program = start("--name", "rviz_lost", "--overlay", file, DISPLAY=screen.display)
        program.wait_for("up")
        eventually(lambda: nodes(master) >= {"/rviz_lost", "/its_overlay"}, timeout=PATIENCE)
        happens(screen)
        # A crash would give a negative number.
        assert program.process.wait(PATIENCE) == 1, program.output
        expected = {message.format(display=screen.display) for message in messages}
    assert any(message in program.output for message in expected), program.output
    assert not nodes(master) & {"/rviz_lost", "/its_overlay"}


@pytest.mark.parametrize("window", ["RViz's", "a floating panel's"])
def test_ends_when_a_window_is_gone_while_its_frame_is_drawn(
    start: Callable[..., Program], master: str, window: str
) -> None:
    file = str(Path(__file__).with_name("lost_window_program.py"))
    program = start("rviz_lost", window, program=[file])
    assert program.process.wait(2 * PATIENCE) == 1, program.output
    assert NO_WINDOW in program.output
    assert "/rviz_lost" not in nodes(master)
