"""The stamps of a simulation, in a node that has the system's time."""

from __future__ import annotations


def test_headers_say_nothing_about_delays_while_a_simulation_publishes_its_time(
    connect, eventually
):
    robot, screen = connect("robot"), connect("screen")
    publisher = robot.create_publisher("/imu", "sensor_msgs/msg/Imu")
    subscription = screen.create_subscription("/imu", "sensor_msgs/msg/Imu")
    eventually(publisher.subscription_count)
    samples = []
    for seconds in (200, 150):
        publisher.publish(header={"stamp": {"sec": seconds}})
        samples.append(subscription.wait(30))
    assert subscription.lateness(samples[1]).seconds > 45
    clock = robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    eventually(lambda: screen.has_simulated_stamps)
    assert not screen.clock.is_simulated
    assert subscription.lateness(samples[1]).seconds < 40
    clock.close()
    eventually(lambda: not screen.has_simulated_stamps)
