from __future__ import annotations

import os
import re
import struct
import threading
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import rosglass
from rosglass.wires.dds import domain as dds_domain
from rosglass.wires.dds.domain import DdsOptions, domain_config, large_sample_advice, user_config

ROS2_PAGE = Path(__file__).parents[3] / "docs" / "ros2.md"


def config(url="dds://", **env):
    return domain_config(DdsOptions.parse(url, env))


def ours(url="dds://", **env):
    """Our part of a configuration, as a tree."""
    return ET.fromstring(config(url, **env)).find("Domain")


@pytest.mark.parametrize("url", ["dds://?range=localhost", "dds://?interface=lo"])
def test_big_messages_get_big_datagrams_on_this_machine(url):
    domain = ours(url)
    assert domain.findtext("General/MaxMessageSize") == "31000B"
    assert domain.findtext("General/FragmentSize") == "30872B"


def test_on_a_network_a_datagram_is_one_packet(monkeypatch):
    """The kernel's memory for IP fragments fills up where packets are lost."""
    mtus = {"lo": 65536, "test0": 1500, "test1": 1420, "test2": 9000}
    names = list(enumerate(mtus, 1))

    def ioctl(_, request, argument):
        name = argument[:16].rstrip(b"\0").decode()
        flags = 0x49 if name == "lo" else 0x1 if name != "test2" else 0x0  # it is down
        address = bytes((10, 0, 0, next(n for n, each in names if each == name)))
        found = {0x8913: struct.pack("H", flags), 0x8921: struct.pack("i", mtus[name])}
        return argument[:16] + found.get(request, b"\0" * 4 + address).ljust(16, b"\0")

    monkeypatch.setattr("socket.if_nameindex", lambda: names)
    monkeypatch.setattr("fcntl.ioctl", ioctl)
    for url, size in (
        ("interface=test0", "1472B"),
        ("interface=10.0.0.2", "1472B"),
        ("interface=test0,test1", "1392B"),
        ("range=localhost", "31000B"),
    ):
        assert ours(f"dds://?{url}").findtext("General/MaxMessageSize") == size, url
    # Once per process; that of this machine stays for the other tests.
    assert dds_domain.datagram_size.__wrapped__(()) == 1392


def test_socket_has_room():
    domain = ours()
    assert domain.find("Internal/SocketReceiveBufferSize").attrib == {
        "min": "default",
        "max": "10MB",
    }


@pytest.mark.parametrize(
    ("url", "multicast", "index", "localhost"),
    [
        ("dds://", None, "auto", "default"),
        ("dds://?range=localhost", "false", "auto", "true"),
        ("dds://?range=off", "false", "none", "false"),
        ("dds://?range=system_default", None, None, None),
    ],
)
def test_range_becomes_settings_as_in_rmw_cyclonedds(url, multicast, index, localhost):
    domain = ours(url)
    assert domain.findtext("General/AllowMulticast") == multicast
    assert domain.findtext("Discovery/ParticipantIndex") == index
    peers = domain.find("Discovery/Peers")
    assert (None if peers is None else peers.get("AddLocalhost")) == localhost
    tag = domain.findtext("Discovery/Tag")
    assert tag == (f"ros_discovery_off_{os.getpid()}" if "off" in url else None)


def test_there_is_room_for_a_hundred_programs_on_a_machine():
    assert int(ours().findtext("Discovery/MaxAutoParticipantIndex")) >= 100


def test_peers_are_asked_for_ever_and_by_address(monkeypatch):
    found = [(0, 0, 0, "", ("10.0.0.7", 0))]
    look_up = dds_domain.socket.getaddrinfo
    monkeypatch.setattr(
        dds_domain.socket,
        "getaddrinfo",
        lambda host, *rest: found if host == "robot" else look_up(host, *rest),
    )
    around = ours("dds://robot;10.0.0.9", ROS_STATIC_PEERS="10.0.0.8:7412").find("Discovery/Peers")
    assert [peer.get("Address") for peer in around] == ["10.0.0.7", "10.0.0.9", "10.0.0.8:7412"]
    assert {peer.get("PruneDelay") for peer in around} == {"inf"}
    assert around.get("AddLocalhost") == "default"


@pytest.mark.parametrize("peer", ["localhost", "127.0.0.1", "127.0.1.1"])
def test_this_machine_as_a_peer_is_whatever_address_it_uses(peer):
    around = ours(f"dds://{peer}").find("Discovery/Peers")
    assert (around.get("AddLocalhost"), len(around)) == ("true", 0)


