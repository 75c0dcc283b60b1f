"""Type descriptions and texts, as nodes send them, and the definitions made of them."""

from __future__ import annotations

import copy
import json
import logging
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import CyclicTypeError, DefinitionError
from rosglass.interfaces import (
    DISTRIBUTIONS,
    ActionDefinition,
    Definition,
    Library,
    ServiceDefinition,
    add_type_sources,
    parse_message,
    parse_service,
    parse_type_description,
    rihs01,
    type_description,
    type_sources,
)
from rosglass.interfaces.texts import message_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces import InterfaceDefinition

ODD = """\
# What odd messages look like.

byte B=7 # a byte
string QUOTED="a 'b' \\"c\\" \\\\ \\t"
float64 NOTHING=-0.0
char letter 65 # first
char[] letters
bool[3] switches [true, false, true]
string<=5 name "ab"
wstring<=9[<=4] names
string[<=3] words ["a, b", 'c']
byte[2] raw [1, 255]
uint64 big 18446744073709551615
int8 small -128
# How fast [m/s].
float32 speed 1e-3
my_msgs/Empty[<=2] nothing
wstring wide
"""


def odd() -> Definition:
    library = Library()
    library.add_text("my_msgs/msg/Empty", "", source="test")
    library.add_text("my_msgs/msg/Odd", ODD, source="test")
    found = library.definition("my_msgs/msg/Odd")
    assert isinstance(found, Definition)
    return found


def sent(definition: InterfaceDefinition) -> dict[str, Any]:
    """The description, as it looks after the wire: plain values only."""
    described: dict[str, Any] = json.loads(json.dumps(type_description(definition)))
    return described


def parts(definition: InterfaceDefinition) -> list[Definition]:
    if isinstance(definition, ServiceDefinition):
        return [definition.request, definition.response]
    if isinstance(definition, ActionDefinition):
        return [definition.goal, definition.result, definition.feedback]
    return [definition]


def said(definition: InterfaceDefinition) -> list[Any]:
    """Everything a definition says, nested ones included."""
    return [
        (part.name, part.fields, part.constants, part.comment, part.text)
        for outer in parts(definition)
        for part in (outer, *sorted(outer.nested.values(), key=lambda inner: inner.name))
    ]


@pytest.mark.parametrize("distribution", DISTRIBUTIONS[2])
def test_every_standard_type_comes_back_whole(distribution: str) -> None:
    library = Library(distribution=distribution)
    for name in library.names():
        definition = library.definition(name)
        described = parse_type_description(sent(definition))
        assert type(described) is type(definition)
        assert rihs01(described) == rihs01(definition), name
        complete = add_type_sources(described, type_sources(definition), verbatim=True)
        assert said(complete) == said(definition), name


@pytest.mark.parametrize(
    "suffix",
    ["_SendGoal", "_GetResult", "_FeedbackMessage", "_SendGoal_Request", "_GetResult_Event"],
)
def test_types_implied_by_an_action_are_described(suffix: str) -> None:
    definition = Library().definition(f"example_interfaces/action/Fibonacci{suffix}")
    described = parse_type_description(sent(definition))
    assert type(described) is type(definition)
    assert rihs01(described) == rihs01(definition)
    assert rihs01(add_type_sources(described, type_sources(definition))) == rihs01(definition)


def test_goals_have_the_constants_of_their_action() -> None:
    library = Library()
    text = "uint8 FAST=1 # m/s\nuint8 speed\n---\nuint8 DONE=2\nuint8 state\n---\nfloat32 left"
    library.add_text("my_msgs/action/Go", text, source="test")
    (whole,) = (s for s in type_sources(library.definition("my_msgs/action/Go"))[:1])
    asked = library.definition("my_msgs/action/Go_SendGoal")
    found = add_type_sources(
        parse_type_description(sent(asked)), [*type_sources(asked), whole], verbatim=True
    )
    assert isinstance(found, ServiceDefinition)
    goal = found.request.nested["my_msgs/action/Go_Goal"]
    assert [(c.name, c.comment) for c in goal.constants] == [("FAST", "m/s")]


