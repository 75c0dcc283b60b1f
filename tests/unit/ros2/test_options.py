from __future__ import annotations

import re

import pytest

import rosglass
from rosglass.connection import default_url
from rosglass.extras import install_command
from rosglass.wires.zenoh.options import ZenohOptions, locator


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("zenoh://robot:7447", ZenohOptions("robot")),
        ("zenoh://robot", ZenohOptions("robot")),
        ("zenoh://192.168.0.7:8000/", ZenohOptions("192.168.0.7", 8000)),
        ("zenoh://[::1]:7447", ZenohOptions("::1")),
        ("zenoh://", ZenohOptions()),
        ("zenoh://r?domain=5", ZenohOptions("r", domain=5)),
        ("zenoh://?domain=5", ZenohOptions(domain=5)),
        ("zenoh://r?mode=client&distro=humble", ZenohOptions("r", mode="client", humble=True)),
        ("zenoh://r?mode=peer&distro=jazzy", ZenohOptions("r", mode="peer")),
        ("zenoh://r?shm=true", ZenohOptions("r", shared_memory=True)),
        ("zenoh://r?shm=false", ZenohOptions("r", shared_memory=False)),
        ("zenoh://r?domain=5&domain=5", ZenohOptions("r", domain=5)),
    ],
)
def test_urls(url, expected):
    assert ZenohOptions.parse(url, {}) == expected


def test_environment_fills_what_the_url_leaves_out():
    env = {"ROS_DOMAIN_ID": "9", "ZENOH_SESSION_CONFIG_URI": "/etc/zenoh.json5"}
    options = ZenohOptions.parse("zenoh://r", env)
    assert (options.domain, options.config_file) == (9, "/etc/zenoh.json5")
    assert ZenohOptions.parse("zenoh://r?domain=2", env).domain == 2
    assert ZenohOptions.parse("zenoh://r", {"ROS_DOMAIN_ID": ""}).domain == 0


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("zenoh://r:0", "address: expected host:port, port 1 to 65535"),
        ("zenoh://r:99999", "address: expected host:port, port 1 to 65535"),
        ("zenoh://r:http", "address: expected host:port"),
        ("zenoh://:7447", "address: expected host:port"),
        ("zenoh://[::1:7447", "url: expected a URL as in zenoh://127.0.0.1:7447?domain=0"),
        ("zenoh://my robot", "host: expected a host name or an address, got 'my robot'"),
        ("zenoh://r/path", "nothing but host, port and options"),
        ("zenoh://user@r", "user: expected a name and a password"),
        ("zenoh://r#x", "nothing but host, port and options"),
        ("zenoh://r?domain=x", "zenoh://r?domain=x: domain: expected a ROS domain"),
        ("zenoh://r?domain=-1", "domain: expected a ROS domain"),
        ("zenoh://r?domain=", "domain: expected a ROS domain"),
        ("zenoh://r?domain=99999999999999999999", "domain: expected a ROS domain"),
        ("zenoh://r?mode=router", "mode: expected one of peer, client, got 'router'"),
        ("zenoh://r?distro=noetic", "distro: expected one of humble, iron"),
        ("zenoh://r?shm=1", "shm: expected one of true, false"),
        (
            "zenoh://r?color=red",
            "option: expected one of domain, mode, distro, shm, tls, ca, cert, key, got 'color'",
        ),
        ("zenoh://r?mode=peer&mode=client", "to be given once"),
    ],
)
def test_bad_urls_are_refused_with_the_part_that_is_wrong(url, message):
    with pytest.raises(rosglass.ConversionError) as error:
        ZenohOptions.parse(url, {})
    assert message in str(error.value)


def test_bad_domain_in_the_environment_is_reported():
    with pytest.raises(rosglass.ConversionError, match="environment: ROS_DOMAIN_ID: expected"):
        ZenohOptions.parse("zenoh://r", {"ROS_DOMAIN_ID": "two"})


def test_locators():
    assert locator("robot", 1) == "tcp/robot:1"
    assert locator("::1", 1) == "tcp/[::1]:1"


@pytest.mark.parametrize(
    ("env", "url"),
    [
        ({"ROSGLASS_URL": "zenoh://r"}, "zenoh://r"),
        ({"ROSGLASS_URL": "zenoh://r", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, "zenoh://r"),
        ({"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, "zenoh://"),
        ({"ZENOH_SESSION_CONFIG_URI": "/x"}, "zenoh://"),
        ({"ZENOH_SESSION_CONFIG_URI": "/x", "ROS_DISTRO": "jazzy"}, "zenoh://"),
        ({"RMW_IMPLEMENTATION": "rmw_zenoh_cpp", "ROS_DOMAIN_ID": "3"}, "zenoh://"),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, "dds://"),
        ({"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}, "dds://"),
        ({"RMW_IMPLEMENTATION": "rmw_fastrtps_dynamic_cpp"}, "dds://"),
        ({"RMW_IMPLEMENTATION": "rmw_connextdds"}, "dds://"),
        ({"ROS_DISTRO": "jazzy"}, "dds://"),
        ({"ROS_DISTRO": "jazzy", "ROS_VERSION": "2"}, "dds://"),
        ({"ROS_DOMAIN_ID": "7"}, "dds://"),
        ({"CYCLONEDDS_URI": "/x.xml"}, "dds://"),
        ({"ROS_MASTER_URI": "http://r:11311"}, "ros1://"),
        ({"ROS_MASTER_URI": "http://r:11311", "ROS_DISTRO": "jazzy"}, "dds://"),
    ],
)
def test_environment_chooses_the_middleware(env, url):
    assert default_url(env) == url


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ({}, "no robot was named: pass a URL to connect()"),
        (
            {"RMW_IMPLEMENTATION": "rmw_email_cpp"},
            "RMW_IMPLEMENTATION=rmw_email_cpp is not known (known: rmw_zenoh_cpp, rmw_cyclonedds",
        ),
        ({"ROS_DISTRO": "noetic", "ROS_VERSION": "1"}, "no robot was named"),
    ],
)
def test_missing_choice_is_reported_with_the_choices(env, message):
    with pytest.raises(rosglass.UnsupportedError) as error:
        default_url(env)
    assert message in str(error.value)
    assert "zenoh://127.0.0.1:7447, dds://?domain=0 or ros1://robot:11311" in str(error.value)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("mqtt://robot", "unknown scheme 'mqtt'; known: dds://"),
        ("zenho://robot", "unknown scheme 'zenho'; did you mean zenoh? Known: dds://"),
        ("http://robot:11311", "unknown scheme 'http'; did you mean ros1://robot:11311? Known:"),
        ("robot:7447", "no scheme; known: dds://"),
        ("dds", "no scheme"),
        ("", "no scheme"),
    ],
)
def test_unknown_scheme_is_refused_with_the_known_ones(url, message):
    with pytest.raises(rosglass.UnsupportedError) as error:
        rosglass.connect(url)
    assert message in str(error.value)


@pytest.mark.parametrize(("url", "package"), [("dds://", "cyclonedds"), ("zenoh://", "zenoh")])
def test_middleware_that_is_not_installed_says_how_to_get_it(monkeypatch, url, package):
    monkeypatch.setattr("rosglass.connection.find_spec", lambda name: None)
    extra = url.partition(":")[0]
    with pytest.raises(rosglass.UnsupportedError, match=re.escape(install_command(extra))):
        rosglass.connect(url)


def test_url_of_another_type_is_refused():
    with pytest.raises(rosglass.ConversionError, match="url: expected a text"):
        rosglass.connect(7447)
