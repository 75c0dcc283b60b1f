"""Bytes of point clouds as vertices: shared where the card reads them, checked, described, kept."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from point_clouds import packed_color, point_cloud2, random_points

from rosglass.errors import DecodeError, Error
from rosglass.messages import load
from rosglass.scene.data.point_clouds import (
    Channel,
    Cloud,
    CloudHistory,
    is_ordered,
    order_points,
)

CLOUD2 = "sensor_msgs/msg/PointCloud2"
INTENSITY = Channel(("intensity",))
COLOR = Channel(("rgb",), is_color=True)
IDENTITY = np.eye(4)


def cloud(columns: dict[str, Any] | None = None, **options: Any) -> Cloud:
    return Cloud.from_message(point_cloud2(columns or random_points(6), **options))


def changed(**changes: Any) -> Cloud:
    return Cloud.from_message(point_cloud2(random_points(6)) | changes)


def positions(vertices: Any) -> np.ndarray:
    rows = vertices.data.reshape(vertices.count, vertices.stride)
    end = vertices.position + 12
    return np.ascontiguousarray(rows[:, vertices.position : end]).view("<f4")


def channel(vertices: Any) -> np.ndarray:
    rows = vertices.data.reshape(vertices.count, vertices.stride)
    found = np.ascontiguousarray(rows[:, vertices.channel : vertices.channel + 4])
    return found if vertices.channel_is_bytes else found.view("<f4")[:, 0]


# ---- messages


@pytest.mark.parametrize("ros", [1, 2])
def test_messages_of_both_versions_share_their_bytes(ros: int) -> None:
    points = random_points(20) | {"intensity": np.arange(20, dtype=np.float32)}
    kind = load(CLOUD2, ros=ros)
    message = kind.decode(kind.encode(point_cloud2(points, point_step=32)))
    found = Cloud.from_message(message)
    vertices = found.vertex_data(INTENSITY)
    assert np.shares_memory(vertices.data, message.data)
    assert (vertices.stride, vertices.count, vertices.position, vertices.channel) == (32, 20, 0, 12)
    assert np.array_equal(positions(vertices), np.stack([points[k] for k in "xyz"], 1))
    assert np.array_equal(channel(vertices), points["intensity"])
    assert not found.warnings


def test_objects_and_lists_are_accepted() -> None:
    message = point_cloud2(random_points(2))
    message["fields"] = [SimpleNamespace(**field) for field in message["fields"]]
    message["data"] = list(message["data"])
    assert Cloud.from_message(SimpleNamespace(**message)).point_count == 2


def test_equal_layouts_are_equal() -> None:
    assert cloud().layout == cloud(random_points(6, seed=2)).layout
    assert hash(cloud().layout) == hash(cloud().layout)
    assert cloud().layout != cloud(point_step=16).layout


def test_wrong_row_step_is_ignored_if_there_is_no_padding() -> None:
    for row_step in (0, 3, 1000):
        found = changed(width=3, height=2, row_step=row_step)
        assert found.layout.row_step == 36
        assert len(found.warnings) == 1
        assert f"row_step is {row_step}" in found.warnings[0]


def test_cloud_without_points_needs_no_fields() -> None:
    for changes in ({"width": 0}, {"height": 0}, {"width": 0, "row_step": 77, "point_step": 0}):
        found = changed(data=b"", fields=[], **changes)
        assert (found.point_count, found.finite_count, found.bounds()) == (0, 0, None)
        vertices = found.vertex_data()
        assert (vertices.count, vertices.stride) == (0, 12)
        assert found.positions().shape == (0, 3)
        assert is_ordered(found)
        assert order_points(found, vertices).count == 0
    assert changed(data=b"", width=0, point_step=0).vertex_data(Channel(("x",))).stride == 16
    kind = load(CLOUD2)
    assert Cloud.from_message(kind()).point_count == 0


def test_padding_may_have_one_name_several_times() -> None:
    columns = random_points(4)
    message = point_cloud2(columns, point_step=24)
    message["fields"] += [
        {"name": "_", "offset": 12 + i, "datatype": 2, "count": 1} for i in (0, 1)
    ]
    assert Cloud.from_message(message).layout.channels == ["_", "x", "y", "z"]


def test_count_of_0_is_1() -> None:
    message = point_cloud2(random_points(2))
    for field in message["fields"]:
        field["count"] = 0
    assert Cloud.from_message(message).positions().shape == (2, 3)


# ---- bad input


def field(name: str, offset: int, datatype: int = 7, count: int = 1) -> dict[str, Any]:
    return {"name": name, "offset": offset, "datatype": datatype, "count": count}


XYZ = [field("x", 0), field("y", 4), field("z", 8)]


@pytest.mark.parametrize(
    ("changes", "texts"),
    [
        ({"width": -1}, ["width", "-1"]),
        ({"width": 1 << 32}, ["width", "4294967296"]),
        ({"height": 2.5}, ["height", "2.5"]),
        ({"height": True}, ["height", "True"]),
        ({"point_step": "12"}, ["point_step", "'12'"]),
        ({"width": 0xFFFFFFFF, "height": 0xFFFFFFFF}, ["row_step", "72"]),
        ({"width": 7}, ["row_step", "7 points of 12 bytes need 84 bytes", "72"]),
        ({"height": 2}, ["data", "too short", "72 bytes", "144"]),
        ({"data": bytes(71)}, ["data", "too short", "71 bytes", "72"]),
        ({"data": bytes(73)}, ["data", "too long", "73 bytes", "72"]),
        ({"width": 0}, ["data", "too long", "72"]),
        ({"data": "a text"}, ["data", "bytes"]),
        ({"data": [1, 2, 300]}, ["data", "bytes"]),
        ({"data": None}, ["data", "bytes"]),
        ({"point_step": 0, "row_step": 0, "data": b""}, ["fields[0]", "point_step is 0"]),
        ({"point_step": 4, "row_step": 24, "data": bytes(24)}, ["fields[1]", "'y'", "byte 8"]),
        ({"fields": None}, ["fields", "None"]),
        ({"fields": []}, ["fields", "'x'", "none"]),
        ({"fields": XYZ[:2]}, ["fields", "'z'", "x, y"]),
        ({"fields": [*XYZ, field("x", 0)]}, ["fields[3]", "'x'", "two fields"]),
        ({"fields": [*XYZ, field("i", 9)]}, ["fields[3]", "'i'", "byte 13", "point_step is 12"]),
        ({"fields": [*XYZ, field("i", 0xFFFFFFFF)]}, ["fields[3]", "'i'", "4294967299"]),
        ({"fields": [*XYZ, field("h", 0, 7, 0xFFFFFFFF)]}, ["fields[3]", "'h'", "17179869180"]),
        ({"fields": [*XYZ, field("i", -4)]}, ["fields[3].offset", "-4"]),
        ({"fields": [*XYZ, field("i", 0, 300, 1.5)]}, ["fields[3].count", "1.5"]),
        ({"fields": [*XYZ, field(7, 0)]}, ["fields[3].name", "7"]),
        ({"fields": [*XYZ[:2], field("z", 8, 99)]}, ["fields", "'z'", "datatype 99"]),
        ({"fields": [field("i", 0)] * 100_000}, ["fields", "100000"]),
        ({"fields": [*XYZ, 5]}, ["name", "int"]),
    ],
)
def test_errors_name_the_field_and_the_numbers(changes: dict[str, Any], texts: list[str]) -> None:
    with pytest.raises(DecodeError) as error:
        changed(**changes)
    for text in (CLOUD2, *texts):
        assert text in str(error.value)


def test_another_message_is_refused() -> None:
    for value in (None, 5, {}, load("std_msgs/msg/String")(data="x")):
        with pytest.raises(DecodeError, match="pass a sensor_msgs/msg/PointCloud2"):
            Cloud.from_message(value)


def test_hostile_bytes_raise_errors_of_rosglass_only() -> None:
    random = np.random.default_rng(7)
    message = point_cloud2(random_points(6) | {"rgb": np.zeros(6, np.float32)}, height=2)
    interesting = [0, 1, 3, 4, 12, 16, 22, 255, 2**16, 2**31, 2**32 - 1]
    survived = 0
    for _ in range(600):
        fields = [dict(item) for item in message["fields"]]
        broken = message | {"fields": fields}
        for _ in range(random.integers(1, 4)):
            value = int(random.choice(interesting))
            if random.random() < 0.5:
                broken[random.choice(["width", "height", "point_step", "row_step"])] = value
            else:
                random.choice(fields)[random.choice(["offset", "datatype", "count"])] = value
        broken["data"] = message["data"][: int(random.choice([96, 96, 95, 48, 0]))]
        try:
            found = Cloud.from_message(broken)
            # As the colour transformers do, which say what they support.
            color = found.layout.find("rgb")
            is_usable = color is not None and color.is_packed_color
            vertices = found.vertex_data(COLOR if is_usable else None)
            found.bounds()
            order_points(found, vertices)
            assert vertices.data.nbytes <= 1000
            survived += 1
        except Error:
            continue
    assert survived > 20


# ---- vertices


def test_colors_are_read_from_the_bytes_of_any_4_byte_type() -> None:
    bits = np.array([packed_color(1, 2, 3, 4), packed_color(255, 128, 0, 9)], np.uint32)
    for rgb in (bits, bits.view(np.int32), bits.view(np.float32)):
        found = cloud(random_points(2) | {"rgb": rgb})
        vertices = found.vertex_data(COLOR)
        assert np.shares_memory(vertices.data, found.data)
        assert channel(vertices).tolist() == [[3, 2, 1, 4], [0, 128, 255, 9]]


def velodyne(count: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    columns = random_points(count) | {
        "intensity": np.arange(count, dtype=np.float32),
        "ring": np.arange(count, dtype=np.uint16) % 16,
        "time": np.linspace(0, 0.1, count, dtype=np.float32),
    }
    return point_cloud2(columns), columns


def test_22_byte_velodyne_is_repacked() -> None:
    message, columns = velodyne(50)
    assert message["point_step"] == 22
    found = Cloud.from_message(message)
    for name in ("intensity", "ring", "time"):
        vertices = found.vertex_data(Channel((name,)))
        assert (vertices.stride, vertices.channel) == (16, 12)
        assert np.array_equal(positions(vertices), np.stack([columns[k] for k in "xyz"], 1))
        assert np.array_equal(channel(vertices), columns[name].astype(np.float32))


REPACKED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "float64": ({k: v.astype(np.float64) for k, v in random_points(6).items()}, {}),
    "int16": ({k: v.astype(np.int16) for k, v in random_points(6).items()}, {}),
    "int32": ({k: v.astype(np.int32) for k, v in random_points(6).items()}, {}),
    "big-endian": (random_points(6), {"big_endian": True}),
    "padded rows": (random_points(6), {"height": 2, "row_padding": 8}),
    "z first": (dict(reversed(random_points(6).items())), {}),
    "gap": (random_points(6), {"offsets": {"z": 12}}),
    "odd offset": (random_points(6), {"offsets": {"x": 2}, "point_step": 16}),
    "odd step": (random_points(6), {"point_step": 13}),
    "long step": (random_points(6), {"point_step": 4096}),
}


@pytest.mark.parametrize("name", REPACKED)
def test_layouts_that_the_gpu_cannot_read_are_repacked(name: str) -> None:
    columns, options = REPACKED[name]
    found = cloud(columns, **options)
    vertices = found.vertex_data()
    expected = np.stack([columns[key] for key in "xyz"], 1).astype(np.float32)
    assert not np.shares_memory(vertices.data, found.data)
    assert (vertices.stride, vertices.position, vertices.channel) == (12, 0, -1)
    assert np.array_equal(positions(vertices), expected)
    assert np.array_equal(found.positions(), expected)
    assert np.allclose(found.bounds(), (expected.min(0), expected.max(0)))


def test_channel_at_an_odd_offset_is_repacked() -> None:
    columns = random_points(3) | {"intensity": np.array([1, 2, 3], np.float32)}
    found = cloud(columns, offsets={"intensity": 13}, point_step=20)
    assert channel(found.vertex_data(INTENSITY)).tolist() == [1, 2, 3]
    assert found.vertex_data(INTENSITY).stride == 16
    assert found.vertex_data().stride == 20


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "f8"])
def test_channels_of_other_types_become_float32(dtype: str) -> None:
    values = np.array([-3, 0, 100] if dtype[0] != "u" else [250, 0, 100], dtype)
    for big_endian in (False, True):
        found = cloud(random_points(3) | {"intensity": values}, big_endian=big_endian)
        assert channel(found.vertex_data(INTENSITY)).tolist() == values.tolist()
        assert found.channel_range("intensity") == (min(values), max(values))


def test_packed_colors_of_a_big_endian_cloud() -> None:
    rgb = np.array([packed_color(1, 2, 3, 4)], np.uint32).view(np.float32)
    found = cloud(random_points(1) | {"rgb": rgb}, big_endian=True)
    assert channel(found.vertex_data(COLOR)).tolist() == [[3, 2, 1, 4]]


def test_padding_after_the_only_row_does_not_count_as_vertex() -> None:
    found = cloud(random_points(6), row_padding=5)
    vertices = found.vertex_data()
    assert np.shares_memory(vertices.data, found.data)
    assert vertices.data.nbytes == 72
    assert order_points(found, vertices).count == 6


def test_separate_colors_are_packed() -> None:
    colors = {"r": [1.0, 0.0, np.nan], "g": [0.5, 2.0, 0.0], "b": [0.0, -1.0, np.inf]}
    columns = random_points(3) | {k: np.array(v, np.float32) for k, v in colors.items()}
    vertices = cloud(columns).vertex_data(Channel(("r", "g", "b"), is_color=True))
    assert vertices.channel_is_bytes
    assert channel(vertices).tolist() == [[0, 128, 255, 255], [0, 255, 0, 255], [255, 0, 0, 255]]


def test_doubles_beyond_float32_are_invalid_points() -> None:
    columns = {name: np.array([1.0, 1e300]) for name in "xyz"}
    found = cloud(columns)
    assert found.finite_count == 1
    assert np.isinf(positions(found.vertex_data())[1]).all()


# ---- ranges


def test_invalid_points_are_counted_and_have_no_bounds() -> None:
    columns = random_points(5) | {"intensity": np.array([9, 1, 2, np.nan, 7], np.float32)}
    columns["x"][0], columns["y"][4] = np.nan, -np.inf
    found = cloud(columns)
    valid = np.stack([columns[key][1:4] for key in "xyz"], 1)
    assert found.finite_count == 3
    assert found.finite_mask is not None
    assert found.finite_mask.tolist() == [False, True, True, True, False]
    assert np.array_equal(found.bounds(), (valid.min(0), valid.max(0)))
    # 9 and 7 belong to points that cannot be seen.
    assert found.channel_range("intensity") == (1, 2)
    nothing = cloud({name: np.full(3, np.nan, np.float32) for name in "xyz"})
    assert (nothing.finite_count, nothing.bounds(), nothing.channel_range("x")) == (0, None, None)
    assert nothing.axis_range((0, 0, 1)) is None


def test_largest_finite_positions_do_not_count_as_infinite() -> None:
    largest = np.float32(3e38)
    found = cloud({name: np.array([largest, -largest], np.float32) for name in "xyz"})
    assert found.finite_count == 2
    assert found.bounds()[1].tolist() == [largest] * 3


def test_ranges_along_a_vector() -> None:
    columns = random_points(200)
    found = cloud(columns)
    points = np.stack([columns[key] for key in "xyz"], 1).astype(np.float64)
    for axis in ((0, 0, 1), (0, -2, 0), (0.6, 0.0, 0.8), (0.5, -0.5, 0.7), (0, 0, 0)):
        along = points @ np.array(axis, float)
        assert found.axis_range(axis) == pytest.approx((along.min(), along.max()), abs=1e-4)


# ---- order


def test_random_clouds_are_ordered_by_cells() -> None:
    columns = random_points(5000) | {"intensity": np.arange(5000, dtype=np.float32)}
    found = cloud(columns)
    vertices = found.vertex_data(INTENSITY)
    assert not is_ordered(found)
    ordered = order_points(found, vertices)
    assert ordered.count == 5000
    assert ordered.order is not None
    assert sorted(ordered.order) == list(range(5000))
    assert np.array_equal(channel(ordered), ordered.order)
    assert np.array_equal(positions(ordered), found.positions()[ordered.order])
    assert ordered.point_index(7) == ordered.order[7]

    def jump(points: np.ndarray) -> float:
        return float(np.median(np.linalg.norm(np.diff(points, axis=0), axis=1)))

    assert jump(positions(ordered)) < jump(found.positions()) / 4


def test_rows_of_a_scanner_are_ordered_already() -> None:
    angle = np.tile(np.linspace(0, 2 * np.pi, 900, dtype=np.float32), 16)
    height = np.repeat(np.arange(16, dtype=np.float32) / 4, 900)
    x, y = 20 * np.cos(angle), 20 * np.sin(angle)
    assert is_ordered(cloud({"x": x, "y": y, "z": height}))
    # A few outliers change nothing, for random points either.
    x[30:40] = 1e9
    assert is_ordered(cloud({"x": x, "y": y, "z": height}))
    columns = random_points(3000)
    columns["x"][3:9] = 1e9
    assert not is_ordered(cloud(columns))


def test_ordering_leaves_out_invalid_points() -> None:
    columns = random_points(100)
    columns["x"][10:20] = np.nan
    columns["z"][0] = np.inf
    found = cloud(columns)
    ordered = order_points(found, found.vertex_data())
    assert ordered.count == found.finite_count == 89
    assert np.isfinite(positions(ordered)).all()
    assert found.finite_mask is not None
    assert sorted(ordered.order) == np.flatnonzero(found.finite_mask).tolist()
    nothing = cloud({name: np.full(3, np.nan, np.float32) for name in "xyz"})
    assert order_points(nothing, nothing.vertex_data()).count == 0


def test_points_at_one_place_can_be_ordered() -> None:
    found = cloud({name: np.full(9, 2.5, np.float32) for name in "xyz"})
    assert is_ordered(found)
    assert order_points(found, found.vertex_data()).count == 9


# ---- selection


def test_point_is_described_as_in_rviz() -> None:
    rgb = np.array([0, packed_color(10, 20, 30, 40)], np.uint32).view(np.float32)
    columns = {name: np.array([0, 1 + i], np.float32) for i, name in enumerate("xyz")}
    columns |= {
        "rgb": rgb,
        "ring": np.array([0, 5], np.uint16),
        "normal": np.array([[0, 0, 1], [1, 0, 0]], np.float64),
        "histogram": np.zeros((2, 308), np.uint8),
    }
    for options in ({}, {"big_endian": True}, {"height": 2, "row_padding": 3}):
        assert cloud(columns, **options).describe_point(1) == [
            ("Position", (1.0, 2.0, 3.0)),
            ("3: rgb", (10, 20, 30, 40)),
            ("4: ring", 5),
            ("5: normal", (1.0, 0.0, 0.0)),
            ("6: histogram[308]", (0,) * 16),
        ]


# ---- history


def test_without_decay_time_the_last_cloud_stays() -> None:
    history = CloudHistory()
    first, removed = history.add(cloud(), IDENTITY, 10.0)
    assert (history.entries, removed) == ((first,), [])
    assert history.expire(1e9) == []
    second, removed = history.add(cloud(random_points(9)), IDENTITY, 11.0)
    assert (history.entries, removed, history.point_count) == ((second,), [first], 9)


def test_clouds_stay_for_the_decay_time() -> None:
    history = CloudHistory(decay_time_s=2.0)
    entries = [history.add(cloud(), IDENTITY * 1.0, float(at))[0] for at in (0, 1)]
    assert history.expire(1.99) == []
    assert history.expire(2.0) == entries[:1]
    third, removed = history.add(cloud(), IDENTITY, 3.5)
    assert (removed, history.entries) == (entries[1:], (third,))
    # As in RViz, the last one disappears, too.
    assert history.expire(5.5) == [third]
    assert history.point_count == 0
    history.decay_time_s = 0
    history.add(cloud(), IDENTITY, 6.0)
    assert len(history.clear()) == 1
    assert history.entries == ()


def test_entries_keep_the_pose_of_their_stamp() -> None:
    history = CloudHistory(10.0)
    poses = [np.diag([1.0, 1, 1, 1]) + np.eye(4, k=3) * shift for shift in (0, 1)]
    for at, pose in enumerate(poses):
        history.add(cloud(), pose, at)
    assert [entry.transform.tolist() for entry in history.entries] == [p.tolist() for p in poses]
