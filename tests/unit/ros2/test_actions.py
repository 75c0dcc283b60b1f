"""Actions on a wire that the test steers."""

from __future__ import annotations

import asyncio
import threading
import time
from concurrent.futures import Future

import pytest
from waiting import nothing_happens

import rosglass
from rosglass.comm import (
    ActionResult,
    CancelAnswer,
    ConnectionState,
    Dispatcher,
    EndpointKind,
    Executor,
    GoalStatus,
    Time,
)
from rosglass.interfaces import Library
from rosglass.ros2 import Ros2Node
from rosglass.ros2.action_server import _cancelable
from rosglass.wires.base import SERVER_LEFT

pytestmark = pytest.mark.usefixtures("quick")

SERVER, PUBLISHER = EndpointKind.SERVICE_SERVER, EndpointKind.PUBLISHER
FIB = "example_interfaces/action/Fibonacci"
OTHER_HASH = "RIHS01_" + "0" * 64
ACCEPTED, EXECUTING = GoalStatus.ACCEPTED, GoalStatus.EXECUTING
CANCELING, SUCCEEDED = GoalStatus.CANCELING, GoalStatus.SUCCEEDED
CANCELED, ABORTED, LOST = GoalStatus.CANCELED, GoalStatus.ABORTED, GoalStatus.LOST


def fibonacci(goal):
    """Count up to the order, with feedback; an order of 99 goes on until it is cancelled."""
    sequence = [0, 1]
    while len(sequence) < goal.goal.order:
        if goal.wait_for_cancel(0.005):
            break
        sequence = [*sequence[:97], sequence[-1] + 1]
        goal.publish_feedback(sequence=sequence)
    return {"sequence": sequence}


@pytest.fixture
def server(robot):
    return robot.create_action_server("/fib", FIB, fibonacci)


@pytest.fixture
def client(node):
    return node.create_action_client("/fib", FIB)


class Peer:
    """A server made by hand: what it is asked for, and its answers."""

    def __init__(self, middleware):
        self.middleware = middleware
        self.send_goal, self.cancel_goal, self.get_result = middleware.requesters[-3:]
        self.feedback, self.status = middleware.readers[-2:]
        self.types = {
            part: rosglass.load(f"{FIB}_{part}")
            for part in ("SendGoal", "GetResult", "FeedbackMessage")
        }
        self.cancel_type = rosglass.load("action_msgs/srv/CancelGoal")
        self.keys = []
        self.appear()

    def appear(self, gid=b"s" * 16, hashes=None):
        for end, part in (
            (self.send_goal, "SendGoal"),
            (self.cancel_goal, "CancelGoal"),
            (self.get_result, "GetResult"),
        ):
            info = end.info
            type_hash = (hashes or {}).get(part, info.type_hash)
            args = (SERVER, info.name, info.type, type_hash)
            self.keys.append(self.middleware.appear(*args, gid=gid))
            end.linked = True

    def vanish(self):
        for end in (self.send_goal, self.cancel_goal, self.get_result):
            end.linked = False
        for key in self.keys:
            self.middleware.graph.remove(key)
        self.keys.clear()

    def answer(self, number=1, accepted=True, sec=5):
        data = self.types["SendGoal"].response.encode(accepted=accepted, stamp={"sec": sec})
        self.send_goal.reply(number, data)

    def result(self, goal, status, sequence=()):
        """Answer the newest request for a goal's result."""
        ids = [self.types["GetResult"].request.decode(sent).goal_id for sent in self.asked]
        number = max(n for n, found in enumerate(ids, 1) if bytes(found.uuid) == goal.id)
        data = self.types["GetResult"].response.encode(
            status=status, result={"sequence": list(sequence)}
        )
        self.get_result.reply(number, data)

    @property
    def asked(self):
        return self.get_result.sent

    def feed(self, goal, *sequence, **options):
        message = {"goal_id": {"uuid": goal.id}, "feedback": {"sequence": list(sequence)}}
        self.feedback.receive(self.types["FeedbackMessage"].encode(message), **options)

    def tell(self, goal, status, sec=5):
        info = {"goal_id": {"uuid": goal.id}, "stamp": {"sec": sec}}
        array = {"status_list": [{"goal_info": info, "status": status}]}
        self.status.receive(rosglass.load("action_msgs/msg/GoalStatusArray").encode(array))

    def canceled(self, number, code, *ids):
        infos = [{"goal_id": {"uuid": each}} for each in ids]
        data = self.cancel_type.response.encode(return_code=code, goals_canceling=infos)
        self.cancel_goal.reply(number, data)


@pytest.fixture
def peer(client, middleware):
    return Peer(middleware)


@pytest.fixture
def impatient(monkeypatch):
    """Shorten what is waited for."""
    for name, value in (("_GRACE", 0.05), ("_OUTAGE", 0.05), ("_AGAIN", 0.01), ("_OVERDUE", 0.05)):
        monkeypatch.setattr(f"rosglass.ros2.client_goal.{name}", value)


# -- both ends -----------------------------------------------------------------------------------


def test_a_goal_from_beginning_to_end(node, client, server, eventually):
    told = []
    goal = client.send_goal(
        {"order": 5},
        on_feedback=lambda message: told.append(list(message.sequence)),
        on_status_change=told.append,
        on_done=told.append,
    )
    assert goal.result(30) == ActionResult(SUCCEEDED, goal.done.result().result)
    assert list(goal.result().result.sequence) == [0, 1, 2, 3, 4]
    eventually(lambda: goal in told)
    assert told == [ACCEPTED, EXECUTING, [0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3, 4], SUCCEEDED, goal]
    assert list(goal.feedback.sequence) == [0, 1, 2, 3, 4]
    assert goal.status is SUCCEEDED
    assert goal.acceptance.result() is True
    assert abs((Time.now() - goal.accepted).seconds) < 5
    assert goal.goal.order == 5
    assert len(goal.id) == 16
    assert goal.id_text == goal.id.hex()
    assert repr(goal) == f"<Ros2ClientGoal {goal.id_text} succeeded>"
    assert list(client.goals) == list(server.goals) == []
    assert client.problem == server.problem == ""
    assert repr(client) == f"<Ros2ActionClient /fib [{FIB}]>"
    assert repr(server) == f"<Ros2ActionServer /fib [{FIB}]>"


def test_a_goal_sent_before_the_server_is_up(client, robot):
    goal = client.send_goal({"order": 3})
    assert goal.status is GoalStatus.PENDING
    robot.create_action_server("/fib", FIB, fibonacci)
    assert goal.result(30).status is SUCCEEDED


