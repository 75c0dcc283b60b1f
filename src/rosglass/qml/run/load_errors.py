"""Errors of a QML file that cannot be loaded, with what to do about them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.comm.names import similar
from rosglass.extras import install_command
from rosglass.qml.engine.log import plain_path
from rosglass.qml.run.renderer_choice import imported_folders
from rosglass.qt import QT6

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rosglass.qt import QtQml

__all__ = ["error_list"]

_MODULE = re.compile(r'module "([\w.]+)"(?: version ([\d.]+))?')
_UNVERSIONED = re.compile(r"\s*import\s+[\w.]+\s*(?:as\b|;|//|$)")
_OURS = {"Ros", "Ros2", "RosControls", "RosCockpit"}
_TYPE = re.compile(r"^(?:\w+\.)?(\w+) is not a type$")
#: Types that only one of our modules has -> the module, and the type's name in the other one.
_ONLY_IN = {
    "Subscriber": ("Ros 1.0", "Subscription"),
    "ImageTransportSubscriber": ("Ros 1.0", "ImageTransportSubscription"),
    "Subscription": ("Ros2 1.0", "Subscriber"),
    "ImageTransportSubscription": ("Ros2 1.0", "ImageTransportSubscriber"),
}
#: Import -> frequently used types that only this import provides.
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
    "RosControls 1.0": {
        *("ActionPanel", "AlarmList", "Attitude", "Battery", "CameraGrid", "CameraView", "Compass"),
        *("DiagnosticsView", "DriveKeys", "DriveStick", "EmergencyStop", "Gamepad", "GamepadView"),
        *("Gauge", "GeoMap", "JointView", "LiveFrame", "LogView", "MapView", "MessageView"),
        *(
            "ModeSwitch",
            "NodeGraph",
            "ParameterForm",
            "Plot",
            "Recorder",
            "RobotSwitch",
            "RobotTiles",
        ),
        *("ServiceButton", "Speed", "TfTree", "Timeline", "TopicTree", "TwistCommand", "WhoSteers"),
    },
}
#: Module -> the extra that installs it for Qt 6, and the command for Qt 5.
_BROUGHT_BY = {
    "QtMultimedia": ("camera", "apt install qml-module-qtmultimedia"),
    "QtQuick3D": ("camera", ""),
    "QtCharts": ("camera", "apt install qml-module-qtcharts"),
    "QtQuick.Controls": ("", "apt install qml-module-qtquick-controls2"),
    "QtQuick.Layouts": ("", "apt install qml-module-qtquick-layouts"),
    "QtQuick.Window": ("", "apt install qml-module-qtquick-window2"),
}
#: Modules that Qt 6 has removed -> their replacements.
_GONE = {
    "QtQuick.Controls.Styles": "QtQuick.Controls 2.15",
    "QtQuick.Extras": "QtQuick.Controls 2.15",
    "QtQuick.Dialogs": "QtQuick.Dialogs 6.0",
    "QtQuick.Controls": "QtQuick.Controls 2.15",
    "QtGraphicalEffects": "Qt5Compat.GraphicalEffects",
}


def error_list(
    errors: Sequence[QtQml.QQmlError], file: Path, import_paths: Sequence[str] = ()
) -> str:
    """Return errors as ``file:line:column: message``, or ``file: message``, one per line.

    Args:
        errors: The errors from Qt.
        file: The loaded file, for errors that name no file.
        import_paths: Folders with QML modules, whose types an unknown one is compared with.
    """
    lines = []
    for error in errors:
        place = plain_path(error.url().toString()) or str(file)
        text = error.description()
        hint = _advice(text) or _similar_types(text, Path(place), import_paths)
        line, column = max(error.line(), 0), max(error.column(), 0)
        if not line and "requires a version" in text:
            line, column = _unversioned(place), 1
        where = f"{place}:{line}:{column}" if line else place
        lines.append(f"{where}: {text}{f'; {hint}' if hint else ''}")
    return "\n".join(lines) or f"{file}: it could not be created"


def _unversioned(place: str) -> int:
    """Return the line of the first import without a version, or 0; Qt 5 does not report it."""
    try:
        lines = Path(place).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return 0
    return next((n for n, line in enumerate(lines, 1) if _UNVERSIONED.match(line)), 0)


def _advice(text: str) -> str:
    """Return advice for an error; empty if its text suffices."""
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
    if module == "RosScene" and not QT6:
        return "it needs Qt 6 (PySide6): run the interface with rosglass from PyPI, outside of RViz"
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
    extra, command = _BROUGHT_BY.get(module, ("", ""))
    if QT6:
        command = install_command(extra) if extra else ""
    return f"to install it: {command}" if command else hint


#: In a module's list of types for editors: what exports a type, and in its qmldir: a type's line.
_EXPORT = re.compile(r'"[\w.]+/([A-Z]\w*) ([\d.]+)"')
_LINE = re.compile(r"^(?:singleton\s+)?([A-Z]\w*)\s+[\d.]+\s+\S+\.qml", re.MULTILINE)
#: Types that come with Qt Quick, but are not in its list, in Qt 5 in no list.
_QML_TYPES = {
    "Binding",
    "Component",
    "Connections",
    "ListElement",
    "ListModel",
    "QtObject",
    "Timer",
}
#: Names that differ more in length are not compared.
_MAX_LENGTH_DIFFERENCE = 3


def _similar_types(text: str, file: Path, import_paths: Sequence[str]) -> str:
    """Return a hint at types whose names are like an unknown one; empty if there are none."""
    kind = _TYPE.search(text)
    if kind is None:
        return ""
    name = kind[1]

    def near(kinds: set[str]) -> str:
        compared = [k for k in sorted(kinds) if abs(len(k) - len(name)) <= _MAX_LENGTH_DIFFERENCE]
        return similar(name, compared).removeprefix("; ")

    found = list(imported_folders(file, import_paths))
    modules = {module for module, _, _ in found}
    known = {kind for _, version, folder in found for kind in _types_in(folder, version)}
    known |= _QML_TYPES
    for module, kinds in _IMPORTED_BY.items():
        if module.partition(" ")[0] in modules:
            known |= kinds
    # Types of other imports only if no imported one is meant.
    return near(known) or next(
        (
            f"{hint} It comes with: import {module}"
            for module, kinds in _IMPORTED_BY.items()
            if module.partition(" ")[0] not in modules and (hint := near(kinds))
        ),
        "",
    )


def _types_in(folder: Path, version: str) -> Iterator[str]:
    """Yield the names of the types that a folder, or a version of a module, has for QML files."""
    most = _numbers(version or "999")
    try:
        files = [file for file in folder.iterdir() if file.suffix in (".qml", ".qmltypes")]
        qmldir = folder / "qmldir"
        listed = qmldir.read_text(errors="replace") if qmldir.is_file() else ""
        yield from _LINE.findall(listed)
        for file in files:
            if file.suffix == ".qmltypes":
                for component in file.read_text(errors="replace").split("Component {"):
                    if "isCreatable: false" not in component:
                        exported = _EXPORT.findall(component)
                        yield from (kind for kind, since in exported if _numbers(since) <= most)
            elif not listed and file.stem[:1].isupper():
                yield file.stem
    except OSError:
        return


def _numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".") if part]
