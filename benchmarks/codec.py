"""Measure the message codec against rosbags, genpy and mcap-ros2-support.

    python benchmarks/codec.py [--quick] [--json FILE] [--sample NAME ...] [--strict]

Prints, per wire and metric, our time, each peer's time and how many times faster we are, the
target and whether it is met. All contenders of a figure are measured in turns within one run, so
that a busy machine slows them alike. Exits 1 when the bytes of any two libraries differ, and with
``--strict`` also when a ratio is missed.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import platform
import sys
import time
import timeit
import tracemalloc
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from libraries import LIBRARIES, Library, MissingError, Statement
from samples import SAMPLES, Sample
from targets import Target, cplusplus, target

if TYPE_CHECKING:
    from collections.abc import Callable

METRICS = {
    "decode": "decode only (us)",
    "path": "decode + one leaf, ours by compiled path (us)",
    "attribute": "decode + one leaf by attribute (us)",
    "every leaf": "decode + read every leaf (us)",
    "encode": "nested dict -> bytes (us)",
    "parts": "nested dict -> parts without copying, against the peers' bytes (us)",
    "first use": "first use: definition text -> first decoded message (us)",
    "memory": "memory of one decoded, untouched message beside its bytes (bytes)",
}
#: The peer's metric to compare with a metric that only we have.
PEER_METRIC = {"path": "attribute", "parts": "encode"}


@dataclass
class Row:
    """One figure of ours with everything it is compared with."""

    wire: str
    metric: str
    sample: str
    ours: float
    peers: dict[str, float]
    target: Target
    cplusplus: float | None = None
    missed: list[str] = field(default_factory=list)

    def judge(self) -> None:
        """Compare with the target's ratios."""
        for peer, ratio in self.target.ratios.items():
            if peer in self.peers and self.peers[peer] / self.ours < ratio:
                self.missed.append(f"{self.peers[peer] / self.ours:.3g}x {peer}, wanted {ratio:g}x")
        if self.target.copies is not None and "memcpy" in self.peers:
            copies = self.ours / self.peers["memcpy"]
            if copies > self.target.copies:
                self.missed.append(f"{copies:.3g} copies, wanted {self.target.copies:g}")


class Settings:
    """How long to measure: `rounds` turns of at least `seconds` per statement."""

    def __init__(self, quick: bool) -> None:
        self.rounds, self.seconds = (7, 0.002) if quick else (15, 0.01)


def time_in_turns(statements: dict[str, Statement], settings: Settings) -> dict[str, float]:
    """Microseconds of processor time of each statement, the statements taking turns.

    The best turn counts, as timeit's documentation advises: the others measure the neighbours.
    """
    timers = {}
    for name, (statement, names) in statements.items():
        # timeit turns the garbage collector off; real programs have it on.
        timer = timeit.Timer(statement, "import gc; gc.enable()", time.thread_time, names)
        number, spent = 1, timer.timeit(1)
        while spent < settings.seconds and number < 1_000_000:
            number = max(number * 2, int(number * settings.seconds / max(spent, 1e-7)))
            spent = timer.timeit(number)
        timers[name] = (timer, number)
    best = dict.fromkeys(timers, math.inf)
    for _ in range(settings.rounds):
        for name, (timer, number) in timers.items():
            best[name] = min(best[name], timer.timeit(number) / number * 1e6)
    return best


