"""Topics beyond sending and receiving: matching, problems, messages that cannot be decoded."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest
from inside import core_of
from waiting import at_rate, nothing_happens

import rosglass
from rosglass import Duration, QoS
from rosglass.comm import (
    IMMEDIATE,
    ConnectionState,
    DeadlineMissed,
    Durability,
    EndpointKind,
    Liveliness,
    Reliability,
    SamplesLost,
)
from rosglass.comm import timers as timers_module
from rosglass.comm.timers import Watchdog
from rosglass.interfaces import Library
from rosglass.messages import OpaqueType
from rosglass.ros2 import Ros2Node

PUBLISHER, SUBSCRIPTION = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION
STRING, TWIST = "std_msgs/msg/String", "geometry_msgs/msg/Twist"
HELLO = rosglass.load(STRING).encode({"data": "hello"})
SECRET = "secret_msgs/msg/Thing"
HASH, OTHER = "RIHS01_" + "a" * 64, "RIHS01_" + "b" * 64
BEST_EFFORT = QoS.sensor_data()
MANUAL = QoS(liveliness=Liveliness.MANUAL_BY_TOPIC, lease_duration=Duration.from_seconds(0.05))


def hash_of(name):
    return rosglass.load(name).rihs01


@pytest.fixture
def robot(middleware):
    """Let the robot publish; ``robot(topic, qos=..., name=...)`` returns the endpoint's key."""

    def appear(topic="/t", type_name=STRING, type_hash=None, qos=None, node="robot", gid=b""):
        known = hash_of(type_name) if type_hash is None else type_hash
        return middleware.appear(PUBLISHER, topic, type_name, known, qos, node, gid)

    return appear


@pytest.fixture
def asker(middleware):
    """Let the robot subscribe, as `robot` publishes."""

    def appear(topic="/t", type_name=STRING, type_hash=None, qos=None, node="robot"):
        known = hash_of(type_name) if type_hash is None else type_hash
        return middleware.appear(SUBSCRIPTION, topic, type_name, known, qos, node)

    return appear


# -- who matches ---------------------------------------------------------------------------------


def test_publisher_names_subscriptions_of_other_definitions(node, asker, eventually):
    publisher = node.create_publisher("/t", STRING)
    asker(type_hash=OTHER, node="other")
    problem = eventually(lambda: publisher.problem)
    definition = f"/other has another definition of {STRING} ({OTHER}, ours is {hash_of(STRING)})"
    assert f"{definition}: it receives nothing from us" in problem
    assert publisher.subscription_count() == 0


def test_subscriptions_with_another_definition_receive_us_where_names_match(
    node, middleware, asker, eventually
):
    middleware.matches_hashes = False
    publisher = node.create_publisher("/t", STRING)
    asker(type_hash=OTHER, node="other")
    problem = eventually(lambda: publisher.problem)
    assert "it receives our messages all the same" in problem
    assert "receives nothing" not in problem
    assert publisher.subscription_count() == 1


def test_subscription_names_the_publisher_that_left_and_a_lost_connection(
    node, middleware, robot, eventually, caplog
):
    subscription = node.create_subscription("/t", STRING)
    never = node.create_subscription("/never", STRING)
    came = threading.Event()
    subscription.on_matched(lambda _: came.set())
    key = robot()
    assert came.wait(30)
    middleware.graph.remove(key)
    problem = eventually(lambda: subscription.problem)
    assert re.fullmatch(r"it has had no publisher since \d\d:\d\d:\d\d, when /robot left", problem)
    assert [r for r in caplog.records if r.levelname == "WARNING"] == []
    middleware.become(ConnectionState.LOST, "connection to the router lost")
    eventually(lambda: subscription.problem == f"{problem}; connection to the router lost")
    middleware.become(ConnectionState.CONNECTED)
    eventually(lambda: subscription.problem == problem)
    robot()
    eventually(lambda: not subscription.problem)
    middleware.become(ConnectionState.LOST, "connection to the router lost")
    eventually(lambda: subscription.problem == "connection to the router lost")
    assert never.problem == ""


# -- what is available ---------------------------------------------------------------------------


def test_services_are_reliable_and_volatile_whatever_is_available(node, middleware):
    for create in (node.create_service_client, node.create_service_server):
        more = (id,) if create == node.create_service_server else ()
        create("/s", "std_srvs/srv/Trigger", *more, qos=QoS.best_available(5))
    ends = (*middleware.requesters, *middleware.repliers)
    assert {end.info.qos for end in ends if end.info.name == "/s"} == {QoS(depth=5)}


