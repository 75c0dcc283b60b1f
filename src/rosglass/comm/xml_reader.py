"""XML of robots and meshes, read by expat within limits, with the line of each element.

ElementTree's own parser drops the lines, and lets a document define entities. What RViz's parsers
(tinyxml, pugixml) read although it is not well-formed is read here with a warning.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NoReturn
from xml.etree.ElementTree import Element
from xml.parsers.expat import ExpatError, ParserCreate

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["XmlElement", "XmlError", "read_xml"]

_MAX_ELEMENTS = 1_000_000
_MAX_DEPTH = 200
#: Longest document whose faults are mended, which takes several times its memory.
_MAX_MENDED = 64 << 20


class XmlError(Error):
    """A document is not well-formed XML, or beyond the limits."""


class XmlElement(Element):
    """An element of a document; the text behind its first child is not kept.

    Attributes:
        line: 1-based line on which it starts.
    """

    __slots__ = ("line",)

    line: int


def read_xml(
    data: str | bytes, source: str, max_bytes: int, warn: Callable[[str], None]
) -> XmlElement:
    """Return the root element of a document.

    What stands behind its end is ignored. Comments and spaces in front of the declaration, ``--``
    in comments, bytes of Latin-1 in UTF-8, and an ``&`` that is not an entity are read.

    Args:
        data: The document; bytes are decoded as their XML declaration says, or as UTF-8.
        source: File or topic that the document is from, for errors.
        max_bytes: Largest document that is read, in bytes or characters.
        warn: Called with a warning, which begins with source and line, if it is not well-formed.

    Raises:
        XmlError: The document is malformed or too large, has a document type, or has more than
            1,000,000 elements or 200 levels.
    """
    if len(data) > max_bytes:
        raise XmlError(f"{source}: {len(data)} bytes of XML; the limit is {max_bytes}")
    if not data.strip():
        raise XmlError(f"{source}: the text is empty; expected XML")
    root, fault = _read(data, source)
    if root is None:
        mended = _mended(data)
        root, later = (None, fault) if mended is None else _read(mended, source)
        if root is None:
            raise XmlError(later)
    if fault:
        warn(f"{fault}; it is read anyway")
    return root


def _read(data: str | bytes, source: str) -> tuple[XmlElement | None, str]:
    """Return the root element if its end was read, and the first fault, empty for none."""
    reader = _Reader(source)
    try:
        reader.read(data)
    except ExpatError as error:
        reason = str(error).partition(":")[0]
        fault = (
            f"{source}:{error.lineno}: the text is not well-formed XML: {reason} "
            f"(column {error.offset + 1})"
        )
        return reader.root(), fault
    except (LookupError, ValueError) as error:  # of an encoding, or a lone surrogate
        raise XmlError(f"{source}: the text can't be decoded: {error}; save it as UTF-8") from None
    return reader.root(), ""


_SPACES = re.compile(r"[\s\ufeff]*")
_ENCODING = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*[\"']([\w.-]+)")
_AMPERSAND = re.compile(r"&(?!(?:#\d+|#x[0-9A-Fa-f]+|amp|lt|gt|quot|apos);)")


def _mended(data: str | bytes) -> str | None:
    """Return a document with the faults mended that RViz's parsers read; lines stay where they are.

    None if it can't be decoded or is too long.
    """
    if len(data) > _MAX_MENDED:
        return None
    if isinstance(data, str):
        text = data
    else:
        declared = _ENCODING.search(data[:4096])
        encoding = "utf-8" if declared is None else declared[1].decode()
        try:
            text = data.decode(encoding, "surrogateescape")
        except (LookupError, UnicodeError):
            return None
        # Bytes that are not UTF-8 are taken for Latin-1.
        text = re.sub("[\udc80-\udcff]", lambda match: chr(ord(match[0]) - 0xDC00), text)
    start = _end_of_comments(text)
    end = text.find("?>", start) + 2
    if text.startswith("<?xml", start) and end > start:
        before = text[:start].replace("\ufeff", "")
        text = f"{text[start:end]}{before}{text[end:]}"
    return _AMPERSAND.sub("&amp;", _without_dashes(text))


def _end_of_comments(text: str) -> int:
    """Return the place behind the spaces and comments at the beginning."""
    place = _end_of_spaces(text, 0)
    while text.startswith("<!--", place):
        end = text.find("-->", place + 4)
        if end < 0:
            break
        place = _end_of_spaces(text, end + 3)
    return place


def _end_of_spaces(text: str, place: int) -> int:
    match = _SPACES.match(text, place)
    return place if match is None else match.end()


def _without_dashes(text: str) -> str:
    """Return a text whose comments have no ``--`` inside."""
    parts, place = [], 0
    while True:
        start = text.find("<!--", place)
        end = text.find("-->", start + 4) if start >= 0 else -1
        if end < 0:
            parts.append(text[place:])
            return "".join(parts)
        parts.append(f"{text[place : start + 4]}{text[start + 4 : end].replace('-', '=')}-->")
        place = end + 3


class _Reader:
    def __init__(self, source: str) -> None:
        self._source = source
        self._stack: list[XmlElement] = []
        self._root: XmlElement | None = None
        self._text: list[str] = []
        self._count = 0
        self._parser = ParserCreate()
        # The numbers of a mesh come in few pieces.
        self._parser.buffer_size = 1 << 20
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._on_start
        self._parser.EndElementHandler = self._on_end
        self._parser.CharacterDataHandler = self._text.append
        self._parser.StartDoctypeDeclHandler = self._on_doctype

    def read(self, data: str | bytes) -> None:
        self._parser.Parse(data, True)

    def root(self) -> XmlElement | None:
        """Return the root element if its end was read; otherwise None."""
        return None if self._stack else self._root

    def _on_start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        if self._count > _MAX_ELEMENTS:
            self._refuse(f"more than {_MAX_ELEMENTS} elements")
        if len(self._stack) >= _MAX_DEPTH:
            self._refuse(f"<{tag}> is inside more than {_MAX_DEPTH} other elements")
        element = XmlElement(tag, attributes)
        element.line = self._parser.CurrentLineNumber
        if self._stack:
            parent = self._stack[-1]
            if not len(parent):
                parent.text = "".join(self._text)
            parent.append(element)
        else:
            self._root = element
        self._text.clear()
        self._stack.append(element)

    def _on_end(self, _tag: str) -> None:
        element = self._stack.pop()
        if not len(element):
            element.text = "".join(self._text)
        self._text.clear()

    def _on_doctype(self, *_: object) -> None:
        # Entities of a document type can make gigabytes of a few lines.
        self._refuse("a document type (<!DOCTYPE ...>) is not allowed; remove it")

    def _refuse(self, reason: str) -> NoReturn:
        raise XmlError(f"{self._source}:{self._parser.CurrentLineNumber}: {reason}")
