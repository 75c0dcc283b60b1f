"""Files that are elsewhere: on web servers, and on the robot."""

from __future__ import annotations

import threading
import time
import uuid
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from web_server import WebServer

import rosglass
from rosglass.errors import Error, UnsupportedError
from rosglass.scene.data import resource_retriever
from rosglass.scene.data.resource_retriever import ResourceRetriever
from rosglass.scene.data.resources import ResourceError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from http.server import BaseHTTPRequestHandler
    from pathlib import Path

SERVICE, TYPE = "/rviz/get_resource", "rviz_resource_interfaces/srv/GetResource"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for variable in ("http_proxy", "HTTP_PROXY", "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    return tmp_path / "cache" / "rosglass" / "resources"


@pytest.fixture
def web() -> Iterator[WebServer]:
    with WebServer() as server:
        yield server


def test_files_of_this_machine_are_paths(tmp_path: Path) -> None:
    file = tmp_path / "a.stl"
    file.write_bytes(b"mesh")
    assert ResourceRetriever().find(str(file)) == file
    assert ResourceRetriever().read(file.as_uri()) == b"mesh"
    with pytest.raises(ResourceError, match="there is no package 'x'"):
        ResourceRetriever().find("package://x/a.stl")


def test_a_package_that_was_added_is_found_by_reset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    retriever = ResourceRetriever()
    with pytest.raises(ResourceError, match="there is no package 'my_arm'"):
        retriever.find("package://my_arm/arm.stl")
    package = tmp_path / "my_arm"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>my_arm</name></package>")
    (package / "arm.stl").write_bytes(b"mesh")
    retriever.retry()
    assert retriever.find("package://my_arm/arm.stl") == package / "arm.stl"


def test_a_file_of_a_web_server_is_fetched_once_and_then_checked(
    web: WebServer, cache: Path
) -> None:
    web.files["/arm%20one.stl"] = b"\0mesh\n" * 1000
    uri = f"{web.url}/arm one.stl"
    retriever = ResourceRetriever()
    assert retriever.find(uri) == retriever.read(f" {uri}\n") == web.files["/arm%20one.stl"]
    assert web.requests == [("/arm%20one.stl", None)]
    assert len(list(cache.iterdir())) == 1
    # The next program asks whether it is still the same.
    assert ResourceRetriever().find(uri) == web.files["/arm%20one.stl"]
    assert web.requests[1:] == [("/arm%20one.stl", '"1"')]
    web.files["/arm%20one.stl"], web.etag = b"new", '"2"'
    assert ResourceRetriever().find(uri) == b"new"
    assert len(list(cache.iterdir())) == 1
    # Without a version, nothing is kept.
    web.files["/plain.stl"], web.etag = b"plain", ""
    assert ResourceRetriever().find(f"{web.url}/plain.stl") == b"plain"
    assert len(list(cache.iterdir())) == 1


def test_a_path_beside_a_mesh_is_normalised(web: WebServer) -> None:
    web.files["/textures/a.png"] = b"picture"
    assert ResourceRetriever().find(f"{web.url}/meshes/../textures/a.png") == b"picture"


def redirect(target: str) -> Callable[[BaseHTTPRequestHandler], None]:
    def answer(request: BaseHTTPRequestHandler) -> None:
        request.send_response(302)
        request.send_header("Location", target)
        request.end_headers()

    return answer


def raw(*lines: bytes) -> Callable[[BaseHTTPRequestHandler], None]:
    return lambda request: request.wfile.write(b"\r\n".join(lines)) and None


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (None, "the server answers 404 Not Found"),
        (redirect("file:///etc/passwd"), "file:///etc/passwd"),
        (redirect("ftp://127.0.0.1/a.stl"), "which is not a web server"),
        (redirect("/a.stl"), "redirect"),
        (raw(b"HTTP/1.0 200 OK", b"Content-Length: 99", b"", b"short"), "sent 5 of 99 bytes"),
        (raw(b"HTTP/1.0 200 OK", b"Content-Length: x", b"", b"short"), "cannot be fetched"),
        (raw(b"nonsense"), "cannot be fetched: BadStatusLine"),
        (
            raw(b"HTTP/1.0 200 OK", b"Content-Length: 999999999999", b"", b""),
            "999999999999 bytes; the limit is 268435456",
        ),
    ],
)
def test_failed_web_requests_are_reported(web: WebServer, answer: Any, text: str) -> None:
    if answer is not None:
        web.files["/a.stl"] = answer
    uri = f"{web.url}/a.stl"
    retriever = ResourceRetriever()
    with pytest.raises(ResourceError, match=f"^{uri}: ") as caught:
        retriever.find(uri)
    assert text in str(caught.value)
    # Each link that has the mesh gets the same answer, without another request.
    count = len(web.requests)
    with pytest.raises(ResourceError):
        retriever.find(uri)
    assert len(web.requests) == count


