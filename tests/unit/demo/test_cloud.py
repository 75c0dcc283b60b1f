"""The coloured cloud: positions and colours of its points, and when it is published."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the simulated cloud needs the extra `camera`")

import rosglass
from rosglass.comm import Time
from rosglass.demo.equipment import Cloud
from rosglass.demo.simulation import RobotState
from rosglass.demo.world import LaserScanner, World

if TYPE_CHECKING:
    import numpy.typing as npt

WORLD = World.standard()


@pytest.fixture
def cloud() -> Cloud:
    return Cloud(WORLD)


def look(cloud: Cloud, x: float, y: float, yaw: float = 0.0) -> bool:
    ranges = LaserScanner(WORLD, noise=0.0).scan(x, y, yaw, 0.0)
    return cloud.look(RobotState(x=x, y=y, yaw=yaw), ranges)


def message(cloud: Cloud) -> Any:
    """Return the message as it comes out of the wire."""
    type_ = rosglass.load("sensor_msgs/msg/PointCloud2")
    data = type_.encode(cloud.message(Time(12_500_000_000)), wire="cdr")
    return type_.decode(bytes(data), wire="cdr")


def points(cloud: Any) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Read places and colours as PCL's programs do."""
    fields = {f.name: f for f in cloud.fields}
    assert all(f.datatype == 7 and f.count == 1 for f in fields.values())
    names = ("x", "y", "z", "rgb")
    layout = np.dtype(
        {
            "names": names,
            "formats": ["<f4", "<f4", "<f4", "<u4"],
            "offsets": [fields[name].offset for name in names],
            "itemsize": cloud.point_step,
        }
    )
    rows = np.frombuffer(bytes(cloud.data), layout)
    rgb = rows["rgb"]
    colours = np.column_stack([rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255])
    return np.column_stack([rows[name] for name in names[:3]]), colours


def test_cloud_is_empty_before_anything_was_seen(cloud: Cloud) -> None:
    sent = message(cloud)
    assert (sent.width, sent.height, len(sent.data)) == (0, 1, 0)


def test_its_layout_is_consistent(cloud: Cloud) -> None:
    look(cloud, -3.6, -1.8)
    sent = message(cloud)
    assert sent.header.frame_id == "map"
    assert sent.header.stamp.sec == 12
    assert sent.width > 100
    assert sent.row_step == sent.width * sent.point_step == len(sent.data)
    assert not sent.is_bigendian
    places, _ = points(sent)
    assert np.isfinite(places).all()
    assert np.abs(places[:, 0]).max() <= WORLD.half_length + 0.5
    assert places[:, 2].min() >= -0.01
    assert places[:, 2].max() < 4


def test_visible_points_are_added_and_kept(cloud: Cloud) -> None:
    assert look(cloud, -3.6, -1.8)
    assert not look(cloud, -3.6, -1.8), "nothing is new"
    first = {tuple(place) for place in points(message(cloud))[0].tolist()}
    assert all(math.dist(place[:2], (-3.6, -1.8)) < 5.5 for place in first)
    look(cloud, 3.0, 2.0)
    second = {tuple(place) for place in points(message(cloud))[0].tolist()}
    assert first < second


def test_nothing_is_seen_through_walls(cloud: Cloud) -> None:
    """The brick wall east of the dock hides the ground behind it."""
    look(cloud, -3.0, -3.2)
    places, _ = points(message(cloud))
    ranges = LaserScanner(WORLD, noise=0.0).scan(-3.0, -3.2, 0.0, 0.0)
    beams = np.arctan2(places[:, 1] + 3.2, places[:, 0] + 3.0) - LaserScanner.angle_min
    beams = np.rint(beams % math.tau / LaserScanner.angle_increment).astype(int)
    met = ranges[beams % LaserScanner.beams]
    assert (np.hypot(places[:, 0] + 3.0, places[:, 1] + 3.2) <= met + 0.36).all()
    assert met.min() < 1.5


def test_things_have_their_colours(cloud: Cloud) -> None:
    for x, y in ((-3.6, -1.8), (0.0, 0.0), (3.0, 2.0), (-2.0, 2.5), (3.0, -2.0)):
        look(cloud, x, y)
    places, colours = points(message(cloud))
    red, green, blue = (colours[:, k].astype(int) for k in range(3))
    assert ((red > 120) & (red > 2 * green) & (red > 2 * blue)).sum() > 20, "the red barrel"
    assert ((blue > 90) & (blue > 2 * red)).sum() > 20, "the blue barrel"
    concrete = (places[:, 2] > 0.3) & (np.ptp(colours, axis=1) < 25)
    assert concrete.sum() > 500, "the grey walls"


def test_bare_ground_is_left_to_the_map(cloud: Cloud) -> None:
    look(cloud, -3.6, -1.8)
    places, colours = points(message(cloud))
    flat = places[:, 2] < 0.01
    assert flat.any(), "markings are included"
    assert (np.ptp(colours[flat], axis=1) > 10).all()