def test_unresolvable_peer_is_reported():
    with pytest.raises(rosglass.ConnectionLostError, match=r"address of peer 'robot\.invalid'"):
        config("dds://robot.invalid")


def test_name_server_that_does_not_answer_does_not_block(monkeypatch):
    never = threading.Event()

    def look_up(*_):
        never.wait(30)
        raise OSError

    monkeypatch.setattr(dds_domain, "_LOOK_UP_TIMEOUT_S", 0.05)
    monkeypatch.setattr(dds_domain.socket, "getaddrinfo", look_up)
    with pytest.raises(rosglass.ConnectionLostError, match="no answer within"):
        config("dds://slow")
    never.set()


@pytest.mark.parametrize(
    ("url", "interval"),
    [("dds://", "1s"), ("dds://10.0.0.9", "2s"), ("dds://localhost", "1s")],
)
def test_participants_announce_themselves_every_few_seconds(url, interval):
    assert ours(url).findtext("Discovery/SPDPInterval") == interval


def test_interfaces_by_name_and_address():
    found = ours("dds://?interface=eth0,192.168.1.2").findall("General/Interfaces/NetworkInterface")
    assert [interface.attrib for interface in found] == [
        {"name": "eth0"},
        {"address": "192.168.1.2"},
    ]


LO = '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
LO += "</General></Domain></CycloneDDS>"


def test_users_own_configuration_comes_last_and_so_wins():
    whole = config(CYCLONEDDS_URI=LO)
    assert whole.endswith("," + LO)
    assert user_config(whole) == LO
    assert user_config(config()) == ""


@pytest.mark.parametrize(
    ("url", "own", "element"),
    [
        ("dds://?interface=eth0", LO, "Interfaces"),
        (
            "dds://?interface=eth0",
            "<general><networkinterfaceaddress>lo</networkinterfaceaddress></general>",
            "NetworkInterfaceAddress",
        ),
        (
            "dds://?range=localhost",
            "<General><AllowMulticast>spdp</AllowMulticast></General>",
            "AllowMulticast",
        ),
        ("dds://?range=localhost", "FILE", "AllowMulticast"),
        ("dds://?range=localhost", "file://FILE,<General/>", "AllowMulticast"),
        (
            "dds://?range=localhost&domain=5",
            '<Domain Id="5"><General><AllowMulticast>true</AllowMulticast></General></Domain>',
            "AllowMulticast",
        ),
    ],
)
def test_option_in_both_url_and_user_configuration_is_refused(tmp_path, url, own, element):
    file = tmp_path / "cyclone.xml"
    file.write_text("<General><AllowMulticast>spdp,asm</AllowMulticast></General>")
    with pytest.raises(rosglass.ConversionError) as error:
        config(url, CYCLONEDDS_URI=own.replace("FILE", str(file)))
    assert f"expected CYCLONEDDS_URI without <{element}>" in str(error.value)


@pytest.mark.parametrize(
    ("url", "own"),
    [
        ("dds://", LO),
        ("dds://?interface=eth0", "<General><!-- <Interfaces/> --></General>"),
        (
            "dds://?range=localhost&domain=4",
            '<Domain Id="5"><General><AllowMulticast>true</AllowMulticast></General></Domain>',
        ),
        ("dds://?range=localhost", "/no/such/file.xml"),
    ],
)
def test_user_configuration_without_conflict_is_kept(url, own):
    assert user_config(config(url, CYCLONEDDS_URI=own)) == own


def test_documentations_larger_datagrams_are_those_of_this_machine():
    (own,) = re.findall(r"^  export CYCLONEDDS_URI='(.*)'$", ROS2_PAGE.read_text(), re.MULTILINE)
    assert own.removesuffix("</General>") in config("dds://?range=localhost")
    assert user_config(config(CYCLONEDDS_URI=own)) == own


def test_publisher_of_single_packets_is_advised_to_send_documented_datagrams(monkeypatch):
    monkeypatch.setattr(dds_domain, "datagram_size", lambda _: 1472)

    def advice(url="dds://", **env):
        return large_sample_advice(DdsOptions.parse(url, env))

    (own,) = re.findall(r"CYCLONEDDS_URI='(.*?)'", advice())
    assert f"  export CYCLONEDDS_URI='{own}'\n" in ROS2_PAGE.read_text()
    assert advice("dds://?range=localhost") == advice(CYCLONEDDS_URI=own) == ""