def test_failed_resource_can_be_requested_again(web: WebServer) -> None:
    uri, retriever = f"{web.url}/a.stl", ResourceRetriever()
    for _ in range(2):
        with pytest.raises(ResourceError, match="404"):
            retriever.find(uri)
    web.files["/a.stl"] = b"mesh"
    retriever.retry()
    assert retriever.find(uri) == b"mesh"


def test_servers_that_answer_later_are_asked_for_one_file_each(web: WebServer) -> None:
    def is_down(request: BaseHTTPRequestHandler) -> None:
        request.send_error(503)

    names = ("/a.stl", "/b.stl", "/c.stl")
    for name in names:
        web.files[name] = is_down
    uris, retriever = [f"{web.url}{name}" for name in names], ResourceRetriever()
    refused = "http://127.0.0.1:1/d.stl"
    for uri in (*uris, refused):
        with pytest.raises(ResourceError, match="it is retried later, or at once by Reset"):
            retriever.find(uri)
    with pytest.raises(ResourceError, match=r"404 Not Found$"):
        retriever.find(f"{web.url}/gone.stl")
    assert retriever.is_waiting
    web.requests.clear()
    assert retriever.ask_again() == []
    assert [path for path, _ in web.requests] == ["/a.stl"]
    for name in names:
        web.files[name] = b"mesh"
    assert retriever.ask_again() == uris
    assert [retriever.find(uri) for uri in uris] == [b"mesh"] * 3
    # The other server is still asked, and nothing else.
    web.requests.clear()
    assert retriever.is_waiting
    assert retriever.ask_again() == []
    assert web.requests == []
    # Reset forgets what is not wanted any more.
    retriever.retry()
    assert retriever.find(uris[0]) == b"mesh"
    assert not retriever.is_waiting


def test_invalid_url_is_not_requested_again(web: WebServer) -> None:
    retriever = ResourceRetriever()
    with pytest.raises(ResourceError, match=r"^http://\[1/a.stl: Invalid IPv6 URL"):
        retriever.find("http://[1/a.stl")
    assert not retriever.is_waiting


def test_a_body_without_an_end_is_cut_off(web: WebServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource_retriever, "_MAX_BYTES", 100_000)
    sent = []

    def endless(request: BaseHTTPRequestHandler) -> None:
        request.wfile.write(b"HTTP/1.0 200 OK\r\n\r\n")
        while sum(sent) < 100_000_000:
            sent.append(request.wfile.write(bytes(50_000)))

    web.files["/a.stl"] = endless
    with pytest.raises(ResourceError, match="bytes; the limit is 100000"):
        ResourceRetriever().find(f"{web.url}/a.stl")


def test_servers_that_do_not_answer_are_few(
    web: WebServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resource_retriever, "_READ_TIMEOUT_S", 0.2)
    monkeypatch.setattr(resource_retriever, "_SLOW_S", 0.1)
    ended = threading.Event()
    web.files["/good.stl"] = b"mesh"
    for number in range(5):
        web.files[f"/{number}.stl"] = lambda _: ended.wait(30) and None
    retriever = ResourceRetriever()
    for number in range(3):
        with pytest.raises(ResourceError, match="cannot be reached: timed out"):
            retriever.find(f"{web.url}/{number}.stl")
    before = len(web.requests)
    with pytest.raises(ResourceError, match="it is not requested: 3 servers have not answered"):
        retriever.find(f"{web.url}/good.stl")
    assert len(web.requests) == before
    # After the minute it is.
    monkeypatch.setattr(resource_retriever, "_FAILURES_S", 0.0)
    retriever = ResourceRetriever()
    assert retriever.find(f"{web.url}/good.stl") == b"mesh"
    ended.set()


def test_servers_that_refuse_at_once_do_not_count(web: WebServer) -> None:
    retriever = ResourceRetriever()
    for number in range(5):
        with pytest.raises(ResourceError, match=r"cannot be reached: .*refused"):
            retriever.find(f"http://127.0.0.1:1/{number}.stl")
    web.files["/good.stl"] = b"mesh"
    assert retriever.find(f"{web.url}/good.stl") == b"mesh"


def test_a_closed_network_is_closed_to_meshes(
    web: WebServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resource_retriever, "is_network_closed", lambda: True)
    with pytest.raises(UnsupportedError, match="start with --allow-network"):
        ResourceRetriever().find(f"{web.url}/a.stl")
    assert web.requests == []


def test_a_cache_that_cannot_be_written_costs_time_only(web: WebServer, cache: Path) -> None:
    cache.parent.mkdir(parents=True)
    cache.write_text("no folder")
    web.files["/a.stl"] = b"mesh"
    assert ResourceRetriever().find(f"{web.url}/a.stl") == b"mesh"


# -- services --------------------------------------------------------------------------------------


