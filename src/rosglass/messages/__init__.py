"""Messages: lazy trees over received bytes, their types, and the codecs."""

from rosglass.messages.message import Message
from rosglass.messages.sequences import MessageSequence
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
    "type_of",
]