def test_publisher_takes_the_limits_that_subscriptions_ask_for(node, asker):
    asker(qos=replace(MANUAL, deadline=Duration.from_seconds(2)))
    publisher = node.create_publisher("/t", STRING, QoS.best_available())
    assert publisher.qos.deadline == Duration.from_seconds(2)
    assert publisher.qos.liveliness is Liveliness.MANUAL_BY_TOPIC
    assert publisher.qos.lease_duration == MANUAL.lease_duration


def test_later_publisher_that_offers_less_is_received(node, middleware, robot, eventually):
    middleware.matches_qos = True
    subscription = node.create_subscription("/t", STRING, qos=QoS.best_available())
    conflicts = []
    subscription.on_incompatible_qos(conflicts.append)
    assert subscription.qos.durability is Durability.TRANSIENT_LOCAL
    keys = [robot(qos=QoS.latched(), node="latched")]
    eventually(lambda: subscription.publisher_count() == 1)
    assert len(middleware.readers) == 1
    keys.append(robot(qos=BEST_EFFORT, node="fast"))
    first, second = eventually(lambda: len(r := middleware.readers) == 2 and r)
    eventually(lambda: first.closed)
    assert not second.closed
    assert subscription.qos == second.info.qos == QoS(reliability=Reliability.BEST_EFFORT)
    assert subscription.publisher_count() == 2
    second.receive(HELLO)
    assert subscription.wait(30).data == HELLO
    # A stricter QoS is requested only while no publisher is matched, so that nothing is lost.
    for key in keys:
        middleware.graph.remove(key)
    eventually(lambda: subscription.publisher_count() == 0)
    time.sleep(0.05)
    robot(qos=QoS.latched(), node="again")
    eventually(lambda: len(middleware.readers) == 3)
    assert subscription.qos.durability is Durability.TRANSIENT_LOCAL
    assert subscription.problem == ""
    assert conflicts == []


def test_changing_readers_neither_loses_nor_repeats(node, middleware, robot, eventually):
    subscription = node.create_subscription("/t", STRING, qos=QoS.best_available(100))
    first = middleware.readers[0]
    gid = b"g" * 16
    numbered = [(HELLO, 10, n, gid, n, "") for n in range(1, 5)]
    unnumbered = [(HELLO, 10, n, b"u" * 16, -1, "") for n in range(1, 5)]
    for old in (*numbered[:3], *unnumbered[:3]):
        first.on_sample(*old)
    robot(qos=BEST_EFFORT)
    second = eventually(lambda: middleware.readers[1:])[0]
    for new in (*numbered[1:], *unnumbered[1:]):
        second.on_sample(*new)
    got = []
    while (sample := subscription.take()) is not None:
        got.append((sample.publisher[:1], sample.sent_ns))
    assert got == [(p, n) for p in (b"g", b"u") for n in (1, 2, 3)] + [(b"g", 4), (b"u", 4)]
    # A publisher whose clock is set back later is heard all the same.
    later = (HELLO, 10, 2, b"u" * 16, -1, "")
    eventually(lambda: second.on_sample(*later) or subscription.take())


# -- in time, alive, complete --------------------------------------------------------------------


def test_messages_in_time_keep_a_deadline(node, middleware, robot, eventually):
    qos = QoS(deadline=Duration.from_seconds(0.2))
    subscription = node.create_subscription("/t", STRING, qos=qos)
    events = []
    subscription.on_deadline_missed(events.append, IMMEDIATE)
    robot(qos=qos)
    eventually(lambda: len(events) >= 2)
    assert all(isinstance(event, DeadlineMissed) and event.change >= 1 for event in events)
    middleware.readers[0].receive(HELLO)
    settled, received, missed = len(events), time.monotonic(), 0
    for _ in at_rate(0.005, 240):
        middleware.readers[0].receive(HELLO)
        # On a busy machine, some messages are late indeed.
        before, received = received, time.monotonic()
        missed += int((received - before) / 0.2)
    assert len(events) <= settled + missed + 2, "six more would have come without messages"