def test_several_goals_at_once(client, server):
    goals = [client.send_goal({"order": order}) for order in (99, 4, 99, 3)]
    assert [goal.result(30).status for goal in (goals[1], goals[3])] == [SUCCEEDED] * 2
    assert list(client.goals) == [goals[0], goals[2]]
    assert [goal.id for goal in server.goals] == [goals[0].id, goals[2].id]
    assert goals[2].cancel().result(30) == CancelAnswer((goals[2].id,))
    assert goals[2].result(30).status is CANCELED
    assert goals[0].status in (ACCEPTED, EXECUTING)


def test_cancelling_one_all_and_before(client, server, connect):
    first, second = client.send_goal({"order": 99}), client.send_goal({"order": 99})
    assert first.acceptance.result(30)
    assert second.acceptance.result(30)
    third = client.send_goal({"order": 99})
    assert third.acceptance.result(30)
    answer = client.cancel_before(second.accepted).result(30)
    assert set(answer.accepted) == {first.id, second.id}
    assert {first.result(30).status, second.result(30).status} == {CANCELED}
    assert third.status.is_active
    others = connect("other").create_action_client("/fib")
    theirs = others.send_goal({"order": 99})
    assert theirs.acceptance.result(30)
    assert set(client.cancel_all().result(30).accepted) == {third.id, theirs.id}
    assert theirs.result(30).status is CANCELED
    assert third.result(30).status is CANCELED
    assert client.cancel_all().result(30) == CancelAnswer((), "there was no goal to cancel")
    again = third.cancel().result(30)
    assert again == CancelAnswer((), "the goal has ended already: canceled")


def test_a_rejected_goal_leaves_nothing_behind(client, robot, eventually):
    server = robot.create_action_server("/fib", FIB, fibonacci, accept=lambda g: g.order < 10)
    told = []
    goal = client.send_goal({"order": 10}, on_status_change=told.append, on_done=told.append)
    with pytest.raises(
        rosglass.GoalRejectedError, match=f"/fib does not accept goal {goal.id_text}"
    ):
        goal.result(30)
    assert goal.acceptance.result() is False
    assert goal.status is GoalStatus.REJECTED
    assert goal.accepted is None
    assert goal.cancel().result(30).reason == "the goal has ended already: rejected"
    eventually(lambda: told == [GoalStatus.REJECTED, goal])
    assert list(client.goals) == []
    assert server._goals == {}
    assert server._deciding == set()
    assert client.send_goal({"order": 3}).result(30).status is SUCCEEDED


def test_a_goal_that_fails(client, robot, caplog):
    def fail(goal):
        if goal.goal.order == 1:
            raise ValueError("the arm is off")
        if goal.goal.order == 2:
            return {"sequence": "text"}
        goal.abort({"sequence": [7]})
        return None

    robot.create_action_server("/fib", FIB, fail)
    goals = [client.send_goal({"order": order}) for order in (1, 2, 3)]
    results = [goal.result(30) for goal in goals]
    assert [result.status for result in results] == [ABORTED] * 3
    assert [list(result.result.sequence) for result in results] == [[], [], [7]]
    assert f"/fib: execute failed on goal {goals[0].id_text}, which is aborted" in caplog.text
    assert "ValueError: the arm is off" in caplog.text
    assert f"the result of goal {goals[1].id_text} does not fit, the goal is abo" in caplog.text
    assert "sequence: expected" in caplog.text


def test_the_client_is_awaited_in_asyncio(client, server):
    async def main():
        goal = client.send_goal({"order": 99})
        assert await goal.acceptance
        with pytest.raises((asyncio.TimeoutError, TimeoutError)):
            await asyncio.wait_for(goal.done, 0.02)  # which does not end the goal
        assert (await goal.cancel()).accepted == (goal.id,)
        return (await goal.done).status

    assert asyncio.run(main()) is CANCELED


def test_the_server_runs_coroutines_in_their_loop(node, robot):
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
        robot.create_action_server("/fib", FIB, execute, accept=accept)
        client = node.create_action_client("/fib", FIB)
        broken, goal = client.send_goal({"order": 1}), client.send_goal()
        assert (await broken.done).status is ABORTED
        assert await goal.acceptance
        await goal.cancel()
        return await goal.done

    status, result = asyncio.run(main())
    assert status is CANCELED
    assert list(result.sequence) == [1, 2]
    assert set(decided) == {threading.current_thread()}


# -- the client ----------------------------------------------------------------------------------


def test_names_types_and_profiles_on_the_wire(client, middleware):
    ends = [*middleware.requesters, *middleware.readers]
    infos = [getattr(end, "info", None) or end for end in ends]
    names = [info.name if hasattr(info, "name") else info.topic for info in infos]
    types = [info.type if hasattr(info, "type") else info.type_name for info in infos]
    hashes = [info.type_hash for info in infos]
    assert names == [
        f"/fib/_action/{part}"
        for part in ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    ]
    assert types == [
        f"{FIB}_SendGoal",
        "action_msgs/srv/CancelGoal",
        f"{FIB}_GetResult",
        f"{FIB}_FeedbackMessage",
        "action_msgs/msg/GoalStatusArray",
    ]
    assert hashes == [rosglass.load(name).rihs01 for name in types]


def test_the_server_announces_itself_as_an_action(robot, server):
    fake = robot.fake
    assert robot.actions() == {"/fib": [FIB]}
    assert {replier.info.name for replier in fake.repliers} == {
        f"/fib/_action/{part}" for part in ("send_goal", "cancel_goal", "get_result")
    }
    topics = {writer.info.name: (writer.info.type, writer.info.qos) for writer in fake.writers}
    assert topics["/fib/_action/feedback"] == (f"{FIB}_FeedbackMessage", rosglass.QoS())
    status = ("action_msgs/msg/GoalStatusArray", rosglass.QoS.latched())
    assert topics["/fib/_action/status"] == status


@pytest.mark.parametrize("create", ["create_action_client", "create_action_server"])
@pytest.mark.parametrize(
    ("name", "type_", "error", "told"),
    [
        ("a b", FIB, rosglass.InvalidNameError, "contains ' '"),
        ("/x", "nowhere_msgs/action/No", rosglass.TypeNotFoundError, "nowhere_msgs/action/No"),
        ("/x", "std_msgs/msg/String", rosglass.TypeNotFoundError, "is not an? action type"),
        ("/x", 7, rosglass.TypeNotFoundError, "7 is not an? action type"),
    ],
)
def test_what_cannot_be_used_is_refused_at_creation(node, create, name, type_, error, told):
    arguments = (name, type_) if create == "create_action_client" else (name, type_, fibonacci)
    with pytest.raises(error, match=told):
        getattr(node, create)(*arguments)


