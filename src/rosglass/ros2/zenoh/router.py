"""The old place of :mod:`rosglass.wires.zenoh.router`; gone with version 0.3."""

from __future__ import annotations

import warnings
from importlib import import_module


def __getattr__(name: str) -> object:
    warnings.warn(
        f"rosglass.ros2.zenoh.router.{name} is rosglass.wires.zenoh.router.{name} now",
        DeprecationWarning,
        stacklevel=2,
    )
    return getattr(import_module("rosglass.wires.zenoh.router"), name)
