"""The message sets of the ROS distributions, as rosbags ships them, and common services.

The bundles in ``distributions/`` are written from rosbags by ``scripts/bundle_definitions.py``
(importing rosbags itself takes far longer than a GUI may spend on its first message). rosbags has
messages only; ``definitions/`` holds services, actions and a few more messages of common packages.
"""

# pathlib takes longer to import than the first definition to load.
# ruff: noqa: PTH118, PTH120, PTH123, PTH208

from __future__ import annotations

import os
import re
from functools import lru_cache
from os.path import dirname, join
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import UnsupportedError
from rosglass.interfaces.folders import find_in_package, list_package
from rosglass.interfaces.parser import parse_message
from rosglass.interfaces.provider import Provider

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["DISTRIBUTIONS", "Distributions"]

#: Known distributions by ROS version, in the order in which a type is looked for.
DISTRIBUTIONS: dict[int, tuple[str, ...]] = {
    1: ("noetic",),
    2: ("jazzy", "kilted", "lyrical", "iron", "humble", "galactic", "foxy", "eloquent", "dashing"),
}

_HERE = dirname(__file__)
_BLOCK = re.compile(r"^=== (\S+)(.*)\n", re.MULTILINE)


class _Block(NamedTuple):
    distributions: tuple[str, ...]
    start: int
    end: int


@lru_cache(maxsize=2)
def _bundle(ros: int) -> tuple[str, Mapping[str, tuple[_Block, ...]]]:
    with open(join(_HERE, "distributions", f"ros{ros}.txt"), encoding="utf-8") as file:
        text = file.read()
    heads = list(_BLOCK.finditer(text))
    blocks: dict[str, tuple[_Block, ...]] = {}
    for index, head in enumerate(heads):
        end = heads[index + 1].start() if index + 1 < len(heads) else len(text)
        distributions = tuple(head.group(2).split()) or DISTRIBUTIONS[ros]
        name = head.group(1)
        blocks[name] = (*blocks.get(name, ()), _Block(distributions, head.end(), end))
    return text, blocks


class Distributions(Provider):
    """The distributions' definitions, those of the preferred distribution first.

    Args:
        preferred: A distribution's name; by default the environment's ``ROS_DISTRO`` if it is a
            known one, else Jazzy (ROS 2) and Noetic (ROS 1).

    Raises:
        UnsupportedError: `preferred` is not a known distribution.
    """

    name = "distribution"

    def __init__(self, preferred: str = "") -> None:
        known = [name for names in DISTRIBUTIONS.values() for name in names]
        if preferred and preferred not in known:
            raise UnsupportedError(
                f"there are no definitions of a distribution {preferred!r}; known: "
                f"{', '.join(known)}. Add a folder with its definitions by Library.add_path()"
            )
        self._preferred = preferred or os.environ.get("ROS_DISTRO", "")

    def order(self, ros: int) -> tuple[str, ...]:
        """Return the distributions in the order in which they are asked."""
        names = DISTRIBUTIONS[ros]
        if self._preferred not in names:
            return names
        return (self._preferred, *(name for name in names if name != self._preferred))

    def find(self, name: str, ros: int) -> Sequence[InterfaceDefinition]:
        """Return the definitions of all distributions, the preferred one's first."""
        text, blocks = _bundle(ros)
        found: list[InterfaceDefinition] = []
        seen: set[int] = set()
        variants = blocks.get(name, ())
        for distribution in self.order(ros) if variants else ():
            for block in variants:
                if distribution in block.distributions and block.start not in seen:
                    seen.add(block.start)
                    found.append(
                        parse_message(
                            text[block.start : block.end].rstrip("\n"),
                            name,
                            ros=ros,
                            file=f"<{name} of {distribution}>",
                            provider=f"rosbags {distribution}",
                        )
                    )
        if found:
            return found
        package = name.partition("/")[0]
        extra = find_in_package(
            join(_HERE, "definitions", f"ros{ros}", package), name, ros, "rosglass definitions"
        )
        return () if extra is None else (extra,)

    def names(self, ros: int) -> Iterable[str]:
        """Return the full names of all types of all distributions."""
        yield from _bundle(ros)[1]
        folder = join(_HERE, "definitions", f"ros{ros}")
        for package in sorted(os.listdir(folder)):
            yield from list_package(join(folder, package), package, ros)

    def describe(self, ros: int) -> str:
        """Name the distributions."""
        return f"{self.name} sets ({', '.join(self.order(ros))})"

    def views(self, ros: int) -> Iterator[Provider]:
        """Yield the sets of one distribution after the other."""
        for distribution in self.order(ros):
            yield Distributions(distribution)
