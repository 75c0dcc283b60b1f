"""The file of a layout: saved whole or not at all, merged with changes from outside, recovered.

file = LayoutFile.open(path)
...
if file.changed_outside():
    theirs = file.reread()
    text, conflicts = file.merge(text)
    if not conflicts:
        file.accept(theirs)
file.save(text)
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import secrets
import stat
import sys
import time
from collections import Counter
from contextlib import suppress
from difflib import SequenceMatcher
from pathlib import Path
from typing import NamedTuple

from rosglass.cockpit.qml_scanner import Member, Object, Scanner
from rosglass.errors import QmlError, QmlSyntaxError

__all__ = ["Conflict", "LayoutFile", "Recovery", "merge", "state_folder"]

#: Size of a file in bytes from which on it is not a layout.
_MOST_BYTES = 16 << 20
#: Lines that are compared; larger differences are one conflict.
_MOST_LINES = 5_000
#: Seconds in which a file may change again without another time stamp.
_STAMP_S = 2.0
#: Recoveries that are kept.
_MOST_RECOVERIES = 50


class Conflict(NamedTuple):
    """A place that both sides have changed.

    Attributes:
        line: 1-based line in one's own text.
        reason: Why it cannot be merged.
        base: The lines that both started from.
        mine: One's own lines.
        theirs: The lines from outside.
    """

    line: int
    reason: str
    base: str = ""
    mine: str = ""
    theirs: str = ""


class LayoutFile:
    """A layout on disk.

    Reading and writing wait for the disk.

    Attributes:
        path: Absolute path.
        text: The text that changes are compared with: as it was read or saved last.
    """

    def __init__(self, path: Path, text: str) -> None:
        self.path, self.text = path, text
        self._stamp: tuple[int, ...] | None = None
        self._stamped_at = 0.0

    @classmethod
    def open(cls, path: str | Path) -> LayoutFile:
        """Read a layout.

        Raises:
            QmlError: The file is missing, cannot be read, or is not text in UTF-8.
        """
        file = cls(Path(path).absolute(), "")
        file.text = file.reread()
        return file

    @classmethod
    def create(cls, path: str | Path, text: str) -> LayoutFile:
        """Write a layout to a new file, or over another one.

        Raises:
            QmlError: It cannot be written.
        """
        file = cls(Path(path).absolute(), "")
        file.save(text, overwrite=True)
        return file

    def save(self, text: str, *, overwrite: bool = False) -> None:
        """Write the text: afterwards the file has all of it, or all of what it had before.

        Its mode and a symbolic link to it stay.

        Args:
            text: The text.
            overwrite: Write it even if the file was changed from outside.

        Raises:
            QmlError: It cannot be written, or was changed from outside; the file is as before.
        """
        if not overwrite and self.changed_outside():
            raise QmlError(
                f"{self.path} was changed by another program and is not overwritten; merge first"
            )
        try:
            data = text.encode()
        except UnicodeEncodeError as error:
            line = text.count("\n", 0, error.start) + 1
            raise QmlError(f"{self.path}:{line}: half of a character cannot be saved") from None
        try:
            _write(Path(os.path.realpath(self.path)), data)
            self._remember(self.path.stat())
        except OSError as error:
            raise QmlError(f"{self.path} cannot be saved: {_reason(error)}") from None
        self.text = text

    def changed_outside(self) -> bool:
        """Return whether the file has another text than `text`; False if it is missing."""
        try:
            about = self.path.stat()
            stamp = _stamp(about)
            settled = self._stamped_at - max(about.st_mtime, about.st_ctime) > _STAMP_S
            if stamp == self._stamp and settled:
                return False
            changed = self._read() != self.text
        except OSError:
            return False
        except QmlError:
            return True
        if not changed:
            self._remember(about)
        return changed

    def reread(self) -> str:
        """Return the text that is in the file now; `text` stays until :meth:`accept`.

        Raises:
            QmlError: The file is missing, cannot be read, or is not text in UTF-8.
        """
        try:
            return self._read()
        except OSError as error:
            raise QmlError(f"{self.path} cannot be read: {_reason(error)}") from None

    def accept(self, theirs: str) -> None:
        """Take a text from outside as what later changes are compared with, and saved over."""
        self.text = theirs
        self._stamp = None

    def merge(self, mine: str) -> tuple[str, list[Conflict]]:
        """Merge one's own text with the text from outside.

        Returns:
            The merged text, and no conflicts; or one's own text, and the conflicts.

        Raises:
            QmlError: The file is missing, cannot be read, or is not text in UTF-8.
        """
        return merge(self.text, mine, self.reread())

    def _read(self) -> str:
        about = self.path.stat()
        if not stat.S_ISREG(about.st_mode):
            raise QmlError(f"{self.path} is not a file")
        if about.st_size > _MOST_BYTES:
            raise QmlError(f"{self.path} is larger than {_MOST_BYTES >> 20} MB: not a layout")
        data = self.path.read_bytes()
        try:
            text = data.decode()
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            raise QmlError(f"{self.path}:{line}: not UTF-8; save it in this encoding") from None
        if text == self.text or not self.text:
            self._remember(about)
        return text

    def _remember(self, about: os.stat_result) -> None:
        self._stamp, self._stamped_at = _stamp(about), time.time()


def _stamp(about: os.stat_result) -> tuple[int, ...]:
    # A program can set the time of modification, but not that of the change itself.
    return about.st_mtime_ns, about.st_ctime_ns, about.st_size, about.st_ino, about.st_dev


def _reason(error: OSError) -> str:
    return error.strerror or type(error).__name__


def _write(path: Path, data: bytes, durable: bool = True) -> None:
    """Replace a file by another one, as `save` says; OSError if that fails."""
    try:
        about = path.stat()
    except FileNotFoundError:
        about = None
    if about is not None and not stat.S_ISREG(about.st_mode):
        raise OSError(errno.EISDIR, "it is not a file")
    if about is not None and not os.access(path, os.W_OK):
        # A rename would replace it all the same.
        raise PermissionError(errno.EACCES, "it is read-only")
    part = path.with_name(f".{path.name[:100]}.{secrets.token_hex(4)}")
    try:
        with part.open("xb") as file:
            file.write(data)
            file.flush()
            if durable:
                os.fsync(file.fileno())
        if about is not None:
            part.chmod(stat.S_IMODE(about.st_mode))
            if os.name == "posix" and (about.st_uid, about.st_gid) != (os.getuid(), os.getgid()):
                with suppress(OSError):  # only root may give files away
                    os.chown(part, about.st_uid, about.st_gid)
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise
    if durable and os.name == "posix":
        # The new name is on the disk only when the folder is.
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            with suppress(OSError):  # some file systems cannot
                os.fsync(folder)
        finally:
            os.close(folder)


# ---- merging


def merge(base: str, mine: str, theirs: str) -> tuple[str, list[Conflict]]:
    """Merge two texts that were made from the same one, by lines.

    Changes of the same or of adjacent lines are conflicts, unless both are the same change; so are
    merged texts that are not QML, or have an id or property twice.

    Args:
        base: The text that both started from.
        mine: One's own text.
        theirs: The text from outside.

    Returns:
        The merged text, and no conflicts; or one's own text, and the conflicts.
    """
    if theirs in {base, mine}:
        return mine, []
    if base == mine:
        return theirs, []
    old, own, other = (_lines(text) for text in (base, mine, theirs))
    merged: list[str] = []
    conflicts = []
    # Where the part behind the last change starts, in the base and in one's own text.
    at = own_at = 0
    for start, end, own_span, other_span in _regions(_changes(old, own), _changes(old, other)):
        merged += old[at:start]
        own_at += start - at
        before = old[start:end]
        ours = own[slice(*own_span)]
        new = other[slice(*other_span)]
        if new in (ours, before):
            merged += ours
        elif ours == before:
            merged += new
        else:
            texts = ("".join(lines) for lines in (before, ours, new))
            conflicts.append(Conflict(own_at + 1, "both have changed it", *texts))
        own_at += len(ours)
        at = end
    merged += old[at:]
    text = "".join(merged)
    conflicts = conflicts or _broken_by_merge(text, mine, theirs)
    return (mine, conflicts) if conflicts else (text, [])


def _lines(text: str) -> list[str]:
    return re.findall(r"[^\r\n]*(?:\r\n|\n|\r)|[^\r\n]+", text)


def _changes(old: list[str], new: list[str]) -> list[tuple[int, int, int, int]]:
    """Return the ranges of `old` that differ, and those of `new` in their places."""
    start, rest = 0, 0
    shorter = min(len(old), len(new))
    while start < shorter and old[start] == new[start]:
        start += 1
    while rest < shorter - start and old[-1 - rest] == new[-1 - rest]:
        rest += 1
    first, second = old[start : len(old) - rest], new[start : len(new) - rest]
    if len(first) + len(second) > _MOST_LINES:
        return [(start, len(old) - rest, start, len(new) - rest)]
    return [
        (start + a, start + b, start + c, start + d)
        for what, a, b, c, d in SequenceMatcher(None, first, second).get_opcodes()
        if what != "equal"
    ]


def _regions(
    own: list[tuple[int, int, int, int]], other: list[tuple[int, int, int, int]]
) -> list[tuple[int, int, tuple[int, int], tuple[int, int]]]:
    """Return the changed ranges of the base, and the ranges of both texts in their places.

    Changes that touch each other are one.
    """
    merged: list[list[int]] = []
    for start, end in sorted(change[:2] for change in own + other):
        if merged and start <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], end)
        else:
            merged.append([start, end])
    spans = zip(merged, _spans(merged, own), _spans(merged, other), strict=True)
    return [(start, end, mine, theirs) for (start, end), mine, theirs in spans]


def _spans(
    regions: list[list[int]], changes: list[tuple[int, int, int, int]]
) -> list[tuple[int, int]]:
    """Return the ranges of a text in the places of ranges of the base."""
    spans, index, offset = [], 0, 0
    for start, end in regions:
        first = start + offset
        while index < len(changes) and changes[index][1] <= end:
            _, old_end, _, new_end = changes[index]
            offset = new_end - old_end
            index += 1
        spans.append((first, end + offset))
    return spans


def _broken_by_merge(text: str, mine: str, theirs: str) -> list[Conflict]:
    """Return conflicts that lines do not show."""
    try:
        known = _doubles(mine) | _doubles(theirs)
        doubled = _doubles(text) - known
    except QmlSyntaxError as error:
        return [Conflict(1, f"the text from outside, or the merged one, is not QML: {error}")]
    return [Conflict(1, f"{name} would be there twice") for name in doubled]


def _doubles(text: str) -> Counter[str]:
    """Return the ids, and the properties of each object, that are there more than once."""
    ids: Counter[str] = Counter()
    doubles: Counter[str] = Counter()
    for found in Scanner(text).root.walk():
        names: Counter[str] = Counter()
        waiting: list[tuple[str, Member | Object]] = [("", item) for item in found.items]
        while waiting:
            prefix, item = waiting.pop()
            if isinstance(item, Object):
                continue
            if item.group is not None:
                waiting += [(f"{prefix}{item.name}.", inner) for inner in item.group.items]
            elif item.form in {"value", "object", "list", "component"}:
                names[f"{prefix}{item.name}"] += 1
        ids[f"the id {found.id}"] += bool(found.id)
        label = f"{found.type} {found.id}".rstrip()
        doubles.update({f"{name} of {label}": count - 1 for name, count in names.items()})
    doubles.update({name: count - 1 for name, count in ids.items()})
    return +doubles


# ---- recovery


def state_folder() -> Path:
    """Return the folder for what the cockpit remembers: ``rosglass/cockpit`` in the system's.

    That is ``XDG_STATE_HOME`` or ``~/.local/state`` (Linux), ``~/Library/Application Support``
    (macOS), ``%LOCALAPPDATA%`` (Windows).
    """
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_STATE_HOME", ""))
        # The specification says that relative paths count as unset.
        base = base if base.is_absolute() else home / ".local" / "state"
    return base / "rosglass" / "cockpit"


class Recovery:
    """Texts that were not saved when the program ended; one for each layout and process."""

    @staticmethod
    def keep(path: str | Path, text: str) -> None:
        """Note the text of a layout, so that it survives the end of this process.

        It does not wait for the disk: a power cut may cost it.

        Args:
            path: The layout; it need not exist.
            text: Its text as it is now.

        Raises:
            QmlError: The text cannot be noted, and why.
        """
        pid, start = os.getpid(), _start_of(os.getpid())
        entry = {"path": str(Path(path).absolute()), "pid": pid, "start": start, "text": text}
        target = _recovery_file(path, pid)
        try:
            target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            _write(target, json.dumps(entry).encode(), durable=False)
            target.chmod(0o600)
            _limit(target.parent)
        except OSError as error:
            raise QmlError(f"{target} cannot be written: {_reason(error)}") from None

    @staticmethod
    def find(path: str | Path) -> str | None:
        """Return the newest text that an ended process, or this one, noted for a layout.

        None without one. Files with anything else are removed.
        """
        for file in _recoveries(path):
            with suppress(OSError):
                try:
                    entry = json.loads(file.read_bytes())
                    text, pid, start = entry["text"], entry["pid"], entry["start"]
                    if not isinstance(text, str) or not isinstance(pid, int):
                        raise ValueError("not an entry")
                except (ValueError, LookupError, TypeError, RecursionError):
                    file.unlink()
                    continue
                if pid == os.getpid() or not _is_running(pid, start):
                    return text
        return None

    @staticmethod
    def drop(path: str | Path) -> None:
        """Forget the texts of a layout, except those of other processes that still run."""
        for file in _recoveries(path):
            with suppress(OSError, ValueError, LookupError, TypeError, RecursionError):
                entry = json.loads(file.read_bytes())
                if entry["pid"] != os.getpid() and _is_running(entry["pid"], entry["start"]):
                    continue
            with suppress(OSError):
                file.unlink()


def _recovery_file(path: str | Path, pid: int) -> Path:
    absolute = Path(path).absolute()
    digest = hashlib.sha256(os.fsencode(absolute)).hexdigest()[:16]
    return state_folder() / "recovery" / f"{absolute.stem[:40]}-{digest}-{pid}.json"


def _recoveries(path: str | Path) -> list[Path]:
    """Return the files for a layout, the newest first."""
    name = _recovery_file(path, 0).name.removesuffix("0.json")
    files: list[Path] = []
    with suppress(OSError):
        files += (state_folder() / "recovery").iterdir()
        files = [file for file in files if file.name.startswith(name) and file.suffix == ".json"]
        files.sort(key=lambda file: file.stat().st_mtime_ns, reverse=True)
    return files


def _limit(folder: Path) -> None:
    files = list(folder.glob("*.json"))
    if len(files) > _MOST_RECOVERIES:
        oldest = sorted(files, key=lambda file: file.stat().st_mtime_ns)
        for file in oldest[: len(files) - _MOST_RECOVERIES]:
            file.unlink(missing_ok=True)


def _start_of(pid: int) -> str:
    """Return when a process started, in the system's own unit; empty if that is unknown."""
    try:
        data = Path(f"/proc/{pid}/stat").read_bytes()
        return data.rpartition(b")")[2].split()[19].decode()
    except (OSError, IndexError):
        return ""


def _is_running(pid: int, start: object) -> bool:
    """Return whether the process that noted a text still runs; another one may have its number."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    now = _start_of(pid)
    return not now or now == start
