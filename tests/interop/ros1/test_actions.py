"""Actions both ways with actionlib's own clients and servers, in Python and C++."""

from __future__ import annotations

import itertools
import os
import signal

import pytest
from waiting import eventually

import rosglass
from rosglass.comm import GoalStatus, Time
from rosglass.errors import ConnectionLostError, GoalRejectedError, NodeClosedError
from rosglass.interfaces import Distributions, Library
from rosglass.ros1.actionlib import CommState, TerminalState

TYPE = "actionlib/TestAction"
BOTH = pytest.mark.parametrize("which", ["rospy", "roscpp"])
numbers = itertools.count()


@pytest.fixture
def peer(which, request):
    """The peer whose side of actionlib is spoken to."""
    return request.getfixturevalue(f"{which}_peer")


@pytest.fixture
def name():
    """Return the name of an action of the test's own."""
    return f"/action_{next(numbers)}"


@pytest.fixture
def client(which, peer, name, connect):
    """Return our client of the peer's server."""
    peer.call("action_server", name=name)
    made = connect("us").create_action_client(name, TYPE)
    assert made.wait_for_server(30), made.problem
    if which == "rospy":
        # It accepts a connection a moment before it publishes to it.
        peer.call("wait_for_client", name=name)
    return made


def work(goal):
    """Do what the peers' servers do."""
    wanted = goal.goal.goal
    if wanted == -1:
        goal.abort({"result": -1}, "unlucky")
        return
    for done in range(wanted):
        goal.publish_feedback(feedback=done)
        if goal.wait_for_cancel(0.02):
            goal.canceled({"result": done}, "stopped")
            return
    goal.succeed({"result": wanted}, "finished")
    return


@pytest.fixture
def server(peer, name, connect):
    """Return our server, whose clients are the peer's."""
    made = connect("us").create_action_server(name, TYPE, work, accept=lambda goal: goal.goal != 0)
    assert peer.call("wait_for_server", name=name) is True
    return made


def ended(peer, key):
    """Return the states that a peer's goal goes through, and how it ends."""
    states = []
    while True:
        report = peer.event(f"state {key}")
        states.append(report.pop("state"))
        if states[-1] == "DONE":
            return states, report


# -- our client ------------------------------------------------------------------------------------


@BOTH
def test_a_goal_succeeds(client, which):
    feedback, states, statuses = [], [], []
    goal = client.send_goal(
        {"goal": 5},
        on_feedback=lambda message: feedback.append(message.feedback),
        on_comm_state_change=states.append,
        on_status_change=statuses.append,
    )
    status, result = goal.result(30)
    assert (status, result.result) == (GoalStatus.SUCCEEDED, 5)
    assert (goal.comm_state, goal.terminal_state) == (CommState.DONE, TerminalState.SUCCEEDED)
    assert goal.text == "finished"
    assert goal.acceptance.result(30) is True
    assert goal.accepted == goal.stamp
    assert goal.server == f"/{which}_peer"
    assert goal.id_text.startswith("/us-")
    eventually(lambda: CommState.DONE in states)
    rest = [state for state in states if state is not CommState.PENDING]
    assert rest == [CommState.ACTIVE, CommState.WAITING_FOR_RESULT, CommState.DONE]
    assert statuses == [GoalStatus.EXECUTING, GoalStatus.SUCCEEDED]
    assert feedback == [0, 1, 2, 3, 4]


@BOTH
def test_a_goal_is_aborted_with_a_text(client):
    goal = client.send_goal({"goal": -1})
    status, result = goal.result(30)
    assert (status, result.result) == (GoalStatus.ABORTED, -1)
    assert (goal.terminal_state, goal.text) == (TerminalState.ABORTED, "unlucky")


@BOTH
def test_a_goal_is_rejected_with_a_text(client):
    goal = client.send_goal({"goal": 0})
    with pytest.raises(GoalRejectedError, match="not zero"):
        goal.result(30)
    assert goal.acceptance.result(1) is False
    assert (goal.status, goal.terminal_state) == (GoalStatus.REJECTED, TerminalState.REJECTED)


