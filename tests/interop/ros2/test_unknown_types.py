"""Types that exist nowhere but on the robot: fetched from it, checked, cached, used."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass
from rosglass.bags import Recorder, open_bag
from rosglass.errors import TypeNotFoundError
from rosglass.interfaces import Library, MemoryProvider
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PEER = Path(__file__).parent / "peers" / "types_peer.py"
STATE, ASK, GO = "my_msgs/msg/State", "my_msgs/srv/Ask", "my_msgs/action/Go"
TEXTS = {
    "msg/Part": "int8 a 5",
    "msg/State": (
        "# What it does.\nuint8 IDLE=0\t# nothing\nuint8 state 3\nPart[] parts\nstring name\n"
    ),
    "srv/Ask": "uint8 WHY=1\nPart part\n---\nbool yes\nstring text",
    "action/Go": "uint8 FAST=1\nuint8 speed\n---\nPart part\n---\nfloat32 left",
}


@pytest.fixture(scope="session")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The robot's packages, and others with the same names that say something else."""
    made = {}
    for kind in ("truth", "lies"):
        made[kind] = tmp_path_factory.mktemp(kind)
        for name, text in TEXTS.items():
            path = made[kind] / "my_msgs" / name.split("/")[0]
            path.mkdir(parents=True, exist_ok=True)
            if kind == "lies":
                text = text.replace("string name", "int64 name").replace("bool", "float64")  # noqa: PLW2901
            (path / f"{name.split('/')[1]}.{name.split('/')[0]}").write_text(text)
        (made[kind] / "my_msgs" / "package.xml").write_text(
            "<package><name>my_msgs</name></package>"
        )
    return made


@pytest.fixture(params=["zenoh", "dds"])
def url(request: pytest.FixtureRequest) -> str:
    """URL of the robot: behind a router, or in a DDS domain."""
    if request.param == "zenoh":
        return str(request.getfixturevalue("router").url)
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    return f"dds://?domain={request.getfixturevalue('dds_domain')}"


@pytest.fixture
def robot(start, folders, url) -> Iterator[Callable[..., Any]]:
    """Start a robot with types of its own; killed after the test."""
    started = []

    def robot(**plan: Any) -> Any:
        plan |= {"url": url, "folder": str(folders["truth"]), "lies": str(folders["lies"])}
        process = start(str(PEER), json.dumps(plan))
        started.append(process)
        process.event("ready")
        return process

    yield robot
    for process in started:
        process.end()


@pytest.fixture
def cockpit(url) -> Iterator[Callable[..., Any]]:
    """Connect without any of the robot's definitions."""
    nodes = []

    def cockpit(name: str = "cockpit") -> Any:
        node = rosglass.connect(url, name, library=Library())
        nodes.append(node)
        return node

    yield cockpit
    for node in nodes:
        node.close()


def test_topics(robot, cockpit) -> None:
    process = robot()
    node = cockpit()
    subscription = node.create_subscription("/state")
    message = eventually(subscription.take, what=lambda: subscription.problem).message()
    assert message.name == "Grüße"
    assert [part.a for part in message.parts] == [-1, 2]
    assert subscription.problem == ""
    definition = subscription.type.definition
    assert definition.source.provider == "wire /robot"
    assert definition.comment == "What it does."
    assert definition.constants[0].comment.endswith("nothing")
    # Its name is enough now, and missing fields get the robot's defaults.
    publisher = node.create_publisher("/command", STATE)
    eventually(publisher.subscription_count)
    publisher.publish(parts=[{}])
    assert process.event("command") == {"state": 3, "parts": [{"a": 5}], "name": ""}


