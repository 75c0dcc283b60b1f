"""The rules of the transform buffer."""

from __future__ import annotations

import logging
import math
import random
import threading
from typing import Any

import pytest

import rosglass
from rosglass.comm import Duration, Time
from rosglass.errors import (
    ConnectivityException,
    ConversionError,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from rosglass.tf import Transform, TransformBuffer

HALF = math.sqrt(0.5)
#: A quarter turn to the left.
LEFT = (0.0, 0.0, HALF, HALF)


def at(seconds: float) -> Time:
    return Time() + Duration.from_seconds(seconds)


def put(
    buffer: TransformBuffer,
    parent: str,
    child: str,
    seconds: float = 1.0,
    x: float = 1.0,
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
    authority: str = "",
    static: bool = False,
) -> bool:
    given = Transform((x, 0.0, 0.0), rotation, at(seconds), parent, child)
    return buffer.set_transform(given, authority, static=static)


def test_chain_up_down_and_across() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", rotation=LEFT)
    put(buffer, "base", "arm", x=2.0)
    put(buffer, "base", "head", x=3.0, static=True)
    assert buffer.lookup_transform("map", "arm").translation == pytest.approx((1, 2, 0))
    assert buffer.lookup_transform("arm", "map").translation == pytest.approx((-2, 1, 0))
    assert buffer.lookup_transform("head", "arm").translation == pytest.approx((-1, 0, 0))
    found = buffer.lookup_transform("map", "arm")
    assert (found.frame_id, found.child_frame_id, found.stamp) == ("map", "arm", at(1))
    assert found.rotation == pytest.approx(LEFT)


def test_interpolation_and_time_travel() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 1.0, 0.0)
    put(buffer, "map", "base", 3.0, 4.0, LEFT)
    between = buffer.lookup_transform("map", "base", at(2.5))
    assert between.translation == pytest.approx((3, 0, 0))
    angle = math.radians(90) * 0.75 / 2
    assert between.rotation == pytest.approx((0, 0, math.sin(angle), math.cos(angle)))
    with pytest.raises(ExtrapolationException, match=r"into the future.*3\.100.*3\.000.*'base'"):
        buffer.lookup_transform("map", "base", at(3.1))
    with pytest.raises(ExtrapolationException, match="into the past"):
        buffer.lookup_transform("map", "base", at(0.9))


def test_shorter_way_round() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 1.0, rotation=(0.0, 0.0, 0.0, 1.0))
    put(buffer, "map", "base", 2.0, rotation=(0.0, 0.0, -HALF, -HALF))
    found = buffer.lookup_transform("map", "base", at(1.5)).rotation
    assert found == pytest.approx((0, 0, math.sin(math.pi / 8), math.cos(math.pi / 8)))


def test_fixed_frame_and_two_times() -> None:
    buffer = TransformBuffer()
    for second in (1, 2, 3):
        put(buffer, "odom", "base", second, float(second))
    found = buffer.lookup_transform_full("base", at(3), "base", at(1), "odom")
    assert found.translation == pytest.approx((-2, 0, 0))
    assert found.stamp == at(3)
    assert buffer.can_transform_full("base", at(3), "base", at(1), "odom")
    assert "never" in buffer.can_transform_full("base", None, "base", None, "never").reason


@pytest.mark.parametrize("name", ["", "/base", None, 3, []])
def test_invalid_names_are_rejected(name: object) -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    with pytest.raises(InvalidArgumentException):
        buffer.lookup_transform("map", name)  # type: ignore[arg-type]
    assert not buffer.has_frame(name)  # type: ignore[arg-type]
    assert buffer.frame(name) is None  # type: ignore[arg-type]
    with pytest.raises(InvalidArgumentException):
        buffer.on_change(name, "map", lambda: None)  # type: ignore[arg-type]


def test_unknown_frames_and_what_they_may_be() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base_link")
    with pytest.raises(LookupException, match="did you mean base_link") as caught:
        buffer.lookup_transform("map", "base_lnk")
    assert isinstance(caught.value, rosglass.Error)
    found = buffer.can_transform("map", "other")
    assert not found
    assert isinstance(found.error, LookupException)
    assert "other" in found.reason
    assert buffer.can_transform("map", "base_link")
    assert buffer.can_transform("map", "base_link").reason == ""


