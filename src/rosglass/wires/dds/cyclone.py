"""The part of Cyclone DDS's C interface that ROS 2 needs; calls release the GIL.

The PyPI package `cyclonedds` contains the library. Its Python layer is not used: it holds the GIL
while it copies samples, announces a type description that keeps plain ROS 2 endpoints from
matching, and takes 0.2 s to import. Entities are the library's numbers for them. The declarations
follow the headers of Eclipse Cyclone DDS 11 (``dds/dds.h``, ``dds/ddsc/*.h``).

In this order: the library and its entities, quality of service, events, discovered participants
and endpoints. Samples are in ``cyclone_samples``.
"""

from __future__ import annotations

import ctypes
import itertools
import logging
import os
import struct
import sys
from contextlib import suppress
from ctypes import (
    POINTER,
    byref,
    c_bool,
    c_char_p,
    c_int16,
    c_int32,
    c_int64,
    c_size_t,
    c_ubyte,
    c_uint32,
    c_uint64,
    c_void_p,
)
from ctypes import c_void_p as pointer
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from typing import Any

from rosglass.comm import Durability, Duration, History, Liveliness, QoS, Reliability
from rosglass.errors import (
    ConnectionLostError,
    Error,
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)
from rosglass.extras import install_command

__all__ = [
    "GONE",
    "INFINITY",
    "TIMEOUT",
    "VERSION",
    "XCDR1",
    "BuiltinTopic",
    "Discovered",
    "Event",
    "Qos",
    "RepeatedBytes",
    "Waitset",
    "alive_writers",
    "assert_liveliness",
    "check",
    "check_alive",
    "create_domain",
    "create_participant",
    "create_reader",
    "create_topic",
    "create_writer",
    "delete",
    "guid",
    "handle",
    "library",
    "library_with_gil",
    "lost_samples",
    "matched_publication",
    "matched_publications",
    "matched_subscription",
    "matched_subscriptions",
    "publication_matched",
    "qos_of",
    "sertype",
    "set_events",
    "start_at_first_sample",
    "subscription_matched",
    "take",
]

_log = logging.getLogger("rosglass.ros2")
#: The tested version, and the series with the interface declared here.
VERSION, _SERIES = "11.0.1", "11."
#: A time span without limit, in nanoseconds.
INFINITY = 2**63 - 1

