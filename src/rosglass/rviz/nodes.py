"""The two nodes of an RViz with overlays: RViz's own, of roscpp, and the overlays'."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING

from rosglass.comm import anonymous_name
from rosglass.errors import InvalidNameError
from rosglass.rviz import roscpp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm.node import Node
    from rosglass.ros1.options import Ros1Options

__all__ = ["connect_beside_rviz", "name_node", "shared_arguments"]

_log = logging.getLogger("rosglass.rviz")


def name_node(name: str, options: Ros1Options) -> None:
    """Make RViz's node, unless the program has one of roscpp already.

    Args:
        name: Its name; empty for ``rviz`` with what makes it unique.
        options: Its master, and what else it is told.
    """
    # Plugins of RViz may ask for it, too.
    os.environ["ROS_MASTER_URI"] = options.master
    if not roscpp.is_initialized():
        roscpp.set_log_level(_log.getEffectiveLevel())
        roscpp.initialize(name or anonymous_name("rviz"), shared_arguments(options))


def shared_arguments(options: Ros1Options) -> list[str]:
    """Return what was told to both nodes, for each has a name of its own."""
    told = options.arguments
    words = [f"{old}:={new}" for old, new in told.rules]
    words += [f"_{key}:={value}" for key, value in told.parameters.items()]
    words += [f"__ns:={told.namespace}"] if told.namespace else []
    words += [f"__hostname:={options.address}"] if options.address else []
    return words


def connect_beside_rviz(
    url: str | None, name: str, namespace: str, arguments: Sequence[str] = ()
) -> Node:
    """Return the node of overlays, as :func:`rosglass.connect` does.

    Raises:
        InvalidNameError: It has the name of RViz's own.
    """
    from rosglass.connection import connect  # noqa: PLC0415 - not before someone connects

    full = f"{namespace.rstrip('/')}/{name}"
    if full == roscpp.node_name():
        raise InvalidNameError(
            f"{full} is RViz's own node, which the master would end for a second one of its name; "
            "give the overlays' node or RViz another name"
        )
    return connect(url, name, namespace, arguments=arguments)