@pytest.mark.parametrize(
    ("goal", "options", "told"),
    [
        ({"order": "x"}, {}, "order: expected an integer"),
        ({"speed": 1}, {}, "speed"),
        ({}, {"timeout": -1}, "timeout: expected seconds"),
        ({}, {"executor": "gui"}, "executor: expected a rosglass.comm.Executor"),
        ({}, {"on_feedback": 7}, "callback: expected something that can be called"),
        ({}, {"on_status_change": 7}, "callback: expected something that can be called"),
        ({}, {"on_done": 7}, "on_done: expected something that can be called"),
    ],
)
def test_what_does_not_fit_is_refused_and_not_sent(client, peer, goal, options, told):
    with pytest.raises(rosglass.ConversionError, match=told):
        client.send_goal(goal, **options)
    assert peer.send_goal.sent == []
    assert list(client.goals) == []


def test_feedback_and_status_never_come_before_the_acceptance(client, peer, eventually):
    told = []
    goal = client.send_goal(
        on_feedback=lambda m: told.append(list(m.sequence)), on_status_change=told.append
    )
    peer.feed(goal, 1)
    peer.tell(goal, 2)
    peer.feed(goal, 2)
    nothing_happens(0.02)
    assert told == []
    assert goal.feedback is None
    peer.answer()
    eventually(lambda: told == [ACCEPTED, EXECUTING, [1], [2]])
    assert goal.accepted == Time.from_parts(5, 0)


def test_feedback_of_others_and_after_the_end_is_not_told(client, peer, eventually):
    told = []
    one = client.send_goal(on_feedback=lambda m: told.append(("one", list(m.sequence))))
    two = client.send_goal(on_feedback=lambda m: told.append(("two", list(m.sequence))))
    peer.answer(1)
    peer.answer(2)
    peer.feed(two, 2)
    peer.feed(one, 1)
    stranger = rosglass.load(f"{FIB}_FeedbackMessage").encode(goal_id={"uuid": bytes(16)})
    peer.feedback.receive(stranger)
    eventually(lambda: peer.asked[1:])
    peer.result(one, 4)
    assert one.result(30).status is SUCCEEDED
    peer.feed(one, 3)
    eventually(lambda: told == [("two", [2]), ("one", [1])])


def test_feedback_that_waits_is_taken_before_the_end(client, peer, eventually):
    told = []
    goal = client.send_goal(
        on_feedback=lambda m: told.append(list(m.sequence)), on_done=told.append
    )
    peer.answer()
    eventually(lambda: peer.asked)
    message = {"goal_id": {"uuid": goal.id}, "feedback": {"sequence": [1]}}
    peer.feedback.waiting.append(peer.types["FeedbackMessage"].encode(message))
    peer.result(goal, 4)
    eventually(lambda: told == [[1], goal])


def test_a_sample_that_comes_twice_is_told_once(client, peer, eventually):
    told = []
    goal = client.send_goal(on_feedback=lambda m: told.append(list(m.sequence)))
    peer.answer()
    peer.feed(goal, 1)
    peer.feedback.count -= 1
    stamp = time.time_ns
    try:
        time.time_ns = lambda: 1
        peer.feed(goal, 1)
    finally:
        time.time_ns = stamp
    peer.feed(goal, 2)
    eventually(lambda: [2] in told)
    assert told == [[1], [2]]


@pytest.mark.parametrize("code", [4, 5, 6])
def test_the_status_topic_tells_of_every_goal_that_has_not_ended(client, peer, code, eventually):
    goals = [client.send_goal() for _ in range(3)]
    for number in (1, 2, 3):
        peer.answer(number)
    told = []
    for goal in goals:
        goal.on_status_change(lambda status, g=goal: told.append((g, status)))
    infos = [
        {"goal_info": {"goal_id": {"uuid": goal.id}}, "status": status}
        for goal, status in zip(goals, (code, 1, 3), strict=True)
    ]
    array = rosglass.load("action_msgs/msg/GoalStatusArray")
    peer.status.receive(array.encode(status_list=[{"status": 2}, *infos]))
    ended = {4: SUCCEEDED, 5: CANCELED, 6: ABORTED}[code]
    eventually(lambda: told == [(goals[0], ended), (goals[2], CANCELING)])
    assert [goal.status for goal in goals] == [ended, ACCEPTED, CANCELING]
    peer.status.receive(array.encode(status_list=[infos[1], {**infos[2], "status": 2}]))
    assert goals[2].status is CANCELING  # it never goes back
    assert not goals[0].done.done()
    eventually(lambda: peer.asked[2:])
    peer.result(goals[0], code, [1])
    assert list(goals[0].result(30).result.sequence) == [1]


def test_a_status_that_is_not_known_is_ignored(client, peer):
    goal = client.send_goal()
    peer.answer()
    peer.tell(goal, 0)
    peer.tell(goal, 77)
    assert goal.status is ACCEPTED


def test_an_acceptance_that_gets_lost_shows_by_the_status(client, peer):
    goal = client.send_goal(timeout=0.05)
    peer.tell(goal, 2, sec=9)
    assert goal.acceptance.result(30) is True
    assert goal.status is EXECUTING
    assert goal.accepted == Time.from_parts(9, 0)


def test_a_goal_whose_server_went_is_cancelled_should_it_run(client, peer, eventually):
    goal = client.send_goal()
    peer.send_goal.reply(1, None, SERVER_LEFT)
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        goal.result(30)
    eventually(lambda: peer.cancel_goal.sent)
    asked = peer.cancel_type.request.decode(peer.cancel_goal.sent[0])
    assert bytes(asked.goal_info.goal_id.uuid) == goal.id


def test_a_goal_that_nobody_answers_is_given_up_and_cancelled(client, peer, eventually):
    goal = client.send_goal(timeout=0.05)
    told = (
        f"neither accepted nor rejected goal {goal.id_text} within 0.05 s; it was asked to cancel"
    )
    with pytest.raises(rosglass.TimeoutError, match=told):
        goal.result(5)
    with pytest.raises(rosglass.TimeoutError, match=told):
        goal.acceptance.result(0)
    assert goal.status is LOST
    eventually(lambda: peer.cancel_goal.sent)
    asked = peer.cancel_type.request.decode(peer.cancel_goal.sent[0])
    assert bytes(asked.goal_info.goal_id.uuid) == goal.id
    assert asked.goal_info.stamp.nanoseconds == 0
    peer.answer()  # too late
    assert list(client.goals) == []


