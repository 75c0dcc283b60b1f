"""Translation of messages between ROS 1 and ROS 2: by their bytes where possible, or by fields.

If both have the same fields in the same order, the bytes are directly read as the other ROS's
message: in ROS 1's wire format, the two differ only in ``Header.seq``. Equal parts are copied in
blocks, including arrays of messages.
"""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import ConversionError
from rosglass.interfaces import Counterparts
from rosglass.interfaces.definition import ArrayKind
from rosglass.messages.codec import codec_of
from rosglass.messages.message import plain_class
from rosglass.messages.sequences import MessageSequence
from rosglass.messages.types import ActionType, MessageType, ServiceType, default_library

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.interfaces import Definition, Library, Pair, PairedField
    from rosglass.messages.message import Message
    from rosglass.messages.schema import Member, Schema

    _Convert = Callable[[Any], Any]

__all__ = ["ActionTranslation", "ServiceTranslation", "Translation"]

_WIRES = {1: "ros1", 2: "cdr"}
#: ``Header.seq`` of messages for ROS 1, where publishers set it as they like.
_SEQ = bytes(4)
#: Size of a message in bytes from which a view is used instead of a slice.
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
    """Translates the messages of a type to the other ROS.

    The target is the other ROS's own type if it has one with corresponding fields, so that its
    nodes understand it; otherwise a type derived from the source's definition.

    Args:
        source: The type, of either ROS.
        wanted: Types of the other ROS to prefer when they correspond: those in use there.
        library: Library for the types of the other ROS; None for the shared one.

    Attributes:
        source: As given.
        type: The type in the other ROS.
        derived: Whether it was derived: nodes of the other ROS need the same definition.
        left_out: Paths of fields that the target lacks.
        added: Paths of fields that only the target has; they get their defaults.

    Raises:
        UnsupportedError: The other ROS cannot have such a type; the message gives the reason.
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
            DecodeError: The bytes are not such a message.
            ConversionError: A value does not fit the other ROS, such as a time before 1970, or an
                array beyond its bound; the message names the field.
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
            # Translating field by field finds the field and the error.
            return self._encode(self._whole(data))
        if self.source.ros == 1:
            return self._exact.encode(message, wire="cdr")
        if not self._seq:
            return self._exact.encode(message, wire="ros1")
        return b"".join([_SEQ, *self._exact.encode_parts(message, wire="ros1")])

    def convert(self, message: Message) -> Message:
        """Return a message of the other ROS; arguments and errors as in :meth:`encode`."""
        try:
            return self._build(message)  # type: ignore[no-any-return]
        except ConversionError as error:
            where = error.path, error.value, error.expected
            raise ConversionError(*where, self.source.name) from None

    def _encode(self, data: bytes | bytearray | memoryview) -> bytes:
        message = self.source.decode(data, wire=_WIRES[self.source.ros])
        return self.type.encode(self.convert(message), wire=_WIRES[self.type.ros])

    def _whole(self, data: bytes | bytearray | memoryview) -> bytes | bytearray | memoryview:
        return b"".join([_SEQ, data]) if self._seq and self.source.ros == 1 else data


class ServiceTranslation:
    """Translates the requests and responses of a service to the other ROS.

    Args:
        source: The service's type at its server, of either ROS.
        wanted: Types of the other ROS to prefer when they correspond.
        library: Library for the types of the other ROS; None for the shared one.

    Attributes:
        source: As given.
        type: The type in the other ROS, at the clients.
        request: Translates requests of the clients for the server.
        response: Translates responses of the server for the clients.

    Raises:
        UnsupportedError: The other ROS cannot have such a type; the message gives the reason.
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


