"""Garbage is collected in the GUI thread alone: elsewhere, it could freeze the interface."""

from __future__ import annotations

import gc
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from qt_waiting import QtWaiting

pytestmark = pytest.mark.both_qt


def test_no_other_thread_collects_while_there_is_a_session(app: Any, wait: QtWaiting) -> None:
    from rosglass.qml import Session

    collected: list[threading.Thread] = []
    ended = threading.Event()

    def note(phase: str, _: Any) -> None:
        if phase == "start":
            collected.append(threading.current_thread())

    def allocate() -> None:
        while not ended.is_set():
            cycle: list[Any] = [[] for _ in range(100)]
            cycle.append(cycle)
            time.sleep(0)

    before = gc.get_threshold()
    session = Session("local://garbage")
    gc.callbacks.append(note)
    worker = threading.Thread(target=allocate)
    worker.start()
    try:
        wait(lambda: len(collected) > 3)
    finally:
        ended.set()
        worker.join()
        gc.callbacks.remove(note)
        session.close()
    assert set(collected) == {threading.main_thread()}
    assert gc.get_threshold() == before
