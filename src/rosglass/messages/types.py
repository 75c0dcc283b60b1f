"""Types of messages, services and actions, and finding them by name.

Message types decode, encode and create messages; there are also types without a definition.
"""

from __future__ import annotations

import re
import threading
import weakref
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass import interfaces
from rosglass.errors import (
    DecodeError,
    DefinitionError,
    Error,
    InvalidNameError,
    TypeNotFoundError,
    UnsupportedError,
)
from rosglass.interfaces.definition import ActionDefinition, Definition, ServiceDefinition
from rosglass.interfaces.names import join_name, split_name
from rosglass.interfaces.resolver import Resolver
from rosglass.messages.codec import UNREADABLE, Codec, codec_of, encapsulation_error
from rosglass.messages.emit_read import path_function
from rosglass.messages.layout import Wire, leaves
from rosglass.messages.message import convert
from rosglass.messages.schema import Schema, schema_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.interfaces import Library
    from rosglass.interfaces.definition import Field, InterfaceDefinition
    from rosglass.messages.message import Message

__all__ = [
    "ActionType",
    "Constants",
    "MessageType",
    "OpaqueType",
    "ServiceType",
    "default_library",
    "load",
    "mend",
    "portable",
    "type_of",
]


_HEADER = "std_msgs/msg/Header"
_WIRES = {
    (name, big, wide, view): Wire(name, big, wide, view)
    for name in ("cdr", "ros1")
    for big in (False, True)
    for wide in (2, 4)
    for view in (False, True)
    if not (name == "ros1" and big)
}
_ORDERS = {"little": False, "big": True}
_PADDING = 3
#: Limits of bytes and values for which decoding at once is faster than in two steps.
_SMALL, _FEW_LEAVES = 1024, 16
_MOST_PATHS = 1000
#: Lines of a definition that are left out to get the md5 sum that its publisher announced, and the
#: longest text that is tried: each line costs a parser's run.
_MAX_BROKEN_LINES, _MAX_BROKEN_TEXT = 10, 1 << 17


