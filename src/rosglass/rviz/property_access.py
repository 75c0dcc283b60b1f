"""Reading and changing any property in RViz's Displays panel, by its path."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qt import QtGui
from rosglass.rviz.host import pyqt
from rosglass.rviz.shown import shown
from rosglass.rviz.watch import class_of, is_a

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["children", "describe", "find", "read", "write"]

_LONGEST = 10_000
_INT32 = (-(2**31), 2**31 - 1)
#: What RViz keeps as text with its parts between semicolons, and the names of the parts.
_PARTS = {"rviz::VectorProperty": "xyz", "rviz::QuaternionProperty": "xyzw"}
_COLOUR = "rviz::ColorProperty"
#: What tells how a display is, and cannot be changed.
_STATUS = ("rviz::StatusList", "rviz::StatusProperty")


def children(item: Any) -> Iterator[Any]:
    """Iterate over the properties below one, without displays and their status."""
    for index in range(item.numChildren()):
        child = item.childAt(index)
        if class_of(child) not in _STATUS and not is_a(child, "rviz::Display"):
            yield child


def find(item: Any, path: str | Sequence[str], whose: str = "") -> Any:
    """Return a property below another one.

    Args:
        item: The upper one.
        path: Names with slashes between them, e.g. ``Offset/X``, or a list of names.
        whose: Name of `item`, for the error.

    Raises:
        Error: There is none of this path; the error says which there are.
    """
    names = path if isinstance(path, str) else "/".join(map(str, path))
    found = _below(item, names)
    if found is None:
        head = names.partition("/")[0]
        known = [str(child.getName()) for child in children(item)]
        upper = next((c for c in children(item) if str(c.getName()) == head), None)
        if upper is not None and "/" in names:
            known = [f"{head}/{child.getName()}" for child in children(upper)]
        hint = similar(names, known) or f"; there are: {', '.join(known) or 'none'}"
        raise Error(f"{whose or item.getName()} has no property {names!r:.120}{hint}")
    return found


def _below(item: Any, path: str) -> Any:
    # Names of topics and links have slashes of their own.
    for child in children(item):
        name = str(child.getName())
        if path == name:
            return child
        if path.startswith(f"{name}/"):
            found = _below(child, path[len(name) + 1 :])
            if found is not None:
                return found
    return None


def read(item: Any) -> Any:
    """Return the value of a property.

    Returns:
        Bool, int, float or text; colours as ``#rrggbb``, vectors and quaternions as dicts of x, y,
        z and w, in RViz's order; None where it only holds others.
    """
    value, kind = item.getValue(), class_of(item)
    if kind == _COLOUR:
        parts = _split(value)
        return "#{:02x}{:02x}{:02x}".format(*map(int, parts)) if len(parts) == 3 else str(value)
    if kind in _PARTS:
        return dict(zip(_PARTS[kind], _split(value), strict=False))
    if isinstance(value, bool) or value is None:
        return value
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        # RViz keeps 32 bits of each; these are the fewest digits that mean the same.
        return float(str(np.float32(value)))
    return str(value)


def write(item: Any, value: Any, name: str = "") -> None:
    """Change a property, as if it were done in the panel.

    Args:
        item: The property.
        value: As :func:`read` gives it; colours also as ``QColor`` or by name, vectors as lists.
        name: What to call it in errors.

    Raises:
        Error: It cannot be changed, or holds no such value, or RViz keeps another one.
    """
    name = name or str(item.getName())
    kind = class_of(item)
    if item.getReadOnly() or kind in _STATUS:
        raise Error(f"{name} cannot be changed; it is {read(item)!r}")
    wanted, given = _convert(item, kind, value, name)
    if item.getValue() == given:
        return
    item.setValue(given)
    now = read(item)
    if not _same(now, wanted):
        raise Error(f"{name}: RViz does not take {shown(value)}, and has made it {shown(now)}")


def describe(item: Any, path: str = "") -> list[dict[str, Any]]:
    """Return the properties below one as dicts.

    Args:
        item: The upper one.
        path: Where it is; empty at the top.

    Returns:
        Of each `name`, `path` (for :func:`find`), `value`, `kind`, `description`, `readOnly`,
        `hidden` and `properties`, those below it.
    """
    found = []
    for child in children(item):
        name = str(child.getName())
        here = f"{path}/{name}" if path else name
        found.append(
            {
                "name": name,
                "path": here,
                "value": read(child),
                "kind": _kind(child),
                "description": " ".join(str(child.getDescription()).split()),
                "readOnly": bool(child.getReadOnly()),
                "hidden": bool(child.getHidden()),
                "properties": describe(child, here),
            }
        )
    return found


def _kind(item: Any) -> str:
    """Return a word for what a property holds: ``bool``, ``int``, ``float``, ``color``, ..."""
    kind = class_of(item).removeprefix("rviz::").removesuffix("Property").lower()
    if kind:
        return {"rostopic": "topic", "tfframe": "frame"}.get(kind, kind)
    value = item.getValue()
    names = {bool: "bool", int: "int", float: "float", str: "string"}
    return names.get(type(value), "container")


def _convert(item: Any, kind: str, value: Any, name: str) -> tuple[Any, Any]:
    """Return a value as :func:`read` would give it, and as RViz takes it."""
    if kind == _COLOUR:
        return _colour(value, name)
    if kind in _PARTS:
        return _vector(value, _PARTS[kind], name)
    now = item.getValue()
    if now is None:
        raise Error(f"{name} has no value of its own, only properties below it")
    if isinstance(now, bool):
        if not isinstance(value, bool):
            raise Error(f"{name}: expected true or false, got {shown(value)}")
        return value, value
    if isinstance(now, (int, float)):
        number = _number(value, name)
        if isinstance(now, int):
            if number != int(number) or not _INT32[0] <= number <= _INT32[1]:
                raise Error(f"{name}: expected a whole number of 32 bits, got {shown(value)}")
            return int(number), int(number)
        return number, number
    choices = _choices(item) if kind == "rviz::EnumProperty" else []
    if choices and value not in choices:
        raise Error(f"{name}: expected one of {', '.join(choices)}, got {shown(value)}")
    if not isinstance(value, str) or len(value) > _LONGEST or not value.isprintable():
        raise Error(f"{name}: expected a text of one line, got {shown(value)}")
    return value, value


def _choices(item: Any) -> list[str]:
    """Return what can be chosen, which only the property's editor knows."""
    widgets = pyqt("QtWidgets")
    host = widgets.QWidget()
    editor = item.createEditor(host, widgets.QStyleOptionViewItem())
    found = isinstance(editor, widgets.QComboBox)
    names = [str(editor.itemText(at)) for at in range(editor.count())] if found else []
    host.deleteLater()
    return names