def memory(decode: Callable[[bytes], Any], data: bytes) -> float:
    """Bytes held by one decoded message, not counting the buffer it was decoded from."""
    decode(data)
    count = max(3, min(300, 2_000_000 // len(data)))
    gc.collect()
    tracemalloc.start()
    kept = [None] * count
    before = tracemalloc.get_traced_memory()[0]
    for index in range(count):
        kept[index] = decode(data)
    held = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    return held / count


def measure(sample: Sample, ros: int, settings: Settings, missing: set[str]) -> list[Row]:
    """All figures of one sample on one wire; raises SystemExit when bytes differ."""
    value = sample.make(ros)
    libraries: dict[str, Library] = {}
    for name, prepare in LIBRARIES.items():
        try:
            library = prepare(sample, ros, value)
        except MissingError as why:
            missing.add(f"{name}: {why}")
            continue
        if library is not None:
            libraries[name] = library
    data = check_bytes(f"{sample.type} (ROS {ros})", libraries)
    for library in libraries.values():
        for _, names in library.statements.values():
            names.update(data=data, view=memoryview(data))
    ours, others = libraries["rosglass"], list(libraries)[1:]
    rows = []
    for metric in ("decode", "path", "attribute", "every leaf", "encode", "parts"):
        contenders = {"rosglass": ours.statements[metric]}
        for peer in others:
            contenders[peer] = libraries[peer].statements[PEER_METRIC.get(metric, metric)]
        if metric == "decode":
            contenders["rosbags view"] = libraries["rosbags"].statements["decode view"]
        if metric == "encode":
            by_hand = libraries["rosbags"].statements["encode by hand"]
            contenders["rosbags by hand"] = by_hand
            contenders["memcpy"] = ("bytes(view)", {"view": memoryview(data)})
        rows.append(_row(sample, ros, metric, time_in_turns(contenders, settings)))
    first = {
        name: ("first(data)", {"first": library.first_use, "data": data})
        for name, library in libraries.items()
    }
    rows.append(_row(sample, ros, "first use", time_in_turns(first, settings)))
    held = {name: memory(library.decode, data) for name, library in libraries.items()}
    rows.append(_row(sample, ros, "memory", held))
    return rows


def _row(sample: Sample, ros: int, metric: str, figures: dict[str, float]) -> Row:
    ours = figures.pop("rosglass")
    known = cplusplus(metric, sample.name) if ros == 1 else None
    wire = "ros1" if ros == 1 else "cdr"
    row = Row(wire, metric, sample.name, ours, figures, target(metric, sample.name, ros), known)
    row.judge()
    return row


def check_bytes(what: str, libraries: dict[str, Library]) -> bytes:
    """The encoded sample; exits 1 unless every library gives the same bytes on every route."""
    data = libraries["rosbags"].encodings["dict"](b"")
    same = True
    for name, library in libraries.items():
        for route, encode in library.encodings.items():
            other = bytes(encode(data))
            if other == data:
                continue
            same = False
            at = next((i for i, (a, b) in enumerate(zip(data, other)) if a != b), len(data))  # noqa: B905 - the shorter ends it
            print(
                f"BYTES DIFFER: {what}: {name} ({route}) against rosbags (dict) at byte {at}: "
                f"{other[at : at + 16].hex()} against {data[at : at + 16].hex()}, "
                f"lengths {len(other)} and {len(data)}",
                file=sys.stderr,
            )
    if not same:
        raise SystemExit(1)
    return data


def show(rows: list[Row]) -> None:
    """Print one table per wire and metric."""
    for wire in ("ros1", "cdr"):
        for metric, title in METRICS.items():
            chosen = [row for row in rows if row.wire == wire and row.metric == metric]
            if chosen:
                print(f"\n{'ROS 1' if wire == 'ros1' else 'ROS 2 / CDR'}: {title}")
                _table(chosen)
    print(
        "\nC++: ros_babel_fish on ROS 1 bytes, measured elsewhere on the same kind of machine."
        "\nratio: the peer's time divided by ours in this run, with the target behind the arrow."
        "\n* above the absolute figure set on the idle reference machine."
    )


def _table(rows: list[Row]) -> None:
    peers = list(dict.fromkeys(peer for row in rows for peer in row.peers))
    with_cpp = any(row.cplusplus is not None for row in rows)
    heads = ["message", "rosglass", "target", *peers, *(["C++"] if with_cpp else []), "verdict"]
    lines = [heads]
    for row in rows:
        limit = row.target.limit
        slow = "*" if limit is not None and row.ours > limit else ""
        line = [row.sample, _number(row.ours) + slow, _number(limit)]
        line += [_against(row, peer) for peer in peers]
        if with_cpp:
            line.append(_number(row.cplusplus))
        judged = row.target.ratios or row.target.copies or limit is not None
        line.append("MISSED" if row.missed else "met" if judged else "")
        lines.append(line)
    widths = [max(len(line[i]) for line in lines) for i in range(len(heads))]
    for line in lines:
        cells = [line[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        print("  " + "  ".join(cells).rstrip())


def _against(row: Row, peer: str) -> str:
    if peer not in row.peers:
        return "-"
    theirs = row.peers[peer]
    if peer == "memcpy":
        wanted = f"->{row.target.copies:g}" if row.target.copies is not None else ""
        return f"{_number(theirs)} ({row.ours / theirs:.2f}{wanted})"
    wanted = f"->{row.target.ratios[peer]:g}x" if peer in row.target.ratios else ""
    return f"{_number(theirs)} ({theirs / row.ours:.3g}x{wanted})"


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    if value >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}" if value >= 1 else f"{value:.3f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="shorter turns: about a minute")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures there")
    parser.add_argument("--sample", action="append", metavar="NAME", help="only this message type")
    parser.add_argument("--strict", action="store_true", help="exit 1 when a ratio is missed")
    options = parser.parse_args()
    known = [sample.name for sample in SAMPLES]
    for name in options.sample or ():
        if name not in known:
            parser.error(f"no sample {name!r}; there are: {', '.join(known)}")
    settings, missing, rows = Settings(options.quick), set[str](), []
    for sample in SAMPLES:
        if options.sample and sample.name not in options.sample:
            continue
        for ros in (1, 2):
            print(f"measuring {sample.name}, ROS {ros} ...", file=sys.stderr)
            rows += measure(sample, ros, settings, missing)
    print(f"Python {platform.python_version()} on {platform.platform()}, us = microseconds")
    for line in sorted(missing):
        print(f"not measured: {line}")
    show(rows)
    missed = [row for row in rows if row.missed]
    judged = sum(bool(row.target.ratios or row.target.copies) for row in rows)
    print(f"\n{judged - len(missed)} of {judged} targets met, bytes identical everywhere.")
    for row in missed:
        print(f"  missed: {row.wire} {row.metric} {row.sample}: {'; '.join(row.missed)}")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))
    return 1 if options.strict and missed else 0


if __name__ == "__main__":
    sys.exit(main())