@BOTH
def test_a_goal_is_preempted(client):
    states = []
    goal = client.send_goal({"goal": 1000}, on_comm_state_change=states.append)
    eventually(lambda: goal.feedback is not None)
    assert goal.cancel().result(30).accepted == (goal.id,)
    status, result = goal.result(30)
    assert status is GoalStatus.CANCELED
    assert 0 <= result.result < 1000
    assert (goal.terminal_state, goal.text) == (TerminalState.PREEMPTED, "stopped")
    eventually(lambda: CommState.DONE in states)
    assert states[-4:] == [
        CommState.WAITING_FOR_CANCEL_ACK,
        CommState.PREEMPTING,
        CommState.WAITING_FOR_RESULT,
        CommState.DONE,
    ]


@BOTH
def test_a_goal_is_recalled(client):
    goal = client.send_goal({"goal": -2})
    eventually(lambda: goal.comm_state is CommState.PENDING)
    assert goal.accepted is None
    assert goal.cancel().result(30).accepted == (goal.id,)
    status, result = goal.result(30)
    assert (status, result.result) == (GoalStatus.CANCELED, -1)
    assert (goal.terminal_state, goal.text) == (TerminalState.RECALLED, "recalled")
    assert goal.acceptance.result(1) is False


@BOTH
def test_goals_are_cancelled_until_a_time_and_all(client):
    goals = [client.send_goal({"goal": 1000 + number}) for number in range(4)]
    eventually(lambda: all(goal.status is GoalStatus.EXECUTING for goal in goals))
    first = client.cancel_before(goals[1].stamp).result(30)
    assert set(first.accepted) == {goals[0].id, goals[1].id}
    for goal in goals[:2]:
        assert goal.result(30).status is GoalStatus.CANCELED
    assert all(goal.status is GoalStatus.EXECUTING for goal in goals[2:])
    assert set(client.cancel_all().result(30).accepted) == {goals[2].id, goals[3].id}
    for goal in goals[2:]:
        assert goal.result(30).status is GoalStatus.CANCELED
    assert client.cancel_all().result(30) == ((), "there was no goal to cancel")
    assert not client.goals


@BOTH
def test_a_goal_that_is_resent_is_executed_once(client):
    feedback = []
    goal = client.send_goal({"goal": 20}, on_feedback=lambda each: feedback.append(each.feedback))
    eventually(lambda: feedback)
    goal.resend()
    assert goal.result(30).result.result == 20
    eventually(lambda: feedback == list(range(20)))
    with pytest.raises(rosglass.Error, match="send a new goal"):
        goal.resend()


@BOTH
def test_the_type_is_learned_from_the_server(peer, name, connect):
    client = connect("us").create_action_client(name)
    goal = client.send_goal({"goal": 2})
    assert (client.type, goal.goal) == (None, None)
    peer.call("action_server", name=name)
    assert goal.result(30).result.result == 2
    assert client.type.name == "actionlib/action/Test"
    assert goal.goal.goal == 2


class WithoutActionlib(Distributions):
    """The standard definitions of a machine that does not have the package actionlib."""

    def find(self, name, ros):
        return () if name.startswith("actionlib/") else super().find(name, ros)


def test_a_type_that_is_not_known_here_is_learned_from_a_server_in_python(
    rospy_peer, name, connect
):
    client = connect("us", library=Library(WithoutActionlib())).create_action_client(name)
    rospy_peer.call("action_server", name=name)
    goal = client.send_goal({"goal": 3})
    assert goal.result(30).result.result == 3, client.problem
    assert client.type.name == "actionlib/action/Test"


