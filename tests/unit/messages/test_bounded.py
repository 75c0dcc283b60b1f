"""The cost of a definition of any shape: at most a second and 200 MB, or it is refused by name."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosglass import load
from rosglass.interfaces import Definition, Field, FieldType, Library, MemoryProvider
from rosglass.messages import MessageType

from .bounded import USES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

PROGRAM = Path(__file__).parent / "bounded.py"
ROS = (1, 2)
PRIMITIVES = ["uint8", "int32", "float64", "bool", "string"]


def doubling(levels: int, array: str = "") -> list[Any]:
    return [[[at + 1, array, 2]] for at in range(levels)] + [[["uint8", "", 1]]]


def chain(levels: int, leaf: list[Any], array: str = "") -> list[Any]:
    """Types with a number, the next one and a text each, and fields at the end."""
    nested = [[["uint8", "", 1], [at + 1, array, 1], ["string", "", 1]] for at in range(levels)]
    return [*nested, leaf]


def many_types(count: int, array: str) -> list[Any]:
    return [
        [[at, array, 1] for at in range(1, count + 1)],
        *[[["string", "", 1], ["uint8", "", 1]]] * count,
    ]


BOMBS = {
    "2 in the next, 8 levels": doubling(8),
    "2 in the next, 20 levels": doubling(20),
    "2 in the next, 60 levels": doubling(60),
    "2 sequences in the next, 8 levels": doubling(8, "[]"),
    "2 sequences in the next, 26 levels": doubling(26, "[]"),
    "2 arrays in the next, 26 levels": doubling(26, "[1]"),
    "arrays in arrays": doubling(8, "[3]"),
    "2999 numbers": [[["float64", "", 1499], ["uint8", "", 1500]]],
    "2999 texts": [[["string", "", 2999]]],
    "2999 sequences": [[["float64", "[]", 2999]]],
    "2999 sequences of texts": [[["string", "[]", 2999]]],
    "990 messages": [[[1, "", 990]], [["string", "", 1], ["uint8", "", 1]]],
    "990 sequences of messages": [[[1, "[]", 990]], [["string", "", 1], ["uint8", "", 1]]],
    "10000 fields": [[["uint8", "", 10_000]]],
    "50000 fields": [[["uint8", "", 50_000]]],
    "500 types": many_types(499, ""),
    "500 types in sequences": many_types(499, "[]"),
    "5000 types": many_types(5000, ""),
    "a deep chain": chain(60, [["string", "", 2500]]),
    "a deep chain of sequences": chain(60, [["string", "", 2500]], "[]"),
    "a chain of 62 small ones": chain(62, [["uint8", "", 1]], "[]"),
    "the largest array of numbers": [[["uint8", f"[{1 << 25}]", 1]]],
    "the largest array of messages": [[[1, "[49999]", 1]], [["uint8", "", 1]]],
    "no bytes at all": [[[1, "[1073741823]", 1]], []],
    "few bytes": [[[1, "[1024]", 1]], []],
    "many sequences of nothing": [[[1, "[]", 2000]], []],
}


@pytest.fixture(scope="module")
def bounded() -> Iterator[Callable[[str, int, list[Any]], tuple[str, float, int]]]:
    """Use types in a process of little memory: how it went, seconds and bytes."""
    program = subprocess.Popen(
        [sys.executable, str(PROGRAM)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert program.stdin is not None
    assert program.stdout is not None

    def use(how: str, ros: int, types: list[Any]) -> tuple[str, float, int]:
        print(json.dumps({"use": how, "ros": ros, "types": types}), file=program.stdin, flush=True)
        outcome, seconds, memory = json.loads(program.stdout.readline())
        return outcome, seconds, memory

    yield use
    program.stdin.close()
    assert program.wait(timeout=30) == 0


@pytest.mark.parametrize(("bomb", "number"), zip(BOMBS, itertools.count()), ids=list(BOMBS))
@pytest.mark.parametrize("use", USES)
def test_bombs_are_used_or_refused(bounded: Any, bomb: str, number: int, use: str) -> None:
    # Every bomb in both ROS versions and every use as well, but not each with each.
    ros = ROS[(number + list(USES).index(use)) % 2]
    outcome, _, _ = bounded(use, ros, BOMBS[bomb])
    assert (
        outcome == "used"
        or ("b/msg/T" in outcome and "more than" in outcome)
        or "64 levels" in outcome
    )


def fields(draw: Any, number: int, count: int) -> list[Any]:
    """Draw the fields of a type, which may be of the types behind it."""
    found = []
    for _ in range(draw(st.integers(0, 4))):
        near = st.integers(number + 1, min(number + 3, count - 1))
        far = st.integers(number + 1, count - 1)
        kinds = [st.sampled_from(PRIMITIVES)] + [near, near, far] * (number + 1 < count)
        array = draw(st.sampled_from(["", "", "[]", "[1]", "[3]", "[100]", "[1000000]"]))
        times = draw(st.sampled_from([1, 1, 2, 2, 3, 40, 500, 3000]))
        found.append([draw(st.one_of(kinds)), array, times])
    return found


@st.composite
def definitions(draw: Any) -> list[Any]:
    """Draw types that need each other in any way, in no cycle."""
    count = draw(st.one_of(st.integers(1, 12), st.integers(1, 80)))
    return [fields(draw, number, count) for number in range(count)]


@settings(
    max_examples=30, deadline=None, derandomize=True,
    suppress_health_check=list(HealthCheck),
)  # fmt: skip
@given(types=definitions(), use=st.sampled_from(sorted(USES)), ros=st.sampled_from(ROS))
def test_definitions_of_any_shape_are_used_or_refused(
    bounded: Any, types: list[Any], use: str, ros: int
) -> None:
    outcome, _, _ = bounded(use, ros, types)
    assert outcome == "used" or outcome.startswith("refused: ")


class Slow(dict[str, Definition]):
    """Definitions that take as long to look up as the test wants."""

    def __init__(self) -> None:
        super().__init__({"b/msg/B": Definition("b/msg/B", 2, ())})
        self.asked, self.go_on = threading.Event(), threading.Event()

    def get(self, name: str, default: Any = None) -> Any:
        self.asked.set()
        assert self.go_on.wait(30)
        return super().get(name, default)


class SlowProvider(MemoryProvider):
    """A provider whose definitions take as long."""

    def __init__(self) -> None:
        super().__init__("slow")
        self.slow = Slow()

    def find(self, name: str, ros: int) -> Any:
        self.slow.get(name)
        return super().find(name, ros)


def definition_of(nested: Mapping[str, Definition]) -> Definition:
    return Definition("b/msg/A", 2, (Field("x", FieldType("b/msg/B")),), nested=nested)


@pytest.mark.parametrize("way", ["type", "provider"])
def test_slow_type_does_not_block_others(way: str) -> None:
    provider = SlowProvider()
    slow = provider.slow
    provider.add(Definition("b/msg/B", 2, ()))
    provider.add(definition_of({}))

    def make() -> None:
        if way == "type":
            MessageType(definition_of(slow))
        else:
            load("b/msg/A", library=Library(provider))

    thread = threading.Thread(target=make, daemon=True)
    thread.start()
    assert slow.asked.wait(10)
    done = threading.Event()

    def twist() -> None:
        kind = load("geometry_msgs/msg/Twist", library=Library())
        kind.decode_all(kind.encode(linear={"x": 1}))
        done.set()

    threading.Thread(target=twist, daemon=True).start()
    in_time = done.wait(10)
    slow.go_on.set()
    thread.join(10)
    assert in_time
