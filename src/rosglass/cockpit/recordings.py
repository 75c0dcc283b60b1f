"""Recordings that the cockpit shows instead of a robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from rosglass.bags import open_bag
from rosglass.errors import Error
from rosglass.extras import explain_missing

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

__all__ = ["SCHEME", "Examined", "examine", "is_recording", "path_of"]

#: The beginning of a recording's URL.
SCHEME = "replay:"
_SUFFIXES = (".mcap", ".bag", ".db3", ".active")


@dataclass(frozen=True)
class Examined:
    """A recording that was looked at.

    Attributes:
        url: Its URL.
        topics: Its topics, and their types.
        problem: Damage that does not prevent showing it; empty if there is none.
        error: Why it cannot be shown; empty if it can.
    """

    url: str
    topics: Mapping[str, Sequence[str]] = field(default_factory=dict)
    problem: str = ""
    error: str = ""


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Return whether a path names a recording, by its ending, or as the folder of a ROS 2 bag."""
    found = Path(path)
    return found.suffix.lower() in _SUFFIXES or (found / "metadata.yaml").is_file()


def path_of(url: str) -> Path:
    """Return the path of a recording's URL."""
    return Path(unquote(url.removeprefix(SCHEME).partition("?")[0].removeprefix("//")))


def examine(url: str) -> Examined:
    """Open a recording, and return what is in it; takes long if it has no index.

    Args:
        url: Such as ``replay:drive.mcap``.
    """
    path = path_of(url)
    try:
        bag = open_bag(path)
    except ModuleNotFoundError as error:
        return Examined(url, error=explain_missing(error) or str(error))
    except (Error, OSError) as error:
        return Examined(url, error=str(error))
    with bag:
        topics: dict[str, list[str]] = {}
        for channel in bag.channels:
            if channel.count != 0:
                topics.setdefault(channel.topic, []).append(channel.type_name)
        if not topics:
            return Examined(
                url, error=f"{path} has nothing to show: {bag.problem or 'it is empty'}"
            )
        return Examined(url, topics, f"{path}: {bag.problem}" if bag.problem else "")
