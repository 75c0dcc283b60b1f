"""Pictures: encodings, transports and shared camera streams."""

from rosglass.images.compressed import decompress
from rosglass.images.encodings import ANY_FORMAT, ENCODINGS, convert
from rosglass.images.frame import Frame, PixelFormat, RawImage
from rosglass.images.stream import ImageStream, StreamStatistics
from rosglass.images.transports import TRANSPORTS, Choice, Transport, choose

__all__ = [
    "ANY_FORMAT",
    "ENCODINGS",
    "TRANSPORTS",
    "Choice",
    "Frame",
    "ImageStream",
    "PixelFormat",
    "RawImage",
    "StreamStatistics",
    "Transport",
    "choose",
    "convert",
    "decompress",
]
