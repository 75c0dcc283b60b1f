"""The findings of ``rosglass doctor``."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Finding"]


@dataclass(frozen=True)
class Finding:
    """The result of a check.

    Attributes:
        level: ``ok``, ``note``, ``warning`` or ``error``.
        area: What was checked.
        text: The result.
        fix: How to fix it.
    """

    level: str
    area: str
    text: str
    fix: str = ""
