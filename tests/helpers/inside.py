"""Access to the inside of nodes and elements, for tests of their parts, in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest

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


def frames_of(view: Any) -> Any:
    """Return what times the frames of a 3D view."""
    return view._frames


def renderers_of(view: Any) -> list[Any]:
    """Return what draws a 3D view: one for each window that it is in."""
    return list(frames_of(view).renderers)


def watch_frames(patch: pytest.MonkeyPatch, renderer: Any, watch: Callable[[Any], Any]) -> None:
    """Call `watch` with each frame that a renderer is about to draw."""
    take = renderer._take_frame

    def watched() -> Any:
        frame = take()
        watch(frame)
        return frame

    patch.setattr(renderer, "_take_frame", watched)


def on_device(renderer: Any) -> set[Any]:
    """Return the drawables that a renderer has uploaded."""
    return set(renderer._on_device)


def watch_uploads(patch: pytest.MonkeyPatch, renderer: Any, watch: Callable[[], Any]) -> None:
    """Call `watch` after each upload of what a frame shows."""
    prepare = renderer._prepare

    def watched(*arguments: Any) -> Any:
        found = prepare(*arguments)
        watch()
        return found

    patch.setattr(renderer, "_prepare", watched)


def device_of(renderer: Any) -> Any:
    """Return what a renderer has on the graphics device; None once it is freed."""
    return renderer._device


def image_of(item: Any) -> Any:
    """Return the image that an item shows; None without one."""
    return item._image


def root_of(runner: Any) -> Any:
    """Return the root object of the interface that a runner shows."""
    return runner._live.made.root


def runtime_of(scene: Any) -> Any:
    """Return the runtime that the elements of a scene are made with."""
    return scene._find_runtime()
