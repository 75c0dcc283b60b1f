"""Definitions that robots sent, kept on disk for when nobody can be asked."""

# pathlib takes longer to import than the first definition to load.
# ruff: noqa: PTH100, PTH103, PTH105, PTH108, PTH111, PTH117, PTH118, PTH123

from __future__ import annotations

import logging
import os
import re
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import DefinitionError, Error
from rosglass.interfaces.hashes import announced_hashes, type_description
from rosglass.interfaces.type_descriptions import parse_type_description
from rosglass.interfaces.type_sources import add_type_sources, type_sources

if TYPE_CHECKING:
    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["CACHE_VARIABLE", "TypeCache", "cache_folder"]

_log = logging.getLogger("rosglass.interfaces")

#: Environment variable with the cache's folder, or ``off``.
CACHE_VARIABLE = "ROSGLASS_TYPE_CACHE"
_OFF = ("off", "0", "no", "false", "none")
_HASH = re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")
#: What reading a file raises that somebody else has written.
_RUBBISH = (Error, ValueError, TypeError, LookupError, AttributeError, RecursionError)
#: Bytes that one entry, and all entries together, may take.
_MAX_ENTRY = 8 << 20
_MAX_TOTAL = 64 << 20


def cache_folder() -> str:
    """Return the folder of the cache; empty when it is switched off.

    ``ROSGLASS_TYPE_CACHE`` if it is set, otherwise where the system keeps such things:
    ``rosglass/types`` in ``XDG_CACHE_HOME`` or ``~/.cache`` (Linux), ``~/Library/Caches`` (macOS),
    ``%LOCALAPPDATA%`` (Windows).
    """
    chosen = os.environ.get(CACHE_VARIABLE, "").strip()
    if chosen.lower() in _OFF:
        return ""
    if chosen:
        return os.path.abspath(os.path.expanduser(chosen))
    home = os.path.expanduser("~")
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or os.path.join(home, "AppData", "Local")
    elif sys.platform == "darwin":
        base = os.path.join(home, "Library", "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME", "")
        # The specification says that relative paths count as unset.
        base = base if os.path.isabs(base) else os.path.join(home, ".cache")
    return os.path.join(base, "rosglass", "types")


class TypeCache:
    """One file per definition, called like its hash; what cannot be read or written is skipped.

    Args:
        folder: Where the files are; empty for a cache that keeps nothing. Made when needed.
    """

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self._told = False

    def get(self, name: str, type_hash: str) -> InterfaceDefinition | None:
        """Return the definition of a type with a hash, None when it is not in the cache."""
        path = self._path(type_hash)
        if not path:
            return None
        try:
            with open(path, encoding="utf-8") as file:
                text = file.read(_MAX_ENTRY)
        except (OSError, ValueError):
            return None
        try:
            return _read(text, name, type_hash)
        except _RUBBISH as error:
            # Whoever wrote it: it is of no use to anybody.
            _log.warning("%s is no definition of %s and is removed: %s", path, name, error)
            with suppress(OSError):
                os.unlink(path)
            return None

    def put(self, definition: InterfaceDefinition, type_hash: str) -> None:
        """Keep a definition under the hash that a robot announced for it.

        Old entries make room: all together take 64 MB at most.
        """
        path = self._path(type_hash)
        if not path:
            return
        entry = {
            "type_name": definition.name,
            "source": definition.source.provider,
            "type_description": type_description(definition),
            "type_sources": type_sources(definition),
        }
        import json  # noqa: PLC0415 - its 2 ms would be spent by all who load a definition

        data = json.dumps(entry, indent=1).encode()
        if len(data) > _MAX_ENTRY:
            return
        try:
            os.makedirs(self.folder, mode=0o700, exist_ok=True)
            self._make_room(len(data))
            # Other processes see either the whole file or none.
            part = f"{path}.{os.getpid()}.{threading.get_ident()}"
            with open(part, "wb") as file:
                file.write(data)
            os.replace(part, path)
        except (OSError, ValueError) as error:
            if not self._told:
                self._told = True
                _log.info("definitions from robots are not kept in %s: %s", self.folder, error)

    def _path(self, type_hash: str) -> str:
        if not (self.folder and _HASH.fullmatch(type_hash)):
            return ""
        return os.path.join(self.folder, f"{type_hash}.json")

    def _make_room(self, size: int) -> None:
        entries = []
        with os.scandir(self.folder) as found:
            for entry in found:
                with suppress(OSError):
                    about = entry.stat()
                    entries.append((about.st_mtime, about.st_size, entry.path))
        total = size + sum(entry[1] for entry in entries)
        for _, taken, path in sorted(entries):
            if total <= _MAX_TOTAL:
                return
            with suppress(OSError):
                os.unlink(path)
            total -= taken


def _read(text: str, name: str, type_hash: str) -> InterfaceDefinition:
    import json  # noqa: PLC0415 - as above

    entry = json.loads(text)
    provider = f"cache, from {entry['source'].removeprefix('wire ')}"
    described = parse_type_description(entry["type_description"], provider=provider)
    definition = add_type_sources(described, entry["type_sources"], verbatim=True)
    if definition.name != name or type_hash not in announced_hashes(definition):
        raise DefinitionError(f"it is {definition.name}, with another hash", "<cache>")
    return definition
