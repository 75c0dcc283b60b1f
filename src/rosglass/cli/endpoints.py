"""Publishers, subscriptions, servers and clients, as text and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.cli.connecting import is_ros1, spelled
from rosglass.cli.messages import print_json
from rosglass.cli.output import Style, note
from rosglass.comm import Durability, EndpointKind

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence

    from rosglass.comm import EndpointInfo, Node

__all__ = [
    "DUPLICATES_FIX",
    "Problem",
    "describe",
    "duplicates",
    "print_names",
    "problems",
    "short",
    "sources",
]

#: The fix for several nodes of one name.
DUPLICATES_FIX = (
    "give each robot a namespace (-r __ns:=/name), or a domain or router of its own; over DDS, a "
    "node that was killed is seen for some 10 to 20 s"
)

#: Best effort and volatile fits every publisher.
_QOS_FIX = (
    "let the subscription ask for less: QoS.sensor_data() in rosglass, qos_profile_sensor_data in "
    "rclpy, rclcpp::SensorDataQoS() in C++; or let the publisher offer more"
)


class Problem(NamedTuple):
    """Why some of a topic's endpoints do not match, and the fix."""

    text: str
    fix: str


def duplicates(name: str, count: int) -> str:
    """Return the message for a name that several nodes have."""
    return f"{count} nodes are called {name}: what they publish is mixed, and all obey commands"


def describe(node: Node, end: EndpointInfo) -> dict[str, Any]:
    """Return an endpoint of the node's graph as a dict for JSON."""
    if is_ros1(node):
        found: dict[str, Any] = {"kind": end.kind.value, "name": end.name, "node": str(end.node),
                 "type": spelled(node, end.type)}  # fmt: skip
        if end.type_hash:
            found["md5"] = end.type_hash
        if end.type_hash and end.kind is EndpointKind.PUBLISHER:
            found["latched"] = end.qos.durability is Durability.TRANSIENT_LOCAL
        return found
    qos = end.qos
    return {
        "kind": end.kind.value,
        "name": end.name,
        "node": str(end.node),
        "type": end.type,
        "qos": {
            "reliability": qos.reliability.value,
            "durability": qos.durability.value,
            "history": qos.history.value,
            "depth": qos.depth,
            "deadline": None if qos.deadline is None else qos.deadline.seconds,
            "lifespan": None if qos.lifespan is None else qos.lifespan.seconds,
            "liveliness": qos.liveliness.value,
            "lease_duration": None if qos.lease_duration is None else qos.lease_duration.seconds,
        },
        "type_hash": end.type_hash,
        "response_hash": end.response_hash,
        "gid": end.gid.hex(),
    }


def problems(ends: Sequence[EndpointInfo]) -> list[Problem]:
    """Return which of a topic's endpoints do not match each other, and why."""
    found = []
    sinks = [end for end in ends if end.kind is EndpointKind.SUBSCRIPTION]
    if len({end.type for end in ends}) > 1:
        differences = "; ".join(f"{end.node} has {end.type}" for end in ends)
        found.append(
            Problem(
                f"types differ: {differences}",
                "let all use one type, or give one of them another topic: -r old:=new when it is "
                "started",
            )
        )
    for sink in sinks:
        for source in sources(ends):
            conflict = sink.qos.incompatibility(source.qos)
            if conflict:
                text = f"{sink.node} may get nothing from {source.node}: {conflict}"
                found.append(Problem(text, _QOS_FIX))
            hashes = {end.type_hash for end in (sink, source)} - {""}
            if source.type == sink.type and len(hashes) > 1:
                text = f"{sink.node} and {source.node} define {sink.type} differently"
                found.append(Problem(text, "build both from the same sources of messages"))
    return found


def sources(ends: Sequence[EndpointInfo]) -> list[EndpointInfo]:
    """Return those of a topic's endpoints that publish."""
    return [end for end in ends if end.kind is EndpointKind.PUBLISHER]


def short(value: object) -> str:
    """Return a value of :func:`describe` in one line."""
    if value is True:
        return "yes"
    if not isinstance(value, dict):
        return str(value)
    return ", ".join(f"{key} {inner}" for key, inner in value.items() if inner is not None)


def print_names(
    args: argparse.Namespace, node: Node, what: str, found: Mapping[str, Sequence[str]]
) -> None:
    """Print names in the graph, with their types if requested.

    Args:
        args: The command's options.
        node: Node in the graph; may be closed.
        what: ``service`` or ``action``.
        found: Name -> types.
    """
    style = Style(args)
    spelling = {name: [spelled(node, one) for one in types] for name, types in found.items()}
    if args.json:
        print_json([{what: name, "types": types} for name, types in spelling.items()])
        return
    for name, types in spelling.items():
        print(name + (style(f" [{', '.join(types)}]", "dim") if args.types else ""))
    if not found:
        note(f"there are no {what}s here; rosglass doctor finds out why")