_entity = c_int32
_int_p, _long_p, _size_p = POINTER(c_int32), POINTER(c_int64), POINTER(c_size_t)
#: Result and argument types of every function that is called.
_PROTOTYPES: dict[str, tuple[Any, list[Any]]] = {
    "dds_create_domain": (_entity, [c_uint32, c_char_p]),
    "dds_create_participant": (_entity, [c_uint32, pointer, pointer]),
    "dds_create_topic": (_entity, [_entity, pointer, c_char_p, pointer, pointer]),
    "dds_create_reader": (_entity, [_entity, _entity, pointer, pointer]),
    "dds_create_writer": (_entity, [_entity, _entity, pointer, pointer]),
    "dds_delete": (c_int32, [_entity]),
    "dds_wait_for_acks": (c_int32, [_entity, c_int64]),
    "dds_get_guid": (c_int32, [_entity, pointer]),
    "dds_get_instance_handle": (c_int32, [_entity, POINTER(c_uint64)]),
    "dds_get_entity_sertype": (c_int32, [_entity, POINTER(pointer)]),
    "dds_get_matched_publications": (c_int32, [_entity, pointer, c_size_t]),
    "dds_get_matched_subscriptions": (c_int32, [_entity, pointer, c_size_t]),
    "dds_get_matched_publication_data": (pointer, [_entity, c_uint64]),
    "dds_get_matched_subscription_data": (pointer, [_entity, c_uint64]),
    "dds_builtintopic_free_endpoint": (None, [pointer]),
    "dds_assert_liveliness": (c_int32, [_entity]),
    "dds_create_statistics": (pointer, [_entity]),
    "dds_refresh_statistics": (c_int32, [pointer]),
    "dds_lookup_statistic": (pointer, [pointer, c_char_p]),
    "dds_delete_statistics": (None, [pointer]),
    "dds_create_waitset": (_entity, [_entity]),
    "dds_create_guardcondition": (_entity, [_entity]),
    "dds_set_guardcondition": (c_int32, [_entity, c_bool]),
    "dds_take_guardcondition": (c_int32, [_entity, POINTER(c_bool)]),
    "dds_set_status_mask": (c_int32, [_entity, c_uint32]),
    "dds_get_subscription_matched_status": (c_int32, [_entity, pointer]),
    "dds_get_publication_matched_status": (c_int32, [_entity, pointer]),
    "dds_get_liveliness_changed_status": (c_int32, [_entity, pointer]),
    "dds_get_sample_lost_status": (c_int32, [_entity, pointer]),
    "dds_waitset_attach": (c_int32, [_entity, _entity, c_int64]),
    "dds_waitset_wait": (c_int32, [_entity, pointer, c_size_t, c_int64]),
    "dds_take": (c_int32, [_entity, pointer, pointer, c_size_t, c_uint32]),
    "dds_return_loan": (c_int32, [_entity, pointer, c_int32]),
    "dds_takecdr": (c_int32, [_entity, pointer, c_uint32, pointer, c_uint32]),
    "dds_writecdr": (c_int32, [_entity, pointer]),
    "ddsi_serdata_from_ser_iov": (pointer, [pointer, c_int32, c_size_t, pointer, c_size_t]),
    "ddsi_serdata_size": (c_uint32, [pointer]),
    "ddsi_serdata_ref": (pointer, [pointer]),
    "ddsi_serdata_unref": (None, [pointer]),
    "ddsi_serdata_to_ser": (None, [pointer, c_size_t, c_size_t, pointer]),
    "ddsi_serdata_to_ser_ref": (pointer, [pointer, c_size_t, c_size_t, pointer]),
    "ddsi_serdata_to_ser_unref": (None, [pointer, pointer]),
    "dds_free": (None, [pointer]),
    "dds_create_qos": (pointer, []),
    "dds_delete_qos": (None, [pointer]),
    "dds_qset_reliability": (None, [pointer, c_int32, c_int64]),
    "dds_qset_durability": (None, [pointer, c_int32]),
    "dds_qset_durability_service": (
        None,
        [pointer, c_int64, c_int32, c_int32, c_int32, c_int32, c_int32],
    ),
    "dds_qset_history": (None, [pointer, c_int32, c_int32]),
    "dds_qset_deadline": (None, [pointer, c_int64]),
    "dds_qset_lifespan": (None, [pointer, c_int64]),
    "dds_qset_liveliness": (None, [pointer, c_int32, c_int64]),
    "dds_qset_userdata": (None, [pointer, c_char_p, c_size_t]),
    "dds_qset_writer_data_lifecycle": (None, [pointer, c_bool]),
    "dds_qset_data_representation": (None, [pointer, c_uint32, pointer]),
    "dds_qget_data_representation": (c_bool, [pointer, POINTER(c_uint32), POINTER(pointer)]),
    "dds_qget_reliability": (c_bool, [pointer, _int_p, _long_p]),
    "dds_qget_durability": (c_bool, [pointer, _int_p]),
    "dds_qget_history": (c_bool, [pointer, _int_p, _int_p]),
    "dds_qget_deadline": (c_bool, [pointer, _long_p]),
    "dds_qget_lifespan": (c_bool, [pointer, _long_p]),
    "dds_qget_liveliness": (c_bool, [pointer, _int_p, _long_p]),
    "dds_qget_userdata": (c_bool, [pointer, POINTER(pointer), _size_p]),
    "dds_qget_prop": (c_bool, [pointer, c_char_p, POINTER(pointer)]),
}
#: Return code for an entity that is being deleted.
GONE = -9
#: Return code of a call that timed out.
TIMEOUT = -10
#: Return codes for a deleted entity: its number is unused, or another entity's, or no domain is
#: left.
_WRONG_ENTITY = (-3, -4, -12)
#: Return codes (``dds/ddsrt/retcode.h``): the message, and the error to raise.
_CODES: dict[int, tuple[str, type[Error]]] = {
    -2: ("it is not supported", UnsupportedError),
    -3: ("a parameter is not accepted", UnsupportedError),
    -4: ("a precondition is not met", ConnectionLostError),
    -5: ("out of resources", ConnectionLostError),
    -6: ("the entity is not enabled", ConnectionLostError),
    -7: ("a policy cannot be changed any more", UnsupportedError),
    -8: ("policies contradict each other", UnsupportedError),
    -9: ("it was closed before", NodeClosedError),
    TIMEOUT: ("no answer in time", TimeoutError),
    -12: ("the entity is of another kind", UnsupportedError),
    -13: ("the security settings do not allow it", ConnectionLostError),
}