def test_without_a_server_a_goal_ends_after_its_time(client, connect):
    connect("robot").create_action_server("/base/fib", FIB, fibonacci)
    goal = client.send_goal(timeout=0.02)
    told = (
        r"no goal could be sent to /fib within 0\.02 s: no server offers the action /fib "
        rf"\[{FIB}\] on fake:// \(CONNECTED: in this process\); did you mean /base/fib\?"
    )
    with pytest.raises(rosglass.ServiceUnavailableError, match=told):
        goal.result(5)
    assert goal.status is LOST


def test_a_goal_cancelled_before_it_was_sent_is_not_sent(client, middleware, eventually):
    told = []
    goal = client.send_goal(on_status_change=told.append, on_done=told.append)
    assert goal.cancel().result(0) == CancelAnswer((goal.id,))
    assert goal.result(0) == ActionResult(CANCELED, rosglass.load(FIB).result.create())
    assert goal.acceptance.result(0) is False
    eventually(lambda: told == [CANCELED, goal])
    queued = client.send_goal()
    client.cancel_all()
    assert queued.result(30).status is CANCELED
    peer = Peer(middleware)
    client.wait_for_server(30)
    eventually(lambda: peer.cancel_goal.sent)
    assert peer.send_goal.sent == []


def test_a_goal_cancelled_before_it_was_accepted_is_cancelled_then(client, peer, eventually):
    goal = client.send_goal()
    answer = goal.cancel()
    late = client.send_goal().cancel(timeout=0.02)
    assert peer.cancel_goal.sent == []
    with pytest.raises(rosglass.TimeoutError, match="has neither accepted nor rejected it"):
        late.result(5)
    peer.answer(1)
    eventually(lambda: peer.cancel_goal.sent)
    peer.canceled(1, 0, goal.id)
    assert answer.result(30) == CancelAnswer((goal.id,))
    assert goal.status is CANCELING
    rejected = client.send_goal()
    answer = rejected.cancel()
    peer.answer(3, accepted=False)
    assert answer.result(30).reason == "the goal has ended already: rejected"


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (0, "there was no goal to cancel"),
        (1, "the server refuses to cancel"),
        (2, "the server does not know the goal (any more)"),
        (3, "the goal has ended already, or is being cancelled already"),
        (9, "the server answers with the unknown code 9"),
    ],
)
def test_refusals_to_cancel_are_explained(client, peer, code, told):
    goal = client.send_goal()
    peer.answer()
    answer = goal.cancel()
    peer.canceled(1, code)
    assert answer.result(30) == CancelAnswer((), told)
    assert goal.status is ACCEPTED


def test_a_server_that_never_answers_requests_to_cancel(client, peer):
    goal = client.send_goal()
    peer.answer()
    with pytest.raises(rosglass.TimeoutError, match=r"did not answer .* within 0\.02 s; some serv"):
        goal.cancel(timeout=0.02).result(5)
    peer.vanish()
    with pytest.raises(rosglass.ServiceUnavailableError, match="could not be asked to cancel with"):
        client.cancel_all(timeout=0.02).result(5)
    assert not goal.done.done()


@pytest.mark.parametrize("time_", [Time(), Time(-1), Time(2**31 * 10**9), 5, None])
def test_odd_times_to_cancel_before_are_refused(client, peer, time_):
    with pytest.raises(
        rosglass.ConversionError, match=r"time: .* cancel_all\(\) cancels all goals"
    ):
        client.cancel_before(time_)
    assert peer.cancel_goal.sent == []


def test_slow_callbacks_get_the_newest_feedback(client, peer, caplog, eventually):
    slow, told = Dispatcher("slow"), []
    release = threading.Event()
    slow.post(lambda: release.wait(30) and None)
    goal = client.send_goal(on_feedback=lambda m: told.append(int(m.sequence[0])), executor=slow)
    peer.answer()
    for value in range(100):
        peer.feed(goal, value)
    release.set()
    eventually(lambda: told == list(range(90, 100)))
    assert caplog.text.count("only the newest 10 wait") == 1
    slow.close()


@pytest.mark.parametrize("topic", ["feedback", "status"])
def test_rubbish_is_named_once_per_publisher(client, peer, middleware, caplog, topic):
    goal = client.send_goal()
    peer.answer()
    reader = getattr(peer, topic)
    middleware.appear(PUBLISHER, reader.info.name, reader.info.type, node="mad", gid=b"m" * 16)
    for _ in range(3):
        reader.receive(b"\0\1\0\0" + goal.id + b"\xff\xff\xff\xff", gid=b"m" * 16)
        reader.receive(b"\0\1", gid=b"n" * 16)
        reader.receive(b"\0\1\0\0" + goal.id, hash=OTHER_HASH, gid=b"o" * 16)
    assert caplog.text.count(f"/fib: ignoring {topic} of /mad: ") == 1
    assert caplog.text.count(f"/fib: ignoring {topic} of gid {b'n'.hex() * 16}: ") == 1
    assert caplog.text.count(f"another definition of {reader.info.type} ({OTHER_HASH}") == 1
    peer.feed(goal, 5)
    assert list(goal.feedback.sequence) == [5]


# -- results that do not come easily -------------------------------------------------------------