def test_messages_before_the_definition_are_recorded(url, folders, cockpit, tmp_path) -> None:
    library = Library()
    library.add_path(folders["truth"])
    node = cockpit()
    path = tmp_path / "state.mcap"
    with rosglass.connect(url, "robot", library=library) as robot:
        publisher = robot.create_publisher("/state", STATE)
        with Recorder(node, path, ["/state"]) as recorder:
            eventually(publisher.subscription_count)
            for number in range(200):
                publisher.publish(state=number, name="first")
            eventually(lambda: recorder.status().messages >= 200)
            assert recorder.status().problems == {}
    with open_bag(path) as bag:
        found = [message.channel.type().decode(message.data) for message in bag.messages()]
    assert [message.state for message in found] == list(range(200))
    assert {message.name for message in found} == {"first"}


def test_publishing_first(robot, cockpit) -> None:
    process = robot()
    node = cockpit()
    eventually(lambda: node.subscriptions("/command") and node.nodes())
    publisher = node.create_publisher("/command", STATE)
    eventually(publisher.subscription_count)
    publisher.publish(name="first")
    assert process.event("command")["name"] == "first"


def test_services(robot, cockpit) -> None:
    robot()
    node = cockpit()
    eventually(lambda: node.service_servers("/ask"))
    client = node.create_service_client("/ask", ASK)
    assert client.type.constants["request"]["WHY"] == 1
    assert client.call({"part": {"a": 5}}).to_dict() == {"yes": True, "text": "ok"}
    # Without naming the type.
    again = node.create_service_client("/ask")
    assert again.call({"part": {"a": 6}}).yes is False


def test_actions(robot, cockpit) -> None:
    robot(action=True)
    node = cockpit()
    found = node.fetch_type(GO)
    assert dict(found.constants["goal"]) == {"FAST": 1}
    client = node.create_action_client("/go", GO)
    assert client.send_goal({"speed": 7}).result(30).result.part.a == 7
    unnamed = cockpit("other").create_action_client("/go")
    assert unnamed.wait_for_server(30), unnamed.problem
    assert unnamed.send_goal({"speed": 8}).result(30).result.part.a == 8


def test_everything_by_name(robot, cockpit) -> None:
    robot()
    node = cockpit()
    for name in (STATE, ASK):
        found = node.fetch_type(name, timeout=10)
        assert found.name == name
        assert found.definition.source.provider == "wire /robot"
        package, _, base = name.split("/")
        assert node.fetch_type(f"{package}/{base}") == found


def test_a_robot_that_sends_no_definitions(robot, cockpit) -> None:
    robot(mood="mute")
    node = cockpit()
    samples: list[Any] = []
    subscription = node.create_subscription("/state", raw_callback=samples.append)
    problem = "/robot has no get_type_description service"
    eventually(lambda: problem in subscription.problem, what=lambda: subscription.problem)
    # Raw bytes come all the same.
    assert isinstance(eventually(lambda: samples)[0].type, OpaqueType)
    with pytest.raises(TypeNotFoundError, match=problem):
        node.fetch_type(STATE)


def test_a_liar_is_named_once(robot, cockpit, caplog) -> None:
    process = robot(mood="liar")
    node = cockpit()
    samples: list[Any] = []
    subscription = node.create_subscription("/state", raw_callback=samples.append)
    problem = f"/robot: it sent a definition of {STATE} with the hash RIHS01_"
    eventually(lambda: problem in subscription.problem, what=lambda: subscription.problem)
    assert isinstance(eventually(lambda: samples)[0].type, OpaqueType)
    with pytest.raises(TypeNotFoundError, match=problem):
        node.fetch_type(STATE)
    assert caplog.text.count("a definition from /robot is not used") == 1
    assert process.event("asked") == STATE
    assert process.event("asked", timeout=0.5, otherwise=None) is None
    # Nothing else is disturbed.
    assert node.create_subscription("/other", "std_msgs/msg/String").problem == ""


def test_killed_while_it_is_asked(robot, cockpit) -> None:
    process = robot(mood="silent")
    node = cockpit()
    subscription = node.create_subscription("/state")
    assert process.event("asked") == STATE
    process.popen.kill()
    process.popen.wait()
    robot(name="spare")
    eventually(subscription.take, what=lambda: subscription.problem)
    assert subscription.type.definition.source.provider == "wire /spare"


