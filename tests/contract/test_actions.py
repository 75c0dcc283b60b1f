"""Sending and executing goals, on every wire."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import Future

import pytest
from executors import Failing

import rosglass
from rosglass.comm import CancelAnswer, Dispatcher, GoalStatus, Time
from rosglass.comm.executor import LoopExecutor

ENDLESS = {"order": 1_000_000}


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


def test_goal_succeeds_with_feedback_and_result(offer, client, console, wire, eventually):
    server = offer()
    feedback, statuses, done = [], [], []
    goal = client.send_goal(
        {"order": 5},
        on_feedback=lambda message: feedback.append(len(message.sequence)),
        on_status_change=statuses.append,
        on_done=done.append,
    )
    status, result = goal.result(30)
    assert status is goal.status is GoalStatus.SUCCEEDED
    assert list(result.sequence) == [0, 1, 2, 3, 4]
    eventually(lambda: done == [goal])
    if not wire.is_ros1:  # where clients do not learn when a goal was accepted
        assert statuses.pop(0) is GoalStatus.ACCEPTED
        assert abs((console.now() - goal.accepted).seconds) < 30
    assert statuses == [GoalStatus.EXECUTING, GoalStatus.SUCCEEDED]
    assert feedback == [2, 3, 4, 5]
    assert len(goal.feedback.sequence) == 5
    assert goal.acceptance.result() is True
    assert goal.goal.order == 5
    assert f"{goal.id_text} succeeded" in repr(goal)
    assert client.name in repr(client)
    assert client.name in repr(server)
    assert list(client.goals) == list(server.goals) == []
    assert client.problem == server.problem == ""


def test_rejected_goal_leaves_nothing_behind(offer, client, eventually):
    server = offer(accept=lambda goal: goal.order < 10)
    events = []
    goal = client.send_goal({"order": 100}, on_status_change=events.append, on_done=events.append)
    reason = f"{client.name} does not accept goal {goal.id_text}"
    with pytest.raises(rosglass.GoalRejectedError, match=reason):
        goal.result(30)
    assert goal.acceptance.result() is False
    assert goal.status is GoalStatus.REJECTED
    assert goal.accepted is None
    assert goal.cancel().result(30).reason == "the goal has ended already: rejected"
    eventually(lambda: events == [GoalStatus.REJECTED, goal], lambda: events)
    assert list(client.goals) == list(server.goals) == []
    assert client.send_goal({"order": 2}).result(30).status is GoalStatus.SUCCEEDED


def test_goal_is_cancelled(offer, client):
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


def test_goal_waits_for_the_server(robot, client, topic, wire):
    goal = client.send_goal({"order": 3})
    robot.create_action_server(topic, wire.count, count)
    assert goal.result(30).status is GoalStatus.SUCCEEDED


def test_without_a_server_a_goal_ends_after_its_time(robot, client, topic, wire, eventually):
    robot.create_action_server(f"/base{topic}", wire.count, count)
    eventually(lambda: f"did you mean /base{topic}?" in client.problem, lambda: client.problem)
    goal = client.send_goal({"order": 1}, timeout=0.2)
    reason = rf"no goal could be sent to {topic} within 0\.2 s: no server offers the action {topic}"
    with pytest.raises(rosglass.ServiceUnavailableError, match=reason):
        goal.result(30)
    assert goal.status is GoalStatus.LOST


@pytest.mark.parametrize("create", ["create_action_client", "create_action_server"])
def test_odd_names_and_types_are_refused(robot, wire, create):
    more = (count,) if create.endswith("server") else ()
    for name, kind, error, reason in (
        ("a b", wire.count, rosglass.InvalidNameError, " "),
        ("/x", "nowhere_msgs/action/No", rosglass.TypeNotFoundError, "nowhere_msgs"),
        ("/x", "std_msgs/msg/String", rosglass.TypeNotFoundError, "is not an? action type"),
        ("/x", 7, rosglass.TypeNotFoundError, "7 is not an? action type"),
    ):
        with pytest.raises(error, match=reason):
            getattr(robot, create)(name, kind, *more)


def test_invalid_goal_is_refused_naming_the_field_and_not_sent(offer, client):
    orders = []
    offer(lambda goal: orders.append(goal.goal.order))
    with pytest.raises(rosglass.ConversionError, match="order: expected an integer"):
        client.send_goal({"order": "many"})
    client.send_goal({"order": 2}).result(30)
    assert orders == [2]


def test_status_of_goals_is_available_to_late_subscriptions(offer, client, connect, topic, wire):
    offer()
    goal = client.send_goal({"order": 2})
    assert goal.result(30).status is GoalStatus.SUCCEEDED
    name = f"{topic}/status" if wire.is_ros1 else f"{topic}/_action/status"
    late = connect("late").create_subscription(name, qos=rosglass.QoS.latched())
    (entry,) = late.wait(30).message().status_list
    if wire.is_ros1:
        assert (entry.goal_id.id, entry.status) == (goal.id_text, 3)
    else:
        assert (bytes(entry.goal_info.goal_id.uuid), entry.status) == (goal.id, 4)


def test_graph_shows_the_action(offer, console, topic, wire, eventually):
    offer()
    eventually(lambda: topic in console.actions(), console.actions)
    assert console.actions()[topic] == [wire.count]


# -- the client ------------------------------------------------------------------------------------


def test_cancelling_one_all_and_before(offer, connect, client, topic):
    offer()
    first, second = client.send_goal(ENDLESS), client.send_goal(ENDLESS)
    assert first.acceptance.result(30)
    assert second.acceptance.result(30)
    third = client.send_goal(ENDLESS)
    assert third.acceptance.result(30)
    answer = client.cancel_before(second.accepted).result(30)
    assert set(answer.accepted) == {first.id, second.id}
    assert {first.result(30).status, second.result(30).status} == {GoalStatus.CANCELED}
    assert third.status.is_active
    theirs = connect("other").create_action_client(topic).send_goal(ENDLESS, timeout=30)
    assert theirs.acceptance.result(30)
    assert set(client.cancel_all().result(30).accepted) == {third.id, theirs.id}
    assert {theirs.result(30).status, third.result(30).status} == {GoalStatus.CANCELED}
    assert client.cancel_all().result(30) == CancelAnswer((), "there was no goal to cancel")
    again = third.cancel().result(30)
    assert again == CancelAnswer((), "the goal has ended already: canceled")


def test_goal_cancelled_before_it_was_sent_is_not_sent(offer, client, eventually):
    events, executed = [], []
    goal = client.send_goal(on_status_change=events.append, on_done=events.append)
    assert goal.cancel().result(30) == CancelAnswer((goal.id,))
    status, result = goal.result(30)
    assert (status, list(result.sequence)) == (GoalStatus.CANCELED, [])
    assert goal.acceptance.result(30) is False
    eventually(lambda: events[-2:] == [GoalStatus.CANCELED, goal], lambda: events)
    assert GoalStatus.EXECUTING not in events
    queued = client.send_goal()
    answer = client.cancel_all(30)
    assert queued.result(30).status is GoalStatus.CANCELED
    offer(executed.append)
    answer.result(30)
    last = client.send_goal()
    assert last.result(30).status is GoalStatus.SUCCEEDED
    assert [each.id for each in executed] == [last.id]


@pytest.mark.parametrize("time_", [Time(), Time(-1), Time(2**32 * 10**9), 5, None])
def test_odd_times_to_cancel_before_are_refused(client, time_):
    with pytest.raises(rosglass.ArgumentError, match=r"time: .* cancel_all\(\) cancels all goals"):
        client.cancel_before(time_)


def test_invalid_goal_or_option_is_refused_and_not_sent(offer, client):
    executed = []
    offer(lambda goal: executed.append(goal.id))
    for goal, options, reason in (
        (5, {}, "expected a dict or a"),
        ({"speed": 1}, {}, "speed"),
        ({}, {"timeout": -1}, "timeout: expected seconds"),
        ({}, {"timeout": "soon"}, "timeout: expected seconds"),
        ({}, {"executor": "gui"}, "executor: expected a rosglass.comm.Executor"),
        ({}, {"on_feedback": 7}, "callback: expected something that can be called"),
        ({}, {"on_status_change": 7}, "callback: expected something that can be called"),
        ({}, {"on_done": 7}, "on_done: expected something that can be called"),
    ):
        with pytest.raises(rosglass.ConversionError, match=reason):
            client.send_goal(goal, **options)
    assert list(client.goals) == []
    last = client.send_goal()
    last.result(30)
    assert executed == [last.id]


def test_cancelling_takes_seconds(client):
    with pytest.raises(rosglass.ArgumentError, match="timeout: expected seconds"):
        client.send_goal().cancel("soon")


def test_slow_callbacks_get_the_newest_feedback(offer, client, caplog, eventually):
    slow, seen, release = Dispatcher("slow"), [], threading.Event()
    slow.post(lambda: release.wait(30) and None)

    def execute(goal):
        for value in range(100):
            goal.publish_feedback(sequence=[value])
            goal.wait_for_cancel(0.001)

    offer(execute)
    goal = client.send_goal(on_feedback=lambda m: seen.append(int(m.sequence[0])), executor=slow)
    goal.result(30)
    eventually(lambda: goal.feedback.sequence[0] >= 90)
    last = int(goal.feedback.sequence[0])
    release.set()
    eventually(lambda: seen == list(range(last - 9, last + 1)), lambda: seen)
    assert caplog.text.count("the newest 10 are kept") == 1
    slow.close()


def test_goals_sent_before_the_type_is_known(robot, console, topic, wire):
    client = console.create_action_client(topic)
    assert "type not known yet" in repr(client)
    wanted = {"order": 3}
    goal = client.send_goal(wanted, timeout=None)
    wanted["order"] = 99  # of no concern any more
    canceled, late = client.send_goal(ENDLESS), client.send_goal(timeout=0.01)
    wrong = client.send_goal({"order": "three"}, timeout=None)
    with pytest.raises(rosglass.ConversionError, match="expected a message or a dict"):
        client.send_goal(3)
    assert goal.goal is None
    assert goal.status is GoalStatus.PENDING
    assert canceled.cancel().result(30).accepted == (canceled.id,)
    assert (canceled.status, canceled.acceptance.result(30)) == (GoalStatus.CANCELED, False)
    with pytest.raises(rosglass.ServiceUnavailableError, match="before its type was discovered"):
        canceled.result(30)
    with pytest.raises(rosglass.ServiceUnavailableError, match=r"within 0\.01 s: no server offers"):
        late.result(30)
    with pytest.raises(rosglass.ServiceUnavailableError, match=r"asked to cancel within .* s: no"):
        client.cancel_before(Time(1), 0.01).result(30)
    robot.create_action_server(topic, wire.count, count)
    assert list(goal.result(30).result.sequence) == [0, 1, 2]
    assert goal.goal.order == 3
    assert client.type.name == wire.count
    with pytest.raises(rosglass.ConversionError, match="order: expected"):
        wrong.result(30)
    assert list(client.goals) == []


def test_cancelling_waits_for_the_type(robot, console, topic, wire):
    client = console.create_action_client(topic)
    goal = client.send_goal(ENDLESS)
    answer, other = client.cancel_all(30), client.cancel_before(Time(1), 30)
    assert goal.status is GoalStatus.CANCELED
    assert not answer.done()
    robot.create_action_server(topic, wire.count, count)
    assert (answer.result(30).accepted, other.result(30).accepted) == ((), ())


def test_closing_ends_goals_whose_type_is_not_known(console, topic):
    client = console.create_action_client(topic)
    goal, answer = client.send_goal({"order": 3}), client.cancel_before(Time(1))
    client.close()
    with pytest.raises(rosglass.NodeClosedError, match="closed before the goal ended"):
        goal.result(30)
    with pytest.raises(rosglass.NodeClosedError, match="closed"):
        answer.result(30)


def test_readiness_changes_to_and_fro(client, offer, eventually):
    changes = []
    client.on_ready_change(changes.append)
    assert not client.wait_for_server(0.01)
    server = offer()
    eventually(lambda: changes == [True])
    server.close()
    eventually(lambda: changes == [True, False])


@pytest.mark.parametrize("close", ["client", "node"])
def test_closing_the_client_leaves_goals_to_the_server(offer, console, client, close):
    server = offer()
    goal = client.send_goal(ENDLESS)
    assert goal.acceptance.result(30)
    (client if close == "client" else console).close()
    client.close()
    message = f"client of {client.name} was closed before the goal ended, which continues"
    with pytest.raises(rosglass.NodeClosedError, match=message):
        goal.result(30)
    assert [each.id for each in server.goals] == [goal.id]
    assert client.problem == "the client is closed"
    assert not client.ready
    for use in (client.send_goal, client.cancel_all, client.wait_for_server):
        with pytest.raises(rosglass.NodeClosedError, match="closed"):
            use()


def test_closing_a_goal_ends_the_watching(offer, client):
    server = offer()
    with client.send_goal(ENDLESS) as goal:
        assert goal.acceptance.result(30)
    goal.close()
    with pytest.raises(rosglass.NodeClosedError, match="was closed: its end is unknown"):
        goal.result(30)
    assert list(client.goals) == []
    assert len(server.goals) == 1


# -- the server ------------------------------------------------------------------------------------


def test_several_goals_run_at_once(offer, client):
    server = offer()
    goals = [client.send_goal({"order": order}) for order in (1_000_000, 4, 1_000_000, 3)]
    assert [goals[number].result(30).status for number in (1, 3)] == [GoalStatus.SUCCEEDED] * 2
    assert list(client.goals) == [goals[0], goals[2]]
    assert [goal.id for goal in server.goals] == [goals[0].id, goals[2].id]
    assert goals[2].cancel().result(30).accepted == (goals[2].id,)
    assert goals[2].result(30).status is GoalStatus.CANCELED
    assert goals[0].status.is_active


class Failed(dict):
    """A result whose own code fails."""

    def items(self):
        raise ZeroDivisionError("in the result")

    __getitem__ = __iter__ = __len__ = keys = get = items


def test_result_whose_own_code_fails_aborts_the_goal(offer, client, caplog):
    done = Future()
    offer(lambda goal: Failed() if goal.goal.order == 1 else done)
    goals = [client.send_goal({"order": order}) for order in (1, 2)]
    done.set_result(Failed())
    assert [goal.result(30).status for goal in goals] == [GoalStatus.ABORTED] * 2
    assert caplog.text.count("ZeroDivisionError: in the result") == 2


def test_failing_callback_aborts_the_goal(offer, client, caplog):
    def fail(goal):
        if goal.goal.order == 1:
            raise ValueError("the arm is off")
        if goal.goal.order == 2:
            return {"sequence": "text"}
        goal.abort({"sequence": [7]})
        return None

    server = offer(fail)
    goals = [client.send_goal({"order": order}) for order in (1, 2, 3)]
    results = [goal.result(30) for goal in goals]
    assert [result.status for result in results] == [GoalStatus.ABORTED] * 3
    assert [list(result.result.sequence) for result in results] == [[], [], [7]]
    failed = f"{server.name}: execute failed on goal {goals[0].id_text}, which is aborted"
    assert failed in caplog.text
    assert "ValueError: the arm is off" in caplog.text
    assert f"the result of goal {goals[1].id_text} does not fit, the goal is abo" in caplog.text
    assert "sequence: expected" in caplog.text


def test_operations_that_do_not_fit_the_state_of_a_goal_raise(offer, client, wire):
    kept, caught = [], []

    def execute(goal):
        kept.append(goal)
        for attempt in (
            goal.canceled,
            lambda: goal.succeed({"sequence": "x"}),
            lambda: goal.publish_feedback(sequence="x"),
            lambda: goal.publish_feedback({"sequence": [1]}, sequence=[2]),
        ):
            with pytest.raises(rosglass.Error) as refused:
                attempt()
            caught.append(str(refused.value))
        goal.publish_feedback({"sequence": [1]})
        goal.publish_feedback(client.type.feedback.create(sequence=[2]))
        goal.succeed({"sequence": [3]})
        return {"sequence": [4]}

    offer(execute)
    goal = client.send_goal()
    assert list(goal.result(30).result.sequence) == [3]
    for text, message in zip(
        caught,
        [
            "there was no request to cancel goal",
            "sequence: expected",
            "sequence: expected",
            "either feedback or keyword fields, not both",
        ],
        strict=True,
    ):
        assert message in text
    (theirs,) = kept
    assert (theirs.id, theirs.status) == (goal.id, GoalStatus.SUCCEEDED)
    if not wire.is_ros1:  # where clients do not learn when a goal was accepted
        assert theirs.accepted == goal.accepted
    assert theirs.id_text == goal.id_text
    assert f"{goal.id_text} succeeded" in repr(theirs)
    theirs.close()
    for late in (theirs.succeed, theirs.abort, theirs.canceled, theirs.publish_feedback):
        with pytest.raises(rosglass.Error, match="has ended as succeeded already"):
            late()


def test_return_value_after_the_end_is_logged(offer, client, caplog, eventually):
    def execute(goal):
        goal.succeed()
        return {"sequence": [1]}

    offer(execute)
    assert client.send_goal().result(30).status is GoalStatus.SUCCEEDED
    eventually(lambda: "what execute returned is dropped" in caplog.text)


def test_leaving_a_goals_block_ends_it(offer, client):
    def execute(goal):
        with goal:
            assert not goal.is_cancel_requested
        assert goal.is_cancel_requested

    offer(execute)
    assert client.send_goal().result(30).status is GoalStatus.ABORTED


@pytest.mark.parametrize(
    ("decision", "warning"),
    [
        (None, "accept returned None instead of True or False; rejecting goal"),
        (1, "accept returned 1 instead of True or False; rejecting goal"),
        (ValueError("broken"), "accept failed; rejecting goal"),
    ],
)
def test_goal_is_accepted_by_true_alone(offer, client, decision, warning, caplog):
    def accept(goal):
        if isinstance(decision, Exception):
            raise decision
        return decision

    offer(accept=accept)
    with pytest.raises(rosglass.GoalRejectedError):
        client.send_goal().result(30)
    assert warning in caplog.text


@pytest.mark.parametrize(
    ("decision", "warning"),
    [
        (True, ""),
        (None, "cancel returned None instead of True or False; cancelling goal"),
        (ValueError("broken"), "cancel failed; cancelling goal"),
    ],
)
def test_goal_is_cancelled_unless_the_callback_refuses(offer, client, decision, warning, caplog):
    seen = []

    def cancel(goal):
        seen.append((goal.id, threading.current_thread().name))
        if isinstance(decision, Exception):
            raise decision
        return decision

    offer(cancel=cancel)
    goal = client.send_goal(ENDLESS)
    assert goal.acceptance.result(30)
    assert goal.cancel().result(30).accepted == (goal.id,)
    assert goal.result(30).status is GoalStatus.CANCELED
    assert seen == [(goal.id, "robot callbacks")]
    assert warning in caplog.text


def test_goal_goes_on_when_the_user_refuses_to_cancel_it(offer, client, eventually):
    seen = []

    def refuse(goal):
        seen.append(goal)
        return False

    server = offer(cancel=refuse)
    goal = client.send_goal(ENDLESS)
    assert goal.acceptance.result(30)
    goal.cancel()
    (theirs,) = eventually(lambda: seen)
    assert list(server.goals) == [theirs]
    assert not theirs.is_cancel_requested
    eventually(lambda: theirs.status is GoalStatus.EXECUTING)


def test_cancel_request_is_accepted_although_the_executor_raises(offer, client, caplog, eventually):
    executor = Failing()
    server = offer(accept=lambda _: True, cancel=lambda _: False, executor=executor)
    goal = client.send_goal(ENDLESS)
    eventually(lambda: goal.status is GoalStatus.EXECUTING)
    # In ROS 1, the client learns of that before the executor gets the goal.
    eventually(lambda: [each.status for each in server.goals] == [GoalStatus.EXECUTING])
    executor.failing = True
    assert goal.cancel().result(30).accepted == (goal.id,)
    assert goal.result(30).status is GoalStatus.CANCELED
    with pytest.raises(rosglass.GoalRejectedError):
        client.send_goal({"order": 3}).result(30)
    executor.failing = False
    assert client.send_goal({"order": 3}).result(30).status is GoalStatus.SUCCEEDED
    assert "the executor of accept and cancel raised" in caplog.text


def test_cancel_request_is_accepted_although_callbacks_block_the_dispatcher(offer, robot, client):
    offer()
    goal = client.send_goal(ENDLESS)
    assert goal.acceptance.result(30)
    release = threading.Event()
    robot.create_timer(0.001, lambda: release.wait(30) and None)
    assert goal.cancel().result(30).accepted == (goal.id,)
    assert goal.result(30).status is GoalStatus.CANCELED
    release.set()


def test_goal_that_the_executor_rejects_is_aborted(offer, client, caplog):
    executor = Failing()
    executor.failing = True
    offer(executor=executor)
    assert client.send_goal({"order": 3}).result(30).status is GoalStatus.ABORTED
    executor.failing = False
    assert client.send_goal({"order": 3}).result(30).status is GoalStatus.SUCCEEDED
    assert "which cannot be executed: RuntimeError" in caplog.text


def test_goal_whose_event_loop_is_closed_is_aborted(offer, client, caplog):
    loop = asyncio.new_event_loop()
    loop.close()
    offer(executor=LoopExecutor(loop))
    assert client.send_goal({"order": 3}).result(30).status is GoalStatus.ABORTED
    assert "which cannot be executed: RuntimeError" in caplog.text


def test_goal_cancelled_before_its_turn_is_not_started(offer, client):
    turn, started, release = Dispatcher("turn"), [], threading.Event()
    turn.post(lambda: release.wait(30) and None)
    server = offer(started.append, executor=turn)
    goal = client.send_goal()
    assert goal.acceptance.result(30)
    assert [each.status for each in server.goals] == [GoalStatus.ACCEPTED]
    assert goal.cancel().result(30).accepted
    release.set()
    assert goal.result(30).status is GoalStatus.CANCELED
    assert started == []
    turn.close()


def test_goal_with_a_future_needs_no_thread(offer, client, eventually):
    """A promise announces the cancel request, as user interfaces need it."""
    goals, asked, answers = [], [], [Future(), Future()]

    def execute(goal):
        goals.append(goal)
        goal.cancel_request.on_done(asked.append)
        return answers[len(goals) - 1]

    executor = Dispatcher("goals")
    offer(execute, executor=executor)
    first, second = client.send_goal({"order": 1}), client.send_goal({"order": 2})
    eventually(lambda: len(goals) == 2)
    assert [goal.status for goal in goals] == [GoalStatus.EXECUTING] * 2
    assert not asked
    assert first.cancel().result(30).accepted
    eventually(lambda: asked == [goals[0].cancel_request])
    answers[0].set_result({"sequence": [1]})
    status, result = first.result(30)
    assert (status, list(result.sequence)) == (GoalStatus.CANCELED, [1])
    answers[1].set_exception(ValueError("no"))
    assert second.result(30).status is GoalStatus.ABORTED
    eventually(lambda: len(asked) == 2)  # it has ended
    executor.close()


def test_coroutines_execute_goals_in_their_loop(robot, console, topic, wire):
    decided = []

    async def execute(goal):
        decided.append(threading.current_thread())
        if goal.goal.order == 1:
            raise ValueError("broken")
        while not goal.is_cancel_requested:
            goal.publish_feedback(sequence=[1])
            await asyncio.sleep(0.005)
        return {"sequence": [1, 2]}

    def accept(goal):
        decided.append(threading.current_thread())
        return True

    async def main():
        robot.create_action_server(topic, wire.count, execute, accept=accept)
        client = console.create_action_client(topic, wire.count)
        broken, goal = client.send_goal({"order": 1}), client.send_goal()
        assert (await broken.done).status is GoalStatus.ABORTED
        assert await goal.acceptance
        with pytest.raises((asyncio.TimeoutError, TimeoutError)):
            await asyncio.wait_for(goal.done, 0.02)  # which does not end the goal
        await goal.cancel()
        return await goal.done

    status, result = asyncio.run(main())
    assert status is GoalStatus.CANCELED
    assert list(result.sequence) == [1, 2]
    assert set(decided) == {threading.current_thread()}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"execute": None}, "callback: expected something that can be called"),
        ({"accept": 7}, "accept: expected a plain function, or None"),
        ({"cancel": asyncio.sleep}, "cancel: expected a plain function, or None"),
        ({"executor": "gui"}, "executor: expected a rosglass.comm.Executor"),
        ({"execute": asyncio.sleep}, "created inside a running event loop"),
    ],
)
def test_invalid_callbacks_are_refused_at_creation(robot, topic, wire, arguments, message):
    options = {"execute": count, **arguments}
    with pytest.raises(rosglass.ArgumentError, match=f"{topic}: .*{message}"):
        robot.create_action_server(topic, wire.count, **options)
    assert topic not in robot.actions()


@pytest.mark.parametrize("close", ["server", "node"])
def test_closing_the_server_aborts_its_goals(offer, robot, client, close, eventually):
    ended = threading.Event()

    def execute(goal):
        try:
            while True:
                goal.publish_feedback(sequence=[1])
                goal.wait_for_cancel(0.005)
        finally:
            ended.set()

    server = offer(execute)
    goal = client.send_goal()
    eventually(lambda: goal.feedback)
    (server if close == "server" else robot).close()
    server.close()
    assert ended.is_set()
    assert goal.result(30).status is GoalStatus.ABORTED
    assert server.problem == "the server is closed"
    assert list(server.goals) == []
    eventually(lambda: not client.ready)


def test_closing_from_execute_does_not_hang(offer, client, eventually):
    servers = []
    servers.append(offer(lambda _: servers[0].close()))
    goal = client.send_goal()
    eventually(lambda: servers[0].closed)
    eventually(lambda: goal.status is GoalStatus.ABORTED)


def test_goal_that_ignores_closing_is_abandoned(offer, client, caplog, monkeypatch):
    monkeypatch.setattr("rosglass.comm.action_server._CLOSE_TIMEOUT_S", 0.2)
    started, release = threading.Event(), threading.Event()

    def execute(_):
        started.set()
        release.wait(30)

    server = offer(execute)
    goal = client.send_goal()
    assert started.wait(30)
    server.close()
    assert f"{server.name} {goal.id_text} still runs" in caplog.text
    release.set()