@cache
def library() -> Any:
    """Return the library with functions that release the GIL.

    Raises:
        UnsupportedError: The package is not installed, or its interface differs.
    """
    return _declare(ctypes.CDLL(library_path()))


def untested_version() -> str:
    """Return why private layouts cannot be used, empty with the tested version.

    The public interface works with every version of the series.
    """
    version = distribution("cyclonedds").version
    return "" if version == VERSION else f"cyclonedds {version} is installed instead of {VERSION}"


@cache
def library_with_gil() -> Any:
    """Return the library with functions that keep the GIL, for short calls that take no lock.

    Releasing the GIL costs more than such a call, and acquiring it again up to a switch interval.
    Do not call a function this way if it waits for a lock that a thread of the library holds while
    it calls Python.
    """
    return _declare(ctypes.PyDLL(library_path()))


def check_alive(result: int, call: str, place: str) -> int:
    """Check a call like :func:`check`, where it can only fail because the entity was deleted."""
    return check(GONE if result in _WRONG_ENTITY else result, call, place)


def check(result: int, call: str, place: str) -> int:
    """Return the result of a call, or raise its error if it is negative.

    Args:
        result: The return value of the call.
        call: The called function, e.g. ``dds_create_reader``.
        place: The topic or service it was called for, e.g. ``topic /scan``.

    Raises:
        NodeClosedError: The entity was deleted.
        TimeoutError: It took too long.
        UnsupportedError: The arguments or the library cannot do it.
        ConnectionLostError: This machine cannot do it now.
    """
    if result >= 0:
        return result
    words, kind = _CODES.get(result, ("an error that it does not explain", ConnectionLostError))
    raise kind(f"{place}: Cyclone DDS's {call} failed with code {result}: {words}")


def create_domain(domain: int, config: str) -> int:
    """Create a domain of this process; delete it after everything that belongs to it.

    Args:
        domain: Its number.
        config: Cyclone's configuration as XML, or as comma-separated XML and ``file://`` names;
            CYCLONEDDS_URI is ignored.

    Raises:
        ConnectionLostError: The process has the domain already, or the configuration is wrong.
    """
    result = library().dds_create_domain(domain, config.encode())
    return check(result, "dds_create_domain", f"domain {domain}")


def create_participant(domain: int, qos: Qos | None) -> int:
    """Join a domain; CYCLONEDDS_URI configures it unless :func:`create_domain` was called before.

    Raises:
        ConnectionLostError: This machine has no usable network interface, or no free port.
    """
    result = library().dds_create_participant(domain, _of(qos), None)
    return check(result, "dds_create_participant", f"domain {domain}")


def create_topic(participant: int, name: str, type_name: str, *, own_type: bool = False) -> int:
    """Create a topic of opaque payloads, whose type matches by name alone.

    It announces no type information, and still matches endpoints that do.

    Args:
        participant: The participant it belongs to.
        name: Its DDS name, e.g. ``rt/chatter``.
        type_name: The type's DDS name, e.g. ``std_msgs::msg::dds_::String_``.
        own_type: Whether the library gives the topic a type object (:func:`sertype`) of its own
            instead of the one that all topics with this type share.
    """
    descriptor = _descriptor(type_name, next(_own_sizes)) if own_type else _shared(type_name)
    address = ctypes.addressof(descriptor)
    result = library().dds_create_topic(participant, address, name.encode(), None, None)
    return check(result, "dds_create_topic", f"topic {name} of type {type_name}")