class Constants(dict[str, Any]):
    """A message's constants: ``constants["OK"]`` or ``constants.OK``; read-only by convention."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            known = ", ".join(self) or "none"
            raise AttributeError(f"no constant {name!r}; there are: {known}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]


class MessageType:
    """A message type, which decodes, encodes and creates its messages.

    Attributes:
        definition: The definition it was made from.
        name: Full name, ``pkg/msg/Type``.
        ros: 1 or 2.
        wire: The default wire format: ``cdr`` for ROS 2, ``ros1``.
    """

    def __init__(self, definition: Definition) -> None:
        if not isinstance(definition, Definition):
            raise UnsupportedError(
                f"a MessageType is made from a message Definition, not {definition!r}; "
                "use rosglass.load(name) to make one from a name"
            )
        self._set(schema_of(definition), definition)

    def _set(self, schema: Schema, definition: Definition) -> None:
        self._schema = schema
        self.definition = definition
        self.name, self.ros = schema.name, schema.ros
        self.wire = "cdr" if schema.ros == 2 else "ros1"
        self._codecs: dict[Any, Codec] = {}
        self._dict_writers: dict[str | None, Any] = {}
        self._shells: dict[str, type[Any]] = {}
        self._at_once: Callable[[bytes | memoryview], Message] | None = None
        self._paths: dict[Any, Callable[[Any], Any]] = {}

    @classmethod
    def from_text(cls, name: str, text: str, ros: int = 2, *, encoding: str = "msg") -> MessageType:
        """Create the type from a text, which includes all types that it uses after ``===`` lines.

        Args:
            name: ``pkg/msg/Type``.
            text: The definitions.
            ros: 1 or 2.
            encoding: Language of the text, ``msg`` or (ROS 2) ``idl``.

        Raises:
            DefinitionError: The text breaks a rule, or needs a type it does not contain.
            InvalidNameError: `name` is not a message type's name.
            UnsupportedError: There is no such encoding.
        """
        if encoding not in ("msg", "idl") or (encoding, ros) == ("idl", 1):
            raise UnsupportedError(
                f"{name}: a definition is in 'msg', or 'idl' in ROS 2, not in {encoding!r}"
            )
        if encoding == "idl":
            parsed = interfaces.parse_idl(text, name)
        else:
            parsed = interfaces.parse_message(text, name, ros=ros)
        if not isinstance(parsed, Definition):
            raise InvalidNameError(f"{name!r} is not a message type; write pkg/msg/Type")

        def find(wanted: str, owner: Definition, field: Field) -> Definition:
            if wanted not in parsed.nested:
                problem = f"{owner.name}.{field.name}: the text does not define {wanted}"
                raise DefinitionError(problem, owner.source.file, *field.place)
            return parsed.nested[wanted]

        return cls(Resolver(find).message(parsed))

    @classmethod
    def _of_schema(cls, schema: Schema) -> MessageType:
        made: MessageType = object.__new__(cls)
        made._set(schema, schema.definition)
        return made

    def __repr__(self) -> str:
        return f"<MessageType {self.name} (ROS {self.ros})>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MessageType):
            return NotImplemented
        return self._schema is other._schema

    def __hash__(self) -> int:
        return hash((self.name, self.ros))

    def __reduce__(self) -> tuple[Any, ...]:
        return MessageType, (portable(self.definition),)

    @property
    def md5(self) -> str:
        """ROS 1's md5 sum of the definition."""
        return interfaces.md5(self.definition)

    @property
    def rihs01(self) -> str:
        """ROS 2's type hash (REP 2016), ``RIHS01_`` and 64 hexadecimal digits."""
        return interfaces.rihs01(self.definition)

    @property
    def type_hash(self) -> str:
        """The hash by which peers compare versions of the type: RIHS01, or md5 in ROS 1."""
        return self.md5 if self.ros == 1 else self.rihs01

    @cached_property
    def has_header(self) -> bool:
        """True if messages begin with a ``std_msgs/Header`` named ``header``."""
        first = self.definition.fields[:1]
        return [(field.name, str(field.type)) for field in first] == [("header", _HEADER)]

    @property
    def fields(self) -> tuple[Field, ...]:
        """The fields in wire order."""
        return self.definition.fields

    @property
    def constants(self) -> Constants:
        """The constants by name."""
        return Constants({constant.name: constant.value for constant in self.definition.constants})

    # -- making ----------------------------------------------------------------------------------

    def create(self, value: dict[str, Any] | Message | None = None, /, **fields: Any) -> Message:
        """Return a new message; missing fields have the type's defaults.

        Args:
            value: A dict of fields, or a message of this type to start from.
            fields: Fields by name, instead of or on top of `value`.

        Raises:
            ConversionError: A value does not fit its field.
        """
        return convert(self._schema, self._merged(value, fields))

    def __call__(self, value: Any = None, /, **fields: Any) -> Message:
        """Return a new message, as :meth:`create` does."""
        return self.create(value, **fields)

    def _merged(self, value: Any, fields: dict[str, Any]) -> Any:
        if value is None:
            return fields
        if not fields:
            return value
        base = convert(self._schema, value)
        for name, item in fields.items():
            member = self._schema.by_name.get(name)
            if member is None:
                convert(self._schema, {name: item})  # raises, with a hint at the right name
            else:
                setattr(base, member.attr, item)
        return base

    # -- reading ---------------------------------------------------------------------------------

    def decode(
        self, buffer: Any, wire: str | None = None, *, wstring_width: int | None = None
    ) -> Message:
        """Return the message in `buffer`; fields are decoded when they are read.

        Args:
            buffer: The bytes as received, for CDR with the encapsulation header. ``bytes`` and
                read-only memoryviews of bytes are kept, not copied: the object behind a view stays
                alive, and must not change while the message or an array out of it is used. Any
                other buffer is copied first.
            wire: ``cdr`` or ``ros1``; None for the type's own.
            wstring_width: Bytes for each UTF-16 unit of wstrings, 2 or 4; None to detect it.

        Raises:
            DecodeError: The buffer is not bytes, or its header announces another encoding.
                Other damage is reported when fields are read; :meth:`validate` finds it at once.
        """
        if wire is None:
            wire = self.wire
        try:
            message: Message = self._shells[wire]()
            if (
                buffer.__class__ is bytes
                and (wire == "ros1" or (buffer[1] == 1 and not buffer[0]))
                and wstring_width is None
            ):
                message._buffer__ = buffer
                return message
        except LookupError:
            pass  # no codec cached yet, or too short for a header
        return self._decode(buffer, wire, wstring_width)

    def _decode(self, buffer: Any, wire: str | None, wide: int | None) -> Message:
        data = self._bytes(buffer)
        codec = self._codec_for(data, wire, wide)
        if not (self._schema.has_wide or codec.wire.big or codec.wire.view):
            self._shells[codec.wire.name] = codec.root
        message = codec.root()
        message._buffer__ = data
        return message

    def _bytes(self, buffer: Any) -> bytes | memoryview:
        """Return the buffer as bytes or a read-only view, which can be kept."""
        if type(buffer) is bytes:
            return buffer
        try:
            view = memoryview(buffer)
        except TypeError:
            kind = type(buffer).__name__
            raise DecodeError(self.name, f"expected bytes to decode, got {kind}") from None
        if type(buffer) is memoryview and view.readonly and view.format == "B" and view.contiguous:
            return buffer
        return view.tobytes()

    def _wire_name(self, wire: str | None) -> str:
        if wire is None:
            return self.wire
        if wire not in ("cdr", "ros1"):
            raise UnsupportedError(f"wire format {wire!r} is unknown; there are 'cdr' and 'ros1'")
        return wire

    def _codec_for(self, data: bytes | memoryview, wire: str | None, wide: int | None) -> Codec:
        """Return the codec for received bytes, by the byte order in their header."""
        name = self._wire_name(wire)
        big = name == "cdr" and _encapsulation(self.name, data)
        if wide is None and self._schema.has_wide:
            wide = self._plausible_width(data, name, big)
        return self._codec(name, big, _width(wide), type(data) is memoryview)

    def _codec(self, name: str, big: bool, wide: int, view: bool = False) -> Codec:
        key = name, big, wide, view
        codec = self._codecs.get(key)
        if codec is None:
            codec = self._codecs[key] = codec_of(self._schema, _WIRES[key])
        return codec

    def _plausible_width(self, data: bytes | memoryview, name: str, big: bool) -> int:
        """Return the wstring width that makes the message end where its bytes end.

        If both do, the padding that the encapsulation header announces decides; otherwise 4, as
        written by ROS 2's nodes.
        """
        fitting = []
        for wide in (4, 2):
            try:
                left = len(data) - self._codec(name, big, wide).end(data)
            except DecodeError:
                continue
            if left <= (_PADDING if name == "cdr" else 0):
                announced = data[3] & _PADDING if name == "cdr" else 0
                fitting.append((left != announced, wide))
        return min(fitting, key=lambda found: found[0])[1] if fitting else 4

    def decode_small(self, buffers: Sequence[bytes | memoryview]) -> list[Message] | None:
        """Decode many small messages of ROS 1 at once, which is faster than lazy messages.

        None if :meth:`decode` is better for them or for the type: large, damaged, or with many
        values.
        """
        read = self._at_once
        if read is None:
            if self.wire != "ros1" or leaves(self._schema) > _FEW_LEAVES:
                return None
            read = self._at_once = self._codec("ros1", False, _width(None)).reader
        try:
            return list(map(read, buffers)) if len(buffers[0]) <= _SMALL else None
        except UNREADABLE:  # reading the fields raises the error
            return None

    def decode_all(
        self, buffer: Any, wire: str | None = None, *, wstring_width: int | None = None
    ) -> Message:
        """Return the message in `buffer` with every field decoded; arguments as :meth:`decode`.

        Bytes left over are accepted, as other versions of a type may have more fields.

        Raises:
            DecodeError: The buffer is not such a message.
        """
        data = self._bytes(buffer)
        return self._codec_for(data, wire, wstring_width).decode_all(data)

    def validate(
        self, buffer: Any, wire: str | None = None, *, wstring_width: int | None = None
    ) -> None:
        """Check that `buffer` is one message and nothing else, without decoding it.

        :meth:`decode_all` accepts the same buffers, and those with bytes left over.

        Raises:
            DecodeError: A length does not fit the buffer, a unit of a wstring is not a character,
                or bytes are left over (up to three bytes of padding are normal in CDR).
        """
        data = self._bytes(buffer)
        codec = self._codec_for(data, wire, wstring_width)
        self._check_end(codec, data, codec.end(data))

    def decode_checked(
        self, buffer: Any, wire: str | None = None, *, wstring_width: int | None = None
    ) -> Message:
        """Combine :meth:`validate` and :meth:`decode` in one pass over the bytes.

        The message's own fields are decoded; larger nested messages and arrays of messages are
        checked, and decoded when they are read.

        Raises:
            DecodeError: As for :meth:`validate`.
        """
        data = self._bytes(buffer)
        codec = self._codec_for(data, wire, wstring_width)
        message, end = codec.decode_checked(data)
        self._check_end(codec, data, end)
        return message

    def _check_end(self, codec: Codec, data: bytes | memoryview, end: int) -> None:
        """Raise DecodeError if bytes are left over after the message."""
        left = len(data) - end
        if left and left > (_PADDING if codec.wire.aligned else 0):
            raise DecodeError(self.name, f"{left} bytes left over after the message", "", end)

    def path(
        self,
        path: str,
        /,
        *more: str,
        wire: str | None = None,
        wstring_width: int | None = None,
    ) -> Callable[[Any], Any]:
        """Return a function from a message's bytes to the value at a field path.

        Args:
            path: E.g. ``pose.position.x``, ``ranges[3]``, ``ranges[-1]``, ``name[1:5]``,
                ``poses[*].pose.position.x`` (a numpy array of all, or a list of strings).
            more: More paths; the function then returns a tuple.
            wire: ``cdr`` or ``ros1``; None for the type's own.
            wstring_width: As for :meth:`decode`.

        Raises:
            FieldPathError: The path does not exist in the type; from the function: an index is
                beyond the array.
        """
        name = self._wire_name(wire)
        if self._schema.has_wide and wstring_width is None:
            # The width is known only from the bytes.
            self._path(name, 4, False, (path, *more), not more)
            return partial(self._path_by_bytes, name, (path, *more), not more)
        return self._path(name, _width(wstring_width), False, (path, *more), not more)

    def _path(
        self,
        name: str,
        wide: int,
        big: bool,
        paths: tuple[str, ...],
        single: bool,
        view: bool = False,
    ) -> Callable[[Any], Any]:
        key = (name, wide, big, paths, single, view)
        known = self._paths.get(key)
        if known is not None:
            return known
        codec = self._codec(name, big, wide, view)
        kind = memoryview if view else bytes

        def other(buffer: Any) -> Any:
            data = self._bytes(buffer)
            big = name == "cdr" and _encapsulation(self.name, data)
            view = type(data) is memoryview
            return self._path(name, wide, big, paths, single, view)(data)

        def failed(buffer: Any, error: Exception) -> Any:
            if type(buffer) is not kind:
                return other(buffer)
            if isinstance(error, Error):
                raise error
            found = codec
            if name == "cdr":
                found = self._codec(name, _encapsulation(self.name, buffer), wide, view)
            raise found.explain(buffer, error) from None

        made = path_function(codec, paths, single, other, failed)
        if len(self._paths) >= _MOST_PATHS:
            self._paths.clear()  # paths made in a loop must not pile up
        self._paths[key] = made
        return made

    def _path_by_bytes(self, name: str, paths: tuple[str, ...], single: bool, buffer: Any) -> Any:
        data = self._bytes(buffer)
        codec = self._codec_for(data, name, None)
        wire = codec.wire
        return self._path(name, wire.wide, wire.big, paths, single, wire.view)(data)

    # -- writing ---------------------------------------------------------------------------------

    def encode(
        self,
        value: Message | dict[str, Any] | None = None,
        /,
        *,
        wire: str | None = None,
        byteorder: str = "little",
        wstring_width: int | None = None,
        **fields: Any,
    ) -> bytes:
        """Return the bytes of a message.

        Args:
            value: A message of this type, or a dict of fields; missing fields get the defaults.
            wire: ``cdr`` or ``ros1``; None for the type's own.
            byteorder: ``little`` or ``big``; only ``little`` in ROS 1.
            wstring_width: Bytes for each UTF-16 unit of wstrings: 4 (default), as ROS 2's nodes
                write and read them, or 2.
            fields: The fields as keyword arguments, instead of or on top of `value`.

        Raises:
            ConversionError: A value does not fit its field.
        """
        if value is None:
            value = fields
        elif fields:
            value = self._merged(value, fields)
        if byteorder == "little" and wstring_width is None and value.__class__ is dict:
            try:
                write = self._dict_writers[wire]
            except (KeyError, TypeError):
                pass  # no writer cached yet, or invalid arguments
            else:
                return write(value)  # type: ignore[no-any-return]
        codec = self._writing_codec(wire, byteorder, wstring_width)
        if value.__class__ is dict:
            write = codec.writer(True, True)
            if byteorder == "little" and wstring_width is None:
                self._dict_writers[wire] = write
            return write(value)  # type: ignore[no-any-return]
        untouched = _untouched(value, codec)
        if untouched is None:
            return codec.writer(False, True)(value)  # type: ignore[no-any-return]
        return untouched if type(untouched) is bytes else bytes(untouched)

    def encode_parts(
        self,
        value: Message | dict[str, Any] | None = None,
        /,
        *,
        wire: str | None = None,
        byteorder: str = "little",
        wstring_width: int | None = None,
        **fields: Any,
    ) -> list[bytes | memoryview]:
        """Return the bytes of a message in parts, for ``writev``; arguments as :meth:`encode`.

        Large arrays are not copied, nor is a received message whose fields were never read: the
        parts are views of the data in `value`, which must not change until the parts are sent.
        """
        if value is None:
            value = fields
        elif fields:
            value = self._merged(value, fields)
        codec = self._writing_codec(wire, byteorder, wstring_width)
        untouched = _untouched(value, codec)
        if untouched is not None:
            return [untouched]
        return codec.writer(value.__class__ is dict, False)(value)  # type: ignore[no-any-return]

    def _writing_codec(self, wire: str | None, byteorder: str, wide: int | None) -> Codec:
        try:
            return self._codecs[wire, byteorder, wide]
        except (KeyError, TypeError):
            name = self._wire_name(wire)
        if byteorder not in _ORDERS:
            raise UnsupportedError(f"byteorder is 'little' or 'big', not {byteorder!r}")
        big = _ORDERS[byteorder]
        if big and name == "ros1":
            raise UnsupportedError("ROS 1 messages are little endian; byteorder='big' is for CDR")
        codec = self._codecs[wire, byteorder, wide] = self._codec(name, big, _width(wide))
        return codec


