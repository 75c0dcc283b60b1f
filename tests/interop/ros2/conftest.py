"""Fixtures for tests with real ROS 2 peers over Zenoh and DDS."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import random
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from waiting import eventually

import rosglass
from rosglass.interfaces import (
    ActionDefinition,
    Definition,
    Library,
    ServiceDefinition,
    rihs01,
    type_description,
)
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node

PEERS = Path(__file__).parent / "peers"
MODULES = {"rosglass": "rosglass", "sdk": "zenoh_ros2_sdk", "dora": "dora"}


@pytest.fixture(scope="session")
def peer_values() -> Any:
    """The module that peers share: ``VALUES`` they publish, ``summary()`` of what they receive."""
    spec = importlib.util.spec_from_file_location("summary", PEERS / "summary.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def router() -> Iterator[Router]:
    with Router(f"tcp/127.0.0.1:{free_port()}") as running:
        yield running


@pytest.fixture
def start_router(start: Callable[..., Any], free_port: int) -> Callable[[], Any]:
    """Start the command `rosglass router`, always on the same port; ``start_router.url``."""

    def start_router() -> Any:
        address = f"tcp/127.0.0.1:{free_port}"
        process = start("-m", "rosglass", "router", "--listen", address)
        eventually(lambda: address in "".join(process.output))
        return process

    start_router.url = f"zenoh://127.0.0.1:{free_port}"  # type: ignore[attr-defined]
    return start_router


@pytest.fixture
def connect(router: Router) -> Iterator[Callable[..., Node]]:
    """Connect to the router; nodes are closed at the end of the test."""
    nodes: list[Node] = []

    def connect(name: str, options: str = "", namespace: str = "/", url: str = "") -> Node:
        node = rosglass.connect((url or router.url) + options, name, namespace)
        nodes.append(node)
        return node

    yield connect
    for node in nodes:
        node.close()


def pytest_report_header() -> str:
    """Say how far the traffic of the tests reaches."""
    if os.environ.get("ROSGLASS_PRIVATE_NETWORK"):
        return "DDS: in a private network"
    return "DDS: in this machine's own network, in random domains (scripts/private_network.sh)"


@pytest.fixture(scope="module")
def dds_domain(ros_domains: list[int]) -> int:
    """A ROS domain for the tests of a module, most likely unused on this machine."""
    return random.SystemRandom().choice(ros_domains)


@pytest.fixture
def dds_connect(dds_domain: int) -> Iterator[Callable[..., Node]]:
    """Connect to the module's domain; nodes are closed at the end of the test."""
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    nodes: list[Node] = []

    def connect(name: str, options: str = "", namespace: str = "/") -> Node:
        node = rosglass.connect(f"dds://?domain={dds_domain}{options}", name, namespace)
        nodes.append(node)
        return node

    yield connect
    for node in nodes:
        node.close()


