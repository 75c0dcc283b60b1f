from __future__ import annotations

import pytest

import rosglass
from rosglass.wires.dds.domain import DdsOptions, DiscoveryRange

SUBNET, LOCALHOST = DiscoveryRange.SUBNET, DiscoveryRange.LOCALHOST
OFF, SYSTEM_DEFAULT = DiscoveryRange.OFF, DiscoveryRange.SYSTEM_DEFAULT


def options(url, **env):
    return DdsOptions.parse(url, env)


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("dds://", {}),
        ("dds:///", {}),
        ("dds://?domain=5", {"domain": 5}),
        ("dds://?domain=232", {"domain": 232}),
        ("dds://192.168.1.5?domain=0", {"peers": ("192.168.1.5",)}),
        ("dds://robot", {"peers": ("robot",)}),
        ("dds://a;b,c", {"peers": ("a", "b", "c")}),
        ("dds://?peers=a;b", {"peers": ("a", "b")}),
        ("dds://a?peers=a,b", {"peers": ("a", "b")}),
        ("dds://?peers=10.0.0.1:7412", {"peers": ("10.0.0.1:7412",)}),
        ("dds://?range=localhost", {"discovery": LOCALHOST}),
        ("dds://?range=OFF", {"discovery": OFF}),
        ("dds://?range=system_default", {"discovery": SYSTEM_DEFAULT}),
        ("dds://?interface=eth0", {"interfaces": ("eth0",)}),
        ("dds://?interface=eth0,192.168.1.2", {"interfaces": ("eth0", "192.168.1.2")}),
        ("dds://?distro=humble", {"humble": True}),
        ("dds://?distro=jazzy", {"humble": False}),
        ("dds://?domain=5&domain=5", {"domain": 5}),
    ],
)
def test_urls(url, expected):
    parsed = options(url)
    for name in ("domain", "peers", "interfaces", "humble", "discovery", "config"):
        assert getattr(parsed, name) == expected.get(name, getattr(DdsOptions(), name)), name


@pytest.mark.parametrize(
    ("env", "expected"),
    [
        ({"ROS_DOMAIN_ID": "9"}, {"domain": 9}),
        ({"ROS_DOMAIN_ID": ""}, {}),
        ({"ROS_LOCALHOST_ONLY": "1"}, {"discovery": LOCALHOST}),
        ({"ROS_LOCALHOST_ONLY": "0"}, {}),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, {"discovery": LOCALHOST}),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, {"discovery": OFF}),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": ""}, {}),
        ({"ROS_STATIC_PEERS": "robot; 10.0.0.2;"}, {"peers": ("robot", "10.0.0.2")}),
        (
            {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
            | {"ROS_STATIC_PEERS": "robot"},
            {"discovery": LOCALHOST},
        ),
        ({"CYCLONEDDS_URI": " /etc/c.xml,<General/> "}, {"config": "/etc/c.xml,<General/>"}),
    ],
)
def test_environment_fills_what_the_url_leaves_out(env, expected):
    parsed = options("dds://", **env)
    for name in ("domain", "peers", "discovery", "config"):
        assert getattr(parsed, name) == expected.get(name, getattr(DdsOptions(), name)), name


def test_url_wins_over_the_environment():
    env = {"ROS_DOMAIN_ID": "9", "ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "robot"}
    parsed = options("dds://other?domain=2&range=subnet", **env)
    assert (parsed.domain, parsed.discovery) == (2, SUBNET)
    assert parsed.peers == ("other", "robot")
    assert parsed.chosen == {"domain", "range", "peers"}


def test_peers_are_dropped_with_a_warning_when_discovery_is_off(caplog):
    env = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "robot"}
    assert options("dds://", **env).peers == ()
    assert "ignoring ROS_STATIC_PEERS=robot: ROS_AUTOMATIC_DISCOVERY_RANGE=off" in caplog.text


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("dds://?domain=233", "domain: expected a ROS domain: 0 to 232"),
        ("dds://?domain=-1", "domain: expected a ROS domain"),
        ("dds://?domain=", "domain: expected a ROS domain"),
        ("dds://?domain=99999999999999999999", "domain: expected a ROS domain"),
        ("dds://robot:7400", "address: expected no port: DDS derives it from the domain"),
        ("dds://[::1]", "peer: expected a host name or an IPv4 address, got '[::1]'"),
        ("dds://[::1", "url: expected a URL as in dds://?domain=0"),
        ("dds://my robot", "peer: expected a host name or an IPv4 address, got 'my robot'"),
        ("dds://r/path", "nothing but peers and options"),
        ("dds://user@r", "nothing but peers and options"),
        ("dds://r#x", "nothing but peers and options"),
        ("dds://?range=far", "range: expected one of subnet, localhost, off, system_default"),
        ("dds://?peers=", "peers: expected a host name or an IPv4 address, got ''"),
        ("dds://?peers=a b", "peers: expected a host name or an IPv4 address, got 'a b'"),
        ("dds://?interface=", "interface: expected an interface's name or address"),
        ("dds://?interface=<x>", "interface: expected an interface's name or address"),
        ("dds://?distro=noetic", "distro: expected one of humble, iron"),
        ("dds://robot?range=off", "peers: expected range=subnet or range=localhost beside them"),
        ("dds://?mode=peer", "option: expected one of domain, range, peers, interface, distro"),
        ("dds://?domain=1&domain=2", "domain: expected to be given once, not also 2"),
    ],
)
def test_bad_urls_are_refused_with_the_part_that_is_wrong(url, message):
    with pytest.raises(rosglass.ConversionError) as error:
        options(url)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ({"ROS_DOMAIN_ID": "233"}, "environment: ROS_DOMAIN_ID: expected a ROS domain: 0 to 232"),
        ({"ROS_DOMAIN_ID": "two"}, "environment: ROS_DOMAIN_ID: expected a ROS domain"),
        ({"ROS_LOCALHOST_ONLY": "yes"}, "environment: ROS_LOCALHOST_ONLY: expected 0 or 1"),
        (
            {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCAL"},
            "ROS_AUTOMATIC_DISCOVERY_RANGE: expected one of SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT",
        ),
        ({"ROS_STATIC_PEERS": "a b"}, "ROS_STATIC_PEERS: expected host names or IPv4 addresses"),
    ],
)
def test_bad_variables_are_reported(env, message):
    with pytest.raises(rosglass.ConversionError) as error:
        options("dds://", **env)
    assert message in str(error.value)


def test_named_peers_contradict_a_range_from_the_environment():
    with pytest.raises(rosglass.ConversionError, match="ROS_AUTOMATIC_DISCOVERY_RANGE=off"):
        options("dds://robot", ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")


def test_enforced_security_is_refused_and_not_left_out(monkeypatch, caplog):
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    with pytest.raises(rosglass.UnsupportedError, match=r"SROS2.*Enforce forbids to connect"):
        rosglass.connect("dds://?range=off")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Permissive")
    with rosglass.connect("dds://?range=off", own_services=False):
        assert "connecting without it, to nodes without it" in caplog.text
