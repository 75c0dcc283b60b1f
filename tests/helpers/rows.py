"""Rows of models, and diagnostics to fill them with."""

from __future__ import annotations

from typing import Any

DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
HOSTILE = "<b>bold</b>\x1b[31m\u202e\n" + "x" * 1_000_000


def part(name: str, level: int = 0, message: str = "", hardware: str = "", **values: str) -> Any:
    pairs = [{"key": key, "value": value} for key, value in values.items()]
    return {
        "name": name, "level": level, "message": message, "hardware_id": hardware, "values": pairs
    }  # fmt: skip


def rows_of(model: Any) -> list[dict[str, Any]]:
    """Return all rows of a model, by the names of the roles."""
    roles = {role: bytes(name.data()).decode() for role, name in model.roleNames().items()}
    return [
        {name: model.data(model.index(at, 0), role) for role, name in roles.items()}
        for at in range(model.rowCount())
    ]


def tree_rows(controls: Any, *roles: str) -> list[Any]:
    """Return a role, or several, of all rows of the tree that is shown."""
    model = controls.find("tree").property("model")
    found = []
    for row in range(model.rowCount()):
        values = [model.value(row, role) for role in roles]
        found.append(values[0] if len(roles) == 1 else tuple(values))
    return found
