"""A node's logger: one of Python's, whose messages other nodes can follow, too."""

from __future__ import annotations

import logging

from rosglass.comm.rclpy_names import hint_at_members

__all__ = ["NodeLogger"]


@hint_at_members
class NodeLogger(logging.Logger):
    """A node's logger, or a child of it.

    A :class:`logging.Logger` like any other, except that :func:`logging.getLogger` does not know
    it: several nodes in one process, in one graph or in several, may bear the same name. It starts
    with level INFO, as ROS's loggers do, and hands its messages on to Python's root logger.

    Args:
        name: Its name.
        parent: Where its messages go, too.
        levels: Least severe levels of it and its children, by name.
    """

    def __init__(
        self, name: str, parent: logging.Logger, levels: dict[str, int] | None = None
    ) -> None:
        self._levels = {} if levels is None else levels
        super().__init__(name, self._levels.get(name, logging.NOTSET))
        self.parent = parent
        self._children: dict[str, NodeLogger] = {}

    def getChild(self, suffix: str) -> NodeLogger:  # noqa: N802 - logging's spelling
        """Return the logger ``<name>.<suffix>``, whose messages go where this one's go."""
        first, _, rest = suffix.partition(".")
        child = self._children.get(first)
        if child is None:
            made = NodeLogger(f"{self.name}.{first}", self, self._levels)
            child = self._children.setdefault(first, made)
        return child.getChild(rest) if rest else child

    def family(self) -> list[NodeLogger]:
        """Return it and all loggers below it that were asked for, sorted by name."""
        found = [self]
        for _, child in sorted(self._children.copy().items()):
            found += child.family()
        return found

    def isEnabledFor(self, level: int) -> bool:  # noqa: N802 - logging's spelling
        """Return whether messages of `level` pass."""
        # Asked anew each time: logging only clears the caches of loggers that it knows.
        if self.disabled or self.manager.disable >= level:
            return False
        return level >= self.getEffectiveLevel()
