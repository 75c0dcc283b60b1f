"""Messages: plain objects with a slot for every field, or shells that become such an object.

A shell holds the received bytes and nothing else. The first access to any field decodes that level
and turns the shell into a plain object, in place; from then on access costs what any attribute
costs. Nested messages of some size and arrays of messages stay shells of their own.
"""

from __future__ import annotations

import time
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import DecodeError, FieldPathError
from rosglass.messages import access, text
from rosglass.messages.runtime import hint
from rosglass.messages.schema import Kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np

    from rosglass.messages.codec import Codec
    from rosglass.messages.schema import Member, Schema
    from rosglass.messages.types import MessageType

__all__ = ["Message", "NoSuchFieldError", "plain_class", "touch", "type_of"]

_PATIENCE = 0.1
#: Fields from which on a message does not get a function for each field that is read first.
_MANY_FIELDS = 64


class NoSuchFieldError(FieldPathError, AttributeError):
    """The message has no field of that name."""


class Message:
    """A ROS message; made by :class:`~rosglass.messages.MessageType`, never directly.

    Fields are attributes (``message.header.stamp.sec``), items (``message["header"]``) and ends of
    paths (``message["poses[2].position.x"]``). A field whose name is a Python keyword has an
    underscore appended as an attribute (``message.from_``) and keeps its name everywhere else.
    A field called like a method (``copy``) or ``type`` wins over it: code for any message uses
    :func:`type_of` and ``Message.copy(message)``.

    Numeric arrays of a received message are numpy views of its bytes and read-only: take
    :meth:`writable` or a :meth:`copy` to change single elements. Values are checked when the
    message is encoded.
    """

    __slots__ = ("_buffer__", "_offset__")
    __hash__ = None  # type: ignore[assignment]
    #: The bytes of a shell; unset in plain objects. A view keeps what it is of alive.
    _buffer__: bytes | memoryview
    #: Where in the bytes the shell of a nested message starts.
    _offset__: int
    _schema__: ClassVar[Schema]
    #: Decodes a shell; None for plain classes.
    _fill__: ClassVar[Callable[[Message], None] | None] = None
    #: The codec whose whole message a root shell's buffer is; None for all others.
    _root__: ClassVar[Codec | None] = None

    @property
    def type(self) -> MessageType:
        """The message's type."""
        return self._schema__.type

    def __getattr__(self, name: str) -> Any:
        # Reached for unknown names, and for slots another thread is just about to fill.
        schema = self._schema__
        if any(name == member.attr for member in schema.members):
            deadline = time.monotonic() + _PATIENCE
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
        return access.get(self, path)

    def __setitem__(self, path: str, value: Any) -> None:
        member = self._schema__.by_name.get(path)
        if member is not None:
            setattr(self, member.attr, value)
        else:
            access.put(self, path, value)

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
            FieldPathError: There is no such field, or it is no numeric array.
        """
        return access.writable(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return the message as a dict of wire field names.

        Nested messages become dicts, arrays of messages lists of dicts; numeric arrays stay the
        numpy arrays they are. ``encode`` turns it into the same bytes again.
        """
        return text.to_dict(self)

    def to_json(self, indent: int | None = None) -> str:
        """Return the message as JSON.

        Arrays are lists; floats that JSON cannot say become the strings ``"NaN"``,
        ``"Infinity"`` and ``"-Infinity"``, as in protobuf's JSON mapping; bytes of strings that
        are not UTF-8, and surrogates that are no pair, become U+FFFD.
        """
        return text.to_json(self, indent)

    def to_yaml(self) -> str:
        """Return the message as YAML, each numeric array in one line."""
        return text.to_yaml(self)

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
        kind = type_of(self)
        return _restore, (kind, kind.encode(self))

    def __repr__(self) -> str:
        return text.short(self)


def _restore(kind: MessageType, data: bytes) -> Message:
    return kind.decode(data, wstring_width=4) if kind.wire == "cdr" else kind.decode(data)


def _no_field(schema: Schema, name: str) -> str:
    known = [member.name for member in schema.members]
    return f"{schema.name} has no field {name!r}; {hint(name, known)}"


def type_of(message: Message) -> MessageType:
    """Return the type of any message, one with a field called ``type`` included."""
    return message._schema__.type


def touch(message: Message) -> None:
    """Decode a shell's own level, if it is one."""
    fill = type(message)._fill__
    if fill is not None:
        fill(message)


def copy_of(message: Message) -> Message:
    """Return a deep copy; a value that is not of its field's kind is copied as it is."""
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
    numpy = import_module("numpy")
    left, right = numpy.asarray(one), numpy.asarray(other)
    equal = left == right
    if left.dtype.kind == "f":
        equal |= numpy.isnan(left) & numpy.isnan(right)
    return bool(equal.all())


class Stamp:
    """What times and durations of both worlds have on top of their two fields."""

    __slots__ = ()
    _schema__: ClassVar[Schema]

    @property
    def nanoseconds(self) -> int:
        """The whole in nanoseconds."""
        whole, rest = (getattr(self, member.attr) for member in self._schema__.members)
        return int(whole) * 1_000_000_000 + int(rest)

    @property
    def is_duration(self) -> bool:
        """Whether it is a span of time, not a point in time."""
        return self._schema__.name.lower().endswith("duration")

    @property
    def seconds(self) -> float:
        """The whole in seconds; a float loses accuracy below a microsecond."""
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
    codec: Codec, root: bool, compile_fill: Callable[[Any, str], Callable[[Any], Any]]
) -> type[Message]:
    """Return the class of a schema's shells: its plain class with every field shadowed.

    Args:
        codec: Whose bytes the shells hold.
        root: Whether a shell's buffer is the whole message.
        compile_fill: Called with the class and the name of an attribute; makes the function that
            decodes a shell and returns that attribute (nothing for an empty name).
    """
    cls = plain_class(codec.schema)

    def fill(message: Message) -> None:
        made = compile_fill(shell, "")
        shell._fill__ = staticmethod(made)
        made(message)

    body: dict[str, Any] = {
        "__slots__": (),
        "__module__": cls.__module__,
        "_schema__": codec.schema,
        "_root__": codec if root else None,
        "_fill__": staticmethod(fill),
    }
    for member in codec.schema.members:
        body[member.attr] = _first_access(member.attr, compile_fill)
    shell: Any = type(cls.__name__, (cls,), body)
    made: type[Message] = shell
    return made


def _first_access(attr: str, compile_fill: Callable[[Any, str], Callable[[Any], Any]]) -> property:
    """Return the property of a shell's field; the code behind it is made when it is first used."""

    def get(message: Message) -> Any:
        shell = type(message)
        if shell._fill__ is None:  # another thread was quicker
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
    """Wait until the thread that was quicker to decode `message` has made it a plain object."""
    deadline = time.monotonic() + _PATIENCE
    while type(message) is shell:
        if time.monotonic() > deadline:
            raise DecodeError(message._schema__.name, "decoding was interrupted; decode again")
        time.sleep(0.00005)
