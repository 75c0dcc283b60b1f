"""ROS 2 bags (SQLite, MCAP) and ROS 1 bags, read with the ``rosbags`` package."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag1.reader import decompressors
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.rosbag2 import reader as rosbag2_reader
from rosbags.rosbag2 import storage_mcap, storage_sqlite3

from rosglass.bags.bag import Bag, BagMessage, Channel, LeftOut, decompress, parse_profile
from rosglass.comm import QoS
from rosglass.comm.handle import undo_on_error
from rosglass.comm.text_files import check_yaml, load_pyyaml, read_text
from rosglass.errors import BagError
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

__all__ = ["RosbagsBag"]

#: Size limit of a metadata.yaml in bytes.
_MAX_METADATA = 64 * 2**20
#: Disk space in bytes to leave free when a whole file is decompressed.
_MIN_FREE = 2**30
#: Bytes of it that are decompressed at a time.
_PIECE = 4 * 2**20


class RosbagsBag(Bag):
    """A ROS 2 bag's folder or file, or a ROS 1 ``.bag`` file.

    Raises:
        BagError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            _check_metadata(path / "metadata.yaml")
            _check_databases(path)
            # AnyReader refuses a whole bag for one missing or wrong definition.
            reader = Ros1Reader if path.suffix == ".bag" else Ros2Reader
            self._reader: Any = reader(path)
            with _any_encoding():
                self._reader.open()
        except BagError:
            raise
        except Exception as error:  # damaged data may raise anything in the libraries
            raise BagError(
                f"{path} cannot be read as a recording: {_describe(error)}; there are MCAP files "
                "(.mcap), ROS 2 bags (a folder with metadata.yaml, .db3) and ROS 1 bags (.bag)"
            ) from error
        self._open = True
        self._left_out = LeftOut(path, "message")
        with self._damage_reported(), undo_on_error(self.close):
            self._limit_decompression()
            self._index()

    @contextmanager
    def _damage_reported(self) -> Iterator[None]:
        """Raise errors of the package as BagError."""
        try:
            yield
        except Exception as error:  # damaged data and metadata of wrong types may raise anything
            raise BagError(f"{self.path} is damaged: {_describe(error)}") from error

    def _limit_decompression(self) -> None:
        """Decompress chunks and messages here, within the limit."""
        self._by_message = False
        if isinstance(self._reader, Ros1Reader):
            self._reader.chunks = {
                offset: chunk._replace(decompressor=partial(_chunk, offset, chunk.decompressor))
                for offset, chunk in self._reader.chunks.items()
            }
            return
        metadata = self._reader.storage.metadata
        if metadata.compression_mode == "message":
            self._by_message = True
            self._reader.storage.metadata = metadata._replace(compression_mode=None)

    def _index(self) -> None:
        wire = "ros1" if isinstance(self._reader, Ros1Reader) else "cdr"
        grouped: dict[Channel, list[Any]] = {}
        for connection in self._reader.connections:
            grouped.setdefault(_channel(connection, wire), []).append(connection)
        self._connections: dict[Channel, list[Any]] = {}
        for channel, connections in grouped.items():
            counted = replace(channel, count=sum(c.msgcount for c in connections))
            self._connections[counted] = connections
        self.channels = tuple(sorted(self._connections, key=lambda c: (c.topic, c.type_name)))
        self.start, self.end = self._reader.start_time, self._reader.end_time
        if not any(channel.count for channel in self.channels):
            self.start = self.end = 0

    def messages(
        self,
        channels: Collection[Channel] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[BagMessage]:
        """Yield messages in order of time; see :meth:`Bag.messages`."""
        owner = {
            (c.id, id(c.owner)): channel
            for channel, connections in self._connections.items()
            if channels is None or channel in channels
            for c in connections
        }
        wanted = [c for c in self._reader.connections if (c.id, id(c.owner)) in owner]
        if not wanted:
            return
        with self._damage_reported():
            for connection, time, data in self._reader.messages(wanted, start, end):
                channel, content = owner[connection.id, id(connection.owner)], bytes(data)
                if self._by_message:
                    try:
                        content = decompress("zstd", content, None)
                    except BagError as error:
                        self._left_out.add(f"of {channel.topic} at {time} ns", error)
                        self.problem = self._left_out.words()
                        continue
                yield BagMessage(channel, time, content)

    def times(self) -> Iterator[tuple[Channel, Sequence[int]]]:
        """Yield the times of all messages; see :meth:`Bag.times`."""
        if isinstance(self._reader, Ros1Reader):
            for channel, connections in self._connections.items():
                for connection in connections:
                    index = self._reader.indexes.get(connection.id, ())
                    yield channel, [entry.time for entry in index]
            return
        files = sorted(self.path.glob("*.db3")) if self.path.is_dir() else [self.path]
        if not files or any(file.suffix != ".db3" for file in files):
            yield from super().times()
            return
        named = {channel.topic: channel for channel in self.channels}
        for file in files:
            uri = f"{file.resolve().as_uri()}?immutable=1"
            # Rows are read without their messages, which are behind the times.
            with self._damage_reported(), closing(sqlite3.connect(uri, uri=True)) as database:
                rows = database.execute(
                    "SELECT topics.name, timestamp FROM messages "
                    "JOIN topics ON topics.id = messages.topic_id"
                )
                for topic, time in rows:
                    if topic in named:
                        yield named[topic], (int(time),)

    def close(self) -> None:
        """Close the files."""
        if self._open:
            self._open = False
            self._reader.close()


def _check_metadata(path: Path) -> None:
    """Raise YAMLError if a bag's metadata expands beyond the limits of :func:`check_yaml`."""
    yaml = load_pyyaml()
    if path.is_file():
        text, _ = read_text(path, _MAX_METADATA)
        check_yaml(text)
        for event in yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            # QoS profiles are YAML inside YAML.
            if isinstance(event, yaml.ScalarEvent) and "*" in event.value:
                check_yaml(event.value)


def _check_databases(path: Path) -> None:
    """Raise YAMLError if QoS profiles in a bag's SQLite files expand beyond the limits."""
    for file in path.iterdir() if path.is_dir() else [path]:
        # The rosbags package reports files that are not databases or lack this column.
        with suppress(sqlite3.Error):
            uri = f"{file.resolve().as_uri()}?immutable=1"
            with closing(sqlite3.connect(uri, uri=True)) as database:
                for (text,) in database.execute("SELECT offered_qos_profiles FROM topics"):
                    check_yaml(str(text))


def _unpack(packed: Any, file: Any) -> None:
    """Decompress a file of a ROS 2 bag into a temporary folder while the disk has room."""
    folder = Path(file.name).parent
    while piece := packed.read(_PIECE):
        if shutil.disk_usage(folder).free < _MIN_FREE + len(piece):
            raise BagError(
                f"{packed.name} holds more than {file.tell()} bytes, for which there is no room in "
                f"{folder.parent}: {_MIN_FREE} bytes stay free there; if it can be trusted to be "
                "that large, set TMPDIR to a folder on a larger disk"
            )
        file.write(piece)
    file.flush()
    _check_databases(Path(file.name))


# The package decompresses MCAP in a folder without a limit, and compares sizes afterwards.
for _kind in ("lz4", "zstd"):
    storage_mcap.DECOMPRESSORS[_kind] = partial(decompress, _kind)
# The same for files that are compressed as a whole, which it decompresses first.
rosbag2_reader.shutil = SimpleNamespace(copyfileobj=_unpack)  # type: ignore[assignment,attr-defined]


# It refuses a whole bag for a definition in another language than these.
_mcap_definition = storage_mcap.get_msgdef
_LANGUAGES = ("ros2msg", "ros2idl", "omgidl", "")
storage_mcap.get_msgdef = lambda schema: _mcap_definition(
    schema if schema is not None and schema.encoding in _LANGUAGES else None
)
_DEFINITIONS = """
CREATE TEMP VIEW message_definitions AS SELECT id, topic_type, type_description_hash,
iif(encoding = 'ros2idl', encoding, 'ros2msg') AS encoding,
iif(encoding IN ('ros2msg', 'ros2idl'), encoded_message_definition, '')
AS encoded_message_definition FROM main.message_definitions
"""


@contextmanager
def _any_encoding() -> Iterator[None]:
    """Let SQLite files have definitions in other languages, as rosbag2's "unknown"; as above."""

    def hook(connection: Any) -> None:
        connection.execute(_DEFINITIONS)

    # Earlier versions of the package do not use apsw, and refuse such files.
    apsw: Any = getattr(storage_sqlite3, "apsw", None)
    hooks: list[Any] = getattr(apsw, "connection_hooks", [])
    hooks.append(hook)
    try:
        yield
    finally:
        hooks.remove(hook)


def _chunk(offset: int, decompressor: Any, data: bytes) -> bytes:
    """Decompress a chunk of a ROS 1 bag; the package does not keep its size."""
    kinds = {known: kind for kind, known in decompressors.items()}
    try:
        return decompress(kinds[decompressor], data, None)
    except BagError as error:
        raise BagError(f"the chunk at byte {offset}: {error}") from error


def _describe(error: Exception) -> str:
    return str(error) or type(error).__name__


def _channel(connection: Any, wire: str) -> Channel:
    extra = connection.ext
    offered: tuple[QoS, ...] = ()
    if wire == "ros1":
        offered = (QoS.latched(),) if extra.latching else ()
    else:
        offered = tuple(_parse_profile(qos) for qos in extra.offered_qos_profiles)
    return Channel(
        connection.topic,
        join_name(connection.msgtype),
        wire,
        connection.msgdef.data,
        "idl" if connection.msgdef.format.name == "IDL" else "msg",
        connection.digest if wire == "ros1" or connection.digest.startswith("RIHS") else "",
        offered,
    )


def _parse_profile(qos: Any) -> QoS:
    parts = {
        key: value._asdict() if hasattr(value, "_asdict") else getattr(value, "name", value)
        for key, value in qos._asdict().items()
    }
    return parse_profile({k: v.lower() if isinstance(v, str) else v for k, v in parts.items()})
