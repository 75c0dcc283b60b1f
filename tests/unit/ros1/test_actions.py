"""Actions against servers and clients led by hand: late, silent, and contradictory ones."""

from __future__ import annotations

import itertools
import threading

import pytest
from executors import Failing

from rosglass.comm import IMMEDIATE, Dispatcher, GoalStatus, QoS, Time
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    GoalRejectedError,
    NodeClosedError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004
)
from rosglass.interfaces import Library
from rosglass.ros1.actionlib import CommState, ServerState, TerminalState

TYPE = "actionlib/TestAction"
NAME = "/work"
OWN = "int32 order\n---\nint32 total\n---\nfloat32 part"


class Puppet:
    """The topics of a server, led by a test.

    Attributes:
        goals: Received goals.
        cancels: Received requests to cancel, as id and nanoseconds.
    """

    def __init__(self, node, *, leave_out=""):
        self.node, self.goals, self.cancels = node, [], []
        self.status = node.create_publisher(
            f"{NAME}/status", "actionlib_msgs/GoalStatusArray", QoS.latched()
        )
        self.result = node.create_publisher(f"{NAME}/result", "actionlib/TestActionResult")
        self.feedback = node.create_publisher(f"{NAME}/feedback", "actionlib/TestActionFeedback")
        node.create_subscription(
            f"{NAME}/goal", "actionlib/TestActionGoal", self.goals.append, executor=IMMEDIATE
        )
        if leave_out != "cancel":
            self.listen()
        self.say()

    def listen(self):
        """Take requests to cancel from now on."""
        self.listening = self.node.create_subscription(
            f"{NAME}/cancel", "actionlib_msgs/GoalID", self._cancel, executor=IMMEDIATE
        )

    def _cancel(self, message):
        stamp = message.stamp.secs * 10**9 + message.stamp.nsecs
        self.cancels.append((message.id, stamp))

    def say(self, **states):
        """Publish the state of goals, by their places in `goals`: g0="ACTIVE"."""
        entries = []
        for word, state in states.items():
            code = state if isinstance(state, int) else ServerState[state]
            entries.append({"goal_id": self.goals[int(word[1:])].goal_id.to_dict(), "status": code})
        self.status.publish(status_list=entries)

    def end(self, state, number=0, text=""):
        """Publish the result of a goal."""
        goal_id = self.goals[number].goal_id.to_dict()
        status = {"goal_id": goal_id, "status": ServerState[state], "text": text}
        self.result.publish(status=status, result={"result": 7})


@pytest.fixture
def puppet(connect):
    return Puppet(connect("robot"))


@pytest.fixture
def client(puppet, connect):
    made = connect("us").create_action_client(NAME, TYPE)
    assert made.wait_for_server(30), made.problem
    return made


@pytest.fixture
def sent(client, puppet, eventually):
    """A goal that the server has accepted and executes."""
    goal = client.send_goal({"goal": 5})
    eventually(lambda: puppet.goals)
    puppet.say(g0="ACTIVE")
    eventually(lambda: goal.status is GoalStatus.EXECUTING)
    return goal


# -- the client ------------------------------------------------------------------------------------


def test_goal_message_has_stamp_and_id(sent, puppet):
    message = puppet.goals[0]
    assert message.goal.goal == 5
    assert message.goal_id.id == sent.id_text == sent.id.decode()
    name, number, stamp = message.goal_id.id.rsplit("-", 2)
    assert (name, number.isdigit()) == ("/us", True)
    assert stamp == f"{message.goal_id.stamp.secs}.{message.goal_id.stamp.nsecs:09d}"
    assert Time.from_parts(message.goal_id.stamp.secs, message.goal_id.stamp.nsecs) == sent.stamp
    assert message.header.stamp.to_dict() == message.goal_id.stamp.to_dict()


def test_ids_are_unique_among_a_nodes_clients(connect):
    node = connect("us")
    clients = [node.create_action_client(NAME, TYPE) for _ in range(2)]
    goals = [client.send_goal() for client in clients for _ in range(3)]
    assert len({goal.id for goal in goals}) == 6


def test_server_is_ready_once_all_five_topics_are_connected(connect, eventually):
    Puppet(connect("robot"), leave_out="cancel")
    client = connect("us").create_action_client(NAME, TYPE)
    eventually(
        lambda: client.problem == f"the server /robot is not connected on {NAME}/cancel (yet)"
    )
    assert client.wait_for_server(0.3) is False
    goal = client.send_goal(timeout=0.2)
    with pytest.raises(ServiceUnavailableError, match=f"not connected on {NAME}/cancel"):
        goal.result(5)
    assert goal.terminal_state is TerminalState.LOST


