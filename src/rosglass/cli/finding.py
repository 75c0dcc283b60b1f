"""What ``rosglass doctor`` finds."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Finding"]


@dataclass(frozen=True)
class Finding:
    """Something that was looked at.

    Attributes:
        level: ``ok``, ``note``, ``warning`` or ``error``.
        area: What was looked at.
        text: What was found.
        fix: What to do about it.
    """

    level: str
    area: str
    text: str
    fix: str = ""
