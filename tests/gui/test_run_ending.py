"""``rosglass run`` ends soon, and cleanly, whatever the robot is doing."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from waiting import nothing_happens

import rosglass

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

#: Seconds: 2 are promised; the machines that run the tests are busy.
SOON = 5.0

BLOCKED = """import QtQuick 2.15
import QtQuick.Window 2.15
import Ros 1.0
Window {
    id: window
    visible: true; width: 200; height: 100
    property bool answered: false
    Component.onCompleted: Ros.init("ui")
    function call() {
        console.log("calling")
        const result = Service.call("/hang", "std_srvs/Trigger", {})
        console.log("returned", result)
        return result
    }
    Timer {
        running: Ros.connectionState == "connected"; interval: 100
        onTriggered: if (window.call() === false) restart()
    }
}"""
SERVER = """
import sys, time, rosglass
node = rosglass.connect(sys.argv[1], "robot")
def hang(request):
    print("called", flush=True)
    time.sleep(1000)
node.create_service_server("/hang", "std_srvs/srv/Trigger", hang)
print("ready", flush=True)
time.sleep(1000)
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "Main.qml"


class HangingRobot:
    """A robot in its own process whose service never answers."""

    def __init__(self, url: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVER, url], stdout=subprocess.PIPE, text=True
        )
        self.until("ready")

    def until(self, text: str) -> None:
        assert self._process.stdout is not None
        assert self._process.stdout.readline().strip() == text

    def freeze(self) -> None:
        self._process.send_signal(signal.SIGSTOP)

    def close(self) -> None:
        self._process.kill()
        self._process.wait(10)
        assert self._process.stdout is not None
        self._process.stdout.close()


@pytest.fixture
def robot(url: str) -> Iterator[HangingRobot]:
    made = HangingRobot(url)
    yield made
    made.close()


def ended_soon(program: Any, started: float) -> bool:
    return time.monotonic() - started < SOON


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_blocked_call_is_given_up_on_a_signal(
    start: Any, file: Path, url: str, robot: HangingRobot, number: int
) -> None:
    file.write_text(BLOCKED)
    program = start("run", file, "--url", url)
    robot.until("called")
    started = time.monotonic()
    program.kill(number)
    assert program.end() == 128 + number
    assert ended_soon(program, started)
    assert "Traceback" not in program.text


def test_closing_the_window_ends_a_blocked_call(
    start: Any, file: Path, url: str, robot: HangingRobot
) -> None:
    timer = "Timer { id: closer; interval: 300; onTriggered: { console.log('closing'); close() } }"
    text = BLOCKED.replace('console.log("calling")', 'console.log("calling"); closer.start()')
    file.write_text(text.replace("    function call()", f"    {timer}\n    function call()"))
    program = start("run", file, "--url", url)
    program.until("closing", 40)
    started = time.monotonic()
    assert program.end() == 0
    assert ended_soon(program, started)


def test_a_frozen_robot_does_not_keep_it(
    start: Any, file: Path, url: str, robot: HangingRobot
) -> None:
    file.write_text(BLOCKED)
    program = start("run", file, "--url", url)
    robot.until("called")
    robot.freeze()
    started = time.monotonic()
    program.kill(signal.SIGTERM)
    assert program.end() == 143
    assert ended_soon(program, started)


@pytest.mark.parametrize("scheme", ["ros1", "zenoh"])
def test_an_address_that_accepts_and_says_nothing(start: Any, file: Path, scheme: str) -> None:
    file.write_text(
        """import QtQuick 2.15
        import Ros2 1.0
        Item {
            Component.onCompleted: { Ros2.init("ui"); console.log("asked for a node") }
            Timer { running: true; interval: 700; onTriggered: Qt.exit(5) }
        }"""
    )
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen(20)
        program = start("run", file, "--url", f"{scheme}://127.0.0.1:{silent.getsockname()[1]}")
        program.until("asked for a node", 40)
        started = time.monotonic()
        assert program.end() == 5
        assert ended_soon(program, started)


def test_qml_that_calls_again_and_again_is_ended(
    start: Any, file: Path, url: str, robot: HangingRobot
) -> None:
    file.write_text(BLOCKED.replace("const result =", "const result = false; for (;;)"))
    program = start("run", file, "--url", url)
    robot.until("called")
    started = time.monotonic()
    program.kill(signal.SIGINT)
    assert program.end() == 130
    assert ended_soon(program, started)


def test_an_interface_that_refuses_to_close_ends_on_ctrl_c(start: Any, file: Path) -> None:
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        Window {
            visible: true
            onClosing: (close) => { close.accepted = false; console.log("refused") }
            Timer { running: true; interval: 100; onTriggered: close() }
        }"""
    )
    program = start("run", file)
    program.until("refused", 40)
    program.kill(signal.SIGINT)
    assert program.end() == 130
    assert "does not react" not in program.text


def test_reloading_waits_for_a_blocked_call(start: Any, file: Path, url: str) -> None:
    answer = threading.Event()
    called = threading.Event()

    def handler(request: Any) -> Any:
        called.set()
        answer.wait(60)
        return {"success": True, "message": "at last"}

    with rosglass.connect(url, "robot") as node:
        node.create_service_server("/hang", "std_srvs/srv/Trigger", handler)
        file.write_text(BLOCKED)
        program = start("run", file, "--url", url, "--watch")
        assert called.wait(40)
        file.write_text(
            BLOCKED.replace('console.log("returned', 'console.log("new').replace(
                "interval: 100", "interval: 1000000"
            )
        )
        # Longer than it takes to notice the change.
        nothing_happens(0.5)
        assert "reloaded" not in program.text
        answer.set()
        program.until("returned", 40)
        program.until("reloaded", 40)
        program.kill(signal.SIGINT)
        assert program.end() == 130
        assert "Traceback" not in program.text


def test_ctrl_c_while_the_interface_is_being_made(
    start: Any, file: Path, url: str, robot: HangingRobot
) -> None:
    file.write_text(
        """import QtQuick 2.15
        import Ros 1.0
        Item { Component.onCompleted: {
            Ros.init("ui")
            while (Service.call("/hang", "std_srvs/Trigger", {}) === false) ;
        } }"""
    )
    program = start("run", file, "--url", url)
    robot.until("called")
    started = time.monotonic()
    program.kill(signal.SIGINT)
    assert program.end() == 130
    assert ended_soon(program, started)


def test_the_process_ends_with_the_interface(file: Path, tmp_path: Path) -> None:
    # The interpreter's own end takes seconds with Qt, OpenGL and Zenoh; all is closed before.
    (tmp_path / "sitecustomize.py").write_text(
        "import atexit\natexit.register(lambda: print('the interpreter ends'))\n"
    )
    file.write_text(
        "import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport Ros2 1.0\n"
        "Window { visible: true; Component.onCompleted: Ros2.init('ui')\n"
        "Timer { interval: 1; running: true; onTriggered: { console.log('done'); Qt.exit(7) } } }"
    )
    command = [sys.executable, "-m", "rosglass", "run", str(file), "--url", "local://end"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "QT_QPA_PLATFORM": "offscreen"}
    ended = subprocess.run(
        command, check=False, env=environment, capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 7, ended.stderr
    assert "done" in ended.stderr
    assert "the interpreter ends" not in ended.stdout
