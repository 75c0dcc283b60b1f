from __future__ import annotations

import json

import pytest
import zenoh

import rosglass
from rosglass.wires.zenoh.options import ZenohOptions, shown_url
from rosglass.wires.zenoh.session import reason, router_config, session_config

RMW_FILE = """
// As rmw_zenoh ships it: JSON5 with comments, settings for each mode.
{
  mode: "client",
  connect: { endpoints: { router: [], peer: ["tcp/localhost:7447"], client: ["tcp/far:7447"] } },
  scouting: { multicast: { enabled: true } },
  transport: { shared_memory: { enabled: true } },
}
"""


def setting(config, key):
    return json.loads(config.get_json(key))


@pytest.fixture
def rmw_file(tmp_path):
    file = tmp_path / "session.json5"
    file.write_text(RMW_FILE)
    return str(file)


def test_session_stays_on_this_machine_by_default():
    config, address = session_config(ZenohOptions("localhost", 8000))
    assert address == "tcp/localhost:8000"
    assert setting(config, "mode") == "peer"
    assert setting(config, "connect/endpoints") == ["tcp/localhost:8000"]
    assert setting(config, "listen/endpoints") == ["tcp/127.0.0.1:0"]
    assert setting(config, "scouting/multicast/enabled") is False
    assert setting(config, "scouting/gossip/enabled") is True
    assert setting(config, "transport/shared_memory/enabled") is False


def test_without_a_host_it_is_this_machine():
    assert session_config(ZenohOptions())[1] == "tcp/127.0.0.1:7447"


@pytest.mark.parametrize("host", ["robot", "10.0.0.7", "fe80::7"])
def test_session_is_a_client_of_another_machine(host):
    config, _ = session_config(ZenohOptions(host))
    assert setting(config, "mode") == "client"
    assert setting(session_config(ZenohOptions(host, mode="peer"))[0], "mode") == "peer"


def test_parts_of_messages_wait_on_links_of_this_machine_only() -> None:
    waiting = "transport/link/tx/queue/size/data"
    usual = setting(zenoh.Config(), waiting)
    assert setting(session_config(ZenohOptions())[0], waiting) > usual
    for mode in ("client", "peer"):
        elsewhere, _ = session_config(ZenohOptions("192.168.1.5", mode=mode))
        assert setting(elsewhere, waiting) == usual


def test_clients_do_not_listen():
    config, _ = session_config(ZenohOptions(mode="client"))
    assert setting(config, "mode") == "client"
    assert setting(config, "listen/endpoints") == []


def test_shared_memory_on_request():
    config, _ = session_config(ZenohOptions(shared_memory=True))
    assert setting(config, "transport/shared_memory/enabled") is True


def test_every_session_has_an_id_of_its_own_without_leading_zeros():
    ids = {setting(session_config(ZenohOptions())[0], "id") for _ in range(50)}
    assert len(ids) == 50
    assert all(len(i) == 32 and i[0] != "0" for i in ids)


def test_configuration_file_fills_what_the_url_leaves_out(rmw_file):
    config, address = session_config(ZenohOptions(config_file=rmw_file))
    assert address == "tcp/far:7447"
    assert setting(config, "mode") == "client"
    assert setting(config, "scouting/multicast/enabled") is True
    assert setting(config, "transport/shared_memory/enabled") is True
    assert setting(config, "timestamping/enabled") is True, "latched publishers need it"


def test_url_wins_over_the_configuration_file(rmw_file):
    options = ZenohOptions(
        "near", mode="peer", shared_memory=False, config_file=f"file://{rmw_file}"
    )
    config, address = session_config(options)
    assert address == "tcp/near:7447"
    assert setting(config, "mode") == "peer"
    assert setting(config, "transport/shared_memory/enabled") is False


def test_file_without_addresses_is_reported(tmp_path):
    file = tmp_path / "x.json5"
    file.write_text("{mode: 'peer'}")
    assert session_config(ZenohOptions(config_file=str(file)))[1].startswith("any address")


@pytest.mark.parametrize("content", [None, "{", "{mode: 'nonsense'}", "{no_such_setting: 1}"])
def test_bad_configuration_file_is_reported(tmp_path, content):
    file = tmp_path / "bad.json5"
    if content is not None:
        file.write_text(content)
    with pytest.raises(rosglass.ConversionError) as error:
        session_config(ZenohOptions(config_file=str(file)))
    assert str(error.value).startswith("ZENOH_SESSION_CONFIG_URI: expected a Zenoh configuration")
    assert str(file) in str(error.value)


def test_router_listens_only_where_configured():
    config = router_config("tcp/127.0.0.1:7447")
    assert setting(config, "mode") == "router"
    assert setting(config, "listen/endpoints") == ["tcp/127.0.0.1:7447"]
    assert setting(config, "scouting/multicast/enabled") is False


