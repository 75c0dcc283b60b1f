"""``rosglass demo`` and ``rosglass robot`` as a user starts them."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from ports import free_port
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Iterator

pytest.importorskip("PySide6.QtMultimedia", reason="the cockpit needs the extra `camera`")
pytest.importorskip("zenoh", reason="the cockpit needs the extra `zenoh`")

pytestmark = pytest.mark.xvfb
_STARTED = re.compile(r"started the robot, process (\d+)")


@pytest.fixture
def url() -> str:
    return f"zenoh://127.0.0.1:{free_port()}"


def without_display(**more: str) -> dict[str, str]:
    hidden = {"DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM", "QSG_RENDER_LOOP"}
    return {**{k: v for k, v in os.environ.items() if k not in hidden}, **more}


def start(folder: Path, *arguments: str, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "rosglass", *arguments],
        cwd=folder,
        env=without_display(PYTHONUNBUFFERED="1", **environment),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def alive(pid: int) -> bool:
    """Return whether a process runs; one that only waits to be collected does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def wait_gone(pids: list[int], timeout: float) -> None:
    eventually(lambda: not any(map(alive, pids)), timeout=timeout)


def children(pid: int) -> list[int]:
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in found]


def catches(pid: int, number: signal.Signals) -> bool:
    """Return whether a process has a handler for a signal."""
    found = re.search(r"^SigCgt:\s*(\w+)$", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return found is not None and bool(int(found[1], 16) >> (number - 1) & 1)


@pytest.fixture
def demo(tmp_path: Path, url: str) -> Iterator[tuple[subprocess.Popen[str], list[int]]]:
    """A demo that runs without display, and its children: the virtual screen and the robot."""
    process = start(tmp_path, "demo", "--url", url, "--seconds", "60")
    assert process.stdout is not None
    for line in process.stdout:
        if "connected: router" in line:
            break
    pids = children(process.pid)
    assert len(pids) == 2
    eventually(lambda: catches(process.pid, signal.SIGTERM), "its window is shown")
    yield process, pids
    process.kill()
    process.wait()


def test_without_display_it_flies_by_itself_and_says_what_it_saw(tmp_path: Path, url: str) -> None:
    process = start(tmp_path, "demo", "--url", url, "--seconds", "7")
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 0, output
    assert "no display" in output
    assert "no Zenoh router" in output
    found = _STARTED.search(output)
    assert found is not None
    assert not alive(int(found[1]))
    rates = dict(re.findall(r"^(/\S+) +\S+(?: rgb8)? +([\d.]+) ", output, re.MULTILINE))
    assert 15 < float(rates["/odom"]) < 36
    assert float(rates["/camera/image_raw"]) > 5
    assert re.search(r"median \d+\.\d ms", output)
    assert "dropped images:" in output
    driven = re.search(r"robot: ([\d.]+) m driven", output)
    assert driven is not None
    assert float(driven[1]) > 0.5
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")


def test_a_robot_that_never_comes_is_a_failure(tmp_path: Path, url: str) -> None:
    process = start(tmp_path, "demo", "--url", url, "--seconds", "3", "--no-robot")
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "no camera image and no odometry ever arrived" in output
    assert "not measured, no image" in output


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)]
)
def test_its_children_end_with_it(
    demo: tuple[subprocess.Popen[str], list[int]], number: signal.Signals, code: int
) -> None:
    process, pids = demo
    process.send_signal(number)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == code
    assert "screenshot of the cockpit" not in output
    assert ("demo.png was not written: the cockpit was ended before" in output) == (code > 0)
    wait_gone(pids, 30)


def test_a_second_demo_says_that_there_is_a_robot_already(
    demo: tuple[subprocess.Popen[str], list[int]], tmp_path: Path, url: str
) -> None:
    """It must not show, nor steer, another robot under the same name as its own."""
    import rosglass

    came: list[float] = []
    with rosglass.connect(url, "me") as me:
        me.create_subscription(
            "/odom", "nav_msgs/msg/Odometry", lambda _: came.append(time.monotonic())
        )
        # One that starts at the same time has the same right to the name.
        eventually(lambda: came and came[-1] - came[0] >= 6)
        second = start(tmp_path, "demo", "--url", url, "--seconds", "60")
        output, _ = second.communicate(timeout=60)
        assert second.returncode == 1, output
        assert "a robot called /robot is on" in output
        assert "rosglass demo --no-robot" in output
        assert "driven" not in output
        assert demo[0].poll() is None
        assert "/robot" not in me.duplicate_nodes()


