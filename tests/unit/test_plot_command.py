"""``rosglass plot``: its arguments, and the plot in the terminal."""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass
from rosglass.cli.output import Style
from rosglass.cli.plot import TextPlot
from rosglass.cli.program import parse

if TYPE_CHECKING:
    from collections.abc import Iterator

PLAIN = Style(argparse.Namespace(color="never"))


@pytest.fixture
def robot() -> Iterator[rosglass.Node]:
    with rosglass.connect("local://plot_command", name="robot") as node:
        yield node


@pytest.fixture
def plot(robot: rosglass.Node) -> Iterator[Any]:
    made: list[TextPlot] = []

    def make(*paths: str) -> TextPlot:
        made.append(TextPlot(robot, list(paths), 10.0, 60.0))
        return made[-1]

    yield make
    for one in made:
        one.close()


def wave(publisher: Any, count: int = 1000) -> None:
    eventually(publisher.subscription_count)
    for number in range(count):
        stamp = {"sec": 1000 + number // 100, "nanosec": number % 100 * 10_000_000}
        value = 5 * math.sin(number / 50)
        publisher.publish(header={"stamp": stamp}, point={"x": value, "y": 1.0})


def test_lines_are_drawn_with_their_range_and_values(robot: rosglass.Node, plot: Any) -> None:
    publisher = robot.create_publisher("/point", "geometry_msgs/msg/PointStamped")
    shown = plot("/point:point.x", "/point:point.y")
    wave(publisher)
    eventually(lambda: shown.received == 1000)
    lines = shown.lines(80, 24, PLAIN)
    assert len(lines) == 23
    assert max(map(len, lines)) < 80
    drawn = [sum(0x2800 < ord(char) < 0x2900 for char in line) for line in lines[:20]]
    assert sum(one > 0 for one in drawn) > 15
    text = "\n".join(lines)
    assert "/point:point.y 1 m" in text
    assert "-10 s" in text
    assert any(line.strip().startswith(("4", "5")) for line in lines)
    assert publisher.subscription_count() == 1


@pytest.mark.parametrize("size", [(1, 1), (20, 5), (300, 100)])
def test_any_size_is_drawn(robot: rosglass.Node, plot: Any, size: tuple[int, int]) -> None:
    publisher = robot.create_publisher("/joints", "sensor_msgs/msg/JointState")
    shown = plot("/joints:position[*]", "/none:data")
    eventually(publisher.subscription_count)
    publisher.publish(position=[math.nan, math.inf, 1e308, 0.0] * 16)
    eventually(lambda: shown.received == 1)
    lines = shown.lines(*size, PLAIN)
    assert any("more" in line for line in lines)


def test_path_that_cannot_be_plotted_is_named(robot: rosglass.Node, plot: Any) -> None:
    publisher = robot.create_publisher("/text", "std_msgs/msg/String")
    shown = plot("/text:data", "/missing:data")
    eventually(publisher.subscription_count)
    publisher.publish(data="\x1b[31mhello")
    eventually(lambda: shown.received == 1)
    eventually(lambda: "data of std_msgs/msg/String is a string" in str(shown.problems()))
    assert "/missing has no publisher" in str(shown.problems())
    text = " ".join(line.strip() for line in shown.lines(40, 24, PLAIN))
    assert all(problem in text for problem in shown.problems()), "wrapped, not cut"


def test_terminal_needs_no_qt() -> None:
    script = (
        "import sys, rosglass.cli.plot\n"
        "print([name for name in sys.modules if name.startswith(('PySide', 'shiboken'))])"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize("window", ["0", "-1", "nan", "1e9", "x"])
def test_wrong_window_is_refused(window: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parse(["plot", "/odom:pose.pose.position.x", f"--window={window}"])
    assert "--window" in capsys.readouterr().err


def test_path_without_a_field_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    from rosglass.cli import main

    assert main(["plot", "/odom", "--terminal"]) == 1
    assert "write it like /odom:twist.twist.linear.x" in capsys.readouterr().err
