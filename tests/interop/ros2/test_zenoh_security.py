"""Zenoh routers with users, TLS and access control, and sessions that they refuse."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from waiting import eventually

import rosglass
from rosglass.comm import ConnectionState
from rosglass.wires.zenoh.router import Router, is_router_reachable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node

EXAMPLE = Path(__file__).parents[3] / "examples" / "zenoh_router.json5"
#: With characters that have a meaning in URLs.
PASSWORD, IN_URL = "se/c:r@t", "se%2Fc:r%40t"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Certificates made by openssl, users, and what the example needs beside it."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is missing: sudo apt-get install openssl")
    place = tmp_path_factory.mktemp("security")

    def openssl(*arguments: str) -> None:
        subprocess.run(["openssl", *arguments], cwd=place, check=True, capture_output=True)

    for name in ("authority", "other"):
        openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "30",
                "-subj", f"/CN={name}", "-keyout", f"{name}.key",
                "-out", f"{name}.pem")  # fmt: skip
    for name, names, days in (
        ("router", "DNS:localhost,IP:127.0.0.1", "30"),
        ("elsewhere", "DNS:robot.example", "30"),
        ("expired", "DNS:localhost,IP:127.0.0.1", "-1"),
        ("operator", "DNS:operator", "30"),
    ):
        (place / "names").write_text(f"subjectAltName={names}\n")
        openssl("req", "-newkey", "rsa:2048", "-nodes", "-subj", f"/CN={name}",
                "-keyout", f"{name}.key", "-out", f"{name}.csr")  # fmt: skip
        openssl("x509", "-req", "-in", f"{name}.csr", "-CA", "authority.pem",
                "-CAkey", "authority.key", "-CAcreateserial", "-days", days,
                "-extfile", "names", "-out", f"{name}.pem")  # fmt: skip
    (place / "users.txt").write_text(f"operator:{PASSWORD}\nviewer:look\n")
    return place


def tls_settings(folder: Path, certificate: str = "router", **more: str) -> str:
    pairs = {
        "listen_certificate": f'"{folder}/{certificate}.pem"',
        "listen_private_key": f'"{folder}/{certificate}.key"',
        **more,
    }
    return ", ".join(f"{key}: {value}" for key, value in pairs.items())


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Callable[[str, str], Router]]:
    """Run a router at a protocol's address with settings of Zenoh's ``transport``."""
    running: list[Router] = []

    def run(protocol: str, settings: str) -> Router:
        file = tmp_path / f"router{len(running)}.json5"
        file.write_text(f"{{ mode: 'router', transport: {{ {settings} }} }}")
        running.append(Router(f"{protocol}/127.0.0.1:{free_port()}", str(file)))
        return running[-1]

    yield run
    for router in running:
        router.close()


def with_user(url: str, user: str) -> str:
    return url.replace("zenoh://", f"zenoh://{user}@")


def exchange(one: Node, other: Node) -> None:
    """See that a message arrives, in a topic and by a service."""
    publisher = one.create_publisher("/words", "std_msgs/msg/String", rosglass.QoS.latched())
    publisher.publish(data="hello")
    subscription = other.create_subscription("/words", qos=rosglass.QoS.latched())
    assert subscription.wait(30).message().data == "hello"
    one.create_service_server("/home", "std_srvs/srv/Trigger", lambda _: {"message": "done"})
    assert other.create_service_client("/home").call(timeout=30).message == "done"


def refused(connect: Callable[..., Node], url: str) -> str:
    """Return the status of a node that a router refuses."""
    node = connect("refused", url=url)
    eventually(lambda: node.status().detail.startswith("the router at "), node.status)
    assert node.status().state is ConnectionState.CONNECTING
    assert PASSWORD not in f"{node.status()} {node.url} {node!r}"
    return node.status().detail


def test_router_with_users_admits_users_with_a_password(
    folder: Path, run: Callable[[str, str], Router], connect: Callable[..., Node]
) -> None:
    router = run("tcp", f"auth: {{ usrpwd: {{ dictionary_file: '{folder}/users.txt' }} }}")
    assert (router.is_restricted, router.is_encrypted) == (True, True), "on this machine only"
    own = with_user(router.url, f"operator:{IN_URL}")
    robot, cockpit = connect("robot", url=own), connect("cockpit", url=own)
    exchange(robot, cockpit)
    assert robot.url == with_user(router.url, "operator:***")
    assert is_router_reachable(own)
    assert is_router_reachable(router.url), "it refuses, so it is there"
    wrong = refused(connect, with_user(router.url, "operator:wrong"))
    assert "refuses the user: correct the user's name or password; trying again" in wrong
    assert "refuses the user" in refused(connect, with_user(router.url, f"op:{IN_URL}"))
    assert "asks for a user and a password: connect to zenoh://USER:" in refused(
        connect, router.url
    )


def test_a_router_without_users_and_a_session_with_one(
    run: Callable[[str, str], Router], connect: Callable[..., Node]
) -> None:
    router = run("tcp", "")
    assert not router.is_restricted
    assert "has no users, and refuses sessions with one: leave out 'operator'" in refused(
        connect, with_user(router.url, f"operator:{IN_URL}")
    )


def test_tls_encrypts_and_says_why_it_fails(
    folder: Path, run: Callable[[str, str], Router], connect: Callable[..., Node]
) -> None:
    router = run("tls", f"link: {{ tls: {{ {tls_settings(folder)} }} }}")
    assert (router.is_restricted, router.is_encrypted) == (False, True)
    assert router.url.endswith("?tls=true")
    plain = router.url.removesuffix("?tls=true")
    trusted = f"{plain}?ca={folder}/authority.pem"
    exchange(connect("robot", url=trusted), connect("cockpit", url=trusted))
    name = trusted.replace("127.0.0.1", "localhost")
    exchange(connect("robot2", url=name), connect("cockpit2", url=trusted))
    assert "expects TLS: add ?ca=FILE" in refused(connect, plain)
    assert "not trusted" in (untrusted := refused(connect, router.url))
    assert "add ?ca=FILE, the certificate of its authority, to the URL" in untrusted
    other = refused(connect, f"{plain}?ca={folder}/other.pem")
    assert f"{folder}/other.pem is not that of its authority" in other
    elsewhere = run("tls", f"link: {{ tls: {{ {tls_settings(folder, 'elsewhere')} }} }}")
    url = elsewhere.url.replace("?tls=true", f"?ca={folder}/authority.pem")
    assert "a certificate for another host" in refused(connect, url)
    expired = run("tls", f"link: {{ tls: {{ {tls_settings(folder, 'expired')} }} }}")
    old = refused(connect, expired.url.replace("?tls=true", f"?ca={folder}/authority.pem"))
    assert "a certificate that is not valid now (certificate has expired)" in old
    assert "renew it, or correct a clock" in old
    assert "does not speak TLS: leave out tls" in refused(
        connect, f"{run('tcp', '').url}?ca={folder}/authority.pem"
    )


def test_a_router_that_asks_for_certificates(
    folder: Path, run: Callable[[str, str], Router], connect: Callable[..., Node]
) -> None:
    asks = {"enable_mtls": "true", "root_ca_certificate": f'"{folder}/authority.pem"'}
    router = run("tls", f"link: {{ tls: {{ {tls_settings(folder, **asks)} }} }}")
    assert router.is_restricted
    url = router.url.replace("?tls=true", f"?ca={folder}/authority.pem")
    own = f"{url}&cert={folder}/operator.pem&key={folder}/operator.key"
    exchange(connect("robot", url=own), connect("cockpit", url=own))
    assert "asks for a certificate: add cert=FILE&key=FILE" in refused(connect, url)
    strange = f"{url}&cert={folder}/other.pem&key={folder}/other.key"
    assert "refuses this program's certificate" in refused(connect, strange)


def test_a_session_file_for_tls_counts_for_a_url_with_another_host(
    folder: Path,
    run: Callable[[str, str], Router],
    connect: Callable[..., Node],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    router = run("tls", f"link: {{ tls: {{ {tls_settings(folder)} }} }}")
    file = tmp_path / "session.json5"
    trusted = (
        f"transport: {{ link: {{ tls: {{ root_ca_certificate: '{folder}/authority.pem' }} }} }}"
    )
    monkeypatch.setenv("ZENOH_SESSION_CONFIG_URI", str(file))
    url = router.url.removesuffix("?tls=true")
    for settings in (trusted, f"connect: {{ endpoints: ['tls/nowhere:1'] }}, {trusted}"):
        file.write_text(f"{{ mode: 'client', {settings} }}")
        exchange(connect("robot", url=url), connect("cockpit", url=url))


@pytest.fixture
def example(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Router]:
    """The router of the documentation, at ports of its own."""
    text = EXAMPLE.read_text()
    for address in ("tcp/127.0.0.1:7447", "tls/[::]:7448"):
        assert address in text
        text = text.replace(address, f"{address[:4]}127.0.0.1:{free_port()}")
    (folder / "example.json5").write_text(text)
    monkeypatch.chdir(folder)
    with Router(config_file="example.json5") as router:
        yield router


def test_example_open_to_the_network_starts_without_a_warning(folder: Path) -> None:
    text = EXAMPLE.read_text()
    for port in ("7447", "7448"):
        text = text.replace(f":{port}", f":{free_port()}")
    (folder / "open.json5").write_text(text)
    command = [sys.executable, "-m", "rosglass", "router", "--config", "open.json5"]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as router:
        assert router.stdout is not None
        assert "tls/[::]:" in router.stdout.readline()
        router.terminate()
        _, errors = router.communicate(timeout=30)
    assert errors == "", "plain TCP is open to this machine only"


def test_the_example_lets_viewers_look_only(example: Router, connect: Callable[..., Node]) -> None:
    assert example.is_restricted
    robot = connect("robot", url=with_user(example.url, f"operator:{IN_URL}"))
    tls = example.listen.partition("tls/")[2]
    viewer = connect("viewer", url=f"zenoh://viewer:look@{tls}?ca=authority.pem")
    state = robot.create_publisher("/state", "std_msgs/msg/String", rosglass.QoS.latched())
    state.publish(data="ready")
    seen = viewer.create_subscription("/state", qos=rosglass.QoS.latched())
    assert seen.wait(30).message().data == "ready", "latched before it came"
    state.publish(data="steady")
    assert seen.wait(30).message().data == "steady"

    driven: list[Any] = []
    robot.create_subscription("/cmd_vel", "geometry_msgs/msg/Twist", driven.append)
    called: list[Any] = []
    robot.create_service_server("/home", "std_srvs/srv/Trigger", lambda _: called.append(1) or {})
    operator = connect("operator", url=with_user(example.url, f"operator:{IN_URL}"))
    for node, speed in ((viewer, 9.0), (operator, 0.1)):
        drive = node.create_publisher("/cmd_vel", "geometry_msgs/msg/Twist")
        eventually(drive.subscription_count)
        drive.publish(linear={"x": speed})
    home = viewer.create_service_client("/home")
    assert home.wait_for_server(30)
    with pytest.raises(rosglass.Error):
        home.call(timeout=2)
    operator.create_service_client("/home").call(timeout=30)
    eventually(lambda: len(driven) == 1)
    assert driven[0].linear.x == 0.1
    assert called == [1]


def test_the_router_command_takes_a_file_and_the_environment(
    folder: Path, tmp_path: Path, start: Callable[..., Any]
) -> None:
    file = tmp_path / "router.json5"
    port = free_port()
    file.write_text(
        f"{{ mode: 'router', listen: {{ endpoints: ['tls/127.0.0.1:{port}'] }}, transport: {{"
        f"auth: {{ usrpwd: {{ dictionary_file: '{folder}/users.txt' }} }}, "
        f"link: {{ tls: {{ {tls_settings(folder)} }} }} }} }}"
    )
    url = f"zenoh://operator:{IN_URL}@127.0.0.1:{port}?ca={folder}/authority.pem"
    variable = {"ZENOH_ROUTER_CONFIG_URI": str(file)}
    for arguments, env, where in (
        (("--config", str(file)), {}, port),
        ((), variable, port),
        (("--listen", f"tls/127.0.0.1:{(other := free_port())}"), variable, other),
    ):
        process = start("-m", "rosglass", "router", *arguments, env={**os.environ, **env})
        eventually(lambda: "connect with" in "".join(process.output), lambda: process.output)  # noqa: B023
        assert f"tls/127.0.0.1:{where}, as {file} says" in "".join(process.output)
        with rosglass.connect(url.replace(str(port), str(where)), own_services=False) as node:
            eventually(lambda: node.status().state is ConnectionState.CONNECTED, node.status)
        assert is_router_reachable(f"zenoh://127.0.0.1:{where}?tls=true"), "but refuses"
        process.end()


def test_a_router_names_what_is_wrong_with_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(rosglass.ConnectionLostError, match=r"Missing TLS.*--config FILE with list"):
        Router(f"tls/127.0.0.1:{free_port()}")
    file = tmp_path / "bad.json5"
    with pytest.raises(rosglass.ArgumentError, match=r"config_file: expected .*bad\.json5"):
        Router(config_file=str(file))
    monkeypatch.setenv("ZENOH_ROUTER_CONFIG_URI", str(file))
    with pytest.raises(rosglass.ArgumentError, match="ZENOH_ROUTER_CONFIG_URI"):
        Router(config_file=str(file))
    file.write_text("{ transport: { auth: { usrpwd: { dictionary_file: '/nowhere' } } } }")
    invalid = r"Invalid user-password dictionary file.*\(its files: /nowhere\)"
    with pytest.raises(rosglass.ConnectionLostError, match=invalid):
        Router(f"tcp/127.0.0.1:{free_port()}", str(file))


def test_commands_name_the_reason_and_no_password(
    folder: Path, run: Callable[[str, str], Router]
) -> None:
    router = run("tcp", f"auth: {{ usrpwd: {{ dictionary_file: '{folder}/users.txt' }} }}")
    url = with_user(router.url, "operator:wrong-secret")
    for command in (("topic", "list"), ("doctor",), ("topic", "echo", "/x", "--timeout", "1")):
        done = subprocess.run(
            [sys.executable, "-m", "rosglass", *command, "--url", url],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        said = done.stdout + done.stderr
        assert done.returncode == 1, said
        assert "refuses the user" in said
        assert "correct the user's name or password" in said
        assert "Is the robot on" not in said
        assert "wrong-secret" not in said