def test_goal_missing_from_the_status_is_lost(sent, puppet, client):
    puppet.say()
    with pytest.raises(ConnectionLostError, match=r"does not know goal .* any more"):
        sent.result(30)
    assert (sent.status, sent.comm_state) == (GoalStatus.LOST, CommState.DONE)
    assert client.goals == ()


def test_another_servers_list_does_not_lose_a_goal(sent, connect, puppet, eventually):
    Puppet(connect("second"))
    puppet.say(g0="PREEMPTING")
    eventually(lambda: sent.status is GoalStatus.CANCELING)
    puppet.end("SUCCEEDED")
    assert sent.result(30).result.result == 7


def test_goal_whose_result_never_comes_is_lost(sent, puppet, eventually, monkeypatch):
    monkeypatch.setattr("rosglass.ros1.actionlib_client._OVERDUE_S", 0.2)
    puppet.say(g0="SUCCEEDED")
    eventually(lambda: sent.comm_state is CommState.WAITING_FOR_RESULT)
    assert sent.status is GoalStatus.SUCCEEDED

    def lost():
        puppet.say()
        return sent.done.done()

    eventually(lost)
    with pytest.raises(ConnectionLostError, match="has ended as succeeded, but its result was not"):
        sent.result(0)


def test_silent_server_that_lives_keeps_its_goals(sent, puppet, monkeypatch, eventually):
    asked = []
    monkeypatch.setattr("rosglass.ros1.actionlib_client._SILENCE_S", 0.1)
    monkeypatch.setattr(
        "rosglass.ros1.actionlib_client.call_node", lambda *given, **_: asked.append(given[1])
    )
    eventually(lambda: len(asked) > 1)
    assert set(asked) == {"getPid"}
    assert sent.status is GoalStatus.EXECUTING
    puppet.end("SUCCEEDED")
    assert sent.result(30).status is GoalStatus.SUCCEEDED


def test_silent_server_that_does_not_answer_loses_its_goals(sent, client, monkeypatch):
    def fail(*_given, **_more):
        raise ConnectionLostError("http://robot:1 does not answer: no answer in time")

    monkeypatch.setattr("rosglass.ros1.actionlib_client._SILENCE_S", 0.1)
    monkeypatch.setattr("rosglass.ros1.actionlib_client.call_node", fail)
    with pytest.raises(
        ConnectionLostError, match=r"stopped responding .*no answer in time.* before goal"
    ):
        sent.result(30)
    assert not client.ready
    assert "does not publish the status of its goals" in client.problem


def test_cancel_request_is_repeated_until_the_server_reacts(sent, puppet, eventually, monkeypatch):
    monkeypatch.setattr("rosglass.ros1.actionlib_client._REPEAT_S", 0.05)
    answer = sent.cancel()
    eventually(lambda: sent.comm_state is CommState.WAITING_FOR_CANCEL_ACK)
    assert sent.status is GoalStatus.EXECUTING

    def insisted():
        puppet.say(g0="ACTIVE")
        return len(puppet.cancels) >= 4

    eventually(insisted)
    for _ in range(20):
        puppet.say(g0="ACTIVE")
    puppet.say(g0="PREEMPTING")
    assert answer.result(30) == ((sent.id,), "")
    assert puppet.cancels == [(sent.id_text, 0)] * 4
    puppet.end("PREEMPTED", text="stopped")
    assert sent.result(30).status is GoalStatus.CANCELED
    assert sent.text == "stopped"


def test_request_to_cancel_outlives_a_connection(sent, client, puppet, eventually, monkeypatch):
    monkeypatch.setattr("rosglass.ros1.actionlib_client._REPEAT_S", 0.02)
    puppet.listening.close()
    eventually(lambda: not client.ready)
    answer, every = sent.cancel(), client.cancel_all()
    for _ in range(20):
        puppet.say(g0="ACTIVE")
    assert not client.ready
    puppet.listen()

    def heard():
        puppet.say(g0="ACTIVE")
        return (sent.id_text, 0) in puppet.cancels and ("", 0) in puppet.cancels

    eventually(heard)
    puppet.say(g0="PREEMPTING")
    assert answer.result(30).accepted == (sent.id,)
    assert every.result(30).accepted == (sent.id,)


