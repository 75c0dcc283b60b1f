"""The camera's topics and services, and what RViz says, when the ROS master is started anew."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from rosmaster import RosMaster
from view_contract import use_through_restarts

from rosglass.errors import ConnectionLostError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def own_master(tmp_path: Path) -> Iterator[RosMaster]:
    with RosMaster(tmp_path / "ros") as master:
        yield master


@pytest.fixture
def rviz(screen: str, own_master: RosMaster, tmp_path: Path) -> Iterator[Any]:
    home = tmp_path / "home"
    home.mkdir(mode=0o700)
    env = {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "DISPLAY": screen,
        "ROS_IP": "127.0.0.1",
    }
    command = [sys.executable, "-m", "rosglass.cli", "rviz", "--name", "rviz"]
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            [*command, "--url", f"ros1://127.0.0.1:{own_master.port}"],
            env=env,
            stdout=log,
            stderr=log,
        )
    yield process
    process.kill()
    process.wait()


def test_the_services_come_back_without_a_restart(rviz: Any, own_master: RosMaster) -> None:
    use_through_restarts(own_master, "/rviz/hector_view_controller")
    assert rviz.poll() is None


def test_rviz_says_what_to_do(app: Any, wait: Any) -> None:
    from rosglass.rviz.qt5 import QtWidgets

    watch = app.master
    wait(lambda: watch.pid != -1)
    usual = watch.pid
    watch.on_answer(ConnectionLostError("http://robot:11311 does not answer"))
    shown = app.window.widget.statusBar().findChild(QtWidgets.QLabel, "masterProblem")
    assert shown.text() == watch.advice
    assert "restart roscore and RViz" in watch.advice
    assert "does not answer" in shown.toolTip()
    watch.on_answer(usual + 1)
    assert "restart RViz" in shown.text()
    assert shown.isVisible()
    watch.on_answer(usual)
    assert watch.advice == ""
    assert not shown.isVisible()
