"""Actions through a bridge: rospy's actionlib on one side, ROS 2 on the other, both ways."""

from __future__ import annotations

import contextlib
import itertools
import threading

import pytest
from waiting import eventually

import rosglass
from rosglass.bridge import survey
from rosglass.comm import GoalStatus
from rosglass.messages import ActionTranslation, default_library, load

numbers = itertools.count()


@pytest.fixture
def served(bridge, rospy_peer):
    """An action of rospy, in ROS 2; goals of 0 are rejected, of -1 aborted, of -2 not decided."""
    rospy_peer.call("action_server", name="/count")
    made = bridge(actions=["/count"])
    rospy_peer.call("wait_for_client", name="/count")
    yield made
    rospy_peer.call("stop_action_server", name="/count")


def test_an_action_of_ros1(served, connect):
    client = connect("ros2", "client").create_action_client("/count")
    assert client.wait_for_server(30)
    assert client.type.name == "actionlib/action/Test"
    heard, states = [], []
    goal = client.send_goal(
        {"goal": 5}, on_feedback=lambda feedback: heard.append(feedback.feedback),
        on_status_change=states.append,
    )  # fmt: skip
    status, result = goal.result(30)
    assert (status, result.result) == (GoalStatus.SUCCEEDED, 5)
    eventually(lambda: heard == [0, 1, 2, 3, 4], what=lambda: str(heard))
    assert GoalStatus.EXECUTING in states
    status, result = client.send_goal({"goal": -1}).result(30)
    assert (status, result.result) == (GoalStatus.ABORTED, -1)
    with pytest.raises(rosglass.GoalRejectedError):
        client.send_goal({"goal": 0}).result(30)
    first = threading.Event()
    goal = client.send_goal(
        {"goal": 10_000}, on_feedback=lambda feedback: feedback.feedback > 0 and first.set()
    )
    assert first.wait(30)
    assert goal.cancel(30).result(30).accepted == (goal.id,)
    status, result = goal.result(30)
    assert status is GoalStatus.CANCELED
    assert result.result > 0
    (relay,) = served.status().relays
    assert (relay.kind, relay.count, relay.refused) == ("action", 3, 1)


def test_slow_server_does_not_block_other_goals(served, connect):
    client = connect("ros2", "client").create_action_client("/count")
    slow = client.send_goal({"goal": -2}, timeout=30)
    quick = client.send_goal({"goal": 3}, timeout=30)
    assert quick.result(30).result.result == 3
    assert slow.status.is_active
    slow.cancel(30)
    assert slow.result(30).status is GoalStatus.CANCELED


def test_goals_are_cancelled_when_the_bridge_ends(served, connect, rospy_peer):
    client = connect("ros2", "client").create_action_client("/count")
    first = threading.Event()
    goal = client.send_goal({"goal": 10_000}, on_feedback=lambda _: first.set(), timeout=30)
    assert first.wait(30)
    watcher = connect("ros1", "watcher").create_subscription("/count/result")
    eventually(watcher.publisher_count)
    served.close()
    assert watcher.wait(30).message().status.text == "stopped"
    with contextlib.suppress(rosglass.ConnectionLostError):  # it left before it was asked
        assert goal.result(30).status is GoalStatus.ABORTED


@pytest.fixture
def offered(bridge, connect, rospy_peer):
    """An action of ROS 2, in ROS 1; the same goals are rejected and aborted."""
    name = f"/work_{next(numbers)}"

    def execute(goal):
        wanted = goal.goal.goal
        if wanted == -1:
            return goal.abort({"result": -1})
        for number in range(wanted):
            goal.publish_feedback(feedback=number)
            if goal.wait_for_cancel(0.02):
                return goal.canceled({"result": number})
        return goal.succeed({"result": wanted})

    kind = ActionTranslation(load("actionlib/Test", 1)).type
    default_library().add_version(kind.definition)  # as a robot knows its own types
    connect("ros2", "server", described=True).create_action_server(
        name, kind, execute, accept=lambda goal: goal.goal != 0
    )
    bridge(actions=[f"{name}<-"])
    assert rospy_peer.call("wait_for_server", name=name)
    return name


def ended(peer, key):
    """Return how a goal of the peer ends."""
    while True:
        state = peer.event(f"state {key}")
        if state["state"] == "DONE":
            return state["terminal"], state["result"]


@pytest.mark.parametrize(
    ("wanted", "end"), [(5, ("SUCCEEDED", 5)), (-1, ("ABORTED", -1)), (0, ("REJECTED", 0))]
)
def test_an_action_of_ros2(offered, rospy_peer, wanted, end):
    key = f"{offered}{wanted}"
    rospy_peer.call("send_goal", name=offered, goal=wanted, key=key)
    for number in range(wanted):
        assert rospy_peer.event(f"feedback {key}") == number
    assert ended(rospy_peer, key) == end


def test_an_action_of_ros2_is_cancelled(offered, rospy_peer):
    rospy_peer.call("send_goal", name=offered, goal=10_000, key="long")
    rospy_peer.event("feedback long")
    rospy_peer.call("cancel_goal", key="long")
    terminal, result = ended(rospy_peer, "long")
    assert terminal == "PREEMPTED"
    assert result < 10_000


def test_all_takes_actions_as_such(bridge, connect, rospy_peer):
    """Their topics in ROS 1 are not relayed as well, and others of such names are."""
    rospy_peer.call("action_server", name="/both")
    connect("ros1", "talker").create_publisher("/other/status", "std_msgs/String")
    made = bridge(["*"], ["*"], ["*"])
    eventually(lambda: {"/both", "/other/status"} <= {one.name for one in made.status().relays})
    names = [one.name for one in made.status().relays]
    assert not [name for name in names if name.startswith("/both/")]
    eventually(lambda: ", 1 action: " in made.status().line())
    rospy_peer.call("stop_action_server", name="/both")
    eventually(lambda: "/both" not in [one.name for one in made.status().relays])


def test_survey_shows_actions(connect, rospy_peer):
    rospy_peer.call("action_server", name="/seen")
    one, two = connect("ros1", "survey_one"), connect("ros2", "survey_two")
    eventually(lambda: "/seen" in one.actions())
    (found,) = survey(one, two, [], [], ["/seen"])
    assert (found.kind, found.type, found.direction) == ("action", "actionlib/action/Test", "->")
    assert found.notes == ("ROS 2 has no such type",)
    rospy_peer.call("stop_action_server", name="/seen")