def test_two_trees() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    put(buffer, "world", "camera")
    with pytest.raises(ConnectivityException, match=r"'base' belongs to 'map'.*'world'"):
        buffer.lookup_transform("base", "camera")


@pytest.mark.parametrize("time", [1.5, 3, "now"])
def test_invalid_times_are_rejected(time: object) -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    with pytest.raises(InvalidArgumentException, match=r"rosglass\.Time"):
        buffer.lookup_transform("map", "base", time)  # type: ignore[arg-type]


@pytest.mark.parametrize("time", [0, -1.0, "10", True, math.nan, Duration(-1)])
def test_invalid_cache_times_are_rejected(time: object) -> None:
    with pytest.raises(ConversionError, match="cache_time"):
        TransformBuffer(time)  # type: ignore[arg-type]


def test_newest_is_the_newest_common() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 5.0)
    put(buffer, "map", "base", 9.0)
    put(buffer, "base", "arm", 7.0)
    put(buffer, "arm", "hand", static=True)
    assert buffer.lookup_transform("map", "hand").stamp == at(7)
    assert buffer.latest_common_time("map", "hand") == at(7)
    assert buffer.latest_common_time("arm", "hand") == Time()


def test_many_frames_at_once_are_where_each_of_them_is() -> None:
    buffer = TransformBuffer()
    turns = random.Random(3)
    for number in range(1, 40):
        parent = f"frame{turns.randrange(number)}"
        static = turns.random() < 0.3
        # Their newest times differ, and lie between those of others.
        for second in range(1, 2 if static else 2 + turns.randrange(5)):
            angle = turns.uniform(-3, 3)
            rotation = (0.0, math.sin(angle), 0.0, math.cos(angle))
            moment = second + turns.random()
            put(
                buffer, parent, f"frame{number}", moment, turns.uniform(-1, 1), rotation, "", static
            )
    put(buffer, "island", "beach")
    put(buffer, "frame0", "once", 90.0)
    put(buffer, "once", "long ago", 1.0)
    put(buffer, "frame3", "moved", 1.0)
    put(buffer, "frame4", "moved", 3.0)
    put(buffer, "moved", "on it", 2.0)
    frames = [*(f"frame{number}" for number in range(40)), "beach", "moved", "on it"]
    frames += ["once", "long ago", "", "nowhere"]
    for target in frames:
        found = buffer.lookup_newest(target, frames)
        assert found.keys() == set(frames)
        for source in frames:
            error = buffer.can_transform(target, source).error
            if error is not None:
                assert repr(found[source]) == repr(error)
                continue
            alone = buffer.lookup_transform(target, source)
            position, rotation = found[source]  # type: ignore[misc]
            assert position == pytest.approx(alone.translation)
            assert rotation == pytest.approx(alone.rotation)


def test_leading_slash_is_left_out() -> None:
    buffer = TransformBuffer()
    notified: list[str] = []
    buffer.on_tree_change(lambda: notified.append("tree"))
    put(buffer, "/map", "/base")
    put(buffer, "/map", "/base", 2.0)
    assert list(buffer.tree()) == ["base", "map"]
    assert notified == ["tree"]


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"child_frame_id": "map"}, "self"),
        ({"child_frame_id": ""}, "no name"),
        ({"frame_id": "/"}, "no name"),
        ({"rotation": (0.0, 0.0, 0.0, 0.0)}, "not normalised"),
        ({"rotation": (0.0, 0.0, 0.0, 1.01)}, "not normalised"),
    ],
)
def test_transforms_that_are_refused(
    change: dict[str, object], kind: str, caplog: pytest.LogCaptureFixture
) -> None:
    buffer = TransformBuffer()
    fields = {"frame_id": "map", "child_frame_id": "base", **change}
    with pytest.raises(InvalidArgumentException):
        buffer.set_transform(Transform(**fields), "/one")  # type: ignore[arg-type]
    with pytest.raises(InvalidArgumentException):
        buffer.set_transform(Transform(**fields), "/one")  # type: ignore[arg-type]
    assert buffer.ignored == {kind: 2}
    assert not len(buffer.tree())
    # Each fault is logged once.
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "/one" in caplog.text


