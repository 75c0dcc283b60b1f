"""Access to the inside of nodes and elements, for tests of their parts, in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosglass.comm import Node


def core_of(node: Node) -> Any:
    """Return what everything that was created from a node shares."""
    return node._core


def endpoint_of(element: Any) -> Any:
    """Return the endpoint of an element, a display or a tool; None while there is none."""
    return element._endpoint


def queue_of(display: Any) -> Any:
    """Return the queue of the messages that a display receives."""
    return display._queue


def waiting_of(display: Any) -> Any:
    """Return the messages of a display that wait for their transforms."""
    return display._waiting


def renderers_of(view: Any) -> list[Any]:
    """Return what draws a 3D view: one for each window that it is in."""
    return list(view._frames.renderers)


def device_of(renderer: Any) -> Any:
    """Return what a renderer has on the graphics device; None once it is freed."""
    return renderer._device


def image_of(item: Any) -> Any:
    """Return the image that an item shows; None without one."""
    return item._image


def runtime_of(scene: Any) -> Any:
    """Return the runtime that the elements of a scene are made with."""
    return scene._find_runtime()


def ask_again_after(scene: Any, seconds: float | None = None) -> float:
    """Return after how long a robot is asked again for a file; set it to `seconds`."""
    if seconds is not None:
        scene._ask_again_s = seconds
    delay: float = scene._ask_again_s
    return delay
