"""Types that exist on another node only: fetched, checked, used."""

from __future__ import annotations

import asyncio
import re
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually, nothing_happens

import rosglass
from rosglass.comm import EndpointKind
from rosglass.comm.types import Types
from rosglass.errors import (
    DefinitionConflictError,
    NodeClosedError,
    TypeNotFoundError,
)
from rosglass.interfaces import Library, TypeCache, announced_hashes, rihs01
from rosglass.messages import OpaqueType
from rosglass.ros2 import Ros2Node
from rosglass.ros2.type_descriptions import TypeFetcher, describe

from .steered import SteeredMiddleware

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

STATE = "my_msgs/msg/State"
STATE_TEXT = "# What it does.\nuint8 IDLE=0\nuint8 state 3\nmy_msgs/Part[] parts\nstring name"
ASK = "my_msgs/srv/Ask"
GO = "my_msgs/action/Go"
SERVICE = "type_description_interfaces/srv/GetTypeDescription"


def robot_library(state: str = STATE_TEXT) -> Library:
    library = Library()
    library.add_text("my_msgs/msg/Part", "int8 a")
    library.add_text(STATE, state)
    library.add_text(ASK, "my_msgs/Part part\n---\nbool yes")
    library.add_text(GO, "uint8 FAST=1\nuint8 speed\n---\nmy_msgs/Part part\n---\nfloat32 left")
    return library


@pytest.fixture(autouse=True)
def hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    """The local graph is complete at once."""
    monkeypatch.setattr("rosglass.ros2.type_descriptions._GRACE_S", 0.1)


@pytest.fixture
def join(url: str) -> Iterator[Callable[..., Ros2Node]]:
    """Connect a node with a library of its own."""
    made: list[Ros2Node] = []

    def join(name: str, library: Library | None = None, *, serves: bool = True) -> Ros2Node:
        fake = SteeredMiddleware(url)
        node = Ros2Node(fake, "fake://", name, "/", library or Library(), own_services=serves)
        node.fake = fake
        made.append(node)
        # With a grace of 0.1 s, what others serve has to be in the graph before anything is asked.
        expected = [f"/{name}/get_type_description"] if serves else []
        expected += [
            end.info.name
            for other in made
            for end in other.fake.repliers
            if not end.closed and end.info.name.endswith("/get_type_description")
        ]
        eventually(lambda: all(node.service_servers(service) for service in expected))
        return node

    yield join
    for node in made:
        node.close()


def use(user: Ros2Node, name: str, type_hash: str, by: str, kind: Any = None) -> str:
    """Let `user` see that a node uses a type."""
    kind = kind or EndpointKind.PUBLISHER
    return user.fake.appear(kind, f"/{name.rpartition('/')[2].lower()}", name, type_hash, node=by)


def hash_of(name: str, library: Library | None = None) -> str:
    return rihs01((library or robot_library()).definition(name))


NO = {"successful": False, "failure_reason": "Type not in use\n\x1b[31m"}


def answer(node: Ros2Node, respond: Callable[[Any], Any]) -> None:
    """Offer get_type_description with answers of the test's own."""
    node.create_service_server(
        f"/{node.name}/get_type_description", SERVICE, respond, executor=rosglass.comm.IMMEDIATE
    )


def test_topic_is_read_with_the_definition_of_its_publisher(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any]
) -> None:
    library = robot_library()
    join("talker", library)
    user = join("cockpit", serves=False)
    got: list[Any] = []
    subscription = user.create_subscription("/state", callback=got.append)
    use(user, STATE, hash_of(STATE), "talker")
    eventually(lambda: user.fake.readers)
    assert subscription.problem == ""
    assert subscription.type.constants["IDLE"] == 0
    assert subscription.type.definition.source.provider == "wire /talker"
    kind = rosglass.load(STATE, library=library)
    user.fake.readers[0].receive(kind.encode({"state": 7, "parts": [{"a": -1}], "name": "x"}))
    message = eventually(lambda: got)[0]
    assert message.to_dict() == {"state": 7, "parts": [{"a": -1}], "name": "x"}
    # Missing fields get the defaults of the robot's definition.
    assert subscription.type().state == 3


