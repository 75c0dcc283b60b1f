"""Messages: plain objects with a slot for every field, or shells that become such an object.

A shell holds only the received bytes. The first access to any field decodes that level and turns
the shell into a plain object, in place; from then on, access is as fast as for any attribute.
Larger nested messages and arrays of messages stay shells of their own.

Dicts and messages are converted into messages strictly; missing fields get the type's defaults.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from functools import lru_cache, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import ConversionError, DecodeError, Error, FieldPathError
from rosglass.interfaces.hashes import load_json
from rosglass.messages.schema import Kind
from rosglass.messages.source import hint, load_numpy, number_type
from rosglass.messages.values import (
    as_number,
    as_sequence,
    as_text,
    check_length,
    elements,
    numbers,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np

    from rosglass.messages.schema import Member, Schema

__all__ = [
    "Message",
    "NoSuchFieldError",
    "Step",
    "column_type",
    "complete",
    "convert",
    "find_member",
    "finite",
    "get_path",
    "parse_path",
    "plain",
    "plain_class",
    "resolve_path",
    "set_path",
    "short",
    "to_dict",
    "to_json",
    "to_yaml",
    "touch",
    "writable",
]


_FILL_TIMEOUT_S = 0.1
#: Number of fields from which no function is compiled for the field that is read first.
_MANY_FIELDS = 64


class NoSuchFieldError(FieldPathError, AttributeError):
    """The message has no field of that name."""


class Message:
    """A ROS message; made by :class:`~rosglass.messages.MessageType`, never directly.

    Fields are attributes (``message.header.stamp.sec``), items (``message["header"]``) and ends of
    paths (``message["poses[2].position.x"]``). A field whose name is a Python keyword has an
    underscore appended as an attribute (``message.from_``) and keeps its name everywhere else.
    A field named like a method (``copy``) or ``type`` hides it: code for any message uses
    :func:`~rosglass.messages.type_of` and ``Message.copy(message)``.

    Numeric arrays of a received message are numpy views of its bytes and read-only: use
    :meth:`writable` or a :meth:`copy` to change single elements. Values are checked when the
    message is encoded.
    """

    __slots__ = ("_buffer__", "_offset__")
    __hash__ = None  # type: ignore[assignment]
    #: The bytes of a shell; unset in plain objects. A view keeps its object alive.
    _buffer__: bytes | memoryview
    #: Offset at which the shell of a nested message starts in the bytes.
    _offset__: int
    _schema__: ClassVar[Schema]
    #: Decodes a shell; None for plain classes.
    _fill__: ClassVar[Callable[[Message], None] | None] = None
    #: The codec for whole messages like the bytes of a root shell; None for all others.
    _root__: ClassVar[object] = None

    @property
    def type(self) -> Any:
        """The message's :class:`~rosglass.messages.MessageType`, unless it has a field `type`."""
        return self._schema__.type

    def __getattr__(self, name: str) -> Any:
        # Reached for unknown names, and for slots another thread is just about to fill.
        schema = self._schema__
        if any(name == member.attr for member in schema.members):
            deadline = time.monotonic() + _FILL_TIMEOUT_S
            while time.monotonic() < deadline:
                time.sleep(0.00005)
                try:
                    return object.__getattribute__(self, name)
                except AttributeError:
                    continue
            raise NoSuchFieldError(f"{schema.name}: field {name!r} was deleted")
        if name.endswith("__"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise NoSuchFieldError(_no_field(schema, name))

    def __getitem__(self, path: str) -> Any:
        member = self._schema__.by_name.get(path)
        if member is not None:
            return getattr(self, member.attr)
        return get_path(self, path)

    def __setitem__(self, path: str, value: Any) -> None:
        member = self._schema__.by_name.get(path)
        if member is not None:
            setattr(self, member.attr, value)
        else:
            set_path(self, path, value)

    def __iter__(self) -> Iterator[str]:
        return (member.name for member in self._schema__.members)

    def __contains__(self, name: object) -> bool:
        return name in self._schema__.by_name

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *(m.attr for m in self._schema__.members)})

    def writable(self, path: str) -> np.ndarray:
        """Return a numeric array of the message for writing into.

        The first call copies the array out of the received bytes; later calls return that copy.

        Raises:
            FieldPathError: The field does not exist, or is not a numeric array.
        """
        return writable(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return the message as a dict of wire field names.

        Nested messages become dicts, arrays of messages lists of dicts; numeric arrays remain numpy
        arrays. ``encode`` returns the same bytes for it.
        """
        return to_dict(self)

    def to_json(self, indent: int | None = None) -> str:
        """Return the message as JSON.

        Arrays are lists; floats that JSON cannot represent become the strings ``"NaN"``,
        ``"Infinity"`` and ``"-Infinity"``, as in protobuf's JSON mapping; bytes of strings that are
        not UTF-8, and unpaired surrogates, become U+FFFD.
        """
        return to_json(self, indent)

    def to_yaml(self) -> str:
        """Return the message as YAML, each numeric array in one line."""
        return to_yaml(self)

    def copy(self) -> Message:
        """Return a deep copy, detached from the received bytes; its arrays are writable."""
        return copy_of(self)

    def __copy__(self) -> Message:
        touch(self)
        twin = plain_class(self._schema__)()
        for member in self._schema__.members:
            setattr(twin, member.attr, getattr(self, member.attr))
        return twin

    def __deepcopy__(self, memo: dict[int, Any]) -> Message:
        return Message.copy(self)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Message):
            return NotImplemented
        return same(self, other)

    def __reduce__(self) -> tuple[Any, ...]:
        kind = self._schema__.type
        return _restore, (kind, kind.encode(self))

    def __repr__(self) -> str:
        return short(self)


def _restore(kind: Any, data: bytes) -> Message:
    cdr = kind.wire == "cdr"
    made: Message = kind.decode(data, wstring_width=4) if cdr else kind.decode(data)
    return made


def _no_field(schema: Schema, name: str) -> str:
    known = [member.name for member in schema.members]
    return f"{schema.name} has no field {name!r}; {hint(name, known)}"


def touch(message: Message) -> None:
    """Decode a shell's own level, if it is one."""
    fill = type(message)._fill__
    if fill is not None:
        fill(message)


def copy_of(message: Message) -> Message:
    """Return a deep copy; a value of another kind than its field is copied unchanged."""
    twin = plain_class(message._schema__)()
    for member in message._schema__.members:
        value = getattr(message, member.attr)
        if member.is_array:
            value = _copy_array(member, value)
        elif isinstance(value, Message):
            value = copy_of(value)
        setattr(twin, member.attr, value)
    return twin


def _copy_array(member: Member, value: Any) -> Any:
    if member.kind is Kind.STRUCT:
        return [copy_of(item) if isinstance(item, Message) else item for item in value]
    return value.copy() if hasattr(value, "copy") else list(value)


def same(one: Message, other: Message) -> bool:
    """Return whether two messages have the same type and values; NaN equals NaN."""
    if one is other:
        return True
    if one._schema__ is not other._schema__:
        return False
    return all(
        _same_value(member, getattr(one, member.attr), getattr(other, member.attr))
        for member in one._schema__.members
    )


def _same_value(member: Member, one: Any, other: Any) -> bool:
    if not member.is_array:
        # NaN is the only value that differs from itself.
        return bool(one == other or (one != one and other != other))  # noqa: PLR0124
    if len(one) != len(other):
        return False
    if member.number is None:
        return all(left == right for left, right in zip(one, other, strict=True))
    numpy = load_numpy()
    left, right = numpy.asarray(one), numpy.asarray(other)
    equal = left == right
    if left.dtype.kind == "f":
        equal |= numpy.isnan(left) & numpy.isnan(right)
    return bool(equal.all())


class Stamp:
    """The additional properties of times and durations, in ROS 1 and ROS 2."""

    __slots__ = ()
    _schema__: ClassVar[Schema]

    @property
    def nanoseconds(self) -> int:
        """The total in nanoseconds."""
        whole, rest = (getattr(self, member.attr) for member in self._schema__.members)
        return int(whole) * 1_000_000_000 + int(rest)

    @property
    def is_duration(self) -> bool:
        """True for a duration, False for a point in time."""
        return self._schema__.name.lower().endswith("duration")

    @property
    def seconds(self) -> float:
        """The total in seconds; a float loses accuracy below a microsecond."""
        return self.nanoseconds / 1e9


def plain_class(schema: Schema) -> type[Message]:
    """Return the class of a schema's messages."""
    found: type[Message] = schema.cached("class", lambda: _make_class(schema))
    return found


def _make_class(schema: Schema) -> type[Message]:
    bases = (Message, Stamp) if schema.is_time else (Message,)
    body = {
        "__slots__": tuple(member.attr for member in schema.members),
        "__module__": "rosglass.messages",
        "__qualname__": schema.name,
        "_schema__": schema,
    }
    made: type[Message] = type(schema.name.rpartition("/")[2], bases, body)
    return made


def shell_class(
    schema: Schema, root: object, compile_fill: Callable[[Any, str], Callable[[Any], Any]]
) -> type[Message]:
    """Return the class of a schema's shells: its plain class with every field shadowed.

    Args:
        schema: The schema.
        root: The codec for whole messages like the shells' bytes; None for parts of messages.
        compile_fill: Called with the class and the name of an attribute; returns the function that
            decodes a shell and returns that attribute (nothing for an empty name).
    """
    cls = plain_class(schema)

    def fill(message: Message) -> None:
        made = compile_fill(shell, "")
        shell._fill__ = staticmethod(made)
        made(message)

    body: dict[str, Any] = {
        "__slots__": (),
        "__module__": cls.__module__,
        "_schema__": schema,
        "_root__": root,
        "_fill__": staticmethod(fill),
    }
    for member in schema.members:
        body[member.attr] = _first_access(member.attr, compile_fill)
    shell: Any = type(cls.__name__, (cls,), body)
    made: type[Message] = shell
    return made


def _first_access(attr: str, compile_fill: Callable[[Any, str], Callable[[Any], Any]]) -> property:
    """Return the property of a shell's field, whose code is compiled when it is first used."""

    def get(message: Message) -> Any:
        shell = type(message)
        if shell._fill__ is None:  # another thread has decoded it
            return getattr(message, attr)
        if len(shell._schema__.members) > _MANY_FIELDS:
            touch(message)
            return getattr(message, attr)
        made = compile_fill(shell, attr)
        setattr(shell, attr, property(made, put))
        return made(message)

    def put(message: Message, value: Any) -> None:
        touch(message)
        setattr(message, attr, value)

    return property(get, put)


def await_fill(message: Message, shell: type[Message]) -> None:
    """Wait until another thread has decoded a message and made it a plain object."""
    deadline = time.monotonic() + _FILL_TIMEOUT_S
    while type(message) is shell:
        if time.monotonic() > deadline:
            raise DecodeError(message._schema__.name, "decoding was interrupted; decode again")
        time.sleep(0.00005)


#: One step of a path: a field name, an index, or a slice (``[*]`` is ``slice(None)``).
Step = str | int | slice

_TOKEN = re.compile(
    r"(?P<dot>\.?)(?P<name>[A-Za-z_]\w*)"
    r"|\[(?P<index>[+-]?\d+)\]"
    r"|\[(?P<star>\*)\]"
    r"|\[(?P<start>[+-]?\d+)?:(?P<stop>[+-]?\d+)?(?::(?P<step>[+-]?\d+)?)?\]"
)


@lru_cache(maxsize=1024)
def parse_path(path: str) -> tuple[Step, ...]:
    """Split a path into its steps.

    Raises:
        FieldPathError: It is not of the form ``name.name[3].name[*]``.
    """
    if not isinstance(path, str):
        raise FieldPathError(f"a field path is a str such as 'pose.position.x', got {path!r}")
    steps: list[Step] = []
    place = 0
    while place < len(path):
        match = _TOKEN.match(path, place)
        if match is None or (bool(steps) != bool(match["dot"]) and match["name"]):
            raise FieldPathError(
                f"field path {path!r} is malformed at character {place + 1}; "
                "write it like 'poses[2].position.x', 'ranges[1:5]' or 'markers[*].id'"
            )
        place = match.end()
        if match["name"]:
            steps.append(match["name"])
        elif match["index"]:
            steps.append(int(match["index"]))
        elif match["star"]:
            steps.append(slice(None))
        else:
            parts = (match["start"], match["stop"], match["step"])
            cut = slice(*(None if part is None else int(part) for part in parts))
            if cut.step == 0:
                raise FieldPathError(f"field path {path!r}: a slice's step cannot be 0")
            steps.append(cut)
    if not steps:
        raise FieldPathError("a field path cannot be empty")
    return tuple(steps)


def find_member(schema: Schema, name: str, path: str) -> Member:
    """Return the member `name`; raises FieldPathError with the nearest name."""
    member = schema.by_name.get(name)
    if member is None:
        names = [known.name for known in schema.members]
        raise FieldPathError(
            f"field path {path!r}: {schema.name} has no field {name!r}; {hint(name, names)}"
        )
    return member


def resolve_path(schema: Schema, path: str) -> list[tuple[Member, Step | None]]:
    """Check a path against a schema; return (member, index or slice) for each field on it.

    Raises:
        FieldPathError: The path does not exist in the type.
    """
    found: list[tuple[Member, Step | None]] = []
    inside: Schema | None = schema
    open_array = False
    for step in parse_path(path):
        if isinstance(step, str):
            if open_array:
                raise FieldPathError(
                    f"field path {path!r}: {found[-1][0].name!r} is an array; "
                    f"write {found[-1][0].name}[0] or {found[-1][0].name}[*]"
                )
            if inside is None:
                raise FieldPathError(
                    f"field path {path!r}: {found[-1][0].name!r} is a "
                    f"{found[-1][0].field.type.name} and has no fields"
                )
            member = find_member(inside, step, path)
            found.append((member, None))
            inside, open_array = member.struct, member.is_array
        else:
            if not open_array:
                what = found[-1][0].name if found else "the message"
                raise FieldPathError(f"field path {path!r}: {what!r} is not an array")
            member = found[-1][0]
            if isinstance(step, int) and member.fixed_count is not None:
                _check_index(step, member.fixed_count, path)
            found[-1] = (member, step)
            open_array = False
    return found


def column_type(rest: list[tuple[Member, Step | None]]) -> Any:
    """Return the numpy type of a column at the end of a route; None for other values."""
    number, step = rest[-1][0].number, rest[-1][1]
    if number is None or (rest[-1][0].is_array and not isinstance(step, int)):
        return None
    if any(isinstance(step, slice) for _, step in rest):
        return None  # a column of columns, of any lengths
    return bool if number.python is bool else number_type(number.dtype, "<")


def _check_index(index: int, count: int, path: str) -> None:
    if not -count <= index < count:
        raise FieldPathError(
            f"field path {path!r}: index {index} is out of range, the array holds {count}"
        )


def get_path(message: Message, path: str) -> Any:
    """Return the value at a path; after a slice of messages, those of all elements."""
    route = resolve_path(message._schema__, path)
    try:
        return _follow(message, route, path)
    except (AttributeError, TypeError) as error:
        raise _astray(error, path) from None


def _astray(error: Exception, path: str) -> Exception:
    # Assigned values are not checked before they are encoded.
    if isinstance(error, Error):
        return error
    return FieldPathError(f"field path {path!r} meets an assigned value of the wrong kind: {error}")


def _follow(message: Any, route: list[tuple[Member, Step | None]], path: str) -> Any:
    value = message
    for place, (member, step) in enumerate(route):
        value = getattr(value, member.attr)
        if isinstance(step, int):
            _check_index(step, len(value), path)
            value = value[step]
            if member.number is not None:
                value = value.item() if hasattr(value, "item") else value
        elif isinstance(step, slice):
            value = value[step]
            rest = route[place + 1 :]
            if rest and member.kind is Kind.STRUCT:
                found = [_follow(element, rest, path) for element in value]
                leaf = column_type(rest)
                return found if leaf is None else load_numpy().array(found, leaf)
    return value


def set_path(message: Message, path: str, value: Any) -> None:
    """Set the value at a path; an array still in the received bytes is copied first.

    Raises:
        FieldPathError: The path does not exist.
        ConversionError: A number does not fit its array; other values are checked when encoding.
    """
    route = resolve_path(message._schema__, path)
    try:
        _put(message, route, path, value)
    except ConversionError as error:
        name = message._schema__.name
        raise ConversionError(error.path, error.value, error.expected, name) from None
    except (AttributeError, TypeError) as error:
        raise _astray(error, path) from None


def _put(message: Message, route: list[tuple[Member, Step | None]], path: str, value: Any) -> None:
    target: Any = message
    for place, (member, step) in enumerate(route):
        final = place + 1 == len(route)
        if final and step is None:
            setattr(target, member.attr, value)
            return
        holder = target
        target = getattr(target, member.attr)
        if step is None:
            continue
        if isinstance(step, int):
            _check_index(step, len(target), path)
        elif not final:
            raise FieldPathError(f"field path {path!r}: only the last step can be a slice to set")
        if final:
            if member.number is not None:
                target = _own(holder, member)
                count = len(range(len(target))[step]) if isinstance(step, slice) else 1
                assert not isinstance(step, str)  # names are members by now
                value = elements(member, step, count, value, path)
            target[step] = value
        else:
            target = target[step]


def writable(message: Message, path: str) -> np.ndarray:
    """Return the numeric array at a path, copied if it is in the received bytes."""
    route = resolve_path(message._schema__, path)
    member, step = route[-1]
    if not member.is_array or member.number is None or step is not None:
        raise FieldPathError(f"field path {path!r} does not lead to a numeric array")
    holder = _follow(message, route[:-1], path)
    if isinstance(holder, list):
        raise FieldPathError(f"field path {path!r} leads to several arrays")
    array: np.ndarray = _own(holder, member)
    return array


def _own(holder: Any, member: Member) -> Any:
    array = getattr(holder, member.attr)
    flags = getattr(array, "flags", None)
    if flags is None:  # a value assigned to the field
        array = numbers(member, array, member.name)
    elif flags.writeable:
        return array
    else:
        array = array.copy()
    setattr(holder, member.attr, array)
    return array


_SHOWN = 6
_LONGEST = 60
#: The characters for bytes that are not UTF-8, and for half pairs in a ``wstring``.
_SURROGATE = re.compile("[\ud800-\udfff]")


def to_dict(message: Message) -> dict[str, Any]:
    """Return the message as nested dicts; numeric arrays are kept."""
    return {
        member.name: _dict_value(member, getattr(message, member.attr))
        for member in message._schema__.members
    }


def _dict_value(member: Member, value: Any) -> Any:
    if member.kind is not Kind.STRUCT:
        number = member.number
        single = isinstance(value, (bytes, bytearray)) and len(value) == 1 and not member.is_array
        if single and number is not None and number.name == "byte":
            return int.from_bytes(value, "little", signed=number.low != 0)
        return value
    if member.is_array:
        return [to_dict(element) if hasattr(element, "_schema__") else element for element in value]
    return to_dict(value) if hasattr(value, "_schema__") else value


def plain(value: Any) -> Any:
    """Return a value of :func:`to_dict` with lists for arrays and readable strings."""
    if isinstance(value, dict):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, str):
        return _SURROGATE.sub("\N{REPLACEMENT CHARACTER}", value)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return value


