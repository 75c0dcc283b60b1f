"""Telling who wants to know that transforms came: of two frames, of the tree, or any."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm.executor import check_plain
from rosglass.comm.listeners import Listeners
from rosglass.comm.node import Executor, Handle

if TYPE_CHECKING:
    from collections.abc import Callable
    from collections.abc import Set as AbstractSet

__all__ = ["Changes"]


class Changes:
    """Who wants to know of a buffer's changes.

    Args:
        links: Returns the frames whose transforms connect a target and a source; None when
            nothing does.
    """

    def __init__(self, links: Callable[[str, str], frozenset[str] | None]) -> None:
        self._links = links
        self._lock = threading.Lock()
        self._pairs: list[_Pair] = []
        self._any: Listeners[None] = Listeners(merge=True, where="transforms")
        self._tree: Listeners[None] = Listeners(merge=True, where="the tree of frames")

    def on_any(self, callback: Callable[[], None], executor: Executor) -> Handle:
        """Call back after any transform came."""
        return self._any.add(_ignoring(callback), executor)

    def on_tree(self, callback: Callable[[], None], executor: Executor) -> Handle:
        """Call back after the tree changed."""
        return self._tree.add(_ignoring(callback), executor)

    def on_pair(
        self, target: str, source: str, callback: Callable[[], None], executor: Executor
    ) -> Handle:
        """Call back after a transform came that lies between two frames."""
        pair = _Pair(self, target, source)
        pair.listeners.add(_ignoring(callback), executor)
        pair.links = self._links(target, source)
        with self._lock:
            self._pairs.append(pair)
        # What connected them meanwhile was not told.
        pair.links = self._links(target, source)
        return pair

    def tell(self, changed: AbstractSet[str], tree: bool) -> None:
        """Tell everybody; from any thread, without a lock held.

        Args:
            changed: The frames that a transform came for.
            tree: Whether frames came, went, or have another parent.
        """
        self._any.notify(None)
        if tree:
            self._tree.notify(None)
        if not self._pairs:
            return
        with self._lock:
            pairs = list(self._pairs)
        for pair in pairs:
            before = pair.links
            if tree:
                pair.links = self._links(pair.target, pair.source)
            if before != pair.links or (before is not None and not changed.isdisjoint(before)):
                pair.listeners.notify(None)

    def forget(self, pair: _Pair) -> None:
        """Let go of who wants to know no more."""
        with self._lock:
            if pair in self._pairs:
                self._pairs.remove(pair)


class _Pair(Handle):
    def __init__(self, owner: Changes, target: str, source: str) -> None:
        self._owner = owner
        self.target, self.source = target, source
        self.listeners: Listeners[None] = Listeners(merge=True, where=f"{target} <- {source}")
        self.links: frozenset[str] | None = None

    def close(self) -> None:
        self._owner.forget(self)
        self.listeners.clear()


def _ignoring(callback: Callable[[], None]) -> Callable[[None], None]:
    check_plain(callback, "transforms")
    return lambda _: callback()
