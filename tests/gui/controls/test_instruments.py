"""The controls Attitude, Compass, Gauge, Lamp and Speed."""

from __future__ import annotations

import math
from typing import Any

import pytest

pytestmark = pytest.mark.both_qt
IMU, ODOMETRY = "sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"


def turned(roll: float = 0, pitch: float = 0, yaw: float = 0) -> dict[str, float]:
    """Return the quaternion of angles in degrees."""
    r, p, y = (math.radians(angle) / 2 for angle in (roll, pitch, yaw))
    cr, sr, cp, sp, cy, sy = (f(a) for a in (r, p, y) for f in (math.cos, math.sin))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


def odometry(x: float = 0, y: float = 0, turn: float = 0, **angles: float) -> dict[str, Any]:
    return {
        "header": {"frame_id": "odom"},
        "pose": {"pose": {"orientation": turned(**angles)}},
        "twist": {"twist": {"linear": {"x": x, "y": y}, "angular": {"z": turn}}},
    }


@pytest.fixture
def shown(controls: Any, wait: Any) -> Any:
    """Shows a control of a topic; returns it, and a function that publishes and waits."""

    def show(control: str, kind: str, topic: str = "/topic") -> Any:
        publisher = controls.robot.create_publisher(topic, kind)
        item = controls.show(control)
        wait(publisher.subscription_count)
        received = []
        item.property("source").messageChanged.connect(lambda: received.append(1))

        def publish(**fields: Any) -> None:
            received.clear()
            publisher.publish(**fields)
            wait(lambda: received)

        return item, publish

    return show


# Attitude.


@pytest.mark.parametrize(("convention", "sign"), [("ENU", -1), ("NED", 1)])
def test_attitude_shows_roll_and_pitch(shown: Any, convention: str, sign: int) -> None:
    item, publish = shown(f'Attitude {{ convention: "{convention}" }}', IMU)
    publish(orientation=turned(roll=10, pitch=5, yaw=70))
    assert item.property("roll") == pytest.approx(10)
    assert item.property("pitch") == pytest.approx(5 * sign)
    assert not item.property("steep")
    publish(orientation=turned(roll=-25))
    assert item.property("steep")
    assert item.property("note") == "pitch 0° roll -25°"


def test_attitude_draws_the_horizon_as_seen_from_behind(shown: Any, controls: Any) -> None:
    item, publish = shown("Attitude { width: 200; height: 200; framed: false }", IMU)
    publish(orientation=turned(roll=30))
    glass = controls.find("glass")
    picture = controls.grab()
    middle = int(glass.property("width") / 2)
    left, right = (picture.pixelColor(middle + at, middle) for at in (-90, 90))
    # With the right side down, the ground appears on the right: the horizon falls to the left.
    assert left.blue() > left.red()
    assert right.red() > right.blue()
    assert item.property("roll") == pytest.approx(30)


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}, "the orientation is zero"),
        ({"orientation": {"w": math.nan}}, "the orientation is not a number"),
        ({"orientation": {"x": math.inf, "w": 1}}, "the orientation is not a number"),
        ({"orientation": {"x": 0, "y": 0, "z": 0, "w": 0.5}}, "has the length 0.50, not 1"),
        ({"orientation_covariance": [-1.0, *[0.0] * 8]}, "measures no orientation"),
    ],
)
@pytest.mark.parametrize("control", ["Attitude", "Compass"])
def test_faulty_orientation_is_named(shown: Any, control: str, fields: Any, fault: str) -> None:
    item, publish = shown(f"{control} {{}}", IMU)
    publish(**fields)
    assert fault in item.property("status")
    publish(orientation=turned())
    assert item.property("status") == ""


def test_unknown_convention_is_named(shown: Any) -> None:
    item, publish = shown('Attitude { convention: "FLU" }', IMU)
    publish(orientation=turned())
    assert item.property("status") == 'convention is "ENU" or "NED", not "FLU"'


def test_attitude_takes_an_odometry(shown: Any) -> None:
    item, publish = shown("Attitude {}", ODOMETRY)
    publish(**odometry(roll=3))
    assert item.property("roll") == pytest.approx(3)


# Compass.


@pytest.mark.parametrize(
    ("setting", "yaw", "heading", "note"),
    [
        ("", 0, 90, "magnetic north · ENU"),
        ("", 90, 0, "magnetic north · ENU"),
        ("", 180, 270, "magnetic north · ENU"),
        ('convention: "NED"', 30, 30, "magnetic north · NED"),
        ("declination: 4", 90, 4, "true north · ENU"),
        ('reference: "true"; declination: 4', 90, 0, "true north · ENU"),
    ],
)
def test_compass_of_an_imu(shown: Any, setting: str, yaw: float, heading: float, note: str) -> None:
    item, publish = shown(f"Compass {{ {setting} }}", IMU)
    publish(orientation=turned(yaw=yaw))
    assert item.property("heading") % 360 == pytest.approx(heading, abs=1e-6)
    assert item.property("note") == note


