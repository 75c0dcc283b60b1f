"""A publisher that stays connected and sends no more."""

from __future__ import annotations

import threading

from tcpros import publisher_links

from rosglass.comm import Durability, QoS
from rosglass.wires.tcpros import arrivals

LATCHED = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)


def count_looks(monkeypatch):
    """Return a list that grows with each check for silent publishers."""
    looks, follow = [], arrivals.SilenceMonitor.update

    def count(self, *given):
        follow(self, *given)
        looks.append(given)

    monkeypatch.setattr(arrivals.SilenceMonitor, "update", count)
    return looks


def test_publisher_that_falls_silent_is_a_problem_until_its_next_message(
    connect, eventually, monkeypatch
):
    monkeypatch.setattr(arrivals, "_REGULAR_SAMPLES", 2)  # takes ten seconds else
    looks = count_looks(monkeypatch)
    robot, cockpit = connect("robot"), connect("cockpit")
    publisher = robot.create_publisher("/odom", "std_msgs/Int32")
    problems = []
    subscription = cockpit.create_subscription("/odom", "std_msgs/Int32", lambda _: None)
    subscription.on_problem_change(problems.append)

    def fall_silent():
        """Send regularly, which a loaded machine may not manage, and then no more."""
        frozen = threading.Event()

        def publish():
            while not frozen.wait(0.02):
                publisher.publish({"data": 1})

        sending = threading.Thread(target=publish, daemon=True)
        sending.start()
        count = len(looks)
        eventually(lambda: len(looks) >= count + 5)
        frozen.set()
        sending.join()
        count = len(looks)
        eventually(lambda: subscription.problem or len(looks) >= count + 5)
        return subscription.problem

    problem = eventually(fall_silent)
    assert problem.startswith("nothing was received from /robot since ")
    assert subscription.publisher_count() == 1
    publisher.publish({"data": 2})
    eventually(lambda: not subscription.problem)
    eventually(lambda: problems[-2:] == [problem, ""])


def test_latched_message_is_not_missed(connect, eventually, monkeypatch):
    monkeypatch.setattr(arrivals, "_REGULAR_SAMPLES", 0)
    robot, cockpit = connect("robot"), connect("cockpit")
    robot.create_publisher("/map", "std_msgs/Int32", LATCHED).publish({"data": 1})
    subscription = cockpit.create_subscription("/map", "std_msgs/Int32")
    assert eventually(subscription.take_latest)
    (link,) = publisher_links(cockpit, "/map")
    for _ in range(3):
        link.check_silence()
    assert not link.silence
