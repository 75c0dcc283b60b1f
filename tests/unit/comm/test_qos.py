from __future__ import annotations

from dataclasses import replace

import pytest

from rosglass import ArgumentError, Duration, QoS
from rosglass.comm import BEST_AVAILABLE, Durability, History, Liveliness, Reliability

SECOND = Duration.from_seconds(1)
BEST_EFFORT = QoS(reliability=Reliability.BEST_EFFORT)
LATCHED = QoS.latched()


@pytest.mark.parametrize(
    ("requested", "offered", "expected"),
    [
        (QoS(), QoS(), ""),
        (BEST_EFFORT, QoS(), ""),
        (QoS(), BEST_EFFORT, "reliability: reliable requested, best effort offered"),
        (QoS(), LATCHED, ""),
        (LATCHED, QoS(), "durability: transient local requested, volatile offered"),
        (QoS(depth=1), QoS(depth=5), ""),
        (QoS(), QoS(deadline=SECOND), ""),
        (QoS(deadline=SECOND), QoS(deadline=SECOND), ""),
        (QoS(deadline=SECOND), QoS(), "deadline: 1.0 s requested, none offered"),
        (
            QoS(deadline=SECOND),
            QoS(deadline=Duration.from_seconds(2)),
            "deadline: 1.0 s requested, 2.0 s offered",
        ),
        (
            QoS(liveliness=Liveliness.MANUAL_BY_TOPIC),
            QoS(),
            "liveliness: manual by topic requested, automatic offered",
        ),
        (QoS(lease_duration=SECOND), QoS(), "lease duration: 1.0 s requested, none offered"),
        (QoS(lifespan=SECOND), QoS(), ""),
    ],
)
def test_incompatibility_names_the_policies_that_dds_would_refuse(requested, offered, expected):
    assert requested.incompatibility(offered) == expected


def test_several_conflicts_are_all_named():
    conflict = LATCHED.incompatibility(BEST_EFFORT)
    assert "reliability" in conflict
    assert "durability" in conflict


@pytest.mark.parametrize("depth", [0, -1, 1.0, "3", True, None, 2**31])
def test_depth_must_be_a_positive_integer(depth):
    with pytest.raises(ArgumentError, match="QoS: depth: expected an integer from 1 to") as raised:
        QoS(depth=depth)
    assert isinstance(raised.value, ValueError)
    assert isinstance(raised.value, TypeError)


def test_preset_name_as_depth_is_refused_naming_the_profile():
    with pytest.raises(ArgumentError, match=r"use QoS.preset\('sensor_data'\), got 'sensor_data'"):
        QoS("sensor_data")
    with pytest.raises(ArgumentError, match=r"a profile such as QoS.sensor_data\(\)"):
        QoS("sensor")


def test_presets_are_ros_2s():
    assert QoS.sensor_data() == QoS(depth=5, reliability=Reliability.BEST_EFFORT)
    assert QoS.latched(3) == QoS(depth=3, durability=Durability.TRANSIENT_LOCAL)
    assert QoS.clock().depth == 1
    assert QoS.services() == QoS(depth=10)
    assert QoS.parameters() == QoS.parameter_events() == QoS(depth=1000)
    assert QoS.action_status() == QoS.latched(1)
    assert QoS.rosout() == replace(QoS.latched(1000), lifespan=Duration.from_seconds(10))
    assert QoS().with_depth(3) == QoS(depth=3)


@pytest.mark.parametrize(
    ("policy", "value", "expected"),
    [
        ("reliability", "reliable", "Reliability.RELIABLE or Reliability.BEST_EFFORT"),
        ("durability", 3, "Durability.VOLATILE or"),
        ("history", None, "History.KEEP_LAST or"),
        ("liveliness", Reliability.RELIABLE, "Liveliness.AUTOMATIC or"),
        ("deadline", 1.0, "Duration.from_seconds"),
        ("lifespan", Duration(-1), "above zero"),
        ("lease_duration", Duration(0), "above zero"),
    ],
)
def test_policies_are_checked_where_they_are_written(policy, value, expected):
    with pytest.raises(ArgumentError, match=f"QoS: {policy}: expected .*{expected}"):
        QoS(**{policy: value})


def test_limit_must_fit_into_64_bits_and_a_lifespan_is_the_publishers_alone():
    with pytest.raises(ArgumentError, match="below 292 years"):
        QoS(deadline=Duration(2**63 - 1))
    with pytest.raises(ArgumentError, match=r"lifespan: .*as it is the publisher's alone"):
        QoS(lifespan=BEST_AVAILABLE)


def test_send_timeout_is_applied_by_the_sender_and_not_announced():
    command = QoS.command()
    assert (command.depth, command.reliability) == (1, Reliability.RELIABLE)
    assert command.durability is Durability.VOLATILE
    assert command.lifespan is command.deadline is None, "a reader's clock may be another"
    assert command.send_timeout == Duration.from_seconds(0.3)
    assert QoS().conflicts(command) == {}, "robots' default subscriptions match"
    assert command.for_publisher([LATCHED]) is command


