"""MCAP recordings (https://mcap.dev/spec), read with the ``mcap`` package."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mcap.reader import NonSeekingReader, SeekingReader

from rosglass.bags.bag import Bag, BagMessage, Channel
from rosglass.bags.nearly_sorted import by_time
from rosglass.bags.qos_text import read_profiles
from rosglass.comm import QoS
from rosglass.errors import BagError, InvalidNameError
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

__all__ = ["McapBag"]

_log = logging.getLogger("rosglass.bags")
_WIRES = {"cdr": "cdr", "ros1": "ros1"}
_LANGUAGES = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl"}


class McapBag(Bag):
    """An MCAP file with ROS 1 or ROS 2 messages.

    Topics in other encodings (JSON, Protobuf) are left out, and named in :attr:`problem`.

    Raises:
        BagError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("rb")
        except OSError as error:
            raise BagError(f"{path} cannot be read: {error.strerror}") from error
        self._known: dict[int, Channel] = {}
        self._foreign: dict[str, str] = {}
        try:
            self._index()
        except BaseException:
            self._file.close()
            raise
        self._merge()
        found = set(self._known.values())
        self.channels = tuple(sorted(found, key=lambda c: (c.topic, c.type_name, c.offered != ())))
        if self._foreign:
            told = ", ".join(f"{topic} ({what})" for topic, what in sorted(self._foreign.items()))
            self._note(f"these topics are not ROS messages and are left out: {told}")

    def messages(
        self,
        channels: Collection[Channel] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[BagMessage]:
        """Yield messages in order of time; see :meth:`Bag.messages`."""
        wanted = {n: c for n, c in self._known.items() if channels is None or c in channels}
        topics = {channel.topic for channel in wanted.values()}
        if not topics:
            return
        if self._complete:
            found = self._seek(topics, start, end)
        else:
            found = by_time(self._scan())
        for number, time, data in found:
            late = end is not None and time >= end
            if number in wanted and not late and (start is None or time >= start):
                yield BagMessage(wanted[number], time, data)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _index(self) -> None:
        summary = None
        try:
            summary = SeekingReader(self._file).get_summary()
        except Exception:  # whatever the damage leads to
            self._note("it was not closed properly: its end is missing or damaged")
        complete = summary is not None and summary.statistics is not None
        self._complete = bool(complete and summary and summary.channels)
        if summary is not None and summary.statistics is not None and self._complete:
            counts = summary.statistics.channel_message_counts
            for number, channel in summary.channels.items():
                schema = summary.schemas.get(channel.schema_id)
                self._add(number, channel, schema, counts.get(number, 0))
            self.start = summary.statistics.message_start_time
            self.end = summary.statistics.message_end_time
            return
        times = [time for _, time, _ in self._scan()]
        self.start, self.end = min(times, default=0), max(times, default=0)
        if not self._known and not self._foreign and not times and not self.problem:
            self._note("it holds no messages")

    def _seek(
        self, topics: set[str], start: int | None, end: int | None
    ) -> Iterator[tuple[int, int, bytes]]:
        # A reader of its own for each pass: passes may overlap, and share the file.
        with self.path.open("rb") as file:
            try:
                found = SeekingReader(file).iter_messages(
                    topics, starting_at=start, ending_before=end
                )
                for _, channel, message in found:
                    yield channel.id, message.log_time, message.data
            except Exception as error:  # whatever the damage leads to
                raise BagError(f"{self.path} is damaged: {error}") from error

    def _scan(self) -> Iterator[tuple[int, int, bytes]]:
        """Read from the start for as far as the file goes, learning channels on the way."""
        with self.path.open("rb") as file:
            try:
                # Magic numbers and lengths are checked by the reader; a cut chunk ends it.
                for schema, channel, message in NonSeekingReader(file).iter_messages(
                    log_time_order=False
                ):
                    if channel.id not in self._known:
                        self._add(channel.id, channel, schema, -1)
                    yield channel.id, message.log_time, message.data
            except Exception as error:  # whatever the damage leads to
                if not self._known and not self._foreign:
                    raise BagError(
                        f"{self.path} is no MCAP file, or damaged at its beginning: {error}"
                    ) from error

    def _add(self, number: int, channel: Any, schema: Any, count: int) -> None:
        wire = _WIRES.get(channel.message_encoding)
        language = "" if schema is None else _LANGUAGES.get(schema.encoding, "")
        if wire is None or schema is None or (schema.encoding and not language):
            what = channel.message_encoding or "no encoding"
            if schema is not None and schema.encoding:
                what += f" described by {schema.encoding}"
            self._foreign[channel.topic] = what
            return
        try:
            name = join_name(schema.name)
        except InvalidNameError:
            self._foreign[channel.topic] = f"type {schema.name!r:.80}"
            return
        told = channel.metadata
        offered: tuple[QoS, ...]
        if wire == "ros1":
            offered = (QoS.latched(),) if told.get("latching", "") in ("1", "true") else ()
        else:
            offered = read_profiles(told.get("offered_qos_profiles", ""))
        self._known[number] = Channel(
            channel.topic,
            name,
            wire,
            schema.data.decode("utf-8", "replace"),
            language or "msg",
            told.get("md5sum" if wire == "ros1" else "topic_type_hash", ""),
            offered,
            count,
        )

    def _merge(self) -> None:
        """Make one channel of those that differ in nothing but who published."""
        groups: dict[Channel, list[int]] = {}
        for number, channel in self._known.items():
            groups.setdefault(replace(channel, count=0), []).append(number)
        for channel, numbers in groups.items():
            counts = [self._known[number].count for number in numbers]
            merged = replace(channel, count=-1 if -1 in counts else sum(counts))
            self._known.update(dict.fromkeys(numbers, merged))

    def _note(self, problem: str) -> None:
        self.problem = f"{self.problem}; {problem}" if self.problem else problem
        _log.warning("%s: %s", self.path, problem)
