"""Ctrl-C while a program is being started: Qt's bindings must neither swallow it nor abort."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from rosglass.qt import BINDING

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.both_qt

#: Results of an interrupted process: the exit code, or the signal that ended it.
INTERRUPTED = {130, -signal.SIGINT}
STARTS = 12
FILE = """import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0
Item {
    Component.onCompleted: Ros2.init("ui")
    Subscription { id: sub; topic: "/chatter" }
    Button { text: "Stop" }
}
"""
SCRIPT = """import sys
print("started", flush=True)
from rosglass.qml import Application
sys.exit(Application({file!r}, url="dds://?domain=97").run())
"""
#: Ctrl-C is pressed when a module is about to be imported.
IMPORT = """import os, signal, sys
class Press:
    def find_spec(self, name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Press())
from rosglass.qml import Application
print("still there")
"""
ASYNCIO = """import asyncio, os, signal
import rosglass.qml
async def main():
    os.kill(os.getpid(), signal.SIGINT)
    try:
        await asyncio.sleep(60)
    except asyncio.CancelledError:
        print("cancelled")
        raise
try:
    asyncio.run(main())
except KeyboardInterrupt:
    print("ended")
"""
#: Says when it is `rosglass` that is to answer: what comes before is Python's own, and so are the
#: few steps from there into `main`.
COMMAND = """import sys
from rosglass.cli import main
try:
    print("started", flush=True)
except KeyboardInterrupt:
    sys.exit(130)
sys.exit(main(["run", {file!r}, "--url", "dds://?domain=97"]))
"""


@pytest.mark.parametrize("program", [COMMAND, SCRIPT], ids=["command", "script"])
def test_ctrl_c_at_any_moment_of_the_start_ends_it(
    program: str, tmp_path: Path, platform: dict[str, str]
) -> None:
    file, script = tmp_path / "Main.qml", tmp_path / "program.py"
    file.write_text(FILE)
    script.write_text(program.format(file=str(file)))
    environment = os.environ | platform
    moments = random.Random(7)
    for start in range(STARTS):
        process = subprocess.Popen(
            [sys.executable, str(script)],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "started\n"
        time.sleep(moments.uniform(0, 1.2 * start / STARTS))
        process.send_signal(signal.SIGINT)
        try:
            _, said = process.communicate(timeout=30)
        finally:
            process.kill()
        assert process.returncode in INTERRUPTED, said
        assert "ImportError" not in said
        assert "Fatal" not in said
        if program is COMMAND and said.count("  File ") != 1:  # not the program's own line alone
            assert "Traceback" not in said, said


@pytest.mark.parametrize(
    "module",
    ["rosglass.qml.engine.log", "QtCore", "rosglass.qml.engine.session", "rosglass.qml.run.runner"],
)
def test_ctrl_c_while_modules_are_imported_ends_the_script_afterwards(
    module: str, platform: dict[str, str]
) -> None:
    module = f"{BINDING}.QtCore" if module == "QtCore" else module
    done = run(IMPORT.format(module=module), platform)
    assert done.returncode == 130, done.stderr
    assert done.stdout == ""
    assert done.stderr == ""


@pytest.mark.skipif(sys.version_info < (3, 11), reason="asyncio answers Ctrl-C from 3.11 on")
def test_asyncio_answers_ctrl_c_after_the_import(platform: dict[str, str]) -> None:
    done = run(ASYNCIO, platform)
    assert done.stdout.split() == ["cancelled", "ended"], done.stderr


def run(program: str, platform: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | platform,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
