from __future__ import annotations

import json

import pytest
import zenoh

import rosglass
from rosglass.wires.zenoh.options import ZenohOptions
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


def test_a_session_is_shy_by_default():
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
def test_a_session_is_a_client_of_another_machine(host):
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


def test_a_configuration_file_decides_what_the_url_leaves_open(rmw_file):
    config, address = session_config(ZenohOptions(config_file=rmw_file))
    assert address == "tcp/far:7447"
    assert setting(config, "mode") == "client"
    assert setting(config, "scouting/multicast/enabled") is True
    assert setting(config, "transport/shared_memory/enabled") is True
    assert setting(config, "timestamping/enabled") is True, "latched publishers need it"


def test_the_url_wins_over_the_configuration_file(rmw_file):
    options = ZenohOptions(
        "near", mode="peer", shared_memory=False, config_file=f"file://{rmw_file}"
    )
    config, address = session_config(options)
    assert address == "tcp/near:7447"
    assert setting(config, "mode") == "peer"
    assert setting(config, "transport/shared_memory/enabled") is False


def test_a_file_without_addresses_is_named_so(tmp_path):
    file = tmp_path / "x.json5"
    file.write_text("{mode: 'peer'}")
    assert session_config(ZenohOptions(config_file=str(file)))[1].startswith("any address")


@pytest.mark.parametrize("content", [None, "{", "{mode: 'nonsense'}", "{no_such_setting: 1}"])
def test_a_bad_configuration_file_is_named(tmp_path, content):
    file = tmp_path / "bad.json5"
    if content is not None:
        file.write_text(content)
    with pytest.raises(rosglass.ConversionError) as error:
        session_config(ZenohOptions(config_file=str(file)))
    assert str(error.value).startswith("ZENOH_SESSION_CONFIG_URI: expected a Zenoh configuration")
    assert str(file) in str(error.value)


def test_a_router_listens_where_it_is_told_and_nowhere_else():
    config = router_config("tcp/127.0.0.1:7447")
    assert setting(config, "mode") == "router"
    assert setting(config, "listen/endpoints") == ["tcp/127.0.0.1:7447"]
    assert setting(config, "scouting/multicast/enabled") is False


def test_zenohs_own_source_is_not_quoted():
    error = zenoh.ZError("no (os error 99) at /root/.cargo/git/zenoh-9c/io/tcp.rs:61.] at /x.rs:3.")
    assert reason(error) == "no (os error 99)]"
