"""``rosglass topic``: list, print, measure and publish topics."""

from __future__ import annotations

import itertools
import logging
import math
import statistics
import threading
import time
from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.cli.connecting import (
    End,
    as_ros1,
    await_graph,
    connect,
    create_typed,
    explained_wait,
    find,
    is_hidden,
    note_invalid_names,
    spelled,
    wait,
)
from rosglass.cli.endpoints import describe, problems, short, sources
from rosglass.cli.messages import (
    SHOWN,
    SHOWN_JSON,
    fields,
    parse_fields,
    print_json,
    profile,
    split_type,
    template,
    to_json,
    to_yaml,
)
from rosglass.cli.output import Style, note, require_reader
from rosglass.comm import IMMEDIATE, ConnectionState
from rosglass.comm.names import similar
from rosglass.errors import Error, TypeNotFoundError
from rosglass.messages import OpaqueType
from rosglass.wires.zenoh.options import shown_url

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterable, Iterator

    from rosglass.comm import Node, Sample, Subscription
    from rosglass.messages import MessageType

__all__ = ["echo", "info", "list_topics", "measure", "publish"]

#: Seconds without messages that are not reported.
_QUIET_S = 2.0
#: How many times the usual pause between messages counts as silence.
_PAUSES = 5
#: Shown for an unknown type.
_UNKNOWN = "unknown"
#: Seconds that ROS 1's publishers may take to send their type.
_TYPE_TIMEOUT_S = 3.0


def list_topics(args: argparse.Namespace) -> int:
    """Print the topics."""
    style = Style(args)
    with connect(args) as node:
        await_graph(node)
        note_invalid_names(node)
        found = {t: k for t, k in node.topics().items() if args.hidden or not is_hidden(node, t)}
        counts = {t: (len(node.publishers(t)), len(node.subscriptions(t))) for t in found}
    if args.count_topics:
        if args.json:
            print_json({"count": len(found)})
        else:
            print(len(found))
        return 0
    if args.json:
        print_json(
            [
                {"topic": t, "types": [spelled(node, one) for one in types],
                 "publishers": counts[t][0],
                 "subscriptions": counts[t][1]}
                for t, types in found.items()
            ]
        )  # fmt: skip
        return 0
    for topic, types in found.items():
        several = style(f"  {len(types)} types!", "red") if len(types) > 1 else ""
        shown = style(f" [{_types(node, types)}]", "dim") if args.types else several
        print(topic + shown)
    if not found:
        graph = shown_url(args.url or "this graph")
        note(f"there are no topics on {graph}; rosglass doctor finds out why")
    return 0


def info(args: argparse.Namespace) -> int:
    """Print the publishers and subscribers of a topic."""
    style = Style(args)
    with connect(args) as node:
        topic = node.resolve(args.topic)
        ends = find(
            node, lambda: [*node.publishers(topic), *node.subscriptions(topic)], args.timeout
        )
        if not ends:
            return _unknown(node, topic)
        ros1 = as_ros1(node)
        if ros1 is not None:
            publishers = ros1.ask_publishers(topic, min(args.timeout, _TYPE_TIMEOUT_S))
            ends = [*publishers, *node.subscriptions(topic)]
    if args.json:
        print_json({"topic": topic, "endpoints": [describe(node, end) for end in ends]})
        return 0
    types = _types(node, {end.type for end in ends})
    shown = "unknown (no publisher)" if types == _UNKNOWN and not sources(ends) else types
    print(f"{style(topic, 'bold')} [{shown}]")
    for problem in problems(ends):
        print(style(f"  {problem.text}", "red"))
    for end in ends:
        print(f"  {end.kind.value} {style(end.node, 'cyan')}")
        # In ROS 1, a topic has one type, which is printed above.
        above = ("kind", "name", "node", *(("type",) if ros1 else ()))
        for key, value in describe(node, end).items():
            if key not in above and value:
                print(f"    {key}: {short(value)}")
        if ros1 and end in sources(ends) and not end.type_hash:
            print("    does not answer: its md5 sum, and whether it latches, is not known")
    return 0


