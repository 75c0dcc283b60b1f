"""Types of ours from a definition's text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass import Library
from rosglass.messages import MessageType

if TYPE_CHECKING:
    from rosglass.interfaces.definition import InterfaceDefinition

SEPARATOR = "=" * 80


def from_text(name: str, text: str, ros: int) -> MessageType:
    """The type that a definition received from a peer describes."""
    library = Library()
    library.add_text(name, text, ros=ros)
    definition: InterfaceDefinition = library.definition(name, ros=ros)
    return MessageType(definition)