def to_json(message: Message, indent: int | None = None) -> str:
    """Return the message as strict JSON."""
    dumped: str = load_json().dumps(
        finite(plain(to_dict(message))), indent=indent, ensure_ascii=False, allow_nan=False
    )
    return dumped


def finite(value: Any) -> Any:
    """Return a value of :func:`plain` with strings for numbers that JSON does not support."""
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [finite(inner) for inner in value]
    return value


def to_yaml(message: Message) -> str:
    """Return the message as YAML; lists of numbers take one line."""
    yaml = import_module("yaml")

    class Dumper(yaml.SafeDumper):  # type: ignore[misc, name-defined]
        pass

    def represent_list(dumper: Any, items: list[Any]) -> Any:
        flow = not any(isinstance(item, (dict, list, str)) for item in items)
        return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=flow)

    Dumper.add_representer(list, represent_list)
    dumped: str = yaml.dump(
        plain(to_dict(message)),
        Dumper=Dumper,
        sort_keys=False,
        default_flow_style=False,
        allow_unicode=True,
        width=2**31,
    )
    return dumped


def short(message: Message) -> str:
    """Return the type and fields in one line, with long arrays and strings truncated."""
    try:
        return message._schema__.name + _fields(message)
    except DecodeError as error:
        return f"{message._schema__.name}(<{error}>)"


