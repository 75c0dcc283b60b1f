"""Guessing what a misspelled name stands for."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["similar"]


def similar(name: str, known: Iterable[str]) -> str:
    """Return a hint at a known name that `name` may stand for, empty when there is none."""
    import difflib  # noqa: PLC0415 - only needed to explain an error

    names = [other for other in known if other != name]
    base = name.rpartition("/")[2]
    near = [other for other in names if other.rpartition("/")[2] == base]
    plain = _plain(name)
    near += [other for other in names if _plain(other) == plain]
    near += difflib.get_close_matches(name, names, 2, 0.8)
    return f"; did you mean {' or '.join(list(dict.fromkeys(near))[:2])}?" if near else ""


def _plain(name: str) -> str:
    """Return a name without what languages spell differently: frameId and frame_id."""
    return name.replace("_", "").lower()