def test_a_type_that_is_not_known_here_is_learned_from_other_clients(roscpp_peer, name, connect):
    client = connect("us", library=Library(WithoutActionlib())).create_action_client(name)
    roscpp_peer.call("action_server", name=name)
    goal = client.send_goal({"goal": 3})
    eventually(lambda: "no definition of actionlib/TestGoal is known" in client.problem)
    assert roscpp_peer.call("wait_for_server", name=name) is True
    assert goal.result(30).result.result == 3, client.problem


@BOTH
def test_a_goal_sent_before_its_server_is_there_waits(peer, name, connect):
    client = connect("us").create_action_client(name, TYPE)
    goal = client.send_goal({"goal": 3})
    other = client.send_goal({"goal": 1000})
    assert "no server offers the action" in client.problem
    assert other.cancel().result(30).accepted == (other.id,)
    assert other.result(30).status is GoalStatus.CANCELED
    assert goal.comm_state is CommState.WAITING_FOR_GOAL_ACK
    peer.call("action_server", name=name)
    assert goal.result(30).result.result == 3


@BOTH
def test_a_simple_server_preempts_goals_for_newer_ones(peer, name, connect):
    peer.call("simple_action_server", name=name)
    client = connect("us").create_action_client(name, TYPE)
    old = client.send_goal({"goal": 1000})
    eventually(lambda: old.feedback is not None)
    new = client.send_goal({"goal": 3})
    assert old.result(30).status is GoalStatus.CANCELED
    assert new.result(30).result.result == 3


def test_readiness_comes_and_goes(rospy_peer, name, connect):
    client = connect("us").create_action_client(name, TYPE)
    changes = []
    client.on_ready_change(changes.append)
    assert client.wait_for_server(0.2) is False
    rospy_peer.call("action_server", name=name)
    eventually(lambda: changes == [True])
    goal = client.send_goal({"goal": 2000})
    eventually(lambda: goal.feedback is not None)
    rospy_peer.call("stop_action_server", name=name)
    eventually(lambda: changes == [True, False])
    with pytest.raises(ConnectionLostError, match="left before goal"):
        goal.result(30)
    assert goal.terminal_state is TerminalState.LOST


# -- our server ------------------------------------------------------------------------------------


@BOTH
def test_our_server_lets_goals_succeed(server, peer, name):
    peer.call("send_goal", name=name, goal=4, key=f"{name} a")
    states, end = ended(peer, f"{name} a")
    assert end == {"terminal": "SUCCEEDED", "text": "finished", "result": 4}
    assert [state for state in states if state != "PENDING"] == [
        "ACTIVE",
        "WAITING_FOR_RESULT",
        "DONE",
    ]
    assert [peer.event(f"feedback {name} a") for _ in range(4)] == [0, 1, 2, 3]


@BOTH
@pytest.mark.parametrize(
    ("goal", "end"),
    [
        (0, {"terminal": "REJECTED", "text": "It is not accepted", "result": 0}),
        (-1, {"terminal": "ABORTED", "text": "unlucky", "result": -1}),
    ],
)
def test_our_server_rejects_and_aborts(goal, end, server, peer, name):
    peer.call("send_goal", name=name, goal=goal, key=f"{name} a")
    assert ended(peer, f"{name} a")[1] == end


@BOTH
def test_our_server_is_asked_to_cancel(server, peer, name):
    for key in "ab":
        peer.call("send_goal", name=name, goal=1000, key=f"{name} {key}")
        peer.event(f"feedback {name} {key}")
    assert [goal.status for goal in server.goals] == [GoalStatus.EXECUTING] * 2
    peer.call("cancel_goal", key=f"{name} a")
    states, end = ended(peer, f"{name} a")
    assert states[-4:] == ["WAITING_FOR_CANCEL_ACK", "PREEMPTING", "WAITING_FOR_RESULT", "DONE"]
    assert (end["terminal"], end["text"]) == ("PREEMPTED", "stopped")
    assert len(server.goals) == 1
    peer.call("cancel_all", name=name)
    assert ended(peer, f"{name} b")[1]["terminal"] == "PREEMPTED"
    assert not server.goals


