"""Where JavaScript is in an engine, seen from another thread."""

from __future__ import annotations

import ctypes
import os
import struct
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.qml.log import Caller, plain_path
from rosglass.qt import QT6, QtCore, QtQml, Slot, address

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["JsStack"]

#: Bytes from the start of QJSEngine to its pointer to QV4::ExecutionEngine, whose first member is
#: the pointer to the innermost QV4::CppStackFrame: Qt's own JIT relies on that.
_ENGINE = 2 * ctypes.sizeof(ctypes.c_void_p)
#: Bytes from the start of a frame to its caller, its QV4::Function, and its place in the code.
_CALLER, _FUNCTION, _POSITION = (0, 8, 20) if QT6 else (16, 24, 52)
#: Bytes from the start of a QV4::Function to its QV4::CompiledData::Function; inside of that.
_COMPILED = 8
_NAME, _TABLES, _COUNTS, _LOCATION = 8, 24, 28, 40
#: Bytes of an entry of the table of lines.
_ENTRY = 12 if QT6 else 8
_MAGIC = b"qv4cdata"
#: Bytes from the start of a compiled file within which its functions are looked for.
_LONGEST = 1 << 24
_PAGE = 4096
#: Frames that are told.
_MOST = 12
#: Bytes from the number of a compiled file's strings to that of the string with its name.
_FILE = 124
_PROBE, _PROBE_FILE, _PROBE_LINE = "rosglassProbe", "/rosglass/probe", 3
_SCRIPT = f"(function {_PROBE}(probe) {{\n\n probe.look() }})"


class _Layout(NamedTuple):
    """Where in a compiled file something is; differs between versions of Qt.

    Attributes:
        strings: Bytes from its start to the number of its strings, which is before their place.
        text: Bytes from the start of a string to its characters.
    """

    strings: int
    text: int


