"""Options that are either on or off."""

from __future__ import annotations

from rosglass.errors import ArgumentError

__all__ = ["check_flag"]


def check_flag(value: object, name: str, where: str = "") -> bool:
    """Return an option that is True or False; raises ArgumentError.

    Python takes any text for true, "no" and "false" included.
    """
    if value is not True and value is not False:
        raise ArgumentError(name, value, "True or False", where)
    return value