def _types(node: Node, names: Iterable[str]) -> str:
    return ", ".join(sorted(spelled(node, name) for name in names if name)) or _UNKNOWN


def _unknown(node: Node, topic: str) -> int:
    note(f"nothing publishes or subscribes to {topic}{similar(topic, node.topics())}")
    return 1


def echo(args: argparse.Namespace) -> int:
    """Print messages until Ctrl-C, or up to the requested number."""
    style = Style(args)
    # Readers of a table would misread truncated values, or miss columns.
    limit = args.truncate or (None if args.csv else SHOWN_JSON if args.json else SHOWN)
    received = 0
    with connect(args, wait_for_start=True) as node:
        subscription = create_typed(
            node,
            lambda: node.create_subscription(args.topic, args.type, qos=profile(args)),
            args.type,
            args.timeout,
        )
        get = _getter(args.field)
        end = End()
        due = time.monotonic() + (math.inf if args.timeout is None else args.timeout)
        with _SilenceReasons(node, subscription, args) as reasons:
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
                reasons.on_sample(sample)
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
    """Yield the cells of a value in a CSV line, in the order of the fields."""
    if isinstance(value, (dict, list)):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _cells(inner)
        return
    text = str(value)
    if set(text) & set(',"\n\r'):
        text = '"' + text.replace('"', '""') + '"'
    yield text


class _Seen(NamedTuple):
    received: int
    size: int
    delay: float | None


def measure(args: argparse.Namespace) -> int:
    """Print a figure each second, until Ctrl-C or the end of the duration or count."""
    seen: deque[_Seen] = deque(maxlen=args.window)
    lock = threading.Lock()
    wants_stamp = args.what == "delay"
    failure: list[str] = []
    wanted, counted = args.count or math.inf, itertools.count(1)
    is_complete = threading.Event()

    def receive(sample: Sample) -> None:
        if is_complete.is_set():
            return
        if next(counted) >= wanted:
            is_complete.set()
        delay = _delay(sample, failure) if wants_stamp else None
        with lock:
            seen.append(_Seen(sample.received_ns, len(sample.data), delay))

    with connect(args, wait_for_start=True) as node:
        subscription = create_typed(
            node,
            lambda: node.create_subscription(
                args.topic, args.type, qos=profile(args), raw_callback=receive, executor=IMMEDIATE
            ),
            args.type,
            None,
        )
        end = End()
        until = None if args.duration is None else time.monotonic() + args.duration
        shown = -1
        with _SilenceReasons(node, subscription, args) as reasons:
            while not end.is_set() and not failure:
                left = 1.0 if until is None else until - time.monotonic()
                if left <= 0:
                    break
                end.wait(min(1.0, left))
                with lock:
                    samples = [s for s in seen if s.delay is not None or not wants_stamp]
                total = subscription.statistics().received
                reasons.on_count(total)
                if total != shown and len(samples) > 1:
                    shown = total
                    result = _FIGURES[args.what](samples)
                    print(to_json(result) if args.json else result.pop("text"), flush=True)
                    if is_complete.is_set():
                        break
                elif reasons.report() and total:
                    # Start over after an interruption.
                    with lock:
                        seen.clear()
            if shown < 0 and not failure and not end.is_set():
                reasons.report(last=True)
    for reason in failure[:1]:
        note(f"{args.topic}: {reason}")
    if end.is_set():
        return end.code
    return 0 if shown > 0 and not failure else 1


def _delay(sample: Sample, failure: list[str]) -> float | None:
    try:
        stamp = sample.message()["header.stamp"]
        words = ("secs", "nsecs") if sample.wire == "ros1" else ("sec", "nanosec")
        sent = stamp[words[0]] * 10**9 + stamp[words[1]]
        return float(sample.received_ns - sent) / 1e9
    except (Error, AttributeError) as error:
        failure.append(f"its messages have no header.stamp: {error}")
        return None