def _number(value: Any, name: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        # Ogre ends the process at a place that is no number.
        with np.errstate(over="ignore"):
            if math.isfinite(value) and np.isfinite(np.float32(value)):
                return float(value)
    raise Error(f"{name}: expected a finite number, got {shown(value)}")


def _colour(value: Any, name: str) -> tuple[str, str]:
    parts = _split(value) if isinstance(value, str) and value.count(";") == 2 else []
    if len(parts) == 3 and all(0 <= part <= 255 and part == int(part) for part in parts):
        value = QtGui.QColor(*map(int, parts))
    colour = QtGui.QColor(value) if isinstance(value, (str, QtGui.QColor)) else QtGui.QColor()
    if not colour.isValid():
        raise Error(f"{name}: expected a colour, e.g. '#ff8800' or 'orange', got {shown(value)}")
    if colour.alpha() != 255:
        raise Error(f"{name}: RViz keeps no transparency with a colour; set the property Alpha")
    plain = (colour.red(), colour.green(), colour.blue())
    return "#{:02x}{:02x}{:02x}".format(*plain), "; ".join(map(str, plain))


def _vector(value: Any, names: str, name: str) -> tuple[dict[str, float], str]:
    if isinstance(value, (list, tuple)) and len(value) == len(names):
        value = dict(zip(names, value, strict=True))
    if not isinstance(value, dict) or set(value) != set(names):
        example = shown({part: int(part == "w") for part in names})
        raise Error(f"{name}: expected {', '.join(names)}, e.g. {example}, got {shown(value)}")
    parts = {part: _number(value[part], f"{name}/{part.upper()}") for part in names}
    return parts, "; ".join(f"{number:.9g}" for number in parts.values())


def _split(value: Any) -> list[float]:
    try:
        return [float(part) for part in str(value).split(";")]
    except ValueError:
        return []


def _same(now: Any, wanted: Any) -> bool:
    if isinstance(wanted, dict):
        return isinstance(now, dict) and all(_same(now.get(key), wanted[key]) for key in wanted)
    if isinstance(wanted, float) and isinstance(now, (int, float)):
        return math.isclose(now, wanted, rel_tol=1e-5, abs_tol=1e-6)
    return bool(now == wanted)