def _fields(message: Message) -> str:
    parts = []
    for member in message._schema__.members:
        try:
            value = getattr(message, member.attr)
        except AttributeError:
            parts.append(f"{member.name}=<deleted>")
            continue
        parts.append(f"{member.name}={_short_value(member, value)}")
    return f"({', '.join(parts)})"


def _short_value(member: Member, value: Any) -> str:
    if not member.is_array:
        if hasattr(value, "_schema__"):
            return _fields(value)
        return _cut(repr(value))
    if not hasattr(value, "__len__") or isinstance(value, str):
        return _cut(repr(value))
    count = len(value)
    few = value[: _SHOWN if count > _SHOWN else count]
    few = few.tolist() if hasattr(few, "tolist") else list(few)
    shown = [_fields(item) if hasattr(item, "_schema__") else _cut(repr(item)) for item in few]
    more = [f"... {count} in all"] if count > _SHOWN else []
    return f"[{', '.join(shown + more)}]"


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


_NANO = 1_000_000_000


def convert(schema: Schema, value: Any) -> Message:
    """Return a plain message made from a dict, a message of the type, or something like a time.

    Raises:
        ConversionError: A value does not fit; its path is the field's from the root.
    """
    try:
        return _message(schema, value, "")
    except ConversionError as error:
        raise ConversionError(error.path, error.value, error.expected, schema.name) from None