class Robot:
    """A node with the service, and one that asks it."""

    def __init__(self, service: str = SERVICE, kind: str = TYPE) -> None:
        url = f"local://resources-{uuid.uuid4().hex}"
        self.node, self.cockpit = rosglass.connect(url, "robot"), rosglass.connect(url, "cockpit")
        self.requests: list[tuple[str, str]] = []
        self.response: dict[str, Any] = {"status_code": 0, "error_reason": "no such file"}
        self.server = self.node.create_service_server(service, kind, self.answer)
        self.retriever = ResourceRetriever(self.cockpit)

    def answer(self, request: Any) -> dict[str, Any]:
        self.requests.append((request.path, request.etag))
        return self.response

    def close(self) -> None:
        self.retriever.close()
        self.cockpit.close()
        self.node.close()


@pytest.fixture
def make_robot() -> Iterator[Callable[..., Robot]]:
    made: list[Robot] = []

    def make(*arguments: str) -> Robot:
        made.append(Robot(*arguments))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


def ok(body: bytes, etag: str = "") -> dict[str, Any]:
    return {"status_code": 1, "etag": etag, "body": np.frombuffer(body, np.uint8)}


def test_missing_package_is_requested_from_the_robot(
    make_robot: Callable[..., Robot], cache: Path
) -> None:
    robot = make_robot()
    robot.response = ok(b"mesh", "v1")
    uri = "package://my_arm/meshes/a.stl"
    assert robot.retriever.find(uri) == robot.retriever.find(uri) == b"mesh"
    assert robot.requests == [(uri, "")]
    assert len(list(cache.iterdir())) == 1
    robot.response = {"status_code": 2, "etag": "v1"}
    again = ResourceRetriever(robot.cockpit)
    assert again.find(uri) == b"mesh"
    assert robot.requests[1:] == [(uri, "v1")]
    again.close()
    robot.response = ok(b"file")
    assert robot.retriever.find("file:///nowhere/on/this/machine.stl") == b"file"


@pytest.mark.parametrize(
    ("response", "text"),
    [
        ({"status_code": 0, "error_reason": "gone"}, f"{SERVICE} does not have it: gone"),
        ({"status_code": 2}, f"{SERVICE} does not have it: status 2"),
        ({"status_code": 17}, f"{SERVICE} does not have it: status 17"),
    ],
)
def test_missing_resource_is_reported_with_the_reason(
    make_robot: Callable[..., Robot], response: dict[str, Any], text: str
) -> None:
    robot = make_robot()
    robot.response = response
    uri = "package://my_arm/a.stl"
    with pytest.raises(ResourceError) as caught:
        robot.retriever.find(uri)
    # Both the local error, and the robot's.
    assert "there is no package 'my_arm' in ROS_PACKAGE_PATH" in str(caught.value)
    assert f"nor does the robot serve it: the service {text}" in str(caught.value)


def test_a_robot_without_the_service_is_asked_once(
    make_robot: Callable[..., Robot], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resource_retriever, "_APPEAR_TIMEOUT_S", 0.2)
    robot = make_robot("/other", "std_srvs/srv/Trigger")
    started = time.monotonic()
    for number in range(50):
        with pytest.raises(ResourceError, match=f"no node offers the service {SERVICE}"):
            robot.retriever.find(f"package://my_arm/{number}.stl")
    assert time.monotonic() - started < 5


def test_a_robot_that_serves_files_later_is_asked_again(
    make_robot: Callable[..., Robot], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resource_retriever, "_APPEAR_TIMEOUT_S", 0.2)
    robot = make_robot("/other", "std_srvs/srv/Trigger")
    uris = [f"package://my_arm/{number}.stl" for number in range(3)]
    for uri in uris:
        with pytest.raises(ResourceError, match=f"no node offers the service {SERVICE}; it is"):
            robot.retriever.find(uri)
    assert robot.retriever.ask_again() == []
    robot.node.create_service_server(SERVICE, TYPE, robot.answer)
    # The first one is not there, but the robot answers.
    monkeypatch.setattr(resource_retriever, "_APPEAR_TIMEOUT_S", 10.0)
    assert robot.retriever.ask_again() == uris
    robot.response = ok(b"mesh")
    assert robot.retriever.find(uris[1]) == b"mesh"
    assert not robot.retriever.is_waiting


def test_a_service_can_be_named(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot("/provider")
    robot.response = ok(b"mesh")
    assert robot.retriever.find("service:///provider:foo/bar.stl") == b"mesh"
    assert robot.requests == [("foo/bar.stl", "")]
    for uri in ("service://:a", "service:///provider", "service:///provider:a:b"):
        with pytest.raises(ResourceError, match="expected service://NAME:PATH"):
            robot.retriever.find(uri)
    with pytest.raises(Error, match=r"ROS 2's"):
        ResourceRetriever().find("service:///provider:a.stl")


def test_service_of_another_type_is_not_used(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot("/provider", "std_srvs/srv/Trigger")
    with pytest.raises(ResourceError):
        robot.retriever.find("service:///provider:a.stl")
