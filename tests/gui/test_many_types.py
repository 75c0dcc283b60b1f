"""More QML types than PySide2 registers by itself."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.both_qt


def test_more_types_than_pyside2_registers(bench: Any) -> None:
    from rosglass.qml.engine.properties import Writable
    from rosglass.qml.run.modules import register_class
    from rosglass.qt import QtCore, Signal, Slot, send_deferred_deletes

    gone = []
    for at in range(60):

        class Kind(QtCore.QObject):
            number = at
            rang = Signal(int, arguments=["number"])
            text = Writable(str, "new", then="ring")

            def __init__(self, parent: Any = None) -> None:
                super().__init__(parent)
                number = self.number
                self.destroyed.connect(lambda *_: gone.append(number))

            @Slot()
            def ring(self) -> None:
                self.rang.emit(self.number)

        register_class(Kind, "ManyTypes", f"Kind{at}")
    parts = "".join(f"Kind{at} {{ onRang: root.all.push(number) }}\n" for at in range(60))
    root: Any = bench.load(
        "Item { id: root; property var all: []; function go() { "
        "Array.from(resources).forEach(part => part.text = 'set'); return JSON.stringify(all) }\n"
        "function texts() { return Array.from(resources).map(part => part.text).join() }\n"
        f"{parts} }}",
        "import QtQuick 2.15\nimport ManyTypes 1.0",
    )
    assert root.texts() == ",".join(["new"] * 60)
    assert root.go() == str(list(range(60))).replace(" ", "")
    assert root.texts() == ",".join(["set"] * 60)
    root.deleteLater()
    send_deferred_deletes()
    assert sorted(gone) == list(range(60))


def test_type_that_is_registered_late_leaves_lists_as_they_are(bench: Any) -> None:
    """In PySide2, lists of objects would take the last class only."""
    from rosglass.qml.run.modules import register_class
    from rosglass.qt import QtCore

    class Late(QtCore.QObject):
        pass

    bench.load("Item { Rectangle {} }", "import QtQuick 2.15")
    register_class(Late, "LateTypes", "Late")
    bench.load("Item { Rectangle {} Late {} }", "import QtQuick 2.15\nimport LateTypes 1.0")
