"""What is wrong with a QML file, in lines that editors understand, and what to do about it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.qml.log import plain_path
from rosglass.qt import QT6

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.qt import QtQml

__all__ = ["error_list"]

_MODULE = re.compile(r'module "([\w.]+)"(?: version ([\d.]+))?')
_UNVERSIONED = re.compile(r"\s*import\s+[\w.]+\s*(?:as\b|;|//|$)")
_OURS = {"Ros", "Ros2"}
_TYPE = re.compile(r"^(\w+) is not a type$")
#: Types that only one of our modules has -> the module, and what the other one calls it.
_ONLY_IN = {
    "Subscriber": ("Ros 1.0", "Subscription"),
    "ImageTransportSubscriber": ("Ros 1.0", "ImageTransportSubscription"),
    "Subscription": ("Ros2 1.0", "Subscriber"),
    "ImageTransportSubscription": ("Ros2 1.0", "ImageTransportSubscriber"),
}
#: Import -> types that only it has, of those that are used most.
_IMPORTED_BY = {
    "QtQuick.Controls 2.15": {
        *("ApplicationWindow", "Button", "CheckBox", "ComboBox", "Dial", "Dialog", "Drawer"),
        *("Label", "Menu", "Popup", "ProgressBar", "RoundButton", "ScrollView", "Slider"),
        *("SpinBox", "StackView", "Switch", "TabBar", "TextArea", "TextField"),
    },
    "QtQuick.Layouts 1.15": {"ColumnLayout", "GridLayout", "RowLayout", "StackLayout"},
    "QtQuick.Shapes 1.15": {"Shape", "ShapePath"},
    "QtQuick.Window 2.15": {"Window"},
    "RosRviz 1.0": {"AnchoredPopup", "MessageDialog"},
}
#: Module -> what brings it, on Qt 6 and on Qt 5.
_BROUGHT_BY = {
    "QtMultimedia": ('pip install "rosglass[camera]"', "apt install qml-module-qtmultimedia"),
    "QtQuick3D": ('pip install "rosglass[camera]"', ""),
    "QtCharts": ('pip install "rosglass[camera]"', "apt install qml-module-qtcharts"),
    "QtQuick.Controls": ("", "apt install qml-module-qtquick-controls2"),
    "QtQuick.Layouts": ("", "apt install qml-module-qtquick-layouts"),
    "QtQuick.Window": ("", "apt install qml-module-qtquick-window2"),
}
#: Modules that Qt 6 has no longer -> what to use.
_GONE = {
    "QtQuick.Controls.Styles": "QtQuick.Controls 2.15",
    "QtQuick.Extras": "QtQuick.Controls 2.15",
    "QtQuick.Dialogs": "QtQuick.Dialogs 6.0",
    "QtQuick.Controls": "QtQuick.Controls 2.15",
    "QtGraphicalEffects": "Qt5Compat.GraphicalEffects",
}


def error_list(errors: Sequence[QtQml.QQmlError], file: Path) -> str:
    """Return errors as ``file:line:column: message``, or ``file: message``, one per line.

    Args:
        errors: What Qt says.
        file: The file that was loaded, for errors that name none.
    """
    lines = []
    for error in errors:
        place = plain_path(error.url().toString()) or str(file)
        text = error.description()
        hint = _advice(text)
        line, column = max(error.line(), 0), max(error.column(), 0)
        if not line and "requires a version" in text:
            line, column = _unversioned(place), 1
        where = f"{place}:{line}:{column}" if line else place
        lines.append(f"{where}: {text}{f'; {hint}' if hint else ''}")
    return "\n".join(lines) or f"{file}: it could not be created"


def _unversioned(place: str) -> int:
    """Return the line of the first import without a version, which Qt 5 does not tell; or 0."""
    try:
        lines = Path(place).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return 0
    return next((n for n, line in enumerate(lines, 1) if _UNVERSIONED.match(line)), 0)


def _advice(text: str) -> str:
    """Return what to do about an error; empty when it says it itself."""
    if "requires a version" in text:
        return "Qt 5 needs one after the module's name: import QtQuick 2.15"
    kind = _TYPE.search(text)
    if kind is not None and kind[1] in _ONLY_IN:
        module, other = _ONLY_IN[kind[1]]
        return f"{module} has it; the other module calls it {other}"
    if kind is not None:
        imports = (module for module, kinds in _IMPORTED_BY.items() if kind[1] in kinds)
        return next((f"it comes with: import {module}" for module in imports), "")
    found = _MODULE.search(text)
    if found is None:
        return ""
    module, version = found[1], found[2]
    if module in _OURS:
        return f"its version is 1.0: import {module} 1.0"
    for ours in _OURS:
        if module.lower() == ours.lower():
            return f"it is written {ours}: import {ours} 1.0"
    if QT6 and module in _GONE:
        return f"Qt 6 has {_GONE[module]} instead"
    if version and "is not installed" in text and module.startswith("Qt"):
        hint = "this Qt may have another version of it"
    else:
        hint = "folders that hold modules are named with -I FOLDER or in QML_IMPORT_PATH"
    package = _BROUGHT_BY.get(module, ("", ""))[0 if QT6 else 1]
    return f"to install it: {package}" if package else hint
