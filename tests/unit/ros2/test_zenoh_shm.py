from __future__ import annotations

import logging

import pytest

zenoh = pytest.importorskip("zenoh")
pytest.importorskip("zenoh.shm")

from rosglass.wires.zenoh import endpoints  # noqa: E402
from rosglass.wires.zenoh.endpoints import SharedMemory  # noqa: E402

BIG = 100_000


def test_small_payloads_take_the_usual_way():
    assert SharedMemory().place((b"x" * 1000,)) is None


def test_parts_arrive_as_they_are():
    parts = (b"head", bytearray(b"y" * BIG), memoryview(b"z" * 3 * BIG), b"")
    payload = SharedMemory().place(parts)
    assert payload is not None
    assert payload.to_bytes() == b"".join(parts)


def test_bigger_payloads_get_a_bigger_pool(monkeypatch):
    monkeypatch.setattr(endpoints, "_MIN_POOL_SIZE", 4 * BIG)
    monkeypatch.setattr(endpoints, "_MIN_POOL_PAYLOADS", 2)
    shared = SharedMemory()
    kept = [shared.place((bytes([size]) * size * BIG,)) for size in (1, 2, 3, 8)]
    assert [payload.to_bytes()[:1] for payload in kept] == [b"\x01", b"\x02", b"\x03", b"\x08"]


def test_full_pool_does_not_raise(monkeypatch):
    monkeypatch.setattr(endpoints, "_MIN_POOL_SIZE", 4 * BIG)
    monkeypatch.setattr(endpoints, "_MIN_POOL_PAYLOADS", 2)
    shared = SharedMemory()
    kept = [shared.place((b"x" * BIG,)) for _ in range(8)]
    assert kept[0] is not None
    assert kept[-1] is None
    kept.clear()
    assert shared.place((b"x" * BIG,)) is not None


def test_machine_without_shared_memory_is_logged_once(monkeypatch, caplog):
    monkeypatch.setattr(endpoints, "_free", lambda: 1_000_000)
    shared = SharedMemory()
    with caplog.at_level(logging.WARNING):
        assert [shared.place((b"x" * BIG,)) for _ in range(3)] == [None, None, None]
    assert len(caplog.records) == 1
    assert "no shared memory for messages of 100000 bytes" in caplog.text


def test_pool_is_not_larger_than_the_user_may_lock(monkeypatch, caplog):
    monkeypatch.setattr(endpoints, "lockable_bytes", lambda: 6 * 2**20)
    shared = SharedMemory()
    assert shared.place((b"x" * 2**20,)) is not None
    with caplog.at_level(logging.WARNING):
        assert shared.place((b"x" * 7 * 2**20,)) is None
    assert "this user may lock 6 MB; 14 MB are needed at least: raise the limit" in caplog.text
    assert shared.place((b"x" * 2**20,)) is not None


def test_users_other_than_root_may_lock_what_their_limit_says(monkeypatch):
    monkeypatch.setattr(endpoints.os, "geteuid", lambda: 1000)
    monkeypatch.setattr(endpoints.resource, "getrlimit", lambda _: (8 * 2**20, 8 * 2**20))
    assert endpoints.lockable_bytes() == 6 * 2**20