class _Memory:
    """This process's memory, of which nothing that is read can do harm."""

    def __init__(self) -> None:
        try:
            self._file = os.open("/proc/self/mem", os.O_RDONLY)
        except OSError:
            self._file = -1

    def read(self, address: int, size: int) -> bytes:
        """Return bytes; raises OSError when they are not there."""
        if self._file < 0 or not 0 < address < 1 << 62:
            raise OSError(f"no such address: {address:#x}")
        found = os.pread(self._file, size, address)
        if len(found) < size:
            raise OSError(f"nothing at {address:#x}")
        return found

    def number(self, address: int, size: int = 4) -> int:
        """Return an unsigned number."""
        return int.from_bytes(self.read(address, size), "little")

    def close(self) -> None:
        """Give the file back."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


class _Probe(QtCore.QObject):
    """Looks at the stack of a function that is known."""

    def __init__(self, stack: JsStack, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._stack = stack
        self.frame = 0
        self.layout: _Layout | None = None

    @Slot()
    def look(self) -> None:
        """Look; JavaScript calls this."""
        self.frame = self._stack.frame
        with suppress(OSError, struct.error):
            self.layout = self._stack.find_layout()


class JsStack:
    """The stack of JavaScript in an engine.

    Qt tells nothing of it while JavaScript runs, so it is read from Qt's memory. That is private to
    Qt: it is tried with a function that is known, and what does not hold is not used.

    Args:
        engine: The engine, which must live as long as this is asked; in the GUI thread.
    """

    def __init__(self, engine: QtQml.QQmlEngine) -> None:
        engine_v4 = ctypes.c_void_p.from_address(address(engine) + _ENGINE).value or 0
        #: Where Qt keeps :attr:`frame`, for those in a hurry.
        self.pointer = ctypes.c_void_p.from_address(engine_v4)
        self._memory = _Memory()
        self._layout: _Layout | None = None
        before = self.frame
        probe = _Probe(self, engine)
        script: Any = engine.evaluate(_SCRIPT, _PROBE_FILE)
        script.call([engine.newQObject(probe)])
        #: Whether it is known when JavaScript runs.
        self.is_known = probe.frame not in {0, before} and self.frame == before
        self._layout = probe.layout if self.is_known else None
        probe.deleteLater()

    @property
    def frame(self) -> int:
        """What tells the innermost function that runs from its callers; 0 while none does."""
        return self.pointer.value or 0

    def handler(self, waiting: int) -> tuple[int, int]:
        """Return the frame of the function that was called first, and the function; 0 for none.

        Args:
            waiting: A frame that is not part of it any more, but waits for its end; 0 for none.
        """
        outermost = function = 0
        with suppress(OSError):
            for frame in self._frames():
                if frame == waiting:
                    break
                function, outermost = self._memory.number(frame + _FUNCTION, 8), frame
        return outermost, function

    @staticmethod
    def function_of(frame: int) -> ctypes.c_void_p:
        """Return where Qt keeps the function of a frame, for those in a hurry."""
        return ctypes.c_void_p.from_address(frame + _FUNCTION)

    def callers(self) -> list[Caller]:
        """Return where it is, the innermost function first; empty when that cannot be known.

        Of a deep stack, the innermost functions and the outermost one.

        To be called from another thread while JavaScript runs: what is read while it changes is
        left out.
        """
        if self._layout is None:
            return []
        found: list[Caller] = []
        with suppress(OSError, struct.error, UnicodeDecodeError):
            layout = self._layout
            frames = list(self._frames())
            frames[_MOST - 1 : -1] = []
            found.extend(self._caller(frame, layout) for frame in frames)
        return found

    def close(self) -> None:
        """Look no more; safe to call twice."""
        self.pointer = ctypes.c_void_p()
        self._layout = None
        self._memory.close()

    def find_layout(self) -> _Layout | None:
        """Return the layout of compiled files, given that the function that is known runs."""
        memory = self._memory
        compiled = memory.number(memory.number(self.frame + _FUNCTION, 8) + _COMPILED, 8)
        unit, name = self._unit(compiled), memory.number(compiled + _NAME)
        for strings in range(24, 160, 4):
            for text in (4, 24):
                layout = _Layout(strings, text)
                with suppress(OSError, UnicodeDecodeError):
                    if self._string(unit, name, layout) == _PROBE:
                        right = Caller(_PROBE_FILE, _PROBE_LINE, _PROBE)
                        return layout if self._caller(self.frame, layout) == right else None
        return None

    def _frames(self) -> Iterator[int]:
        frame = self.frame
        while frame:
            yield frame
            before, frame = frame, self._memory.number(frame + _CALLER, 8)
            # The stack grows downwards, so it is a caller's, or has changed meanwhile.
            if frame <= before:
                return

    def _caller(self, frame: int, layout: _Layout) -> Caller:
        memory = self._memory
        compiled = memory.number(memory.number(frame + _FUNCTION, 8) + _COMPILED, 8)
        unit = self._unit(compiled)
        name = self._string(unit, memory.number(compiled + _NAME), layout)
        file = self._string(unit, memory.number(unit + layout.strings + _FILE), layout)
        line = memory.number(compiled + _LOCATION) & 0xFFFFF
        counts = memory.number(compiled + _COUNTS)
        table = compiled + memory.number(compiled + _TABLES) + 4 * (counts & 0xFFFF)
        position = memory.number(frame + _POSITION)
        for number in range(min(counts >> 16, 10_000)):
            offset, at = struct.unpack("<Ii", memory.read(table + number * _ENTRY, 8))
            if offset >= position:
                break
            line = abs(at)
        return Caller(plain_path(file), line, name)

    def _unit(self, compiled: int) -> int:
        """Return where the compiled file begins that a function is in."""
        # What is before the file may not be there, but a page is there as a whole.
        page, end = compiled & -_PAGE, compiled
        while compiled - page < _LONGEST:
            # The magic word may lie across two pages.
            at = self._memory.read(page, end - page).rfind(_MAGIC)
            if at >= 0:
                return page + at
            page, end = page - _PAGE, page + len(_MAGIC)
        raise OSError("this is no function")

    def _string(self, unit: int, number: int, layout: _Layout) -> str:
        memory = self._memory
        count, table = struct.unpack("<II", memory.read(unit + layout.strings, 8))
        if not number < count < 1 << 20:
            return ""
        start = unit + memory.number(unit + table + 4 * number)
        size = memory.number(start if layout.text == 4 else start + 4)
        if size > 4096:
            return ""
        return memory.read(start + layout.text, 2 * size).decode("utf-16-le")
