"""Executors that a test steers."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm import Executor

if TYPE_CHECKING:
    from collections.abc import Callable


class Manual(Executor):
    """Runs jobs on request.

    Attributes:
        jobs: Those that have not run.
    """

    def __init__(self) -> None:
        self.jobs: list[Callable[[], object]] = []

    def post(self, job: Callable[[], object]) -> None:
        self.jobs.append(job)

    def run(self) -> None:
        """Run the jobs that wait, but not those that they add."""
        jobs, self.jobs = self.jobs, []
        for job in jobs:
            job()


class Failing(Executor):
    """Runs each job on a thread of its own, or raises as a pool does that was shut down."""

    failing = False

    def post(self, job: Callable[[], object]) -> None:
        if self.failing:
            raise RuntimeError("cannot schedule new futures after shutdown")
        threading.Thread(target=job, daemon=True).start()