def _untouched(value: Any, codec: Codec) -> bytes | memoryview | None:
    """Return the bytes of a shell that was received by `codec` and never decoded."""
    if getattr(value, "_root__", None) is not codec:
        return None
    return getattr(value, "_buffer__", None)


def _encapsulation(type_name: str, data: bytes | memoryview) -> bool:
    """Return whether a CDR message is big endian; raises DecodeError if it is unsupported."""
    if len(data) < 4 or data[0] or data[1] > 1:
        raise encapsulation_error(type_name, data)
    return not data[1]


def _width(wide: int | None) -> int:
    if wide not in (None, 2, 4):
        raise UnsupportedError(f"a wstring's character takes 2 or 4 bytes, not {wide!r}")
    return wide or 4


def portable(definition: Definition) -> Definition:
    """Return the definition with plain dicts inside, for pickling."""
    inner = {name: replace(nested, nested={}) for name, nested in definition.nested.items()}
    return replace(definition, nested=inner)


Schema.make_type = MessageType._of_schema


def type_of(message: Message) -> MessageType:
    """Return the type of any message, even of one with a field called ``type``."""
    found: MessageType = message._schema__.type
    return found


_HASHES = {1: re.compile(r"[0-9a-f]{32}"), 2: re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")}
_WRITE = {1: "32 hexadecimal digits (an md5 sum)", 2: "RIHS01_ and 64 hexadecimal digits"}


class OpaqueType(MessageType):
    """A message type without definition, for topics that are passed on as bytes.

    Everything that needs the definition (decoding, encoding, fields) raises TypeNotFoundError with
    the reason why there is none.

    Args:
        name: ``pkg/msg/Type``.
        type_hash: RIHS01 hash (ROS 1: md5 sum), as the robot announces it; empty to announce none.
        reason: Why there is no definition.
        text: Text that the robot sent instead of a definition, to be passed on; ROS 1 only.
        ros: 1 or 2.

    Attributes:
        reason: As given.
        text: As given.

    Raises:
        InvalidNameError: `name` is not the name of a message type, or `type_hash` is
            not a hash.
        UnsupportedError: `ros` is neither 1 nor 2.
    """

    def __init__(
        self,
        name: str,
        type_hash: str = "",
        reason: str = "only its name was given",
        *,
        text: str = "",
        ros: int = 2,
    ) -> None:
        if ros not in _HASHES:
            raise UnsupportedError(f"{name}: there is ROS 1 and ROS 2, not {ros!r}")
        if split_name(name)[1] not in ("", "msg", "action"):
            raise InvalidNameError(f"{name!r} is not a message type; write pkg/msg/Type")
        if not isinstance(type_hash, str) or (type_hash and not _HASHES[ros].fullmatch(type_hash)):
            raise InvalidNameError(
                f"{type_hash!r:.90} is not a type hash of {name}; write {_WRITE[ros]}, or nothing"
            )
        self.name, self.ros, self.wire = join_name(name), ros, "cdr" if ros == 2 else "ros1"
        self.reason, self.text = reason, text
        self.has_header = False
        self._hash = type_hash

    @property
    def md5(self) -> str:
        """ROS 1's md5 sum as given; empty if there is none."""
        return self._hash if self.ros == 1 else ""

    @property
    def rihs01(self) -> str:
        """ROS 2's type hash as given; empty if there is none."""
        return self._hash if self.ros == 2 else ""

    def __repr__(self) -> str:
        return f"<OpaqueType {self.name}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OpaqueType):
            return False
        return (self.name, self.ros, self._hash) == (other.name, other.ros, other._hash)

    def __hash__(self) -> int:
        return hash((self.name, self._hash))

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(OpaqueType, text=self.text, ros=self.ros), (
            self.name,
            self._hash,
            self.reason,
        )

    def decode_small(self, buffers: Sequence[bytes | memoryview]) -> None:
        """Return None: nothing can be decoded."""

    def _codec_for(self, *_: Any) -> NoReturn:
        raise self._unknown()

    def __getattr__(self, name: str) -> Any:
        # Everything derived from a definition needs attributes that an opaque type lacks.
        if name.startswith("__"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise self._unknown()

    def _unknown(self) -> TypeNotFoundError:
        return TypeNotFoundError(
            f"there is no definition of {self.name}, so that its messages are only bytes: "
            f"{self.reason}"
        )


class _Interface:
    """The common base of types with several messages."""

    parts: dict[str, MessageType]

    def __init__(self, definition: ServiceDefinition | ActionDefinition) -> None:
        self.definition = definition
        self.name, self.ros = definition.name, definition.ros

    @property
    def md5(self) -> str:
        """ROS 1's md5 sum of the definition."""
        return interfaces.md5(self.definition)

    @property
    def rihs01(self) -> str:
        """ROS 2's type hash (REP 2016)."""
        return interfaces.rihs01(self.definition)

    @property
    def fields(self) -> dict[str, tuple[Field, ...]]:
        """The fields of each part."""
        return {name: part.fields for name, part in self.parts.items()}

    @property
    def constants(self) -> dict[str, Constants]:
        """The constants of each part."""
        return {name: part.constants for name, part in self.parts.items()}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Interface):
            return NotImplemented
        return (self.name, self.parts) == (other.name, other.parts)

    def __hash__(self) -> int:
        return hash((self.name, self.ros))

    def __reduce__(self) -> tuple[Any, ...]:
        parts: dict[str, Any] = {
            name: portable(part.definition) for name, part in self.parts.items()
        }
        return type(self), (replace(self.definition, **parts),)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} (ROS {self.ros})>"


