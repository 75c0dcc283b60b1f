"""Recordings of types that are defined in IDL: readable again, by others as well."""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Any

import pytest
from mcap import writer as mcap_writer
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from waiting import eventually

import rosglass
from rosglass import load
from rosglass.bags import Player, Recorder, open_bag
from rosglass.interfaces import Library, parse_idl
from rosglass.interfaces.texts import idl_text, schema_text
from rosglass.messages import MessageType, OpaqueType

if TYPE_CHECKING:
    from pathlib import Path

WINCH = """
#include "builtin_interfaces/msg/Time.idl"

module lab_msgs {
  module msg {
    module Winch_Constants {
      const uint8 REEL_IN = 1;
    };
    @verbatim (language="comment", text="A winch.")
    struct Winch {
      builtin_interfaces::msg::Time stamp;
      @default (value=2)
      uint8 motion;
      @verbatim (language="comment", text="Paid out.")
      @unit (value="m")
      float rope;
    };
  };
};
"""
#: A type that only IDL can define: with a char field, and a name that .msg does not allow.
DRUM = """
module lab_msgs { module msg {
    typedef double double__3[3];
    module Drum_Constants { const string WORDS = "a \\"b\\""; };
    struct Drum {
      lab_msgs::msg::Winch winch;
      char letter;
      @unit (value="rad/s")
      double drumSpeed;
      double__3 axis;
      @default (value="(1, 2)")
      sequence<int16, 4> turns;
      sequence<string<5>> names;
      boolean on;
      octet raw;
    };
}; };
"""
VALUES = {"stamp": {"sec": 7, "nanosec": 5}, "motion": 1, "rope": 1.5}
LINE = "=" * 80


@pytest.fixture
def library(tmp_path: Path) -> Library:
    folder = tmp_path / "lab_msgs" / "msg"
    folder.mkdir(parents=True)
    (tmp_path / "lab_msgs" / "package.xml").write_text("<name>lab_msgs</name>")
    (folder / "Winch.idl").write_text(WINCH)
    (folder / "Drum.idl").write_text(DRUM)
    (folder / "Winches.msg").write_text("lab_msgs/Winch[] all\nstd_msgs/Header header\n")
    library = Library()
    library.add_path(tmp_path)
    return library


def record(path: Path, library: Library, name: str, fields: dict[str, Any]) -> MessageType:
    """Record three messages of a type, as `rosglass record` does; return the type."""
    with rosglass.connect(f"local://{path.stem}", "robot", library=library) as node:
        publisher = node.create_publisher("/winch", name)
        with Recorder(node, path, ["/winch"]) as recorder:
            eventually(lambda: publisher.subscription_count)
            for _ in range(3):
                publisher.publish(fields)
            eventually(lambda: recorder.status().messages == 3)
        assert not recorder.status().problems
    found = load(name, library=library)
    assert isinstance(found, MessageType)
    return found


@pytest.mark.parametrize(
    ("name", "fields"),
    [("lab_msgs/msg/Winch", VALUES), ("lab_msgs/msg/Winches", {"all": [VALUES, {}]})],
)
def test_idl_type_is_recorded_as_msg_which_all_read(tmp_path, library, name, fields):
    path = tmp_path / "lab.mcap"
    recorded = record(path, library, name, fields)
    wanted = recorded.create(fields)
    with open_bag(path) as bag:
        (channel,) = bag.channels
        found = channel.type(Library())  # by what is in the file
        assert (channel.encoding, found.rihs01) == ("msg", recorded.rihs01)
        assert [found.decode(m.data) for m in bag.messages()] == [wanted] * 3
        winch = (
            found.definition
            if name.endswith("Winch")
            else found.definition.nested["lab_msgs/msg/Winch"]
        )
        assert [(f.name, f.default, f.unit) for f in winch.fields] == [
            ("stamp", None, ""), ("motion", 2, ""), ("rope", None, "m"),
        ]  # fmt: skip
        assert winch.fields[2].comment == "Paid out. [m]"
        assert winch.comment == "A winch."
        assert [(c.name, c.value) for c in winch.constants] == [("REEL_IN", 1)]
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        others = [message.decoded_message for message in reader.iter_decoded_messages()]
    assert len(others) == 3
    first = others[0] if name.endswith("Winch") else others[0].all[0]
    assert (first.stamp.sec, first.rope) == (7, 1.5)
    with AnyReader([path]) as reader:
        (other, *_) = [reader.deserialize(m[2], name) for m in reader.messages()]
    first = other if name.endswith("Winch") else other.all[0]
    assert (first.stamp.sec, first.rope) == (7, 1.5)