@pytest.mark.parametrize("name", [STATE, ASK, GO])
def test_by_name(name: str, join: Callable[..., Ros2Node]) -> None:
    library = robot_library()
    join("robot", library)
    user = join("cockpit", serves=False)
    if name == GO:
        for suffix in ("_SendGoal", "_GetResult", "_FeedbackMessage"):
            use(user, GO + suffix, hash_of(GO + suffix), "robot")
    else:
        use(user, name, hash_of(name), "robot")
    found = user.fetch_type(name)
    assert found.rihs01 == hash_of(name)
    assert found.name == name
    package, _, base = name.split("/")
    assert user.fetch_type(f"{package}/{base}") == found
    assert user.fetch_type(name, hash=hash_of(name)) == found
    assert user.fetch_type(name, node="/robot") == found
    if name == GO:
        assert dict(found.constants["goal"]) == {"FAST": 1}


def test_publishers_and_services_wait_for_types_that_the_graph_knows(
    join: Callable[..., Ros2Node],
) -> None:
    join("robot", robot_library())
    user = join("cockpit", serves=False)
    with pytest.raises(TypeNotFoundError, match="looked in"):
        user.create_publisher("/state", STATE)
    use(user, STATE, hash_of(STATE), "robot", EndpointKind.SUBSCRIPTION)
    use(user, ASK, hash_of(ASK), "robot", EndpointKind.SERVICE_SERVER)
    assert user.create_publisher("/state", STATE).type.rihs01 == hash_of(STATE)
    assert user.create_service_client("/ask", ASK).type.rihs01 == hash_of(ASK)
    user.create_service_server("/ask2", "my_msgs/Ask", lambda _: None)


def test_services_announced_by_the_hash_of_their_request(join: Callable[..., Ros2Node]) -> None:
    """That is what DDS nodes do."""
    definition = robot_library().definition(ASK)
    join("robot", robot_library())
    user = join("cockpit", serves=False)
    own, request, response = announced_hashes(definition)
    use(user, ASK, request, "robot", EndpointKind.SERVICE_SERVER)
    found = user.fetch_type(ASK)
    assert found.rihs01 == own
    for announced in (own, request, response):
        assert user.fetch_type(ASK, hash=announced, timeout=0) == found


def test_asyncio_and_callbacks(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any]
) -> None:
    join("robot", robot_library())
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE), "robot")

    async def fetch() -> Any:
        return await user.fetch_type_async(STATE)

    assert asyncio.run(fetch()).rihs01 == hash_of(STATE)
    done: list[Any] = []
    user.fetch_type_async(STATE).on_done(lambda promise: done.append(promise.result()))
    assert eventually(lambda: done)[0].name == STATE


def test_node_that_appears_later_is_queried(join: Callable[..., Ros2Node]) -> None:
    user = join("cockpit", serves=False)
    promise = user.fetch_type_async(STATE, timeout=10)
    join("robot", robot_library())
    use(user, STATE, hash_of(STATE), "robot")
    assert promise.result(30).rihs01 == hash_of(STATE)