class ServiceType(_Interface):
    """A service type.

    Attributes:
        definition: The definition it was made from.
        name: Full name, ``pkg/srv/Type``.
        ros: 1 or 2.
        request: Type of the request.
        response: Type of the response.
        parts: Both by these names.
    """

    definition: ServiceDefinition

    def __init__(self, definition: ServiceDefinition) -> None:
        super().__init__(definition)
        self.request = MessageType(definition.request)
        self.response = MessageType(definition.response)
        self.parts = {"request": self.request, "response": self.response}


class ActionType(_Interface):
    """An action type.

    Attributes:
        definition: The definition it was made from.
        name: Full name, ``pkg/action/Type``.
        ros: 1 or 2.
        goal: Type of the goal.
        result: Type of the result.
        feedback: Type of the feedback.
        parts: All three by these names.
    """

    definition: ActionDefinition

    def __init__(self, definition: ActionDefinition) -> None:
        super().__init__(definition)
        self.goal = MessageType(definition.goal)
        self.result = MessageType(definition.result)
        self.feedback = MessageType(definition.feedback)
        self.parts = {"goal": self.goal, "result": self.result, "feedback": self.feedback}


_lock = threading.RLock()
_libraries: weakref.WeakKeyDictionary[
    Library, dict[tuple[str, int, str], MessageType | ServiceType | ActionType]
] = weakref.WeakKeyDictionary()
_default: list[Library] = []