def test_our_server_cancels_goals_until_a_time(connect, rospy_peer, name):
    server = connect("us").create_action_server(name, TYPE, work)
    assert rospy_peer.call("wait_for_server", name=name) is True
    for key in "abc":
        rospy_peer.call("send_goal", name=name, goal=1000, key=f"{name} {key}")
        rospy_peer.event(f"feedback {name} {key}")
    rospy_peer.call("cancel_before", name=name, key=f"{name} b")
    for key in "ab":
        assert ended(rospy_peer, f"{name} {key}")[1]["terminal"] == "PREEMPTED"
    assert len(server.goals) == 1


@BOTH
def test_simple_clients_use_our_server(server, peer, name):
    end = peer.call("simple_goal", name=name, goal=3)
    assert end == {"terminal": "SUCCEEDED", "text": "finished", "result": 3}
    end = peer.call("simple_goal", name=name, goal=1000, cancel_after=0.3)
    assert (end["terminal"], end["text"]) == ("PREEMPTED", "stopped")


@BOTH
def test_our_simple_server_executes_one_goal_at_a_time(peer, name, connect):
    running = []

    def execute(goal):
        running.append(goal)
        assert len([one for one in running if one.status.is_active]) == 1
        return work(goal)

    connect("us").create_action_server(name, TYPE, execute, simple=True)
    assert peer.call("wait_for_server", name=name) is True
    peer.call("send_goal", name=name, goal=1000, key=f"{name} a")
    peer.event(f"feedback {name} a")
    peer.call("send_goal", name=name, goal=3, key=f"{name} b")
    assert ended(peer, f"{name} a")[1]["terminal"] == "PREEMPTED"
    assert ended(peer, f"{name} b")[1]["terminal"] == "SUCCEEDED"


@BOTH
def test_closing_our_server_aborts_its_goals(server, peer, name):
    peer.call("send_goal", name=name, goal=1000, key=f"{name} a")
    peer.event(f"feedback {name} a")
    server.close()
    server.close()
    end = ended(peer, f"{name} a")[1]
    assert end["terminal"] in ("ABORTED", "PREEMPTED")


def test_rostopic_sees_and_drives_our_server(connect, tool, start_tool, name):
    node = connect("us")
    server = node.create_action_server(name, TYPE, work)
    words = ("goal", "cancel", "status", "result", "feedback")
    eventually(lambda: node.topics().keys() >= {f"{name}/{word}" for word in words})
    listed = tool("rostopic", "list", "-v")
    assert f" * {name}/goal [actionlib/TestActionGoal] 1 subscriber" in listed
    assert f" * {name}/cancel [actionlib_msgs/GoalID] 1 subscriber" in listed
    assert f" * {name}/status [actionlib_msgs/GoalStatusArray] 1 publisher" in listed
    assert f" * {name}/result [actionlib/TestActionResult] 1 publisher" in listed
    assert f" * {name}/feedback [actionlib/TestActionFeedback] 1 publisher" in listed
    start_tool("rostopic", "pub", f"{name}/goal", "actionlib/TestActionGoal", "goal: {goal: 1000}")
    goal = eventually(lambda: server.goals and server.goals[0])
    assert goal.id_text.startswith("/us-")  # rostopic leaves that to the server
    assert goal.accepted > Time()
    tool("rostopic", "pub", "-1", f"{name}/cancel", "actionlib_msgs/GoalID", "{}", timeout=30)
    eventually(lambda: goal.status is GoalStatus.CANCELED)
    assert node.actions()[name] == ["actionlib/action/Test"]


def test_parameters_of_actionlib_hold_for_our_server(connect, master, name):
    master.call("setParam", f"{name}/status_frequency", 50.0)
    master.call("setParam", f"{name}/status_list_timeout", 0.5)
    node = connect("us")
    server = node.create_action_server(name, TYPE, work)
    seen = []
    node.create_subscription(f"{name}/status", callback=seen.append)
    client = connect("other").create_action_client(name, TYPE)
    assert client.send_goal({"goal": 1}).result(30).result.result == 1
    begun = len(seen)
    eventually(lambda: len(seen) > begun + 25)
    eventually(lambda: not seen[-1].status_list)
    assert not server.problem