def test_every_kind_of_field() -> None:
    definition = odd()
    described = parse_type_description(sent(definition))
    assert isinstance(described, Definition)
    assert rihs01(described) == rihs01(definition)
    assert [(f.name, f.default) for f in described.fields] == [
        (f.name, f.default) for f in definition.fields
    ]
    # A .msg file's char is an uint8 in everything but its name.
    assert [str(f.type).replace("uint8", "char") for f in described.fields] == [
        str(f.type) for f in definition.fields
    ]
    assert said(add_type_sources(described, type_sources(definition), verbatim=True)) == said(
        definition
    )


def test_source_names_the_sender() -> None:
    description = sent(Library().definition("std_srvs/srv/SetBool"))
    described = parse_type_description(description, provider="wire /talker")
    for part in (described, *parts(described)):
        assert part.source.provider == "wire /talker"


def test_text_is_written_for_people_and_parsers() -> None:
    definition = odd()
    again = parse_message(message_text(definition), "my_msgs/Odd")
    assert [(f.name, f.type, f.default, f.unit) for f in again.fields] == [
        (f.name, f.type, f.default, f.unit) for f in definition.fields
    ]
    assert [(c.name, c.type, c.value, c.comment) for c in again.constants] == [
        (c.name, c.type, c.value, c.comment) for c in definition.constants
    ]
    assert again.comment == definition.comment
    service = parse_type_description(sent(Library().definition("rcl_interfaces/srv/GetParameters")))
    assert isinstance(service, ServiceDefinition)
    parsed = parse_service(service.text, service.name)
    assert [p.fields for p in parts(parsed)] == [p.fields for p in parts(service)]


@pytest.mark.parametrize(
    "text",
    [
        "# Head\n# more\nint8 a\t# beside\nint8 b",
        "# Head\n\nint8 a",
        "# Head\n\n# of a\nint8 a",
        "# Head\nint8 A=1 # c\nint8 b",
        "# Head\nint8 a\nint8 A=1",
        "# Head",
    ],
)
def test_head_comment_is_written_once(text):
    """It belongs to the message and to the first field that it touches."""
    definition = parse_message(text, "my_msgs/Odd")
    written = message_text(definition)
    assert written.count("Head") == 1
    again = parse_message(written, "my_msgs/Odd")
    assert again.comment == definition.comment
    assert [f.name for f in again.fields] == [f.name for f in definition.fields]
    if not (definition.constants and definition.fields):
        assert again.fields == definition.fields


def mangle(text: str) -> str:
    """Change a text as rosidl's generator does: escaped, and cut to the original's length."""
    lines = (str(line.encode())[2:-1] for line in text.splitlines())
    return "\n".join(lines)[: len(text)]


def with_text(definition: InterfaceDefinition, text: str) -> InterfaceDefinition:
    sources = type_sources(definition)
    sources[0]["raw_file_contents"] = text
    return add_type_sources(parse_type_description(sent(definition)), sources)


def message(text: str) -> Definition:
    library = Library()
    library.add_text("my_msgs/msg/Some", text, source="test")
    found = library.definition("my_msgs/msg/Some")
    assert isinstance(found, Definition)
    return found


TABS = """\
uint8 OFF=0\t# aus
uint8 ON=1\t# ein: "läuft", heißt's

uint8 state 1\t# OFF or ON
float32 speed\t# [m/s]
# It's 'quoted' and \\d is a digit.
string note
uint8 LAST=123
"""


@pytest.mark.parametrize("end", ["", "\0"], ids=["as is", "with its zero byte"])
def test_texts_that_the_generator_escaped_and_cut(end: str) -> None:
    definition = message(TABS)
    mangled = mangle(TABS)
    assert "\t" not in mangled
    assert "LAST" not in mangled
    found = with_text(definition, mangled + end)
    assert isinstance(found, Definition)
    assert rihs01(found) == rihs01(definition)
    assert [(c.name, c.value) for c in found.constants] == [("OFF", 0), ("ON", 1)]
    assert found.constants[1].comment == 'ein: "läuft", heißt\'s'
    assert found.fields[0].default == 1
    assert found.fields[1].unit == "m/s"
    assert [f.name for f in found.fields] == ["state", "speed", "note"]
    # The text shown to people has all fields, too, and no number that was cut in two.
    assert parse_message(found.text, found.name).fields[2].name == "note"
    assert "LAST" not in found.text


