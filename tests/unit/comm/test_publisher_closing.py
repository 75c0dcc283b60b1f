"""A publisher whose node is closed while it is created."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

import rosglass
from rosglass.wires.local import LocalMiddleware

if TYPE_CHECKING:
    from collections.abc import Callable


def test_creation_fails_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    node = rosglass.connect("local://closing", own_services=False)
    create: Callable[..., Any] = LocalMiddleware.create_writer

    def create_then_close(*arguments: Any) -> Any:
        made = create(*arguments)
        node.close()
        return made

    monkeypatch.setattr(LocalMiddleware, "create_writer", create_then_close)
    with pytest.raises(rosglass.NodeClosedError):
        node.create_publisher("/chatter", "std_msgs/msg/String")