def create_reader(participant: int, topic: int, qos: Qos | None, place: str) -> int:
    """Create a reader; `topic` may be one of the built-in topics, `place` is for errors."""
    result = library().dds_create_reader(participant, topic, _of(qos), None)
    return check(result, "dds_create_reader", place)


def create_writer(participant: int, topic: int, qos: Qos | None, place: str) -> int:
    """Create a writer; `place` is for errors."""
    result = library().dds_create_writer(participant, topic, _of(qos), None)
    return check(result, "dds_create_writer", place)


def delete(entity: int) -> None:
    """Delete an entity and its children; deleting it twice is allowed.

    Waits for its callbacks to return: do not call it from one of them, or while holding a lock that
    they need.
    """
    library().dds_delete(entity)


def guid(entity: int) -> bytes:
    """Return the GUID of a participant, reader or writer, 16 bytes."""
    buffer = ctypes.create_string_buffer(16)
    check_alive(library().dds_get_guid(entity, buffer), "dds_get_guid", f"entity {entity}")
    return buffer.raw


def handle(entity: int) -> int:
    """Return the number that identifies a reader or writer in samples and matches."""
    value = c_uint64()
    result = library().dds_get_instance_handle(entity, ctypes.byref(value))
    check_alive(result, "dds_get_instance_handle", f"entity {entity}")
    return value.value


def sertype(entity: int) -> int:
    """Return the address of the sample type (sertype) of a reader, writer or topic.

    It is valid as long as the entity exists.
    """
    value = pointer()
    result = library().dds_get_entity_sertype(entity, ctypes.byref(value))
    check(result, "dds_get_entity_sertype", f"entity {entity}")
    return value.value or 0


def start_at_first_sample(reader: int) -> str:
    """Make a reliable reader request all samples that writers matched later have for it.

    Otherwise a volatile reader starts at the newest sample of another vendor's writer, and loses
    those sent before it discovered the writer. A writer sends a volatile reader no samples from
    before it discovered the reader; after a reconnection, samples may be received again.

    Returns:
        Why this is not possible on this machine, empty if it is.
    """
    if strange := untested_version():
        return strange
    lib, entity = library(), pointer()
    lib.dds_entity_pin.argtypes = [_entity, POINTER(pointer)]
    lib.dds_entity_unpin.argtypes = [pointer]
    check_alive(lib.dds_entity_pin(reader, ctypes.byref(entity)), "dds_entity_pin", "reader")
    try:
        address = _reader_flags(entity.value or 0, guid(reader))
        if address is None:
            return f"Cyclone DDS {VERSION} is built differently on this machine"
        ctypes.c_ubyte.from_address(address).value |= _HANDLE_AS_TRANSIENT_LOCAL
    finally:
        lib.dds_entity_unpin(entity)
    return ""


def matched_publications(reader: int) -> list[int]:
    """Return the handles of the writers that a reader is matched with."""
    return _matched("dds_get_matched_publications", reader)


def matched_subscriptions(writer: int) -> list[int]:
    """Return the handles of the readers that a writer is matched with."""
    return _matched("dds_get_matched_subscriptions", writer)


def acknowledged(writer: int) -> bool:
    """Return whether all matched reliable readers of a writer have acknowledged all samples."""
    result: int = library().dds_wait_for_acks(writer, 0)
    return result != TIMEOUT


def assert_liveliness(entity: int, place: str) -> None:
    """Assert the liveliness of a participant or writer."""
    check_alive(library().dds_assert_liveliness(entity), "dds_assert_liveliness", place)


class RepeatedBytes:
    """Return the number of bytes that a writer has repeated at the request of readers.

    Args:
        writer: The writer.
    """

    def __init__(self, writer: int) -> None:
        lib = library()
        self._statistics: int | None = lib.dds_create_statistics(writer)
        self._found = self._statistics and lib.dds_lookup_statistic(
            self._statistics, b"rexmit_bytes"
        )

    def get(self) -> int:
        """Return the number so far; 0 if the writer was deleted."""
        if not self._found or library().dds_refresh_statistics(self._statistics) < 0:
            return 0
        return int(_Statistic.from_address(self._found).value)

    def close(self) -> None:
        """Release the memory."""
        if self._statistics:
            library().dds_delete_statistics(self._statistics)
        self._statistics = self._found = None


