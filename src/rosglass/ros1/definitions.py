"""Definitions as connection headers carry them, also of types that are only passed on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import InvalidNameError

if TYPE_CHECKING:
    from rosglass.messages import MessageType, OpaqueType
    from rosglass.ros1.types import Types

__all__ = ["definition_text", "opaque"]


def definition_text(types: Types, kind: MessageType) -> str:
    """Return a type's definition with all that it needs; an opaque type's as it was received."""
    from rosglass.messages import OpaqueType  # noqa: PLC0415 - numpy

    return kind.text if isinstance(kind, OpaqueType) else types.text(kind)


def opaque(name: str, md5: str, text: str, reason: str) -> OpaqueType | None:
    """Return a type that is only passed on; None when that is no name or no sum of a type."""
    from rosglass.messages import OpaqueType  # noqa: PLC0415 - numpy

    try:
        return OpaqueType(name, md5, reason, text=text, ros=1)
    except InvalidNameError:
        return None
