"""Messages without stamps that a bad link has held back."""

from __future__ import annotations

import pytest
from tcpros import publisher_links
from waiting import eventually

from rosglass.wires.tcpros import arrivals
from rosglass.wires.tcpros.arrivals import BacklogMonitor

PERIOD = 0.1


@pytest.fixture
def monitor() -> BacklogMonitor:
    """A monitor of a publisher that sends ten messages per second; the last one came at 100 s."""
    made = BacklogMonitor()
    made.set_period(PERIOD, 100.0)
    made.add(1, 100.0)
    return made


def lateness(monitor: BacklogMonitor, *arrivals: tuple[float, int]) -> list[float]:
    """Let messages arrive, given by time and count; return how late the last of each is."""
    found = []
    for at, count in arrivals:
        monitor.add(count, at)
        found.append(monitor.late)
    return found


def test_messages_in_time_are_not_late(monitor: BacklogMonitor) -> None:
    times = [100 + PERIOD * n + (0.04 if n % 2 else 0) for n in range(1, 100)]
    assert not any(lateness(monitor, *((at, 1) for at in times)))
    # Read in batches, as sockets are that are not urgent.
    assert not any(lateness(monitor, *((110 + n, 10) for n in range(1, 20))))


def test_each_message_after_an_outage_makes_up_for_its_part(monitor: BacklogMonitor) -> None:
    burst = [(110.0 + n / 1000, 1) for n in range(100)]
    found = lateness(monitor, *burst)
    assert found[0] == pytest.approx(9.9, abs=0.01)
    assert found[50] == pytest.approx(4.9, abs=0.1)
    assert found[99] == pytest.approx(0, abs=0.11)
    assert not any(lateness(monitor, *((110.2 + PERIOD * n, 1) for n in range(15)))[10:])
    assert lateness(BacklogMonitor(), *burst) == [0] * 100, "of an irregular publisher"


def test_backlog_that_arrives_at_once_ends_with_the_newest(
    monitor: BacklogMonitor,
) -> None:
    assert lateness(monitor, (110.0, 100)) == [0]
    assert lateness(monitor, (120.0, 40), (120.01, 60)) == pytest.approx([6.0, 0.01], abs=0.05)


def test_publisher_that_died_in_the_outage_never_becomes_live(monitor: BacklogMonitor) -> None:
    assert lateness(monitor, *[(110.0 + n / 1000, 1) for n in range(20)])[-1] > 7.9


def test_link_that_loses_packets_holds_back_again_and_again(monitor: BacklogMonitor) -> None:
    # 1.6 s of nothing, half of it at once, 0.5 s of nothing, the rest.
    found = lateness(monitor, (101.6, 1), (101.61, 7), (102.1, 1), (102.11, 12))
    assert found == pytest.approx([1.5, 0.81, 1.2, 0.01], abs=0.02)


def test_messages_that_the_publisher_dropped_are_not_waited_for(monitor: BacklogMonitor) -> None:
    # After the outage only the newest one, then as usual.
    found = lateness(monitor, *((110.0 + PERIOD * n, 1) for n in range(20)))
    assert found[0] == found[5] == pytest.approx(9.9), "by chance, part of a backlog may look so"
    assert found[11:] == [0] * 9


def test_publisher_that_sends_less_often_is_not_late_for_long(monitor: BacklogMonitor) -> None:
    assert not any(lateness(monitor, *((100 + 0.25 * n, 1) for n in range(1, 50))))
    found = lateness(monitor, *((113 + 1.0 * n, 1) for n in range(1, 10)))
    assert found[-1] > 5, "each of them may have been held back"
    monitor.set_period(0.0, 114.0)
    assert monitor.late > 5
    monitor.set_period(0.0, 116.0)
    assert monitor.late == 0, "it is not regular any more"


def test_subscriptions_know_by_their_publisher(connect, monkeypatch) -> None:
    monkeypatch.setattr(arrivals, "_REGULAR_SAMPLES", 1)
    robot, cockpit = connect("robot", own_services=False), connect("cockpit", own_services=False)
    publisher = robot.create_publisher("/stop", "std_msgs/Bool")
    subscription = cockpit.create_subscription("/stop", "std_msgs/Bool")
    eventually(subscription.publisher_count)

    def is_regular() -> bool:
        publisher.publish(data=True)
        return publisher_links(cockpit, "/stop")[0].backlog.period > 0

    eventually(is_regular)
    link = publisher_links(cockpit, "/stop")[0]
    link.backlog.received_at -= 30.0  # an outage
    while subscription.take() is not None:
        pass
    publisher.publish(data=True)
    sample = subscription.wait(30)
    late = subscription.lateness(sample).seconds
    assert 20 < late < 40
    assert subscription.lateness(sample._replace(publisher=b"/other")).seconds == 0
