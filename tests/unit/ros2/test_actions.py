"""Actions on a wire that the test steers."""

from __future__ import annotations

import threading
import time

import pytest
from waiting import nothing_happens

import rosglass
from rosglass.comm import (
    CancelAnswer,
    ConnectionState,
    EndpointKind,
    GoalStatus,
    Time,
)
from rosglass.comm.wire import SERVER_LEFT
from rosglass.interfaces import Library
from rosglass.ros2 import Ros2Node
from rosglass.ros2.action_server import _cancelable

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

    def send_status(self, goal, status, sec=5):
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
    for name, value in (
        ("GRACE_S", 0.05),
        ("OUTAGE_S", 0.05),
        ("_RETRY_S", 0.01),
        ("_OVERDUE_S", 0.05),
    ):
        monkeypatch.setattr(f"rosglass.ros2.action_client.{name}", value)


# -- both ends -----------------------------------------------------------------------------------


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


def test_server_announces_itself_as_an_action(robot, server):
    fake = robot.fake
    assert robot.actions() == {"/fib": [FIB]}
    assert {replier.info.name for replier in fake.repliers} == {
        f"/fib/_action/{part}" for part in ("send_goal", "cancel_goal", "get_result")
    }
    topics = {writer.info.name: (writer.info.type, writer.info.qos) for writer in fake.writers}
    assert topics["/fib/_action/feedback"] == (f"{FIB}_FeedbackMessage", rosglass.QoS())
    status = ("action_msgs/msg/GoalStatusArray", rosglass.QoS.latched())
    assert topics["/fib/_action/status"] == status


def test_feedback_and_status_never_come_before_the_acceptance(client, peer, eventually):
    seen = []
    goal = client.send_goal(
        on_feedback=lambda m: seen.append(list(m.sequence)), on_status_change=seen.append
    )
    peer.feed(goal, 1)
    peer.send_status(goal, 2)
    peer.feed(goal, 2)
    nothing_happens(0.02)
    assert seen == []
    assert goal.feedback is None
    peer.answer()
    eventually(lambda: seen == [ACCEPTED, EXECUTING, [1], [2]])
    assert goal.accepted == Time.from_parts(5, 0)


def test_feedback_of_other_goals_and_after_the_end_is_ignored(client, peer, eventually):
    seen = []
    one = client.send_goal(on_feedback=lambda m: seen.append(("one", list(m.sequence))))
    two = client.send_goal(on_feedback=lambda m: seen.append(("two", list(m.sequence))))
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
    eventually(lambda: seen == [("two", [2]), ("one", [1])])


def test_feedback_that_waits_is_taken_before_the_end(client, peer, eventually):
    seen = []
    goal = client.send_goal(
        on_feedback=lambda m: seen.append(list(m.sequence)), on_done=seen.append
    )
    peer.answer()
    eventually(lambda: peer.asked)
    message = {"goal_id": {"uuid": goal.id}, "feedback": {"sequence": [1]}}
    peer.feedback.waiting.append(peer.types["FeedbackMessage"].encode(message))
    peer.result(goal, 4)
    eventually(lambda: seen == [[1], goal])


def test_duplicate_feedback_is_reported_once(client, peer, eventually):
    seen = []
    goal = client.send_goal(on_feedback=lambda m: seen.append(list(m.sequence)))
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
    eventually(lambda: [2] in seen)
    assert seen == [[1], [2]]


@pytest.mark.parametrize("code", [4, 5, 6])
def test_status_topic_lists_every_goal_that_has_not_ended(client, peer, code, eventually):
    goals = [client.send_goal() for _ in range(3)]
    for number in (1, 2, 3):
        peer.answer(number)
    seen = []
    for goal in goals:
        goal.on_status_change(lambda status, g=goal: seen.append((g, status)))
    infos = [
        {"goal_info": {"goal_id": {"uuid": goal.id}}, "status": status}
        for goal, status in zip(goals, (code, 1, 3), strict=True)
    ]
    array = rosglass.load("action_msgs/msg/GoalStatusArray")
    peer.status.receive(array.encode(status_list=[{"status": 2}, *infos]))
    ended = {4: SUCCEEDED, 5: CANCELED, 6: ABORTED}[code]
    eventually(lambda: seen == [(goals[0], ended), (goals[2], CANCELING)])
    assert [goal.status for goal in goals] == [ended, ACCEPTED, CANCELING]
    peer.status.receive(array.encode(status_list=[infos[1], {**infos[2], "status": 2}]))
    assert goals[2].status is CANCELING  # it never goes back
    assert not goals[0].done.done()
    eventually(lambda: peer.asked[2:])
    peer.result(goals[0], code, [1])
    assert list(goals[0].result(30).result.sequence) == [1]