def _show_rate(samples: list[_Seen]) -> dict[str, Any]:
    gaps = [(b.received - a.received) / 1e9 for a, b in pairwise(samples)]
    mean = statistics.fmean(gaps)
    rate = 1 / mean if mean > 0 else 0.0
    found = {
        "rate": rate, "min": min(gaps), "max": max(gaps), "std_dev": statistics.pstdev(gaps),
        "window": len(samples),
    }  # fmt: skip
    text = (
        f"{rate:.2f} Hz  gap min {found['min'] * 1e3:.1f} ms, max {found['max'] * 1e3:.1f} ms, "
        f"std dev {found['std_dev'] * 1e3:.2f} ms, window {len(samples)}"
    )
    return found | {"text": text}


def _show_bandwidth(samples: list[_Seen]) -> dict[str, Any]:
    span = (samples[-1].received - samples[0].received) / 1e9
    sizes = [sample.size for sample in samples]
    rate = sum(sizes[1:]) / span if span > 0 else 0.0
    found = {
        "bytes_per_second": rate, "mean": statistics.fmean(sizes), "min": min(sizes),
        "max": max(sizes), "window": len(samples),
    }  # fmt: skip
    text = (
        f"{_amount(rate)}/s  message mean {_amount(found['mean'])}, min {_amount(min(sizes))}, "
        f"max {_amount(max(sizes))}, window {len(samples)}"
    )
    return found | {"text": text}


def _show_delay(samples: list[_Seen]) -> dict[str, Any]:
    delays = [sample.delay or 0.0 for sample in samples]
    found = {
        "mean": statistics.fmean(delays), "min": min(delays), "max": max(delays),
        "std_dev": statistics.pstdev(delays), "window": len(delays),
    }  # fmt: skip
    text = (
        f"{found['mean'] * 1e3:.2f} ms  min {found['min'] * 1e3:.2f} ms, max "
        f"{found['max'] * 1e3:.2f} ms, std dev {found['std_dev'] * 1e3:.2f} ms, "
        f"window {len(delays)}"
    )
    return found | {"text": text}


def _amount(size: float) -> str:
    for unit, factor in (("MB", 1e6), ("kB", 1e3)):
        if size >= factor:
            return f"{size / factor:.2f} {unit}"
    return f"{size:.0f} B"


_FIGURES = {"hz": _show_rate, "bw": _show_bandwidth, "delay": _show_delay}


def publish(args: argparse.Namespace) -> int:
    """Publish messages, until Ctrl-C or up to the requested number."""
    type_name, text = split_type(args.rest)
    with connect(args, wait_for_start=args.count is None) as node:
        topic = node.resolve(args.topic)
        if type_name is None:
            type_name = _type_in_use(node, topic, args.timeout)
        publisher = create_typed(
            node,
            lambda: node.create_publisher(topic, type_name, profile(args)),
            type_name,
            args.timeout,
        )
        values = parse_fields(text, publisher.type.name, template(publisher.type))
        message = publisher.type.create(values)
        wanted = args.wait if args.wait is not None else int(args.count == 1)

        def missing() -> str:
            there = publisher.subscription_count()
            if there < wanted:
                return publisher.hint or f"{topic}: {there} of {wanted} subscriptions are there"
            return ""

        with explained_wait(missing):
            wait(node, lambda: publisher.subscription_count() >= wanted, args.timeout)
        there = publisher.subscription_count()
        if there < wanted:
            note(f"{topic}: {there} of {wanted} subscriptions within {args.timeout:g} s; "
                 "nothing was published")  # fmt: skip
            return 1
        end = End()
        sent, due = 0, time.monotonic()
        hint_at = due + 1.0
        name = spelled(node, publisher.type.name)
        shown = f"{name}{str(message).removeprefix(publisher.type.name)}"
        while not end.is_set():
            publisher.publish(message)
            sent += 1
            if not args.json:
                print(f"{sent}: {shown}", flush=True)
            if sent == args.count:
                break
            if hint_at and time.monotonic() > hint_at:
                hint_at = 0.0
                if publisher.hint:
                    note(publisher.hint)
            due += 1 / args.rate
            end.wait(max(0.0, due - time.monotonic()))
        end.wait(args.keep_alive)
        if args.json:
            print_json({"topic": topic, "type": name, "sent": sent})
    return end.code


