"""The core of a ROS 1 node: what TCPROS needs, its types, and names that may be remapped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.ros1.announced_types import AnnouncedTypes
from rosglass.ros1.names import expand
from rosglass.wires.tcpros.core import TcprosCore

if TYPE_CHECKING:
    from rosglass.comm import NodeName
    from rosglass.interfaces import Library
    from rosglass.ros1.options import Ros1Options

__all__ = ["Core"]


class Core(TcprosCore):
    """Holds what a node consists of, and resolves its names.

    Args:
        name: The node's name.
        url: What it was connected with, for people to read.
        options: Master, own address, remappings.
        library: Where definitions come from; None for the shared library.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    types: AnnouncedTypes

    def __init__(
        self, name: NodeName, url: str, options: Ros1Options, library: Library | None
    ) -> None:
        super().__init__(name, url, options, AnnouncedTypes(library, url))
        self._new_names = options.arguments.remappings(name.name, name.namespace)

    def resolve(self, name: str, kind: str = "topic") -> str:  # noqa: ARG002 - one rule for all
        """Return the absolute name of a topic, service or parameter, which may be remapped.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        full = self.expand(name)
        return self._new_names.get(full, full)

    def expand(self, name: str) -> str:
        """Return the absolute name of anything, not remapped; raises InvalidNameError."""
        return expand(name, self.name.name, self.name.namespace)
