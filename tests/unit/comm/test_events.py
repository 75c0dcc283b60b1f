from __future__ import annotations

import sys

import pytest
from receiving import set_problem

from rosglass import ConversionError, QoS
from rosglass.comm import (
    IMMEDIATE,
    EndpointInfo,
    EndpointKind,
    Matched,
    NodeName,
    Subscription,
)
from rosglass.comm.events import EndpointListeners


def endpoint(node, gid=b""):
    return EndpointInfo(EndpointKind.PUBLISHER, "/t", "p/msg/T", NodeName("/", node), gid=gid)


A, B = endpoint("a"), endpoint("b")


def events_of(appearances):
    events = []
    handle = appearances.add(
        lambda e: events.append((e.endpoint.node.name, e.change, e.count, e.total)), IMMEDIATE
    )
    return events, handle


def test_listener_is_notified_of_each_change_with_counts():
    appearances = EndpointListeners()
    events, _ = events_of(appearances)
    for now in ([A], [A, B], [B], [B, A], []):
        appearances.update(now, Matched)
    assert events == [
        ("a", 1, 1, 1),
        ("b", 1, 2, 2),
        ("a", -1, 1, 2),
        ("a", 1, 2, 3),
        ("b", -1, 1, 3),
        ("a", -1, 0, 3),
    ]


def test_changes_between_two_updates_are_notified():
    appearances = EndpointListeners()
    events, _ = events_of(appearances)
    known = endpoint("known", b"k")
    appearances.update([known], Matched, [A])
    appearances.update([B], Matched, [A, known, A, B])
    assert events == [
        ("known", 1, 1, 1),
        ("a", 1, 2, 2),
        ("a", -1, 1, 2),
        ("b", 1, 2, 3),
        ("a", 1, 3, 4),
        ("a", -1, 2, 4),
        ("known", -1, 1, 4),
    ]


def test_new_listener_is_notified_of_present_endpoints_once():
    appearances = EndpointListeners()
    first, _ = events_of(appearances)
    appearances.update([A], Matched)
    second, _ = events_of(appearances)
    for _ in range(2):
        appearances.update([A], Matched)
    assert first == second == [("a", 1, 1, 1)]


def test_twins_are_counted():
    appearances = EndpointListeners()
    events, _ = events_of(appearances)
    appearances.update([A, A], Matched)
    appearances.update([A], Matched)
    assert [event[2] for event in events] == [1, 2, 1]


def test_closing_ends_it_and_frees_it():
    appearances, known = EndpointListeners(), endpoint("c")
    references = sys.getrefcount(known)
    events, handle = events_of(appearances)
    assert appearances
    appearances.update([known], Matched)
    handle.close()
    appearances.update([A], Matched)
    assert events == [("c", 1, 1, 1)]
    assert not appearances
    assert sys.getrefcount(known) == references


def test_ignored_events_are_counted_but_not_notified():
    appearances = EndpointListeners()
    events, _ = events_of(appearances)
    appearances.update([A], Matched)
    appearances.update([], lambda *_: None)
    appearances.update([B], Matched)
    assert events == [("a", 1, 1, 1), ("b", 1, 1, 2)]


def test_problem_is_notified_when_it_changes():
    seen = []
    sub = Subscription("/t", None, QoS(), IMMEDIATE)
    sub.on_problem_change(seen.append)
    for problem in ("one", "one", "two", "", ""):
        set_problem(sub, problem)
    sub.close()
    set_problem(sub, "three")
    assert seen == ["one", "two", ""]


@pytest.mark.parametrize(
    "name",
    [
        "on_matched",
        "on_incompatible_qos",
        "on_deadline_missed",
        "on_liveliness_change",
        "on_samples_lost",
        "on_problem_change",
    ],
)
def test_listeners_are_checked(name):
    register = getattr(Subscription("/t", None, QoS(), IMMEDIATE), name)
    with pytest.raises(ConversionError, match="callback: expected something that can be called"):
        register(3)
    with pytest.raises(ConversionError, match=r"executor: expected a rosglass\.comm\.Executor"):
        register(print, 3)
