"""The log, simulated time and renamed things, between rosglass programs over Zenoh and DDS."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from waiting import eventually

from rosglass import QoS, Time

PEERS = Path(__file__).parent / "peers"


@pytest.fixture(params=["zenoh", "dds"])
def node(request: pytest.FixtureRequest) -> Any:
    connect = request.getfixturevalue("connect" if request.param == "zenoh" else "dds_connect")
    return connect("cockpit")


def test_the_log_time_and_names_of_another_program(node: Any, start: Any) -> None:
    logs: list[Any] = []
    node.create_subscription("/rosout", "rcl_interfaces/msg/Log", logs.append)
    arguments = ["-r", "chatter:=/talk", "-r", "__node:=left", "-r", "__ns:=/arms"]
    plan = {"url": node.url, "arguments": arguments}
    robot = start(str(PEERS / "rcl_services_peer.py"), json.dumps(plan))
    robot.event("ready")
    robot.ask(read=True)
    assert robot.event("chatter") == "/talk"
    eventually(lambda: "/arms/left" in [name.full for name in node.nodes()])
    eventually(lambda: node.publishers("/rosout"))
    robot.ask(log="battery low")
    eventually(lambda: [log for log in logs if log.msg == "battery low"])
    log = next(log for log in logs if log.msg == "battery low")
    assert (log.name, log.level, Path(log.file).name) == ("arms.left", 30, "rcl_services_peer.py")

    # A late subscription gets the log of the last 10 s.
    late: list[Any] = []
    node.create_subscription("/rosout", "rcl_interfaces/msg/Log", late.append, QoS.latched(100))
    eventually(lambda: [log for log in late if log.msg == "battery low"])

    node.parameters.set({"use_sim_time": True})
    assert node.now() == Time(0)
    eventually(lambda: node.publishers("/clock"))
    ticks: list[Time] = []
    node.create_timer(1.0, lambda: ticks.append(node.now()))

    def tick(seconds: int) -> bool:
        robot.ask(clock=seconds)
        return bool(node.now() == Time.from_parts(seconds, 0))

    eventually(lambda: tick(100))
    eventually(lambda: ticks)
    eventually(lambda: tick(102))
    eventually(lambda: len(ticks) == 2)
    assert ticks[1] == Time.from_parts(102, 0)
