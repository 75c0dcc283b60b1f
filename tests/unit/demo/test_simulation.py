"""How the simulated robot moves, and above all how it stops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rosglass.demo.simulation import CommandRejectedError, RobotState, Simulation
from rosglass.demo.world import World
from rosglass.errors import Error


def drive(simulation: Simulation, speed: float, turn: float, seconds: float) -> None:
    """Send a command every 50 ms, as an operator's stick does."""
    for _ in range(round(seconds / 0.05)):
        simulation.command_velocity(speed, turn)
        simulation.advance(0.05)


def at(x: float, y: float, yaw: float = 0.0, **fields: object) -> Simulation:
    return Simulation(state=RobotState(x=x, y=y, yaw=yaw, **fields))  # type: ignore[arg-type]


def test_stops_half_a_second_after_the_last_command() -> None:
    robot = at(-5.4, -3.2)
    drive(robot, 0.5, 0.0, 1.0)
    assert robot.state.speed == pytest.approx(0.5)
    robot.advance(0.4)
    assert robot.state.speed == pytest.approx(0.5)
    assert robot.state.commands_alive
    robot.advance(0.3)
    assert robot.state.speed == 0.0
    assert not robot.state.commands_alive


def test_stops_in_time_when_its_thread_was_starved() -> None:
    robot = at(-5.4, -3.2)
    drive(robot, 1.0, 0.0, 0.5)
    before = robot.state.x
    robot.advance(5.0)
    assert robot.state.speed == 0.0
    assert robot.state.x - before < 0.5 + 1.0**2 / (2 * robot.limits.braking) + 0.05


def test_odometry_of_a_straight_drive_and_a_circle() -> None:
    robot = at(-5.4, -3.2)
    drive(robot, 0.5, 0.0, 2.0)
    # 0.25 s of acceleration at 2 m/s² covers half of what full speed would.
    assert robot.state.x == pytest.approx(-5.4 + 0.5 * (2.0 - 0.125), abs=0.01)
    assert robot.state.odometer == pytest.approx(robot.state.x + 5.4, abs=1e-6)

    robot = at(0.0, -3.5, carrier_phase=9.0)
    drive(robot, 0.0, 1.0, 3.0)
    assert math.hypot(robot.state.x, robot.state.y + 3.5) < 1e-9
    assert robot.state.yaw == pytest.approx(
        3.0 - 1.0 / (2 * robot.limits.turn_acceleration), abs=0.01
    )


@pytest.mark.parametrize("yaw", [math.pi, -math.pi / 2, 2.4, -2.0])
def test_walls_hold_whatever_the_operator_does(yaw: float) -> None:
    robot = at(-5.4, -3.2, yaw)
    drive(robot, 1.2, 0.05, 12.0)
    world, radius = robot.world, robot.limits.radius
    assert abs(robot.state.x) <= world.half_length - radius + 1e-6
    assert abs(robot.state.y) <= world.half_width - radius + 1e-6


def test_wall_ahead_stalls_the_tracks() -> None:
    robot = at(-6.0, -3.2, math.pi)
    drive(robot, 1.0, 0.0, 2.0)
    assert robot.state.bumped
    assert robot.state.speed < 0.1
    drive(robot, -0.5, 0.0, 1.0)
    assert not robot.state.bumped
    assert robot.state.x > -6.4


def test_stays_clear_of_every_obstacle_on_a_long_random_drive() -> None:
    robot = Simulation()
    random = np.random.default_rng(1)
    for _ in range(120):
        drive(robot, random.uniform(-1.2, 1.2), random.uniform(-1.6, 1.6), 0.5)
        for prism in (*robot.world.prisms, robot.world.carrier(robot.state.carrier_phase)):
            inside = all(
                (x1 - x0) * (robot.state.y - y0) - (y1 - y0) * (robot.state.x - x0) > 0
                for x0, y0, x1, y1 in prism.segments()
            )
            assert not inside, prism.name
    assert robot.state.odometer > 3.0


def test_emergency_stop_is_latched_until_released() -> None:
    robot = at(-5.4, -3.2)
    drive(robot, 1.0, 0.0, 1.0)
    robot.set_emergency_stop(True)
    drive(robot, 1.0, 0.5, 0.3)
    assert robot.state.speed == 0.0
    drive(robot, 1.0, 0.5, 2.0)
    assert (robot.state.speed, robot.state.turn) == (0.0, 0.0)
    robot.set_emergency_stop(False)
    robot.advance(0.2)
    assert robot.state.speed == 0.0, "a release must not bring an old command back to life"
    drive(robot, 0.5, 0.0, 0.5)
    assert robot.state.speed == pytest.approx(0.5)


def test_emergency_stop_holds_the_flippers() -> None:
    robot = Simulation()
    robot.command_flippers([1.0, 1.0, 1.0, 1.0])
    robot.advance(0.2)
    held = robot.state.flippers
    robot.set_emergency_stop(True)
    robot.advance(1.0)
    robot.set_emergency_stop(False)
    robot.advance(1.0)
    assert robot.state.flippers == held