def _message(schema: Schema, value: Any, path: str) -> Message:
    cls = plain_class(schema)
    if isinstance(value, Message):
        if value._schema__ is not schema:
            raise ConversionError(path, value, _expected(schema, value._schema__))
        given = _attributes(value)
    elif isinstance(value, Mapping):
        given = _known_fields(schema, value, path)
    elif schema.is_time and (parts := _time_parts(value)) is not None:
        given = dict(zip((m.name for m in schema.members), parts, strict=True))
    else:
        raise ConversionError(path, value, f"a dict or a {schema.name}")
    made = cls()
    for member in schema.members:
        if member.name in given:
            inner = f"{path}.{member.name}" if path else member.name
            found = _member(member, given[member.name], inner)
        else:
            found = _default(member)
        setattr(made, member.attr, found)
    return made


def _attributes(message: Message) -> dict[str, Any]:
    return {m.name: getattr(message, m.attr) for m in message._schema__.members}


def complete(schema: Schema, value: Any) -> dict[str, Any]:
    """Return a dict with every field, the missing ones with their defaults; checks no values.

    Raises:
        LookupError, TypeError, AttributeError, ConversionError: Missing fields are not the only
            fault.
    """
    if isinstance(value, Message):
        if value._schema__ is not schema:
            raise TypeError
        value = _attributes(value)
    defaults: dict[str, Any] = schema.cached("defaults", lambda: to_dict(_message(schema, {}, "")))
    made = dict(defaults)
    for name, given in value.items():
        member = schema.by_name[name]
        if name != member.name and member.name in value:
            raise LookupError
        struct = member.struct
        if struct is None:
            made[member.name] = given
        elif member.is_array:
            items = as_sequence(given, name, struct.name)
            made[member.name] = [complete(struct, item) for item in items]
        else:
            made[member.name] = complete(struct, given)
    return made


