"""XML of robots and meshes, read by expat within limits, with the line of each element.

ElementTree's own parser drops the lines, and lets a document define entities.
"""

from __future__ import annotations

from typing import NoReturn
from xml.etree.ElementTree import Element
from xml.parsers.expat import ExpatError, ParserCreate

from rosglass.errors import Error

__all__ = ["XmlElement", "XmlError", "read_xml"]

_MAX_ELEMENTS = 1_000_000
_MAX_DEPTH = 200


class XmlError(Error):
    """A document is not well-formed XML, or beyond the limits."""


class XmlElement(Element):
    """An element of a document; the text behind its first child is not kept.

    Attributes:
        line: 1-based line on which it starts.
    """

    __slots__ = ("line",)

    line: int


def read_xml(data: str | bytes, source: str, max_bytes: int) -> XmlElement:
    """Return the root element of a document.

    Args:
        data: The document; bytes are decoded as their XML declaration says, or as UTF-8.
        source: File or topic that the document is from, for errors.
        max_bytes: Largest document that is read, in bytes or characters.

    Raises:
        XmlError: The document is malformed or too large, has a document type, or has more than
            1,000,000 elements or 200 levels.
    """
    if len(data) > max_bytes:
        raise XmlError(f"{source}: {len(data)} bytes of XML; the limit is {max_bytes}")
    if not data.strip():
        raise XmlError(f"{source}: the text is empty; expected XML")
    reader = _Reader(source)
    try:
        return reader.read(data)
    except ExpatError as error:
        reason = str(error).partition(":")[0]
        raise XmlError(
            f"{source}:{error.lineno}: the text is not well-formed XML: {reason} "
            f"(column {error.offset + 1})"
        ) from None
    except (LookupError, ValueError) as error:  # of an encoding, or a lone surrogate
        raise XmlError(f"{source}: the text can't be decoded: {error}; save it as UTF-8") from None


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

    def read(self, data: str | bytes) -> XmlElement:
        self._parser.Parse(data, True)
        assert self._root is not None  # expat refuses a document without an element
        return self._root

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