def test_status_that_is_unknown_is_ignored(client, peer):
    goal = client.send_goal()
    peer.answer()
    peer.send_status(goal, 0)
    peer.send_status(goal, 77)
    assert goal.status is ACCEPTED


def test_lost_acceptance_is_known_from_the_status(client, peer):
    goal = client.send_goal(timeout=1.0)
    peer.send_status(goal, 2, sec=9)
    assert goal.acceptance.result(30) is True
    assert goal.status is EXECUTING
    assert goal.accepted == Time.from_parts(9, 0)


def test_goal_of_a_server_that_left_is_cancelled_if_it_still_runs(client, peer, eventually):
    goal = client.send_goal()
    peer.send_goal.reply(1, None, SERVER_LEFT)
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        goal.result(30)
    eventually(lambda: peer.cancel_goal.sent)
    asked = peer.cancel_type.request.decode(peer.cancel_goal.sent[0])
    assert bytes(asked.goal_info.goal_id.uuid) == goal.id


def test_unanswered_goal_times_out_and_is_cancelled(client, peer, eventually):
    goal = client.send_goal(timeout=0.05)
    message = (
        f"neither accepted nor rejected goal {goal.id_text} within 0.05 s; it was asked to cancel"
    )
    with pytest.raises(rosglass.TimeoutError, match=message):
        goal.result(5)
    with pytest.raises(rosglass.TimeoutError, match=message):
        goal.acceptance.result(0)
    assert goal.status is LOST
    eventually(lambda: peer.cancel_goal.sent)
    asked = peer.cancel_type.request.decode(peer.cancel_goal.sent[0])
    assert bytes(asked.goal_info.goal_id.uuid) == goal.id
    assert asked.goal_info.stamp.nanoseconds == 0
    peer.answer()  # too late
    assert list(client.goals) == []


def test_goal_cancelled_before_it_was_accepted_is_cancelled_then(client, peer, eventually):
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
    ("code", "reason"),
    [
        (0, "there was no goal to cancel"),
        (1, "the server refuses to cancel"),
        (2, "the server does not know the goal (any more)"),
        (3, "the goal has ended already, or is being cancelled already"),
        (9, "the server answers with the unknown code 9"),
    ],
)
def test_refusals_to_cancel_are_explained(client, peer, code, reason):
    goal = client.send_goal()
    peer.answer()
    answer = goal.cancel()
    peer.canceled(1, code)
    assert answer.result(30) == CancelAnswer((), reason)
    assert goal.status is ACCEPTED


def test_server_that_never_answers_requests_to_cancel(client, peer):
    goal = client.send_goal()
    peer.answer()
    with pytest.raises(rosglass.TimeoutError, match=r"did not answer .* within 0\.02 s; some serv"):
        goal.cancel(timeout=0.02).result(5)
    peer.vanish()
    with pytest.raises(rosglass.ServiceUnavailableError, match="could not be asked to cancel with"):
        client.cancel_all(timeout=0.02).result(5)
    assert not goal.done.done()


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


def test_result_is_requested_again_when_asking_failed(client, peer, impatient, eventually):
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