@pytest.mark.parametrize(
    ("policies", "expected"),
    [
        ({"durability": Durability.TRANSIENT_LOCAL}, "latched messages are received late"),
        ({"durability": Durability.BEST_AVAILABLE}, "latched messages are received late"),
        ({"history": History.KEEP_ALL}, "keep all drops nothing"),
        ({"send_timeout": BEST_AVAILABLE}, "as it is the publisher's alone"),
        ({"send_timeout": 0.3}, "a Duration above zero"),
    ],
)
def test_send_timeout_that_contradicts_the_profile_is_refused(policies, expected):
    with pytest.raises(ArgumentError, match=f"QoS: send_timeout: expected .*{expected}"):
        QoS(**{"send_timeout": SECOND, **policies})


def test_presets_by_name():
    assert QoS.preset("sensor_data") == QoS.sensor_data()
    assert QoS.preset("default") == QoS()
    for name in ("sensor", None):
        with pytest.raises(ArgumentError, match="one of default, command, sensor_data, latched"):
            QoS.preset(name)


# -- what is left open ---------------------------------------------------------------------------

BEST = QoS.best_available()
MANUAL = QoS(liveliness=Liveliness.MANUAL_BY_TOPIC)


def test_decided_policies_are_kept():
    for profile in (QoS(), LATCHED, BEST_EFFORT, MANUAL):
        assert profile.is_decided
        assert profile.for_subscription([BEST_EFFORT]) is profile
        assert profile.for_publisher([LATCHED]) is profile


def test_systems_default_is_reliable_volatile_and_keeps_the_last():
    assert not QoS.system_default().is_decided
    assert QoS.system_default().for_subscription([BEST_EFFORT]) == QoS()
    assert QoS.system_default().for_publisher() == QoS()


@pytest.mark.parametrize(
    ("offered", "expected"),
    [
        ([], QoS.latched(10)),
        ([QoS()], QoS()),
        ([LATCHED, LATCHED], QoS.latched(10)),
        ([LATCHED, QoS()], QoS()),
        ([LATCHED, BEST_EFFORT], QoS(reliability=Reliability.BEST_EFFORT)),
        ([MANUAL], MANUAL),
        ([MANUAL, QoS()], QoS()),
        ([QoS(deadline=SECOND)], QoS(deadline=SECOND)),
        (
            [QoS(deadline=SECOND), QoS(deadline=Duration.from_seconds(2))],
            QoS(deadline=Duration.from_seconds(2)),
        ),
        ([QoS(deadline=SECOND), QoS()], QoS()),
        ([QoS(lease_duration=SECOND)], QoS(lease_duration=SECOND)),
    ],
)
def test_subscription_takes_the_strongest_that_matches_all_publishers(offered, expected):
    decided = BEST.for_subscription(offered)
    assert decided == expected
    assert decided.is_decided
    assert [decided.incompatibility(one) for one in offered] == [""] * len(offered)


@pytest.mark.parametrize(
    ("requested", "expected"),
    [
        ([], QoS.latched(10)),
        ([BEST_EFFORT, QoS()], QoS.latched(10)),
        ([MANUAL, QoS()], replace(QoS.latched(10), liveliness=Liveliness.MANUAL_BY_TOPIC)),
        (
            [QoS(deadline=SECOND), QoS(deadline=Duration.from_seconds(2)), QoS()],
            replace(QoS.latched(10), deadline=SECOND),
        ),
        ([QoS(lease_duration=SECOND)], replace(QoS.latched(10), lease_duration=SECOND)),
    ],
)
def test_publisher_offers_what_matches_all_subscriptions(requested, expected):
    decided = BEST.for_publisher(requested)
    assert decided == expected
    assert [one.incompatibility(decided) for one in requested] == [""] * len(requested)


def test_single_policies_can_be_left_open():
    open_one = replace(LATCHED, reliability=Reliability.BEST_AVAILABLE)
    assert open_one.for_subscription([BEST_EFFORT]).reliability is Reliability.BEST_EFFORT
    assert open_one.for_subscription([BEST_EFFORT]).durability is Durability.TRANSIENT_LOCAL


@pytest.mark.parametrize("other", [QoS(), LATCHED, BEST_EFFORT, MANUAL, QoS(deadline=SECOND), BEST])
def test_best_available_conflicts_with_no_profile(other):
    assert BEST.conflicts(other) == {}
    assert other.conflicts(BEST) == {}


def test_conflicts_by_policy():
    assert LATCHED.conflicts(BEST_EFFORT) == {
        "reliability": "reliable requested, best effort offered",
        "durability": "transient local requested, volatile offered",
    }
