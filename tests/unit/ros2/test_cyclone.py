"""The parts of Cyclone DDS's binding that need no network: the library, errors, profiles."""

from __future__ import annotations

import gc
import importlib.metadata
import re

import pytest

from rosglass.comm import Durability, Duration, History, Liveliness, QoS, Reliability
from rosglass.errors import (
    ConnectionLostError,
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)
from rosglass.extras import install_command

pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
from rosglass.wires.dds import cyclone

PROFILES = [
    QoS(),
    QoS.sensor_data(),
    QoS.latched(3),
    QoS(history=History.KEEP_ALL),
    QoS(
        depth=7,
        deadline=Duration(1_500_000_001),
        liveliness=Liveliness.MANUAL_BY_TOPIC,
        lease_duration=Duration.from_seconds(2),
    ),
    QoS(reliability=Reliability.BEST_EFFORT, lease_duration=Duration(3)),
]


@pytest.fixture
def fresh():
    """Forget the library before and after."""
    for loaded in (cyclone.library, cyclone.library_with_gil):
        loaded.cache_clear()
    yield
    for loaded in (cyclone.library, cyclone.library_with_gil):
        loaded.cache_clear()


@pytest.mark.parametrize("writer", [True, False])
@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_profiles_are_kept(profile, writer):
    kept = cyclone.qos_of(profile, writer=writer).profile()
    if profile.history is History.KEEP_ALL:
        profile = profile.with_depth(kept.depth)
    assert kept == profile


def test_only_writers_have_a_lifespan():
    brief = QoS(lifespan=Duration.from_seconds(0.5))
    assert cyclone.qos_of(brief, writer=True).profile() == brief
    assert cyclone.qos_of(brief, writer=False).profile() == QoS()


def test_empty_profile_is_ddss_default():
    profile = cyclone.Qos().profile()
    assert profile.reliability is Reliability.BEST_EFFORT
    assert profile.durability is Durability.VOLATILE
    assert (profile.deadline, profile.lifespan, profile.lease_duration) == (None, None, None)


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_profile_interrupted_at_its_making_frees_nothing(monkeypatch):
    def interrupt():
        raise KeyboardInterrupt

    monkeypatch.setattr(cyclone, "library", interrupt)
    with pytest.raises(KeyboardInterrupt):
        cyclone.Qos()
    gc.collect()


def test_user_data_is_any_bytes():
    qos = cyclone.qos_of(QoS(), writer=True, user_data=b"typehash=x;\0\xff")
    assert qos.user_data() == b"typehash=x;\0\xff"
    assert cyclone.Qos().user_data() == b""
    assert cyclone.Qos().property("__Hostname") == ""


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (-1, ConnectionLostError),
        (-2, UnsupportedError),
        (-3, UnsupportedError),
        (-5, ConnectionLostError),
        (-8, UnsupportedError),
        (-9, NodeClosedError),
        (-10, TimeoutError),
        (-99, ConnectionLostError),
    ],
)
def test_failed_calls_are_named_with_what_they_were_for(code, kind):
    with pytest.raises(kind, match=rf"topic /scan: .*dds_create_reader failed with code {code}:"):
        cyclone.check(code, "dds_create_reader", "topic /scan")


def test_result_of_a_successful_call_is_returned():
    assert cyclone.check(17, "dds_take", "topic /scan") == 17
    assert cyclone.check_alive(0, "dds_take", "topic /scan") == 0


def test_calls_for_entities_that_are_gone():
    for code in (-3, -4, -9, -12):
        with pytest.raises(NodeClosedError):
            cyclone.check_alive(code, "dds_takecdr", "topic /scan")
    with pytest.raises(NodeClosedError):
        cyclone.guid(12345)
    cyclone.delete(12345)


def test_missing_package_is_reported_with_the_install_command(fresh, monkeypatch):
    def missing(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(cyclone, "distribution", missing)
    with pytest.raises(UnsupportedError, match=re.escape(install_command("dds"))):
        cyclone.library()


def test_another_version_is_refused(fresh, monkeypatch):
    class Other:
        version = "0.10.5"
        files = ()

    monkeypatch.setattr(cyclone, "distribution", lambda _: Other)
    with pytest.raises(UnsupportedError, match=rf"0\.10\.5 is installed, but {cyclone.VERSION}"):
        cyclone.library()


def test_package_without_library_is_refused(fresh, monkeypatch):
    class Empty:
        version = cyclone.VERSION
        files = ()

    monkeypatch.setattr(cyclone, "distribution", lambda _: Empty)
    with pytest.raises(UnsupportedError, match="no library in it"):
        cyclone.library_with_gil()