class _Statistic(ctypes.Structure):
    """``dds_stat_keyvalue`` (``dds/ddsc/dds_statistics.h``)."""

    _fields_ = (("name", c_char_p), ("kind", c_int32), ("value", c_uint64))


class _Descriptor(ctypes.Structure):
    """``dds_topic_descriptor_t`` (``dds/ddsc/dds_public_impl.h``)."""

    _fields_ = (
        ("size", c_uint32),
        ("align", c_uint32),
        ("flags", c_uint32),
        ("key_count", c_uint32),
        ("type_name", c_char_p),
        ("keys", pointer),
        ("op_count", c_uint32),
        ("ops", pointer),
        ("meta", c_char_p),
        ("type_information", pointer),
        ("type_information_size", c_size_t),
        ("type_mapping", pointer),
        ("type_mapping_size", c_size_t),
        ("restrict_data_representation", c_uint32),
    )


#: One octet at offset 0, then the end (``dds/ddsc/dds_opcodes.h``): the library checks that a
#: payload has that octet, and leaves the rest alone.
_OPS = (c_uint32 * 3)(0x01010000, 0, 0)
#: Sizes of native samples, by which the library distinguishes types of one name. They are unrelated
#: to payloads: no native sample is ever created.
_own_sizes = itertools.count(2)


def _descriptor(type_name: str, size: int) -> _Descriptor:
    return _Descriptor(
        size=size,
        align=1,
        type_name=type_name.encode(),
        op_count=len(_OPS),
        ops=ctypes.addressof(_OPS),
        meta=b"",
    )


@cache
def _shared(type_name: str) -> _Descriptor:
    return _descriptor(type_name, 1)


#: The bytes of a ``dds_reader`` that contain the pointer to its ``ddsi_reader``.
_DDSI_READER = slice(400, 1000)
#: Offset of a ``ddsi_reader``'s flags from its pointer back to the ``dds_reader``: the pointers to
#: the history and the profile are in between. Two of the flags.
_FLAGS = 24
_RELIABLE, _HANDLE_AS_TRANSIENT_LOCAL = 1, 2
#: Upper limit of pointers in this process.
_LAST_ADDRESS = 2**47


