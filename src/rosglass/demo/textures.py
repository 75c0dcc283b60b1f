"""The textures of the simulated world, painted when the robot starts, without image files."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

import cv2
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from rosglass.demo.world import World

    Picture = npt.NDArray[np.uint8]
    Color = tuple[int, int, int]
    Locator = Callable[[float, float], tuple[int, int]]

__all__ = ["PIXELS_PER_METRE", "SUN", "TILED", "ground", "panorama", "sides"]

#: Resolution of side textures that repeat along a wall.
PIXELS_PER_METRE = 220
#: Textures that keep their scale instead of being stretched over a face.
TILED = frozenset({"panel", "brick", "hazard", "container"})
#: Direction towards the sun; a low evening sun in the south-west.
SUN = (-0.62, -0.55, 0.56)
_GROUND_SCALE = 96
_CRATE: Color = (176, 128, 74)


def _noise(
    random: np.random.Generator,
    height: int,
    width: int,
    sizes: Sequence[int],
    stretch: int = 1,
) -> npt.NDArray[np.float32]:
    """Return smooth noise, mean 0, about -1 to 1, whose right end continues at its left.

    Args:
        random: Random number generator.
        height: Pixels.
        width: Pixels.
        sizes: Feature heights in pixels.
        stretch: How much wider than high the features are.
    """
    total = np.zeros((height, width), np.float32)
    for size in sizes:
        columns = max(2, width // (size * stretch))
        coarse = random.standard_normal((height // size + 2, columns)).astype(np.float32)
        tripled = np.concatenate([coarse] * 3, axis=1)
        smooth = cv2.resize(tripled, (3 * width, height), interpolation=cv2.INTER_CUBIC)
        total += smooth[:, width : 2 * width]
    total /= 2 * len(sizes)
    return total


def _tinted(base: Sequence[int], noise: npt.NDArray[np.float32], strength: float) -> Picture:
    color = np.array(base, np.float32)
    return cast("Picture", np.clip(color + noise[..., None] * strength, 0, 255).astype(np.uint8))


def _darken_foot(picture: Picture, reach: float) -> None:
    """Darken the lower edge, where little light gets between a wall and the ground."""
    rows = picture.shape[0]
    depth = np.clip((np.arange(rows) - rows * (1 - reach)) / (rows * reach), 0, 1)
    gain = (1 - 0.45 * depth**2)[:, None, None]
    picture[:] = (picture * gain).astype(np.uint8)


def _panel(random: np.random.Generator, width: int, height: int) -> Picture:
    picture = _tinted((152, 156, 160), _noise(random, height, width, (3, 24, 90)), 26)
    cv2.rectangle(picture, (2, 2), (width - 3, height - 3), (112, 116, 122), 3)
    for y in (30, height - 30):
        for x in (28, width - 28):
            cv2.circle(picture, (x, y), 5, (96, 100, 106), -1, cv2.LINE_AA)
    stripe = round(height * 0.36)
    cv2.rectangle(picture, (0, stripe), (width, stripe + 26), (206, 96, 44), -1)
    cv2.rectangle(picture, (0, stripe + 26), (width, stripe + 32), (236, 232, 220), -1)
    _darken_foot(picture, 0.3)
    return picture


def _brick(random: np.random.Generator, width: int, height: int) -> Picture:
    picture = _tinted((150, 142, 132), _noise(random, height, width, (2, 12)), 18)
    brick_height, brick_length = 20, 55
    for row, y in enumerate(range(0, height, brick_height)):
        shift = (row % 2) * brick_length // 2
        for x in range(-shift, width, brick_length):
            tint = int(random.integers(-22, 22))
            color = (158 + tint, 78 + tint // 2, 58 + tint // 2)
            cv2.rectangle(
                picture, (x + 2, y + 2), (x + brick_length - 2, y + brick_height - 2), color, -1
            )
    grain = _noise(random, height, width, (2, 40))[..., None] * 16
    bricks: Picture = np.clip(picture + grain, 0, 255).astype(np.uint8)
    _darken_foot(bricks, 0.3)
    return bricks


def _crate(random: np.random.Generator, size: int) -> Picture:
    picture = np.empty((size, size, 3), np.uint8)
    plank = size // 6
    for i, x in enumerate(range(0, size, plank)):
        part = picture[:, x : x + plank]
        grain = np.repeat(_noise(random, 8, part.shape[1], (2, 5)), math.ceil(size / 8), axis=0)
        shade = -12 if i % 2 else 6
        part[:] = _tinted(tuple(c + shade for c in _CRATE), grain[:size], 34)
        cv2.line(picture, (x, 0), (x, size), (74, 50, 26), 2)
    frame: Color = (146, 102, 56)
    edge: Color = (84, 56, 30)
    border = size // 8
    diagonal = np.array(
        [
            [0, size - border],
            [0, size],
            [border, size],
            [size, border],
            [size, 0],
            [size - border, 0],
        ],
        np.int32,
    )
    cv2.fillPoly(picture, [diagonal], frame, cv2.LINE_AA)
    cv2.polylines(picture, [diagonal], True, edge, 2, cv2.LINE_AA)
    far = size - border
    for start, end in (
        ((0, 0), (border, size)),
        ((far, 0), (size, size)),
        ((0, 0), (size, border)),
        ((0, far), (size, size)),
    ):
        cv2.rectangle(picture, start, end, frame, -1)
    for line in (border, far):
        cv2.line(picture, (0, line), (size, line), edge, 2)
    cv2.rectangle(picture, (1, 1), (size - 2, size - 2), edge, 3)
    for x in (border // 2, size - border // 2):
        for y in (border // 2, size - border // 2):
            cv2.circle(picture, (x, y), 4, (60, 44, 28), -1, cv2.LINE_AA)
    return picture


def _hazard(width: int, height: int) -> Picture:
    y, x = np.mgrid[0:height, 0:width]
    stripes = ((x + y) // 44) % 2 == 0
    picture = np.where(stripes[..., None], (238, 190, 34), (36, 36, 38)).astype(np.uint8)
    return cv2.GaussianBlur(picture, (3, 3), 0).astype(np.uint8)


def _barrel(random: np.random.Generator, base: Color, size: int) -> Picture:
    picture = _tinted(base, _noise(random, size * 2, size, (3, 30)), 18)
    dark = (base[0] * 6 // 10, base[1] * 6 // 10, base[2] * 6 // 10)
    for y in (size * 2 // 3, size * 4 // 3):
        cv2.rectangle(picture, (0, y - 7), (size, y + 7), dark, -1)
        cv2.line(picture, (0, y - 7), (size, y - 7), tuple(min(255, c + 46) for c in base), 3)
    _darken_foot(picture, 0.25)
    return picture


def _container(random: np.random.Generator, width: int, height: int) -> Picture:
    x = np.arange(width)
    ribs = (np.sin(2 * math.pi * x / 37) * 20).astype(np.float32)
    noise = _noise(random, height, width, (3, 50)) * 18 + ribs[None, :]
    picture = _tinted((38, 104, 112), noise, 1.0)
    cv2.rectangle(picture, (0, 0), (width, 12), (26, 74, 80), -1)
    cv2.rectangle(picture, (0, height - 16), (width, height), (26, 74, 80), -1)
    _darken_foot(picture, 0.2)
    return picture


def _carrier(size: int) -> Picture:
    picture = np.full((size, size, 3), (232, 236, 240), np.uint8)
    cv2.rectangle(picture, (0, size * 3 // 4), (size, size), (44, 48, 54), -1)
    cv2.rectangle(picture, (0, size // 2), (size, size // 2 + size // 7), (0, 152, 170), -1)
    for x in (size // 4, size * 3 // 4):
        cv2.circle(picture, (x, size - size // 8), size // 9, (20, 20, 22), -1, cv2.LINE_AA)
        cv2.circle(picture, (x, size - size // 8), size // 20, (150, 152, 156), -1, cv2.LINE_AA)
    cv2.rectangle(picture, (2, 2), (size - 3, size // 6), (255, 140, 20), -1)
    return picture


def sides() -> dict[str, Picture]:
    """Return the texture of every kind of side and top face, RGB."""
    random = np.random.default_rng(3)
    width, height = round(1.2 * PIXELS_PER_METRE), round(1.7 * PIXELS_PER_METRE)
    concrete = _tinted((150, 148, 142), _noise(random, 128, 128, (2, 9, 40)), 26)
    textures = {
        "panel": _panel(random, width, height),
        "brick": _brick(random, width, height),
        "hazard": _hazard(width, height),
        "container": _container(random, width, height),
        "crate": _crate(random, 192),
        "concrete": concrete,
        "red barrel": _barrel(random, (182, 40, 34), 64),
        "blue barrel": _barrel(random, (32, 82, 158), 64),
        "yellow barrel": _barrel(random, (222, 168, 30), 64),
        "lid": _tinted((70, 72, 78), _noise(random, 64, 64, (2, 16)), 16),
        "carrier": _carrier(160),
        "carrier top": np.full((32, 32, 3), (206, 210, 216), np.uint8),
        "ramp": _tinted((126, 118, 104), _noise(random, 256, 256, (2, 10, 60)), 24),
        "track": np.full((16, 16, 3), (34, 36, 40), np.uint8),
    }
    ramp = textures["ramp"]
    for y in range(16, 256, 32):
        cv2.line(ramp, (0, y), (256, y), (96, 88, 76), 4)
    for x in (12, 244):
        cv2.line(ramp, (x, 0), (x, 256), (226, 186, 40), 6)
    return textures


def ground(world: World) -> tuple[Picture, float]:
    """Return the floor seen from above (north up, RGB) and its pixels per metre.

    Markings and the shadows of all fixed objects are painted in.
    """
    scale = _GROUND_SCALE
    width, height = round(2 * world.half_length * scale), round(2 * world.half_width * scale)
    random = np.random.default_rng(5)

    def at(x: float, y: float) -> tuple[int, int]:
        return round((x + world.half_length) * scale), round((world.half_width - y) * scale)

    picture = _tinted((124, 120, 114), _noise(random, height, width, (2, 7, 40, 200)), 30)
    slab = 2.0
    for k in range(-3, 4):
        cv2.line(picture, at(k * slab, -9), at(k * slab, 9), (92, 89, 85), 2, cv2.LINE_AA)
        cv2.line(picture, at(-9, k * slab), at(9, k * slab), (92, 89, 85), 2, cv2.LINE_AA)
    _rubble(picture, world, random, at, scale)
    white: Color = (214, 212, 204)
    for k in range(16):
        y = -4.4 + 0.55 * k
        cv2.line(picture, at(0.1, y), at(0.1, y + 0.3), white, 5, cv2.LINE_AA)
        cv2.line(picture, at(1.0, y), at(1.0, y + 0.3), white, 5, cv2.LINE_AA)
    _dock(picture, world, at)
    _arrow(picture, world, at)
    _shadows(picture, world, at, scale)
    return picture, float(scale)


def _rubble(
    picture: Picture, world: World, random: np.random.Generator, at: Locator, scale: int
) -> None:
    rough = world.rough
    for _ in range(520):
        angle = random.uniform(0, 2 * math.pi)
        far = rough.radius * math.sqrt(random.uniform(0, 1)) * 0.97
        spot = at(rough.centre[0] + far * math.cos(angle), rough.centre[1] + far * math.sin(angle))
        size = int(random.integers(2, 9))
        tint = int(random.integers(-26, 40))
        axes = (size, max(1, size * 2 // 3))
        turn = float(random.uniform(0, 180))
        shifted = (spot[0] + 2, spot[1] - 2)
        cv2.ellipse(picture, shifted, axes, turn, 0, 360, (58, 54, 50), -1, cv2.LINE_AA)
        color = (128 + tint, 112 + tint, 94 + tint)
        cv2.ellipse(picture, spot, axes, turn, 0, 360, color, -1, cv2.LINE_AA)
    centre = at(*rough.centre)
    cv2.circle(picture, centre, round(rough.radius * scale), (226, 186, 40), 3, cv2.LINE_AA)


def _dock(picture: Picture, world: World, at: Locator) -> None:
    x, y = world.dock
    cv2.rectangle(picture, at(x - 0.6, y + 0.6), at(x + 0.6, y - 0.6), (42, 150, 96), -1)
    cv2.rectangle(picture, at(x - 0.6, y + 0.6), at(x + 0.6, y - 0.6), (226, 240, 230), 4)
    bolt = [(0.05, 0.4), (-0.22, -0.05), (-0.02, -0.05), (-0.08, -0.4), (0.22, 0.08), (0.02, 0.08)]
    points = np.array([at(x + dx, y + dy) for dx, dy in bolt], np.int32)
    cv2.fillPoly(picture, [points], (240, 244, 230), cv2.LINE_AA)


def _arrow(picture: Picture, world: World, at: Locator) -> None:
    tip, y = world.ramp.start - 0.35, world.ramp.y
    head = [(0, 0), (-0.45, 0.32), (-0.45, 0.12), (-1.1, 0.12), (-1.1, -0.12), (-0.45, -0.12)]
    head.append((-0.45, -0.32))
    points = np.array([at(tip + dx, y + dy) for dx, dy in head], np.int32)
    cv2.fillPoly(picture, [points], (214, 212, 204), cv2.LINE_AA)


def _shadows(picture: Picture, world: World, at: Locator, scale: int) -> None:
    light = np.full(picture.shape[:2], 255, np.uint8)
    for prism in world.prisms:
        reach = prism.top / SUN[2]
        shift = (-SUN[0] * reach, -SUN[1] * reach)
        points = [at(x, y) for x, y in prism.corners]
        points += [at(x + shift[0], y + shift[1]) for x, y in prism.corners]
        hull = cv2.convexHull(np.array(points, np.int32))
        cv2.fillConvexPoly(light, hull, 138, cv2.LINE_AA)
    light = cv2.GaussianBlur(light, (0, 0), scale * 0.03).astype(np.uint8)
    contact = np.full(picture.shape[:2], 255, np.uint8)
    for prism in world.prisms:
        outline = np.array([at(x, y) for x, y in prism.corners], np.int32)
        cv2.fillConvexPoly(contact, outline, 90)
    contact = cv2.GaussianBlur(contact, (0, 0), scale * 0.07).astype(np.uint8)
    gain = cv2.multiply(light, contact, scale=1 / 255)
    cv2.multiply(picture, cv2.merge([gain] * 3), picture, 1 / 255)


def panorama(pixels_per_radian: float) -> Picture:
    """Return the sky all around with the hills at its foot, RGB.

    Its columns run clockwise from east (so that they grow to the right on the screen); the last row
    lies 3 degrees below the horizon, and the right end repeats the first 100 degrees.
    """
    random = np.random.default_rng(11)
    width = round(2 * math.pi * pixels_per_radian)
    height = round(math.radians(48) * pixels_per_radian)
    horizon = height - round(math.radians(3) * pixels_per_radian)
    rows = np.clip(np.arange(height) / horizon, 0, 1)[:, None]
    top, low = np.array([62, 104, 158]), np.array([240, 206, 168])
    sky = (top + (low - top) * rows**1.7)[:, None, :] * np.ones((1, width, 1))
    clouds = _noise(random, height, width, (90, 44, 20, 9), stretch=3)
    cover = np.clip((clouds - 0.05) * 1.6, 0, 1)[..., None] * (0.3 + 0.5 * rows[:, None])
    sky = sky * (1 - cover) + np.array([252, 238, 224]) * cover
    columns = np.arange(width) / width * 2 * math.pi
    for depth, color in enumerate(((132, 140, 158), (104, 112, 128), (78, 88, 92))):
        angles = (
            0.055 * np.sin(columns * 3 + 2 * depth)
            + 0.035 * np.sin(columns * 7 + depth)
            + 0.012 * np.sin(columns * 23 + 5 * depth)
        )
        crest = horizon - (0.19 - 0.045 * depth + angles * (0.8 - 0.15 * depth)) * pixels_per_radian
        hill = np.arange(height)[:, None] > crest[None, :]
        sky[hill] = color
    picture = sky.astype(np.uint8)
    wrap = round(math.radians(100) * pixels_per_radian)
    return np.ascontiguousarray(np.concatenate([picture, picture[:, :wrap]], axis=1))
