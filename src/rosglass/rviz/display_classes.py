"""Classes of overlays that a ``.rviz`` file can name, by RViz's class ids."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.overlay import Overlay

__all__ = ["QML_CLASS", "REFERENCE_QML_CLASS", "class_id_of", "maker_of", "register"]

_T = TypeVar("_T", bound="type[Overlay]")
#: Class id of a QML file.
QML_CLASS = "rosglass/QmlOverlay"
#: What hector_rviz_overlay calls it.
REFERENCE_QML_CLASS = "hector_rviz_overlay_controls/QmlOverlay"
_CLASS_ID = re.compile(r"[A-Za-z_]\w*/[A-Za-z_]\w*\Z", re.ASCII)
_makers: dict[str, Callable[[str], Overlay]] = {}
_ids: dict[type[Any], str] = {}


def register(kind: _T, class_id: str = "", make: Callable[[str], Overlay] | None = None) -> _T:
    """Have overlays of a class come back from a saved ``.rviz`` file; also as a decorator.

    Do it before the file is loaded.

    Args:
        kind: The class.
        class_id: Its name in files, e.g. ``my_robot/Gauges``; the Python package and the class by
            default.
        make: Returns a new one of a name; the class itself, called with the name, by default.

    Raises:
        Error: It is no class of overlays, or the class id is taken or not valid.
    """
    from rosglass.rviz.overlay import Overlay  # noqa: PLC0415 - brings in Qt

    if not isinstance(kind, type) or not issubclass(kind, Overlay):
        raise Error(f"{kind!r:.80} is no class derived from rosglass.rviz.Overlay")
    name = class_id or _own_id(kind)
    if not _CLASS_ID.match(name):
        raise Error(f"the class id {name!r} is not of the form package/Class")
    taken = next((one for one, taken in _ids.items() if taken == name and one is not kind), None)
    if name in {QML_CLASS, REFERENCE_QML_CLASS} or taken is not None:
        whose = taken.__qualname__ if taken is not None else "QML files"
        raise Error(f"the class id {name!r} is that of {whose}; give another one")
    _makers[name] = make or (lambda overlay_name: kind(name=overlay_name))
    _ids[kind] = name
    return kind


def class_id_of(kind: type[Overlay]) -> str:
    """Return the class id of a class, registered or not."""
    return _ids.get(kind) or _own_id(kind)


def maker_of(class_id: str) -> Callable[[str], Overlay] | None:
    """Return what makes an overlay of a class id; None for ids that are not registered."""
    return _makers.get(class_id)


def _own_id(kind: type[Any]) -> str:
    package = kind.__module__.partition(".")[0]
    if package == "__main__":
        package = re.sub(r"\W", "_", Path(sys.argv[0] or "program").stem, flags=re.ASCII)
    return f"{package}/{kind.__name__}"
