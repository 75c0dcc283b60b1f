"""``rosglass topic hz``, ``bw`` and ``delay``: measure received messages."""

from __future__ import annotations

import statistics
import threading
import time
from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.cli.connecting import End, connect
from rosglass.cli.output import note, to_json
from rosglass.cli.values import profile
from rosglass.cli.waiting import Reasons

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Sample

__all__ = ["measure"]


class _Seen(NamedTuple):
    received: int
    size: int
    delay: float | None


def measure(args: argparse.Namespace) -> int:
    """Print a figure each second, until Ctrl-C or the end of the duration."""
    from rosglass.comm import IMMEDIATE

    seen: deque[_Seen] = deque(maxlen=args.window)
    lock = threading.Lock()
    wants_stamp = args.what == "delay"
    failure: list[str] = []

    def receive(sample: Sample) -> None:
        delay = _delay(sample, failure) if wants_stamp else None
        with lock:
            seen.append(_Seen(sample.received_ns, len(sample.data), delay))

    with connect(args, patient=True) as node:
        subscription = node.create_subscription(
            args.topic, args.type, qos=profile(args), raw_callback=receive, executor=IMMEDIATE
        )
        end = End()
        until = None if args.duration is None else time.monotonic() + args.duration
        shown = -1
        with Reasons(node, subscription, args) as reasons:
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
    from rosglass.errors import Error

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
