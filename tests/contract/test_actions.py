"""Sending and executing goals, on every wire."""

from __future__ import annotations

import pytest

import rosglass
from rosglass.comm import GoalStatus


def count(goal):
    """Count to ``order``; a request to cancel ends it."""
    sequence = [0]
    while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.002):
        sequence.append(len(sequence))
        goal.publish_feedback(sequence=sequence)
    return {"sequence": sequence}


@pytest.fixture
def client(console, topic, wire):
    return console.create_action_client(topic, wire.count)


@pytest.fixture
def offer(robot, topic, wire, client):
    """Offer the action in the robot; returns its server, which the client has found."""

    def offer(execute=count, **options):
        server = robot.create_action_server(topic, wire.count, execute, **options)
        assert client.wait_for_server(30), client.problem
        return server

    return offer


def test_a_goal_succeeds_with_feedback_and_result(offer, client, eventually):
    offer()
    feedback, statuses = [], []
    goal = client.send_goal(
        {"order": 5},
        on_feedback=lambda message: feedback.append(len(message.sequence)),
        on_status_change=statuses.append,
    )
    status, result = goal.result(30)
    assert status is GoalStatus.SUCCEEDED
    assert list(result.sequence) == [0, 1, 2, 3, 4]
    eventually(lambda: statuses[-1:] == [GoalStatus.SUCCEEDED], lambda: statuses)
    eventually(lambda: feedback[-1:] == [5], lambda: feedback)
    assert feedback == sorted(feedback)


def test_a_goal_is_rejected(offer, client):
    offer(accept=lambda goal: goal.order < 10)
    with pytest.raises(rosglass.GoalRejectedError):
        client.send_goal({"order": 100}).result(30)
    assert client.send_goal({"order": 2}).result(30).status is GoalStatus.SUCCEEDED


def test_a_goal_is_cancelled(offer, client):
    offer()
    goal = client.send_goal({"order": 1_000_000})
    assert goal.acceptance.result(30)
    assert goal.id in goal.cancel().result(30).accepted
    assert goal.result(30).status is GoalStatus.CANCELED


def test_all_goals_are_cancelled(offer, client):
    offer()
    goals = [client.send_goal({"order": 1_000_000}) for _ in range(3)]
    assert all(goal.acceptance.result(30) for goal in goals)
    client.cancel_all().result(30)
    assert {goal.result(30).status for goal in goals} == {GoalStatus.CANCELED}


def test_a_goal_whose_execution_fails_is_aborted(offer, client, caplog):
    def fail(_):
        raise ValueError("of the user's")

    offer(fail)
    assert client.send_goal({"order": 1}).result(30).status is GoalStatus.ABORTED
    assert "of the user's" in caplog.text


def test_a_goal_waits_for_the_server(robot, client, topic, wire):
    goal = client.send_goal({"order": 3})
    robot.create_action_server(topic, wire.count, count)
    assert goal.result(30).status is GoalStatus.SUCCEEDED


def test_without_a_server_a_goal_ends_after_its_time(client, topic):
    with pytest.raises(rosglass.Error, match=topic):
        client.send_goal({"order": 1}, timeout=0.2).result(30)


def test_what_does_not_fit_is_refused_naming_the_field(offer, client):
    offer()
    with pytest.raises(rosglass.ConversionError, match="order"):
        client.send_goal({"order": "many"})


def test_closing_the_server_ends_its_goals(offer, client, eventually):
    server = offer()
    goal = client.send_goal({"order": 1_000_000})
    assert goal.acceptance.result(30)
    server.close()
    eventually(goal.done.done, lambda: goal.status)
    assert not goal.status.is_active


def test_closing_the_client_ends_its_goals(offer, client):
    offer()
    goal = client.send_goal({"order": 1_000_000})
    assert goal.acceptance.result(30)
    client.close()
    with pytest.raises(rosglass.NodeClosedError):
        goal.result(30)
    with pytest.raises(rosglass.NodeClosedError):
        client.send_goal({"order": 1})


def test_the_graph_shows_the_action(offer, console, topic, wire, eventually):
    offer()
    eventually(lambda: topic in console.actions(), console.actions)
    assert console.actions()[topic] == [wire.count]