def test_a_result_is_asked_for_again_when_asking_failed(client, peer, impatient, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    assert peer.get_result.timeouts == [None]
    peer.get_result.reply(1, None, "the link broke")
    eventually(lambda: len(peer.asked) == 2)
    peer.result(goal, 2)  # a server that does not wait for the end
    eventually(lambda: len(peer.asked) == 3)
    peer.result(goal, 4, [1])
    assert goal.result(30).status is SUCCEEDED


def test_a_result_is_asked_for_again_when_the_end_was_announced(
    client, peer, impatient, eventually
):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.tell(goal, 6)
    eventually(lambda: len(peer.asked) > 2)
    assert peer.get_result.forgotten[:1] == [1]
    peer.result(goal, 6)
    assert goal.result(30).status is ABORTED


def test_a_result_is_asked_for_again_when_the_server_is_back(client, peer, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    changes = []
    client.on_ready_change(changes.append)
    peer.vanish()
    eventually(lambda: changes == [False])
    peer.appear()
    eventually(lambda: len(peer.asked) == 2)
    assert peer.get_result.forgotten == [1]
    assert not goal.done.done()
    peer.result(goal, 4)
    assert goal.result(30).status is SUCCEEDED


@pytest.mark.parametrize("connected", [True, False])
def test_a_goal_is_lost_with_its_server(client, peer, middleware, impatient, connected, eventually):
    middleware.become(ConnectionState.CONNECTED if connected else ConnectionState.LOST, "told why")
    told = []
    goal = client.send_goal(on_status_change=told.append, on_done=told.append)
    peer.answer()
    assert goal.acceptance.result(30)
    peer.vanish()
    with pytest.raises(
        rosglass.ConnectionLostError,
        match=f"went away before goal {goal.id_text} ended; nobody knows .* told why",
    ):
        goal.result(30)
    eventually(lambda: told == [ACCEPTED, LOST, goal])
    assert list(client.goals) == []


def test_a_goal_whose_end_is_known_keeps_it_without_the_result(client, peer, impatient, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.tell(goal, 4)
    peer.vanish()
    with pytest.raises(rosglass.ConnectionLostError, match="which has ended as succeeded"):
        goal.result(30)
    assert goal.status is SUCCEEDED


def test_a_restarted_server_does_not_know_the_goal(client, peer, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.vanish()
    peer.appear(gid=b"t" * 16)
    eventually(lambda: len(peer.asked) == 2)
    peer.result(goal, 0)
    with pytest.raises(rosglass.ConnectionLostError, match=f"does not know goal {goal.id_text} an"):
        goal.result(30)
    assert goal.status is LOST


def test_a_restarted_server_that_does_not_answer(client, peer, impatient, eventually):
    lost, known = client.send_goal(), client.send_goal()
    peer.answer(1)
    peer.answer(2)
    eventually(lambda: len(peer.asked) == 2)
    peer.vanish()
    peer.appear(gid=b"t" * 16)
    eventually(lambda: len(peer.asked) == 4)
    peer.tell(known, 2)  # somebody has it: the server only looks new
    with pytest.raises(rosglass.ConnectionLostError, match="went away before"):
        lost.result(30)
    peer.feed(known, 1)
    assert known.status is EXECUTING


def test_a_result_that_cannot_be_decoded(client, peer, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.get_result.reply(1, b"\0\1\0\0\4")
    with pytest.raises(rosglass.ServiceError, match=f"bytes that are no {FIB}_GetResult_Response"):
        goal.result(30)
    assert goal.status is LOST


# -- types ---------------------------------------------------------------------------------------


def test_the_type_is_discovered(node, robot, eventually):
    client = node.create_action_client("/fib")
    assert "type not known yet" in repr(client)
    robot.create_action_server("/fib", FIB, fibonacci)
    assert client.wait_for_server(30)
    assert client.type.name == FIB
    assert client.send_goal({"order": 3}).result(30).status is SUCCEEDED


def test_goals_sent_before_the_type_is_known(node, robot, eventually):
    client = node.create_action_client("/fib")
    wanted = {"order": 3}
    goal = client.send_goal(wanted, timeout=None)
    wanted["order"] = 99  # of no concern any more
    canceled, late = client.send_goal({"order": 99}), client.send_goal(timeout=0.01)
    wrong = client.send_goal({"order": "three"})
    with pytest.raises(rosglass.ConversionError, match="expected a message or a dict"):
        client.send_goal(3)
    assert goal.goal is None
    assert goal.status is GoalStatus.PENDING
    assert canceled.cancel().result(30).accepted == (canceled.id,)
    assert (canceled.status, canceled.acceptance.result(30)) == (CANCELED, False)
    with pytest.raises(rosglass.ServiceUnavailableError, match="cancelled before any server told"):
        canceled.result(1)
    with pytest.raises(rosglass.ServiceUnavailableError, match=r"within 0\.01 s: no server offers"):
        late.result(5)
    with pytest.raises(rosglass.ServiceUnavailableError, match=r"asked to cancel within .* s: no"):
        client.cancel_before(Time(1), 0.01).result(5)
    robot.create_action_server("/fib", FIB, fibonacci)
    assert goal.result(5).result.sequence.tolist() == [0, 1, 2]
    assert goal.goal.order == 3
    with pytest.raises(rosglass.ConversionError, match="order: expected"):
        wrong.result(30)
    assert client.goals == ()


def test_cancelling_waits_for_the_type(node, robot):
    client = node.create_action_client("/fib")
    goal = client.send_goal({"order": 99})
    answer, other = client.cancel_all(), client.cancel_before(Time(1))
    assert goal.status is CANCELED
    assert not answer.done()
    robot.create_action_server("/fib", FIB, fibonacci)
    assert (answer.result(30).accepted, other.result(30).accepted) == ((), ())


def test_closing_ends_goals_whose_type_is_not_known(node):
    client = node.create_action_client("/fib")
    goal, answer = client.send_goal({"order": 3}), client.cancel_before(Time(1))
    client.close()
    with pytest.raises(rosglass.NodeClosedError, match="closed before the goal ended"):
        goal.result(30)
    with pytest.raises(rosglass.NodeClosedError, match="is closed"):
        answer.result(30)


def test_types_that_do_not_fit_are_named(node, middleware, caplog, eventually):
    client = node.create_action_client("/fib", FIB)
    for end in middleware.requesters:
        end.linked = True
    middleware.appear(SERVER, "/fib/_action/send_goal", "a_msgs/action/Else_SendGoal")
    told = f"/robot offers a_msgs/action/Else_SendGoal here, not {FIB}_SendGoal: it gets no goals"
    assert told in client.problem
    assert not client.ready
    eventually(lambda: caplog.text.count(told) == 1)
    unknown = node.create_action_client("/fib")
    eventually(lambda: "no definition of a_msgs/action/Else" in unknown.problem)
    middleware.appear(SERVER, "/fib/_action/send_goal", f"{FIB}_SendGoal", node="two")
    eventually(lambda: f"several types (a_msgs/action/Else, {FIB}); choose one" in unknown.problem)


@pytest.mark.parametrize("part", ["SendGoal", "GetResult", "FeedbackMessage"])
def test_a_part_with_an_unknown_definition_is_named(node, middleware, part, eventually):
    client = node.create_action_client("/fib", FIB)
    kind, name = {
        "SendGoal": (SERVER, "send_goal"),
        "GetResult": (SERVER, "get_result"),
        "FeedbackMessage": (PUBLISHER, "feedback"),
    }[part]
    middleware.appear(kind, f"/fib/_action/{name}", f"{FIB}_{part}", OTHER_HASH)
    told = f"/robot has {FIB}_{part}, which cannot be used"
    eventually(lambda: told in client.problem and OTHER_HASH in client.problem)
    fixed = node.create_action_client("/fib", rosglass.load(FIB))
    told = f"/robot has another definition of {FIB}_{part} ({OTHER_HASH}, ours is RIHS01_"
    assert told in fixed.problem


@pytest.fixture
def robots_version(tmp_path):
    """A library with the robot's own version of the action, which differs in goal and result."""
    text = "int32 order\nint32 speed\n---\nint32[] sequence\nint32 code\n---\nint32[] sequence\n"
    folder = tmp_path / "example_interfaces" / "action"
    folder.mkdir(parents=True)
    (folder / "Fibonacci.action").write_text(text)
    (folder.parent / "package.xml").write_text("<package><name>example_interfaces</name></package>")
    newer = Library()
    newer.add_path(tmp_path)
    newer.prefer("folders")
    theirs = {
        part: rosglass.load(f"{FIB}_{part}", library=newer)
        for part in ("SendGoal", "GetResult", "FeedbackMessage")
    }
    library = Library()
    library.add_path(tmp_path)
    library.prefer("distribution")
    return library, theirs


def test_each_part_is_taken_in_the_version_that_is_announced(
    middleware, robots_version, eventually
):
    library, theirs = robots_version
    with Ros2Node(middleware, "fake://", "cockpit", library=library) as node:
        client = node.create_action_client("/fib", FIB)
        waiting = client.send_goal({"order": 3}, timeout=60)
        peer = Peer(middleware)
        old = peer.send_goal
        assert waiting.goal.type != theirs["SendGoal"]
        peer.vanish()
        peer.appear(hashes={part: kind.rihs01 for part, kind in theirs.items()})
        eventually(lambda: len(middleware.requesters) > 3 and middleware.requesters[-1].info)
        eventually(lambda: old.closed)
        new = Peer(middleware)
        new.types |= theirs
        eventually(lambda: new.send_goal.sent)
        sent = theirs["SendGoal"].request.decode(new.send_goal.sent[0])
        assert sent.goal.to_dict() == {"order": 3, "speed": 0}
        new.answer()
        eventually(lambda: new.get_result.sent)
        new.get_result.reply(1, theirs["GetResult"].response.encode(status=4, result={"code": 7}))
        assert waiting.result(30).result.code == 7
        assert client.type.goal.create(speed=1).speed == 1
        assert "code" in client.type.result.create()


def test_goals_of_a_server_that_is_replaced_by_another_version(
    middleware, robots_version, eventually
):
    library, theirs = robots_version
    with Ros2Node(middleware, "fake://", "cockpit", library=library) as node:
        client = node.create_action_client("/fib", FIB)
        peer = Peer(middleware)
        running, asked = client.send_goal(), client.send_goal()
        eventually(lambda: peer.send_goal.sent[1:])
        peer.answer(1)
        peer.vanish()
        peer.appear(hashes={part: kind.rihs01 for part, kind in theirs.items()})
        for goal in (running, asked):
            with pytest.raises(rosglass.ConnectionLostError, match="replaced by one with another"):
                goal.result(30)
            assert goal.status is LOST


# -- the server ----------------------------------------------------------------------------------


def test_a_server_that_is_asked_by_hand(node, robot, server, middleware, eventually):
    """The codes and orders that peers rely on."""
    ask = {
        part: node.create_service_client(f"/fib/_action/{part}")
        for part in ("send_goal", "get_result", "cancel_goal")
    }
    for each in ask.values():
        assert each.wait_for_server(30)
    mine = {"uuid": b"m" * 16}
    assert ask["get_result"].call({"goal_id": mine}).status == 0  # unknown
    cancel = {"goal_info": {"goal_id": mine}}
    assert ask["cancel_goal"].call(cancel).return_code == 2  # unknown goal id
    taken = ask["send_goal"].call({"goal_id": mine, "goal": {"order": 99}})
    assert taken.accepted
    assert taken.stamp.sec > 0
    again = ask["send_goal"].call({"goal_id": mine, "goal": {"order": 1}})
    assert not again.accepted  # its id is in use
    result = ask["get_result"].call_async({"goal_id": mine}, timeout=None)
    other = ask["get_result"].call_async({"goal_id": mine}, timeout=None)
    nothing_happens(0.02)
    assert not result.done()
    canceled = ask["cancel_goal"].call(cancel)
    assert canceled.return_code == 0
    assert bytes(canceled.goals_canceling[0].goal_id.uuid) == mine["uuid"]
    assert canceled.goals_canceling[0].stamp == taken.stamp
    assert result.result(30).status == other.result(30).status == 5
    assert ask["get_result"].call({"goal_id": mine}).status == 5  # kept
    assert ask["cancel_goal"].call(cancel).return_code == 3  # terminated
    assert not ask["send_goal"].call({"goal_id": mine}).accepted
    arrays = [
        rosglass.load("action_msgs/msg/GoalStatusArray").decode(data)
        for writer in robot.fake.writers
        if writer.info.name == "/fib/_action/status"
        for data in writer.written
    ]
    codes = [[entry.status for entry in array.status_list] for array in arrays]
    assert codes == [[1], [2], [3], [5]]


@pytest.mark.parametrize(
    ("goal_id", "stamp", "chosen", "code"),
    [
        (0, 0, [1, 2], 0),
        (0, 15, [1], 0),
        (0, 20, [1, 2], 0),
        (0, 5, [], 0),
        (1, 0, [1], 0),
        (3, 0, [], 3),
        (4, 0, [], 3),
        (9, 0, [], 2),
        (2, 15, [1, 2], 0),
        (9, 15, [1], 0),
    ],
    ids=str,
)
def test_what_a_request_to_cancel_means(goal_id, stamp, chosen, code):
    """As rcl_action_process_cancel_request."""

    class Goal:
        def __init__(self, number, cancelable=True):
            self.id, self.cancelable = bytes([number]) * 16, cancelable
            self.accepted = Time.from_parts(10 * number, 0)

    goals = [Goal(1), Goal(2), Goal(3, False), Goal(4, False)]
    found = _cancelable(goals, bytes([goal_id]) * 16, Time.from_parts(stamp, 0))
    assert found == ([goal for goal in goals if goal.id[0] in chosen], code)


@pytest.mark.parametrize(
    ("decision", "canceled", "told"),
    [
        (True, True, ""),
        (False, False, ""),
        (None, True, "cancel returned None instead of True or False; cancelling goal"),
        (ValueError("broken"), True, "cancel failed; cancelling goal"),
    ],
)
def test_who_decides_on_cancelling(client, robot, decision, canceled, told, caplog):
    seen = []

    def cancel(goal):
        seen.append((goal, threading.current_thread().name))
        if isinstance(decision, Exception):
            raise decision
        return decision

    server = robot.create_action_server("/fib", FIB, fibonacci, cancel=cancel)
    goal = client.send_goal({"order": 99})
    assert goal.acceptance.result(30)
    answer = goal.cancel().result(30)
    assert answer.accepted == ((goal.id,) if canceled else ())
    assert answer.reason == ("" if canceled else "the server refuses to cancel")
    assert [(g.id, where) for g, where in seen] == [(goal.id, "robot callbacks")]
    assert told in caplog.text
    if not canceled:
        assert [g.id for g in server.goals] == [goal.id]


@pytest.mark.parametrize(
    ("decision", "told"),
    [
        (None, "accept returned None instead of True or False; rejecting goal"),
        (1, "accept returned 1 instead of True or False; rejecting goal"),
        (ValueError("broken"), "accept failed; rejecting goal"),
    ],
)
def test_a_goal_is_accepted_by_true_alone(client, robot, decision, told, caplog):
    def accept(goal):
        if isinstance(decision, Exception):
            raise decision
        return decision

    robot.create_action_server("/fib", FIB, fibonacci, accept=accept)
    with pytest.raises(rosglass.GoalRejectedError):
        client.send_goal().result(30)
    assert told in caplog.text


class Failing(Executor):
    """Runs each job on a thread of its own, until it fails."""

    failing = False

    def post(self, job):
        if self.failing:
            raise RuntimeError("cannot schedule new futures after shutdown")
        threading.Thread(target=job, daemon=True).start()


def test_a_stop_is_taken_although_the_executor_raises(client, robot, caplog):
    executor = Failing()
    robot.create_action_server(
        "/fib",
        FIB,
        fibonacci,
        accept=lambda _: True,
        cancel=lambda _: False,
        executor=executor,
    )
    goal = client.send_goal({"order": 99})
    assert goal.acceptance.result(30)
    executor.failing = True
    assert goal.cancel().result(30).accepted == (goal.id,)
    assert goal.result(30).status is CANCELED
    with pytest.raises(rosglass.GoalRejectedError):
        client.send_goal({"order": 3}).result(30)
    executor.failing = False
    assert client.send_goal({"order": 3}).result(30).status is SUCCEEDED
    assert "the executor of accept and cancel raised" in caplog.text


def test_a_goal_that_the_executor_does_not_take_is_aborted(client, robot, caplog):
    executor = Failing()
    executor.failing = True
    robot.create_action_server("/fib", FIB, fibonacci, executor=executor)
    assert client.send_goal({"order": 3}).result(30).status is ABORTED
    executor.failing = False
    assert client.send_goal({"order": 3}).result(30).status is SUCCEEDED
    assert "which cannot be executed: RuntimeError" in caplog.text


def test_a_stop_is_taken_although_callbacks_hold_up_the_dispatcher(client, robot, server):
    goal = client.send_goal({"order": 99})
    assert goal.acceptance.result(30)
    release = threading.Event()
    robot._core.dispatcher.post(lambda: release.wait(30) and None)
    assert goal.cancel().result(30).accepted == (goal.id,)
    assert goal.result(30).status is CANCELED
    release.set()


def test_a_goal_cancelled_before_its_turn_is_not_started(client, robot):
    turn, started = Dispatcher("turn"), []
    release = threading.Event()
    turn.post(lambda: release.wait(30) and None)
    robot.create_action_server("/fib", FIB, started.append, executor=turn)
    goal = client.send_goal()
    assert goal.acceptance.result(30)
    assert goal.status is ACCEPTED
    assert goal.cancel().result(30).accepted
    release.set()
    assert goal.result(30).status is CANCELED
    assert started == []
    turn.close()


def test_what_a_running_goal_may_and_may_not_do(client, robot, eventually):
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
        goal.publish_feedback(rosglass.load(FIB).feedback.create(sequence=[2]))
        goal.succeed({"sequence": [3]})
        return {"sequence": [4]}

    robot.create_action_server("/fib", FIB, execute)
    goal = client.send_goal()
    assert list(goal.result(30).result.sequence) == [3]
    assert "nobody asked to cancel goal" in caught[0]
    assert "sequence: expected" in caught[1]
    assert "sequence: expected" in caught[2]
    assert "either feedback or keyword fields, not both" in caught[3]
    theirs = kept[0]
    assert (theirs.id, theirs.status, theirs.accepted) == (goal.id, SUCCEEDED, goal.accepted)
    assert repr(theirs) == f"<Ros2ServerGoal {goal.id_text} succeeded>"
    theirs.close()
    for late in (theirs.succeed, theirs.abort, theirs.canceled, theirs.publish_feedback):
        with pytest.raises(rosglass.Error, match="has ended as succeeded already"):
            late()


def test_a_future_lets_a_goal_go_on_without_a_thread(client, robot, eventually):
    """Told of a request to cancel by a promise: what user interfaces need."""
    goals, asked, answers = [], [], [Future(), Future()]

    def execute(goal):
        goals.append(goal)
        goal.cancel_request.on_done(asked.append)
        return answers[len(goals) - 1]

    executor = Dispatcher("goals")
    robot.create_action_server("/fib", FIB, execute, executor=executor)
    first, second = client.send_goal({"order": 1}), client.send_goal({"order": 2})
    eventually(lambda: len(goals) == 2)
    assert [goal.status for goal in goals] == [EXECUTING, EXECUTING]
    assert not asked
    assert first.cancel().result(20).accepted
    eventually(lambda: asked == [goals[0].cancel_request])
    answers[0].set_result({"sequence": [1]})
    assert (first.result(20).status, list(first.result().result.sequence)) == (CANCELED, [1])
    answers[1].set_exception(ValueError("no"))
    assert second.result(20).status is ABORTED
    eventually(lambda: len(asked) == 2)  # it has ended
    executor.close()


def test_what_execute_returns_after_the_end_is_logged(client, robot, caplog, eventually):
    def execute(goal):
        goal.succeed()
        return {"sequence": [1]}

    robot.create_action_server("/fib", FIB, execute)
    assert client.send_goal().result(30).status is SUCCEEDED
    eventually(lambda: "what execute returned is dropped" in caplog.text)


def test_leaving_a_goals_block_ends_it(client, robot):
    def execute(goal):
        with goal:
            assert not goal.is_cancel_requested
        assert goal.is_cancel_requested

    robot.create_action_server("/fib", FIB, execute)
    assert client.send_goal().result(30).status is ABORTED


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"execute": None}, "callback: expected something that can be called"),
        ({"accept": 7}, "accept: expected a plain function, or None"),
        ({"cancel": asyncio.sleep}, "cancel: expected a plain function, or None"),
        ({"executor": "gui"}, "executor: expected a rosglass.comm.Executor"),
        ({"execute": asyncio.sleep}, "created inside a running event loop"),
    ],
)
def test_callbacks_that_cannot_run_are_refused_at_creation(robot, arguments, told):
    options = {"execute": fibonacci, **arguments}
    with pytest.raises(rosglass.ConversionError, match=f"/fib: .*{told}"):
        robot.create_action_server("/fib", FIB, **options)
    assert robot.actions() == {}


def test_results_are_kept_for_a_while(client, server, monkeypatch, eventually):
    goals = [client.send_goal({"order": 2}) for _ in range(4)]
    for goal in goals:
        goal.result(30)
    monkeypatch.setattr("rosglass.ros2.action_server._MAX_ENDED", 3)
    eventually(lambda: len(server._goals) == 3)
    monkeypatch.setattr("rosglass.ros2.action_server._RESULT_TIMEOUT", 0.0)
    eventually(lambda: server._goals == {})


# -- the end -------------------------------------------------------------------------------------


def test_readiness_is_told_to_and_fro(client, robot, eventually):
    changes = []
    client.on_ready_change(changes.append)
    assert not client.wait_for_server(0.01)
    server = robot.create_action_server("/fib", FIB, fibonacci)
    assert client.wait_for_server(30)
    eventually(lambda: changes == [True])
    server.close()
    eventually(lambda: changes == [True, False])


def test_an_incomplete_server_is_named(client, middleware, eventually):
    end = middleware.requesters[0]
    middleware.appear(SERVER, end.info.name, end.info.type, end.info.type_hash)
    told = "/fib/_action/send_goal, /fib/_action/cancel_goal, /fib/_action/get_result does not answ"
    eventually(lambda: told in client.problem)


@pytest.mark.parametrize("close", ["client", "node"])
def test_closing_the_client_leaves_goals_to_the_server(node, client, server, close, eventually):
    running = client.send_goal({"order": 99})
    assert running.acceptance.result(30)
    (client if close == "client" else node).close()
    client.close()
    told = "client of /fib was closed before the goal ended, which goes on"
    with pytest.raises(rosglass.NodeClosedError, match=told):
        running.result(30)
    assert [goal.id for goal in server.goals] == [running.id]
    assert client.problem == "the client is closed"
    for use in (client.send_goal, client.cancel_all, client.wait_for_server):
        with pytest.raises(rosglass.NodeClosedError, match="closed"):
            use()
    with pytest.raises(rosglass.NodeClosedError, match="closed"):
        running.cancel().result(0) if running.status.is_active else client.send_goal()


def test_a_goal_whose_client_closes_while_it_asks_for_the_result_says_so(node, client, server):
    goal = client.send_goal({"order": 99})
    assert goal.acceptance.result(30)
    # What a closing client's services answer may come before the goal hears of the end.
    client._closed = True
    client._ends.get_result.close()
    with pytest.raises(rosglass.NodeClosedError, match="client of /fib was closed before the goal"):
        goal.result(30)


def test_cancelling_takes_seconds(client):
    goal = client.send_goal({"order": 99})
    with pytest.raises(rosglass.ConversionError, match="timeout: expected seconds"):
        goal.cancel("soon")


def test_closing_a_goal_ends_the_watching(client, server):
    told = []
    with client.send_goal({"order": 99}, on_status_change=told.append) as goal:
        assert goal.acceptance.result(30)
    goal.close()
    with pytest.raises(rosglass.NodeClosedError, match="is not watched any more: it was closed"):
        goal.result(30)
    assert list(client.goals) == []
    assert len(server.goals) == 1


@pytest.mark.parametrize("close", ["server", "node"])
def test_closing_the_server_aborts_its_goals_and_tells(client, robot, close, eventually):
    ended = threading.Event()

    def execute(goal):
        try:
            while True:
                goal.publish_feedback(sequence=[1])
                goal.wait_for_cancel(0.005)
        finally:
            ended.set()

    server = robot.create_action_server("/fib", FIB, execute)
    goal = client.send_goal()
    eventually(lambda: goal.feedback)
    eventually(lambda: server._goals[goal.id]._waiting)
    (server if close == "server" else robot).close()
    server.close()
    assert ended.is_set()
    assert goal.result(30).status is ABORTED
    assert server.problem == "the server is closed"
    assert list(server.goals) == []
    eventually(lambda: not client.ready)


@pytest.mark.parametrize("close", ["server", "node"])
def test_a_goal_accepted_just_before_closing_is_told_its_end(robot, node, close, eventually):
    server = robot.create_action_server("/fib", FIB, fibonacci)
    ask = {
        part: node.create_service_client(f"/fib/_action/{part}")
        for part in ("send_goal", "get_result")
    }
    for each in ask.values():
        assert each.wait_for_server(30)
    mine = {"uuid": b"m" * 16}
    assert ask["send_goal"].call({"goal_id": mine, "goal": {"order": 99}}).accepted
    closing = threading.Thread(target=(server if close == "server" else robot).close)
    closing.start()
    eventually(lambda: server.closed)
    time.sleep(0.05)  # on its way
    assert ask["get_result"].call({"goal_id": mine}).status == 6
    closing.join(5)
    assert not closing.is_alive()


def test_closing_does_not_wait_for_clients_that_never_ask(robot, node, monkeypatch):
    monkeypatch.setattr("rosglass.ros2.action_server._ASKING", 0.1)
    server = robot.create_action_server("/fib", FIB, fibonacci)
    ask = node.create_service_client("/fib/_action/send_goal")
    never = node.create_service_client("/fib/_action/get_result")
    assert ask.wait_for_server(30)
    assert never.wait_for_server(30)
    assert ask.call({"goal": {"order": 99}}).accepted
    server.close()
    assert not ask.wait_for_server(0)


def test_closing_from_execute_does_not_hang(client, robot, eventually):
    server = robot.create_action_server("/fib", FIB, lambda _: server.close())
    goal = client.send_goal()
    started = time.monotonic()
    eventually(lambda: server.closed)
    eventually(lambda: goal.status is ABORTED)
    assert time.monotonic() - started < 15


def test_a_goal_that_ignores_the_end_is_left_to_its_thread(client, robot, monkeypatch, caplog):
    monkeypatch.setattr("rosglass.comm.goal_runner._PATIENCE", 0.05)
    started, release = threading.Event(), threading.Event()

    def execute(_):
        started.set()
        release.wait(30)

    server = robot.create_action_server("/fib", FIB, execute)
    goal = client.send_goal()
    assert started.wait(30)
    server.close()
    assert f"/fib {goal.id_text} still runs" in caplog.text
    release.set()


def test_clients_and_servers_leave_nothing_behind(node, robot, middleware):
    before = [list(each._core._members) for each in (node, robot)]
    threads = threading.active_count()
    for _ in range(20):
        with (
            robot.create_action_server("/fib", FIB, fibonacci),
            node.create_action_client("/fib", FIB) as client,
        ):
            assert client.send_goal({"order": 3}).result(30).status is SUCCEEDED
    assert [list(each._core._members) for each in (node, robot)] == before
    assert middleware.graph.actions() == {}
    assert threading.active_count() <= threads + 4  # dispatchers and timers of the nodes