def test_constant_cut_in_two_is_left_out() -> None:
    text = "# \t\t\nuint8 state\nuint8 MAXIMUM=123"
    assert mangle(text).endswith("MAXIMUM=1")
    found = with_text(message(text), mangle(text))
    assert isinstance(found, Definition)
    assert found.constants == ()


@pytest.mark.parametrize(
    "text",
    [
        "float32 state\nfloat32 speed\nstring note\nuint8 EVIL=1",
        "uint8 state\nfloat32 speed\nuint8 EVIL=1",
        "uint8 state\nfloat32 speed\nstring note\nstring more\nuint8 EVIL=1",
        "uint8 state\nfloat32 speed\nstring comment\nuint8 EVIL=1",
        "this is not a definition",
        "uint8 a\n---\nuint8 EVIL=1",
        "",
        "\\",
        "\\x\n",
        '# \\xff\nuint8 state 1\nfloat32 speed\nstring note"\\',
        "x" * (5 * 1024 * 1024),
    ],
)
def test_texts_about_something_else_are_not_believed(text: str) -> None:
    definition = message(TABS)
    found = with_text(definition, text)
    assert isinstance(found, Definition)
    assert rihs01(found) == rihs01(definition)
    assert found.constants == ()
    assert [f.default for f in found.fields] == [1, None, None]


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s.update(encoding="fortran"),
        lambda s: s.update(type_name="other_msgs/msg/Some"),
        lambda s: s.update(type_name=3),
        lambda s: s.update(raw_file_contents=None),
        lambda s: s.update(encoding="idl"),
        dict.clear,
    ],
)
def test_odd_sources_are_left_out(change: Callable[[dict[str, Any]], object]) -> None:
    definition = message(TABS)
    sources: list[dict[str, Any]] = [dict(source) for source in type_sources(definition)]
    change(sources[0])
    found = add_type_sources(parse_type_description(sent(definition)), sources)
    assert isinstance(found, Definition)
    assert rihs01(found) == rihs01(definition)
    assert found.constants == ()


IDL = """
module my_msgs { module msg {
  module Some_Constants { const uint8 ON = 1; };
  struct Some {
    @verbatim (language="comment", text="How fast.") @unit (value="m/s")
    @default (value=2.5)
    double speed;
    sequence<octet, 3> raw;
    long myNumber[2];
  };
}; };
"""


def test_idl() -> None:
    library = Library()
    library.add_text("my_msgs/msg/Some", IDL, source="test", encoding="idl")
    definition = library.definition("my_msgs/msg/Some")
    (source,) = type_sources(definition)
    assert source["encoding"] == "idl"
    found = add_type_sources(parse_type_description(sent(definition)), [source])
    assert said(found) == said(definition)
    assert rihs01(found) == rihs01(definition)
    assert found.text == IDL


def field(described: dict[str, Any], name: str) -> dict[str, Any]:
    fields = described["type_description"]["fields"]
    found: dict[str, Any] = next(f for f in fields if f["name"] == name)
    return found


def drop(part: dict[str, Any], key: str) -> None:
    del part[key]