def test_node_that_appears_late_has_time_to_show_its_service(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time that the graph has to become complete begins anew with each node."""
    monkeypatch.setattr("rosglass.ros2.type_descriptions._GRACE_S", 1.0)
    silent, asked = join("silent", serves=False), []
    answer(silent, lambda _: asked.append(1) or rosglass.comm.Promise(cancellable=True))
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE), "silent")
    promise = user.fetch_type_async(STATE, timeout=30.0)
    eventually(lambda: asked)
    nothing_happens(1.1)
    use(user, STATE, hash_of(STATE), "late")
    silent.close()
    nothing_happens(0.2)
    join("late", robot_library())
    assert promise.result().rihs01 == hash_of(STATE)


def test_earlier_failure_does_not_apply_to_a_new_node(join: Callable[..., Ros2Node]) -> None:
    library = robot_library()
    user = join("cockpit", serves=False)
    subscription = user.create_subscription("/state")
    key = use(user, STATE, hash_of(STATE), "gone")
    eventually(lambda: "is being fetched" in subscription.problem)
    user.fake.graph.remove(key)
    with pytest.raises(TypeNotFoundError, match="/gone has no get_type_description"):
        user.fetch_type(STATE, hash=hash_of(STATE), timeout=30)
    join("spare", library)
    use(user, STATE, hash_of(STATE), "spare")
    eventually(lambda: subscription.type)
    assert not isinstance(subscription.type, OpaqueType)
    assert subscription.type.definition.source.provider == "wire /spare"


def test_local_types_are_taken_when_the_robot_has_the_same(join: Callable[..., Ros2Node]) -> None:
    library = Library()
    user = join("cockpit", library, serves=False)
    local = rosglass.load("std_msgs/msg/String", library=library)
    use(user, "std_msgs/msg/String", local.rihs01, "robot")
    assert user.fetch_type("std_msgs/String") is local
    # No node uses it: the local definition is right, once the graph had time to show.
    assert user.fetch_type("std_msgs/msg/Bool").name == "std_msgs/msg/Bool"


def test_robots_version_of_a_local_type(join: Callable[..., Ros2Node]) -> None:
    robot = Library(prefer="wire")
    robot.add_text("std_msgs/msg/String", "string data\nuint8 urgency")
    join("robot", robot)
    user = join("cockpit", serves=False)
    use(user, "std_msgs/msg/String", hash_of("std_msgs/msg/String", robot), "robot")
    assert len(user.fetch_type("std_msgs/msg/String").fields) == 2
    assert len(user.create_publisher("/other", "std_msgs/msg/String").type.fields) == 1


def test_several_versions_must_be_chosen(join: Callable[..., Ros2Node]) -> None:
    old, new = robot_library(), robot_library("int64 state")
    join("old", old)
    join("new", new)
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE, old), "old")
    use(user, STATE, hash_of(STATE, new), "new")
    with pytest.raises(DefinitionConflictError, match=r"several versions .* of /old.* of /new"):
        user.fetch_type(STATE)
    assert user.fetch_type(STATE, node="/old").rihs01 == hash_of(STATE, old)
    assert user.fetch_type(STATE, hash=hash_of(STATE, new)).rihs01 == hash_of(STATE, new)


def test_unused_type_is_not_found(join: Callable[..., Ros2Node]) -> None:
    user = join("cockpit", serves=False)
    with pytest.raises(TypeNotFoundError, match=r"within 0\.2 s: no node in the graph uses it"):
        user.fetch_type(STATE, timeout=0.2)
    with pytest.raises(TypeNotFoundError, match="no node in the graph uses it"):
        user.fetch_type(GO, timeout=0.2)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"name": "state"}, "not a type name"),
        ({"name": 3}, "not a type name"),
        ({"name": STATE, "hash": "abc"}, "not a type hash"),
        ({"name": STATE, "hash": 3}, "not a type hash"),
        ({"name": STATE, "timeout": -1}, "timeout"),
        ({"name": STATE, "timeout": "5"}, "timeout"),
        ({"name": STATE, "node": "a b"}, "a b"),
    ],
)
def test_bad_arguments(
    arguments: dict[str, Any], complaint: str, join: Callable[..., Ros2Node]
) -> None:
    user = join("cockpit", serves=False)
    with pytest.raises(rosglass.Error, match=complaint):
        user.fetch_type(**arguments)


def test_publisher_without_the_service_is_reported(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any]
) -> None:
    user = join("cockpit", serves=False)
    subscription = user.create_subscription("/state", callback=print)
    use(user, STATE, hash_of(STATE), "talker")
    eventually(lambda: "being fetched" in subscription.problem)
    problem = eventually(lambda: "fetched" not in subscription.problem and subscription.problem)
    assert "/talker publishes my_msgs/msg/State, which cannot be decoded" in problem
    assert "/talker has no get_type_description service (ROS 2 Humble or older" in problem
    with pytest.raises(TypeNotFoundError, match="/talker has no get_type_description service"):
        user.fetch_type(STATE)


def test_publisher_without_hash_is_reported(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any]
) -> None:
    user = join("cockpit", serves=False)
    subscription = user.create_subscription("/state", callback=print)
    use(user, STATE, "", "talker")
    problem = eventually(
        lambda: "announces no type hash" in subscription.problem and subscription.problem
    )
    assert "/talker announces no type hash and sends no definitions" in problem
    # The hash of another node shows the most likely definition.
    join("robot", robot_library())
    use(user, STATE, hash_of(STATE), "robot")
    eventually(lambda: user.fake.readers)
    assert subscription.type.rihs01 == hash_of(STATE)


def test_second_node_is_queried_when_the_first_fails(join: Callable[..., Ros2Node]) -> None:
    answer(join("first", serves=False), lambda _: NO)
    join("second", robot_library())
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE), "first")
    use(user, STATE, hash_of(STATE), "second")
    assert user.fetch_type(STATE).rihs01 == hash_of(STATE)


def test_answers_of_nodes_are_reported(join: Callable[..., Ros2Node]) -> None:
    answer(join("first", serves=False), lambda _: NO)
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE), "first")
    use(user, STATE, hash_of(STATE), "second")
    with pytest.raises(TypeNotFoundError) as caught:
        user.fetch_type(STATE)
    message = str(caught.value)
    assert "/first: it answered: Type not in use  [31m;" in message  # nothing that moves a cursor
    assert "/second has no get_type_description service" in message


def test_why_dds_nodes_do_not_know_their_services(join: Callable[..., Ros2Node]) -> None:
    """rcl looks types up by the service's own hash, which is not announced over DDS."""
    answer(join("robot", serves=False), lambda _: NO)
    user = join("cockpit", serves=False)
    use(user, ASK, hash_of(ASK + "_Request"), "robot", EndpointKind.SERVICE_SERVER)
    with pytest.raises(TypeNotFoundError, match="it answered") as caught:
        user.fetch_type(ASK)
    assert "Over DDS" not in str(caught.value)
    user = join("dds_cockpit", serves=False)
    user.fake.announces_requests = True
    use(user, ASK, hash_of(ASK + "_Request"), "robot", EndpointKind.SERVICE_SERVER)
    with pytest.raises(TypeNotFoundError, match="Over DDS, ROS 2 nodes announce a service by"):
        user.fetch_type(ASK)


def test_answers_as_rcl_gives_them(join: Callable[..., Ros2Node]) -> None:
    """By the hash alone, with implied types among the sources, and texts as rosidl makes them."""
    types = Types(robot_library("uint8 IDLE=0\t# \u00e4\nuint8 state 3\nmy_msgs/Part[] parts"), "")
    known = {}
    for name in (STATE, ASK):
        described = description_of(types.library, name)
        for source in described["type_sources"]:
            text = source["raw_file_contents"]
            lines = (str(line.encode())[2:-1] for line in text.splitlines())
            source["raw_file_contents"] = "\n".join(lines)[: len(text)]
        known[hash_of(name, types.library)] = {**described, "extra_information": []}
    robot = join("robot", serves=False)
    answer(robot, lambda request: known.get(request.type_hash, NO))
    user = join("cockpit", serves=False)
    for name in (STATE, ASK):
        use(user, name, hash_of(name, types.library), "robot")
    state = user.fetch_type(STATE)
    assert state.constants["IDLE"] == 0
    assert state.definition.constants[0].comment == "\u00e4"
    assert state().state == 3
    assert state.rihs01 == hash_of(STATE, types.library)
    assert user.fetch_type(ASK).rihs01 == hash_of(ASK)


def test_silent_node_does_not_block_the_others(join: Callable[..., Ros2Node]) -> None:
    silent = join("a_silent", serves=False)
    answer(silent, lambda _: rosglass.comm.Promise(cancellable=True))
    join("second", robot_library())
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE), "a_silent")
    use(user, STATE, hash_of(STATE), "second")
    start = time.monotonic()
    assert user.fetch_type(STATE).rihs01 == hash_of(STATE)
    assert time.monotonic() - start < 8
    # Without anybody else, the time is bounded.
    other = hash_of(STATE, robot_library("int8[3] state"))
    use(user, STATE, other, "a_silent")
    with pytest.raises(TypeNotFoundError, match=r"within 0\.3 s: /a_silent did not answer"):
        user.fetch_type(STATE, hash=other, timeout=0.3)


