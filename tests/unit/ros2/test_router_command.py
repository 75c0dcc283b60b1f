from __future__ import annotations

import signal

import pytest

from rosglass.cli import main
from rosglass.wires.zenoh import router as module


@pytest.fixture
def routers(monkeypatch):
    """Routers that are never opened; the command ends at once."""
    made = []

    class FakeRouter(module.Router):
        def __init__(self, listen, config_file):
            monkeypatch.setattr(module, "open_session", lambda config: None)
            super().__init__(listen, config_file)
            made.append(self)

        def _watch(self, session):
            return None

    monkeypatch.setattr("rosglass.cli.router.Router", FakeRouter)
    monkeypatch.setattr("threading.Event.wait", lambda self, timeout=None: True)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield made
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(
    ("arguments", "listen", "url", "warned"),
    [
        ([], "tcp/127.0.0.1:7447", "zenoh://127.0.0.1:7447", False),
        (["--listen", "tcp/[::1]:8000"], "tcp/[::1]:8000", "zenoh://[::1]:8000", False),
        (["--listen", "tcp/localhost:1"], "tcp/localhost:1", "zenoh://localhost:1", False),
        (["--listen", "tcp/0.0.0.0:1"], "tcp/0.0.0.0:1", "zenoh://127.0.0.1:1", True),
        (["--listen", "tcp/10.0.0.7:1"], "tcp/10.0.0.7:1", "zenoh://10.0.0.7:1", True),
        (["--open"], "tcp/[::]:7447", "zenoh://[::1]:7447", True),
    ],
)
def test_listening_address_is_printed_and_open_ones_are_warned_of(
    routers, capsys, arguments, listen, url, warned
):
    assert main(["router", *arguments]) == 0
    assert routers[0].listen == listen
    shown = capsys.readouterr()
    assert f"Zenoh router at {listen}; connect with {url}" in shown.out
    assert ("open to the network" in shown.err) is warned


def test_invalid_address_is_refused(routers, capsys):
    assert main(["router", "--listen", "7447"]) == 1
    assert "listen: expected an address such as tcp/127.0.0.1:7447" in capsys.readouterr().err