def test_server_that_was_cut_off_may_have_missed_a_goal(client, puppet, eventually):
    goal = client.send_goal({"goal": 1}, timeout=None)
    eventually(lambda: puppet.goals)
    puppet.listening.close()
    eventually(lambda: not client.ready)
    puppet.listen()
    with pytest.raises(ConnectionLostError, match=r"was disconnected after it was sent the goal"):
        goal.result(30)
    eventually(lambda: puppet.cancels == [(goal.id_text, 0)])


def test_unacknowledged_cancel_request_times_out(sent):
    with pytest.raises(
        TimeoutError, match=r"did not acknowledge within 0.2 s that it cancels goal"
    ):
        sent.cancel(timeout=0.2).result(5)
    assert sent.status is GoalStatus.EXECUTING


def test_goal_that_ended_cannot_be_cancelled(sent, puppet):
    late = sent.cancel()
    puppet.end("SUCCEEDED")
    assert late.result(30) == ((), "the goal has ended already: succeeded")
    assert sent.cancel().result(30) == ((), "the goal has ended already: succeeded")


def test_cancelling_many_is_answered_when_all_show_it(client, puppet, eventually):
    goals = [client.send_goal({"goal": n}) for n in range(3)]
    eventually(lambda: len(puppet.goals) == 3)
    puppet.say(g0="ACTIVE", g1="PENDING", g2="ACTIVE")
    eventually(lambda: all(goal.comm_state is not CommState.WAITING_FOR_GOAL_ACK for goal in goals))
    answer = client.cancel_before(goals[1].stamp)
    eventually(lambda: puppet.cancels)
    assert puppet.cancels == [("", goals[1].stamp.nanoseconds)]
    puppet.say(g0="PREEMPTING", g1="PENDING", g2="ACTIVE")
    eventually(lambda: goals[0].status is GoalStatus.CANCELING)
    assert not answer.done()
    puppet.say(g0="PREEMPTED", g1="RECALLING", g2="ACTIVE")
    assert answer.result(30) == ((goals[0].id, goals[1].id), "")
    with pytest.raises(TimeoutError, match="that all goals are cancelled"):
        client.cancel_all(timeout=0.2).result(5)


def test_cancelling_all_waits_for_a_server_and_keeps_goals_back(connect):
    client = connect("us").create_action_client(NAME, TYPE)
    goal = client.send_goal()
    with pytest.raises(ServiceUnavailableError, match=r"could not be asked to cancel within 0.2 s"):
        client.cancel_all(timeout=0.2).result(5)
    assert goal.result(5).status is GoalStatus.CANCELED
    assert goal.terminal_state is TerminalState.RECALLED
    answer = client.cancel_all()
    puppet = Puppet(connect("robot"))
    assert client.wait_for_server(30)
    stop = threading.Event()
    teller = threading.Thread(
        target=lambda: [puppet.say() for _ in iter(lambda: stop.wait(0.1), 1)]
    )
    teller.start()
    try:
        assert answer.result(30) == ((), "there was no goal to cancel")
    finally:
        stop.set()
        teller.join()
    assert puppet.cancels == [("", 0)]
    assert puppet.goals == []


def test_server_that_does_not_know_a_goal_in_time(client, puppet, eventually):
    goal = client.send_goal({"goal": 1}, timeout=0.3)
    with pytest.raises(TimeoutError, match=r"did not acknowledge goal .* within 0.3 s"):
        goal.result(5)
    eventually(lambda: puppet.cancels == [(goal.id_text, 0)])
    with pytest.raises(TimeoutError):
        goal.acceptance.result(0)


def test_goal_may_be_pending_for_longer_than_the_timeout(client, puppet, eventually):
    goal = client.send_goal({"goal": 1}, timeout=0.3)
    eventually(lambda: puppet.goals)
    puppet.say(g0="PENDING")
    eventually(lambda: goal.comm_state is CommState.PENDING)
    with pytest.raises(TimeoutError, match="has not ended, and continues"):
        goal.result(0.6)
    puppet.end("SUCCEEDED")
    assert goal.result(5).status is GoalStatus.SUCCEEDED
    assert goal.acceptance.result(0) is True


