"""``rosglass action``: inspect actions, send goals."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.cli.completion import complete
from rosglass.cli.connecting import (
    End,
    add_connection_options,
    connect,
    find,
    note_invalid_names,
    settle,
    telling,
    wait,
)
from rosglass.cli.endpoints import describe
from rosglass.cli.output import (
    Style,
    add_output_options,
    fields,
    note,
    print_json,
    template,
    to_json,
    to_yaml,
)
from rosglass.cli.subcommands import Subcommands
from rosglass.cli.values import parse_fields, split_type
from rosglass.cli.worlds import is_ros1, spelled
from rosglass.comm.names import similar

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import ClientGoal, EndpointInfo, Node
    from rosglass.messages import Message

__all__ = ["configure", "run"]

#: Seconds to wait for the end of a cancelled goal.
_CANCEL_TIMEOUT_S = 5.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the subcommands for actions."""
    add = Subcommands(parser).add
    sub = add("list", "list actions", _list)
    sub.add_argument("-t", "--types", "--show-types", action="store_true", help="show types")
    _finish(sub)
    sub = add("info", "show the servers and clients of an action", _info)
    complete(sub.add_argument("action"), "actions")
    _finish(sub)
    summary = "send a goal and wait for its end; Ctrl-C cancels it"
    sub = add("send", summary, _send, aliases=("send_goal",))
    complete(sub.add_argument("action"), "actions")
    complete(
        sub.add_argument(
            "rest", nargs="*", metavar="[TYPE] VALUES", help="goal as YAML: '{order: 5}'"
        ),
        "action_types",
    )
    sub.add_argument("-f", "--feedback", action="store_true", help="print feedback")
    _finish(sub)


def run(args: argparse.Namespace) -> int:
    """Run the subcommand."""
    return int(args.handler(args))


def _finish(parser: argparse.ArgumentParser) -> None:
    add_output_options(parser)
    add_connection_options(parser)


def _list(args: argparse.Namespace) -> int:
    style = Style(args)
    with connect(args) as node:
        settle(node)
        note_invalid_names(node)
        found = node.actions()
    if args.json:
        print_json([{"action": name, "types": [spelled(node, t) for t in types]}
                    for name, types in found.items()])  # fmt: skip
        return 0
    for name, types in found.items():
        print(
            name
            + (
                style(f" [{', '.join(spelled(node, t) for t in types)}]", "dim")
                if args.types
                else ""
            )
        )
    if not found:
        note("there are no actions here; rosglass doctor looks why")
    return 0


def _info(args: argparse.Namespace) -> int:
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


def _send(args: argparse.Namespace) -> int:
    from rosglass.comm import IMMEDIATE, GoalStatus
    from rosglass.errors import Error, ServiceUnavailableError

    type_name, text = split_type(args.rest)
    style = Style(args)

    def show(feedback: Message) -> None:
        found = fields(feedback)
        print(to_json({"feedback": found}) if args.json else _block("feedback", found), flush=True)

    with connect(args) as node:
        name = node.resolve(args.action)
        with node.create_action_client(name, type_name) as client:
            with telling(lambda: client.problem):
                wait(node, lambda: client.type is not None, args.timeout)
            if client.type is None:
                raise ServiceUnavailableError(client.problem or f"no node offers {name}")
            kind = client.type.goal
            goal = client.send_goal(
                parse_fields(text, kind.name, template(kind)),
                on_feedback=show if args.feedback else None,
                executor=IMMEDIATE,
                timeout=args.timeout,
            )
            printed, end = GoalStatus.PENDING, End()
            with telling(lambda: client.problem if goal.status is GoalStatus.PENDING else ""):
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
        colour = "green" if status is GoalStatus.SUCCEEDED else "red"
        print(style(f"# goal {goal.id_text} {status.value}", colour))
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
