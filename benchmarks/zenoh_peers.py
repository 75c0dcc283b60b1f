"""The other sides of benchmarks/topics.py: bare zenoh, dora-rs and zenoh-ros2-sdk."""

from __future__ import annotations

import json
import os
import struct
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

TOPIC = "/bench"
#: Sessions close when nothing refers to them.
_kept: list[Any] = []
Plan = dict[str, Any]


def key(plan: Plan) -> str:
    import rosglass
    from rosglass.wires.zenoh.keys import topic_key

    return topic_key(0, TOPIC, plan["type"], rosglass.load(plan["type"]).rihs01)


def session(plan: Plan) -> Any:
    """Open a session with the settings that ours has."""
    import zenoh

    from rosglass.wires.zenoh.options import ZenohOptions
    from rosglass.wires.zenoh.session import session_config

    options = ZenohOptions(
        "127.0.0.1", plan["port"], mode=plan.get("mode"), shared_memory=plan["shm"]
    )
    return zenoh.open(session_config(options)[0])


def keep(*declared: Any) -> None:
    """Keep what would end when nothing refers to it."""
    _kept.extend(declared)


def bare_publisher(plan: Plan, data: bytes) -> Callable[[], None]:
    """Return what puts `data` with the attachment of ROS 2."""
    import zenoh

    opened = session(plan)
    publisher = opened.declare_publisher(
        key(plan), congestion_control=zenoh.CongestionControl.BLOCK
    )
    gid, numbers = bytes(16), iter(range(1, 1 << 40))

    def put() -> None:
        note = struct.pack("<qqB16s", next(numbers), time.time_ns(), 16, gid)
        publisher.put(data, attachment=note)

    _kept.append(opened)
    return put


def bare_subscriber(plan: Plan, note: Callable[[int], None]) -> Any:
    """Read each sample and its time stamp in a callback, as fast as the package allows it."""
    import zenoh

    def receive(sample: Any) -> None:
        sample.payload.to_bytes()
        note(struct.unpack_from("<q", sample.attachment.to_bytes(), 8)[0])

    handler = zenoh.handlers.Callback(receive, indirect=False)
    if plan["receive"] == "native":
        # What Zenoh itself costs: nothing ever comes to Python.
        handler = zenoh.handlers.RingChannel(10)
    opened = session(plan)
    return opened, opened.declare_subscriber(key(plan), handler)


def stamp_of(header: Any) -> int:
    return int(header["stamp"]["sec"]) * 1_000_000_000 + int(header["stamp"]["nanosec"])


def dora_subscriber(plan: Plan, note: Callable[[int], None]) -> Any:
    """Poll dora's subscription, its only way, and read the stamp of each image."""
    import dora

    config = {
        "mode": "peer",
        "connect": {"endpoints": [f"tcp/127.0.0.1:{plan['port']}"]},
        "listen": {"endpoints": ["tcp/127.0.0.1:0"]},
        "scouting": {"multicast": {"enabled": False}},
        "timestamping": {"enabled": True},
    }
    folder = Path(tempfile.mkdtemp())
    (folder / "zenoh.json5").write_text(json.dumps(config))
    prefix = interfaces(folder)
    os.environ |= {"ROS_DOMAIN_ID": "0", "AMENT_PREFIX_PATH": str(prefix)}
    transport = dora.Ros2Transport.zenoh("rep2016", str(folder / "zenoh.json5"))
    context = dora.Ros2Context([str(prefix)], transport=transport, domain_id=0)
    node = context.new_node("dora", "/", dora.Ros2NodeOptions())
    qos = dora.Ros2QosPolicies(reliable=True, keep_last=10)
    topic = node.create_topic(TOPIC, plan["type"].replace("/msg/", "/"), qos)
    subscription = node.create_subscription(topic)

    def work() -> None:
        while True:
            message = subscription.next()
            if message is None:
                time.sleep(0.0005)
            else:
                note(stamp_of(message[0]["header"].as_py()))

    threading.Thread(target=work, daemon=True).start()
    return node, subscription


def sdk_subscriber(plan: Plan, note: Callable[[int], None]) -> Any:
    """Let zenoh-ros2-sdk call back with decoded images."""
    from zenoh_ros2_sdk import message_registry
    from zenoh_ros2_sdk.subscriber import ROS2Subscriber

    message_registry.get_registry(str(interfaces(Path(tempfile.mkdtemp())) / "share"))

    def receive(message: Any) -> None:
        stamp = message.header.stamp
        note(stamp.sec * 1_000_000_000 + stamp.nanosec)

    return ROS2Subscriber(TOPIC, plan["type"], receive, router_port=plan["port"], domain_id=0)


def interfaces(folder: Path) -> Path:
    """Write the definitions of an image, as ROS installs them."""
    from rosglass.interfaces import Definition, Library, rihs01, type_description

    library = Library()
    image = library.definition("sensor_msgs/msg/Image")
    assert isinstance(image, Definition)
    for name in ("sensor_msgs/msg/Image", *image.nested):
        definition = library.definition(name)
        assert isinstance(definition, Definition)
        package, kind, base = name.split("/")
        home = folder / "share" / package
        (home / kind).mkdir(parents=True, exist_ok=True)
        for other in ("srv", "action"):
            (home / other).mkdir(exist_ok=True)
        (home / kind / f"{base}.msg").write_text(definition.text.partition("\n====")[0])
        parts = (definition, *definition.nested.values())
        hashes = [{"type_name": part.name, "hash_string": rihs01(part)} for part in parts]
        described = {"type_description_msg": type_description(definition), "type_hashes": hashes}
        (home / kind / f"{base}.json").write_text(json.dumps(described))
        (home / "package.xml").write_text(
            f'<package format="3"><name>{package}</name><version>1.0.0</version><description/>'
            '<maintainer email="a@example.org">a</maintainer><license>MIT</license></package>'
        )
    return folder
