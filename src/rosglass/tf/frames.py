"""The tree of frames at one moment: who is whose parent, who says so, how often."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rosglass.comm.statistics import fading_rate
from rosglass.errors import ConnectivityException, LookupException

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rosglass.comm.time import Duration, Time

__all__ = ["FrameInfo", "FrameTree"]

_PLAIN = re.compile(r"[A-Za-z_][\w./-]*")


@dataclass(frozen=True, slots=True)
class FrameInfo:
    """What is known of a frame.

    Attributes:
        name: Its name.
        parent: The frame it is placed in; empty for the top of a tree.
        authority: Who said so last, a node's full name as a rule; empty when nobody did.
        static: Whether it never moves.
        latest: Time of the newest transform; of a static one, when it was published. None without
            a parent.
        oldest: Time of the oldest transform kept.
        count: How many transforms are kept.
        silence: Seconds since the last one came, by this machine's clock.
    """

    name: str
    parent: str = ""
    authority: str = ""
    static: bool = False
    latest: Time | None = None
    oldest: Time | None = None
    count: int = 0
    silence: float = field(default=0.0, compare=False)

    @property
    def rate(self) -> float:
        """Transforms a second, by their stamps; 0 for static frames, and once none come."""
        if self.static or self.latest is None or self.oldest is None or self.count < 2:
            return 0.0
        period = (self.latest - self.oldest).seconds / (self.count - 1)
        return fading_rate(period, self.silence)

    def age(self, now: Time) -> Duration | None:
        """Return how old the newest transform is at a time; None without a parent."""
        return None if self.latest is None else now - self.latest


class FrameTree:
    """All frames of a buffer at one moment; iterates over their names.

    Args:
        frames: The frames, each parent among them.
    """

    def __init__(self, frames: Iterable[FrameInfo]) -> None:
        self._frames = {frame.name: frame for frame in frames}

    def __iter__(self) -> Iterator[str]:
        return iter(self._frames)

    def __len__(self) -> int:
        return len(self._frames)

    def __contains__(self, name: object) -> bool:
        return name in self._frames

    def __getitem__(self, name: str) -> FrameInfo:
        try:
            return self._frames[name]
        except KeyError:
            raise LookupException(f"frame '{name}' does not exist") from None

    def roots(self) -> list[str]:
        """Return the frames without a parent; several where trees are not connected."""
        return [name for name, frame in self._frames.items() if not frame.parent]

    def children(self, name: str) -> list[str]:
        """Return the frames that are placed in one; raises LookupException."""
        parent = self[name].name
        return [other for other, frame in self._frames.items() if frame.parent == parent]

    def ancestors(self, name: str) -> list[str]:
        """Return a frame's parent, its parent's parent, and so on; raises LookupException."""
        found: list[str] = []
        frame = self[name]
        while frame.parent and frame.parent not in found:
            found.append(frame.parent)
            frame = self[frame.parent]
        return found

    def chain(self, target: str, source: str) -> list[str]:
        """Return the frames on the way from `source` to `target`, both included.

        Raises:
            LookupException: One of them does not exist.
            ConnectivityException: Nothing connects them.
        """
        up, down = [source, *self.ancestors(source)], [target, *self.ancestors(target)]
        for place, frame in enumerate(down):
            if frame in up:
                return [*up[: up.index(frame) + 1], *reversed(down[:place])]
        raise ConnectivityException(
            f"nothing connects '{target}', which belongs to '{down[-1]}', and '{source}', which "
            f"belongs to '{up[-1]}'"
        )

    def to_yaml(self, now: Time | None = None) -> str:
        """Return all frames that have a parent as tf2's ``all_frames_as_yaml()`` does.

        Args:
            now: Time to tell each frame's delay by; None to leave it out.
        """
        lines = []
        for frame in self._frames.values():
            if frame.latest is None or frame.oldest is None:
                continue
            # tf2 knows no time of static transforms, and counts 10,000 of them a second.
            static = frame.static
            latest = 0.0 if static else frame.latest.seconds
            oldest = 0.0 if static else frame.oldest.seconds
            rate = frame.count / max(latest - oldest, 0.0001)
            lines += [
                f"{_key(frame.name)}: ",
                f"  parent: {_quoted(frame.parent)}",
                f"  broadcaster: {_quoted(frame.authority or 'no recorded authority')}",
                f"  rate: {rate:.3f}",
                f"  most_recent_transform: {latest:.3f}",
                f"  oldest_transform: {oldest:.3f}",
            ]
            if now is not None:
                lines.append(f"  transform_delay: {now.seconds - latest:.3f}")
            lines.append(f"  buffer_length: {latest - oldest:.3f}")
        return "\n".join(lines) + "\n" if lines else "{}"


def _key(name: str) -> str:
    return name if _PLAIN.fullmatch(name) else json.dumps(name)


def _quoted(text: str) -> str:
    return f"'{text}'" if text.isprintable() and "'" not in text else json.dumps(text)