def test_without_xvfb_it_says_what_to_install(tmp_path: Path, url: str) -> None:
    process = start(tmp_path, "demo", "--url", url, PATH=str(tmp_path))
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "apt install xvfb" in output


@pytest.mark.parametrize(
    ("arguments", "code", "named"),
    [
        (["--seconds", "0"], 1, "--seconds"),
        (["--screenshot", "nowhere/demo.png"], 2, "there is no folder 'nowhere'"),
        (["--url", "ros1://robot:11311"], 1, "expected dds:// or zenoh://"),
    ],
)
def test_bad_options_are_explained(
    tmp_path: Path, arguments: list[str], code: int, named: str
) -> None:
    process = start(tmp_path, "demo", *arguments)
    output, _ = process.communicate(timeout=30)
    assert process.returncode == code, output
    assert named in output
    assert "Traceback" not in output


def test_it_uses_a_router_that_is_there(tmp_path: Path) -> None:
    from rosglass.wires.zenoh.router import Router

    with Router(f"tcp/127.0.0.1:{free_port()}") as router:
        process = start(tmp_path, "demo", "--url", router.url, "--seconds", "4")
        output, _ = process.communicate(timeout=60)
    assert process.returncode == 0, output
    assert "using the Zenoh router" in output


def test_a_robot_alone_waits_for_its_router_and_ends_with_its_leash(
    tmp_path: Path, url: str
) -> None:
    from rosglass.wires.zenoh.router import Router

    process = subprocess.Popen(
        [sys.executable, "-m", "rosglass", "robot", "--url", url, "--leash", "--no-raw"],
        cwd=tmp_path,
        env=without_display(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdin is not None
    process.stdout.readline()
    assert "no answer" in process.stdout.readline()
    with Router("tcp/" + url.removeprefix("zenoh://")):
        # What it says of the address may change first.
        assert any("connected" in line for line in iter(process.stdout.readline, ""))
        process.stdin.close()
        process.stdin = None
        output, _ = process.communicate(timeout=60)
    assert process.returncode == 0, output


@pytest.mark.skipif(shutil.which("Xvfb") is None, reason="a virtual screen needs Xvfb")
def test_the_virtual_screen_ends_when_its_owner_forgets_it() -> None:
    script = (
        "import os; from rosglass.demo.processes import VirtualScreen;"
        "s = VirtualScreen(); print(s.process.pid, flush=True); s.close(); s.close()"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=30, check=True
    )
    wait_gone([int(result.stdout)], 2.0)


def test_a_copy_of_the_cockpit_runs(tmp_path: Path, url: str) -> None:
    from PySide6.QtGui import QImage

    from rosglass.demo.processes import VirtualScreen

    copied = start(tmp_path, "examples", "--all", "mine")
    output = copied.communicate(timeout=60)[0]
    assert copied.returncode == 0, output
    again = start(tmp_path, "examples", "--all", "mine")
    assert "mine exists already: name a new folder" in again.communicate(timeout=60)[0]
    assert again.returncode == 1
    shown = re.search(r"rosglass (run mine/cockpit/main\.qml) --watch", output)
    assert shown is not None, output
    with VirtualScreen(1340, 800) as screen:
        arguments = [*shown[1].split(), "--url", url, "--screenshot", "shown.png"]
        run = start(tmp_path, *arguments, DISPLAY=screen.display)
        text = run.communicate(timeout=60)[0]
    assert run.returncode == 0, text
    assert "WARNING" not in text
    image = QImage(str(tmp_path / "shown.png"))
    # Its title bar has room on a screen of 800 pixels.
    assert (image.width(), image.height()) == (1340, 752)
