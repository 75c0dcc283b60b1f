"""What holds for all tests."""

from __future__ import annotations

import os
import random
import signal
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Generator

# No test finds what robots told the developer's own programs, nor leaves anything there; the
# processes that tests start inherit this.
os.environ["ROSGLASS_TYPE_CACHE"] = "off"

#: ROS domains for tests: above 101 the ports are among those that Linux gives to anybody.
DOMAINS, DOMAIN_SHARES = 100, 4

# Whoever starts the tests in the background has Ctrl-C ignored, in everything they start as well.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def ros_domains() -> list[int]:
    """ROS domains, shuffled, that no other process of tests takes that runs beside this one."""
    share = DOMAINS // DOMAIN_SHARES
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % DOMAIN_SHARES
    return random.SystemRandom().sample(range(1 + number * share, 1 + (number + 1) * share), share)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Let processes of tests tell each other what was logged: lone surrogates cannot be sent."""
    report = yield
    report.sections = [
        (name, text.encode("utf-8", "backslashreplace").decode()) for name, text in report.sections
    ]
    return report
