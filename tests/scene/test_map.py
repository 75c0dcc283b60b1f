"""The displays Map and GridCells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import endpoint_of

from rosglass.images.grid_colors import grid_colors

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import SceneBench


def grid(width: int, height: int, value: int, /, **info: Any) -> dict[str, Any]:
    about = {"resolution": 1.0, "width": width, "height": height}
    origin = {"position": {"x": -width / 2, "y": -height / 2}, "orientation": {"w": 1.0}}
    return {
        "header": {"frame_id": "map"},
        "info": {**about, "origin": origin, **info},
        "data": np.full(width * height, value, np.int8),
    }


@pytest.fixture
def show(bench: SceneBench) -> Callable[..., Any]:
    """Publishes maps and updates, and returns the display once it has received them."""
    display = bench.show('view: "TopDownOrtho"; MapDisplay { topic: "/map"; alpha: 1 }')
    publishers = {
        "/map": bench.publisher("/map", "nav_msgs/OccupancyGrid"),
        "/map_updates": bench.publisher("/map_updates", "map_msgs/OccupancyGridUpdate"),
    }
    return lambda message, topic="/map": bench.send(publishers[topic], message, display)


def test_a_map_is_drawn_in_rviz_colors(bench: SceneBench, show: Callable[..., Any]) -> None:
    display = show(grid(20, 10, 100))
    assert display.statusLevel == "ok", display.statusText
    assert (display.columns, display.rows, display.resolution) == (20, 10, 1.0)
    assert bench.pixel(205, 155) == (0, 0, 0)
    display.colorScheme = "costmap"
    assert bench.pixel(205, 155) == (255, 0, 255)
    show(grid(20, 10, -1))
    assert bench.pixel(205, 155) == (0x70, 0x89, 0x86)


PART = {"header": {"frame_id": "map"}, "x": 10, "y": 4, "width": 2, "height": 2}


def test_updates_come_from_any_publisher_whatever_the_policies_of_the_map(
    bench: SceneBench,
) -> None:
    from rosglass.comm.qos import QoS, Reliability

    # As in Nav2's config of RViz.
    display = bench.show(
        'MapDisplay { topic: "/map"; durability: "Transient Local"; reliability: "Reliable" }'
    )
    bench.latch("/map", "nav_msgs/OccupancyGrid", grid(20, 10, 0))
    updates = bench.robot.create_publisher(
        "/map_updates",
        "map_msgs/OccupancyGridUpdate",
        QoS(reliability=Reliability.BEST_EFFORT),
    )
    bench.wait(lambda: display.cells is not None)
    part = {**PART, "data": np.full(4, 100, np.int8)}
    bench.wait(lambda: updates.publish(part) or bool((display.cells == 100).any()))
    assert display.statusLevel == "ok", display.statusText


def test_an_update_that_is_older_than_the_map_is_not_used(bench: SceneBench) -> None:
    from rosglass.comm.qos import QoS

    latched = QoS.latched()
    updates = bench.robot.create_publisher("/map_updates", "map_msgs/OccupancyGridUpdate", latched)
    updates.publish({**PART, "data": np.full(4, 100, np.int8)})
    bench.robot.create_publisher("/map", "nav_msgs/OccupancyGrid", latched).publish(grid(20, 10, 0))
    display = bench.show('MapDisplay { topic: "/map" }')
    bench.wait(lambda: display.cells is not None)
    bench.wait.settled(bench.session)
    assert not display.cells.any()
    assert display.statusLevel == "ok", display.statusText
    updates.publish({**PART, "data": np.full(4, 100, np.int8)})
    bench.wait(lambda: bool(display.cells.any()))


def test_updates_follow_the_topic_of_the_map(bench: SceneBench) -> None:
    view = bench.load()
    display = view.scene.add("Map")
    # As RViz 2 writes it.
    saved = {
        "Topic": {"Value": "/map"},
        "Update Topic": {"Depth": 5, "Durability Policy": "Volatile", "Value": "/map_updates"},
    }
    assert display.load_settings(saved) == []
    display.topic = "/costmap"
    bench.wait(lambda: endpoint_of(display) is not None)
    bench.publisher("/costmap_updates", "map_msgs/OccupancyGridUpdate")
    kept = display.save_settings(saved)["Update Topic"]
    assert kept == {"Depth": 5, "Durability Policy": "Volatile", "Value": "/costmap_updates"}
    assert display.save_settings()["Update Topic"] == "/costmap_updates"
    display.load_settings({**saved, "Update Topic": {"Value": "/changes"}})
    display.topic = "/costmap"
    assert display.save_settings(saved)["Update Topic"]["Value"] == "/changes"


def test_an_update_changes_a_part(bench: SceneBench, show: Callable[..., Any]) -> None:
    show(grid(20, 10, 0))
    assert bench.pixel(205, 155) == (255, 255, 255)
    display = show({**PART, "data": np.full(4, 100, np.int8)}, "/map_updates")
    assert display.statusLevel == "ok", display.statusText
    assert display.cells[4:6, 10:12].tolist() == [[100, 100], [100, 100]]
    assert int((display.cells == 100).sum()) == 4
    display = show({**PART, "x": 19, "data": np.full(4, 100, np.int8)}, "/map_updates")
    assert "x 19, y 4, 2 x 2 cells: beyond the map of 20 x 10 cells" in display.statusText
    assert int((display.cells == 100).sum()) == 4


def test_palettes_have_the_colors_of_rviz() -> None:
    colors = grid_colors("map")
    assert colors[(0, 50, 100), :].tolist() == [[255] * 4, [128, 128, 128, 255], [0, 0, 0, 255]]
    assert colors[(110, 128, 254), :].tolist() == [
        [0, 255, 0, 255],
        [255, 0, 0, 255],
        [255, 255, 0, 255],
    ]
    colors = grid_colors("costmap")
    assert colors[(0, 50, 99), :].tolist() == [
        [0, 0, 0, 0],
        [127, 0, 128, 255],
        [0, 255, 255, 255],
    ]
    assert grid_colors("raw")[7].tolist() == [7, 7, 7, 255]


def test_cells_are_squares(bench: SceneBench) -> None:
    display = bench.show(
        'view: "TopDownOrtho"; GridCellsDisplay { topic: "/cells"; color: "#00ffff" }'
    )
    publisher = bench.publisher("/cells", "nav_msgs/GridCells")
    cell = {"header": {"frame_id": "map"}, "cell_width": 2.0, "cell_height": 2.0}
    bench.send(publisher, {**cell, "cells": [{"x": 0.0, "y": 0.0, "z": 0.0}]}, display)
    picture = bench.picture()
    cyan = (picture == (0, 255, 255)).all(axis=2).sum()
    assert 300 <= cyan <= 500, cyan  # 2 m by 2 m, at 10 pixels for a metre
