"""Questions about the tree."""

from __future__ import annotations

import pytest

from rosglass.comm import Time
from rosglass.errors import ConnectivityException, LookupException
from rosglass.tf import FrameInfo, Transform, TransformBuffer


@pytest.fixture
def buffer() -> TransformBuffer:
    made = TransformBuffer()
    for child, parent, static in (
        ("odom", "map", False),
        ("base", "odom", False),
        ("camera", "base", True),
        ("arm", "base", False),
        ("other", "far", False),
    ):
        for second in (1, 2, 3):
            stamp = Time.from_parts(second, 0)
            given = Transform(stamp=stamp, frame_id=parent, child_frame_id=child)
            made.set_transform(given, f"/{child}_node", static=static)
    return made


def test_frame(buffer: TransformBuffer) -> None:
    one, three = Time.from_parts(1, 0), Time.from_parts(3, 0)
    base = buffer.frame("base")
    assert base == FrameInfo("base", "odom", "/base_node", False, three, one, 3)
    assert base is not None
    assert base.rate == 1.0
    assert base.age(Time.from_parts(5, 0)).seconds == 2.0  # type: ignore[union-attr]
    assert buffer.frame("camera") == FrameInfo(
        "camera", "base", "/camera_node", True, three, three, 1
    )
    assert buffer.frame("map") == FrameInfo("map")
    assert FrameInfo("map").age(three) is None
    assert buffer.frame("never") is None
    assert buffer.has_frame("map")
    assert not buffer.has_frame("never")


def test_rate_falls_to_zero_when_nothing_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    for module in ("buffer", "frames"):
        monkeypatch.setattr(f"rosglass.tf.{module}.monotonic", lambda: clock[0])
    buffer = TransformBuffer()
    for n in range(50):
        stamp = Time.from_parts(1, n * 20_000_000)
        buffer.set_transform(Transform(stamp=stamp, frame_id="map", child_frame_id="base"), "/b")
        clock[0] += 0.02

    def rate() -> float:
        frame = buffer.frame("base")
        assert frame is not None
        return frame.rate

    assert rate() == pytest.approx(50)
    clock[0] += 1.0
    assert 0 < rate() < 50
    clock[0] += 3.0
    assert rate() == 0, "a rate that stays is old data dressed as live"
    assert buffer.tree()["base"].rate == 0


def test_tree(buffer: TransformBuffer) -> None:
    tree = buffer.tree()
    assert sorted(tree) == ["arm", "base", "camera", "far", "map", "odom", "other"]
    assert tree.roots() == ["map", "far"]
    assert sorted(tree.children("base")) == ["arm", "camera"]
    assert tree.ancestors("arm") == ["base", "odom", "map"]
    assert tree.chain("camera", "arm") == ["arm", "base", "camera"]
    assert tree.chain("map", "base") == ["base", "odom", "map"]
    assert tree.chain("base", "map") == ["map", "odom", "base"]
    assert tree.chain("map", "map") == ["map"]
    with pytest.raises(ConnectivityException, match="'far'"):
        tree.chain("map", "other")
    with pytest.raises(LookupException, match="never"):
        tree.chain("map", "never")


def test_yaml_of_nothing_and_of_hostile_names() -> None:
    import yaml

    buffer = TransformBuffer()
    assert yaml.safe_load(buffer.tree().to_yaml()) == {}
    given = Transform(stamp=Time(1), frame_id="it's\n", child_frame_id="a: b\n- c")
    buffer.set_transform(given)
    found = yaml.safe_load(buffer.tree().to_yaml(Time.from_parts(2, 1)))
    assert list(found) == ["a: b\n- c"]
    assert found["a: b\n- c"]["parent"] == "it's\n"
    assert found["a: b\n- c"]["broadcaster"] == "no recorded authority"
    assert found["a: b\n- c"]["transform_delay"] == 2.0