def test_non_finite_numbers_are_ignored() -> None:
    buffer = TransformBuffer()
    for bad in (math.nan, math.inf):
        entry = ("map", bad, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        assert buffer.set_many([("base", 1, entry)])[0][0] == "not finite"
    assert buffer.ignored == {"not finite": 2}


def test_old_and_repeated_data(caplog: pytest.LogCaptureFixture) -> None:
    buffer = TransformBuffer(cache_time=Duration.from_seconds(2))
    assert put(buffer, "map", "base", 10.0)
    assert not put(buffer, "map", "base", 10.0, 5.0)
    assert not put(buffer, "map", "base", 7.9)
    assert not put(buffer, "map", "base", 7.8)
    assert put(buffer, "map", "base", 9.0, 3.0)
    assert buffer.ignored == {"repeated": 1, "old": 2}
    assert buffer.lookup_transform("map", "base", at(9.5)).translation == pytest.approx((2, 0, 0))
    warnings = [record for record in caplog.records if record.levelno == logging.WARNING]
    assert len(warnings) == 1
    assert "TF_OLD_DATA" in caplog.text


def test_only_the_last_seconds_are_kept() -> None:
    buffer = TransformBuffer(1.0)
    for step in range(1000):
        put(buffer, "map", "base", 1 + step * 0.01, float(step))
    info = buffer.frame("base")
    assert info is not None
    assert info.count == 101
    assert info.rate == pytest.approx(100)
    assert info.oldest == at(9.99)
    assert buffer.lookup_transform("map", "base", at(9.995)).translation[0] == pytest.approx(899.5)
    with pytest.raises(ExtrapolationException):
        buffer.lookup_transform("map", "base", at(9.98))


def test_new_parent_counts_from_then_on() -> None:
    buffer = TransformBuffer()
    put(buffer, "left", "cup", 1.0)
    put(buffer, "right", "cup", 2.0)
    assert buffer.lookup_transform("left", "cup", at(1.5)).translation == (1, 0, 0)
    assert buffer.lookup_transform("right", "cup").stamp == at(2)
    info = buffer.frame("cup")
    assert info is not None
    assert info.parent == "right"


def test_loops_are_refused() -> None:
    buffer = TransformBuffer()
    put(buffer, "a", "b")
    put(buffer, "b", "c")
    with pytest.raises(InvalidArgumentException, match="TF_LOOP"):
        put(buffer, "c", "a")
    assert buffer.lookup_transform("a", "c").translation == pytest.approx((2, 0, 0))
    # Links that are older than what is kept make way: the tree was turned round.
    put(buffer, "b", "c", 20.0)
    assert put(buffer, "c", "a", 20.0)
    assert buffer.tree().roots() == ["b"]


def test_static_and_moving(caplog: pytest.LogCaptureFixture) -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 1.0, 1.0, static=True, authority="/one")
    assert buffer.lookup_transform("map", "base", at(99)).translation == (1, 0, 0)
    put(buffer, "map", "base", 2.0, 2.0, authority="/two")
    with pytest.raises(ExtrapolationException, match="only time"):
        buffer.lookup_transform("map", "base", at(99))
    put(buffer, "map", "base", 1.0, 3.0, static=True, authority="/one")
    assert buffer.lookup_transform("map", "base", at(99)).translation == (3, 0, 0)
    assert len(caplog.records) == 1
    assert "/one and /two" in caplog.text


def test_clearing_keeps_what_never_moves() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    put(buffer, "base", "camera", static=True)
    buffer.clear()
    assert sorted(buffer.tree()) == ["base", "camera"]
    with pytest.raises(LookupException):
        buffer.lookup_transform("map", "camera")
    assert buffer.can_transform("base", "camera")
    assert put(buffer, "map", "base", 0.5), "time may begin anew"
    buffer.clear(static=True)
    assert not len(buffer.tree())