def _type_in_use(node: Node, topic: str, timeout: float) -> str:
    """Return the type that other nodes use; raises TypeNotFoundError."""

    def types() -> list[str]:
        ends = [*node.subscriptions(topic), *node.publishers(topic)]
        return sorted({end.type for end in ends})

    def missing() -> str:
        return f"no node uses {topic}{similar(topic, node.topics())}"

    with explained_wait(missing):
        found = wait(node, types, timeout)
    if len(found) == 1:
        return found[0]
    if found:
        raise TypeNotFoundError(f"{topic} has several types, say which: {', '.join(found)}")
    example = spelled(node, "std_msgs/msg/String")
    hint = similar(topic, node.topics())
    raise TypeNotFoundError(f"no node uses {topic} yet: give its type, e.g. {example}{hint}")


class _SilenceReasons:
    """Prints why no messages, or no more messages, are received; each reason once.

    Args:
        node: The subscribing node.
        subscription: The subscription; closed at the end.
        args: The command's options.
    """

    def __init__(self, node: Node, subscription: Subscription, args: argparse.Namespace) -> None:
        self._node, self._subscription = node, subscription
        self._command = f"rosglass topic {args.what} {args.topic}"
        self._began = self._received_at = time.monotonic()
        self._received = 0
        self._pause = 0.0
        self._printed = ""
        self._unreadable: set[MessageType] = set()
        self._log = logging.getLogger("rosglass.comm")
        self._quiet = not args.verbose

    def __enter__(self) -> _SilenceReasons:
        self._log.addFilter(self._passes)
        return self

    def __exit__(self, *_: object) -> None:
        self._subscription.close()
        self._log.removeFilter(self._passes)

    def on_count(self, count: int) -> None:
        """Update the number of messages received so far."""
        if count == self._received:
            return
        now = time.monotonic()
        self._pause = (now - self._began) / count
        self._received, self._received_at, self._printed = count, now, ""

    def on_sample(self, sample: Sample) -> None:
        """Print why a message is shown as bytes, once for each type."""
        kind = sample.type
        if isinstance(kind, OpaqueType) and kind not in self._unreadable:
            self._unreadable.add(kind)
            self._print(f"{kind.name} is shown as bytes: {kind.reason}")

    def report(self, *, last: bool = False) -> str:
        """Print the reason if it is new, and return it; empty if there is none.

        Args:
            last: Whether this is the last report, before the command ends.

        Raises:
            BrokenPipeError: The reader of the output has exited.
        """
        require_reader()
        silent = time.monotonic() - self._received_at
        if silent < _QUIET_S and not last:
            return ""
        reason = self._reason(silent)
        if reason and reason != self._printed:
            self._printed = reason
            self._print(reason)
        return reason

    def _print(self, reason: str) -> None:
        # Conflicting definitions take pages.
        shown = reason.partition("\n")[0].rstrip() if self._quiet else reason
        note(f"{self._subscription.topic}: {spelled(self._node, shown)}")

    def _reason(self, silent: float) -> str:
        found = self._subscription
        status = self._node.status()
        if status.state is not ConnectionState.CONNECTED and not self._node.url.startswith("dds:"):
            return status.detail
        publishers = self._node.publishers(found.topic)
        types = sorted({end.type for end in publishers})
        if len(types) > 1 and found.type is None:
            return f"published with several types, say which: {self._command} {types[0]}"
        if not publishers:
            if self._received:
                return "it has no publisher any more"
            return f"it has no publisher{self._guess()}"
        if found.problem or found.hint:
            return found.problem or found.hint
        if not self._received:
            return "published, but nothing has been received yet"
        if self._received > 1 and silent > max(_QUIET_S, _PAUSES * self._pause):
            return "no more messages, although it is still advertised"
        return ""

    def _guess(self) -> str:
        known = [name for name in self._node.topics() if self._node.publishers(name)]
        return similar(self._subscription.topic, known)

    def _passes(self, record: logging.LogRecord) -> bool:
        """Drop log messages that this class prints."""
        ours = record.getMessage().startswith(f"{self._subscription.topic}: ")
        return not (ours and self._quiet and record.levelno == logging.WARNING)