def default_library() -> Library:
    """Return the shared library, created on first use."""
    with _lock:
        if not _default:
            _default.append(interfaces.Library())
        return _default[0]


def load(
    name: str, ros: int = 2, library: Library | None = None, *, hash: str = ""
) -> MessageType | ServiceType | ActionType:
    """Return the type `name`.

    Args:
        name: ``pkg/msg/Type`` or ``pkg/Type`` (also ``srv`` and ``action``).
        ros: 2 for ROS 2's definition, 1 for ROS 1's.
        library: Library to search; None for :func:`default_library`.
        hash: RIHS01 hash (ROS 1: md5 sum) that a peer announced for it; picks the version of the
            definition that has it.

    Raises:
        TypeNotFoundError: No provider has a definition.
        DefinitionConflictError: No provider has the version with this hash.
        DefinitionError: The definition has errors, or is cyclic.
        UnsupportedError: `library` is not a library, or `ros` is neither 1 nor 2.
    """
    if library is not None and not isinstance(library, interfaces.Library):
        raise UnsupportedError(f"a library is a rosglass.Library, not {library!r:.80}")
    source = default_library() if library is None else library
    definition = source.definition(name, ros=ros, hash=hash)
    with _lock:
        types = _libraries.setdefault(source, {})
        found, usual = types.get((name, ros, hash)), types.get((name, ros, ""))
    if found is not None and found.definition is definition:
        return found
    # If the usual version is the requested one, return the same object. Without the lock: a large
    # type must not delay the loading of others.
    same = usual is not None and usual.definition is definition
    made = usual if usual and same else _make(definition)
    with _lock:
        found = types.get((name, ros, hash))
        if found is None or found.definition is not definition:
            found = types[name, ros, hash] = made
    return found