def test_many_threads_at_once() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 1.0, 0.0)
    faults: list[Exception] = []

    def write(name: str) -> None:
        for step in range(300):
            put(buffer, "base", name, 1 + step * 0.01)

    def read() -> None:
        try:
            for _ in range(300):
                for name in buffer.tree():
                    buffer.lookup_transform("base", name)
        except Exception as error:
            faults.append(error)

    threads = [threading.Thread(target=write, args=(f"f{n}",)) for n in range(3)]
    threads += [threading.Thread(target=read) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not faults
    assert len(buffer.tree()) == 5


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The seconds that have gone by, to be set."""
    now = [1000.0]
    monkeypatch.setattr("rosglass.tf.frames.monotonic", lambda: now[0])
    return now


def test_robot_whose_clock_was_set_back_is_followed(
    clock: list[float], caplog: pytest.LogCaptureFixture
) -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 500.0, authority="/robot")
    put(buffer, "base", "lidar", 7.0, static=True)
    for step in range(30):
        clock[0] += 0.1
        assert not put(buffer, "map", "base", 100.0 + step / 10, 2.0, authority="/robot")
    assert buffer.lookup_transform("map", "lidar").stamp == at(500)
    clock[0] += 0.2
    assert put(buffer, "map", "base", 103.2, 3.0, authority="/restarted")
    assert buffer.lookup_transform("map", "base").stamp == at(103.2)
    assert buffer.lookup_transform("map", "lidar").translation == (4.0, 0.0, 0.0)
    assert put(buffer, "map", "base", 103.3, 4.0)
    text = "time jumped back for 'base' by 396.800 s (from /restarted)"
    assert sum(text in record.getMessage() for record in caplog.records) == 1


def test_frame_with_a_new_parent_after_a_clock_reset(clock: list[float]) -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 500.0)
    assert not put(buffer, "odom", "base", 100.0)
    clock[0] += 3.0
    assert put(buffer, "odom", "base", 103.0)
    assert buffer.tree()["base"].parent == "odom"


def test_late_publisher_among_punctual_ones_does_not_turn_time_back(clock: list[float]) -> None:
    """Two publishers of a frame, one of them with a clock that is behind, or an old message."""
    buffer = TransformBuffer()
    for step in range(20):
        put(buffer, "map", "base", 500.0 + step, authority="/right")
        for late in range(10):
            clock[0] += 0.25
            assert not put(buffer, "map", "base", 100.0 + step + late / 10, authority="/behind")
    # Said again, and again, as what is latched is: no time goes by in it.
    for _ in range(5):
        clock[0] += 2.0
        assert not put(buffer, "map", "base", 100.0)
    assert buffer.lookup_transform("map", "base").stamp == at(519)


def test_earlier_late_data_does_not_count_after_clearing(clock: list[float]) -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base", 500.0)
    put(buffer, "map", "base", 100.0)
    buffer.clear()
    put(buffer, "map", "base", 700.0)
    clock[0] += 5.0
    assert not put(buffer, "map", "base", 600.0)


def test_hint_at_similar_frames_is_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[str] = []

    def similar(name: str, known: Any) -> str:
        found.append(name)
        return f"; there are {len(known)}"

    monkeypatch.setattr("rosglass.tf.buffer.similar", similar)
    buffer = TransformBuffer()
    buffer.set_transform(Transform((0, 0, 0), (0, 0, 0, 1), Time(1), "map", "arm"))
    for _ in range(3):
        with pytest.raises(LookupException, match="; there are 2"):
            buffer.lookup_transform("map", "arms")
    assert found == ["arms"]
    buffer.set_transform(Transform((0, 0, 0), (0, 0, 0, 1), Time(1), "map", "legs"))
    with pytest.raises(LookupException, match="; there are 3"):
        buffer.lookup_transform("map", "arms")
    assert found == ["arms"] * 2, "another frame may be similar"


def test_chains_as_long_as_those_of_tf2_are_followed() -> None:
    count = 9_000  # without a limit, this takes minutes
    links = [("base" if not n else f"f{n - 1}", f"f{n}") for n in range(count)]
    for order in (links, list(reversed(links))):
        buffer = TransformBuffer()
        for parent, child in order:
            assert put(buffer, parent, child)
        assert buffer.lookup_transform("base", "f999").translation[0] == 1000
        assert buffer.silence("base", "f999") < 60.0
        for target, source in (("base", "f1001"), ("f1001", "base"), ("base", f"f{count - 1}")):
            with pytest.raises(LookupException, match="a loop, or more than 1000 links"):
                buffer.lookup_transform(target, source)
            (found,) = buffer.lookup_newest(target, [source]).values()
            assert isinstance(found, LookupException)
        assert buffer.silence("base", f"f{count - 1}") == 0.0
        assert len(buffer.tree().chain("base", f"f{count - 1}")) == count + 1
        # Whether this closes a loop is not found out at any length.
        with pytest.raises(InvalidArgumentException, match="below more than 1000 other frames"):
            put(buffer, f"f{count - 2}", "f9", 2.0)
        assert buffer.ignored["too deep"] == 1


def test_lookups_of_frames_that_nothing_connects_share_what_they_find() -> None:
    class Counting(dict[str, Any]):
        looks = 0

        def get(self, key: str, default: Any = None) -> Any:
            self.looks += 1
            return super().get(key, default)

    buffer = TransformBuffer()
    put(buffer, "map", "odom")
    for chain in range(3):
        for number in range(1500):
            put(buffer, f"chain{chain}_{number}", f"chain{chain}_{number + 1}")
    store = buffer._store
    caches = store.caches = Counting(store.caches)
    frames = [one for one in buffer.frame_names() if one not in ("map", "odom")]
    for target in ("map", "chain0_1400"):
        caches.looks = 0
        found = buffer.lookup_newest(target, frames)
        below = sum(not isinstance(one, TransformException) for one in found.values())
        assert below == (0 if target == "map" else 101)
        assert caches.looks < 4 * len(frames), "they are walked along again and again"


def test_lookup_of_many_frames_ends_soon() -> None:
    # Each link moves at times of its own: no frame shares a pose with another one.
    buffer = TransformBuffer()
    count = 900
    for number in range(count):
        for second in (1.0, 9.0 - number / count):
            put(buffer, f"f{number - 1}" if number else "map", f"f{number}", second)
    found = buffer.lookup_newest("map", [f"f{number}" for number in range(count)])
    known = [one for one in found.values() if not isinstance(one, TransformException)]
    assert 100 < len(known) < count
    assert "more than 50000 links" in str(found[f"f{count - 1}"])


def test_names_are_bounded_for_each_publisher(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    for module in ("buffer", "frames"):
        monkeypatch.setattr(f"rosglass.tf.{module}.monotonic", lambda: now)
    buffer = TransformBuffer()

    def send(names: list[str], authority: str, parent: str = "map") -> list[str]:
        entry = (parent, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        items = [(name, round(now * 1e9), entry) for name in names]
        return [kind for kind, _ in buffer.set_many(items, authority)]

    assert not send(["odom"], "/robot")
    assert not send(["base"], "/robot", "odom")
    assert not send([f"a{number}" for number in range(10_000)], "/one")
    assert send([f"b{number}" for number in range(5_000)], "/one") == ["too many"] * 5_000
    assert send(["a0"], "/one", "c0") == ["too many"], "parents are names, too"
    assert "at most 10000 names of frames are kept for each publisher" in buffer.last_fault
    assert buffer.last_fault.endswith("(from /one)")
    assert len(caplog.records) == 1
    # What is known is followed, other publishers are not affected.
    now += 5.0
    assert not send(["a5"], "/one")
    assert not send([f"d{number}" for number in range(9_000)], "/two")
    # Names that are not used any more make room, but those that others stand on.
    now += 5.5
    assert not send(["leaf"], "/two", "a7")
    assert not send(["e"], "/one")
    names = set(buffer.frame_names())
    assert {"map", "odom", "base", "a5", "a7", "d0", "e", "leaf"} < names
    assert "a0" not in names
    assert len(names) == 9_007
    assert not buffer.has_frame("a0")
    # All together.
    for publisher in ("/three", "/four", "/five", "/six"):
        send([f"{publisher}{number}" for number in range(10_000)], publisher)
    refused = send([f"late{number}" for number in range(1_000)], "/seven")
    assert refused == ["too many"] * 5, "odom and base made room"
    assert len(buffer.frame_names()) == 50_000
    now += 11.0
    # A publisher's frames may be dropped although they are in use: the one with most frames loses.
    assert not send([f"/six{number}" for number in range(10_000)], "/six")
    assert not send(["late"], "/seven")
    assert len(buffer.frame_names()) < 11_000
    buffer.clear(static=True)
    assert buffer.frame_names() == []
    assert not send([f"g{number}" for number in range(9_999)], "/one")


def test_frames_that_make_room_for_their_own_new_names_are_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 100.0
    for module in ("buffer", "frames"):
        monkeypatch.setattr(f"rosglass.tf.{module}.monotonic", lambda: now)
    buffer = TransformBuffer()

    def send(parent: str, *children: str) -> list[str]:
        entry = (parent, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        items = [(child, round(now * 1e9), entry) for child in children]
        return [kind for kind, _ in buffer.set_many(items, "/one")]

    assert not send("map", *(f"a{number}" for number in range(9_999)))
    now += 11.0
    assert not send("new", "a5"), "a5 was outdated until now"
    assert buffer.frame_names() == ["a5", "new"]
    for turn in range(3):
        assert not send("map", *(f"b{turn}-{number}" for number in range(9_990)))
        now += 11.0
    buffer.clear()
    assert buffer.frame_names() == []


def test_long_names_are_refused_and_not_kept(caplog: pytest.LogCaptureFixture) -> None:
    buffer = TransformBuffer()
    long = "x" * 100_000
    for parent, child in (("map", long), (long, "base"), ("/" + long[:255], "base")):
        if len(parent) != 256:
            with pytest.raises(InvalidArgumentException, match="at most 255 letters"):
                put(buffer, parent, child)
        else:
            assert put(buffer, parent, child)
    assert buffer.ignored == {"long name": 2}
    assert all(len(record.getMessage()) < 500 for record in caplog.records)
    assert len(buffer.last_fault) < 500
    assert sorted(map(len, buffer.frame_names())) == [4, 255]


def test_tree_of_some_frames() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "odom")
    put(buffer, "odom", "base", static=True)
    assert buffer.frame_names() == ["odom", "map", "base"]
    tree = buffer.tree(["base", "nowhere", "odom"])
    assert sorted(tree) == ["base", "odom"]
    assert tree["base"].static


def test_silence_is_that_of_the_link_that_moved_longest_ago(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    buffer = TransformBuffer()
    for now, parent, child, static in (
        (0.0, "map", "odom", False),
        (5.0, "odom", "base", False),
        (1.0, "base", "lamp", True),
        (2.0, "earth", "map", False),
    ):
        monkeypatch.setattr("rosglass.tf.buffer.monotonic", lambda now=now: now)
        put(buffer, parent, child, static=static)
    monkeypatch.setattr("rosglass.tf.buffer.monotonic", lambda: 10.0)
    assert buffer.silence("map", "lamp") == buffer.silence("lamp", "map") == 10.0
    assert buffer.silence("odom", "lamp") == 5.0
    assert buffer.silence("base", "lamp") == 0.0
    assert buffer.silence("map", "nowhere") == 0.0


def test_at_rest_no_pose_changes() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "odom", 1.0, 0.0)
    put(buffer, "base", "mast", static=True)
    put(buffer, "odom", "base", 1.0, 5.0)
    rest = buffer.rest()
    assert rest is not None
    # The same again, or another frame of the same place: nothing moves.
    put(buffer, "odom", "base", 2.0, 5.0)
    put(buffer, "map", "odom", 2.0, 0.0)
    assert buffer.rest() == rest
    # The common time of map and mast is before the move, and comes to it later.
    put(buffer, "odom", "base", 3.0, 7.0)
    assert buffer.rest() is None
    assert buffer.lookup_transform("map", "mast").translation == pytest.approx((6, 0, 0))
    put(buffer, "map", "odom", 2.5, 0.0)
    assert buffer.rest() is None
    assert buffer.lookup_transform("map", "mast").translation == pytest.approx((7, 0, 0))
    put(buffer, "map", "odom", 3.5, 0.0)
    moved = buffer.rest()
    assert moved not in (None, rest)
    assert buffer.lookup_transform("map", "mast").translation == pytest.approx((8, 0, 0))
    put(buffer, "odom", "base", 4.0, 7.0)
    assert buffer.rest() == moved
    # Late, between two others; a static one; a new frame.
    put(buffer, "odom", "base", 3.5, 9.0)
    assert buffer.rest() != moved
    put(buffer, "map", "odom", 5.0, 0.0)
    put(buffer, "odom", "base", 5.0, 7.0)
    states = {buffer.rest()}
    put(buffer, "base", "mast", x=2.0, static=True)
    states.add(buffer.rest())
    put(buffer, "base", "arm", 5.0)
    states.add(buffer.rest())
    assert len(states - {None, moved}) == 3
    for number in range(2000):
        put(buffer, "map", f"many{number}", static=True)
    # A peer may send any number of frames: which of them move is not found out.
    rest = buffer.rest()
    assert rest is not None
    assert buffer.rest() == rest
    put(buffer, "base", "mast", x=2.0, static=True)
    assert buffer.rest() != rest
