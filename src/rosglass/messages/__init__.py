"""Messages: lazy trees over received bytes, their types, and the codecs."""

from rosglass.messages.message import Message, parse_path, resolve_path
from rosglass.messages.sequences import MessageSequence, read_columns
from rosglass.messages.translation import ActionTranslation, ServiceTranslation, Translation
from rosglass.messages.types import (
    ActionType,
    Constants,
    MessageType,
    OpaqueType,
    ServiceType,
    default_library,
    load,
    type_of,
)

__all__ = [
    "ActionTranslation",
    "ActionType",
    "Constants",
    "Message",
    "MessageSequence",
    "MessageType",
    "OpaqueType",
    "ServiceTranslation",
    "ServiceType",
    "Translation",
    "default_library",
    "load",
    "parse_path",
    "read_columns",
    "resolve_path",
    "type_of",
]
