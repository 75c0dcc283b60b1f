"""Messages: lazy trees over received bytes, their types, and the codecs."""

from rosglass.messages.loading import ActionType, ServiceType, default_library, load
from rosglass.messages.message import Message
from rosglass.messages.sequences import MessageSequence
from rosglass.messages.translation import ActionTranslation, ServiceTranslation, Translation
from rosglass.messages.types import Constants, MessageType, OpaqueType, type_of

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
