#!/usr/bin/env python3
"""Describe the QML modules for editors and qmllint: ``imports*/*/plugins.qmltypes``.

With ``--write`` it writes the files; without, it prints the differences. Run it with PySide6.
"""

from __future__ import annotations

import argparse
import inspect
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.cockpit import modules as cockpit
from rosglass.controls import modules as controls
from rosglass.qml.elements import ros1, ros2
from rosglass.qml.run import modules
from rosglass.qt import QtCore
from rosglass.scene.app import modules as scene

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

FOLDER = modules.IMPORT_PATHS[0]
#: Folder of modules that need Qt 6.
FOLDER6 = FOLDER.with_name("imports6")
#: Types through which JavaScript passes any value, or gets objects whose types have no name in QML.
_ANY = {"QJSValue", "QVariant", "PyObject", "QObject*", "QJSValueList"}
#: Bases of Qt that its own descriptions leave out.
_UNNAMED = {"QQuickRhiItem"}
_HEAD = """import QtQuick.tooling 1.2

// Written by scripts/qmltypes.py from the registered types; for editors and qmllint only.

Module {
"""


def files() -> dict[Path, str]:
    """Return what the files must hold."""
    found = {FOLDER6 / "RosScene" / "plugins.qmltypes": _module("RosScene", scene.load_types())}
    found[Path(controls.__file__).parent / "imports/RosControls/plugins.qmltypes"] = _module(
        "RosControls", controls.TYPES
    )
    found[Path(cockpit.__file__).parent / "imports/RosCockpit/plugins.qmltypes"] = _module(
        "RosCockpit", cockpit.TYPES
    )
    for uri, module in (("Ros", ros1), ("Ros2", ros2)):
        found[FOLDER / uri / "plugins.qmltypes"] = _module(uri, module.TYPES)
        found[FOLDER / uri / "Native" / "plugins.qmltypes"] = _module(
            f"{uri}.Native", module.NATIVE
        )
    return found


def _module(uri: str, types: Mapping[str, type[QtCore.QObject]]) -> str:
    exports: dict[type[QtCore.QObject], list[str]] = {}
    for name, kind in types.items():
        exports.setdefault(kind, []).append(f"{uri}/{name} 1.0")
    parts = [
        _component(uri, kind, names)
        for kind, names in sorted(exports.items(), key=lambda item: sorted(item[1]))
    ]
    return f"{_HEAD}{''.join(parts)}}}\n"


def _component(uri: str, kind: type[QtCore.QObject], exports: list[str]) -> str:
    meta = kind.staticMetaObject
    base = meta
    # Bases without a name in QML, such as our own: what they have is listed with the type.
    while base.className() in _UNNAMED or not (
        hasattr(QtCore, base.className()) or base.className().startswith("QQuick")
    ):
        base = base.superClass()
    lines = [
        f'name: "{uri}.{meta.className()}"',
        'accessSemantics: "reference"',
        f'prototype: "{base.className()}"',
        f"exports: [{', '.join(f'{chr(34)}{name}{chr(34)}' for name in sorted(exports))}]",
        "exportMetaObjectRevisions: [256]",
    ]
    lines += _enums(meta, base)
    lines += sorted(_properties(meta, base))
    lines += sorted(_methods(kind, base), key=_name_of)
    body = "".join(f"        {line}\n" for line in lines)
    return f"    Component {{\n{body}    }}\n"


def _enums(meta: QtCore.QMetaObject, base: QtCore.QMetaObject) -> Iterator[str]:
    for index in range(base.enumeratorCount(), meta.enumeratorCount()):
        enum: Any = meta.enumerator(index)
        keys = ", ".join(f'"{enum.key(at)}"' for at in range(enum.keyCount()))
        flag = "isFlag: true; " if enum.isFlag() else ""
        yield f'Enum {{ name: "{enum.name()}"; {flag}values: [{keys}] }}'


def _properties(meta: QtCore.QMetaObject, base: QtCore.QMetaObject) -> Iterator[str]:
    for index in range(base.propertyCount(), meta.propertyCount()):
        item: Any = meta.property(index)
        kind, notes = item.typeName(), []
        if kind == "QObject*" and item.isWritable():
            kind = "QObject"
            notes.append("isPointer: true")
        if not item.isWritable():
            notes.append("isReadonly: true")
        if item.hasNotifySignal():
            name = bytes(item.notifySignal().name().data()).decode()
            notes.append(f'notify: "{name}"')
        elif item.isConstant():
            notes.append("isPropertyConstant: true")
        yield f'Property {{ name: "{item.name()}"; {"; ".join([_type(kind), *notes])} }}'


def _methods(kind: type[QtCore.QObject], base: QtCore.QMetaObject) -> Iterator[str]:
    meta: Any = kind.staticMetaObject
    for index in range(base.methodCount(), meta.methodCount()):
        method = meta.method(index)
        name = bytes(method.name().data()).decode()
        if name.startswith("_"):
            continue
        is_signal = method.methodType() == QtCore.QMetaMethod.MethodType.Signal
        names = [bytes(text.data()).decode() for text in method.parameterNames()]
        if not all(names):
            names = _parameter_names(kind, name, len(names))
        types = [bytes(text.data()).decode() for text in method.parameterTypes()]
        parts = [f'name: "{name}"']
        if not is_signal and method.typeName() not in ("", "void"):
            parts.append(_type(method.typeName()))
        parts.append(
            " ".join(
                f'Parameter {{ name: "{word}"; {_type(text)} }}'
                for word, text in zip(names, types, strict=True)
            )
        )
        yield f"{'Signal' if is_signal else 'Method'} {{ {'; '.join(filter(None, parts))} }}"


def _name_of(line: str) -> tuple[bool, str]:
    """Return the sorting key of a method's line: signals first, then by name."""
    return line.startswith("Method"), line.split('"', 2)[1]


def _parameter_names(kind: type[QtCore.QObject], method: str, count: int) -> list[str]:
    """Return the names that Python gives a method's parameters, for as many as there are."""
    function = getattr(kind, method, None)
    names: list[str] = []
    if inspect.isfunction(function):
        parameters = list(inspect.signature(function).parameters.values())[1:]
        names = [p.name.lstrip("_") for p in parameters if p.kind is not p.VAR_POSITIONAL]
    return [names[at] if at < len(names) else f"argument{at + 1}" for at in range(count)]


def _type(name: str) -> str:
    return f'type: "{"QVariant" if name in _ANY else name.rstrip("*")}"'


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the files")
    wanted = parser.parse_args().write
    code = 0
    for path, text in files().items():
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        if wanted:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
            print(f"wrote {path}")
        else:
            print(f"{path} is not up to date: {Path(__file__).name} --write", file=sys.stderr)
            code = 1
    return code


if __name__ == "__main__":
    sys.exit(main())