def mend(name: str, text: str, md5: str, library: Library | None = None) -> MessageType | None:
    """Create a ROS 1 type from a text with invalid lines, or without its nested types.

    Args:
        name: ``pkg/msg/Type``.
        text: As for :meth:`MessageType.from_text`.
        md5: The sum that its publisher announced.
        library: Has nested types that the text lacks; None for :func:`default_library`.

    Returns:
        The type; None unless it has that sum.
    """
    source = default_library() if library is None else library
    parsed = _without_broken_lines(name, text)
    if parsed is None:
        return None

    def find(wanted: str, owner: Definition, field: Field) -> Definition:
        found = parsed.nested.get(wanted) or source.definition(wanted, ros=1)
        if not isinstance(found, Definition):
            raise DefinitionError(f"{owner.name}.{field.name}: {wanted} is not a message")
        return found

    with suppress(Error):  # the text's own error is the one to report
        made = MessageType(Resolver(find).message(parsed))
        return made if made.md5 == md5 else None
    return None


def _without_broken_lines(name: str, text: str) -> Definition | None:
    if len(text) > _MAX_BROKEN_TEXT:
        return None
    lines = text.splitlines()
    for _ in range(_MAX_BROKEN_LINES):
        try:
            return interfaces.parse_message("\n".join(lines), name, ros=1)
        except DefinitionError as error:  # noqa: PERF203 - a few at most
            if not 0 < error.line <= len(lines):
                return None
            lines[error.line - 1] = ""
    return None


def _make(definition: InterfaceDefinition) -> MessageType | ServiceType | ActionType:
    if isinstance(definition, ServiceDefinition):
        return ServiceType(definition)
    if isinstance(definition, ActionDefinition):
        return ActionType(definition)
    return MessageType(definition)