def test_contradicting_status_is_logged_once(sent, puppet, caplog, eventually):
    for _ in range(5):
        puppet.say(g0="PENDING")
    puppet.say(g0="PREEMPTING")
    eventually(lambda: sent.status is GoalStatus.CANCELING)
    messages = [
        record.getMessage() for record in caplog.records if "contradicts" in record.getMessage()
    ]
    assert len(messages) == 1
    assert "PENDING does not follow ACTIVE" in messages[0]


def test_unknown_status_is_logged_once(sent, puppet, caplog, eventually):
    for _ in range(5):
        puppet.say(g0=77)
    puppet.say(g0="PREEMPTING")
    eventually(lambda: sent.status is GoalStatus.CANCELING)
    assert len([text for text in caplog.messages if "status 77" in text]) == 1


@pytest.mark.parametrize(
    ("state", "error", "text"),
    [
        ("LOST", ConnectionLostError, "reports that goal .* is lost: why"),
        ("REJECTED", GoalRejectedError, "does not accept goal .*: why"),
    ],
)
def test_ends_without_result(state, error, text, sent, puppet):
    puppet.end(state, text="why")
    with pytest.raises(error, match=text):
        sent.result(30)
    assert sent.terminal_state.name == state


def test_result_may_come_before_any_status(client, puppet, eventually):
    goal = client.send_goal({"goal": 1})
    eventually(lambda: puppet.goals)
    states = []
    goal.on_comm_state_change(states.append)
    puppet.end("RECALLED")
    assert goal.result(30).status is GoalStatus.CANCELED
    eventually(lambda: len(states) == 3)
    assert states == [CommState.PENDING, CommState.WAITING_FOR_RESULT, CommState.DONE]


def test_goals_of_other_clients_are_ignored(sent, puppet, connect, eventually):
    other = connect("other").create_action_client(NAME, TYPE)
    assert other.wait_for_server(30)
    theirs = other.send_goal({"goal": 6})
    eventually(lambda: len(puppet.goals) == 2)
    puppet.end("SUCCEEDED", 1)
    assert theirs.result(30).status is GoalStatus.SUCCEEDED
    assert sent.status is GoalStatus.EXECUTING


def test_server_of_another_type_is_reported(puppet, connect, eventually):
    client = connect("us").create_action_client(NAME, "actionlib/TwoIntsAction")
    eventually(lambda: "actionlib/TestActionResult" in client.problem)
    assert not client.ready


def test_closed_client_resends_nothing(sent, client, puppet):
    answer = client.cancel_all()
    client.close()
    with pytest.raises(NodeClosedError):
        answer.result(30)
    with pytest.raises(NodeClosedError):
        sent.resend()


# -- types -----------------------------------------------------------------------------------------


@pytest.fixture
def own_server(connect):
    """Return a server of a type that only its own library has."""
    library = Library()
    library.add_text("own_msgs/action/Count", OWN, ros=1)
    node = connect("robot", library=library)
    return node.create_action_server(
        NAME, "own_msgs/CountAction", lambda goal: {"total": goal.goal.order + 1}
    )


@pytest.mark.usefixtures("own_server")
def test_unknown_type_is_assembled_from_the_topics(connect, eventually):
    client = connect("us", library=Library()).create_action_client(NAME)
    goal = client.send_goal({"order": 4})
    eventually(lambda: "no definition of own_msgs/CountGoal is known" in client.problem)
    library = Library()
    library.add_text("own_msgs/action/Count", OWN, ros=1)
    other = connect("other", library=library).create_action_client(NAME, "own_msgs/Count")
    assert goal.result(30).result.total == 5
    assert client.type.name == "own_msgs/action/Count"
    assert other.send_goal({"order": 1}).result(30).result.total == 2


@pytest.mark.usefixtures("own_server")
def test_actions_are_listed_with_their_types(connect, eventually):
    node = connect("us")
    eventually(lambda: node.actions() == {NAME: ["own_msgs/action/Count"]})


# -- the server ------------------------------------------------------------------------------------


