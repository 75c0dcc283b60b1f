"""Connections that are kept while the network is away."""

from __future__ import annotations

import socket
import sys

import pytest

from rosglass.ros1.outages import outlast


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other options")
def test_a_subscriber_gives_a_connection_up_before_its_publisher_does():
    with socket.socket() as sock:
        outlast(sock)
        names = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        idle, pause, count = (sock.getsockopt(socket.IPPROTO_TCP, name) for name in names)
        given_up = sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) / 1000
    ros = 60 + 9 * 10  # rospy and roscpp set these
    assert idle + pause * count > ros
    assert given_up > ros
