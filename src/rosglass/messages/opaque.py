"""Types of which only the name is known: their messages can be passed on, not understood."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.errors import InvalidNameError, TypeNotFoundError, UnsupportedError
from rosglass.interfaces.names import join_name, split_name
from rosglass.messages.types import MessageType

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["OpaqueType"]

_HASHES = {1: re.compile(r"[0-9a-f]{32}"), 2: re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")}
_WRITE = {1: "32 hexadecimal digits (an md5 sum)", 2: "RIHS01_ and 64 hexadecimal digits"}


class OpaqueType(MessageType):
    """A message type without definition, for topics that are passed on as bytes.

    Whatever needs the definition (decoding, encoding, fields) raises TypeNotFoundError with the
    reason why there is none.

    Args:
        name: ``pkg/msg/Type``.
        type_hash: RIHS01 hash (ROS 1: md5 sum), as the robot announces it; empty to announce none.
        reason: Why there is no definition.
        text: What the robot sent in place of a definition, to be passed on; ROS 1 only.
        ros: 1 or 2.

    Attributes:
        reason: As given.
        text: As given.

    Raises:
        InvalidNameError: `name` is no message type's name, or `type_hash` no hash.
        UnsupportedError: There is no such ROS.
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
            raise InvalidNameError(f"{name!r} is no message type; write pkg/msg/Type")
        if not isinstance(type_hash, str) or (type_hash and not _HASHES[ros].fullmatch(type_hash)):
            raise InvalidNameError(
                f"{type_hash!r:.90} is no type hash of {name}; write {_WRITE[ros]}, or nothing"
            )
        self.name, self.ros, self.wire = join_name(name), ros, "cdr" if ros == 2 else "ros1"
        self.reason, self.text = reason, text
        self._hash = type_hash

    @property
    def md5(self) -> str:
        """ROS 1's md5 sum as it was given; empty when none was."""
        return self._hash if self.ros == 1 else ""

    @property
    def rihs01(self) -> str:
        """ROS 2's type hash as it was given; empty when none was."""
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
        # All that a definition gives is made from attributes that an opaque type does not have.
        if name.startswith("__"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise self._unknown()

    def _unknown(self) -> TypeNotFoundError:
        return TypeNotFoundError(
            f"there is no definition of {self.name}, so that its messages are only bytes: "
            f"{self.reason}"
        )