def description_of(library: Library, name: str = STATE) -> dict[str, Any]:
    return describe(Types(library, "fake://"), name, "", sources=True)


def spoiled() -> dict[str, Any]:
    described = description_of(robot_library())
    described["type_description"]["type_description"]["fields"][0]["type"]["type_id"] = 95
    return described


def huge() -> dict[str, Any]:
    described = description_of(robot_library())
    described["type_sources"] = [
        dict(described["type_sources"][0], raw_file_contents="x" * (9 << 20))
    ]
    return described


LIES: dict[str, tuple[Callable[[], dict[str, Any]], str]] = {
    "another definition": (
        lambda: description_of(robot_library("int64 state")),
        f"/liar: .* sent a definition of {STATE} with the hash .* where .* is announced",
    ),
    "another type": (
        lambda: description_of(robot_library(), "my_msgs/msg/Part"),
        "/liar: .* sent a definition of my_msgs/msg/Part .* where .* is announced",
    ),
    "rubbish": (spoiled, "/liar: .* field state has type id 95, which means nothing"),
    "nothing at all": (lambda: {"successful": True}, "/liar: .* not a type name"),
    "far too much": (huge, "/liar: .* has 9[0-9]* bytes, the limit is"),
}


@pytest.mark.parametrize(("lie", "complaint"), LIES.values(), ids=LIES)
def test_liars_are_not_believed(
    lie: Callable[[], dict[str, Any]],
    complaint: str,
    join: Callable[..., Ros2Node],
    eventually: Callable[..., Any],
    caplog: pytest.LogCaptureFixture,
) -> None:
    asked: list[Any] = []
    liar = join("liar", serves=False)
    answer(liar, lambda request: asked.append(request) or lie())
    user = join("cockpit", serves=False)
    taken: list[Any] = []
    subscription = user.create_subscription("/state", raw_callback=taken.append)
    key = use(user, STATE, hash_of(STATE), "liar")
    problem = eventually(lambda: "/liar: " in subscription.problem and subscription.problem)
    assert re.search(complaint, problem)
    with pytest.raises(TypeNotFoundError, match=complaint):
        user.fetch_type(STATE)
    # Raw samples are handed on all the same.
    user.fake.readers[0].receive(b"\0\1\0\0abc")
    assert bytes(eventually(lambda: taken)[0].data) == b"\0\1\0\0abc"
    assert caplog.text.count("a definition from /liar is not used") == ("sent" in complaint)
    assert len(asked) == 1
    # A node that was started anew may have learnt better.
    user.fake.graph.remove(key)
    liar.close()
    join("liar", robot_library())
    use(user, STATE, hash_of(STATE), "liar")
    eventually(lambda: not isinstance(subscription.type, OpaqueType))
    assert subscription.type.constants["IDLE"] == 0


