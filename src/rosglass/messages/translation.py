"""Messages of one ROS in the other's words: by their bytes, or field by field where that must be.

Where both have the same fields in the same order, the bytes are read as the other ROS's message at
once: in ROS 1's wire format the two differ in ``Header.seq`` only. Whatever is alike goes through
in blocks, arrays of messages included.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError
from rosglass.interfaces import Counterparts
from rosglass.interfaces.definition import ArrayKind
from rosglass.messages.codec import codec_of
from rosglass.messages.loading import ServiceType, default_library
from rosglass.messages.message import plain_class
from rosglass.messages.sequences import MessageSequence
from rosglass.messages.types import MessageType

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.interfaces import Definition, FieldType, Library, Pair, PairedField
    from rosglass.messages.message import Message
    from rosglass.messages.schema import Member, Schema

    _Convert = Callable[[Any, str], Any]

__all__ = ["ServiceTranslation", "Translation"]

_WIRES = {1: "ros1", 2: "cdr"}
#: ``Header.seq`` of the messages that we make for ROS 1; publishers there number them as they like.
_SEQ = bytes(4)
#: Bytes of a message from which on a slice of it is no copy.
_BIG = 1 << 16
#: ROS 1's levels of log messages and ROS 2's (rosgraph_msgs/Log, rcl_interfaces/msg/Log).
_LEVELS = ((1, 10), (2, 20), (4, 30), (8, 40), (16, 50))
_TIME_FIELDS = {1: ("secs", "nsecs"), 2: ("sec", "nanosec")}
#: Smallest and largest values of the parts of times and durations, by ROS.
_TIME_RANGES = {
    (1, "time"): ((0, 2**32 - 1), (0, 2**32 - 1)),
    (1, "duration"): ((-(2**31), 2**31 - 1), (-(2**31), 2**31 - 1)),
    (2, "time"): ((-(2**31), 2**31 - 1), (0, 2**32 - 1)),
    (2, "duration"): ((-(2**31), 2**31 - 1), (0, 2**32 - 1)),
}


class Translation:
    """Turns one type's messages into those of the other ROS.

    The target is the other ROS's own type where it has one whose fields correspond, so that its
    nodes understand it; otherwise a type derived from the source's definition.

    Args:
        source: The type, of either ROS.
        wanted: Types of the other ROS to prefer when they correspond: those in use there.
        library: Where the other ROS's types are looked up; None for the shared library.

    Attributes:
        source: As given.
        type: The type in the other ROS.
        derived: Whether it was derived: the other ROS's nodes know it only if they have the same.
        left_out: Paths of fields that the target has no place for.
        added: Paths of fields that only the target has; they get their defaults.

    Raises:
        UnsupportedError: There can be no such type; says why.
    """

    def __init__(
        self,
        source: MessageType,
        wanted: Sequence[MessageType] = (),
        library: Library | None = None,
    ) -> None:
        known = default_library() if library is None else library
        counterparts = Counterparts(known)
        preferred = [kind.definition for kind in wanted if kind.ros != source.ros]
        self._set(source, counterparts.message(source.definition, *preferred), None)

    def _set(self, source: MessageType, pair: Pair, target: Definition | None) -> None:
        self.source = source
        forth = source.ros == 1
        other = (pair.two if forth else pair.one) if target is None else target
        self.type = MessageType(other)
        self.derived = other.source.provider.startswith("derived from ")
        self.left_out = tuple(pair.lost(source.ros))
        self.added = tuple(pair.lost(3 - source.ros))
        self._build = _builder(pair, source.ros, source._schema, self.type._schema)
        self._seq = pair.exact and _starts_with_seq(pair)
        two = self.type if forth else source
        self._exact = two if pair.exact else None
        self._times = _time_checks(pair, two._schema) if pair.exact else []

    def encode(self, data: bytes | bytearray | memoryview) -> bytes:
        """Return a message's bytes for the other ROS.

        Args:
            data: The message as received, in its own ROS's wire format.

        Raises:
            DecodeError: These are no bytes of such a message.
            ConversionError: A value does not fit the other ROS, such as a time before 1970, or
                an array beyond its bound; says which field.
        """
        if self._exact is None:
            return self._encode(data)
        if self.source.ros == 1:
            if self._seq:
                if len(data) < len(_SEQ):
                    self.source.validate(data)
                data = (memoryview(data) if len(data) > _BIG else data)[len(_SEQ) :]
            message = self._exact.decode(data, wire="ros1")
        else:
            message = self._exact.decode(data, wire="cdr")
        if not all(fits(message) for fits in self._times):
            # Field by field it becomes clear where, and what is wrong there.
            return self._encode(self._whole(data))
        if self.source.ros == 1:
            return self._exact.encode(message, wire="cdr")
        if not self._seq:
            return self._exact.encode(message, wire="ros1")
        return b"".join([_SEQ, *self._exact.encode_parts(message, wire="ros1")])

    def convert(self, message: Message) -> Message:
        """Return a message of the other ROS; arguments and errors as in :meth:`encode`."""
        return self._build(message, "")  # type: ignore[no-any-return]

    def _encode(self, data: bytes | bytearray | memoryview) -> bytes:
        message = self.source.decode(data, wire=_WIRES[self.source.ros])
        return self.type.encode(self._build(message, ""), wire=_WIRES[self.type.ros])

    def _whole(self, data: bytes | bytearray | memoryview) -> bytes | bytearray | memoryview:
        return b"".join([_SEQ, data]) if self._seq and self.source.ros == 1 else data


class ServiceTranslation:
    """Turns the requests and responses of a service into those of the other ROS.

    Args:
        source: The service's type where it is offered, of either ROS.
        wanted: Types of the other ROS to prefer when they correspond.
        library: Where the other ROS's types are looked up; None for the shared library.

    Attributes:
        source: As given.
        type: The type in the other ROS, where it is called.
        request: From what is called there to what the server takes.
        response: From what the server answers to what the caller gets.

    Raises:
        UnsupportedError: There can be no such type; says why.
    """

    def __init__(
        self,
        source: ServiceType,
        wanted: Sequence[ServiceType] = (),
        library: Library | None = None,
    ) -> None:
        known = default_library() if library is None else library
        preferred = [kind.definition for kind in wanted if kind.ros != source.ros]
        found, request, response = Counterparts(known).service(source.definition, *preferred)
        self.source, self.type = source, ServiceType(found)
        self.derived = found.source.provider.startswith("derived from ")
        self.request = _of_pair(self.type.request, request, source.definition.request)
        self.response = _of_pair(source.response, response, found.response)


def _of_pair(source: MessageType, pair: Pair, target: Definition) -> Translation:
    made: Translation = object.__new__(Translation)
    made._set(source, pair, target)
    return made


# -- field by field --------------------------------------------------------------------------------


def _builder(pair: Pair, ros: int, source: Schema, target: Schema) -> _Convert:
    """Return ``build(message, path) -> message`` from ROS `ros` to the other."""
    steps = [_step(field, ros, source, target) for field in pair.fields]
    cls, log = plain_class(target), pair.two.name == "rcl_interfaces/msg/Log"
    if len(steps) == 1 and not (steps[0][0] and steps[0][1]):
        return _wrapper(pair, ros, target)
    given = {step[1][0] for step in steps}
    missing = [member for member in target.members if member.name not in given]
    simple = all(member.number is not None and not member.is_array for member in missing)
    whole = not simple or any(len(step[1]) > 1 for step in steps)
    zeros = [(member.name, member.number.python()) for member in missing if member.number]

    def build(message: Any, path: str) -> Any:
        made = target.type.create() if whole else cls()
        if not whole:
            for name, zero in zeros:
                made[name] = zero
        for read, write, convert in steps:
            value, place = message, path
            for name in read:
                value = value[name]
                place = f"{place}.{name}" if place else name
            if convert is not None:
                value = convert(value, place)
            holder = made
            for name in write[:-1]:
                holder = holder[name]
            holder[write[-1]] = value
        if log:
            made["level"] = _level(made["level"], ros)
        return made

    return build


def _wrapper(pair: Pair, ros: int, target: Schema) -> _Convert:
    """Return what turns std_msgs/Time into builtin_interfaces/msg/Time, or back."""
    (field,) = pair.fields
    name = field.one[0]
    kind = field.type_one.name
    if ros == 1:
        forth = _time(kind, 1, target)
        return lambda message, path: forth(message[name], f"{path}.{name}" if path else name)
    member = target.by_name[name]
    assert member.struct is not None
    back, cls = _time(kind, 2, member.struct), plain_class(target)

    def build(message: Any, path: str) -> Any:
        made = cls()
        made[name] = back(message, path)
        return made

    return build


def _step(
    field: PairedField, ros: int, source: Schema, target: Schema
) -> tuple[tuple[str, ...], tuple[str, ...], _Convert | None]:
    read, write = (field.one, field.two) if ros == 1 else (field.two, field.one)
    if not (read and write):
        return read, write, None
    ours, theirs = _member(source, read), _member(target, write)
    kind: FieldType = field.type_one
    convert: _Convert | None = None
    if kind.name in _TIME_NAMES:
        assert theirs.struct is not None
        convert = _time(kind.name, ros, theirs.struct)
    elif field.inner is not None:
        assert ours.struct is not None
        assert theirs.struct is not None
        convert = _builder(field.inner, ros, ours.struct, theirs.struct)
    elif ours.number is not None and theirs.number is not None:
        if (ours.number.low, ours.number.high) != (theirs.number.low, theirs.number.high):
            return read, write, _octets(theirs)
        return read, write, None
    else:
        return read, write, None
    if kind.array is ArrayKind.NONE:
        return read, write, convert
    alike = field.inner is not None and field.inner.exact and _plain(field.inner)
    return read, write, _each(convert, theirs.struct if alike else None)


_TIME_NAMES = ("time", "duration")


def _member(schema: Schema, path: tuple[str, ...]) -> Member:
    member = schema.by_name[path[0]]
    for name in path[1:]:
        assert member.struct is not None
        member = member.struct.by_name[name]
    return member


def _each(convert: _Convert, alike: Schema | None) -> _Convert:
    """Return what converts an array of messages; those that are `alike` keep their bytes."""

    def each(values: Any, path: str) -> Any:
        if alike is not None and isinstance(values, MessageSequence) and values._items is None:
            made = codec_of(alike, values._codec.wire).sequence()
            made._items = None
            made._buffer, made._start, made._count = values._buffer, values._start, values._count
            return made
        return [convert(value, f"{path}[{index}]") for index, value in enumerate(values)]

    return each


def _time(kind: str, ros: int, target: Schema) -> _Convert:
    names, others = _TIME_FIELDS[ros], _TIME_FIELDS[3 - ros]
    ranges, cls = _TIME_RANGES[3 - ros, kind], plain_class(target)

    def convert(value: Any, path: str) -> Any:
        made = cls()
        for name, other, (low, high) in zip(names, others, ranges, strict=True):
            part = value[name]
            if not low <= part <= high:
                where = f"{path}.{name}" if path else name
                raise ConversionError(
                    where, part, f"from {low} to {high}, as ROS {3 - ros} has it", target.name
                )
            made[other] = part
        return made

    return convert


def _octets(target: Member) -> _Convert:
    """Return what turns signed bytes into unsigned ones, or back: the bits stay."""
    number = target.number
    assert number is not None
    signed = bool(number.low)

    def one(value: Any, _: str) -> int:
        bits = int(value) & 0xFF
        return bits - 256 if signed and bits > 127 else bits

    if not target.is_array:
        return one

    def many(values: Any, path: str) -> Any:
        if hasattr(values, "view"):
            return values.view("i1" if signed else "u1")
        return [one(value, path) for value in values]

    return many


def _level(level: int, ros: int) -> int:
    """Return the level of a log message in the other ROS, that of the next lower known one."""
    pairs = _LEVELS if ros == 1 else tuple((two, one) for one, two in _LEVELS)
    return max((there for here, there in pairs if here <= level), default=pairs[0][1])


# -- by their bytes --------------------------------------------------------------------------------


def _plain(pair: Pair) -> bool:
    """Return whether an element can keep its bytes: there is no ``seq`` and no time in it."""
    return all(
        field.type_one.name not in _TIME_NAMES and (field.inner is None or _plain(field.inner))
        for field in pair.fields
    )


def _starts_with_seq(pair: Pair) -> bool:
    if any(field.name == "seq" for field in pair.one.fields) and (
        pair.one.name == "std_msgs/msg/Header" and len(pair.one.fields) > len(pair.two.fields)
    ):
        return True
    first = pair.fields[0] if pair.fields else None
    return first is not None and first.inner is not None and _starts_with_seq(first.inner)


def _time_checks(
    pair: Pair, schema: Schema, before: tuple[str, ...] = ()
) -> list[Callable[[Any], bool]]:
    """Return what says whether the times of ROS 2's message mean the same in ROS 1's bits."""
    found = []
    for field in pair.fields:
        path = (*before, *(schema.by_name[name].attr for name in field.two))
        if field.type_one.name in _TIME_NAMES:
            found.append(_time_check(path, field.type_one.name))
        elif field.inner is not None and field.type_one.array is ArrayKind.NONE:
            inner = schema.by_name[field.two[0]].struct
            assert inner is not None
            found += _time_checks(field.inner, inner, path)
    return found


def _time_check(path: tuple[str, ...], kind: str) -> Callable[[Any], bool]:
    def fits(message: Any) -> bool:
        for name in path:
            message = getattr(message, name)
        bits = message.sec if kind == "time" else message.nanosec
        return bool(0 <= bits < 2**31)

    return fits
