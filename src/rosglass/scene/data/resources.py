"""Files that robot descriptions and markers name: where they are, and what they may be."""

from __future__ import annotations

import os
import re
import stat
import struct
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from rosglass.comm.names import similar
from rosglass.errors import ArgumentError, DecodeError, Error, UnsupportedError
from rosglass.images.compressed import read_header
from rosglass.images.encodings import MAX_PIXELS
from rosglass.interfaces.provider import workspace, workspace_variables

if TYPE_CHECKING:
    from rosglass.interfaces.provider import Folders

__all__ = ["ResourceError", "check_texture", "forget_packages", "locate_resource", "make_room"]

#: Longest side of a texture that graphics cards take everywhere.
_MAX_SIDE = 16_384
_MAX_IMAGE_BYTES = 256 << 20
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):(?://)?")


class ResourceError(Error):
    """A file that a robot description or marker names is missing or unusable."""


def locate_resource(uri: str, base: str | os.PathLike[str] | None = None) -> Path:
    """Return the path of a mesh or texture file on this machine.

    Args:
        uri: ``package://name/path``, ``file:///path``, or a path. Packages are searched in
            ``ROS_PACKAGE_PATH``, ``AMENT_PREFIX_PATH`` and ``CMAKE_PREFIX_PATH``.
        base: Folder that relative paths start from.

    Raises:
        ResourceError: There is no such package or file.
        UnsupportedError: The URI has another scheme, such as http.
        ArgumentError: The URI is not a string, or is empty.
    """
    if not isinstance(uri, str) or not uri.strip():
        raise ArgumentError("uri", uri, "package://name/path, file:///path or a path")
    uri = uri.strip()
    found = _SCHEME.match(uri)
    scheme = found[1].lower() if found else ""
    if scheme == "package":
        path = _in_package(uri)
    elif scheme == "file":
        parts = urlsplit(uri)
        if parts.netloc not in {"", "localhost"}:
            raise ResourceError(
                f"{uri}: {parts.netloc!r} is another machine; files of this one are "
                "named with three slashes: file:///path"
            )
        path = Path(unquote(parts.path))
    elif scheme in {"http", "https"}:
        raise UnsupportedError(
            f"{uri}: files are not loaded from web servers; download it, and name it as "
            "file:///path or package://name/path"
        )
    elif scheme:
        raise UnsupportedError(
            f"{uri}: {scheme}: is not supported; use package://name/path or file:///path"
        )
    else:
        path = Path(uri)
        if not path.is_absolute():
            if base is None:
                raise ResourceError(
                    f"{uri}: the path is relative; use package://name/path or file:///path"
                )
            path = Path(base, path)
    return _existing(path, uri)


def _in_package(uri: str) -> Path:
    package, _, rest = uri.partition(":")[2].lstrip("/").partition("/")
    if not package or not rest:
        raise ResourceError(f"{uri}: expected package://name/path")
    folder = _workspace(workspace_variables(os.environ)).package(package)
    if not folder:
        raise ResourceError(
            f"{uri}: there is no package {package!r} in ROS_PACKAGE_PATH, AMENT_PREFIX_PATH and "
            "CMAKE_PREFIX_PATH; source its workspace first"
        )
    return Path(folder, rest)


@lru_cache(maxsize=2)
def _workspace(_variables: tuple[str | None, ...]) -> Folders:
    """Return the packages, whose folders are searched once for all meshes of a robot."""
    return workspace(os.environ)


def forget_packages() -> None:
    """Search the folders of packages anew, for those that were added in the meantime."""
    _workspace.cache_clear()


def _existing(path: Path, uri: str) -> Path:
    shown = uri if uri.startswith("package:") else os.fspath(path)
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        hint = ""
        with suppress(OSError, ValueError):
            hint = similar(path.name, os.listdir(path.parent)[:1000])  # noqa: PTH208
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
        raise ResourceError(f"{shown}: {reason}{hint}") from None
    if not stat.S_ISREG(mode):
        raise ResourceError(f"{shown}: this is not a file")
    return path


def make_room(folder: Path, size: int, limit: int) -> None:
    """Remove the files of a cache that were used longest ago, until another one fits.

    Args:
        folder: The cache's folder.
        size: Bytes of the new file.
        limit: Bytes of all files together.

    Raises:
        OSError: The folder can't be listed.
    """
    entries = []
    for path in folder.iterdir():
        with suppress(OSError):
            about = path.stat()
            entries.append((about.st_mtime, about.st_size, path))
    total = size + sum(entry[1] for entry in entries)
    for _, taken, path in sorted(entries):
        if total <= limit:
            return
        with suppress(OSError):
            path.unlink()
        total -= taken


def check_texture(
    image: bytes | str | os.PathLike[str] | tuple[int, int], name: str = ""
) -> tuple[int, int]:
    """Return width and height of an image after checking that it can be decoded and drawn.

    Args:
        image: Path or bytes of a PNG, JPEG, BMP, GIF, WebP or TGA file, or a size in pixels.
        name: Name of the image for errors.

    Raises:
        ResourceError: The file is missing, empty or corrupt, or the image has more than 16,384
        pixels along a side or 2^26 in all.
        UnsupportedError: The file has none of these formats.
    """
    if isinstance(image, tuple):
        width, height = image
    else:
        if not isinstance(image, (bytes, bytearray, memoryview)):
            path = Path(image)
            name = name or os.fspath(path)
            image = _read_image(path, name)
        width, height = _size(bytes(image), name or "texture")
    if not 0 < width <= _MAX_SIDE or not 0 < height <= _MAX_SIDE or width * height > MAX_PIXELS:
        raise ResourceError(
            f"{name or 'texture'}: the image is {width}x{height} pixels; the limits are 1 to "
            f"{_MAX_SIDE} a side and {MAX_PIXELS} in all; reduce it"
        )
    return width, height


def _read_image(path: Path, name: str) -> bytes:
    try:
        _existing(path, os.fspath(path))
        size = path.stat().st_size
        if size > _MAX_IMAGE_BYTES:
            raise ResourceError(f"{name}: {size} bytes; the limit is {_MAX_IMAGE_BYTES}")
        return path.read_bytes()
    except OSError as error:
        raise ResourceError(f"{name}: the image can't be read: {error}") from None


def _size(data: bytes, name: str) -> tuple[int, int]:
    try:
        if data[:2] == b"BM" and data[14:18] == b"\x0c\x00\x00\x00":
            return struct.unpack_from("<HH", data, 18)
        if data[:2] == b"BM":
            width, height = struct.unpack_from("<ii", data, 18)
            return width, abs(height)  # negative: the first row is the upper one
        if data[:4] == b"GIF8":
            return struct.unpack_from("<HH", data, 6)
        if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            return _webp_size(data)
        if data[:2] != b"\xff\xd8" and data[:1] != b"\x89" and _is_tga(data):
            return struct.unpack_from("<HH", data, 12)
        header = read_header(data)
        if header.kind not in {"jpeg", "png"}:
            raise UnsupportedError(header.kind)
    except struct.error:
        raise ResourceError(f"{name}: the image is cut off") from None
    except DecodeError as error:
        reason = str(error).partition(": ")[2]
        raise ResourceError(f"{name}: {reason}") from None
    except UnsupportedError:
        raise UnsupportedError(
            f"{name}: this is not a PNG, JPEG, BMP, GIF, WebP or TGA image; convert it to PNG"
        ) from None
    return header.width, header.height


def _webp_size(data: bytes) -> tuple[int, int]:
    if len(data) < 30:
        raise struct.error
    if data[12:16] == b"VP8X":
        width = int.from_bytes(data[24:27], "little") + 1
        return width, int.from_bytes(data[27:30], "little") + 1
    if data[12:16] == b"VP8L":
        (bits,) = struct.unpack_from("<I", data, 21)
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", data, 26)
    return width & 0x3FFF, height & 0x3FFF


def _is_tga(data: bytes) -> bool:
    """Return whether a file, which has no signature, has the header of a TGA image."""
    return (
        len(data) > 18
        and data[1] in {0, 1}
        and data[2] in {1, 2, 3, 9, 10, 11}
        and data[16] in {8, 15, 16, 24, 32}
    )
