"""A node's log leaves no handlers, threads or locks behind."""

from __future__ import annotations

import logging
import threading

import pytest

import rosglass
from rosglass.comm import ConnectionState


@pytest.fixture
def node():
    with rosglass.connect("local://log", "robot") as node:
        yield node


def test_closing_leaves_no_handlers_and_no_threads(node):
    before = [one for one in logging.getLogger("rosglass").handlers if _is_ours(one)]
    node.logger.info("last words")
    assert [one for one in node.logger.handlers if _is_ours(one)]
    node.close()
    assert [one for one in logging.getLogger("rosglass").handlers if _is_ours(one)] == before
    assert not [one for one in node.logger.handlers if _is_ours(one)]
    assert not [one for one in threading.enumerate() if one.name.startswith("robot ")]


def _is_ours(handler):
    """Return whether a handler publishes: those for the terminal stay."""
    return type(handler).__name__ in {"RosoutHandler", "LibraryLog"}


def test_node_may_close_while_its_log_is_announced(node, monkeypatch):
    create, closed = node.create_publisher, threading.Event()

    def create_and_close(*arguments):
        made = create(*arguments)
        node.close()
        closed.set()
        return made

    monkeypatch.setattr(node, "create_publisher", create_and_close)
    node.logger.info("announced at the first message")
    assert closed.wait(30)
    assert node.status().state is ConnectionState.CLOSED
