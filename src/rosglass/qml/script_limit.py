"""For how long JavaScript may compute at a time."""

from __future__ import annotations

import math
import numbers
from typing import TYPE_CHECKING, overload

from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.qt import QtCore

__all__ = ["ScriptLimit"]


class ScriptLimit:
    """An attribute in seconds, 0 for no limit; what is set is checked.

    Args:
        seconds: As long as nothing is set.
    """

    def __init__(self, seconds: float) -> None:
        self._default = seconds

    def __set_name__(self, owner: type, name: str) -> None:
        self._name, self._key = f"{owner.__name__}.{name}", f"_{name}"

    @overload
    def __get__(self, item: None, owner: type) -> ScriptLimit: ...

    @overload
    def __get__(self, item: QtCore.QObject, owner: type) -> float: ...

    def __get__(self, item: QtCore.QObject | None, owner: type) -> ScriptLimit | float:
        if item is None:
            return self
        value: float = vars(item).get(self._key, self._default)
        return value

    def __set__(self, item: QtCore.QObject, seconds: float) -> None:
        real = isinstance(seconds, numbers.Real) and not isinstance(seconds, bool)
        if not real or not math.isfinite(seconds) or seconds < 0:
            raise Error(
                f"{self._name}: {seconds!r:.80} is not a number of seconds, 0 or more; 0 for no "
                "limit"
            )
        vars(item)[self._key] = float(seconds)
