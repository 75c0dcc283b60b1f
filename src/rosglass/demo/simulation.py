"""The robot's body: how a tracked vehicle moves, stops, bumps into things and drains its battery.

Without input, output or a clock of its own: only :meth:`Simulation.step` advances it, so that the
same commands always give the same drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rosglass.demo.world import World
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.demo.world import Prism

__all__ = ["FLIPPERS", "CommandRejectedError", "Limits", "RobotState", "Simulation"]

#: Joint names, in the order of every list of flipper angles.
FLIPPERS = (
    "flipper_front_left",
    "flipper_front_right",
    "flipper_rear_left",
    "flipper_rear_right",
)
_FLOOR_STEP = 0.02
_TRACK_LENGTH, _TRACK_WIDTH = 0.62, 0.46


class CommandRejectedError(Error):
    """A command is invalid; the robot ignores it, and its watchdog continues."""


@dataclass(frozen=True)
class Limits:
    """The limits of the robot and of its commands.

    Attributes:
        speed: Highest speed, m/s; faster commands are driven at this speed.
        turn: Highest turn rate, rad/s; faster commands are turned at this rate.
        believable: Commands beyond this (m/s or rad/s) are refused as invalid.
        acceleration: m/s².
        braking: m/s².
        turn_acceleration: rad/s².
        watchdog: Seconds after the last command until the robot stops by itself.
        radius: Radius of the circle that must stay clear of obstacles, metres.
        flipper: Farthest flipper angle either way, radians.
        flipper_speed: rad/s.
    """

    speed: float = 1.2
    turn: float = 1.6
    believable: float = 20.0
    acceleration: float = 2.0
    braking: float = 4.0
    turn_acceleration: float = 6.0
    watchdog: float = 0.5
    radius: float = 0.42
    flipper: float = 1.4
    flipper_speed: float = 1.2


@dataclass(frozen=True)
class RobotState:
    """The complete state of the robot at one moment. Map frame, SI units, REP 103.

    Attributes:
        time: Seconds since the start.
        x: Position, metres.
        y: Position, metres.
        z: Height of the ground under the robot, metres.
        roll: Radians, positive with the left side up.
        pitch: Radians, positive with the nose down.
        yaw: Radians, counter-clockwise from the x axis.
        speed: Forwards, m/s.
        turn: Counter-clockwise, rad/s.
        acceleration: Forwards, m/s².
        roll_rate: rad/s.
        pitch_rate: rad/s.
        commanded_speed: Commanded speed of the motors, m/s.
        commanded_turn: Commanded turn rate of the motors, rad/s.
        commands_alive: Whether a command was received within the watchdog's time.
        emergency_stop: Whether the stop is latched.
        flashlight: Whether the lamp is on.
        bumped: Whether it touches something.
        flippers: Angles in the order of :data:`FLIPPERS`, radians, positive up.
        flipper_speeds: rad/s.
        charge: Charge of the battery, 0 to 1.
        current: Current into the battery, A; negative while it discharges.
        charging: Whether it stands in its dock.
        odometer: Metres driven.
        carrier_phase: Position of the moving vehicle (:meth:`World.carrier`).
    """

    time: float = 0.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    speed: float = 0.0
    turn: float = 0.0
    acceleration: float = 0.0
    roll_rate: float = 0.0
    pitch_rate: float = 0.0
    commanded_speed: float = 0.0
    commanded_turn: float = 0.0
    commands_alive: bool = False
    emergency_stop: bool = False
    flashlight: bool = False
    bumped: bool = False
    flippers: tuple[float, ...] = (0.4, 0.4, 0.4, 0.4)
    flipper_speeds: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    charge: float = 0.86
    current: float = 0.0
    charging: bool = False
    odometer: float = 0.0
    carrier_phase: float = 10.5

    @property
    def voltage(self) -> float:
        """Voltage of the battery: a six-cell lithium pack that sags under load."""
        return 6 * (3.45 + 0.7 * self.charge) + 0.04 * self.current

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """Attitude as a quaternion x, y, z, w."""
        cr, sr = math.cos(self.roll / 2), math.sin(self.roll / 2)
        cp, sp = math.cos(self.pitch / 2), math.sin(self.pitch / 2)
        cy, sy = math.cos(self.yaw / 2), math.sin(self.yaw / 2)
        return (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )


class Simulation:
    """The moving robot in its world.

    Attributes:
        world: Its world.
        limits: Its limits.
        state: Its current state; a new object after each step.
    """

    def __init__(
        self,
        world: World | None = None,
        limits: Limits | None = None,
        state: RobotState | None = None,
    ) -> None:
        self.world = world if world is not None else World.standard()
        self.limits = limits if limits is not None else Limits()
        dock = self.world.dock
        self.state = state if state is not None else RobotState(x=dock[0], y=dock[1], yaw=0.55)
        self._command = (0.0, 0.0)
        self._command_time = -math.inf
        self._flipper_targets = list(self.state.flippers)
        self._prisms = self.world.prisms
        centres = np.array([prism.centre for prism in self._prisms])
        self._centres = centres
        self._reaches = np.array(
            [
                max(math.dist(corner, prism.centre) for corner in prism.corners)
                for prism in self._prisms
            ]
        )
        self._settle()

    def command_velocity(self, speed: float, turn: float) -> None:
        """Handle a drive command, as received on ``/cmd_vel``.

        Args:
            speed: Forwards, m/s.
            turn: Counter-clockwise, rad/s.

        Raises:
            CommandRejectedError: A value is not finite, or not believable; the previous command
                stays in force until the watchdog ends it.
        """
        for name, value, unit in (("linear.x", speed, "m/s"), ("angular.z", turn, "rad/s")):
            if not math.isfinite(value) or abs(value) > self.limits.believable:
                raise CommandRejectedError(
                    f"{name} = {value} {unit} refused: "
                    f"expected a finite value within ±{self.limits.believable:g} {unit}"
                )
        self._command = (speed, turn)
        self._command_time = self.state.time

    def command_flippers(self, angles: Sequence[float]) -> None:
        """Set target angles for the flippers, in the order of :data:`FLIPPERS`.

        Raises:
            CommandRejectedError: Not four finite angles within the flippers' reach.
        """
        reach = self.limits.flipper
        if len(angles) != len(FLIPPERS):
            raise CommandRejectedError(
                f"{len(angles)} flipper angles refused: expected {len(FLIPPERS)}, "
                f"for {', '.join(FLIPPERS)}"
            )
        for name, angle in zip(FLIPPERS, angles, strict=True):
            if not math.isfinite(angle) or abs(angle) > reach + 1e-9:
                raise CommandRejectedError(
                    f"{name} = {angle} rad refused: expected a finite angle within ±{reach:g} rad"
                )
        self._flipper_targets = [float(angle) for angle in angles]

    def set_emergency_stop(self, stop: bool) -> None:
        """Latch or release the emergency stop; a release discards earlier commands."""
        if stop or self.state.emergency_stop:
            self._command, self._command_time = (0.0, 0.0), -math.inf
            self._flipper_targets = list(self.state.flippers)
        self.state = replace(self.state, emergency_stop=stop)

    def set_flashlight(self, on: bool) -> None:
        """Switch the lamp."""
        self.state = replace(self.state, flashlight=on)

    def advance(self, elapsed: float) -> None:
        """Advance by `elapsed` seconds in small steps; a long pause is caught up, not skipped."""
        while elapsed > 1e-9:
            step = min(elapsed, _FLOOR_STEP)
            self.step(step)
            elapsed -= step

    def step(self, dt: float) -> None:
        """Advance by `dt` seconds, at most 0.05: one step of the motion.

        Raises:
            CommandRejectedError: `dt` is not a positive step.
        """
        if not 0.0 < dt <= 0.05:
            raise CommandRejectedError(f"a step of {dt} s refused: expected 0 < dt <= 0.05")
        s, lim = self.state, self.limits
        now = s.time + dt
        alive = now - self._command_time <= lim.watchdog
        goal_speed, goal_turn = self._goal(alive)
        brake = lim.braking * (2.0 if s.emergency_stop else 1.0)
        slowing = abs(goal_speed) < abs(s.speed) or goal_speed * s.speed < 0
        speed = _towards(s.speed, goal_speed, (brake if slowing else lim.acceleration) * dt)
        turn = _towards(s.turn, goal_turn, lim.turn_acceleration * dt)

        middle = s.yaw + 0.5 * turn * dt
        reach = speed * math.cos(s.pitch) * dt
        x, y = s.x + reach * math.cos(middle), s.y + reach * math.sin(middle)
        carrier, phase = self._move_carrier(x, y, dt)
        x, y, bumped = self._keep_clear(x, y, carrier)
        if bumped:
            # The tracks stall against the obstacle: only the motion that was possible remains.
            made = (x - s.x) * math.cos(middle) + (y - s.y) * math.sin(middle)
            speed = min(abs(speed), abs(made) / dt) * math.copysign(1.0, speed)
        flippers, rates = self._move_flippers(dt)
        roll, pitch, height = self._attitude(x, y, s.yaw + turn * dt)
        # Tracks and soil give way a little: the hull follows the ground with a short lag.
        follow = 1.0 - math.exp(-dt / 0.08)
        new_roll, new_pitch = (
            s.roll + follow * (roll - s.roll),
            s.pitch + follow * (pitch - s.pitch),
        )
        charge, current, charging = self._battery(speed, turn, x, y, dt)
        self.state = replace(
            s,
            time=now,
            x=x,
            y=y,
            z=s.z + follow * (height - s.z),
            roll=new_roll,
            pitch=new_pitch,
            yaw=math.remainder(s.yaw + turn * dt, 2 * math.pi),
            speed=speed,
            turn=turn,
            acceleration=(speed - s.speed) / dt,
            roll_rate=(new_roll - s.roll) / dt,
            pitch_rate=(new_pitch - s.pitch) / dt,
            commanded_speed=goal_speed,
            commanded_turn=goal_turn,
            commands_alive=alive,
            bumped=bumped,
            flippers=flippers,
            flipper_speeds=rates,
            charge=charge,
            current=current,
            charging=charging,
            odometer=s.odometer + abs(math.dist((x, y), (s.x, s.y))),
            carrier_phase=phase,
        )

    def _goal(self, alive: bool) -> tuple[float, float]:
        if self.state.emergency_stop or not alive or self.state.charge <= 0.0:
            return 0.0, 0.0
        lim = self.limits
        return (
            max(-lim.speed, min(lim.speed, self._command[0])),
            max(-lim.turn, min(lim.turn, self._command[1])),
        )

    def _move_carrier(self, x: float, y: float, dt: float) -> tuple[Prism, float]:
        phase = self.state.carrier_phase
        ahead = self.world.carrier(phase + dt)
        cx, cy = ahead.centre
        # It has a bumper scanner of its own and waits for the robot to clear the way.
        if math.dist((x, y), (cx, cy)) < self.limits.radius + 0.65:
            return self.world.carrier(phase), phase
        return ahead, phase + dt

    def _keep_clear(self, x: float, y: float, carrier: Prism) -> tuple[float, float, bool]:
        radius = self.limits.radius
        near = np.hypot(self._centres[:, 0] - x, self._centres[:, 1] - y) < self._reaches + radius
        candidates = [self._prisms[i] for i in np.flatnonzero(near)] + [carrier]
        touched = False
        for _ in range(4):
            pushed = False
            for prism in candidates:
                push = _push_out(x, y, radius, prism)
                if push is not None:
                    x, y = x + push[0], y + push[1]
                    pushed = True
            if not pushed:
                break
            touched = True
        return x, y, touched

    def _move_flippers(self, dt: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        old = self.state.flippers
        if self.state.emergency_stop or self.state.charge <= 0.0:
            return old, (0.0,) * len(FLIPPERS)
        step = self.limits.flipper_speed * dt
        new = tuple(
            _towards(angle, target, step)
            for angle, target in zip(old, self._flipper_targets, strict=True)
        )
        return new, tuple((b - a) / dt for a, b in zip(old, new, strict=True))

    def _attitude(self, x: float, y: float, yaw: float) -> tuple[float, float, float]:
        c, s = math.cos(yaw), math.sin(yaw)
        ahead = np.array([1.0, 1.0, -1.0, -1.0]) * _TRACK_LENGTH / 2
        left = np.array([1.0, -1.0, 1.0, -1.0]) * _TRACK_WIDTH / 2
        fl, fr, rl, rr = self.world.ground(x + c * ahead - s * left, y + s * ahead + c * left)
        pitch = math.atan2((rl + rr - fl - fr) / 2, _TRACK_LENGTH)
        roll = math.atan2((fl + rl - fr - rr) / 2, _TRACK_WIDTH)
        return roll, pitch, float(fl + fr + rl + rr) / 4

    def _settle(self) -> None:
        s = self.state
        roll, pitch, height = self._attitude(s.x, s.y, s.yaw)
        self.state = replace(s, roll=roll, pitch=pitch, z=height)

    def _battery(
        self, speed: float, turn: float, x: float, y: float, dt: float
    ) -> tuple[float, float, bool]:
        s, lim = self.state, self.limits
        effort = abs(speed) / lim.speed + 0.6 * abs(turn) / lim.turn
        # A 20 Ah pack, drained ten times as fast as a real one, as a demo is short.
        load = 1.2 + 9.0 * effort + (0.8 if s.flashlight else 0.0)
        charging = math.dist((x, y), self.world.dock) < 0.6 and abs(speed) < 0.02
        current = (16.0 if s.charge < 1.0 else load) - load if charging else -load
        charge = s.charge + current * 10.0 * dt / (20.0 * 3600.0)
        return max(0.0, min(1.0, charge)), current, charging


def _towards(value: float, goal: float, step: float) -> float:
    return goal if abs(goal - value) <= step else value + math.copysign(step, goal - value)


def _push_out(x: float, y: float, radius: float, prism: Prism) -> tuple[float, float] | None:
    """Return the shortest shift that takes the circle out of the prism, None if it is clear."""
    best_depth, best_normal = math.inf, (0.0, 0.0)
    nearest, nearest_point = math.inf, (0.0, 0.0)
    inside = True
    for x0, y0, x1, y1 in prism.segments():
        ex, ey = x1 - x0, y1 - y0
        length = math.hypot(ex, ey)
        normal = (ey / length, -ex / length)
        outside_by = (x - x0) * normal[0] + (y - y0) * normal[1]
        inside = inside and outside_by <= 0
        if -outside_by < best_depth:
            best_depth, best_normal = -outside_by, normal
        t = max(0.0, min(1.0, ((x - x0) * ex + (y - y0) * ey) / (length * length)))
        point = (x0 + t * ex, y0 + t * ey)
        distance = math.dist((x, y), point)
        if distance < nearest:
            nearest, nearest_point = distance, point
    if inside:
        depth = best_depth + radius
        return best_normal[0] * depth, best_normal[1] * depth
    if nearest >= radius:
        return None
    depth = (radius - nearest) / max(nearest, 1e-9)
    return (x - nearest_point[0]) * depth, (y - nearest_point[1]) * depth