def _expected(schema: Schema, other: Schema) -> str:
    text = f"a {schema.name}"
    if schema.name == other.name:
        text += f" of ROS {schema.ros}" if schema.ros != other.ros else " with the same definition"
    return text


def _known_fields(schema: Schema, value: Mapping[Any, Any], path: str) -> dict[str, Any]:
    given = {}
    for key, item in value.items():
        member = schema.by_name.get(key) if isinstance(key, str) else None
        if member is None:
            names = [known.name for known in schema.members]
            where = f"{path}.{key}" if path else str(key)
            raise ConversionError(where, item, f"a field of {schema.name} ({hint(key, names)})")
        if member.name in given:
            raise ConversionError(f"{path}.{key}" if path else str(key), item, "each field once")
        given[member.name] = item
    return given


def _time_parts(value: Any) -> tuple[Any, Any] | None:
    for names in (("secs", "nsecs"), ("sec", "nanosec")):
        if all(hasattr(value, name) for name in names):
            return getattr(value, names[0]), getattr(value, names[1])
    total = getattr(value, "nanoseconds", None)
    if isinstance(total, int) and not isinstance(total, bool):
        return divmod(total, _NANO)
    return None


def _member(member: Member, value: Any, path: str) -> Any:
    """Return the value of a field, checked and in its canonical Python form."""
    if not member.is_array:
        return _element(member, value, path)
    if member.number is not None:
        return numbers(member, value, path)
    items = as_sequence(value, path, member.field.type.name)
    check_length(member, len(items), value, path)
    return [_element(member, item, f"{path}[{index}]") for index, item in enumerate(items)]


def _element(member: Member, value: Any, path: str) -> Any:
    if member.number is not None:
        return as_number(member.number, value, path)
    if member.kind is Kind.TEXT:
        return as_text(member, value, path)
    assert member.struct is not None
    return _message(member.struct, value, path)


def _default(member: Member) -> Any:
    """Return a fresh default value of a field: the definition's, or zero and empty."""
    given = member.field.default
    if given is not None:
        return _member(member, list(given) if isinstance(given, tuple) else given, member.name)
    count = member.fixed_count or 0
    one: Callable[[], Any]
    if member.number is not None:
        if member.is_array:
            kind = bool if member.number.python is bool else number_type(member.number.dtype, "<")
            return load_numpy().zeros(count, kind)
        one = member.number.python
    elif member.kind is Kind.TEXT:
        one = str
    else:
        assert member.struct is not None
        one = partial(_message, member.struct, {}, "")
    return [one() for _ in range(count)] if member.is_array else one()