def test_compass_of_an_odometry_shows_the_frame(shown: Any, controls: Any) -> None:
    item, publish = shown("Compass {}", ODOMETRY)
    publish(**odometry(yaw=-30))
    assert item.property("heading") == pytest.approx(-30)
    assert not item.property("north")
    assert item.property("note") == "from x of odom · ENU"
    assert controls.find("value").property("text") == "-30°"
    assert controls.find("rose").property("rotation") == pytest.approx(-30)


def test_name_of_a_frame_is_plain_and_bounded(shown: Any, controls: Any) -> None:
    item, publish = shown("Compass {}", ODOMETRY)
    message = odometry()
    message["header"]["frame_id"] = "<b>o</b>\x1b\u202e" + "x" * 1_000_000
    publish(**message)
    assert item.property("origin").startswith("from x of <b>o</b>\ufffd\ufffdx")
    assert len(item.property("origin")) < 60


def test_compass_of_an_odometry_may_be_north(shown: Any) -> None:
    item, publish = shown('Compass { reference: "true" }', ODOMETRY)
    publish(**odometry(yaw=90))
    assert item.property("heading") % 360 == pytest.approx(0, abs=1e-6)
    assert item.property("north")


# Gauge.


def test_gauge_shows_a_field_of_any_topic(shown: Any, controls: Any) -> None:
    item, publish = shown(
        'Gauge { path: "topic:twist.twist.linear.x"; unit: "km/h"; factor: 3.6; to: 20 }', ODOMETRY
    )
    publish(**odometry(x=2))
    assert item.property("value") == pytest.approx(7.2)
    assert controls.find("digits").property("text") == "7.2"
    assert item.property("title") == "x"


def test_gauge_thresholds_have_hysteresis(shown: Any) -> None:
    item, publish = shown(
        'Gauge { path: "/topic:data"; to: 100; warnAbove: 50; badAbove: 80; badBelow: 10; '
        "hysteresis: 5 }",
        "std_msgs/msg/Float64",
    )
    levels = []
    for value in (20, 50, 46, 44, 85, 76, 74, 10, 14, 16, math.nan):
        publish(data=value)
        levels.append(item.property("level"))
    assert levels == [0, 1, 1, 0, 2, 2, 1, 2, 2, 0, 0]
    assert item.property("status") == "not a number"


@pytest.mark.parametrize(
    ("path", "fault"),
    [
        ("/topic:pose.pose.positon.x", "has no field 'positon'"),
        ("/topic:header.frame_id", "is a text, not a number"),
        ("/topic:pose.covariance", "is an array; name one of its elements: pose.covariance[0]"),
        ("/topic:pose.pose", "is a geometry_msgs/msg/Pose; name one of its fields"),
        ("/topic:pose.covariance[99]", "99"),
        ("/topic:pose..x", "malformed"),
    ],
)
def test_gauge_names_a_path_without_a_number(shown: Any, path: str, fault: str) -> None:
    item, publish = shown(f'Gauge {{ path: "{path}" }}', ODOMETRY)
    publish(**odometry())
    assert fault in item.property("status")
    assert math.isnan(item.property("value"))


@pytest.mark.parametrize(
    ("gauge", "fault"),
    [
        ("Gauge {}", 'set path: "topic:field"'),
        ('Gauge { path: "/topic" }', "expected topic:field"),
        ('Gauge { path: "/topic:data"; from: 3; to: 3 }', "from 3 is not less than to 3"),
        ('Gauge { path: "/topic:data"; style: "needle" }', 'style is "dial" or "bar"'),
    ],
)
def test_gauge_names_wrong_settings(controls: Any, wait: Any, gauge: str, fault: str) -> None:
    item = controls.show(gauge)
    wait(lambda: fault in item.property("status"))


@pytest.mark.parametrize("style", ["dial", "bar"])
def test_gauge_lives_with_any_number(shown: Any, controls: Any, style: str) -> None:
    item, publish = shown(
        f'Gauge {{ path: "/topic:data"; style: "{style}"; from: -1 }}', "std_msgs/msg/Float64"
    )
    for value, text in ((math.inf, "∞"), (1e300, "1.00e+300"), (-0.5, "-0.5"), (-1e9, "-1.00e+9")):
        publish(data=value)
        assert controls.find("digits").property("text") == text
    assert item.property("note") == "below -1.0"
    assert not controls.grab().isNull()


def test_gauge_takes_booleans_and_times(shown: Any) -> None:
    item, publish = shown('Gauge { path: "/topic:header.stamp" }', IMU)
    publish(header={"stamp": {"sec": 2, "nanosec": 500_000_000}})
    assert item.property("value") == pytest.approx(2.5)


# Speed.


