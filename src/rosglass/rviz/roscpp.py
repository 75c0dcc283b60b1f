"""RViz's roscpp node, initialized before RViz would do it, and the overlays' own node.

RViz would initialize roscpp with a random node name and a Ctrl-C handler that replaces Python's; it
does not if roscpp is initialized already. roscpp has no Python bindings, so this module calls its
C++ functions by their mangled names (Itanium C++ ABI, libstdc++'s ``std::string``;
https://docs.ros.org/en/noetic/api/roscpp/html/init_8h.html).
"""

from __future__ import annotations

import ctypes
import logging
import os
from typing import TYPE_CHECKING

from rosglass.comm import anonymous_name
from rosglass.connection import connect
from rosglass.errors import InvalidNameError
from rosglass.rviz.host import cpp_function

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm.node import Node
    from rosglass.ros1.options import Ros1Options

__all__ = [
    "connect_beside_rviz",
    "initialize",
    "is_initialized",
    "is_running",
    "name_node",
    "node_name",
    "set_log_level",
    "shared_arguments",
    "shut_down",
]


_STRING = "NSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEE"
_INIT = f"_ZN3ros4initERiPPcRK{_STRING}j"
_SET_LEVEL = f"_ZN3ros7console16set_logger_levelERK{_STRING}NS0_6levels5LevelE"
#: ros/init.h, "init_options".
_NO_SIGINT_HANDLER = 1
#: Python's levels and ros/console.h, "levels".
_LEVELS = ((logging.DEBUG, 0), (logging.INFO, 1), (logging.WARNING, 2), (logging.ERROR, 3))
_FATAL = 4


class _String(ctypes.Structure):
    """A ``std::string``."""

    _fields_ = (
        ("data", ctypes.c_char_p),
        ("size", ctypes.c_size_t),
        ("local", ctypes.c_char * 16),
    )


def _string(text: str) -> _String:
    data = text.encode()
    return _String(data, len(data))


def is_initialized() -> bool:
    """Return whether roscpp is initialized in this process."""
    return bool(cpp_function("libroscpp", "_ZN3ros13isInitializedEv", ctypes.c_bool)())


def is_running() -> bool:
    """Return whether the roscpp node is running; e.g. another node of its name shuts it down."""
    return bool(cpp_function("libroscpp", "_ZN3ros2okEv", ctypes.c_bool)())


def initialize(name: str, arguments: Sequence[str]) -> None:
    """Initialize RViz's node, without a request to the master.

    roscpp ends the process if an argument is invalid.

    Args:
        name: Base name of the node.
        arguments: Remapping arguments such as ``old:=new`` and ``__ns:=...``.
    """
    words = [b"rviz", *(argument.encode() for argument in arguments)]
    argv = (ctypes.c_char_p * (len(words) + 1))(*words)
    count = ctypes.c_int(len(words))
    init = cpp_function("libroscpp", _INIT)
    init(ctypes.byref(count), argv, ctypes.byref(_string(name)), _NO_SIGINT_HANDLER)


def node_name() -> str:
    """Return the full name of RViz's node."""
    get = cpp_function("libroscpp", "_ZN3ros9this_node7getNameB5cxx11Ev", ctypes.POINTER(_String))
    return str(get().contents.data.decode())


def set_log_level(level: int) -> None:
    """Set RViz's log level to a level of Python's logging."""
    cpp_function("librosconsole", "_ZN3ros7console10initializeEv")()
    set_level = cpp_function("librosconsole", _SET_LEVEL)
    cpp_level = next((ours for theirs, ours in _LEVELS if level <= theirs), _FATAL)
    set_level(ctypes.byref(_string("ros")), cpp_level)
    cpp_function("librosconsole", "_ZN3ros7console25notifyLoggerLevelsChangedEv")()


def shut_down() -> None:
    """Shut RViz's node down, which unregisters it from the master."""
    cpp_function("libroscpp", "_ZN3ros8shutdownEv")()


_log = logging.getLogger("rosglass.rviz")


def name_node(name: str, options: Ros1Options) -> None:
    """Initialize RViz's node, unless the program has initialized roscpp.

    Args:
        name: Its name; empty for ``rviz`` with a unique suffix.
        options: Its master and remappings.
    """
    # RViz's plugins may read it, too.
    os.environ["ROS_MASTER_URI"] = options.master
    if not is_initialized():
        set_log_level(_log.getEffectiveLevel())
        initialize(name or anonymous_name("rviz"), shared_arguments(options))


def shared_arguments(options: Ros1Options) -> list[str]:
    """Return the remapping arguments of both nodes, without the name."""
    remappings = options.arguments
    words = [f"{old}:={new}" for old, new in remappings.rules]
    words += [f"_{key}:={value}" for key, value in remappings.parameters.items()]
    words += [f"__ns:={remappings.namespace}"] if remappings.namespace else []
    words += [f"__hostname:={options.address}"] if options.address else []
    return words


def connect_beside_rviz(
    url: str | None, name: str, namespace: str, arguments: Sequence[str] = ()
) -> Node:
    """Return the overlays' node; like :func:`rosglass.connect`.

    Raises:
        InvalidNameError: The name is that of RViz's own node.
    """
    full = f"{namespace.rstrip('/')}/{name}"
    if full == node_name():
        raise InvalidNameError(
            f"{full} is RViz's own node, which a second node of its name would shut down; "
            "give the overlays' node or RViz another name"
        )
    return connect(url, name, namespace, arguments=arguments)
