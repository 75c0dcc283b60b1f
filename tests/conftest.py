"""Options and fixtures of all tests."""

from __future__ import annotations

import logging
import os
import random
import signal
import subprocess
import sys
import zlib
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import ports
import pytest
import waiting

pytest.register_assert_rewrite("overlay_contract", "view_contract")

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator

# No test uses the developer's own cache of types, nor leaves anything there; the
# processes that tests start inherit this.
os.environ["ROSGLASS_TYPE_CACHE"] = "off"
# Tests read English texts, whatever the developer speaks.
os.environ["ROSGLASS_LANGUAGE"] = "en"

#: ROS domains for tests: above 101 the ports are among those that Linux gives to anybody.
DOMAINS, DOMAIN_SHARES = 100, 8

#: Whether a test has failed.
FAILED = pytest.StashKey[bool]()

#: One case in this many of each exhaustive test runs without ``--exhaustive``.
EXHAUSTIVE_SHARE = 10

# A shell that starts the tests in the background ignores Ctrl-C, in all their processes as well.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--exhaustive", action="store_true", help="run all cases of exhaustive tests, not a tenth"
    )


@pytest.hookimpl(trylast=True)  # after -k and -m: a case that is asked for by its name runs
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("exhaustive"):
        return
    cases = defaultdict(list)
    for item in items:
        if item.get_closest_marker("exhaustive"):
            cases[item.nodeid.partition("[")[0]].append(item)
    left_out: set[pytest.Item] = set()
    for name, found in cases.items():
        # Each test begins elsewhere, so that they try different types.
        start = zlib.crc32(name.encode()) % min(EXHAUSTIVE_SHARE, len(found))
        left_out.update(set(found) - set(found[start::EXHAUSTIVE_SHARE]))
    config.hook.pytest_deselected(items=[item for item in items if item in left_out])
    items[:] = [item for item in items if item not in left_out]


@pytest.fixture(scope="session")
def ros_domains() -> list[int]:
    """ROS domains, shuffled, that no other process of tests takes that runs beside this one."""
    share = DOMAINS // DOMAIN_SHARES
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % DOMAIN_SHARES
    return random.SystemRandom().sample(range(1 + number * share, 1 + (number + 1) * share), share)


@pytest.fixture
def free_port() -> int:
    """See :func:`ports.free_port`."""
    return ports.free_port()


@pytest.fixture(scope="session")
def eventually() -> Callable[..., Any]:
    """See :func:`waiting.eventually`."""
    return waiting.eventually


@pytest.fixture(scope="session", autouse=True)
def frequent_polls() -> Iterator[None]:
    """Poll a ROS 1 master five times as often: most of its tests wait for what it shows next."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rosglass.wires.tcpros.registrations._POLL_S", 0.2)
        yield


@pytest.fixture(autouse=True)
def log_levels() -> Iterator[None]:
    """Undo what commands that a test runs in this process have done to the library's logging."""
    yield
    for name, logger in list(logging.Logger.manager.loggerDict.items()):
        if name.partition(".")[0] == "rosglass" and isinstance(logger, logging.Logger):
            logger.propagate = True
            if logger.level:
                logger.setLevel(logging.NOTSET)


@pytest.fixture
def run_command(
    capsys: pytest.CaptureFixture[str],
) -> Iterator[Callable[..., tuple[int, str, str]]]:
    """Run a command in this process, which is quicker: its code, what it printed, and where."""
    from rosglass.cli import main

    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def run(*arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        try:
            code = main(arguments)
        except SystemExit as error:
            code = int(error.code or 0)
        return code, *capsys.readouterr()

    yield run
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.fixture
def start_command_at() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a command in a process of its own, to send it Ctrl-C (SIGINT)."""
    started = []

    def start(url: str, *arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "rosglass", *arguments],
            env=os.environ | {"ROSGLASS_URL": url},
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture(scope="session")
def rclpy_python() -> Path:
    """The Python of real ROS 2 Jazzy nodes: rclpy over Fast DDS, without rosglass."""
    python = Path(__file__).parent.parent / ".venv-rclpy/bin/python"
    if not python.exists():
        pytest.skip("rclpy is not installed: scripts/setup.sh test")
    return python


@pytest.fixture
def start_rclpy_at(rclpy_python: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a program of rclpy in a ROS domain; killed after the test.

    Its standard input and output are pipes of text lines; what it logs goes to standard error.
    """
    started = []

    def start(
        domain: int, script: Path, *arguments: str, **environment: str
    ) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [str(rclpy_python), "-u", str(script), *arguments],
            env=os.environ | {"ROS_DOMAIN_ID": str(domain)} | environment,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Let xdist's workers send captured logs: lone surrogates cannot be sent."""
    report = yield
    item.stash[FAILED] = report.failed or (report.when != "setup" and item.stash[FAILED])
    report.sections = [
        (name, text.encode("utf-8", "backslashreplace").decode()) for name, text in report.sections
    ]
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> None:
    """After a failure, end the peers of the whole module: neither it nor others get broken ones."""
    if item.stash[FAILED]:
        # What lasts for the session stays: user interfaces have their screen and application there.
        item.session._setupstate.teardown_exact(item.session)