def test_idl_only_type_is_recorded_as_idl(tmp_path, library):
    name, path = "lab_msgs/msg/Drum", tmp_path / "lab.mcap"
    fields = {"winch": VALUES, "letter": 65, "drumSpeed": 2.5, "axis": [1, 2, 3], "names": ["a"]}
    recorded = record(path, library, name, fields)
    with path.open("rb") as file:
        (schema,) = make_reader(file).get_summary().schemas.values()
    assert schema.encoding == "ros2idl"
    assert schema.data.decode().startswith(f"{LINE}\nIDL: {name}\nmodule lab_msgs")
    with open_bag(path) as bag:
        (channel,) = bag.channels
        found = channel.type(Library())
        assert found.rihs01 == recorded.rihs01
        assert found.definition == parse_idl(found.definition.text, name)
        assert found.fields == recorded.fields
        assert found.constants == recorded.constants
        assert [found.decode(m.data) for m in bag.messages()] == [recorded.create(fields)] * 3
    with AnyReader([path]) as reader:
        (other, *_) = [reader.deserialize(m[2], name) for m in reader.messages()]
    assert (other.winch.stamp.sec, other.drumSpeed, list(other.turns)) == (7, 2.5, [1, 2])


def test_recording_with_idl_types_is_played(tmp_path, library):
    record(tmp_path / "lab.mcap", library, "lab_msgs/msg/Drum", {"drumSpeed": 2.5})
    found: list[float] = []
    with (
        open_bag(tmp_path / "lab.mcap") as bag,
        rosglass.connect("local://idl_played", "player") as node,
        Player(node, bag, delay=0.0, paused=True) as player,
    ):
        kind = bag.channels[0].type()
        node.create_subscription("/winch", kind, lambda m: found.append(m.drumSpeed))
        player.resume()
        eventually(lambda: found == [2.5] * 3)


def idl_schema(name: str = "lab_msgs/msg/Winch") -> str:
    """The schema that rosbag2 writes for an IDL type: whole files, each after a line."""
    time = (
        "module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };"
    )
    return f"{LINE}\nIDL: {name}\n{WINCH}{LINE}\nIDL: builtin_interfaces/msg/Time\n{time}"


def test_mcap_file_with_an_idl_schema(tmp_path):
    name, path = "lab_msgs/msg/Winch", tmp_path / "idl.mcap"
    kind = MessageType.from_text(name, idl_schema(), encoding="idl")
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    schema = writer.register_schema(name, "ros2idl", idl_schema().encode())
    number = writer.register_channel("/winch", "cdr", schema)
    writer.add_message(number, 1, kind.encode(VALUES), 1)
    writer.finish()
    with open_bag(path) as bag:
        found = bag.channels[0].type(Library())
        assert not isinstance(found, OpaqueType)
        assert [found.decode(m.data) for m in bag.messages()] == [kind.create(VALUES)]
        assert found.constants == {"REEL_IN": 1}


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("broken", [False, True])
def test_ros2_bag_with_an_idl_type(tmp_path, storage, broken):
    """A definition that the rosbags package cannot read costs its own topic at most."""
    store, name = get_typestore(Stores.ROS2_JAZZY), "lab_msgs/msg/Winch"
    kind = MessageType.from_text(name, idl_schema(), encoding="idl")
    text = "?" if broken else idl_schema()
    with Writer2(tmp_path / "bag", version=9, storage_plugin=storage) as writer:
        chatter = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        winch = writer.add_connection("/winch", name, msgdef=text, rihs01=kind.rihs01)
        winch = next(c for c in writer.connections if c.topic == "/winch")
        if broken:
            definition = MessageDefinition(MessageDefinitionFormat.IDL, text)
            assert winch.msgdef.data == definition.data
        writer.write(winch, 1, kind.encode(VALUES))
        writer.write(chatter, 2, load("std_msgs/msg/String").encode({"data": "hello"}))
    with open_bag(tmp_path / "bag") as bag:
        types = {channel.topic: channel.type(Library()) for channel in bag.channels}
        winch, chatter = (types[m.channel.topic] for m in bag.messages())
        assert isinstance(winch, OpaqueType) is broken
        (first, second) = bag.messages()
        assert chatter.decode(second.data).data == "hello"
        if not broken:
            assert winch.decode(first.data) == kind.create(VALUES)


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("encoding", ["unknown", "ros3idl"])
def test_ros2_bag_with_a_definition_in_another_language(tmp_path, storage, encoding):
    """As rosbag2 writes it for a type whose definition it does not find."""
    store = get_typestore(Stores.ROS2_JAZZY)
    string, number = load("std_msgs/msg/String"), load("std_msgs/msg/Int8")
    with Writer2(tmp_path / "bag", version=9, storage_plugin=storage) as writer:
        for time, kind, fields in ((1, string, {"data": "hello"}), (2, number, {"data": 7})):
            connection = writer.add_connection(f"/{time}", kind.name, typestore=store)
            writer.write(connection, time, kind.encode(fields))
    (file,) = (path for path in (tmp_path / "bag").iterdir() if path.suffix != ".yaml")
    if storage is StoragePlugin.SQLITE3:
        with closing(sqlite3.connect(file)) as database:
            database.execute(
                "UPDATE message_definitions SET encoding = ?, encoded_message_definition = '?' "
                "WHERE topic_type = 'std_msgs/msg/Int8'", [encoding],
            )  # fmt: skip
            database.commit()
    else:
        data = file.read_bytes()
        for at in [found.end() + 4 for found in re.finditer(rb"std_msgs/msg/Int8", data)]:
            if data[at : at + 7] == b"ros2msg":
                data = data[:at] + encoding.encode() + data[at + 7 :]
        file.write_bytes(data)
    with open_bag(tmp_path / "bag") as bag:
        types = {channel.topic: channel.type() for channel in bag.channels}
        found = [types[m.channel.topic].decode(m.data).data for m in bag.messages()]
    assert found == ["hello", 7]  # this machine knows both