class ActionTranslation:
    """Translates the goals, results and feedback of an action to the other ROS.

    Args:
        source: The action's type at its server, of either ROS.
        library: Library for the types of the other ROS; None for the shared one.

    Attributes:
        source: As given.
        type: The type in the other ROS, at the clients.
        derived: Whether it was derived; see :class:`Translation`.
        goal: Translates goals of the clients for the server.
        result: Translates results of the server for the clients.
        feedback: The same for feedback.

    Raises:
        UnsupportedError: The other ROS cannot have such a type; the message gives the reason.
    """

    def __init__(self, source: ActionType, library: Library | None = None) -> None:
        known = default_library() if library is None else library
        found, goal, result, feedback = Counterparts(known).action(source.definition)
        self.source, self.type = source, ActionType(found)
        self.derived = found.source.provider.startswith("derived from ")
        self.goal = _of_pair(self.type.goal, goal, source.definition.goal)
        self.result = _of_pair(source.result, result, found.result)
        self.feedback = _of_pair(source.feedback, feedback, found.feedback)


def _of_pair(source: MessageType, pair: Pair, target: Definition) -> Translation:
    made: Translation = object.__new__(Translation)
    made._set(source, pair, target)
    return made


# -- field by field --------------------------------------------------------------------------------


class _Step(NamedTuple):
    name: str
    read: tuple[str, ...]
    write: tuple[str, ...]
    convert: _Convert | None


def _builder(pair: Pair, ros: int, source: Schema, target: Schema) -> _Convert:
    """Return ``build(message) -> message`` from ROS `ros` to the other."""
    (field,) = pair.fields if len(pair.fields) == 1 else (None,)
    if field is not None and not field.two:
        return _wrapper(field, ros, target)
    steps = [_step(field, ros, source, target) for field in pair.fields]
    given = {step.write[0] for step in steps}
    missing = [member for member in target.members if member.attr not in given]
    zeros = {member.attr: member.number.python() for member in missing if member.number}
    if (
        any(len(step.read) > 1 or len(step.write) > 1 for step in steps)
        or len(zeros) < len(missing)
        or any(member.is_array for member in missing)
    ):
        return _careful(steps, ros, target, pair.two.name == "rcl_interfaces/msg/Log")
    simple = [(s.read[0], s.write[0]) for s in steps if s.convert is None]
    converted = [(s.read[0], s.write[0], s.convert) for s in steps if s.convert is not None]
    cls, rest = plain_class(target), list(zeros.items())

    def build(message: Any) -> Any:
        made, read = cls(), ""
        for read, write in simple:
            setattr(made, write, getattr(message, read))
        try:
            for read, write, convert in converted:
                setattr(made, write, convert(getattr(message, read)))
        except ConversionError as error:
            raise _inside(read, error) from None
        for write, zero in rest:
            setattr(made, write, zero)
        return made

    return build


def _careful(steps: list[_Step], ros: int, target: Schema, log: bool) -> _Convert:
    """Return the builder of messages whose fields are moved or derived."""

    def build(message: Any) -> Any:
        made, step = target.type.create(), None
        try:
            for step in steps:
                value, holder = message, made
                for part in step.read:
                    value = getattr(value, part)
                for part in step.write[:-1]:
                    holder = getattr(holder, part)
                value = value if step.convert is None else step.convert(value)
                setattr(holder, step.write[-1], value)
        except ConversionError as error:
            assert step is not None
            raise _inside(step.name, error) from None
        if log:
            made["level"] = _level(made["level"], ros)
        return made

    return build


def _inside(name: str, error: ConversionError) -> ConversionError:
    """Return the error of a nested field with the path in its message."""
    joint = "." if error.path and not error.path.startswith("[") else ""
    return ConversionError(f"{name}{joint}{error.path}", error.value, error.expected)


def _wrapper(field: PairedField, ros: int, target: Schema) -> _Convert:
    """Return the conversion between std_msgs/Time and builtin_interfaces/msg/Time."""
    name, kind = field.one[0], field.type_one.name
    if ros == 1:
        forth = _time(kind, 1, target)
        return lambda message: forth(getattr(message, name))
    inner = target.by_name[name].struct
    assert inner is not None
    back, cls = _time(kind, 2, inner), plain_class(target)

    def build(message: Any) -> Any:
        made = cls()
        setattr(made, name, back(message))
        return made

    return build


