"""``rosglass topic echo``: prints received messages."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from rosglass.cli.connecting import End, connect
from rosglass.cli.output import SHOWN, SHOWN_JSON, Style, fields, note, to_json, to_yaml
from rosglass.cli.values import profile
from rosglass.cli.waiting import Reasons

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator

    from rosglass.comm import Sample

__all__ = ["echo"]


def echo(args: argparse.Namespace) -> int:
    """Print messages until Ctrl-C, or as many as were asked for."""
    style = Style(args)
    # What reads a table would take what is cut for another value, or for fewer columns.
    limit = args.truncate or (None if args.csv else SHOWN_JSON if args.json else SHOWN)
    received = 0
    with connect(args, patient=True) as node:
        subscription = node.create_subscription(args.topic, args.type, qos=profile(args))
        get = _getter(args.field)
        end = End()
        due = time.monotonic() + (math.inf if args.timeout is None else args.timeout)
        with Reasons(node, subscription, args) as reasons:
            while not end.is_set() and (args.count is None or received < args.count):
                sample = subscription.wait(0.2)
                if sample is None:
                    late = time.monotonic() > due
                    reasons.report(last=late)
                    if late:
                        break
                    continue
                received += 1
                reasons.on_count(received)
                due = time.monotonic() + (math.inf if args.timeout is None else args.timeout)
                if args.stamps and not args.json:
                    print(style(f"# received {sample.received.seconds:.6f}", "dim"))
                print(_text(args, sample, get, None if args.full else limit), flush=True)
        dropped = subscription.statistics().dropped
    if dropped:
        note(f"{dropped} messages came faster than they could be printed, and were left out")
    if end.is_set():
        return end.code
    return 0 if args.count is None or received == args.count else 1


def _getter(path: str | None) -> Callable[[Sample], Any]:
    if path is None:
        return lambda sample: sample.message()

    def get(sample: Sample) -> Any:
        return sample.message()[path]

    return get


def _text(
    args: argparse.Namespace, sample: Sample, get: Callable[[Sample], Any], limit: int | None
) -> str:
    from rosglass.messages import OpaqueType

    if args.raw or isinstance(sample.type, OpaqueType):
        data = bytes(sample.data)
        shown = data if limit is None else data[: 16 * limit]
        more = "" if len(shown) == len(data) else f" ... {len(data)} bytes in all"
        if args.json:
            return to_json({"bytes": data.hex(), "received": sample.received.seconds})
        return f"{shown.hex(' ', 4)}{more}\n---"
    found = fields(get(sample), limit)
    if args.json:
        return to_json(found)
    if args.csv:
        return ",".join(_cells(found))
    text = to_yaml(found)
    return text.rstrip("\n") + ("" if args.field and text.count("\n") < 2 else "\n---")


def _cells(value: Any) -> Iterator[str]:
    """Yield what a line of comma-separated values has for a value, in the order of the fields."""
    if isinstance(value, (dict, list)):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _cells(inner)
        return
    text = str(value)
    if set(text) & set(',"\n\r'):
        text = '"' + text.replace('"', '""') + '"'
    yield text