def test_idl_texts_say_what_the_definition_says(library):
    for name in ("lab_msgs/msg/Drum", "lab_msgs/msg/Winch", "diagnostic_msgs/msg/DiagnosticStatus",
                 "sensor_msgs/msg/BatteryState", "std_msgs/msg/Empty"):  # fmt: skip
        definition = library.definition(name)
        again = parse_idl(idl_text(definition), name)
        assert (again.fields, again.constants, again.comment) == (
            tuple(definition.fields),
            tuple(again.constants),
            definition.comment,
        )
        assert [(c.name, c.type, c.value, c.comment) for c in again.constants] == [
            (c.name, c.type, c.value, c.comment) for c in definition.constants
        ]


@pytest.mark.parametrize(
    "name",
    [
        "example_interfaces/action/Fibonacci_FeedbackMessage",
        "example_interfaces/action/Fibonacci_GetResult_Response",
        "std_srvs/srv/SetBool_Event",
    ],
)
def test_messages_of_actions_and_services_are_readable_again(name):
    found = load(name)
    language, text = schema_text(found.definition)
    assert (language, MessageType.from_text(name, text).rihs01) == ("msg", found.rihs01)


def test_idl_has_no_infinity():
    text = 'float64 far inf\nfloat64[] all [1.0, -inf, nan]\nstring word "inf"\n'
    definition = MessageType.from_text("lab_msgs/msg/Far", text).definition
    again = parse_idl(idl_text(definition), definition.name)
    assert [(f.name, f.type) for f in again.fields] == [(f.name, f.type) for f in definition.fields]
    assert [f.default for f in again.fields] == [None, None, "inf"]


def test_schema_of_many_files_is_limited():
    struct = "module lab_msgs { module msg { struct T# { long x; }; }; };"
    one = f"{LINE}\nIDL: lab_msgs/msg/T#\n{struct}\n"
    text = "".join(one.replace("#", str(number)) for number in range(5000))
    one = one.replace("#", "1")
    assert MessageType.from_text("lab_msgs/msg/T7", text, encoding="idl").fields[0].name == "x"
    with pytest.raises(rosglass.Error, match="defined twice, differently"):
        MessageType.from_text("lab_msgs/msg/T1", one + one.replace("x;", "y;"), encoding="idl")
    with pytest.raises(rosglass.Error, match="<lab_msgs/msg/T1>:3:1: expected"):
        MessageType.from_text("lab_msgs/msg/T1", one + "oops", encoding="idl")


def test_ros1_type_has_no_idl():
    with pytest.raises(rosglass.Error, match="'idl' in ROS 2"):
        MessageType.from_text("lab_msgs/msg/Winch", WINCH, 1, encoding="idl")
    assert schema_text(load("std_msgs/String", ros=1).definition) == ("msg", "string data")