def _step(field: PairedField, ros: int, source: Schema, target: Schema) -> _Step:
    read, write = (field.one, field.two) if ros == 1 else (field.two, field.one)
    (reads, ours), (writes, theirs) = _member(source, read), _member(target, write)
    name, convert = ".".join(read), _converter(field, ros, ours, theirs)
    return _Step(name, reads, writes, convert)


def _converter(field: PairedField, ros: int, ours: Member, theirs: Member) -> _Convert | None:
    """Return the conversion of a field's value; None if it is unchanged."""
    if field.type_one.name in _TIME_NAMES:
        assert theirs.struct is not None
        convert = _time(field.type_one.name, ros, theirs.struct)
    elif field.inner is not None:
        assert ours.struct is not None
        assert theirs.struct is not None
        convert = _builder(field.inner, ros, ours.struct, theirs.struct)
    elif ours.number is not None and theirs.number is not None:
        same = (ours.number.low, ours.number.high) == (theirs.number.low, theirs.number.high)
        return None if same else _octets(theirs)
    else:
        return None
    if field.type_one.array is ArrayKind.NONE:
        return convert
    alike = field.inner is not None and field.inner.exact and not field.inner.has_times
    return _each(convert, theirs.struct if alike else None)


_TIME_NAMES = ("time", "duration")


def _member(schema: Schema, path: tuple[str, ...]) -> tuple[tuple[str, ...], Member]:
    """Return the attributes that lead to a field, and its member."""
    member = schema.by_name[path[0]]
    attributes = [member.attr]
    for name in path[1:]:
        assert member.struct is not None
        member = member.struct.by_name[name]
        attributes.append(member.attr)
    return tuple(attributes), member


def _each(convert: _Convert, alike: Schema | None) -> _Convert:
    """Return the conversion of an array of messages; those that are `alike` keep their bytes."""

    def each(values: Any) -> Any:
        if alike is not None and isinstance(values, MessageSequence) and values._items is None:
            kept = codec_of(alike, values._codec.wire).sequence()
            kept._items = None
            kept._buffer, kept._start, kept._count = values._buffer, values._start, values._count
            return kept
        made: list[Any] = []
        try:
            made.extend(map(convert, values))
        except ConversionError as error:
            raise _inside(f"[{len(made)}]", error) from None
        return made

    return each


def _time(kind: str, ros: int, target: Schema) -> _Convert:
    names, cls = _TIME_FIELDS[ros], plain_class(target)
    parts, (first, second) = attrgetter(*names), _TIME_FIELDS[3 - ros]
    (low, high), (least, most) = ranges = _TIME_RANGES[3 - ros, kind]

    def convert(value: Any) -> Any:
        seconds, rest = parts(value)
        if not (low <= seconds <= high and least <= rest <= most):
            for name, part, (bottom, top) in zip(names, (seconds, rest), ranges, strict=True):
                if not bottom <= part <= top:
                    expected = f"from {bottom} to {top}, as in ROS {3 - ros}"
                    raise ConversionError(name, part, expected)
        made = cls()
        setattr(made, first, seconds)
        setattr(made, second, rest)
        return made

    return convert


def _octets(target: Member) -> _Convert:
    """Return the conversion between signed and unsigned bytes with the same bits."""
    number = target.number
    assert number is not None
    signed = bool(number.low)

    def one(value: Any) -> int:
        bits = int(value) & 0xFF
        return bits - 256 if signed and bits > 127 else bits

    def many(values: Any) -> Any:
        if hasattr(values, "view"):
            return values.view("i1" if signed else "u1")
        return [one(value) for value in values]

    return many if target.is_array else one


def _level(level: int, ros: int) -> int:
    """Return a log level in the other ROS; for an unknown one, the next lower level."""
    pairs = _LEVELS if ros == 1 else tuple((two, one) for one, two in _LEVELS)
    return max((there for here, there in pairs if here <= level), default=pairs[0][1])


# -- by their bytes --------------------------------------------------------------------------------


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
    """Return the check whether times of a ROS 2 message have the same bits in ROS 1."""
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