def test_result_is_requested_again_when_the_end_was_announced(client, peer, impatient, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.send_status(goal, 6)
    eventually(lambda: len(peer.asked) > 2)
    assert peer.get_result.forgotten[:1] == [1]
    peer.result(goal, 6)
    assert goal.result(30).status is ABORTED


def test_result_is_requested_again_when_the_server_is_back(client, peer, eventually):
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
def test_goal_is_lost_with_its_server(client, peer, middleware, impatient, connected, eventually):
    middleware.become(
        ConnectionState.CONNECTED if connected else ConnectionState.LOST, "cable pulled"
    )
    seen = []
    goal = client.send_goal(on_status_change=seen.append, on_done=seen.append)
    peer.answer()
    assert goal.acceptance.result(30)
    peer.vanish()
    with pytest.raises(
        rosglass.ConnectionLostError,
        match=f"went away before goal {goal.id_text} ended; its outcome is unknown .* cable pulled",
    ):
        goal.result(30)
    eventually(lambda: seen == [ACCEPTED, LOST, goal])
    assert list(client.goals) == []


def test_goal_whose_end_is_known_keeps_it_without_the_result(client, peer, impatient, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.send_status(goal, 4)
    peer.vanish()
    with pytest.raises(rosglass.ConnectionLostError, match="which has ended as succeeded"):
        goal.result(30)
    assert goal.status is SUCCEEDED


def test_restarted_server_does_not_know_the_goal(client, peer, eventually):
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


def test_restarted_server_that_does_not_answer(client, peer, monkeypatch, eventually):
    lost, known = client.send_goal(), client.send_goal()
    peer.answer(1)
    peer.answer(2)
    eventually(lambda: len(peer.asked) == 2)
    peer.vanish()
    peer.appear(gid=b"t" * 16)
    eventually(lambda: len(peer.asked) == 4)
    peer.send_status(known, 2)  # a server knows this one: it only looks new
    eventually(lambda: known.status is EXECUTING)
    monkeypatch.setattr("rosglass.ros2.action_client.GRACE_S", 0.05)
    with pytest.raises(rosglass.ConnectionLostError, match="went away before"):
        lost.result(30)
    peer.feed(known, 1)
    assert known.status is EXECUTING


def test_result_that_cannot_be_decoded(client, peer, eventually):
    goal = client.send_goal()
    peer.answer()
    eventually(lambda: peer.asked)
    peer.get_result.reply(1, b"\0\1\0\0\4")
    with pytest.raises(rosglass.ServiceError, match=f"that are not a {FIB}_GetResult_Response"):
        goal.result(30)
    assert goal.status is LOST


# -- types ---------------------------------------------------------------------------------------


def test_types_that_do_not_fit_are_reported(node, middleware, caplog, eventually):
    client = node.create_action_client("/fib", FIB)
    for end in middleware.requesters:
        end.linked = True
    middleware.appear(SERVER, "/fib/_action/send_goal", "a_msgs/action/Else_SendGoal")
    problem = (
        f"/robot offers a_msgs/action/Else_SendGoal here, not {FIB}_SendGoal: it gets no goals"
    )
    assert problem in client.problem
    assert not client.ready
    eventually(lambda: caplog.text.count(problem) == 1)
    unknown = node.create_action_client("/fib")
    eventually(lambda: "no definition of a_msgs/action/Else" in unknown.problem)
    middleware.appear(SERVER, "/fib/_action/send_goal", f"{FIB}_SendGoal", node="two")
    eventually(lambda: f"several types (a_msgs/action/Else, {FIB}); choose one" in unknown.problem)


@pytest.mark.parametrize("part", ["SendGoal", "GetResult", "FeedbackMessage"])
def test_unknown_definition_of_an_action_part_is_reported(node, middleware, part, eventually):
    client = node.create_action_client("/fib", FIB)
    kind, name = {
        "SendGoal": (SERVER, "send_goal"),
        "GetResult": (SERVER, "get_result"),
        "FeedbackMessage": (PUBLISHER, "feedback"),
    }[part]
    middleware.appear(kind, f"/fib/_action/{name}", f"{FIB}_{part}", OTHER_HASH)
    problem = f"/robot has {FIB}_{part}, which cannot be used"
    eventually(lambda: problem in client.problem and OTHER_HASH in client.problem)
    fixed = node.create_action_client("/fib", rosglass.load(FIB))
    problem = f"/robot has another definition of {FIB}_{part} ({OTHER_HASH}, ours is RIHS01_"
    assert problem in fixed.problem


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
        waiting = client.send_goal({"order": 3}, timeout=1.0)
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


def test_calls_of_the_action_services(node, robot, server, middleware, eventually):
    """The codes and orders that peers rely on."""

    def codes():
        arrays = [
            rosglass.load("action_msgs/msg/GoalStatusArray").decode(data)
            for writer in robot.fake.writers
            if writer.info.name == "/fib/_action/status"
            for data in writer.written
        ]
        return [[entry.status for entry in array.status_list] for array in arrays]

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
    assert ask["get_result"].call({"goal_id": {"uuid": b"n" * 16}}).status == 0  # after those
    assert not result.done()
    # A goal that is canceled before it executes never has the status 2.
    eventually(lambda: codes() == [[1], [2]])
    canceled = ask["cancel_goal"].call(cancel)
    assert canceled.return_code == 0
    assert bytes(canceled.goals_canceling[0].goal_id.uuid) == mine["uuid"]
    assert canceled.goals_canceling[0].stamp == taken.stamp
    assert result.result(30).status == other.result(30).status == 5
    assert ask["get_result"].call({"goal_id": mine}).status == 5  # kept
    assert ask["cancel_goal"].call(cancel).return_code == 3  # terminated
    assert not ask["send_goal"].call({"goal_id": mine}).accepted
    assert codes() == [[1], [2], [3], [5]]


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
def test_cancel_request_selects_goals(goal_id, stamp, chosen, code):
    """As rcl_action_process_cancel_request."""

    class Goal:
        def __init__(self, number, cancelable=True):
            self.id, self._cancelable = bytes([number]) * 16, cancelable
            self.accepted = Time.from_parts(10 * number, 0)

    goals = [Goal(1), Goal(2), Goal(3, False), Goal(4, False)]
    found = _cancelable(goals, bytes([goal_id]) * 16, Time.from_parts(stamp, 0))
    assert found == ([goal for goal in goals if goal.id[0] in chosen], code)


def test_results_are_kept_for_a_while(client, server, node, monkeypatch, eventually):
    ask = node.create_service_client("/fib/_action/get_result")
    goals = [client.send_goal({"order": 2}) for _ in range(4)]
    for goal in goals:
        goal.result(30)

    def kept():
        return sum(ask.call({"goal_id": {"uuid": goal.id}}).status != 0 for goal in goals)

    assert kept() == 4
    monkeypatch.setattr("rosglass.ros2.action_server._MAX_ENDED", 3)
    eventually(lambda: kept() == 3)
    monkeypatch.setattr("rosglass.ros2.action_server._RESULT_TIMEOUT_S", 0.0)
    eventually(lambda: kept() == 0)


# -- the end -------------------------------------------------------------------------------------


def test_incomplete_server_is_reported(client, middleware, eventually):
    end = middleware.requesters[0]
    middleware.appear(SERVER, end.info.name, end.info.type, end.info.type_hash)
    problem = (
        "/fib/_action/send_goal, /fib/_action/cancel_goal, /fib/_action/get_result does not answ"
    )
    eventually(lambda: problem in client.problem)


def test_goal_whose_client_closes_while_it_fetches_the_result_raises(node, client, server):
    goal = client.send_goal({"order": 99})
    assert goal.acceptance.result(30)
    # What a closing client's services answer may come before the goal hears of the end.
    client._closed = True
    client._endpoints.get_result.close()
    with pytest.raises(rosglass.NodeClosedError, match="client of /fib was closed before the goal"):
        goal.result(30)


@pytest.mark.parametrize("close", ["server", "node"])
def test_goal_accepted_just_before_closing_gets_its_result(robot, node, close, eventually):
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
    assert ask["get_result"].call({"goal_id": mine}).status == 6
    closing.join(5)
    assert not closing.is_alive()


def test_closing_does_not_wait_for_clients_that_never_ask(robot, node, monkeypatch):
    monkeypatch.setattr("rosglass.ros2.action_server._ASK_TIMEOUT_S", 0.1)
    server = robot.create_action_server("/fib", FIB, fibonacci)
    ask = node.create_service_client("/fib/_action/send_goal")
    never = node.create_service_client("/fib/_action/get_result")
    assert ask.wait_for_server(30)
    assert never.wait_for_server(30)
    assert ask.call({"goal": {"order": 99}}).accepted
    server.close()
    assert not ask.wait_for_server(0)
