"""Accepting connections when the system has run out of file descriptors."""

from __future__ import annotations

import errno
import logging
import os
import socket
import threading
import time

from waiting import eventually

from rosglass.wires.tcpros.io_loop import Acceptor, IoLoop


class Scarce(socket.socket):
    """A listening socket of a process that has no file descriptors left, for a while."""

    scarce = True
    attempts = 0

    def accept(self):
        self.attempts += 1
        if self.scarce:
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
        return super().accept()


def test_connections_are_accepted_once_descriptors_are_free_again(caplog):
    loop = IoLoop("test acceptor")
    came = threading.Event()
    listener = Scarce()
    listener.bind(("127.0.0.1", 0))
    listener.listen()
    listener.setblocking(False)

    def accept(sock: socket.socket, _: str) -> None:
        sock.close()
        came.set()

    acceptor = Acceptor(loop, listener, accept)
    with caplog.at_level(logging.WARNING, "rosglass.ros1"):
        loop.call(acceptor.open)
        with socket.create_connection(listener.getsockname()):
            began = time.monotonic()
            eventually(lambda: listener.attempts >= 4)
            lasted = time.monotonic() - began
            listener.scarce = False
            assert came.wait(30)
    loop.call(acceptor.end)
    loop.close()
    assert lasted > 0.2, "again and again, but it leaves time for others"
    messages = [record.getMessage() for record in caplog.records]
    assert messages == [f"cannot accept connections: {os.strerror(errno.EMFILE)}"]
