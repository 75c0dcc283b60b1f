"""Types of which only the name is known: their messages can be passed on, not understood."""

from __future__ import annotations

import re
from typing import Any, NoReturn

from rosglass.errors import InvalidNameError, TypeNotFoundError
from rosglass.interfaces.names import join_name, split_name
from rosglass.messages.types import MessageType

__all__ = ["OpaqueType"]

_HASH = re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")


class OpaqueType(MessageType):
    """A ROS 2 message type without definition, for topics that are passed on as bytes.

    Whatever needs the definition (decoding, encoding, fields) raises TypeNotFoundError with the
    reason why there is none.

    Args:
        name: ``pkg/msg/Type``.
        type_hash: RIHS01 hash, as the robot announces it; empty to announce none.
        reason: Why there is no definition.

    Attributes:
        reason: As given.

    Raises:
        InvalidNameError: `name` is no message type's name, or `type_hash` no hash.
    """

    def __init__(
        self, name: str, type_hash: str = "", reason: str = "only its name was given"
    ) -> None:
        if split_name(name)[1] not in ("", "msg", "action"):
            raise InvalidNameError(f"{name!r} is no message type; write pkg/msg/Type")
        if not isinstance(type_hash, str) or (type_hash and not _HASH.fullmatch(type_hash)):
            raise InvalidNameError(
                f"{type_hash!r:.90} is no type hash of {name}; write RIHS01_ and 64 hexadecimal "
                "digits, or nothing"
            )
        self.name, self.ros, self.wire = join_name(name), 2, "cdr"
        self.reason = reason
        self._hash = type_hash

    @property
    def rihs01(self) -> str:
        """The type hash as it was given; empty when none was."""
        return self._hash

    def __repr__(self) -> str:
        return f"<OpaqueType {self.name}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OpaqueType):
            return False
        return (self.name, self._hash) == (other.name, other._hash)

    def __hash__(self) -> int:
        return hash((self.name, self._hash))

    def __reduce__(self) -> tuple[Any, ...]:
        return OpaqueType, (self.name, self._hash, self.reason)

    def _codec_for(self, *_: Any) -> NoReturn:
        raise self._unknown()

    def __getattr__(self, name: str) -> Any:
        # All that a definition gives is made from attributes that an opaque type does not have.
        if name.startswith("__"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise self._unknown()

    def _unknown(self) -> TypeNotFoundError:
        return TypeNotFoundError(
            f"there is no definition of {self.name}, so that its messages are only bytes: "
            f"{self.reason}"
        )
