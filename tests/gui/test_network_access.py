"""Files on other machines are fetched only where that is allowed."""

from __future__ import annotations

import socket
import threading
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.qt import QT6

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

BODY = """import QtQuick 2.15
IMPORT
Item {
    width: 200; height: 100
    Image { source: "http://ADDRESS/image.png" }
    Loader { source: "http://ADDRESS/loader.qml" }
    FontLoader { source: "http://ADDRESS/font.ttf" }
    // As in the status of a robot's diagnostics.
    Text { text: "<img src='http://ADDRESS/text.png'>" }
    Repeater { model: 40; Image { source: "http://ADDRESS/" + index + ".png" } }
    Component.onCompleted: {
        const request = new XMLHttpRequest()
        request.open("GET", "http://ADDRESS/request")
        request.send()
        console.log("all are asked for")
    }
}
"""

FILES = """import QtQuick 2.15
Item {
    Component.onCompleted: {
        for (const [method, url] of [["GET", "READ"], ["PUT", "WRITTEN"]]) {
            const request = new XMLHttpRequest()
            request.onreadystatechange = () => {
                if (request.readyState === XMLHttpRequest.DONE)
                    console.log("got", JSON.stringify(request.responseText))
            }
            try {
                request.open(method, url)
                request.send("text")
            } catch (error) {
                console.log("got", error)
            }
        }
        console.log("all are asked for")
    }
}
"""
FILM = """import QtQuick 2.15
import QtMultimedia
Item {
    MediaPlayer {
        source: "ADDRESS"
        onErrorOccurred: console.log("no film")
        Component.onCompleted: play()
    }
}
"""


class Server:
    """Another machine, from Qt's point of view; counts requests."""

    def __init__(self) -> None:
        self._socket = socket.create_server(("127.0.0.1", 0))
        # Qt does not take this for an address of this machine, whose requests bypass proxies.
        self.address = f"0.0.0.0:{self._socket.getsockname()[1]}"
        self.requests = 0
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            self.requests += 1
            with connection:
                connection.recv(4096)
                connection.sendall(
                    b"HTTP/1.1 404 No\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
                )

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server()
    yield made
    made.close()


def interface(folder: Path, server: Server, imported: str = "") -> Path:
    file = folder / "Main.qml"
    text = BODY.replace("IMPORT", imported).replace("ADDRESS", server.address)
    file.write_text(text)
    return file


@pytest.mark.both_qt
def test_nothing_is_fetched(start: Any, tmp_path: Path, server: Server) -> None:
    program = start("run", interface(tmp_path, server), "--screenshot", tmp_path / "shot.png")
    program.until("all are asked for")
    assert "--allow-network" in program.until("QML Image:")
    program.end()
    assert server.requests == 0


@pytest.mark.both_qt
def test_an_import_from_another_machine_is_not_fetched(
    start: Any, tmp_path: Path, server: Server
) -> None:
    file = interface(tmp_path, server, f'import "http://{server.address}/parts" as Parts')
    program = start("run", file, "--screenshot", tmp_path / "shot.png")
    program.end()
    assert server.requests == 0


def test_allowed_file_is_fetched(start: Any, tmp_path: Path, server: Server) -> None:
    file = interface(tmp_path, server)
    program = start("run", file, "--allow-network", "--screenshot", tmp_path / "shot.png")
    program.end()
    assert server.requests > 0


def test_a_file_of_another_machine_is_refused(start: Any, server: Server) -> None:
    program = start("run", f"http://{server.address}/Main.qml")
    assert program.end() == 1
    assert "files of this machine only" in program.text
    assert server.requests == 0


def test_refused_requests_do_not_stop_a_busy_program(
    python: Any, tmp_path: Path, server: Server
) -> None:
    """Qt's threads must not wait for Python's lock, which the GUI thread may have."""
    file = interface(tmp_path, server)
    program = python(f"""
import sys, threading
from rosglass.qml import Application

def work():
    while True:
        sum(range(1000))

for _ in range(2):
    threading.Thread(target=work, daemon=True).start()
app = Application({str(file)!r})
app.load()
for turn in range(30):
    assert app.reload()
    app.qt.processEvents()
print("still going", flush=True)
app.close()
""")
    program.until("still going", 120)
    program.kill(9)
    assert server.requests == 0


@pytest.mark.both_qt
def test_javascript_reads_and_writes_no_files(start: Any, tmp_path: Path) -> None:
    read, written, file = (tmp_path / name for name in ("read.txt", "written.txt", "Main.qml"))
    read.write_text("secret")
    file.write_text(FILES.replace("READ", read.as_uri()).replace("WRITTEN", written.as_uri()))
    program = start("run", file)
    for method in ("READ", "WRITE"):
        program.until(f"Set QML_XHR_ALLOW_FILE_{method} to 1")
    program.until("all are asked for")
    program.kill(15)
    program.end()
    assert "secret" not in program.text
    assert not written.exists()


@pytest.mark.both_qt
@pytest.mark.skipif(not QT6, reason="Debian's Qt 5 leaves films to GStreamer")
@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_films_are_fetched_only_where_that_is_allowed(
    scheme: str, start: Any, tmp_path: Path, server: Server
) -> None:
    pytest.importorskip("PySide6.QtMultimedia", reason="needs the extra `camera`")
    file = tmp_path / "Main.qml"
    file.write_text(FILM.replace("ADDRESS", f"{scheme}://{server.address}/film.mp4"))
    program = start("run", file)
    assert "--allow-network" in program.until("not on whitelist 'file,")
    program.until("no film")
    assert server.requests == 0
    program = start("run", file, "--allow-network")
    program.until("no film")
    assert server.requests > 0
