"""Camera images: encodings, transports and shared streams."""

from rosglass.images.compressed import decompress, decompress_depth
from rosglass.images.depth import COLOR_MAPS, DEPTH_ENCODINGS, DepthColors
from rosglass.images.encodings import (
    ANY_FORMAT,
    ENCODINGS,
    Frame,
    PixelFormat,
    RawImage,
    convert,
    reduce,
)
from rosglass.images.stream import ImageStream, StreamStatistics
from rosglass.images.transports import TRANSPORTS, Choice, PictureReader, Transport, choose
from rosglass.images.view import FILE_TYPES, View, save

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