RUBBISH: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "nothing": (lambda d: d.clear(), "no proper type_description"),
    "no fields": (lambda d: drop(d["type_description"], "fields"), "no proper fields"),
    "text for fields": (lambda d: d["type_description"].update(fields="abc"), "no proper fields"),
    "a number for a field": (lambda d: d["type_description"]["fields"].append(3), "got 3"),
    "no id": (
        lambda d: drop(field(d, "big")["type"], "type_id"),
        "field big has no proper type_id",
    ),
    "bool for id": (lambda d: field(d, "big")["type"].update(type_id=True), "field big"),
    "unset id": (lambda d: field(d, "big")["type"].update(type_id=0), "field big has type id 0"),
    "unknown id": (lambda d: field(d, "big")["type"].update(type_id=47), "field big .* 47"),
    "large id": (lambda d: field(d, "big")["type"].update(type_id=193), "field big .* 193"),
    "negative id": (lambda d: field(d, "big")["type"].update(type_id=-45), "field big .* -45"),
    "long double": (lambda d: field(d, "big")["type"].update(type_id=12), "long double"),
    "IDL's char": (lambda d: field(d, "big")["type"].update(type_id=13), "IDL's char"),
    "fixed string": (lambda d: field(d, "big")["type"].update(type_id=19), "fixed length"),
    "no capacity": (lambda d: field(d, "switches")["type"].update(capacity=0), "field switches"),
    "huge capacity": (
        lambda d: field(d, "switches")["type"].update(capacity=1 << 40),
        "field switches: the capacity must be from 1",
    ),
    "more than any memory": (
        lambda d: field(d, "switches")["type"].update(capacity=(1 << 32) - 1),
        "would always take more than",
    ),
    "capacity of a number": (lambda d: field(d, "big")["type"].update(capacity=3), "field big"),
    "bound of a number": (lambda d: field(d, "big")["type"].update(string_capacity=3), "field big"),
    "no bound": (lambda d: field(d, "name")["type"].update(string_capacity=0), "field name"),
    "huge bound": (lambda d: field(d, "name")["type"].update(string_capacity=1 << 33), "name"),
    "type of a number": (
        lambda d: field(d, "big")["type"].update(nested_type_name="my_msgs/msg/Empty"),
        "field big is a uint64, yet names the type",
    ),
    "no type": (lambda d: field(d, "nothing")["type"].update(nested_type_name=""), "type name"),
    "type without kind": (
        lambda d: field(d, "nothing")["type"].update(nested_type_name="my_msgs/Empty"),
        "no kind",
    ),
    "missing type": (
        lambda d: d["referenced_type_descriptions"].clear(),
        "field nothing has the type my_msgs/msg/Empty, which the description leaves out",
    ),
    "bad field name": (lambda d: field(d, "big").update(name="a b"), "field name 'a b'"),
    "field name as code": (lambda d: field(d, "big").update(name="x=0;y"), "field name"),
    "long field name": (lambda d: field(d, "big").update(name="1" * 10**6), "field name"),
    "twice": (lambda d: field(d, "big").update(name="small"), "field small appears twice"),
    "bad type name": (
        lambda d: d["type_description"].update(type_name="../../etc/passwd"),
        "not a type name",
    ),
    "lower-case type": (
        lambda d: d["type_description"].update(type_name="my_msgs/msg/odd"),
        "upper-case",
    ),
    "described twice": (
        lambda d: d["referenced_type_descriptions"].append(
            copy.deepcopy(d["referenced_type_descriptions"][0])
        ),
        "described twice",
    ),
    "too many types": (
        lambda d: d.update(referenced_type_descriptions=[d["type_description"]] * 501),
        "more than 500 other types",
    ),
    "too many fields": (
        lambda d: d["type_description"].update(fields=[field(d, "big")] * 50_001),
        "more than 50000 fields",
    ),
}


@pytest.mark.parametrize(("spoil", "complaint"), RUBBISH.values(), ids=RUBBISH)
def test_rubbish_is_refused(spoil: Callable[[dict[str, Any]], object], complaint: str) -> None:
    described = sent(odd())
    spoil(described)
    with pytest.raises(DefinitionError, match=complaint) as caught:
        parse_type_description(described)
    assert len(str(caught.value)) < 1000


def test_types_that_contain_themselves_are_refused() -> None:
    described = sent(odd())
    empty = described["referenced_type_descriptions"][0]
    loop = copy.deepcopy(field(described, "nothing"))
    loop["type"]["nested_type_name"] = "my_msgs/msg/Odd"
    empty["fields"] = [loop]
    with pytest.raises(CyclicTypeError, match="my_msgs/msg/Odd -> my_msgs/msg/Empty"):
        parse_type_description(described)


@pytest.mark.parametrize(
    ("name", "text"),
    [("big", "much"), ("small", "-129"), ("name", "too long a name"), ("switches", "(True,)")],
)
def test_defaults_that_do_not_fit_are_reported(
    name: str, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    described = sent(odd())
    field(described, name)["default_value"] = text
    with caplog.at_level(logging.WARNING, "rosglass.interfaces"):
        found = parse_type_description(described)
    assert isinstance(found, Definition)
    assert next(f.default for f in found.fields if f.name == name) is None
    assert f"my_msgs/msg/Odd>: field {name} is used without its default" in caplog.text
