"""Checks of Cyclone DDS's configuration; without a network: discovery is off."""

from __future__ import annotations

import importlib.metadata
import multiprocessing
import os
import socket
from contextlib import suppress

import pytest

import rosglass

pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')

from rosglass.wires.dds import cyclone, cyclone_identity
from rosglass.wires.dds import domain as dds_domain
from rosglass.wires.dds.domain import DdsOptions, Domain

URL = "dds://?domain=57&range=off"


def join(url=URL, **env):
    return Domain(DdsOptions.parse(url, env))


@pytest.fixture(autouse=True)
def nothing_stays_joined():
    yield
    assert dds_domain.joined_domains == {}


def test_users_of_a_domain_share_it_and_the_last_one_leaves_it():
    one, two = join(), join()
    one.close()
    one.close()
    assert 57 in dds_domain.joined_domains
    two.close()
    with join("dds://?domain=57&range=off&distro=humble"):
        assert 57 in dds_domain.joined_domains


def test_one_process_cannot_have_two_configurations_for_a_domain():
    with join(), pytest.raises(rosglass.UnsupportedError) as error:
        join("dds://?domain=57&range=localhost")
    assert "in DDS domain 57 with other settings" in str(error.value)
    assert "<AllowMulticast>false" in str(error.value)
    join("dds://?domain=57&range=localhost").close()


@pytest.mark.parametrize(
    ("own", "message"),
    [
        (
            "<CycloneDDS><Domain><General><Colour/></General></Domain></CycloneDDS>",
            (
                "CYCLONEDDS_URI: expected what Cyclone DDS accepts "
                "(config: //CycloneDDS/Domain/General: Colour: unknown element)"
            ),
        ),
        ("<General><MaxMessageSize>lots</MaxMessageSize></General>", "lots: invalid value"),
        ("/no/such/file.xml", "can't open configuration file /no/such/file.xml"),
        # Cyclone DDS ends the process that gives it this.
        ('<Discovery><Peers><Peer Address="robot.invalid"/></Peers></Discovery>', "unknown addr"),
        ("<unfinished", "parser error"),
    ],
)
def test_refused_configuration_is_explained(own, message, capfd):
    with pytest.raises(rosglass.ConversionError) as error:
        join(CYCLONEDDS_URI=own)
    assert message in str(error.value)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("own", ["", "<General><Interfaces/></General>"])
def test_interface_that_is_missing_is_reported(own, capfd):
    with pytest.raises(rosglass.ConversionError) as error:
        join(
            URL + ("" if own else "&interface=wlan77"),
            CYCLONEDDS_URI=own.replace(
                "<Interfaces/>", '<Interfaces><NetworkInterface name="wlan77"/></Interfaces>'
            ),
        )
    assert "interface: expected one of this machine's (wlan77: does not match" in str(error.value)
    assert capfd.readouterr().err == ""


def test_domain_that_other_code_of_this_process_uses_is_joined_with_a_warning(caplog):
    others = cyclone.create_domain(57, "")
    participant = cyclone.create_participant(57, None)
    try:
        joined = join()
        assert "something else in this process takes part in DDS domain 57" in caplog.text
        joined.close()
        assert len(cyclone.guid(participant)) == 16
    finally:
        cyclone.delete(others)


@pytest.fixture
def crowded():
    """Take every port that the programs of a domain have on this machine."""
    taken = []
    for port in range(7400 + 250 * 57 + 10, 7400 + 250 * 57 + 250):
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        taken.append(one)
        with suppress(OSError):
            one.bind(("0.0.0.0", port))
    yield
    for one in taken:
        one.close()


def test_one_program_too_many_is_found_by_multicast(crowded, caplog):
    with join("dds://?domain=57"):
        assert "120 programs of this machine are in it already" in caplog.text
        assert "found by multicast only" in caplog.text


def test_program_beyond_the_last_participant_index_is_refused(crowded):
    with pytest.raises(rosglass.ConnectionLostError, match="120 programs of this machine"):
        join("dds://?domain=57&range=localhost")


class Package:
    """An installed package of some version, with the real one's files."""

    def __init__(self, version):
        self.version, self.files = version, importlib.metadata.distribution("cyclonedds").files


@pytest.mark.parametrize("version", ["11.0.1", "11.3.0"])
def test_other_version_of_the_series_is_used_with_a_warning(monkeypatch, caplog, version):
    package = Package(version)
    monkeypatch.setattr(cyclone, "distribution", lambda _: package)
    assert "libddsc" in cyclone.library_path()
    lost = "services and actions of nodes that use Fast DDS or RustDDS cannot be called"
    assert (lost in caplog.text) == (version != cyclone.VERSION)
    assert bool(cyclone.untested_version()) == (version != cyclone.VERSION)


def test_private_layouts_of_another_version_are_left_alone(monkeypatch):
    monkeypatch.setattr(cyclone, "distribution", lambda _: Package("11.3.0"))
    reason = "cyclonedds 11.3.0 is installed instead of 11.0.1"
    assert cyclone_identity.reading.check(0) == cyclone_identity.writing.check(0) == reason


def test_another_series_is_refused(monkeypatch):
    monkeypatch.setattr(cyclone, "distribution", lambda _: Package("0.10.5"))
    with pytest.raises(rosglass.UnsupportedError, match=r"0\.10\.5 is installed, but 11\.0\.1 is"):
        cyclone.library_path()


def _in_a_fork(answer):
    try:
        join()
    except rosglass.UnsupportedError as error:
        answer.send(str(error))
    os._exit(0)


def test_fork_is_advised_to_spawn():
    with join():
        here, there = multiprocessing.Pipe()
        child = multiprocessing.get_context("fork").Process(target=_in_a_fork, args=(there,))
        child.start()
        assert here.poll(10)
        assert 'multiprocessing.set_start_method("spawn")' in here.recv()
        child.join(10)
