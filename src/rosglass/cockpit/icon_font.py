"""The element ``IconFontFile``: the icon font for plugins, if it is installed."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path

from rosglass.qt import Property, QtCore

__all__ = ["IconFontFile"]

#: Font Awesome 6 Free (SIL OFL 1.1) as the package fonticon-fontawesome6 (MIT) brings it.
_PACKAGE, _PATTERN = "fonticon_fa6", "fonts/*Solid*.otf"


@cache
def _file() -> str:
    """Return the URL of the font's file; empty if it is not installed."""
    spec = importlib.util.find_spec(_PACKAGE)
    for folder in (spec.submodule_search_locations or []) if spec is not None else []:
        for file in sorted(Path(folder).glob(_PATTERN)):
            return QtCore.QUrl.fromLocalFile(str(file)).toString()
    return ""


class IconFontFile(QtCore.QObject):
    """The file of the icon font, for ``IconFont`` of RQml."""

    url = Property(str, lambda _: _file(), constant=True)
