"""Arrays of messages behave as lists, and decode as little as they can."""

from __future__ import annotations

import pickle
import struct

import numpy as np
import pytest

from rosglass import DecodeError, UnsupportedError
from rosglass.messages import MessageSequence, MessageType, load

CLOUD = load("sensor_msgs/msg/PointCloud")
PATH = load("nav_msgs/msg/Path")


def cloud(count: int = 30) -> bytes:
    return CLOUD.encode(points=[{"x": i, "y": 2 * i, "z": -i} for i in range(count)])


def way(count: int = 30) -> bytes:
    return PATH.encode(poses=[{"header": {"frame_id": f"p{i}"}} for i in range(count)])


def test_elements_are_found_one_by_one() -> None:
    for data, kind, field in ((cloud(), CLOUD, "points"), (way(), PATH, "poses")):
        elements = getattr(kind.decode(data), field)
        assert isinstance(elements, MessageSequence)
        assert len(elements) == 30
        assert elements[7] is elements[7]
        assert elements[-1] is elements[29]
        third = elements[3]
        listed = list(elements)
        assert listed[3] is third
        assert elements[3] is third
        for index in (30, -31):
            with pytest.raises(IndexError):
                elements[index]


def test_written_element_survives_the_rest_being_decoded() -> None:
    message = PATH.decode(way())
    message.poses[5].header.frame_id = "five"
    assert [pose.header.frame_id for pose in message.poses][4:7] == ["p4", "five", "p6"]


def test_sequences_are_lists() -> None:
    point = load("geometry_msgs/msg/Point32")
    message = CLOUD.decode(cloud(3))
    points = message.points
    points.append(point.create(x=9.0))
    points.insert(0, point.create(x=-9.0))
    del points[1]
    points[1] = point.create(x=5.0)
    points += [point.create(x=7.0)]
    assert [p.x for p in points] == [-9.0, 5.0, 2.0, 9.0, 7.0]
    assert [p.x for p in points[1:3]] == [5.0, 2.0]
    assert [p.x for p in reversed(points)] == [7.0, 9.0, 2.0, 5.0, -9.0]
    assert len(points + [point.create()]) == 6  # noqa: RUF005 - the operator is under test
    again = CLOUD.decode(CLOUD.encode(message)).points
    assert again == points
    assert again == list(points)
    assert again != [*points, point.create()]
    assert repr(again) == repr(list(points))
    assert pickle.loads(pickle.dumps(again)) == points


def test_elements_of_another_type_are_refused() -> None:
    message = CLOUD.decode(cloud(3))
    message.points[1] = load("geometry_msgs/msg/Point").create()
    with pytest.raises(Exception, match=r"points\[1\]: expected a geometry_msgs/msg/Point32"):
        CLOUD.encode(message)
    message.points[1] = {"x": 4.0}
    assert CLOUD.decode(CLOUD.encode(message)).points[1].x == 4.0


def test_array_is_one_numpy_view() -> None:
    data = cloud()
    points = CLOUD.decode(data).points
    array = points.array
    assert np.shares_memory(array, np.frombuffer(data, np.uint8))
    assert array["y"].tolist() == [2.0 * i for i in range(30)]
    points[2].x = 77.0
    assert points.array["x"][2] == 77.0
    odometry = load("geometry_msgs/msg/PoseArray")
    poses = odometry.decode(odometry.encode(poses=[{"position": {"z": 3.0}}] * 20)).poses
    assert poses.array["position"]["z"].tolist() == [3.0] * 20
    with pytest.raises(UnsupportedError, match="constant size"):
        _ = PATH.decode(way()).poses.array


def test_array_follows_padding_between_elements() -> None:
    text = "t/Odd[] odd\n" + "=" * 80 + "\nMSG: t/Odd\nfloat64 a\nuint8 b"
    kind = MessageType.from_text("t/msg/Odds", text)
    values = [{"a": float(i), "b": i} for i in range(20)]
    data = kind.encode(odd=values)
    # The count at 0, elements of 9 bytes every 16 from 8 on, nothing behind the last.
    assert len(data) == 4 + 8 + 19 * 16 + 9
    assert struct.unpack_from("<dB", data, 4 + 8 + 16) == (1.0, 1)
    odd = kind.decode(data).odd
    assert odd.array["b"].tolist() == list(range(20))
    assert odd.array["a"].tolist() == [float(i) for i in range(20)]
    assert [element.b for element in odd] == list(range(20))
    assert kind.path("odd[*].b")(data).tolist() == list(range(20))
    assert kind.path("odd[-1].a")(data) == 19.0


def test_damage_shows_when_it_is_reached() -> None:
    data = way()
    broken = data[:-20]
    poses = PATH.decode(broken).poses
    assert poses[0].header.frame_id == "p0"
    with pytest.raises(DecodeError) as caught:
        list(poses)
    assert caught.value.offset > 0
    with pytest.raises(DecodeError):
        _ = poses[29].pose.orientation.w