class Hand:
    """The topics of a client, led by a test.

    Attributes:
        results: Received results, by goal: state, text and result.
        listed: The states of the last status message, by goal.
    """

    def __init__(self, node, eventually):
        self.results, self.listed, self.order = {}, {}, itertools.count(1)
        self.goal = node.create_publisher(f"{NAME}/goal", "actionlib/TestActionGoal")
        self.cancel = node.create_publisher(f"{NAME}/cancel", "actionlib_msgs/GoalID")
        result = node.create_subscription(f"{NAME}/result", "actionlib/TestActionResult", self._end)
        status = node.create_subscription(
            f"{NAME}/status", "actionlib_msgs/GoalStatusArray", self._list, QoS.latched()
        )
        eventually(lambda: self.goal.subscription_count() and self.cancel.subscription_count())
        eventually(lambda: result.publisher_count() and status.publisher_count())

    def _end(self, message):
        status = message.status
        end = (ServerState(status.status).name, status.text, message.result.result)
        self.results.setdefault(status.goal_id.id, []).append(end)

    def _list(self, message):
        self.listed = {
            status.goal_id.id: ServerState(status.status).name for status in message.status_list
        }

    def send(self, name, goal=1, stamp=None):
        goal_id = {"id": name, "stamp": {"secs": next(self.order) if stamp is None else stamp}}
        self.goal.publish(goal_id=goal_id, goal={"goal": goal})

    def stop(self, name="", stamp=0):
        self.cancel.publish(id=name, stamp={"secs": stamp})


@pytest.fixture
def offer(connect, eventually):
    """Offer the action; returns the server and a `Hand`, which leads its client."""

    def offer(execute, **more):
        server = connect("robot").create_action_server(NAME, TYPE, execute, **more)
        return server, Hand(connect("hand"), eventually)

    return offer


def until_stopped(goal):
    """Execute a goal until it is stopped."""
    goal.wait_for_cancel(20)
    return {"result": 3}


def test_request_to_cancel_before_the_goal(offer, eventually):
    executed = []
    _, hand = offer(executed.append)
    hand.stop("a")
    eventually(lambda: hand.listed == {"a": "RECALLING"})
    hand.send("a")
    eventually(lambda: hand.results)
    assert hand.results == {"a": [("RECALLED", "It was cancelled before it was received", 0)]}
    assert executed == []


def test_goals_not_newer_than_the_last_request_are_recalled(offer, eventually):
    _, hand = offer(lambda goal: {"result": goal.goal.goal})
    hand.stop(stamp=100)
    hand.stop("marker")
    eventually(lambda: "marker" in hand.listed)
    hand.send("old", stamp=100)
    hand.send("new", stamp=101)
    hand.send("none", stamp=0)  # gets the time of its arrival
    eventually(lambda: len(hand.results) == 3)
    assert [hand.results[name][0][0] for name in ("old", "new", "none")] == [
        "RECALLED",
        "SUCCEEDED",
        "SUCCEEDED",
    ]


def test_goal_that_is_sent_twice_is_executed_once(offer, eventually):
    executed = []
    _, hand = offer(lambda goal: executed.append(goal.id_text))
    hand.send("a", stamp=1)
    eventually(lambda: hand.listed == {"a": "SUCCEEDED"})
    hand.send("a", stamp=1)
    hand.send("b", stamp=2)
    eventually(lambda: "b" in hand.results)
    assert executed == ["a", "b"]
    assert len(hand.results["a"]) == 1


def test_goal_without_id_gets_one(offer, eventually):
    server, hand = offer(until_stopped)
    hand.send("", stamp=0)
    (goal,) = eventually(lambda: server.goals)
    assert goal.id_text.startswith("/robot-")
    assert goal.accepted.nanoseconds > 10**18
    with pytest.raises(ConversionError, match="text"):
        goal.abort(None, 5)
    goal.succeed({"result": 1}, "early")
    eventually(lambda: hand.results)
    assert hand.results == {goal.id_text: [("SUCCEEDED", "early", 1)]}


def test_goal_cancelled_during_its_acceptance_is_recalled(offer, eventually):
    decide, executed = threading.Event(), []
    _, hand = offer(executed.append, accept=lambda _: decide.wait(30))
    hand.send("a")
    eventually(lambda: hand.listed == {"a": "PENDING"})
    hand.stop("a")
    eventually(lambda: hand.listed == {"a": "RECALLING"})
    decide.set()
    eventually(lambda: hand.results)
    assert hand.results["a"][0][0] == "RECALLED"
    assert executed == []


def test_goals_that_the_executor_does_not_take_end_at_once(offer, eventually):
    executor = Failing()
    executor.failing = True
    _, hand = offer(lambda _: {"result": 3}, executor=executor, simple=True)
    hand.send("a")
    eventually(lambda: "a" in hand.results)
    executor.failing = False
    hand.send("b")
    eventually(lambda: "b" in hand.results)
    # It is pending until it is executed, and actionlib rejects what is.
    assert [hand.results[one][0][0] for one in "ab"] == ["REJECTED", "SUCCEEDED"]


