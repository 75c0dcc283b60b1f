"""``rosglass action``: inspect actions, send goals."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.cli.connecting import (
    End,
    await_graph,
    connect,
    create_typed,
    explained_wait,
    find,
    is_ros1,
    note_invalid_names,
    spelled,
    wait,
)
from rosglass.cli.endpoints import describe, print_names
from rosglass.cli.messages import (
    fields,
    parse_fields,
    print_json,
    split_type,
    template,
    to_json,
    to_yaml,
)
from rosglass.cli.output import Style, note
from rosglass.comm import IMMEDIATE, GoalStatus
from rosglass.comm.names import similar
from rosglass.errors import Error, ServiceUnavailableError

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import ClientGoal, EndpointInfo, Node
    from rosglass.messages import Message

__all__ = ["info", "list_actions", "send"]

#: Seconds to wait for the end of a cancelled goal.
_CANCEL_TIMEOUT_S = 5.0


def list_actions(args: argparse.Namespace) -> int:
    """Print the actions."""
    with connect(args) as node:
        await_graph(node)
        note_invalid_names(node)
        found = node.actions()
    print_names(args, node, "action", found)
    return 0


def info(args: argparse.Namespace) -> int:
    """Print the servers and clients of an action."""
    style = Style(args)
    with connect(args) as node:
        name = node.resolve(args.action)
        find(node, lambda: any(_ends(node, name)), args.timeout)
        servers, clients = _ends(node, name)
        known = node.actions()
        types = known.get(name, [])
    if not servers and not clients:
        hint = similar(name, known) or "; rosglass action list shows what there is"
        note(f"no node offers or uses {name}{hint}")
        return 1
    if args.json:
        print_json(
            {
                "action": name, "types": [spelled(node, t) for t in types],
                "servers": [describe(node, end)["node"] for end in servers],
                "clients": [describe(node, end)["node"] for end in clients],
            }
        )  # fmt: skip
        return 0
    print(f"{style(name, 'bold')} [{', '.join(spelled(node, t) for t in types)}]")
    for what, ends in (("server", servers), ("client", clients)):
        for end in ends:
            print(f"  action {what} {style(end.node, 'cyan')}")
    return 0


def _ends(node: Node, name: str) -> tuple[list[EndpointInfo], list[EndpointInfo]]:
    """Return an action's servers and clients."""
    if is_ros1(node):
        return node.publishers(f"{name}/result"), node.publishers(f"{name}/goal")
    service = f"{name}/_action/send_goal"
    return node.service_servers(service), node.service_clients(service)


def send(args: argparse.Namespace) -> int:
    """Send a goal, and wait for its end; Ctrl-C cancels it."""
    type_name, text = split_type(args.rest)
    style = Style(args)

    def on_feedback(feedback: Message) -> None:
        found = fields(feedback)
        print(to_json({"feedback": found}) if args.json else _block("feedback", found), flush=True)

    with connect(args) as node:
        name = node.resolve(args.action)
        with create_typed(
            node, lambda: node.create_action_client(name, type_name), type_name, args.timeout
        ) as client:
            with explained_wait(lambda: client.problem):
                wait(node, lambda: client.type is not None, args.timeout)
            if client.type is None:
                raise ServiceUnavailableError(client.problem or f"no node offers {name}")
            goal_type = client.type.goal
            goal = client.send_goal(
                parse_fields(text, goal_type.name, template(goal_type)),
                on_feedback=on_feedback if args.feedback else None,
                executor=IMMEDIATE,
                timeout=args.timeout,
            )
            printed, end = GoalStatus.PENDING, End()
            with explained_wait(
                lambda: client.problem if goal.status is GoalStatus.PENDING else ""
            ):
                while not goal.done.done():
                    if goal.status is not printed and not args.json:
                        printed = goal.status
                        print(style(f"# goal {goal.id_text} {printed.value}", "dim"), flush=True)
                    if end.wait(0.05):
                        _cancel(goal)
                        break
            try:
                status, result = goal.result(0)
            except Error as error:
                note(spelled(node, f"{name}: {error}"))
                return 1
    found = fields(result, None if args.json else 100)
    if args.json:
        print(to_json({"id": goal.id_text, "status": status.value, "result": found}))
    else:
        print(_block("result", found))
        color = "green" if status is GoalStatus.SUCCEEDED else "red"
        print(style(f"# goal {goal.id_text} {status.value}", color))
    return 0 if status is GoalStatus.SUCCEEDED else 1


def _cancel(goal: ClientGoal) -> None:
    note("cancelling the goal")
    answer = goal.cancel()
    deadline = time.monotonic() + _CANCEL_TIMEOUT_S
    while time.monotonic() < deadline and not goal.done.done():
        if answer.done() and answer.exception() is not None:
            note(f"the goal cannot be cancelled: {answer.exception()}")
            return
        time.sleep(0.02)
    if not goal.done.done():
        note("the goal is still running: its server does not cancel it")


def _block(what: str, found: object) -> str:
    lines = to_yaml(found).rstrip("\n").splitlines()
    return "\n".join([f"{what}:", *(f"  {line}" for line in lines)])
