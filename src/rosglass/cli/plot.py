"""``rosglass plot``: numbers of topics over time, in a window or in the terminal."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.cli.connecting import End, connect
from rosglass.cli.output import CLEAR_REST, HOME, Style, note, require_reader
from rosglass.comm import anonymous_name
from rosglass.controls.plots.axes import Axis, number_text
from rosglass.controls.plots.raster import Background, Raster, outline
from rosglass.controls.plots.series import FieldFeed, PlotReceiver, TopicFeed, split_path

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Node
    from rosglass.controls.plots.samples import Samples

__all__ = ["TextPlot", "run"]

#: The interface of the window.
_WINDOW = Path(__file__).parents[1] / "controls" / "PlotWindow.qml"
#: Seconds between two frames in the terminal.
_FRAME_S = 0.2
#: Columns and lines where the output is not a terminal, and the least of them.
_SIZE, _MIN_SIZE = (80, 24), (30, 8)
#: Columns for the numbers beside the plot.
_MARGIN = 10
_COLORS = ("cyan", "yellow", "green", "magenta", "red", "blue")
#: A braille character has two columns and four rows of dots, whose bits are in this order.
_BRAILLE = 0x2800
_BITS = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))


def run(args: argparse.Namespace) -> int:
    """Plot until the window is closed, Ctrl-C, or the end of the duration.

    Raises:
        FieldPathError: A path is not a topic and a field.
    """
    for path in args.paths:
        split_path(path)
    return _run_terminal(args) if args.terminal else _run_window(args)


def _run_window(args: argparse.Namespace) -> int:
    from rosglass.cli.run import show_interface  # noqa: PLC0415 - a terminal needs no Qt

    args.arguments = [
        json.dumps(
            {
                "paths": args.paths,
                "window": args.window,
                "history": args.history,
                "folder": str(Path.cwd()),
            }
        )
    ]
    args.kiosk = False
    return show_interface(
        args, str(_WINDOW), name=args.node_name or anonymous_name("rosglass_plot")
    )


def _run_terminal(args: argparse.Namespace) -> int:
    style, live = Style(args), sys.stdout.isatty()
    duration = args.duration
    if duration is None and not live:
        duration = args.window  # one plot, of what has arrived until then
    with connect(args, wait_for_start=True) as node:
        plot = TextPlot(node, args.paths, args.window, args.history)
        try:
            end = End()
            until = None if duration is None else time.monotonic() + duration
            while not end.wait(_FRAME_S) and (until is None or time.monotonic() < until):
                require_reader()
                if live:
                    _show(HOME, plot.lines(*shutil.get_terminal_size(_SIZE), style), CLEAR_REST)
            if not live:
                _show("", plot.lines(*_SIZE, style), "\n")
        finally:
            plot.close()
    for problem in plot.problems():
        note(problem)
    if end.is_set():
        return end.code
    return 0 if plot.received else 1


def _show(before: str, lines: list[str], after: str) -> None:
    print(before + "\n".join(lines), end=after, flush=True)


class TextPlot:
    """A plot of braille characters.

    Args:
        node: The node.
        paths: Topics and fields.
        window: Visible seconds.
        history: Seconds that samples are kept; at least those that are visible are.
    """

    def __init__(self, node: Node, paths: list[str], window: float, history: float) -> None:
        self._node, self._window_ns, self._axis = node, round(window * 1e9), Axis()
        self._feeds: dict[str, TopicFeed] = {}
        self._series: list[tuple[str, TopicFeed, FieldFeed]] = []
        fields: dict[str, list[FieldFeed]] = {}
        for path in paths:
            name, field = split_path(path)
            topic = node.resolve(name)
            feed = self._feeds.setdefault(topic, TopicFeed(topic))
            feed.history_ns = round(max(history, window) * 1e9) if history else 0
            made = FieldFeed(field)
            fields.setdefault(topic, []).append(made)
            self._series.append((path, feed, made))
        for topic, feed in self._feeds.items():
            feed.set_fields(tuple(fields[topic]), use_stamps=True)
        self._receiver = PlotReceiver(node)
        self._receiver.set_feeds(self._feeds)

    def close(self) -> None:
        """Stop receiving."""
        self._receiver.close()

    @property
    def received(self) -> int:
        """Number of messages."""
        return sum(feed.received for feed in self._feeds.values())

    def problems(self) -> list[str]:
        """Return what cannot be plotted, and why."""
        found = []
        for _, feed, field in self._series:
            subscription = feed.subscription
            problem = field.problem or field.value_problem or feed.problem
            if problem:
                found.append(f"{feed.topic}: {problem}")
            elif subscription is not None:
                found.append(subscription.problem or ("" if feed.received else subscription.hint))
        return list(dict.fromkeys(filter(None, found)))

    def lines(self, width: int, height: int, style: Style) -> list[str]:
        """Return the lines of text.

        Args:
            width: Columns of the terminal.
            height: Its lines.
            style: Colours them.
        """
        width, height = max(width, _MIN_SIZE[0]), max(height, _MIN_SIZE[1])
        shown = self._lines()
        legend = [
            style(f"{name} {reading}"[: width - 1], _COLORS[at % len(_COLORS)])
            for at, (name, reading, _) in enumerate(shown)
        ]
        problems = [
            style(line, "red")
            for problem in self.problems()
            for line in textwrap.wrap(problem, width - 1)
        ]
        most = max(1, height // 2 - 1)
        texts = [*problems, *legend]
        if len(texts) > most:
            texts = [*texts[: most - 1], f"and {len(texts) - most + 1} more"]
        rows, columns = height - len(texts) - 2, width - _MARGIN - 1
        dots = self._dots([samples for _, _, samples in shown], columns, rows)
        ticks = self._ticks(rows)
        made = []
        for row in range(rows):
            label = f"{ticks.get(row, ''):>{_MARGIN - 1}}"[: _MARGIN - 1]
            made.append(f"{label} {_cells(*dots, row, style)}")
        seconds = f"-{number_text(self._window_ns / 1e9)} s"
        return [*made, f"{'':{_MARGIN}}{seconds}{'0 s':>{max(0, columns - len(seconds))}}", *texts]

    def _lines(self) -> list[tuple[str, str, Samples | None]]:
        found: list[tuple[str, str, Samples | None]] = []
        for path, _, field in self._series:
            if not field.lines:
                found.append((path, "-", None))
            for at, samples in enumerate(list(field.lines)):
                name = path.replace("[*]", f"[{at}]") if field.indexed else path
                value = field.latest[at] if at < len(field.latest) else np.nan
                found.append((name, f"{number_text(float(f'{value:.5g}'))} {field.unit}", samples))
        return found

    def _dots(self, lines: list[Samples | None], columns: int, rows: int) -> tuple[Any, Any]:
        """Return the bits of each character, and the number of its line."""
        bits, owner = np.zeros((rows, columns), int), np.zeros((rows, columns), int)
        ends = []
        for _, feed, field in self._series:
            spans = [samples.span for samples in list(field.lines)]
            if feed.arrived is not None:
                passed = round(max(0.0, self._node.steady() - feed.arrived) * 1e9)
                ends += [span[1] + passed for span in spans if span]
        if not ends:
            return bits, owner
        across, down = 2 * columns, 4 * rows
        step = max(1, self._window_ns // across)
        first = max(ends) // step - across + 1
        low, high = np.full((len(lines), across), np.inf), np.full((len(lines), across), -np.inf)
        for at, samples in enumerate(lines):
            if samples is not None:
                samples.reduce(low[at], high[at], first * step, step)
        finite = np.isfinite(low) & np.isfinite(high)
        if finite.any():
            self._axis.fit(low[finite].min(), high[finite].max(), rows * 16, time.monotonic())
        scale = (down - 1) / (self._axis.high - self._axis.low)
        gaps = [1 if one is None else one.gap_ns // step + 1 for one in lines]
        shown = outline(
            low,
            high,
            np.full(len(lines), down - 0.5 + self._axis.low * scale),
            np.full(len(lines), scale),
            np.zeros(len(lines), bool),
            np.minimum(gaps, across),
        )
        # As the window's image, with the number of the line in place of its colour.
        raster = Raster(across, down)
        colors = np.arange(1, len(lines) + 1, dtype=np.uint32)
        raster.draw(shown, colors, [], Background(0, 0, ()), 0, 0)
        dots = raster.pixels.reshape(rows, 4, columns, 2)
        owner = dots.max(axis=(1, 3)).astype(int) - 1
        bits = ((dots > 0) * np.array(_BITS).T[None, :, None, :]).sum(axis=(1, 3))
        return bits, owner

    def _ticks(self, rows: int) -> dict[int, str]:
        ticks = self._axis.ticks(rows * 16)
        return {round((1 - at) * (rows - 1)): text for at, text in ticks}


def _cells(bits: Any, owner: Any, row: int, style: Style) -> str:
    """Return a line of characters, neighbours of one colour together."""
    parts: list[tuple[int, str]] = []
    for dots, line in zip(bits[row].tolist(), owner[row].tolist(), strict=True):
        text = chr(_BRAILLE + dots) if dots else " "
        color = line % len(_COLORS) if dots else -1
        if parts and parts[-1][0] == color:
            parts[-1] = (color, parts[-1][1] + text)
        else:
            parts.append((color, text))
    return "".join(style(text, _COLORS[color]) if color >= 0 else text for color, text in parts)