# -- faults ----------------------------------------------------------------------------------------


@BOTH
def test_a_server_killed_in_mid_goal_loses_it(which, request, connect, name):
    peer = request.getfixturevalue(f"start_{which}")(f"{which}_victim_{next(numbers)}")
    peer.call("action_server", name=name)
    client = connect("us").create_action_client(name, TYPE)
    goal = client.send_goal({"goal": 100000})
    eventually(lambda: goal.feedback is not None)
    peer.end()
    with pytest.raises(ConnectionLostError, match="left before goal"):
        goal.result(30)
    assert (goal.status, goal.terminal_state) == (GoalStatus.LOST, TerminalState.LOST)
    assert not client.ready
    assert not client.goals


@BOTH
def test_a_server_that_hangs_loses_its_goals(which, request, connect, name, monkeypatch):
    monkeypatch.setattr("rosglass.ros1.actionlib_client._SILENCE_S", 1.0)
    monkeypatch.setattr("rosglass.ros1.actionlib_client._ANSWER_TIMEOUT_S", 1.0)
    peer = request.getfixturevalue(f"start_{which}")(f"{which}_frozen_{next(numbers)}")
    peer.call("action_server", name=name)
    client = connect("us").create_action_client(name, TYPE)
    goal = client.send_goal({"goal": 100000})
    eventually(lambda: goal.feedback is not None)
    os.kill(peer.pid, signal.SIGSTOP)
    try:
        with pytest.raises(ConnectionLostError, match=r"stopped responding .* before goal"):
            goal.result(30)
        assert not client.ready
    finally:
        os.kill(peer.pid, signal.SIGCONT)
    assert client.wait_for_server(30)
    assert client.cancel_all().result(30).accepted == (goal.id,)


def test_a_server_that_is_restarted_does_not_know_its_goals(start_rospy, connect, name):
    peer = start_rospy("phoenix")
    peer.call("action_server", name=name)
    client = connect("us").create_action_client(name, TYPE)
    goal = client.send_goal({"goal": 100000})
    eventually(lambda: goal.feedback is not None)
    peer.end()
    peer = start_rospy("phoenix")
    peer.call("action_server", name=name)
    with pytest.raises(ConnectionLostError):
        goal.result(30)
    assert client.send_goal({"goal": 2}, timeout=20).result(30).result.result == 2


def test_a_goal_outlives_its_master(start_master, start_rospy, connect, name):
    master = start_master()
    peer = start_rospy("survivor", master=master)
    peer.call("action_server", name=name)
    node = connect("us", url=master.url)
    client = node.create_action_client(name, TYPE)
    done = client.send_goal({"goal": 1})
    assert done.result(30).result.result == 1
    goal = client.send_goal({"goal": 300})  # six seconds
    eventually(lambda: goal.feedback is not None)
    master.kill()
    eventually(lambda: node.status().state.value == "lost")
    master.start()
    eventually(lambda: node.status().state.value == "connected")
    assert goal.result(30).result.result == 300


@BOTH
def test_a_client_closed_in_mid_goal_leaves_it_to_the_server(client, peer, name, connect):
    goal = client.send_goal({"goal": 100})
    eventually(lambda: goal.feedback is not None)
    client.close()
    client.close()
    with pytest.raises(NodeClosedError, match="which continues"):
        goal.result(30)
    with pytest.raises(NodeClosedError):
        client.send_goal({"goal": 1})
    other = connect("other")
    results = []
    other.create_subscription(f"{name}/result", callback=results.append)
    ended = eventually(lambda: results and results[0])
    assert ended.status.goal_id.id == goal.id_text
    assert ended.result.result == 100
