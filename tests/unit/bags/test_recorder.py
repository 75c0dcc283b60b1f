"""Errors of a recording whose file cannot be written."""

from __future__ import annotations

import errno
import threading

import pytest
from waiting import eventually

import rosglass
from rosglass.bags import Recorder
from rosglass.bags.mcap_file import McapFile


@pytest.mark.parametrize("full", ["message", "end"])
def test_disk_that_is_full_when_the_file_is_closed(tmp_path, monkeypatch, full):
    """Closing writes the file's buffer, again after a failed write."""
    crashes = []
    monkeypatch.setattr(threading, "excepthook", crashes.append)
    close, failure = McapFile.close, OSError(errno.ENOSPC, "No space left on device")

    def refuse(*_):
        raise failure

    def close_in_vain(file):
        close(file)
        raise failure

    monkeypatch.setattr(McapFile, "close", close_in_vain)
    if full == "message":
        monkeypatch.setattr(McapFile, "write", refuse)
    with rosglass.connect(f"local://full_at_{full}", "robot") as node:
        recorder = Recorder(node, tmp_path / "full.mcap", ["/chatter"])
        publisher = node.create_publisher("/chatter", "std_msgs/msg/String")
        eventually(lambda: publisher.subscription_count)
        publisher.publish(data="hello")
        with pytest.raises(rosglass.BagError, match=r"cannot be written: No space left on device"):
            recorder.close()
    assert not crashes
