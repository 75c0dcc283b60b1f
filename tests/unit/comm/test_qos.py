from __future__ import annotations

import pytest

from rosglass import Duration, QoS, UnsupportedError
from rosglass.comm import Durability, Liveliness, Reliability

SECOND = Duration.from_seconds(1)
BEST_EFFORT = QoS(reliability=Reliability.BEST_EFFORT)
LATCHED = QoS.latched()


@pytest.mark.parametrize(
    ("requested", "offered", "told"),
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
def test_incompatibility_names_the_policies_that_dds_would_refuse(requested, offered, told):
    assert requested.incompatibility(offered) == told


def test_several_conflicts_are_all_named():
    told = LATCHED.incompatibility(BEST_EFFORT)
    assert "reliability" in told
    assert "durability" in told


@pytest.mark.parametrize("depth", [0, -1, 1.0, "3", True, None, 2**31])
def test_depth_must_be_a_positive_integer(depth):
    with pytest.raises(UnsupportedError, match="depth must be an integer from 1"):
        QoS(depth=depth)


def test_presets_are_ros_2s():
    assert QoS.sensor_data() == QoS(depth=5, reliability=Reliability.BEST_EFFORT)
    assert QoS.latched(3) == QoS(depth=3, durability=Durability.TRANSIENT_LOCAL)
    assert QoS.clock().depth == 1
    assert QoS.services() == QoS(depth=10)
    assert QoS().with_depth(3) == QoS(depth=3)


@pytest.mark.parametrize(
    ("policy", "value", "told"),
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
def test_policies_are_checked_where_they_are_written(policy, value, told):
    with pytest.raises(UnsupportedError, match=f"QoS {policy} must be .*{told}"):
        QoS(**{policy: value})
