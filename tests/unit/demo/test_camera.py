"""The rendered camera image, its burnt-in clock and its frame code."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the simulated camera needs the extra `camera`")

from rosglass.demo import framecode
from rosglass.demo.camera import CODE_POSITION, HEIGHT, WIDTH, Camera
from rosglass.demo.simulation import RobotState, Simulation
from rosglass.demo.world import World

NOW = 1_790_000_000_123_456_789


@pytest.fixture(scope="module")
def camera() -> Camera:
    return Camera(World.standard())


def state_at(x: float, y: float, yaw: float, **fields: object) -> RobotState:
    return Simulation(state=RobotState(x=x, y=y, yaw=yaw, **fields)).state  # type: ignore[arg-type]


def test_every_pixel_of_every_view_is_drawn(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(2)
    for _ in range(25):
        state = state_at(random.uniform(-6, 6), random.uniform(-4, 4), random.uniform(-3, 3))
        state = replace(state, roll=random.uniform(-0.2, 0.2), pitch=random.uniform(-0.3, 0.3))
        pictures = []
        for filling in (0, 255):
            with monkeypatch.context() as patch:
                # What is left of the memory's former content shows as a difference.
                patch.setattr(np, "empty", lambda size, dtype: np.full(size, filling, dtype))  # noqa: B023
                pictures.append(camera.render(state))
        assert (pictures[0].shape, pictures[0].dtype) == ((HEIGHT, WIDTH, 3), np.uint8)
        assert np.array_equal(*pictures), state


def test_images_do_not_share_memory(camera: Camera) -> None:
    state = state_at(-5.4, -3.2, 0.5)
    assert not np.shares_memory(camera.render(state), camera.render(state))


def test_sky_is_above_and_floor_below(camera: Camera) -> None:
    picture = camera.render(state_at(-5.4, -3.2, 0.55)).astype(int)
    sky = picture[:80].mean(axis=(0, 1))
    floor = picture[300:380, 280:360].mean(axis=(0, 1))
    assert sky[2] > sky[0] + 15, "blue"
    assert abs(floor[2] - floor[0]) < 25, "grey"


def test_image_follows_the_robot_and_the_carrier(camera: Camera) -> None:
    state = state_at(-5.4, -3.2, 0.55)
    start = camera.render(state)
    assert (camera.render(replace(state, yaw=0.6)) != start).mean() > 0.2
    moved = (camera.render(replace(state, carrier_phase=9.0)) != start).mean()
    assert 0 < moved < 0.2, "only the carrier moved"


def test_flashlight_lights_what_is_ahead(camera: Camera) -> None:
    state = state_at(-5.4, -3.2, 0.55)
    dark = camera.render(state)[240:400, 220:420].mean()
    assert camera.render(replace(state, flashlight=True))[240:400, 220:420].mean() > 1.2 * dark


def test_flippers_reach_into_the_image(camera: Camera) -> None:
    state = state_at(-5.4, -3.2, 0.55)
    up = camera.render(replace(state, flippers=(1.2, 1.2, 0.0, 0.0)))
    down = camera.render(replace(state, flippers=(-1.2, -1.2, 0.0, 0.0)))
    assert (up != down).mean() > 0.05


def test_rendering_is_cheap(camera: Camera) -> None:
    state = state_at(-5.4, -3.2, 0.55)
    camera.render(state)
    costs = []
    for _ in range(15):
        start = time.thread_time()
        camera.stamp(camera.render(state), NOW, 1)
        costs.append(time.thread_time() - start)
    # 5 ms where it was written; the limit leaves room for slow and busy test machines.
    assert min(costs) < 0.020


def test_frame_code_can_be_read_back_from_the_image(camera: Camera) -> None:
    picture = camera.render(state_at(-5.4, -3.2, 0.55))
    camera.stamp(picture, NOW, 70_000)
    x, y = CODE_POSITION
    row = picture[y + 4, x : x + framecode.BITS * framecode.SQUARE, 1]
    code = framecode.read(row)
    assert code == framecode.FrameCode.at(NOW, 70_000)
    assert code.number == 70_000 % 65536
    assert code.age(NOW + 25_000_000) == pytest.approx(0.025, abs=2e-5)


@pytest.mark.parametrize("scale", [0.25, 0.7, 1.5, 2.0])
def test_frame_code_survives_scaling(scale: float) -> None:
    picture = np.zeros((framecode.SQUARE, framecode.BITS * framecode.SQUARE, 3), np.uint8)
    framecode.draw(picture, framecode.FrameCode.at(NOW, 5), 0, 0)
    columns = ((np.arange(int(picture.shape[1] * scale)) + 0.5) / scale).astype(int)
    assert framecode.read(picture[4, columns, 0]).number == 5


def test_disturbed_frame_code_is_refused() -> None:
    picture = np.zeros((framecode.SQUARE, framecode.BITS * framecode.SQUARE, 3), np.uint8)
    framecode.draw(picture, framecode.FrameCode.at(NOW, 5), 0, 0)
    row = picture[4, :, 0].copy()
    row[80:160] = 255 - row[80:160]
    with pytest.raises(framecode.FrameCodeError, match="checksum"):
        framecode.read(row)
    with pytest.raises(framecode.FrameCodeError, match="at least"):
        framecode.read(row[:20])


def test_clock_is_burnt_in(camera: Camera) -> None:
    a, b = (camera.render(state_at(-5.4, -3.2, 0.55)) for _ in range(2))
    camera.stamp(a, NOW, 1)
    camera.stamp(b, NOW + 1_000_000_000, 1)
    changed = np.argwhere((a != b).any(axis=2))
    assert (changed[:, 0] >= HEIGHT - 26).all(), "only the strip at the lower edge"
    assert (changed[:, 1] < 140).any(), "the digits of the clock"