@pytest.mark.parametrize(
    ("speed", "turn", "named"),
    [
        (math.nan, 0.0, "linear.x"),
        (0.0, math.nan, "angular.z"),
        (math.inf, 0.0, "linear.x"),
        (0.0, -math.inf, "angular.z"),
        (1e30, 0.0, "linear.x"),
        (0.0, 21.0, "angular.z"),
    ],
)
def test_garbage_commands_are_refused_and_do_not_feed_the_watchdog(
    speed: float, turn: float, named: str
) -> None:
    robot = at(-5.4, -3.2)
    drive(robot, 0.5, 0.0, 0.5)
    for _ in range(14):
        with pytest.raises(CommandRejectedError, match=named):
            robot.command_velocity(speed, turn)
        robot.advance(0.05)
    assert robot.state.speed == 0.0
    assert math.isfinite(robot.state.x)


def test_commands_beyond_its_speed_are_driven_at_its_speed() -> None:
    robot = at(-5.4, -3.2)
    drive(robot, 5.0, 0.0, 1.5)
    assert robot.state.speed == robot.limits.speed


@pytest.mark.parametrize("angles", [[0.0] * 3, [0.0] * 5, [0.0, math.nan, 0.0, 0.0], [2.0] * 4])
def test_impossible_flipper_angles_are_refused(angles: list[float]) -> None:
    robot = Simulation()
    with pytest.raises(Error, match="refused"):
        robot.command_flippers(angles)
    robot.advance(1.0)
    assert robot.state.flippers == RobotState().flippers


def test_flippers_go_to_their_targets_at_their_own_speed() -> None:
    robot = Simulation()
    robot.command_flippers([1.0, -1.0, 0.4, 0.4])
    robot.advance(0.1)
    assert robot.state.flippers[0] == pytest.approx(0.4 + 0.12)
    robot.advance(2.0)
    assert robot.state.flippers == pytest.approx((1.0, -1.0, 0.4, 0.4))
    assert robot.state.flipper_speeds == (0.0,) * 4


@pytest.mark.parametrize("dt", [0.0, -0.1, 0.06, math.nan])
def test_impossible_steps_are_refused(dt: float) -> None:
    with pytest.raises(Error, match="step"):
        Simulation().step(dt)


def test_nose_goes_up_on_the_ramp_and_down_behind_it() -> None:
    world = World.standard()
    slope = math.atan2(world.ramp.height, world.ramp.slope_length)
    robot = at(world.ramp.start + 0.65, world.ramp.y)
    assert robot.state.pitch == pytest.approx(-slope, abs=0.01)
    robot = at(world.ramp.end - 0.65, world.ramp.y)
    assert robot.state.pitch == pytest.approx(slope, abs=0.01)
    robot = at(world.ramp.start + 0.65, world.ramp.y, math.pi / 2)
    assert robot.state.roll == pytest.approx(-slope, abs=0.02), "the left side is the low one"


def test_rubble_shakes_the_robot() -> None:
    robot = at(-5.2, 2.2)
    rolls = []
    for _ in range(80):
        drive(robot, 0.6, 0.0, 0.05)
        rolls.append(robot.state.roll)
    assert max(rolls) - min(rolls) > math.radians(2)


def test_driving_drains_the_battery_and_the_dock_fills_it() -> None:
    idle, busy = at(-3.5, -0.5), at(-3.5, -0.5)
    idle.advance(10.0)
    drive(busy, 0.3, 1.6, 10.0)
    assert busy.state.charge < idle.state.charge < RobotState().charge
    docked = Simulation()
    docked.advance(10.0)
    assert docked.state.charging
    assert docked.state.charge > RobotState().charge


def test_empty_battery_moves_nothing() -> None:
    robot = at(-3.5, -0.5, charge=0.0)
    robot.command_flippers([1.0] * 4)
    drive(robot, 1.0, 0.0, 1.0)
    assert robot.state.odometer == 0.0
    assert robot.state.flippers == RobotState().flippers


def test_carrier_waits_for_the_robot() -> None:
    world = World.standard()
    x, y = world.carrier(1.0).centre
    robot = at(x, y + 1.0, carrier_phase=1.0)
    robot.advance(10.0)
    assert robot.state.carrier_phase < 2.0


def test_same_commands_give_the_same_drive() -> None:
    ends = []
    for _ in range(2):
        robot = Simulation()
        drive(robot, 0.8, 0.3, 3.0)
        ends.append(robot.state)
    assert ends[0] == ends[1]
    assert replace(ends[0], x=0.0) != ends[1]


def test_orientation_is_the_quaternion_of_roll_pitch_yaw() -> None:
    state = RobotState(roll=0.1, pitch=-0.2, yaw=0.7)
    x, y, z, w = state.orientation
    assert x * x + y * y + z * z + w * w == pytest.approx(1.0)
    assert math.asin(2 * (w * y - z * x)) == pytest.approx(-0.2)
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(0.7)
    assert math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(0.1)
