"""A TCP relay in a process of its own, which can stall and then delivers what lies in it."""

from __future__ import annotations

import signal
import subprocess
import sys

from ports import free_port

__all__ = ["Relay"]

_PROGRAM = """
import asyncio, sys

async def pump(reader, writer):
    try:
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
    except OSError:
        pass
    finally:
        writer.close()

async def relay(reader, writer):
    try:
        other = await asyncio.open_connection("127.0.0.1", int(sys.argv[2]))
    except OSError:
        writer.close()
        return
    await asyncio.gather(pump(reader, other[1]), pump(other[0], writer))

async def main():
    server = await asyncio.start_server(relay, "127.0.0.1", int(sys.argv[1]))
    print("ready", flush=True)
    await server.serve_forever()

asyncio.run(main())
"""


class Relay:
    """Relays TCP connections to a port of this machine.

    Attributes:
        port: The port to connect to.
    """

    def __init__(self, port: int) -> None:
        self.port = free_port()
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, str(self.port), str(port)], stdout=subprocess.PIPE
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == b"ready\n"

    def stall(self) -> None:
        """Forward nothing until :meth:`resume`; the system takes what is sent all the same."""
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Forward what was sent, and go on."""
        self._process.send_signal(signal.SIGCONT)

    def __enter__(self) -> Relay:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
