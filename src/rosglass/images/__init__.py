"""Pictures: encodings, transports and shared camera streams."""

from rosglass.images.compressed import decompress
from rosglass.images.compressed_depth import decompress_depth
from rosglass.images.depth import COLOR_MAPS, DEPTH_ENCODINGS, DepthColors
from rosglass.images.encodings import ANY_FORMAT, ENCODINGS, convert
from rosglass.images.frame import Frame, PixelFormat, RawImage
from rosglass.images.reduction import reduce
from rosglass.images.snapshot import FILE_TYPES, save
from rosglass.images.stream import ImageStream, StreamStatistics
from rosglass.images.transports import TRANSPORTS, Choice, PictureReader, Transport, choose
from rosglass.images.view import View

__all__ = [
    "ANY_FORMAT",
    "COLOR_MAPS",
    "DEPTH_ENCODINGS",
    "ENCODINGS",
    "FILE_TYPES",
    "TRANSPORTS",
    "Choice",
    "DepthColors",
    "Frame",
    "ImageStream",
    "PictureReader",
    "PixelFormat",
    "RawImage",
    "StreamStatistics",
    "Transport",
    "View",
    "choose",
    "convert",
    "decompress",
    "decompress_depth",
    "reduce",
    "save",
]
