"""The robot's camera: draws its view, 640x480, in a few milliseconds on one core.

Every surface is flat, so each is one perspective warp of its texture into the polygon it covers on
the screen, from far to near (painter's algorithm). OpenCV does the pixels and releases the
GIL, so the robot's other threads continue.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, cast

import cv2
import numpy as np

from rosglass.demo import framecode, textures
from rosglass.demo.scene import (
    FOCAL,
    HEIGHT,
    MOUNT,
    PIECE,
    PROJECT,
    WIDTH,
    Face,
    Surfaces,
    View,
    faces_of,
    from_body,
    outline_of,
    pose_of,
    ramp_faces,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from rosglass.demo.simulation import RobotState
    from rosglass.demo.world import World

    Floats = npt.NDArray[np.float64]
    Picture = npt.NDArray[np.uint8]

__all__ = ["CODE_POSITION", "HEIGHT", "MOUNT", "WIDTH", "Camera"]

#: Position of the frame code's first square in pixels.
CODE_POSITION = (WIDTH - framecode.BITS * framecode.SQUARE - 8, HEIGHT - framecode.SQUARE - 6)
_HAZE = np.array([222, 204, 184], np.float64)
#: Front edge, half width and height of the deck's surfaces, and their colour.
_DECK = (
    ((0.40, 0.21, 0.24), (38, 41, 47)),
    ((0.385, 0.195, 0.245), (58, 63, 72)),
    ((0.33, 0.07, 0.25), (214, 110, 34)),
)
#: Outline of a flipper, along and across it, from the upper side at the axle to the lower one.
_FLIPPER_OUTLINE = (np.array([0.0, 0.46, 0.46, 0.0]), np.array([0.085, 0.04, -0.03, -0.085]))


class Camera:
    """Renders images of a world.

    Args:
        world: The world to render.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._textures = textures.sides()
        self._shaded: dict[tuple[str, tuple[float, float], int, int], Picture] = {}
        self._ground, self._ground_scale = textures.ground(world)
        self._ground_far = cast("Picture", cv2.pyrDown(self._ground))
        self._panorama = textures.panorama(FOCAL)
        self._sky_horizon = self._panorama.shape[0] - round(math.radians(3) * FOCAL)
        surrounding = [p for p in world.prisms if max(map(abs, p.centre)) > world.half_width]
        standing = [p for p in world.prisms if p not in surrounding]
        self._walls = Surfaces([f for p in surrounding for f in faces_of(p, 3 * PIECE)])
        self._things = Surfaces([f for p in standing for f in faces_of(p)] + ramp_faces(world))
        self._beam = _beam()

    def render(self, state: RobotState, *, body: bool = True) -> Picture:
        """Return a new image (rows of RGB) of the view, with the robot itself if `body`."""
        image = np.empty((HEIGHT, WIDTH, 3), np.uint8)
        rotation, position = pose_of(state)
        self._draw_sky(image, state)
        self._draw_ground(image, rotation, position)
        for view in self._walls.views(rotation, position):
            self._draw(image, view)
        carrier = Surfaces(faces_of(self._world.carrier(state.carrier_phase)))
        things = self._things.views(rotation, position) + carrier.views(rotation, position)
        things.sort(key=lambda view: -view.distance)
        for view in things:
            self._draw(image, view)
        if body:
            self._draw_body(image, state)
        if state.flashlight:
            cv2.multiply(image, self._beam, image, 1 / 128)
        return image

    def stamp(self, image: Picture, nanoseconds: int, number: int) -> None:
        """Burn the clock and the frame code into the image.

        Args:
            image: The image.
            nanoseconds: System time to encode as the time of the image.
            number: The sequence number of the image.
        """
        seconds, rest = divmod(nanoseconds, 1_000_000_000)
        clock = time.strftime("%H:%M:%S", time.localtime(seconds)) + f".{rest // 1_000_000:03d}"
        strip = image[HEIGHT - 26 :]
        cv2.convertScaleAbs(strip, strip, 0.35)
        at = (8, HEIGHT - 8)
        cv2.putText(
            image, clock, at, cv2.FONT_HERSHEY_SIMPLEX, 0.55, (255, 240, 200), 1, cv2.LINE_AA
        )
        cv2.putText(
            image,
            f"{number % 100000:05d}",
            (144, HEIGHT - 8),
            cv2.FONT_HERSHEY_SIMPLEX,
            0.45,
            (160, 200, 210),
            1,
            cv2.LINE_AA,
        )
        framecode.draw(image, framecode.FrameCode.at(nanoseconds, number), *CODE_POSITION)

    def _draw_sky(self, image: Picture, state: RobotState) -> None:
        pitch = state.pitch + MOUNT[2]
        c, s = math.cos(state.roll), math.sin(state.roll)
        column = (-state.yaw % (2 * math.pi)) * FOCAL - math.radians(39) * FOCAL
        if column < 0:
            column += 2 * math.pi * FOCAL
        # Image -> panorama: rotate by the roll around the centre, then shift.
        offset_x = column + WIDTH / 2
        offset_y = self._sky_horizon + pitch * FOCAL
        cx, cy = WIDTH / 2, HEIGHT / 2
        matrix = np.array(
            [[c, -s, offset_x - c * cx + s * cy], [s, c, offset_y - s * cx - c * cy]], np.float64
        )
        rows = max(1, min(HEIGHT, round(HEIGHT / 2 - pitch * FOCAL + 0.08 * WIDTH)))
        cv2.warpAffine(
            self._panorama,
            matrix,
            (WIDTH, rows),
            image[:rows],
            cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
            cv2.BORDER_REPLICATE,
        )

    def _draw_ground(self, image: Picture, rotation: Floats, position: Floats) -> None:
        half_x, half_y = self._world.half_length, self._world.half_width
        origin = np.array([-half_x, half_y, 0.0])
        plane = np.column_stack(
            [PROJECT @ rotation @ v for v in ((1.0, 0, 0), (0, -1.0, 0), tuple(origin - position))]
        )
        inverse = np.linalg.inv(plane)
        up = rotation @ np.array([0.0, 0.0, 1.0])
        # The horizon: where the viewing ray is level.
        rows = [
            HEIGHT / 2 - FOCAL * (up[2] + up[0] * x / FOCAL) / min(up[1], -0.1)
            for x in (-WIDTH / 2, WIDTH / 2)
        ]
        top = int(max(0, min(HEIGHT, *rows)))
        if top >= HEIGHT:
            return
        # Near the horizon, a smaller texture avoids glitter; near the robot, half the resolution is
        # enough, as every texel covers several pixels.
        switch = min(HEIGHT, max(top, int(max(rows)) + 90))
        far, near = self._ground_scale / 2, self._ground_scale
        _warp(self._ground_far, np.diag([far, far, 1.0]) @ inverse, image, top, switch)
        if switch < HEIGHT:
            half = np.empty(((HEIGHT - switch + 1) // 2, WIDTH // 2, 3), np.uint8)
            to_texture = np.diag([near, near, 1.0]) @ inverse @ _shift(0, switch) @ _DOUBLE
            _warp(self._ground, to_texture, half, 0, half.shape[0])
            cv2.resize(half, (WIDTH, HEIGHT - switch), image[switch:])

    def _draw(self, image: Picture, view: View) -> None:
        x, y, width, height = cv2.boundingRect(view.outline)
        x0, y0 = max(0, x), max(0, y)
        x1, y1 = min(WIDTH, x + width), min(HEIGHT, y + height)
        if x1 - x0 < 2 or y1 - y0 < 2:
            return
        texture = self._texture(view.face, view.distance)
        rows, columns = texture.shape[:2]
        repeats = max(1.0, view.face.part[0])
        to_texture = view.inverse * np.array([[columns * repeats], [rows], [1.0]])
        to_texture[:, 2] += to_texture[:, 0] * x0 + to_texture[:, 1] * y0
        patch = cv2.warpPerspective(
            texture,
            to_texture,
            (x1 - x0, y1 - y0),
            flags=(cv2.INTER_LINEAR if view.distance < 6.0 else cv2.INTER_NEAREST)
            | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_WRAP if repeats > 1 else cv2.BORDER_REPLICATE,
        )
        mask = np.zeros(patch.shape[:2], np.uint8)
        cv2.fillConvexPoly(mask, view.outline - (x0, y0), 255)
        cv2.copyTo(patch, mask, image[y0:y1, x0:x1])

    def _texture(self, face: Face, distance: float) -> Picture:
        """Return the face's texture, lit, hazy and small enough for its distance."""
        haze = min(11, int(distance))
        level = 0 if distance < 1.6 else 1 if distance < 4.0 else 2 if distance < 9.0 else 3
        key = (face.texture, face.part, round(face.shade * 32), haze * 4 + level)
        found = self._shaded.get(key)
        if found is None:
            full = self._textures[face.texture]
            height, width = full.shape[:2]
            part = full[
                -max(8, round(face.part[1] * height)) :,
                : max(8, round(min(1.0, face.part[0]) * width)),
            ]
            for _ in range(level):
                part = cast("Picture", cv2.pyrDown(part))
            far = 0.22 * haze / 11
            mixed = part * (face.shade * (1 - far)) + _HAZE * far
            found = self._shaded[key] = np.clip(mixed, 0, 255).astype(np.uint8)
        return found

    def _draw_body(self, image: Picture, state: RobotState) -> None:
        """Draw the deck and the front flippers, which reach into the image from below."""
        for (front, half, up), color in _DECK:
            deck = [(0.05, half, up), (front, half, up), (front, -half, up), (0.05, -half, up)]
            self._fill(image, np.array(deck), color)
        for side, angle in ((1, state.flippers[0]), (-1, state.flippers[1])):
            c, s = math.cos(angle), math.sin(angle)
            along, thick = _FLIPPER_OUTLINE
            forward = 0.26 + c * along - s * thick
            height = 0.14 + s * along + c * thick
            inner, outer = np.full(4, side * 0.27), np.full(4, side * 0.37)
            belt = [0, 1, 1, 0]
            edge = np.where([True, True, False, False], inner, outer)
            self._fill(image, np.column_stack([forward, inner, height]), (50, 53, 60))
            self._fill(image, np.column_stack([forward[belt], edge, height[belt]]), (30, 32, 36))
            for k in np.linspace(0.12, 0.92, 8):
                x = forward[0] + k * (forward[1] - forward[0])
                z = height[0] + k * (height[1] - height[0])
                self._cleat(image, (x, side * 0.27, z), (x, side * 0.37, z))

    def _cleat(self, image: Picture, start: tuple[float, ...], end: tuple[float, ...]) -> None:
        points = outline_of(from_body(np.array([start, end, end])))
        if points is not None:
            ends = [(int(p[0]), int(p[1])) for p in points[:2]]
            cv2.line(image, ends[0], ends[1], (74, 78, 86), 2, cv2.LINE_AA)

    def _fill(self, image: Picture, points: Floats, color: tuple[int, int, int]) -> None:
        outline = outline_of(from_body(points))
        if outline is not None:
            cv2.fillConvexPoly(image, outline, color, cv2.LINE_AA)


_DOUBLE = np.array([[2.0, 0, 0.5], [0, 2.0, 0.5], [0, 0, 1.0]])


def _shift(x: float, y: float) -> Floats:
    return np.array([[1.0, 0, x], [0, 1.0, y], [0, 0, 1.0]])


def _warp(texture: Picture, inverse: Floats, image: Picture, first: int, last: int) -> None:
    """Fill some rows of `image` with `texture`; `inverse` leads from pixels to texels."""
    if last > first:
        cv2.warpPerspective(
            texture,
            inverse @ _shift(0, first),
            (image.shape[1], last - first),
            image[first:last],
            cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            cv2.BORDER_REPLICATE,
        )


def _beam() -> Picture:
    """Return the gain of the flashlight at each pixel, 128 for none."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    low = y - HEIGHT * 0.6
    away = np.hypot((x - WIDTH / 2) / 270, low / np.where(low < 0, 130, 210))
    gain = 118 + 100 * np.exp(-(away**2.4))
    warm = np.array([1.0, 0.98, 0.9])
    return cast("Picture", np.clip(gain[..., None] * warm, 0, 255).astype(np.uint8))