def test_the_cache_serves_the_next_program(robot, cockpit, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("ROSGLASS_TYPE_CACHE", str(tmp_path))
    process = robot()
    first = cockpit("first").fetch_type(STATE, timeout=10)
    eventually(lambda: os.listdir(tmp_path))  # noqa: PTH208 - files of any name
    process.end()
    robot(mood="mute")
    node = cockpit("second")
    subscription = node.create_subscription("/state")
    sample = eventually(subscription.take, timeout=15, what=lambda: subscription.problem)
    assert sample.message().name == "Grüße"
    assert subscription.type.definition.source.provider == "cache, from /robot"
    assert subscription.type.rihs01 == first.rihs01


# -- peers that send no definitions ----------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        ("sdk", "/sdk/talker0 has no get_type_description service"),
        ("dora-humble", "/dora/dora_node announces no type hash and sends no definitions"),
    ],
)
def test_peers_that_send_none(kind, complaint, router, start_peer) -> None:
    process = start_peer(kind, router, publish={"/words": "std_msgs/msg/String"}, domain=9)
    with rosglass.connect(
        f"{router.url}?domain=9", "bare", library=Library(MemoryProvider())
    ) as node:
        samples: list[Any] = []
        subscription = node.create_subscription("/words", raw_callback=samples.append)
        eventually(
            lambda: complaint in subscription.problem, timeout=20, what=lambda: subscription.problem
        )
        assert isinstance(eventually(lambda: samples)[0].type, OpaqueType)
        with pytest.raises(TypeNotFoundError, match=complaint):
            node.fetch_type("std_msgs/msg/String")
    process.end()


# -- types that DDS endpoints announce themselves --------------------------------------------------


@pytest.fixture
def cyclone(start, dds_domain) -> Any:
    """Cyclone DDS's own Python writers: no ROS node, no type hashes."""
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    process = start(str(PEER.with_name("xtypes_peer.py")), json.dumps({"domain": dds_domain}))
    process.event("ready")
    yield process
    process.end()


@pytest.mark.peers
def test_types_that_endpoints_announce_themselves(cyclone, dds_connect) -> None:
    node = dds_connect("cockpit")
    subscription = node.create_subscription("/state")
    sample = eventually(subscription.take, timeout=15, what=lambda: subscription.problem)
    part = {"a": 1, "xyz": [1.0, 2.0, 3.0]}
    text = json.dumps(sample.message().to_dict(), default=lambda array: array.tolist())
    assert json.loads(text) == {
        "state": 3,
        "flag": True,
        "parts": [part, part],
        "few": [part],
        "one": part,
        "pair": [part, part],
        "name": "hi",
        "short": "abc",
        "names": ["x", "yz"],
        "raw": [1, 255],
        "letter": 65,
        "small": -2,
        "big": 2**63,
        "wide": 0.5,
    }
    definition = subscription.type.definition
    assert "TypeLookup" in definition.source.provider
    assert definition.name == STATE
    assert str(next(f.type for f in definition.fields if f.name == "short")) == "string<=5"
    assert node.fetch_type(STATE).definition is definition


@pytest.mark.peers
@pytest.mark.parametrize(
    ("topic", "complaint"),
    [
        ("/with_enum", "field color.* an enumeration, which ROS 2 does not have"),
        ("/rows", "field rows.* sequences of sequences are not ROS 2's"),
        ("/mutable", "mutable and derived structs are not ROS 2's"),
        ("/maybe", "field a.* optional fields are not ROS 2's"),
    ],
)
def test_announced_types_that_ros_does_not_have(topic, complaint, cyclone, dds_connect) -> None:
    node = dds_connect("cockpit")
    subscription = node.create_subscription(topic)
    eventually(
        lambda: re.search(complaint, subscription.problem), what=lambda: subscription.problem
    )
