"""``rosglass topic echo``: print what comes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from rosglass.cli.connecting import connect, end_event
from rosglass.cli.output import SHOWN, Style, fields, note, to_json, to_yaml
from rosglass.cli.values import profile

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from rosglass.comm import Node, Sample, Subscription

__all__ = ["Reasons", "echo"]


def echo(args: argparse.Namespace) -> int:
    """Print messages until Ctrl-C, or as many as were asked for."""
    style, end = Style(args), end_event()
    limit = None if args.full else SHOWN
    received = 0
    with connect(args) as node:
        subscription = node.create_subscription(args.topic, args.type, qos=profile(args))
        get = _getter(args.field)
        with Reasons(node, subscription, args.timeout) as reasons:
            while not end.is_set() and (args.count is None or received < args.count):
                sample = subscription.wait(0.2)
                if sample is None:
                    reasons.tell()
                    continue
                received += 1
                if args.stamps and not args.json:
                    print(style(f"# received {sample.received.seconds:.6f}", "dim"))
                print(_text(args, sample, get, limit), flush=True)
        dropped = subscription.statistics().dropped
    if dropped:
        note(f"{dropped} messages came faster than they could be printed, and were left out")
    return 0 if received or args.count is None else 1


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
    text = to_yaml(found)
    return text.rstrip("\n") + ("" if args.field and text.count("\n") < 2 else "\n---")


class Reasons:
    """Tells the person who waits why nothing comes."""

    def __init__(self, node: Node, subscription: Subscription, patience: float) -> None:
        self._node, self._subscription = node, subscription
        self._due = time.monotonic() + min(2.0, patience)
        self._told = ""

    def __enter__(self) -> Reasons:
        return self

    def __exit__(self, *_: object) -> None:
        self._subscription.close()

    def tell(self) -> None:
        """Say what is wrong, once for each reason."""
        if time.monotonic() < self._due:
            return
        found = self._subscription
        reason = found.problem or found.hint
        if not reason and not found.statistics().received:
            publishers = self._node.publishers(found.topic)
            reason = "published, but nothing has come yet" if publishers else "nobody publishes it"
        if reason and reason != self._told:
            self._told = reason
            note(f"{found.topic}: {reason}")
