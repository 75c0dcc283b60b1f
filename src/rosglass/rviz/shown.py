"""Values in messages, as who has written them in QML or in Python knows them."""

from __future__ import annotations

import math

from rosglass.qt import QtCore, QtGui

__all__ = ["shown"]

_LONGEST, _DEEPEST = 80, 4


def shown(value: object) -> str:
    """Return a value as JavaScript writes it, in one line of at most 80 characters."""
    text = _text(value, 0)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def _text(value: object, depth: int) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, (dict, list, tuple)) and depth >= _DEEPEST:
        return "..."
    if isinstance(value, dict):
        # No more of it than can be shown.
        parts = [f"{key}: {_text(value[key], depth + 1)}" for key in list(value)[:_LONGEST]]
        return f"{{{', '.join(parts)}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_text(item, depth + 1) for item in value[:_LONGEST])}]"
    if isinstance(value, QtGui.QColor):
        return str(value.name())
    if isinstance(value, QtCore.QObject):
        return str(getattr(value, "CALLED", "") or value.metaObject().className())
    return repr(value)