def test_node_that_is_killed_while_it_is_asked_is_replaced(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any]
) -> None:
    robot = join("robot", serves=False)
    asked = threading.Event()
    answer(robot, lambda _: asked.set() or rosglass.comm.Promise(cancellable=True))
    user = join("cockpit", serves=False)
    subscription = user.create_subscription("/state", callback=print)
    key = use(user, STATE, hash_of(STATE), "robot")
    assert asked.wait(30)
    user.fake.graph.remove(key)
    robot.close()
    join("robot", robot_library())
    use(user, STATE, hash_of(STATE), "robot")
    # Without an answer for a second, it was opaque first.
    eventually(lambda: not isinstance(subscription.type, OpaqueType | None))
    eventually(lambda: not subscription.problem, lambda: subscription.problem)


@pytest.mark.parametrize("when", ["before", "while asking"])
def test_closing_ends_it(when: str, join: Callable[..., Ros2Node]) -> None:
    asked = threading.Event()
    robot = join("robot", serves=False)
    answer(robot, lambda _: asked.set() or rosglass.comm.Promise(cancellable=True))
    user = join("cockpit", serves=False)
    if when == "while asking":
        use(user, STATE, hash_of(STATE), "robot")
    promise = user.fetch_type_async(STATE, timeout=None)
    assert when == "before" or asked.wait(30)
    user.close()
    with pytest.raises(NodeClosedError):
        promise.result(30)
    with pytest.raises(NodeClosedError):
        user.fetch_type(STATE)


def test_cancelled_fetch_sends_no_more_requests(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any]
) -> None:
    user = join("cockpit", serves=False)
    promise = user.fetch_type_async(STATE)
    assert promise.cancel()
    robot = join("robot", serves=False)
    asked: list[Any] = []
    answer(robot, lambda request: asked.append(request) or NO)
    use(user, ASK, hash_of(ASK), "robot")
    with pytest.raises(TypeNotFoundError, match="it answered"):
        user.fetch_type(ASK)
    assert [request.type_name for request in asked] == [ASK]


