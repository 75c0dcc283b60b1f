"""The JavaScript stack of an engine, which Qt does not show while JavaScript runs.

The public ``QJSEngine.setInterrupted`` ends JavaScript, but Qt does not report if any runs, nor if
it has ended. Interrupted from one heartbeat of the GUI thread to the next, an engine ends
every handler that comes in between as well, without a warning: that of a stop button which was
pressed while a function looped, or while Qt, RViz or a plugin was at work and no JavaScript ran
(``tests/gui/test_js_stack.py``). So the watchdog reads from Qt's memory what runs, and where.
"""

from __future__ import annotations

import ctypes
import os
import struct
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.qml.engine.log import Caller, plain_path
from rosglass.qt import QT6, QtCore, QtQml, Slot, address

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["JsStack"]

#: Bytes from the start of QJSEngine to its pointer to QV4::ExecutionEngine, whose first member is
#: the pointer to the innermost QV4::CppStackFrame: Qt's own JIT relies on this layout.
_ENGINE = 2 * ctypes.sizeof(ctypes.c_void_p)
#: Bytes from the start of a frame to its caller, its QV4::Function, and its position in the code.
_CALLER, _FUNCTION, _POSITION = (0, 8, 20) if QT6 else (16, 24, 52)
#: Bytes from the start of a QV4::Function to its QV4::CompiledData::Function; and within that.
_COMPILED = 8
_NAME, _TABLES, _COUNTS, _LOCATION = 8, 24, 28, 40
#: Bytes of an entry in the line table.
_ENTRY = 12 if QT6 else 8
_MAGIC = b"qv4cdata"
#: Bytes from the start of a compiled file within which its functions are searched.
_LONGEST = 1 << 24
_PAGE = 4096
#: Maximum number of reported stack frames.
_MOST = 12
#: Bytes from a compiled file's string count to the index of the string with its name.
_FILE = 124
_PROBE, _PROBE_FILE, _PROBE_LINE = "rosglassProbe", "/rosglass/probe", 3
_SCRIPT = f"(function {_PROBE}(probe) {{\n\n probe.look() }})"


class _Layout(NamedTuple):
    """Offsets in a compiled file, which differ between versions of Qt.

    Attributes:
        strings: Bytes from its start to its string count, which precedes the strings' offset.
        text: Bytes from the start of a string to its characters.
    """

    strings: int
    text: int


class _Memory:
    """Reads this process's memory; invalid addresses raise an error instead of crashing."""

    def __init__(self) -> None:
        try:
            self._file = os.open("/proc/self/mem", os.O_RDONLY)
        except OSError:
            self._file = -1

    def read(self, address: int, size: int) -> bytes:
        """Return bytes; raises OSError if the address is invalid."""
        if self._file < 0 or not 0 < address < 1 << 62:
            raise OSError(f"no such address: {address:#x}")
        found = os.pread(self._file, size, address)
        if len(found) < size:
            raise OSError(f"nothing at {address:#x}")
        return found

    def number(self, address: int, size: int = 4) -> int:
        """Return an unsigned integer."""
        return int.from_bytes(self.read(address, size), "little")

    def close(self) -> None:
        """Close the file."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


class _Probe(QtCore.QObject):
    """Inspects the stack while a known function runs."""

    def __init__(self, stack: JsStack, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._stack = stack
        self.frame = 0
        self.layout: _Layout | None = None

    @Slot()
    def look(self) -> None:
        """Inspect the stack; JavaScript calls this."""
        self.frame = self._stack.frame
        with suppress(OSError, struct.error):  # another layout
            self.layout = self._stack.find_layout()


class JsStack:
    """The JavaScript stack of an engine.

    Qt has no interface for it while JavaScript runs, so it is read from Qt's memory. The layout is
    private to Qt: it is checked with a known function, and parts that do not match are not used.

    Args:
        engine: The engine, which must outlive this object; in the GUI thread.
    """

    def __init__(self, engine: QtQml.QQmlEngine) -> None:
        engine_v4 = ctypes.c_void_p.from_address(address(engine) + _ENGINE).value or 0
        #: Qt's pointer to :attr:`frame`, for fast access.
        self.pointer = ctypes.c_void_p.from_address(engine_v4)
        self._memory = _Memory()
        self._layout: _Layout | None = None
        before = self.frame
        probe = _Probe(self, engine)
        script: Any = engine.evaluate(_SCRIPT, _PROBE_FILE)
        script.call([engine.newQObject(probe)])
        #: Whether running JavaScript can be detected.
        self.is_known = probe.frame not in {0, before} and self.frame == before
        self._layout = probe.layout if self.is_known else None
        probe.deleteLater()

    @property
    def frame(self) -> int:
        """Address of the innermost running function's frame; 0 if none runs."""
        return self.pointer.value or 0

    def handler(self, waiting: int) -> tuple[int, int]:
        """Return the frame of the outermost running function, and the function; 0 for none.

        Args:
            waiting: A frame that only waits for the end of these functions; 0 for none.
        """
        outermost = function = 0
        with suppress(OSError):  # it changed while being read
            for frame in self._frames():
                if frame == waiting:
                    break
                function, outermost = self._memory.number(frame + _FUNCTION, 8), frame
        return outermost, function

    @staticmethod
    def function_of(frame: int) -> ctypes.c_void_p:
        """Return Qt's pointer to the function of a frame, for fast access."""
        return ctypes.c_void_p.from_address(frame + _FUNCTION)

    def callers(self) -> list[Caller]:
        """Return the call stack, innermost function first; empty if it cannot be read.

        For a deep stack, only the innermost functions and the outermost one.

        Called from another thread while JavaScript runs: parts that change while being read are
        left out.
        """
        if self._layout is None:
            return []
        found: list[Caller] = []
        with suppress(OSError, struct.error, UnicodeDecodeError):  # as above
            layout = self._layout
            frames = list(self._frames())
            frames[_MOST - 1 : -1] = []
            found.extend(self._caller(frame, layout) for frame in frames)
        return found

    def close(self) -> None:
        """Stop reading; safe to call twice."""
        self.pointer = ctypes.c_void_p()
        self._layout = None
        self._memory.close()

    def find_layout(self) -> _Layout | None:
        """Return the layout of compiled files, determined while the known function runs."""
        memory = self._memory
        compiled = memory.number(memory.number(self.frame + _FUNCTION, 8) + _COMPILED, 8)
        unit, name = self._unit(compiled), memory.number(compiled + _NAME)
        for strings in range(24, 160, 4):
            for text in (4, 24):
                layout = _Layout(strings, text)
                with suppress(OSError, UnicodeDecodeError):  # another layout
                    if self._string(unit, name, layout) == _PROBE:
                        right = Caller(_PROBE_FILE, _PROBE_LINE, _PROBE)
                        return layout if self._caller(self.frame, layout) == right else None
        return None

    def _frames(self) -> Iterator[int]:
        frame = self.frame
        while frame:
            yield frame
            before, frame = frame, self._memory.number(frame + _CALLER, 8)
            # The stack grows downwards: such a frame is a caller's, or has changed in between.
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
        """Return the start of the compiled file that contains a function."""
        # Memory before the file may be unmapped, but pages are mapped as a whole.
        page, end = compiled & -_PAGE, compiled
        while compiled - page < _LONGEST:
            # The magic word may span two pages.
            at = self._memory.read(page, end - page).rfind(_MAGIC)
            if at >= 0:
                return page + at
            page, end = page - _PAGE, page + len(_MAGIC)
        raise OSError("this is not a function")

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