def test_router_with_a_file_without_addresses_is_not_open(tmp_path):
    file = tmp_path / "router.json5"
    file.write_text("{ transport: { auth: { usrpwd: { dictionary_file: '/users' } } } }")
    assert setting(router_config(None, str(file)), "listen/endpoints") == ["tcp/127.0.0.1:7447"]
    file.write_text("{ listen: { endpoints: ['tcp/[::]:7447'] } }")
    assert setting(router_config(None, str(file)), "listen/endpoints") == ["tcp/[::]:7447"]


def test_zenohs_own_source_is_not_quoted():
    error = zenoh.ZError("no (os error 99) at /root/.cargo/git/zenoh-9c/io/tcp.rs:61.] at /x.rs:3.")
    assert reason(error) == "no (os error 99)]"


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("zenoh://operator:secret@robot:7447?tls=true", "zenoh://operator:***@robot:7447?tls=true"),
        ("zenoh://operator:s:e@c@robot", "zenoh://operator:***@robot"),
        ("zenoh://operator:se/cret@robot", "zenoh://operator:***@robot"),
        ("ros1://:secret@robot", "ros1://:***@robot"),
        (
            "zenoh://robot:7447?ca=/home/me@work/ca.pem",
            "zenoh://robot:7447?ca=/home/me@work/ca.pem",
        ),
        ("zenoh://[::1]:7447", "zenoh://[::1]:7447"),
        ("the robot", "the robot"),
    ],
)
def test_url_is_shown_without_its_password(url, shown):
    assert shown_url(url) == shown


@pytest.mark.parametrize(
    "url",
    [
        "zenoh://operator:secret@robot/path",
        "zenoh://operator:sec/ret@robot",
        "zenoh://operator:secret@robot:x",
        "zenoh://operator:secret@",
        "zenoh://operator:secret@[robot",
        "zenoh://operator:secret@robot?tls=maybe",
        "zenoh://operator:secret@robot?x=1",
        "zenoh://:secret@robot",
        "zenoh://operator:secret@robot?ca=/nowhere",
        "znoh://operator:secret@robot",
    ],
)
def test_errors_of_urls_do_not_show_the_password(url):
    with pytest.raises(rosglass.Error) as error:
        rosglass.connect(url)
    assert "sec" not in str(error.value)


def test_users_and_certificates_by_url(tmp_path):
    options = ZenohOptions.parse("zenoh://o%40:s%2Fe@robot?tls=true", {})
    assert (options.user, options.tls) == (("o@", "s/e"), True)
    assert "s/e" not in repr(options)
    config, address = session_config(options)
    assert address == "tls/robot:7447"
    assert setting(config, "transport/auth/usrpwd/user") == "o@"
    assert setting(config, "transport/auth/usrpwd/password") == "s/e"
    assert setting(config, "mode") == "client"
    # Peers with users could not link with each other.
    local, address = session_config(ZenohOptions.parse("zenoh://a:b@127.0.0.1", {}))
    assert (setting(local, "mode"), address) == ("client", "tcp/127.0.0.1:7447")
    file = tmp_path / "ca.pem"
    file.touch()
    assert session_config(ZenohOptions.parse(f"zenoh://?ca={file}", {}))[1] == "tls/127.0.0.1:7447"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("tls=false&ca=x", "ca: expected no file without TLS: remove tls=false"),
        ("cert=x", "key: expected a file: a certificate needs its key"),
        ("key=x", "cert: expected a file: a certificate needs its key"),
        ("ca=", "ca: expected a file"),
        ("tls=1", "tls: expected one of true, false"),
    ],
)
def test_options_of_tls_that_contradict_are_reported(options, message):
    with pytest.raises(rosglass.ArgumentError, match=message):
        ZenohOptions.parse(f"zenoh://robot?{options}", {})


def test_tls_needs_a_host_beside_a_file(rmw_file):
    with pytest.raises(rosglass.ArgumentError, match="tls: expected a URL with the router's host"):
        session_config(ZenohOptions(tls=True, config_file=rmw_file))


@pytest.mark.parametrize(
    ("settings", "address"),
    [
        ("connect: { endpoints: ['tls/far:1'] }", "tls/near:7447"),
        ("connect: { endpoints: { client: ['tls/far:1'] } }, mode: 'client'", "tls/near:7447"),
        ("transport: { link: { tls: { root_ca_certificate: 'ca.pem' } } }", "tls/near:7447"),
        ("connect: { endpoints: ['tcp/far:1'] }", "tcp/near:7447"),
        ("mode: 'client'", "tcp/near:7447"),
    ],
)
def test_host_is_connected_to_as_the_file_connects(tmp_path, settings, address):
    file = tmp_path / "session.json5"
    file.write_text(f"{{ {settings} }}")
    given = ZenohOptions("near", config_file=str(file))
    assert session_config(given)[1] == address
    plain = ZenohOptions("near", config_file=str(file), tls=False)
    assert session_config(plain)[1] == "tcp/near:7447"