def test_cache_serves_when_no_node_answers(
    join: Callable[..., Ros2Node],
    eventually: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setenv("ROSGLASS_TYPE_CACHE", str(tmp_path))
    robot = join("robot", robot_library())
    first = join("first", serves=False)
    use(first, STATE, hash_of(STATE), "robot")
    first.fetch_type(STATE)
    eventually(lambda: TypeCache(str(tmp_path)).get(STATE, hash_of(STATE)))
    robot.close()
    second = join("second", serves=False)
    use(second, STATE, hash_of(STATE), "robot")
    found = second.fetch_type(STATE)
    assert found.definition.source.provider == "cache, from /robot"
    assert found.constants["IDLE"] == 0


def test_many_types_at_once(join: Callable[..., Ros2Node]) -> None:
    library = Library()
    names = [f"my_msgs/msg/Type{number}" for number in range(100)]
    for number, name in enumerate(names):
        library.add_text(name, f"int32[{number + 1}] values")
    join("robot", library)
    user = join("cockpit", serves=False)
    for name in names:
        use(user, name, hash_of(name, library), "robot")
    promises = [user.fetch_type_async(name) for name in names]
    for name, promise in zip(names, promises, strict=True):
        assert promise.result().rihs01 == hash_of(name, library)
    # One client was enough.
    assert len(user.fake.requesters) == 1


def test_nothing_is_left_behind(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.ros2.type_descriptions._LINGER_S", 0.2)
    join("robot", robot_library())
    user = join("cockpit", serves=False)
    use(user, STATE, hash_of(STATE), "robot")
    user.fetch_type(STATE)
    eventually(lambda: all(requester.closed for requester in user.fake.requesters))
    # It connects again when there is something else to ask.
    use(user, ASK, hash_of(ASK), "robot")
    user.fetch_type(ASK)


def test_type_that_is_a_service_is_not_requested_forever(
    join: Callable[..., Ros2Node], eventually: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A confused publisher: its type exists, but cannot be published."""
    join("robot", robot_library())
    user = join("cockpit", serves=False)
    use(user, ASK, hash_of(ASK), "robot", EndpointKind.SERVICE_SERVER)
    user.fetch_type(ASK)
    subscription = user.create_subscription("/ask", callback=print)
    use(user, ASK, hash_of(ASK), "robot")
    eventually(lambda: subscription.problem)
    rounds, go_on = [], TypeFetcher._round
    monkeypatch.setattr(TypeFetcher, "_round", lambda self: rounds.append(go_on(self)))
    nothing_happens(0.5)
    assert len(rounds) < 20


def test_concurrent_requests_are_all_answered(join: Callable[..., Ros2Node]) -> None:
    """Promises come from any thread, while others of the same type are kept and handed over."""
    robot = join("robot", robot_library())
    robot.create_publisher("/state", STATE)
    user = join("user")
    promises: list[Any] = []

    def ask() -> None:
        promises.extend(user.fetch_type_async(STATE, timeout=None) for _ in range(300))

    threads = [threading.Thread(target=ask) for _ in range(4)]
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(usual)
    assert {promise.result(30).rihs01 for promise in promises} == {hash_of(STATE)}


def test_each_answer_costs_the_same_however_many_types_are_fetched(
    join: Callable[..., Ros2Node], monkeypatch: pytest.MonkeyPatch
) -> None:
    library = Library()
    names = [f"many_msgs/msg/M{number}" for number in range(500)]
    for name in names:
        library.add_text(name, "int8 a")
    join("talker", library)
    user = join("cockpit", serves=False)
    for name in names:
        use(user, name, hash_of(name, library), "talker")
    steps: list[Any] = []
    advance = TypeFetcher._advance

    def count(self: TypeFetcher, *arguments: Any) -> None:
        steps.append(None)
        advance(self, *arguments)

    monkeypatch.setattr(TypeFetcher, "_advance", count)
    promises = [user.fetch_type_async(name, timeout=60) for name in names]
    assert [promise.result(60).name for promise in promises] == names
    assert len(steps) < 8 * len(names)
