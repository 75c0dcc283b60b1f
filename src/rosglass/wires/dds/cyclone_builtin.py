"""Who is there, as Cyclone DDS discovered it: participants, their writers and readers."""

from __future__ import annotations

import ctypes
from ctypes import c_char_p, c_ubyte, c_uint64, c_void_p
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from rosglass.comm import QoS
from rosglass.wires.dds.cyclone import check, library
from rosglass.wires.dds.cyclone_qos import Qos

__all__ = ["BuiltinTopic", "Discovered", "matched_publication", "matched_subscription", "take"]

_ROOM = 32
_ALIVE = 16


class BuiltinTopic(IntEnum):
    """The topics on which discovery tells its news; for :func:`cyclone.create_reader`."""

    PARTICIPANT = 0x7FFF0001
    PUBLICATION = 0x7FFF0003
    SUBSCRIPTION = 0x7FFF0004


@dataclass(frozen=True)
class Discovered:
    """A participant, writer or reader that appeared, changed or went.

    Attributes:
        alive: Whether it is there; when not, only `guid` is known.
        guid: Its 16 bytes of identity.
        handle: Its number within this process, as with samples and matches.
        participant: The identity of the participant it belongs to, or is.
        user_data: What it attached to itself.
        topic: Its DDS topic, empty for a participant.
        type: Its DDS type, empty for a participant.
        qos: Its profile.
        representations: The encodings that a writer offers or a reader takes, by their numbers;
            empty when it does not say, which stands for XCDR1 alone.
        properties: Those of `__NetworkAddresses`, `__Hostname`, `__Pid` and `__ProcessName` that a
            participant announces.
    """

    alive: bool
    guid: bytes
    handle: int
    participant: bytes = b""
    user_data: bytes = b""
    topic: str = ""
    type: str = ""
    qos: QoS = field(default_factory=QoS)
    representations: tuple[int, ...] = ()
    properties: tuple[tuple[str, str], ...] = ()


def take(reader: int, topic: BuiltinTopic, place: str) -> list[Discovered]:
    """Take the news that a reader of a built-in topic holds, the oldest first.

    Call it until it returns nothing.
    """
    samples = (c_void_p * _ROOM)()
    infos = (_Info * _ROOM)()
    lib = library()
    count = check(lib.dds_take(reader, samples, infos, _ROOM, _ROOM), "dds_take", place)
    found = []
    for sample, info in zip(samples[:count], infos, strict=False):
        alive = info.instance_state == _ALIVE and info.valid
        if topic is BuiltinTopic.PARTICIPANT:
            found.append(_participant(sample, info.instance_handle, alive))
        else:
            found.append(_endpoint(sample, info.instance_handle, alive))
    if count:
        lib.dds_return_loan(reader, samples, count)
    return found


def matched_publication(reader: int, handle: int) -> Discovered | None:
    """Return the writer with a handle that a reader is matched with, None when it is gone."""
    return _matched(library().dds_get_matched_publication_data(reader, handle), handle)


def matched_subscription(writer: int, handle: int) -> Discovered | None:
    """Return the reader with a handle that a writer is matched with, None when it is gone."""
    return _matched(library().dds_get_matched_subscription_data(writer, handle), handle)


class _Info(ctypes.Structure):
    """``dds_sample_info_t``."""

    _fields_ = (
        ("sample_state", ctypes.c_int32),
        ("view_state", ctypes.c_int32),
        ("instance_state", ctypes.c_int32),
        ("valid", ctypes.c_bool),
        ("source_timestamp", ctypes.c_int64),
        ("instance_handle", c_uint64),
        ("publication_handle", c_uint64),
        ("ranks", ctypes.c_uint32 * 5),
    )


class _Participant(ctypes.Structure):
    """``dds_builtintopic_participant_t``."""

    _fields_ = (("key", c_ubyte * 16), ("qos", c_void_p))


class _Endpoint(ctypes.Structure):
    """``dds_builtintopic_endpoint_t``."""

    _fields_ = (
        ("key", c_ubyte * 16),
        ("participant", c_ubyte * 16),
        ("participant_handle", c_uint64),
        ("topic", c_char_p),
        ("type", c_char_p),
        ("qos", c_void_p),
    )


_PROPERTIES = ("__NetworkAddresses", "__Hostname", "__Pid", "__ProcessName")


def _participant(address: Any, handle: int, alive: bool) -> Discovered:
    data = _Participant.from_address(address)
    guid = bytes(data.key)
    if not (alive and data.qos):
        return Discovered(alive, guid, handle, guid)
    qos = Qos(data.qos)
    told = ((name, qos.property(name)) for name in _PROPERTIES)
    properties = tuple((name, text) for name, text in told if text)
    return Discovered(True, guid, handle, guid, qos.user_data(), properties=properties)


def _endpoint(address: Any, handle: int, alive: bool) -> Discovered:
    data = _Endpoint.from_address(address)
    guid = bytes(data.key)
    if not (alive and data.qos):
        return Discovered(False, guid, handle)
    qos = Qos(data.qos)
    return Discovered(
        True,
        guid,
        handle,
        bytes(data.participant),
        qos.user_data(),
        data.topic.decode(errors="replace"),
        data.type.decode(errors="replace"),
        qos.profile(),
        tuple(qos.representations()),
    )


def _matched(address: int | None, handle: int) -> Discovered | None:
    if not address:
        return None
    found = _endpoint(address, handle, alive=True)
    library().dds_builtintopic_free_endpoint(address)
    return found
