"""Commands that the router does not confirm: held, replaced, dropped, and counted."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
import zenoh

from rosglass.wires.zenoh import command_window
from rosglass.wires.zenoh.command_window import CommandWindow


class Rig:
    """A window with a clock, a router that answers on demand, and timers that run on demand."""

    def __init__(self, monkeypatch):
        self.now, self.answered, self.linked = 100.0, True, True
        self.sent, self.jobs, self.queries = [], [], 0
        self.deliver = self.sent.append
        monkeypatch.setattr(command_window, "time", SimpleNamespace(monotonic=lambda: self.now))
        timers = SimpleNamespace(after=lambda _, job: self.jobs.append(job))
        self.window = CommandWindow(
            timers, 0.3, self._query, lambda data, _: self.deliver(data), lambda: self.linked
        )

    def _query(self, _):
        self.queries += 1
        return self

    def try_recv(self):
        if self.answered:
            raise zenoh.ZError("the end of the answer")

    def send(self, name, after=0.05):
        self.now += after
        self.window.send(name, b"")

    def pass_time(self, seconds):
        self.now += seconds
        jobs, self.jobs = self.jobs, []
        for job in jobs:
            job()


@pytest.fixture
def rig(monkeypatch):
    return Rig(monkeypatch)


def test_commands_flow_while_the_router_answers(rig):
    for name in "abc":
        rig.send(name)
    assert rig.sent == ["a", "b", "c"]
    assert rig.queries == 3, "each is confirmed"
    assert (rig.window.lost, rig.window.problem) == (0, "")


def test_stalled_router_gets_only_the_newest_command_afterwards(rig):
    rig.answered = False
    for name in "abcdef":
        rig.send(name)
    assert rig.sent == ["a", "b", "c"], "0.1 s of them, which the router may have"
    assert rig.queries == 1
    assert rig.window.lost == 2
    assert "does not confirm" in rig.window.problem
    rig.answered = True
    rig.pass_time(0.01)
    assert rig.sent == ["a", "b", "c", "f"], "as soon as it answers"


def test_command_that_waits_too_long_is_dropped(rig):
    rig.answered = False
    rig.send("a")
    rig.send("b", after=0.2)
    for _ in range(4):
        rig.pass_time(0.1)
    rig.answered = True
    rig.pass_time(5)
    assert rig.sent == ["a"]
    assert rig.window.lost == 1
    assert not rig.jobs, "nothing is polled for"
    rig.send("c")
    assert rig.sent == ["a", "c"]


def test_slow_link_that_answers_is_not_stalled(rig):
    for number in range(200):  # camera images lie before each answer: 0.5 s
        rig.answered = number % 10 == 0
        rig.send(str(number))
    lost = rig.window.lost
    assert 0 < lost < 20, "until that is known"
    assert rig.sent[-100:] == [str(number) for number in range(100, 200)]
    rig.answered = False
    rig.send("drive")
    rig.send("stop", after=0.3)
    assert rig.sent[-1] == "stop", "it does not wait for the answer"
    rig.send("late", after=0.7)
    assert rig.sent[-1] == "stop"


def test_pause_does_not_count_as_round_trip(rig):
    for number in range(5):
        rig.send(str(number), after=0.9)
    rig.answered = False
    for name in "abcd":
        rig.send(name)
    assert rig.sent[-1] == "b", "0.1 s"


def test_outage_does_not_count_as_round_trip(rig):
    rig.answered = False
    rig.send("a")
    rig.pass_time(8.0)
    rig.answered = True
    rig.send("b")
    rig.answered = False
    rig.send("c")
    rig.send("d", after=0.2)
    assert rig.sent == ["a", "b", "c"], "0.1 s as before, not 16 s"


@pytest.mark.parametrize("end", [lambda rig: rig.window.close(), lambda rig: rig.pass_time(0.01)])
def test_command_that_waits_when_the_session_closes_is_counted(rig, end):
    def fail(*_):
        raise zenoh.ZError("the session is closed")

    rig.answered = False
    rig.send("a")
    rig.send("stop", after=0.2)
    assert rig.sent == ["a"]
    rig.answered, rig.deliver = True, fail
    end(rig)
    assert (rig.sent, rig.window.lost) == (["a"], 1)


def test_without_a_link_commands_are_dropped_and_counted(rig):
    rig.linked = False
    rig.send("a")
    assert (rig.sent, rig.window.lost) == ([], 1)
    assert rig.window.problem
    rig.linked = True
    rig.send("b")
    assert rig.sent == ["b"]
    rig.pass_time(11)
    assert rig.window.problem == ""


def test_closing_sends_what_waits(rig):
    rig.answered = False
    rig.send("drive")
    rig.send("stop", after=0.2)
    rig.window.close()
    rig.window.close()
    assert rig.sent == ["drive", "stop"]


def test_outage_is_noticed_in_a_second_however_long_answers_took(rig):
    """The last zeros of a stop are repeated for a second only."""
    rig.answered = False
    rig.send("a")
    for _ in range(9):
        rig.send("b", after=0.1)
    rig.answered = True
    rig.pass_time(0.01)
    rig.send("c")
    rig.answered = False
    lost = rig.window.lost
    for _ in range(10):
        rig.send("d", after=0.1)
    assert rig.window.lost > lost
