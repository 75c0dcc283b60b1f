"""The same transforms and 10,000 questions to tf2's own BufferCore and to ours."""

from __future__ import annotations

import json
import math
import random
import subprocess
from collections import Counter
from operator import mul
from pathlib import Path
from typing import Any

import pytest

from rosglass.comm import Time
from rosglass.errors import TransformException
from rosglass.tf import Transform, TransformBuffer

NS = 1_000_000_000
#: Early enough that tf2's Python binding, which takes times as floats, keeps each nanosecond.
START = 1_000 * NS + 123
CACHE_TIME = 10
PYTHON = Path("/usr/bin/python3")


def tf2(plan: dict[str, Any]) -> Any:
    """Return what tf2 answers; skip the test where it is not installed."""
    program = Path(__file__).with_name("tf2_answers.py")
    if not Path("/usr/lib/python3/dist-packages/tf2_py").is_dir():
        pytest.skip("tf2 is not installed: sudo apt-get install python3-tf2-ros")
    done = subprocess.run(
        [str(PYTHON), str(program)],
        input=json.dumps(plan),
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
        env={"PATH": "/usr/bin:/bin", "HOME": "/tmp"},
    )
    return json.loads(done.stdout)


def some_rotation(dice: random.Random) -> list[float]:
    numbers = [dice.gauss(0, 1) for _ in range(4)]
    length = math.sqrt(sum(number * number for number in numbers))
    return [number / length for number in numbers]


def some_transforms(dice: random.Random) -> list[list[Any]]:
    """Return two trees: static and moving frames, late and repeated data, changes of parents."""
    parents = {"base": "odom", "odom": "map", "other": "far", "third": "other"}
    static = {"third"}
    for number in range(24):
        name = f"link{number}"
        parents[name] = dice.choice(list(parents))
        if dice.random() < 0.4:
            static.add(name)
    parents["lost"] = "nowhere"
    samples: list[list[Any]] = []
    for name, parent in parents.items():
        place = [dice.uniform(-5, 5) for _ in range(3)]
        turn = some_rotation(dice)
        if name in static:
            samples.append([parent, name, START, [*place, *turn], "/static", True])
            continue
        # Some transforms cover more than the cache, some end early, some have a single stamp.
        first, last = dice.choice(
            [(-12.0, 5.0), (0.0, 5.0), (0.0, 2.0), (1.0, 5.0)] * 3 + [(3.0, 3.0)]
        )
        time, period = first, dice.choice([0.01, 0.1, 0.5])
        while time <= last:
            stamp = START + int(time * NS) + dice.randrange(1000)
            place = [x + dice.gauss(0, 0.1) for x in place]
            turn = some_rotation(dice) if dice.random() < 0.2 else [-x for x in turn]
            authority = dice.choice(["/one", "/two"])
            samples.append([parent, name, stamp, [*place, *turn], authority, False])
            if dice.random() < 0.05:
                samples.append([parent, name, stamp, [*place, *turn], "/again", False])
            time += period
        if name == "link3":
            samples.append(["map", name, START + 5 * NS + 500, [*place, *turn], "/moved", False])
    # Late ones, in any order; and outdated ones, which are refused.
    late = [item for item in samples if not item[5] and dice.random() < 0.1]
    dice.shuffle(late)
    samples = [item for item in samples if item not in late] + late
    for item in dice.sample(samples, 20):
        samples.append([*item[:2], START - 40 * NS, *item[3:]])
    return samples


def some_queries(dice: random.Random, transforms: list[list[Any]], count: int) -> list[list[Any]]:
    names = sorted({name for item in transforms for name in item[:2]})
    stamps = [item[2] for item in transforms if not item[5]]
    odd = ["never", "", "/base"]

    def name() -> str:
        return dice.choice(odd) if dice.random() < 0.01 else dice.choice(names)

    def time() -> int:
        kind = dice.random()
        if kind < 0.2:
            return 0
        if kind < 0.3:
            return dice.choice(stamps) + dice.choice([-1, 0, 0, 1])
        return START + int(dice.uniform(*dice.choice([(-15, 8), (1, 2), (1, 2), (1, 2)])) * NS)

    queries: list[list[Any]] = []
    for _ in range(count):
        if dice.random() < 0.8:
            queries.append([name(), name(), time()])
        else:
            queries.append([name(), time(), name(), time(), name()])
    return queries


def ask(buffer: TransformBuffer, query: list[Any]) -> tuple[Transform | TransformException, bool]:
    if len(query) == 3:
        target, source, time = query
        can = bool(buffer.can_transform(target, source, Time(time)))
        lookup: Any = lambda: buffer.lookup_transform(target, source, Time(time))  # noqa: E731
    else:
        arguments = (query[0], Time(query[1]), query[2], Time(query[3]), query[4])
        can = bool(buffer.can_transform_full(*arguments))
        lookup = lambda: buffer.lookup_transform_full(*arguments)  # noqa: E731
    try:
        return lookup(), can
    except TransformException as error:
        return error, can


@pytest.mark.parametrize("seed", [1, 2])
def test_same_results_as_tf2(seed: int) -> None:
    dice = random.Random(seed)
    transforms = some_transforms(dice)
    queries = some_queries(dice, transforms, 5000)
    plan = {"cache_time": CACHE_TIME, "transforms": transforms, "queries": queries}
    theirs = tf2(plan)
    buffer = TransformBuffer(CACHE_TIME)
    for parent, child, time, numbers, authority, static in transforms:
        given = Transform(tuple(numbers[:3]), tuple(numbers[3:]), Time(time), parent, child)  # type: ignore[arg-type]
        buffer.set_transform(given, authority, static=static)
    kinds: Counter[str] = Counter()
    for query, expected in zip(queries, theirs["answers"], strict=True):
        found, can = ask(buffer, query)
        where = f"{query}: tf2 says {expected}, we say {found!r}"
        assert can == expected["can"], where
        if isinstance(found, TransformException):
            assert type(found).__name__ == expected.get("error"), where
            kinds[type(found).__name__] += 1
            continue
        assert "value" in expected, where
        place, turn = expected["value"][:3], expected["value"][3:]
        if len(query) == 5 and sum(map(mul, turn, found.rotation)) < 0:
            # tf2 composes matrices here: the same rotation may come back with the other sign.
            turn = [-number for number in turn]
        assert found.translation == pytest.approx(place, abs=1e-9), where
        assert found.rotation == pytest.approx(turn, abs=1e-9), where
        assert found.stamp.nanoseconds == expected["stamp"], where
        assert [found.frame_id, found.child_frame_id] == expected["frames"], where
        kinds["values"] += 1
    assert min(kinds.values()) >= 20, kinds
    assert len(kinds) == 5, kinds
    assert kinds["values"] > 1000, kinds


def test_same_yaml_as_tf2() -> None:
    dice = random.Random(3)
    transforms = some_transforms(dice)
    theirs = tf2({"cache_time": CACHE_TIME, "transforms": transforms, "queries": []})
    buffer = TransformBuffer(CACHE_TIME)
    for parent, child, time, numbers, authority, static in transforms:
        given = Transform(tuple(numbers[:3]), tuple(numbers[3:]), Time(time), parent, child)  # type: ignore[arg-type]
        buffer.set_transform(given, authority, static=static)
    assert sorted(buffer.tree().to_yaml().split("\n")) == sorted(theirs["yaml"].split("\n"))
