"""``rosglass lifecycle``: inspect lifecycle nodes, and take them through their states.

Output: that of ``ros2 lifecycle``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.cli.connecting import await_types, connect, find, is_ros1
from rosglass.cli.messages import print_json
from rosglass.cli.output import Style, note
from rosglass.comm.names import hidden
from rosglass.errors import Error, TransitionError, UnsupportedError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from rosglass.comm import LifecycleClient, Node, State, Transition

__all__ = ["get", "list_nodes", "list_transitions", "set_state"]

_SERVICE, _TYPE = "/get_state", "lifecycle_msgs/srv/GetState"


def list_nodes(args: argparse.Namespace) -> int:
    """Print the lifecycle nodes."""
    with _connect(args) as node:
        found = _lifecycle_nodes(node, args)
    if args.json:
        print_json(found)
        return 0
    if args.count:
        print(len(found))
        return 0
    for name in found:
        print(name)
    if not found:
        note("there are no lifecycle nodes here; rosglass node list shows all nodes")
    return 0


def get(args: argparse.Namespace) -> int:
    """Print the state of a lifecycle node, or of all."""
    with _connect(args) as node:
        if args.node:
            client = _client(node, args)
            states, missing = {client.node: client.state(timeout=args.timeout)}, dict[str, str]()
        else:
            states, missing = _all_states(node, args)
    if args.json:
        print_json({name: _json_state(state) for name, state in states.items()})
    else:
        for name, state in states.items():
            print(str(state) if args.node else f"{name}: {state}")
    for name, problem in missing.items():
        note(f"{name}: {problem}")
    if not (states or missing):
        note("there are no lifecycle nodes here; rosglass node list shows all nodes")
    return 1 if missing else 0


def list_transitions(args: argparse.Namespace) -> int:
    """Print the transitions that are possible in the node's state, or all of them."""
    style = Style(args)
    with _connect(args) as node:
        client = _client(node, args)
        found = (client.transition_graph if args.all else client.available_transitions)(
            timeout=args.timeout
        )
    if args.json:
        print_json([_json_transition(one) for one in found])
        return 0
    for one in found:
        print(f"- {style(str(one), 'bold')}\n\tStart: {one.start}\n\tGoal: {one.goal}")
    if not found:
        note(f"{args.node} has no transition from its state")
    return 0


def set_state(args: argparse.Namespace) -> int:
    """Make a transition, and print the state that it has led to."""
    wanted = int(args.transition) if args.transition.isdecimal() else args.transition
    with _connect(args) as node:
        client = _client(node, args)
        try:
            state = client.change_state(wanted, timeout=args.timeout)
        except TransitionError as error:
            note(str(error))
            return 1
    if args.json:
        print_json(_json_state(state))
    else:
        print(f"Transitioning successful: {args.node} is {state}")
    return 0


def _connect(args: argparse.Namespace) -> Node:
    node = connect(args)
    if is_ros1(node):
        node.close()
        raise UnsupportedError("ROS 1 has no lifecycle nodes: rosglass lifecycle is for ROS 2")
    return node


def _client(node: Node, args: argparse.Namespace) -> LifecycleClient:
    """Return a client of the named node; raises Error for one that is not a lifecycle node."""
    args.node = "/" + args.node.lstrip("/")

    def is_here() -> bool:
        return args.node + _SERVICE in node.services()

    if not find(node, is_here, args.timeout, whole=False):
        names = _names(node.services(), include_hidden=True)
        known = f"; lifecycle nodes are: {', '.join(names)}" if names else ""
        raise Error(f"{args.node} is not a lifecycle node here{known}")
    return node.create_lifecycle_client(args.node)


def _lifecycle_nodes(node: Node, args: argparse.Namespace) -> list[str]:
    find(node, lambda: bool(_names(node.services(), include_hidden=True)), args.timeout)
    await_types(node, lambda: node.services().values(), args.timeout)
    return _names(node.services(), include_hidden=args.all)


def _names(services: dict[str, list[str]], *, include_hidden: bool) -> list[str]:
    """Return the names of the nodes that offer lifecycle services."""
    names = [
        name.removesuffix(_SERVICE)
        for name, types in services.items()
        if name.endswith(_SERVICE) and _TYPE in types
    ]
    return sorted(name for name in names if include_hidden or not hidden(name))


def _all_states(node: Node, args: argparse.Namespace) -> tuple[dict[str, State], dict[str, str]]:
    """Return the states of all lifecycle nodes, and why others did not report theirs."""
    args.all = True
    states: dict[str, State] = {}
    problems: dict[str, str] = {}
    for name in _lifecycle_nodes(node, args):
        try:
            states[name] = node.create_lifecycle_client(name).state(timeout=args.timeout)
        except Error as error:  # noqa: PERF203 - each has its own state
            problems[name] = str(error)
    return states, problems


def _json_state(state: State) -> dict[str, object]:
    return {"id": state.id, "label": state.label}


def _json_transition(one: Transition) -> dict[str, object]:
    ends: Sequence[tuple[str, State]] = (("start", one.start), ("goal", one.goal))
    return {
        "id": one.id,
        "label": one.label,
        **{name: _json_state(state) for name, state in ends},
    }
