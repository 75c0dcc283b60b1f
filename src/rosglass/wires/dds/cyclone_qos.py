"""Quality of service as Cyclone DDS keeps it, made from and read as ROS 2's.

The mapping is rmw_cyclonedds's: whoever speaks to ROS 2 must offer and request the same.
"""

from __future__ import annotations

import ctypes
from ctypes import byref, c_char_p, c_int16, c_int32, c_int64, c_size_t, c_uint32, c_void_p

from rosglass.comm import Durability, Duration, History, Liveliness, QoS, Reliability
from rosglass.wires.dds.cyclone import INFINITY, library

__all__ = ["XCDR1", "Qos", "qos_of"]

#: The encoding of ROS 2's messages, as data representations are numbered (DDS-XTypes 1.3, 7.6.3.1).
XCDR1 = 0

_AUTOMATIC, _MANUAL_BY_TOPIC = 0, 2
_UNLIMITED = -1


class Qos:
    """A set of policies.

    Args:
        borrowed: Address of policies that someone else frees; None for a new, empty set.

    Attributes:
        address: Where the library keeps it.
    """

    def __init__(self, borrowed: int | None = None) -> None:
        # Last, as Ctrl-C may come in between: what was not created is not freed.
        self._owned = False
        self.address: int = library().dds_create_qos() if borrowed is None else borrowed
        self._owned = borrowed is None

    def __del__(self) -> None:
        if self._owned:
            library().dds_delete_qos(self.address)

    def set_user_data(self, data: bytes) -> None:
        """Attach bytes that everyone sees who discovers the entity."""
        library().dds_qset_userdata(self.address, data, len(data))

    def set_history(self, depth: int | None) -> None:
        """Keep the newest `depth` samples, or all with None."""
        library().dds_qset_history(self.address, int(depth is None), depth or 0)

    def wait_at_most(self, seconds: float) -> None:
        """Let a reliable writer wait no longer than so for readers that take nothing."""
        library().dds_qset_reliability(self.address, 1, round(seconds * 1e9))

    def user_data(self) -> bytes:
        """Return the bytes attached to the entity, empty when there are none."""
        value, size = c_void_p(), c_size_t()
        if not library().dds_qget_userdata(self.address, byref(value), byref(size)):
            return b""
        if not value.value:
            return b""
        data = ctypes.string_at(value.value, size.value)
        library().dds_free(value)
        return data

    def property(self, name: str) -> str:
        """Return a named property, empty when there is none."""
        value = c_void_p()
        if not library().dds_qget_prop(self.address, name.encode(), byref(value)):
            return ""
        text = ctypes.cast(value, c_char_p).value or b""
        library().dds_free(value)
        return text.decode(errors="replace")

    def representations(self) -> list[int]:
        """Return the numbers of the encodings that are announced, empty when none are."""
        values, size = c_void_p(), c_uint32()
        if not library().dds_qget_data_representation(self.address, byref(size), byref(values)):
            return []
        if not values.value:
            return []
        found = (c_int16 * size.value).from_address(values.value)[:]
        library().dds_free(values)
        return found

    def profile(self) -> QoS:
        """Return the policies that ROS 2 has; what was not announced has DDS's default.

        Depth is never announced by discovery, so it says nothing about remote endpoints.
        """
        lib, kind, kind2, depth, span = library(), c_int32(), c_int32(), c_int32(), c_int64()
        reliability, durability, history = (
            Reliability.BEST_EFFORT,
            Durability.VOLATILE,
            History.KEEP_LAST,
        )
        if lib.dds_qget_reliability(self.address, byref(kind), byref(span)) and kind.value:
            reliability = Reliability.RELIABLE
        # Transient and persistent are more than transient local.
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
    """Return the policies of a writer or reader with ROS 2's `profile`."""
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
    # XCDR1 alone: ROS 2 knows no other encoding.
    lib.dds_qset_data_representation(address, 1, byref(c_int16(XCDR1)))
    if user_data:
        qos.set_user_data(user_data)
    return qos


def _duration(nanoseconds: int) -> Duration | None:
    return None if nanoseconds in (0, INFINITY) else Duration(nanoseconds)