def test_speed_of_an_odometry(shown: Any, controls: Any) -> None:
    item, publish = shown("Speed {}", ODOMETRY)
    publish(**odometry(x=-0.004, turn=math.pi / 2))
    assert controls.find("forward").property("value") == "0.00"
    assert controls.find("turn").property("value") == "90"
    assert not controls.find("sideways").property("visible")
    publish(**odometry(y=-0.5))
    assert controls.find("sideways").property("value") == "0.50"
    assert controls.find("sideways").property("unit") == "m/s right"
    assert item.property("status") == ""


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("geometry_msgs/msg/Twist", {"linear": {"x": 10.0}}),
        ("geometry_msgs/msg/TwistStamped", {"twist": {"linear": {"x": 10.0}}}),
        (
            "geometry_msgs/msg/TwistWithCovarianceStamped",
            {"twist": {"twist": {"linear": {"x": 10.0}}}},
        ),
    ],
)
def test_speed_of_a_twist(shown: Any, controls: Any, kind: str, fields: Any) -> None:
    item, publish = shown('Speed { topic: "/topic"; unit: "km/h"; turnUnit: "rad/s" }', kind)
    publish(**fields)
    assert controls.find("forward").property("value") == "36.0"
    assert controls.find("turn").property("value") == "0.00"
    assert item.property("speed") == pytest.approx(10)


def test_speed_takes_no_command_for_a_speed(controls: Any, wait: Any) -> None:
    command = controls.robot.create_publisher("/cmd_vel", "geometry_msgs/msg/Twist")
    odom = controls.robot.create_publisher("/odom", ODOMETRY)
    item = controls.show("Speed {}")
    wait(odom.subscription_count)
    assert command.subscription_count() == 0
    assert item.property("status") == "NO DATA YET"


def test_speed_names_what_is_not_a_number(shown: Any, controls: Any) -> None:
    item, publish = shown("Speed {}", ODOMETRY)
    publish(**odometry(x=math.nan))
    assert item.property("status") == "linear.x is not a number"
    assert controls.find("forward").property("value") == "?"
    publish(**odometry(turn=math.inf))
    assert controls.find("turn").property("value") == "∞"


def test_speed_says_why_the_robot_does_not_drive(shown: Any, controls: Any) -> None:
    item, publish = shown(
        "Speed { command: QtObject { property string refusal } }",
        ODOMETRY,
    )
    publish(**odometry())
    assert item.property("refusal") == ""
    item.property("command").setProperty("refusal", "stop is pressed")
    assert item.property("refusal") == "stop is pressed"
    assert controls.find("refusal").property("visible")
    assert not controls.find("readings").property("visible")


def test_convention_lies_beside_the_ladder(controls: Any, wait: Any) -> None:
    attitude = controls.show('Attitude { topic: "/imu"; width: 260; height: 200 }')
    glass, axes = controls.find("glass"), controls.find("convention")
    wait(lambda: axes.width() > 0 and axes.x() + axes.width() <= glass.x())
    # Without room beside it, it is in the glass's corner, on a ground of its own.
    attitude.setProperty("width", 170)
    wait(lambda: axes.x() >= glass.x())
    assert axes.property("color").alpha() == 255


# Lamp.

VOLTAGE = "sensor_msgs/msg/BatteryState"


def test_lamp_shows_a_boolean_in_words(controls: Any, shown: Any) -> None:
    item, publish = shown('Lamp { path: "/topic:data"; tint: Theme.bad }', "std_msgs/msg/Bool")
    assert (item.property("lit"), controls.find("text").property("text")) == (False, "?")
    publish(data=True)
    assert (item.property("lit"), controls.find("text").property("text")) == (True, "ON")
    publish(data=False)
    assert (item.property("lit"), controls.find("text").property("text")) == (False, "OFF")


def test_lamp_has_thresholds_with_hysteresis(controls: Any, shown: Any) -> None:
    item, publish = shown(
        'Lamp { path: "/topic:voltage"; above: 22; below: 18; hysteresis: 1 }', VOLTAGE
    )
    lit = []
    for voltage in (21.5, 22.0, 21.5, 20.9, 18.5, 18.0, 18.5, 19.5, math.inf, math.nan):
        publish(voltage=voltage)
        lit.append(item.property("lit"))
    assert lit == [False, True, True, False, False, True, True, False, True, False]
    assert item.property("problem") == "not a number"
    item.setProperty("above", 10.0)
    publish(voltage=19.0)
    assert item.property("lit")


@pytest.mark.parametrize(
    ("lamp", "problem"),
    [
        ("Lamp {}", "set path"),
        ('Lamp { path: "/topic" }', "topic:field"),
        ('Lamp { path: "/topic:speed" }', "speed"),
    ],
)
def test_lamp_says_what_is_wrong(controls: Any, wait: Any, lamp: str, problem: str) -> None:
    publisher = controls.robot.create_publisher("/topic", "std_msgs/msg/Bool")
    item = controls.show(lamp)
    if "speed" in lamp:
        wait(publisher.subscription_count)
        publisher.publish(data=True)
    wait(lambda: problem in item.property("problem"))
    assert not item.property("lit")