def _reader_flags(address: int, identity: bytes) -> int | None:
    """Return the address of a reliable reader's flags from its ``dds_reader``; None if not found.

    Memory is read through the kernel, which refuses addresses outside this process.
    """
    # A GUID is four numbers, sent in big endian.
    own = struct.pack("=4I", *struct.unpack(">4I", identity))
    back = struct.pack("=Q", address)
    with suppress(OSError), open("/proc/self/mem", "rb", buffering=0) as memory:  # noqa: PTH123
        file = memory.fileno()
        size = _DDSI_READER.stop - _DDSI_READER.start
        words = os.pread(file, size, address + _DDSI_READER.start)
        for (found,) in struct.iter_unpack("=Q", words[: len(words) // 8 * 8]):
            if not 0 < found < _LAST_ADDRESS:
                continue
            with suppress(OSError):  # no address
                data = os.pread(file, 400, found)
                at = data.find(back) + _FLAGS
                if data[4:20] == own and _FLAGS <= at < len(data) and at % 8 == 0:
                    return found + at if data[at] & _RELIABLE else None
    return None


def _of(qos: Qos | None) -> int | None:
    return None if qos is None else qos.address


def _matched(call: str, entity: int) -> list[int]:
    function = getattr(library(), call)
    room = 16
    while True:
        handles = (c_uint64 * room)()
        count = check(function(entity, handles, room), call, f"entity {entity}")
        if count <= room:
            return handles[:count]
        room = count


def library_path() -> str:
    """Return the path of Cyclone DDS's library in the installed package.

    Raises:
        UnsupportedError: It is not installed, or its version cannot be used.
    """
    remedy = f"install it with: {install_command('dds')}"
    try:
        found = distribution("cyclonedds")
    except PackageNotFoundError:
        raise UnsupportedError(f"Cyclone DDS is not installed; {remedy}") from None
    if not found.version.startswith(_SERIES):
        raise UnsupportedError(
            f"cyclonedds {found.version} is installed, but {VERSION} is needed; {remedy}"
        )
    if strange := untested_version():
        _warn(strange, remedy)
    if sys.maxsize < 2**32:
        raise UnsupportedError("DDS needs a 64-bit Python")
    for file in found.files or ():
        if file.name.startswith(("libddsc", "ddsc")) and file.suffix != ".lib":
            return str(file.locate())
    raise UnsupportedError(f"the package cyclonedds {VERSION} has no library in it; {remedy}")


@cache
def _warn(strange: str, remedy: str) -> None:
    _log.warning(
        "%s: services and actions of nodes that use Fast DDS or RustDDS cannot be called, nor "
        "offered to them, and the rest is untested; %s",
        strange,
        remedy,
    )


def _declare(loaded: Any) -> Any:
    for name, (result, arguments) in _PROTOTYPES.items():
        function = getattr(loaded, name)
        function.restype, function.argtypes = result, arguments
    return loaded


#: Data representation number of ROS 2's encoding (DDS-XTypes 1.3, 7.6.3.1).
XCDR1 = 0

_AUTOMATIC, _MANUAL_BY_TOPIC = 0, 2
_UNLIMITED = -1


class Qos:
    """A set of QoS policies.

    Args:
        borrowed: Address of policies that their owner frees; None for a new, empty set.

    Attributes:
        address: Its address.
    """

    def __init__(self, borrowed: int | None = None) -> None:
        # Set last: after Ctrl-C in between, policies that were not created are not freed.
        self._owned = False
        self.address: int = library().dds_create_qos() if borrowed is None else borrowed
        self._owned = borrowed is None

    def __del__(self) -> None:
        if self._owned:
            library().dds_delete_qos(self.address)

    def set_user_data(self, data: bytes) -> None:
        """Attach bytes that are announced with the entity."""
        library().dds_qset_userdata(self.address, data, len(data))

    def set_history(self, depth: int | None) -> None:
        """Keep the newest `depth` samples; None keeps all."""
        library().dds_qset_history(self.address, int(depth is None), depth or 0)

    def wait_at_most(self, seconds: float) -> None:
        """Limit how long a reliable writer waits for slow readers."""
        library().dds_qset_reliability(self.address, 1, round(seconds * 1e9))

    def user_data(self) -> bytes:
        """Return the bytes attached to the entity, empty if it has none."""
        value, size = c_void_p(), c_size_t()
        if not library().dds_qget_userdata(self.address, byref(value), byref(size)):
            return b""
        if not value.value:
            return b""
        data = ctypes.string_at(value.value, size.value)
        library().dds_free(value)
        return data

    def property(self, name: str) -> str:
        """Return a named property, empty if it is missing."""
        value = c_void_p()
        if not library().dds_qget_prop(self.address, name.encode(), byref(value)):
            return ""
        text = ctypes.cast(value, c_char_p).value or b""
        library().dds_free(value)
        return text.decode(errors="replace")

    def representations(self) -> list[int]:
        """Return the numbers of the announced encodings, empty if there are none."""
        values, size = c_void_p(), c_uint32()
        if not library().dds_qget_data_representation(self.address, byref(size), byref(values)):
            return []
        if not values.value:
            return []
        found = (c_int16 * size.value).from_address(values.value)[:]
        library().dds_free(values)
        return found

    def profile(self) -> QoS:
        """Return the policies that exist in ROS 2, with DDS's defaults for those not announced.

        Discovery does not announce the depth of remote endpoints.
        """
        lib, kind, kind2, depth, span = library(), c_int32(), c_int32(), c_int32(), c_int64()
        reliability, durability, history = (
            Reliability.BEST_EFFORT,
            Durability.VOLATILE,
            History.KEEP_LAST,
        )
        if lib.dds_qget_reliability(self.address, byref(kind), byref(span)) and kind.value:
            reliability = Reliability.RELIABLE
        # Transient and persistent are stronger than transient local.
        if lib.dds_qget_durability(self.address, byref(kind)) and kind.value:
            durability = Durability.TRANSIENT_LOCAL
        if lib.dds_qget_history(self.address, byref(kind), byref(depth)) and kind.value:
            history = History.KEEP_ALL
        liveliness, lease = Liveliness.AUTOMATIC, None
        if lib.dds_qget_liveliness(self.address, byref(kind2), byref(span)):
            lease = _duration(span.value)
            if kind2.value == _MANUAL_BY_TOPIC:
                liveliness = Liveliness.MANUAL_BY_TOPIC
        deadline = lifespan = None
        if lib.dds_qget_deadline(self.address, byref(span)):
            deadline = _duration(span.value)
        if lib.dds_qget_lifespan(self.address, byref(span)):
            lifespan = _duration(span.value)
        return QoS(
            depth=max(depth.value, 1),
            reliability=reliability,
            durability=durability,
            history=history,
            deadline=deadline,
            lifespan=lifespan,
            liveliness=liveliness,
            lease_duration=lease,
        )


def qos_of(profile: QoS, *, writer: bool, user_data: bytes = b"") -> Qos:
    """Return the DDS policies of a writer or reader with the ROS 2 profile `profile`."""
    qos, lib = Qos(), library()
    address = qos.address
    reliable = profile.reliability is Reliability.RELIABLE
    lib.dds_qset_reliability(address, int(reliable), INFINITY if reliable else 0)
    keep_all = profile.history is History.KEEP_ALL
    depth = _UNLIMITED if keep_all else profile.depth
    qos.set_history(None if keep_all else profile.depth)
    latched = profile.durability is Durability.TRANSIENT_LOCAL
    lib.dds_qset_durability(address, int(latched))
    if writer and latched:
        lib.dds_qset_durability_service(
            address, 0, int(keep_all), depth, _UNLIMITED, _UNLIMITED, _UNLIMITED
        )
    if profile.deadline is not None:
        lib.dds_qset_deadline(address, profile.deadline.nanoseconds)
    if writer and profile.lifespan is not None:
        lib.dds_qset_lifespan(address, profile.lifespan.nanoseconds)
    manual = profile.liveliness is Liveliness.MANUAL_BY_TOPIC
    lease = profile.lease_duration
    lib.dds_qset_liveliness(
        address,
        _MANUAL_BY_TOPIC if manual else _AUTOMATIC,
        INFINITY if lease is None else lease.nanoseconds,
    )
    if writer:
        lib.dds_qset_writer_data_lifecycle(address, False)
    # XCDR1 alone: ROS 2 uses no other encoding.
    lib.dds_qset_data_representation(address, 1, byref(c_int16(XCDR1)))
    if user_data:
        qos.set_user_data(user_data)
    return qos


def _duration(nanoseconds: int) -> Duration | None:
    return None if nanoseconds in (0, INFINITY) else Duration(nanoseconds)


#: Maximum number of conditions that a wait returns.
_KEYS = 64


class Event(IntFlag):
    """Events of a reader or writer (``dds_status_id_t``)."""

    NONE = 0
    SAMPLE_LOST = 1 << 5
    DATA_AVAILABLE = 1 << 8
    LIVELINESS_CHANGED = 1 << 10
    PUBLICATION_MATCHED = 1 << 11
    SUBSCRIPTION_MATCHED = 1 << 12


def set_events(entity: int, events: Event) -> None:
    """Set the events of an entity that wake the waitset it is attached to."""
    result = library().dds_set_status_mask(entity, events)
    check_alive(result, "dds_set_status_mask", f"entity {entity}")


def subscription_matched(reader: int) -> bool:
    """Return whether matched writers appeared or left since the last call; resets the event."""
    return _has_changed(_status(reader, "subscription_matched"))


def publication_matched(writer: int) -> bool:
    """Return whether matched readers appeared or left since the last call; resets the event."""
    return _has_changed(_status(writer, "publication_matched"))


def _has_changed(status: list[int]) -> bool:
    _total, change, _current, current_change, *_ = status
    return bool(change or current_change)


def alive_writers(reader: int) -> int:
    """Return how many of a reader's writers assert their liveliness; resets the event."""
    return _status(reader, "liveliness_changed")[0]


def lost_samples(reader: int) -> int:
    """Return a reader's total number of lost samples; resets the event."""
    return _status(reader, "sample_lost")[0]


def _status(entity: int, what: str) -> list[int]:
    """Return the first numbers of a status (OMG DDS 1.4, section 2.2.4.1)."""
    numbers, call = (c_int32 * 8)(), f"dds_get_{what}_status"
    check_alive(getattr(library(), call)(entity, numbers), call, f"entity {entity}")
    return numbers[:]


class Waitset:
    """Waits, without the GIL, until one of several conditions holds.

    Args:
        participant: The participant that owns it.
    """

    def __init__(self, participant: int) -> None:
        lib = library()
        self._entity = check(lib.dds_create_waitset(participant), "dds_create_waitset", "waitset")
        self._guard = check(
            lib.dds_create_guardcondition(participant), "dds_create_guardcondition", "waitset"
        )
        self.attach(self._guard, 0)
        self._keys = (c_uint64 * _KEYS)()
        self._wait = lib.dds_waitset_wait

    def attach(self, entity: int, key: int) -> None:
        """Also wait for a condition, or an entity with a status mask; `key` must not be 0."""
        check(library().dds_waitset_attach(self._entity, entity, key), "dds_waitset_attach", "")

    def wait(self, timeout: float | None) -> list[int]:
        """Return the triggered keys, none after `timeout` seconds or :meth:`wake`."""
        keys = self._keys
        span = INFINITY if timeout is None else int(timeout * 1e9)
        count = self._wait(self._entity, keys, _KEYS, span)
        if count < 0:
            check(count, "dds_waitset_wait", "waitset")
        found: list[int] = keys[:count]  # `count` may exceed the room
        if 0 in found:
            library().dds_take_guardcondition(self._guard, ctypes.byref(c_bool()))
            found = [key for key in found if key]
        return found

    def wake(self) -> None:
        """Make :meth:`wait` in another thread return."""
        library().dds_set_guardcondition(self._guard, True)

    def close(self) -> None:
        """Delete the waitset; no thread may be waiting."""
        for entity in (self._guard, self._entity):
            delete(entity)


_ROOM = 32
_ALIVE = 16


class BuiltinTopic(IntEnum):
    """The built-in topics of discovery; for :func:`create_reader`."""

    PARTICIPANT = 0x7FFF0001
    PUBLICATION = 0x7FFF0003
    SUBSCRIPTION = 0x7FFF0004


@dataclass(frozen=True)
class Discovered:
    """A participant, writer or reader that appeared, changed or left.

    Attributes:
        alive: Whether it exists; if not, only `guid` is known.
        guid: Its GUID, 16 bytes.
        handle: Its number within this process, as in samples and matches.
        participant: The GUID of its participant, or its own.
        user_data: The user data that it announces.
        topic: Its DDS topic, empty for a participant.
        type: Its DDS type, empty for a participant.
        qos: Its profile.
        representations: The numbers of the encodings that a writer offers or a reader accepts;
            empty if none are announced, which means XCDR1 alone.
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
    """Return some samples of a built-in topic, the oldest first; empty if there are none."""
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
    """Return a reader's matched writer by its handle, None if it has left."""
    return _matched_endpoint(library().dds_get_matched_publication_data(reader, handle), handle)


def matched_subscription(writer: int, handle: int) -> Discovered | None:
    """Return a writer's matched reader by its handle, None if it has left."""
    return _matched_endpoint(library().dds_get_matched_subscription_data(writer, handle), handle)


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
    named = ((name, qos.property(name)) for name in _PROPERTIES)
    properties = tuple((name, text) for name, text in named if text)
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


def _matched_endpoint(address: int | None, handle: int) -> Discovered | None:
    if not address:
        return None
    found = _endpoint(address, handle, alive=True)
    library().dds_builtintopic_free_endpoint(address)
    return found