@pytest.mark.parametrize(
    ("execute", "text"),
    [
        (lambda _: 5, "ConversionError"),
        (lambda _: {"result": "five"}, "ConversionError"),
        (lambda _: 1 / 0, "ZeroDivisionError: division by zero"),
    ],
)
def test_failing_callback_aborts_the_goal_with_the_reason(execute, text, offer, eventually):
    _, hand = offer(execute)
    hand.send("a")
    eventually(lambda: hand.results)
    state, status_text, result = hand.results["a"][0]
    assert (state, result) == ("ABORTED", 0)
    assert status_text.startswith(text)


def test_executor_takes_goals_one_by_one(offer, eventually):
    executor, begun = Dispatcher("goals"), []

    def execute(goal):
        begun.append(goal.id_text)
        return until_stopped(goal)

    server, hand = offer(execute, executor=executor)
    hand.send("a")
    eventually(lambda: begun)
    hand.send("b")
    eventually(lambda: len(server.goals) == 2)
    assert [goal.status for goal in server.goals] == [GoalStatus.EXECUTING, GoalStatus.ACCEPTED]
    hand.stop("b")
    eventually(lambda: hand.listed.get("b") == "PREEMPTING")
    hand.stop("a")
    eventually(lambda: len(hand.results) == 2)
    assert begun == ["a"]
    assert [end[0][0] for end in hand.results.values()] == ["PREEMPTED", "PREEMPTED"]
    executor.close()


def test_newer_goal_preempts_those_before(offer, eventually):
    begun, go = [], threading.Event()

    def execute(goal):
        begun.append(goal.id_text)
        goal.wait_for_cancel(20)
        assert go.wait(30)
        return {"result": 3}

    server, hand = offer(execute, simple=True)
    hand.send("a", stamp=10)
    eventually(lambda: begun == ["a"])
    hand.send("b", stamp=11)
    eventually(lambda: hand.listed.get("b") == "PENDING")
    assert server.goals[0].is_cancel_requested
    assert server.goals[0].cancel_request.done()
    assert server.goals[0].status is GoalStatus.EXECUTING
    hand.send("c", stamp=12)
    eventually(lambda: "b" in hand.results)
    assert hand.results["b"][0][0] == "RECALLED"
    hand.send("late", stamp=11)
    eventually(lambda: "late" in hand.results)
    assert hand.results["late"][0][0] == "RECALLED"
    go.set()
    eventually(lambda: begun == ["a", "c"])
    assert hand.results["a"] == [("PREEMPTED", "", 3)]
    hand.stop("c")
    eventually(lambda: "c" in hand.results)
    assert hand.results["c"] == [("PREEMPTED", "", 3)]
    assert begun == ["a", "c"]


def test_goal_that_waits_for_its_turn_is_recalled(offer, eventually):
    go = threading.Event()
    server, hand = offer(lambda _: go.wait(30) and None, simple=True)
    hand.send("a")
    eventually(lambda: server.goals)
    hand.send("b")
    eventually(lambda: hand.listed.get("b") == "PENDING")
    hand.stop("b")
    eventually(lambda: "b" in hand.results)
    assert hand.results["b"][0][0] == "RECALLED"
    go.set()
    eventually(lambda: "a" in hand.results)
    hand.send("c")
    eventually(lambda: "c" in hand.results)
    assert hand.results["c"][0][0] == "SUCCEEDED"


def test_closing_ends_all_goals(offer, eventually):
    closed = threading.Event()

    def execute(_):
        closed.wait(30)

    server, hand = offer(execute, simple=True)
    hand.send("a")
    eventually(lambda: server.goals)
    hand.send("b")
    eventually(lambda: hand.listed.get("b") == "PENDING")
    running, waiting = server.goals
    threading.Timer(0.2, closed.set).start()
    server.close()
    server.close()
    eventually(lambda: len(hand.results) == 2)
    assert hand.results["a"][0][0] == "ABORTED"
    assert hand.results["b"][0][0] == "REJECTED"
    for goal in (running, waiting):
        with pytest.raises(NodeClosedError):
            goal.succeed()
    assert server.problem == "the server is closed"


def test_simple_and_full_action_servers(connect):
    node = connect("robot")
    with pytest.raises(ConversionError, match="simple: expected"):
        node.create_action_server(NAME, TYPE, until_stopped, simple="yes")
    node.create_action_server(NAME, TYPE, until_stopped)