@pytest.fixture(scope="session")
def fastdds_program(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Build the Fast DDS peer, unless it was before; peers/fastdds_peer.cpp says what it does."""
    source = PEERS / "fastdds_peer.cpp"
    compiler = shutil.which("g++")
    if compiler is None or not Path("/usr/include/fastdds").is_dir():
        pytest.skip("Fast DDS is not installed: sudo apt-get install g++ libfastrtps-dev")
    version = hashlib.sha256(source.read_bytes()).hexdigest()[:16]
    cache = getattr(request.config, "cache", None)  # -p no:cacheprovider leaves none
    folder = tmp_path_factory.mktemp("fastdds") if cache is None else cache.mkdir("fastdds")
    program = folder / f"fastdds_peer_{version}"
    if not program.exists():
        made = program.with_name(f"{program.name}_{os.getpid()}")
        command = [compiler, "-std=c++17", str(source), "-o", str(made)]
        subprocess.run([*command, "-lfastrtps", "-lfastcdr"], check=True)
        made.rename(program)
    return program


@pytest.fixture
def start_rclpy(
    start_rclpy_at: Callable[..., subprocess.Popen[str]], dds_domain: int
) -> Callable[..., subprocess.Popen[str]]:
    """Start a program of rclpy (``peers/NAME.py``) in the module's domain."""
    return lambda name, *arguments, **environment: start_rclpy_at(
        dds_domain, PEERS / f"{name}.py", *arguments, **environment
    )


@pytest.fixture(scope="session")
def interfaces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A prefix such as ROS installs, with the definitions that peers need."""
    prefix = tmp_path_factory.mktemp("interfaces")
    library = Library()
    waiting = ["std_msgs/msg/String", "geometry_msgs/msg/Twist", "sensor_msgs/msg/Image"]
    packages = set()
    while waiting:
        name = waiting.pop()
        definition = library.definition(name)
        assert isinstance(definition, Definition)
        waiting += definition.nested
        package, _, base = name.split("/")
        packages.add(package)
        folder = prefix / "share" / package / "msg"
        folder.mkdir(parents=True, exist_ok=True)
        text = definition.text.partition("\n====")[0]
        (folder / f"{base}.msg").write_text(text)
        hashes = [
            {"type_name": part.name, "hash_string": rihs01(part)}
            for part in (definition, *definition.nested.values())
        ]
        described = {"type_description_msg": type_description(definition), "type_hashes": hashes}
        (folder / f"{base}.json").write_text(json.dumps(described))
    for package in packages:
        for kind in ("srv", "action"):
            (prefix / "share" / package / kind).mkdir()
        (prefix / "share" / package / "package.xml").write_text(
            f'<package format="3"><name>{package}</name><version>1.0.0</version><description/>'
            '<maintainer email="a@example.org">a</maintainer><license>MIT</license></package>'
        )
    return prefix


# What dora needs to know, with the types that ROS makes of each.
_SERVICE = ("", "_Request", "_Response", "_Event")
_INSTALLED = {
    "example_interfaces/srv/AddTwoInts": _SERVICE,
    "action_msgs/srv/CancelGoal": _SERVICE,
    "example_interfaces/action/Fibonacci": (
        "",
        "_Goal",
        "_Result",
        "_Feedback",
        "_FeedbackMessage",
        *(f"_SendGoal{part}" for part in _SERVICE),
        *(f"_GetResult{part}" for part in _SERVICE),
    ),
    "action_msgs/msg/GoalInfo": ("",),
    "action_msgs/msg/GoalStatus": ("",),
    "action_msgs/msg/GoalStatusArray": ("",),
    "builtin_interfaces/msg/Time": ("",),
    "service_msgs/msg/ServiceEventInfo": ("",),
    "unique_identifier_msgs/msg/UUID": ("",),
}


@pytest.fixture(scope="session")
def service_interfaces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A prefix such as ROS installs, with the services and actions that peers need."""
    prefix, library = tmp_path_factory.mktemp("service_interfaces"), Library()
    for name, suffixes in _INSTALLED.items():
        package, kind, base = name.split("/")
        home = prefix / "share" / package
        for folder in ("msg", "srv", "action"):
            (home / folder).mkdir(parents=True, exist_ok=True)
        definition = library.definition(name)
        assert isinstance(definition, (Definition, ServiceDefinition, ActionDefinition))
        (home / kind / f"{base}.{kind}").write_text(definition.text.partition("\n====")[0])
        hashes = [
            {"type_name": name + suffix, "hash_string": rihs01(library.definition(name + suffix))}
            for suffix in suffixes
        ]
        described = {"type_description_msg": type_description(definition), "type_hashes": hashes}
        (home / kind / f"{base}.json").write_text(json.dumps(described))
        (home / "package.xml").write_text(
            f'<package format="3"><name>{package}</name><version>1.0.0</version><description/>'
            '<maintainer email="a@example.org">a</maintainer><license>MIT</license></package>'
        )
    return prefix


@pytest.fixture(scope="module")
def start_peer(start: Callable[..., Any], interfaces: Path) -> Callable[..., Any]:
    """Start a peer's script with a plan, and wait until it is ready."""

    def start_peer(kind: str, router: Router, **plan: Any) -> Any:
        plan.setdefault("domain", 0)
        plan |= {"port": int(router.listen.rpartition(":")[2]), "interfaces": str(interfaces)}
        script, _, plan["profile"] = kind.partition("-")
        module = MODULES[script]
        if importlib.util.find_spec(module) is None:
            pytest.skip(f'{module} is not installed: pip install "rosglass[peers]"')
        # dora takes the domain of its data keys and its type descriptions from here only.
        env = os.environ | {
            "ROS_DOMAIN_ID": str(plan["domain"]),
            "AMENT_PREFIX_PATH": str(interfaces),
        }
        process = start(str(PEERS / f"{script}_peer.py"), json.dumps(plan), env=env)
        process.event("ready")
        return process

    return start_peer