def test_liveliness_is_what_the_middleware_reports(node, middleware, robot, eventually):
    subscription = node.create_subscription("/t", STRING)
    events = []
    subscription.on_liveliness_change(events.append)
    middleware.readers[0].living = 1
    robot(qos=MANUAL, gid=b"m" * 16)
    eventually(lambda: events)
    nothing_happens(0.15)
    assert [e.change for e in events] == [1], "it sends nothing, but shows that it is alive"
    middleware.readers[0].living = 0
    eventually(lambda: [e.change for e in events] == [1, -1])


def test_lost_samples_are_counted_and_notified(node, middleware, eventually):
    subscription = node.create_subscription("/t", STRING)
    events = []
    subscription.on_samples_lost(events.append)
    for number in (1, 2, 6, 4):
        middleware.readers[0].on_sample(HELLO, 10, number, b"g" * 16, number, "")
    assert subscription.statistics().lost == 2, "4 came late, but it came"
    middleware.readers[0].missing = 3
    assert subscription.statistics().lost == 5
    eventually(lambda: events)
    assert events == [SamplesLost(5, 5)]


def test_watchdog_counts_all_missed_periods(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(timers_module, "time", SimpleNamespace(monotonic=lambda: now[0]))

    class Late:
        """Timers that run the job when the test says so."""

        def after(self, delay, job):
            self.job = job
            return self

        def close(self):
            self.job = None

    timers, missed = Late(), []
    watchdog = Watchdog(timers, Duration.from_seconds(0.01), lambda: 0.0, missed.append)
    now[0] += 0.055
    timers.job()
    assert missed == [5]
    watchdog.close()
    watchdog.close()
    assert timers.job is None


# -- who is waiting ------------------------------------------------------------------------------


def test_samples_are_fetched_on_demand_without_a_waiting_reader(node, middleware):
    subscription = node.create_subscription("/t", STRING)
    (reader,) = middleware.readers
    assert not reader.eager
    for look in (subscription.take, subscription.take_latest):
        reader.waiting = [HELLO]
        assert look().data == HELLO
    reader.waiting = [HELLO] * 3
    assert subscription.statistics().received == 5
    assert reader.waiting == []


def test_waiting_makes_the_reader_eager_for_a_while(node, middleware, eventually, monkeypatch):
    monkeypatch.setattr("rosglass.comm.subscription._AWAITED_S", 0.0)
    subscription = node.create_subscription("/t", STRING)
    (reader,) = middleware.readers
    reader.waiting = [HELLO]
    assert subscription.wait(30).data == HELLO
    assert reader.eager
    eventually(lambda: not reader.eager)


def test_callbacks_get_samples_as_they_come(node, middleware):
    node.create_subscription("/t", STRING, id)
    node.create_subscription("/t", STRING, raw_callback=id)
    assert all(reader.eager for reader in middleware.readers)


def test_patient_callbacks_get_samples_late_and_may_look_themselves(node, middleware, eventually):
    seen = []

    def callback(sample):
        seen.append(sample.data)
        assert subscription.wait(0) is None

    subscription = node.create_subscription(
        "/t", STRING, raw_callback=callback, executor=IMMEDIATE, qos=QoS.best_available()
    )
    (reader,) = middleware.readers
    subscription.set_batching(True)
    eventually(lambda: not reader.eager)
    reader.waiting = [HELLO]
    subscription.statistics()
    assert seen == [HELLO]
    eventually(lambda: not reader.eager)
    reader.waiting = [HELLO]
    subscription.set_batching(False)
    eventually(lambda: len(seen) == 2)
    assert reader.eager


# -- bytes that cannot be decoded ---------------------------------------------------------------


@pytest.fixture
def lost_node(middleware):
    """A node with a library of its own, and no other node to fetch definitions from."""
    library = Library()
    made = Ros2Node(middleware, "fake://", "cockpit", library=library)
    made.library = library
    core_of(made).types.fetcher = None
    yield made
    made.close()


def test_undecodable_message_is_handed_on_as_bytes_with_the_reason(
    lost_node, middleware, robot, eventually
):
    robot(type_name=SECRET, type_hash=HASH)
    seen = []
    subscription = lost_node.create_subscription("/t", raw_callback=seen.append, executor=IMMEDIATE)
    reader = eventually(lambda: middleware.readers)[0]
    assert (reader.info.type, reader.info.type_hash) == (SECRET, HASH)
    eventually(lambda: "handed on as bytes" in subscription.problem)
    assert "/robot publishes secret_msgs/msg/Thing, which cannot be decoded" in subscription.problem
    payload = b"\0\1\0\0\xff\xfe"
    reader.receive(payload)
    (sample,) = seen
    assert sample.data == payload
    assert sample.type == subscription.type == OpaqueType(SECRET, HASH)
    with pytest.raises(rosglass.TypeNotFoundError, match=r"only bytes: .*robot cannot be asked"):
        sample.message()
    # As soon as there is a definition, samples can be decoded.
    library = lost_node.library
    library.add_text(SECRET, "uint8 a\nuint8 b\n")
    known = rosglass.load(SECRET, library=library)
    library.definition = lambda *_, **__: known.definition
    eventually(lambda: subscription.problem == "")
    middleware.readers[-1].receive(payload)
    assert (seen[-1].message().a, seen[-1].message().b) == (255, 254)


def test_callbacks_that_want_messages_get_none_that_cannot_be_decoded(
    lost_node, middleware, robot, eventually
):
    robot(type_name=SECRET, type_hash=HASH)
    subscription = lost_node.create_subscription("/t", callback=id)
    eventually(lambda: "cannot be decoded" in subscription.problem)
    assert subscription.type is None
    assert middleware.readers == []


def test_nothing_is_opaque_while_the_robot_is_asked(lost_node, middleware, robot, eventually):
    asked, answers = [], [""]

    def fetcher(name, hash, endpoints, on_done):
        asked.append((name, hash, [e.node.name for e in endpoints], on_done))
        return answers[0]

    core_of(lost_node).types.fetcher = fetcher
    subscription = lost_node.create_subscription("/t")
    robot(type_name=SECRET, type_hash=HASH)
    eventually(lambda: asked)
    assert asked[0][:3] == (SECRET, HASH, ["robot"])
    eventually(lambda: "is being fetched from the robot" in subscription.problem)
    assert subscription.type is None
    answers[0] = "it did not answer"
    asked[0][3]()
    eventually(lambda: subscription.type)
    eventually(lambda: "it did not answer" in subscription.problem)
    assert isinstance(subscription.type, OpaqueType)


def test_big_endian_bytes_are_turned_round_where_they_cannot_be_passed_on(node, middleware):
    kind = rosglass.load(TWIST)
    big = kind.encode({"linear": {"x": 2.0}}, byteorder="big")
    node.create_publisher("/t", kind).publish_serialized(big)
    middleware.keeps_byte_order = False
    node.create_publisher("/t", kind).publish_serialized(bytearray(big))
    kept, turned = (writer.written[0] for writer in middleware.writers[-2:])
    assert kept == big
    assert turned == kind.encode({"linear": {"x": 2.0}})
    opaque = node.create_publisher("/t", OpaqueType(TWIST))
    with pytest.raises(rosglass.UnsupportedError, match=r"/t: big-endian bytes .*only bytes"):
        opaque.publish_serialized(big)


def test_opaque_type_without_hash_takes_every_version(node, middleware, eventually):
    subscription = node.create_subscription("/t", OpaqueType(SECRET))
    reader = middleware.readers[0]
    for version in ("", HASH, OTHER):
        reader.receive(b"\0\1\0\0", version)
    got = [subscription.take().type.rihs01 for _ in range(3)]
    assert got == ["", HASH, OTHER]
    assert subscription.problem == ""


# -- several versions of a type ------------------------------------------------------------------


@pytest.fixture
def versions(middleware):
    """A node whose library knows two versions of ``pkg/msg/T``: the node, ours, the other one."""
    library, other = Library(), Library()
    library.add_text("pkg/msg/T", "int32 new\n")
    other.add_text("pkg/msg/T", "int32 old\n")
    ours = rosglass.load("pkg/msg/T", library=library)
    theirs = rosglass.load("pkg/msg/T", library=other)
    real = library.definition

    def definition(name, ros=2, *, hash=""):
        return other.definition(name, ros) if hash == theirs.rihs01 else real(name, ros, hash=hash)

    library.definition = definition
    node = Ros2Node(middleware, "fake://", "cockpit", library=library)
    core_of(node).types.fetcher = None
    yield node, ours, theirs
    node.close()


@pytest.mark.parametrize("given", [None, "pkg/msg/T", "pkg/T"])
def test_publishers_with_different_versions_are_all_understood(
    versions, middleware, eventually, given
):
    node, ours, theirs = versions
    middleware.appear(PUBLISHER, "/t", "pkg/msg/T", theirs.rihs01, node="old")
    middleware.appear(PUBLISHER, "/t", "pkg/msg/T", ours.rihs01, node="new")
    subscription = node.create_subscription("/t", given)
    eventually(lambda: subscription.publisher_count() == 2)
    assert subscription.problem == ""
    reader = middleware.readers[-1]
    reader.receive(ours.encode({"new": 1}), ours.rihs01)
    reader.receive(theirs.encode({"old": 2}), theirs.rihs01)
    assert subscription.take().message().new == 1
    assert subscription.take().message().old == 2


def test_robot_that_returns_with_another_version_is_received(versions, middleware, eventually):
    node, ours, theirs = versions
    key = middleware.appear(PUBLISHER, "/t", "pkg/msg/T", ours.rihs01)
    subscription = node.create_subscription("/t")
    eventually(lambda: subscription.type == ours)
    middleware.graph.remove(key)
    middleware.appear(PUBLISHER, "/t", "pkg/msg/T", theirs.rihs01)
    eventually(lambda: subscription.type == theirs)
    assert middleware.readers[-1].info.type_hash == theirs.rihs01
    assert subscription.problem == ""


def test_unannounced_version_is_decoded_when_it_arrives(versions, middleware, eventually):
    node, ours, theirs = versions
    subscription = node.create_subscription("/t", "pkg/msg/T")
    assert subscription.type == ours

    def arrived():
        middleware.readers[-1].receive(theirs.encode({"old": 2}), theirs.rihs01)
        return subscription.take()

    assert eventually(arrived).message().old == 2


def test_undefined_version_is_handed_on_as_bytes_beside_the_others(
    versions, middleware, eventually
):
    node, ours, _ = versions
    subscription = node.create_subscription("/t")
    middleware.appear(PUBLISHER, "/t", "pkg/msg/T", ours.rihs01, node="new")
    eventually(lambda: subscription.type)
    middleware.appear(PUBLISHER, "/t", "pkg/msg/T", HASH, node="secret")
    eventually(lambda: "handed on as bytes" in subscription.problem)
    assert f"the publisher of /secret has another definition of pkg/msg/T ({HASH}" in (
        subscription.problem
    )
    middleware.readers[-1].receive(b"\0\1\0\0????", HASH)
    assert subscription.take().type == OpaqueType("pkg/msg/T", HASH)
    middleware.readers[-1].receive(ours.encode({"new": 1}), ours.rihs01)
    assert subscription.take().message().new == 1


def test_type_name_of_the_robot_alone_is_enough_once_it_is_announced(
    lost_node, middleware, robot, eventually
):
    with pytest.raises(rosglass.TypeNotFoundError):
        lost_node.create_subscription("/t", SECRET)
    robot(type_name=SECRET, type_hash=HASH)
    subscription = lost_node.create_subscription("/t", SECRET)
    assert eventually(lambda: subscription.type) == OpaqueType(SECRET, HASH)


# -- ourselves -----------------------------------------------------------------------------------


def test_own_messages_can_be_ignored(node, middleware):
    subscription = node.create_subscription("/t", STRING, ignore_local=True)
    everything = node.create_subscription("/t", STRING)
    publisher = node.create_publisher("/t", STRING)
    own = middleware.writers[0].gid
    middleware.appear(PUBLISHER, "/t", STRING, hash_of(STRING), gid=b"g" * 16, node="robot")
    assert subscription.publisher_count() == 1
    assert everything.publisher_count() == 2
    for reader in middleware.readers:
        reader.receive(HELLO, gid=own)
        reader.receive(HELLO, gid=b"g" * 16)
    assert subscription.statistics().received == 1
    assert everything.statistics().received == 2
    publisher.close()
    middleware.readers[0].receive(HELLO, gid=own)
    assert subscription.statistics().received == 1, "samples of a closed publisher come back"


def test_gids_of_closed_publishers_are_not_kept_for_ever(node):
    kept = core_of(node).local_gids
    for _ in range(1005):
        node.create_publisher("/t", STRING).close()
    assert len(kept) == 1000


def test_publisher_with_the_gid_of_a_closed_one_belongs_to_the_node(node):
    core = core_of(node)
    core.add_gid(b"again")
    core.retire_gid(b"again")
    core.add_gid(b"again")
    for number in range(2000):
        core.retire_gid(number.to_bytes(16, "little"))
    assert b"again" in core.local_gids
