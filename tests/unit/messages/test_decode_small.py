"""Many small messages of ROS 1, decoded at once."""

from __future__ import annotations

import pytest

import rosglass


@pytest.fixture
def point():
    return rosglass.load("geometry_msgs/PointStamped", ros=1)


def some(point, count=5):
    fields = [{"header": {"frame_id": f"camera{n}"}, "point": {"x": n + 0.5}} for n in range(count)]
    return [point.encode(one) for one in fields]


def test_messages_come_decoded_and_in_order(point):
    data = some(point)
    messages = point.decode_small(data)
    assert [one.point.x for one in messages] == [0.5, 1.5, 2.5, 3.5, 4.5]
    assert [one.header.frame_id for one in messages] == [f"camera{n}" for n in range(5)]
    assert messages == [point.decode(one) for one in data]
    assert [point.encode(one) for one in messages] == data


def test_message_may_be_changed_and_the_others_stay(point):
    first, second = point.decode_small(some(point, 2))
    first.point.x = 9.0
    assert (first.point.x, second.point.x) == (9.0, 1.5)


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda _: b""], ids=["cut", "empty"])
@pytest.mark.parametrize("place", [0, 2, 4])
def test_damage_is_reported_when_fields_are_read(point, place, damage):
    data = some(point)
    data[place] = damage(data[place])
    assert point.decode_small(data) is None
    with pytest.raises(rosglass.DecodeError):
        _ = point.decode(data[place]).point.x


def test_big_messages_are_decoded_one_by_one():
    text = rosglass.load("std_msgs/String", ros=1)
    small, big = ([text.encode({"data": "x" * size})] * 2 for size in (1000, 1100))
    assert [one.data for one in text.decode_small(small)] == ["x" * 1000] * 2
    assert text.decode_small(big) is None


@pytest.mark.parametrize("name", ["sensor_msgs/Imu", "nav_msgs/Odometry"])
def test_types_with_many_fields_are_decoded_one_by_one(name):
    kind = rosglass.load(name, ros=1)
    assert kind.decode_small([kind.encode({})] * 2) is None


def test_messages_of_ros_2_are_decoded_one_by_one():
    kind = rosglass.load("std_msgs/msg/String")
    assert kind.decode_small([kind.encode({"data": "a"})] * 2) is None
