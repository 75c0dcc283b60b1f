"""The end of a process that does not end by itself."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.qml.engine.process import QuitOnSignal

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.both_qt

PROGRAM = """
import threading, time
from rosglass.qml.engine.process import end_process_within

def fail(_):
    raise OSError(22, "Invalid argument")  # as under libfaketime, when a clock is set

time.sleep = fail
end_process_within(0.1, 7)
threading.Event().wait(60)
"""

SCRIPT = """
import os, signal
received = []
signal.signal(signal.SIGTERM, lambda number, _: received.append(number))
from rosglass.qml import Application
from rosglass.qt import QtCore, Slot

class Robot(QtCore.QObject):
    @Slot()
    def end(self):
        os.kill(os.getpid(), signal.SIGTERM)

with Application({file!r}, url="dds://?domain=97", context={{"robot": Robot()}}) as app:
    app.load()
    print("received", received)
"""


def test_the_process_ends_even_where_sleeping_fails() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], timeout=120, check=False)
    assert done.returncode == 7


def test_a_handler_of_the_script_is_called_while_its_window_is_made(
    tmp_path: Path, platform: dict[str, str]
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text("import QtQuick 2.15\nItem { Component.onCompleted: robot.end() }\n")
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(file=str(file))],
        env=os.environ | platform,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert f"received [{signal.SIGTERM:d}]" in done.stdout


@pytest.fixture
def before() -> Any:
    """Put pytest's own handlers back."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("before")
def test_a_handler_that_was_installed_from_c_is_followed_by_pythons(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    install = signal.signal

    def as_after_c(number: int, handler: Any) -> None:
        install(number, handler)

    with monkeypatch.context() as patch:
        # What Python answers where a program in C embeds it.
        patch.setattr(signal, "signal", as_after_c)
        with QuitOnSignal(lambda _: None):
            pass
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


@pytest.mark.usefixtures("before")
def test_handlers_are_kept_that_are_the_programs_own() -> None:
    own = lambda *_: None  # noqa: E731
    signal.signal(signal.SIGTERM, own)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with QuitOnSignal(lambda _: None, keep_handlers=True):
        assert signal.getsignal(signal.SIGTERM) is own
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    received: list[int] = []
    with (
        QuitOnSignal(lambda _: None),
        QuitOnSignal(received.append, 60, keep_handlers=True),
    ):
        os.kill(os.getpid(), signal.SIGTERM)
    assert received == [signal.SIGTERM]


@pytest.mark.usefixtures("before")
def test_a_lost_terminal_ends_the_program_unless_that_is_ignored() -> None:
    """As under nohup."""
    received: list[int] = []
    found = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with QuitOnSignal(received.append, 60):
            os.kill(os.getpid(), signal.SIGHUP)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
        assert not received
        with QuitOnSignal(received.append, 60):
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, found)
    assert received == [signal.SIGHUP]


def test_signals_of_others_reach_whom_python_wakes() -> None:
    """As asyncio, which has taken the wakeup file before."""
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    reader.settimeout(60)
    handler = signal.signal(signal.SIGUSR1, lambda *_: None)
    found = signal.set_wakeup_fd(writer.fileno())
    try:
        with QuitOnSignal(lambda _: None):
            os.kill(os.getpid(), signal.SIGUSR1)
            assert reader.recv(1) == bytes([signal.SIGUSR1])
    finally:
        signal.set_wakeup_fd(found)
        signal.signal(signal.SIGUSR1, handler)
        reader.close()
        writer.close()
