"""Messages to JavaScript and back, for tests of values."""

from __future__ import annotations

import json
from typing import Any

import rosglass


def show(
    bench: Any, type_name: str, value: dict, script: str, *, module: int = 2, ros: int = 2
) -> Any:
    """Return what a script makes of a received message called `m`.

    `module` is the QML module whose value it is, `ros` what the robot speaks.
    """
    from rosglass.qml.engine.dialect import Dialect
    from rosglass.qml.engine.runtime import runtime_of

    kind = rosglass.load(type_name, ros=ros)
    message = kind.decode(kind.encode(value))
    runtime = runtime_of(bench.engine)
    function = bench.engine.evaluate(f"(function(m) {{ return JSON.stringify({script}) }})")
    dialect = Dialect.ROS1 if module == 1 else Dialect.ROS2
    result = function.call([runtime.message(message, dialect)])
    assert not result.isError(), result.toString()
    return None if result.isUndefined() else json.loads(result.toString())


def convert(bench: Any, type_name: str, script: str, *, module: int = 2, ros: int = 2) -> dict:
    """Return the message that a JavaScript expression makes, as a dict."""
    # Qt.vector3d() and its like need QtQuick.
    bench.load("Item {}", "import QtQuick 2.15")
    value = bench.engine.evaluate(f"({script})")
    assert not value.isError(), value.toString()
    return converted(value, type_name, module=module, ros=ros)


def converted(value: Any, type_name: Any, *, module: int = 2, ros: int = 2) -> dict:
    """Return the message that a JavaScript value is, as a dict; of a type, or of its name."""
    from rosglass.qml.engine.dialect import Dialect
    from rosglass.qml.engine.from_js import fields_from_js

    kind = rosglass.load(type_name, ros=ros) if isinstance(type_name, str) else type_name
    dialect = Dialect.ROS1 if module == 1 else Dialect.ROS2
    fields = fields_from_js(value, kind, dialect=dialect)
    return kind.decode(kind.encode(fields)).to_dict()


def caught(bench: Any, script: str, imports: str = "") -> str:
    """Return what an error says that a script throws."""
    text = bench.run(f"try {{ {script} }} catch (e) {{ return String(e) }}", imports)
    assert text is not None, "nothing was thrown"
    return text
