"""Fixtures for tests with real ROS 1 peers: rosmaster, rospy, roscpp and the commands."""

from __future__ import annotations

import itertools
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from rosmaster import RosMaster
from waiting import eventually

import rosglass

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node

PEERS = Path(__file__).parent / "peers"
#: Debian's own interpreter: rospy is installed there, not in our environment.
PYTHON = "/usr/bin/python3"
INSTALL = (
    "ROS 1 is not installed: sudo apt-get install python3-rosmaster python3-rospy "
    "python3-actionlib python3-rosnode python3-rosparam python3-rosservice python3-rostopic "
    "python3-rosbag"
)
INSTALL_CPP = (
    "roscpp is not installed: sudo apt-get install g++ pkg-config libroscpp-dev libactionlib-dev"
)


def needs(*programs: str) -> None:
    """Skip the test unless all of these programs are in Debian's place."""
    missing = [name for name in programs if not Path("/usr/bin", name).exists()]
    if missing:
        pytest.skip(f"{INSTALL} (missing: {', '.join(missing)})")


class Peer:
    """A peer process that obeys requests, each answered by its number; see peers/README.md."""

    def __init__(self, process: Any) -> None:
        self.process, self.pid = process, process.pid
        self._numbers = itertools.count(1)

    def start(self, do: str, **plan: Any) -> int:
        """Send a request without waiting; return its number, for :meth:`answer`."""
        number = next(self._numbers)
        self.process.ask(do=do, number=number, **plan)
        return number

    def answer(self, number: int, timeout: float = 30.0) -> Any:
        """Return what a request led to; fail the test if it failed there."""
        found = self.process.event(f"answer {number}", timeout)
        if "error" in found:
            pytest.fail(f"the peer failed:\n{found['error']}")
        return found.get("value")

    def call(self, do: str, timeout: float = 30.0, **plan: Any) -> Any:
        """Send a request and return what it led to."""
        return self.answer(self.start(do, **plan), timeout)

    def event(self, key: str, timeout: float = 30.0, **otherwise: Any) -> Any:
        """Return the value of the peer's next event of this name."""
        return self.process.event(key, timeout, **otherwise)

    def end(self) -> None:
        """Kill it, without a goodbye to the master or other nodes."""
        self.process.end()


@pytest.fixture(scope="module")
def start_master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], RosMaster]]:
    """Start a master of the test's own; killed when the module's tests are done."""
    with ExitStack() as running:
        yield lambda: running.enter_context(RosMaster(tmp_path_factory.mktemp("ros_home")))


@pytest.fixture(scope="module")
def master(start_master: Callable[[], RosMaster]) -> RosMaster:
    """The module's master; a test that restarts it should rather use ``start_master``."""
    return start_master()


@pytest.fixture
def connect(request: pytest.FixtureRequest) -> Iterator[Callable[..., Node]]:
    """Connect to the module's master, or to another ``url``; nodes are closed at the end."""
    nodes: list[Node] = []

    def connect(
        name: str, namespace: str = "/", *, url: str = "", wait: bool = True, **more: Any
    ) -> Node:
        node = rosglass.connect(
            url or request.getfixturevalue("master").url, name, namespace, **more
        )
        nodes.append(node)
        if wait:
            eventually(lambda: node.status().state.value == "connected", node.status)
        return node

    yield connect
    for node in nodes:
        node.close()


@pytest.fixture(scope="module")
def start_rospy(
    start_program: Callable[..., Any], request: pytest.FixtureRequest
) -> Callable[..., Peer]:
    """Start a rospy peer: ``start_rospy(name, *arguments, master=..., env=...)``."""
    needs("rosmaster")
    if not Path("/usr/lib/python3/dist-packages/rospy").is_dir():
        pytest.skip(INSTALL)

    def start_rospy(
        name: str = "rospy_peer",
        *arguments: str,
        master: RosMaster | None = None,
        env: dict[str, str] | None = None,
    ) -> Peer:
        home = master or request.getfixturevalue("master")
        command = (PYTHON, str(PEERS / "rospy_peer.py"), name, *arguments)
        peer = Peer(start_program(*command, env=home.env(**(env or {}))))
        peer.event("ready")
        return peer

    return start_rospy


@pytest.fixture(scope="module")
def rospy_peer(start_rospy: Callable[..., Peer]) -> Peer:
    """The module's rospy node ``/rospy_peer``."""
    return start_rospy()


@pytest.fixture(scope="session")
def roscpp_program(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Build the roscpp peer of all peers/roscpp_*.cpp; what was built before is kept."""
    tools = all(map(shutil.which, ("g++", "pkg-config")))
    if not tools or not Path("/usr/include/ros/ros.h").exists():
        pytest.skip(INSTALL_CPP)
    cache = getattr(request.config, "cache", None)  # -p no:cacheprovider leaves none
    folder = tmp_path_factory.mktemp("roscpp") if cache is None else cache.mkdir("roscpp")
    command = [sys.executable, str(PEERS / "build_roscpp.py"), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return Path(done.stdout.strip())


@pytest.fixture(scope="module")
def start_roscpp(
    start_program: Callable[..., Any], roscpp_program: Path, request: pytest.FixtureRequest
) -> Callable[..., Peer]:
    """Start a roscpp peer: ``start_roscpp(name, *arguments, master=..., env=...)``."""

    def start_roscpp(
        name: str = "roscpp_peer",
        *arguments: str,
        master: RosMaster | None = None,
        env: dict[str, str] | None = None,
    ) -> Peer:
        home = master or request.getfixturevalue("master")
        command = (str(roscpp_program), name, *arguments)
        peer = Peer(start_program(*command, env=home.env(**(env or {}))))
        peer.event("ready")
        return peer

    return start_roscpp


@pytest.fixture(scope="module")
def roscpp_peer(start_roscpp: Callable[..., Peer]) -> Peer:
    """The module's roscpp node ``/roscpp_peer``."""
    return start_roscpp()


@pytest.fixture
def tool(master: RosMaster) -> Callable[..., str]:
    """Run a ROS 1 command such as ``tool("rostopic", "list")``; return what it prints."""

    def tool(*command: str, timeout: float = 30.0, status: int | None = 0, stdin: str = "") -> str:
        needs(command[0])
        done = subprocess.run(
            command,
            env=master.env(),
            input=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=timeout,
            check=False,
        )
        assert status is None or done.returncode == status, f"{command}:\n{done.stdout}"
        return done.stdout

    return tool


@pytest.fixture
def start_tool(
    master: RosMaster, start_program: Callable[..., Any]
) -> Iterator[Callable[..., Any]]:
    """Start a ROS 1 command that runs until the test ends; its lines are in ``.output``."""
    started: list[Any] = []

    def start_tool(*command: str) -> Any:
        needs(command[0])
        process = start_program(*command, env=master.env())
        started.append(process)
        return process

    yield start_tool
    for process in started:
        # rosbag hands this on to the program that it started; it would outlive being killed.
        process.popen.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.popen.wait(30)
        process.end()
