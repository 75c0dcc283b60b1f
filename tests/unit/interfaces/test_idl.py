"""IDL as rosidl writes it and as people write it for rosidl."""

from __future__ import annotations

import pytest

from rosglass.errors import DefinitionError, InvalidNameError
from rosglass.interfaces import (
    ActionDefinition,
    Definition,
    Library,
    ServiceDefinition,
    parse_idl,
    rihs01,
)
from rosglass.interfaces.hashes import type_description
from rosglass.messages import MessageType

GENERATED = r"""
// generated from rosidl_adapter/resource/msg.idl.em
// with input from my_msgs/msg/Odd.msg

#include "builtin_interfaces/msg/Time.idl"
#include "geometry_msgs/msg/Point.idl"

module my_msgs {
  module msg {
    typedef double double__9[9];
    typedef geometry_msgs::msg::Point geometry_msgs__msg__Point__2[2];
    module Odd_Constants {
      const int8 MINUS = -5;
      @verbatim (language="comment", text=
        "How far" "\n" "it goes.")
      @unit (value="m")
      const float FAR = 1.5;
      const string WORDS = "a \"b\" // no comment";
      const boolean YES = TRUE;
      const octet BYTE = 0xff;
      const uint8 OCTAL = 017;
    };
    @verbatim (language="comment", text=
      "About" "\n"
      "it.")
    struct Odd {
      builtin_interfaces::msg::Time stamp;

      @verbatim (language="comment", text=
        "Above. " "[not a unit]")
      @default (value=-1.5)
      @unit (value="m/s")
      double speed;

      @default (value="x")
      string<5> name;

      @default (value=TRUE)
      boolean on;

      @default (value="(1, 2)")
      sequence<int16, 3> shorts;

      @default (value="('a', \"b, c\")")
      sequence<string> words;

      @default (value="(True,)")
      sequence<boolean> one;

      double__9 covariance;
      geometry_msgs__msg__Point__2 points;
      sequence<geometry_msgs::msg::Point, 4> bounded;
      sequence<string<3>> strings;
      wstring<4> wide;
      octet raw;
      char letter;
      unsigned long long big, bigger;
      long plain[3];
    };
  };
};
"""


def message(text: str, name: str = "my_msgs/Odd") -> Definition:
    definition = parse_idl(text, name, file="odd.idl")
    assert isinstance(definition, Definition)
    return definition


def test_fields() -> None:
    odd = message(GENERATED)
    assert [(str(field.type), field.name, field.default) for field in odd.fields] == [
        ("builtin_interfaces/msg/Time", "stamp", None),
        ("float64", "speed", -1.5),
        ("string<=5", "name", "x"),
        ("bool", "on", True),
        ("int16[<=3]", "shorts", (1, 2)),
        ("string[]", "words", ("a", "b, c")),
        ("bool[]", "one", (True,)),
        ("float64[9]", "covariance", None),
        ("geometry_msgs/msg/Point[2]", "points", None),
        ("geometry_msgs/msg/Point[<=4]", "bounded", None),
        ("string<=3[]", "strings", None),
        ("wstring<=4", "wide", None),
        ("byte", "raw", None),
        ("char", "letter", None),
        ("uint64", "big", None),
        ("uint64", "bigger", None),
        ("int32[3]", "plain", None),
    ]


def test_comments_units_and_places() -> None:
    odd = message(GENERATED)
    speed = odd.fields[1]
    assert (speed.comment, speed.unit) == ("Above. [not a unit]", "m/s")
    assert speed.place == (33, 14)
    assert odd.comment == "About\nit."
    assert odd.constant("FAR").comment == "How far\nit goes."


def test_constants() -> None:
    values = {constant.name: constant.value for constant in message(GENERATED).constants}
    assert values == {
        "MINUS": -5,
        "FAR": 1.5,
        "WORDS": 'a "b" // no comment',
        "YES": True,
        "BYTE": 255,
        "OCTAL": 15,
    }


def test_hash_equals_that_of_the_msg(library: Library) -> None:
    library.add_text(
        "my_msgs/Odd", "geometry_msgs/Point[2] p\nstring<=3[] s\nbyte[<=4] b 1".replace(" 1", "")
    )
    other = Library()
    idl = (
        "module my_msgs { module msg { typedef geometry_msgs::msg::Point two[2]; struct Odd { "
        "two p; sequence<string<3>> s; sequence<octet, 4> b; }; }; };"
    )
    other.add_text("my_msgs/Odd", idl, encoding="idl")
    assert rihs01(library.definition("my_msgs/Odd")) == rihs01(other.definition("my_msgs/Odd"))


def test_agrees_with_rosbags() -> None:
    """On a file that rosbags can read: nothing included, no defaults, units and comments."""
    from rosbags.typesys import get_types_from_idl

    members = (
        "builtin_interfaces::msg::Time stamp; nine grid; sequence<int16, 3> few; octet raw; "
        "sequence<geometry_msgs::msg::Point> points; string<3> word; boolean on;"
    )
    text = (
        "module a { module msg { typedef double nine[9]; "
        f"module B_Constants {{ const int8 X = -5; }}; struct B {{ {members} }}; }}; }};"
    )
    constants, fields = get_types_from_idl(text)["a/msg/B"]
    ours = message(text, "a/B")
    assert constants == [(c.name, c.type, c.value) for c in ours.constants]
    assert [field[0] for field in fields] == [field.name for field in ours.fields]
    assert [field[1] for field in fields] == [
        (2, "builtin_interfaces/msg/Time"),
        (3, ((1, ("float64", 0)), 9)),
        (4, ((1, ("int16", 0)), 3)),
        (1, ("byte", 0)),
        (4, ((2, "geometry_msgs/msg/Point"), 0)),
        (1, ("string", 3)),
        (1, ("bool", 0)),
    ]
    assert [str(field.type) for field in ours.fields] == [
        "builtin_interfaces/msg/Time",
        "float64[9]",
        "int16[<=3]",
        "byte",
        "geometry_msgs/msg/Point[]",
        "string<=3",
        "bool",
    ]


def test_empty_struct_has_no_fields() -> None:
    text = (
        "module a { module msg { struct Empty { uint8 structure_needs_at_least_one_member; }; }; };"
    )
    assert message(text, "a/Empty").fields == ()


SERVICE = """
module a { module srv {
  module Do_Request_Constants { const long X = 1; };
  struct Do_Request { long x; };
  struct Do_Response { boolean ok; };
}; };
"""
ACTION = """
module a { module action {
  struct Go_Goal { long x; };
  struct Go_Result { long y; };
  struct Go_Feedback { long z; };
}; };
"""


def test_services_and_actions(library: Library) -> None:
    service = parse_idl(SERVICE, "a/srv/Do")
    assert isinstance(service, ServiceDefinition)
    assert service.request.constant("X").value == 1
    assert service.response.name == "a/srv/Do_Response"
    library.add_text("a/action/Go", ACTION, encoding="idl")
    action = library.definition("a/action/Go")
    assert isinstance(action, ActionDefinition)
    assert library.definition("a/action/Go_FeedbackMessage").name == "a/action/Go_FeedbackMessage"


def test_constants_of_a_message_need_no_qualification() -> None:
    """As ``wstring<UNSIGNED_LONG_CONSTANT>`` in rosidl's own MyMessage.idl."""
    text = """module a { module msg {
        module B_Constants { const unsigned long N = 42; const short M = 3; };
        module C_Constants { const unsigned long N = 7; };
        typedef sequence<long, M> few;
        struct B { wstring<N> text; string<N> names[M]; few numbers; sequence<double, N> more; };
        struct C { wstring<N> text; };
    }; };"""
    types = {field.name: str(field.type) for field in message(text, "a/msg/B").fields}
    assert types == {
        "text": "wstring<=42",
        "names": "string<=42[3]",
        "numbers": "int32[<=3]",
        "more": "float64[<=42]",
    }
    assert str(message(text, "a/msg/C").fields[0].type) == "wstring<=7"
    other = text.replace("struct C {", "struct D {")
    with pytest.raises(DefinitionError, match="unknown constant 'N'"):
        message(other, "a/msg/D")


def test_constants_as_sizes_and_names_in_scopes() -> None:
    text = """
    module a { module msg {
      const long SIZE = 3;
      enum Color { RED, GREEN };
      struct Inner;
      struct Inner { long x; };
      struct Outer {
        sequence<long, SIZE> some; long fixed[SIZE]; string<a::msg::SIZE> name;
        Inner inner; msg::Inner other; a::msg::Inner third; Color color; b::msg::Else more;
        Later later;
      };
    }; };
    """
    outer = message(text, "a/Outer")
    assert [str(field.type) for field in outer.fields] == [
        "int32[<=3]",
        "int32[3]",
        "string<=3",
        "a/msg/Inner",
        "a/msg/Inner",
        "a/msg/Inner",
        "uint32",
        "b/msg/Else",
        "a/msg/Later",
    ]


def test_annotations_and_literals_of_every_form() -> None:
    text = """
    module a { module msg {
      module B_Constants {
        const char LETTER = 'a'; const long NEG = - +2; const long COPY = NEG;
        const long PLUS = -COPY; const double TENTH = .1e0; const string JOINED = "a" L"b";
      };
      @extensibility(FINAL) @nested @topic(name="x", platform=ANY)
      struct B { @key @id(5) @range(min=-1, max=1.5) long x; };
    }; };
    """
    odd = message(text, "a/B")
    assert [field.name for field in odd.fields] == ["x"]
    assert {constant.name: constant.value for constant in odd.constants} == {
        "LETTER": 97,
        "NEG": -2,
        "COPY": -2,
        "PLUS": 2,
        "TENTH": 0.1,
        "JOINED": "ab",
    }


def wrapped(members: str) -> str:
    return f"module a {{ module msg {{ struct B {{\n{members}\n}}; }}; }};"


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("struct X { long x; };", 1, 8, "a struct lies in the modules of its package and kind"),
        ("module a { struct X { long x; }; };", 1, 19, "a struct lies in the modules"),
        ("module A { module msg { struct X { }; }; };", 1, 32, "package name 'A'"),
        ("module a { module msg { struct x { }; }; };", 1, 32, "type name 'x'"),
        ("module a { module msg { union X", 1, 25, "ROS 2 has no 'union'"),
        ("module a { module msg { foo", 1, 25, "expected module, struct, const, typedef or enum"),
        ("module a { module msg {", 1, 24, "got 'end of file'"),
        ("module a { module msg { struct X : Y { }; }; };", 1, 34, "no structs that inherit"),
        ("module a { module msg { struct X { }; struct X { }; }; };", 1, 46, "is defined twice"),
        ("module a { $", 1, 12, "'$' is not IDL"),
        ("module a {\n /* open", 2, 2, "is not IDL"),
        (wrapped("long x"), 3, 1, "expected ';', got '}'"),
        (wrapped("long x; long x;"), 2, 14, "'x' is already defined"),
        (wrapped("long double x;"), 2, 1, "ROS 2 has no 'long double'"),
        (wrapped("wchar x;"), 2, 1, "ROS 2 has no 'wchar'"),
        (wrapped("map<long, long> x;"), 2, 1, "ROS 2 has no 'map'"),
        (wrapped("long x[2][3];"), 2, 7, "there are no arrays of arrays"),
        (wrapped("sequence<sequence<long>> x;"), 2, 1, "there are no sequences of sequences"),
        (wrapped("sequence<long, 0> x;"), 2, 16, "whole number from 1 to"),
        (wrapped("sequence<long, 4294967296> x;"), 2, 16, "whole number from 1 to"),
        (wrapped("string<N> x;"), 2, 8, "unknown constant 'N'"),
        (wrapped("string<1.5> x;"), 2, 8, "got '1.5'"),
        (wrapped("b::Foo x;"), 2, 1, "unknown type 'b::Foo'"),
        (wrapped("@optional long x;"), 2, 2, "@optional is not supported"),
        (wrapped("@default (value=300) octet x;"), 2, 17, "default value: 300 is out of range"),
        (wrapped('@default (value="abc") string<2> x;'), 2, 17, "its bound is 2"),
        (wrapped('@default (value="(1, x)") sequence<long> x;'), 2, 17, "element 1: 'x'"),
        (wrapped("@default (value=1) string x;"), 2, 17, "1 is not a string"),
        (wrapped("@default (value=1) b::msg::C x;"), 2, 17, "can't have a default value"),
        (wrapped("@default (value=1 2) long x;"), 2, 19, "expected ',' or ')'"),
        ("module a { const long X = (1); };", 1, 27, "expressions are not evaluated"),
        ("module a { const long X = 1 + 1; };", 1, 29, "expected ';', got '+'"),
        ("module a { const octet X = 256; };", 1, 28, "constant X: 256 is out of range"),
        ('module a { const long X = -"a"; };', 1, 28, "expected a value"),
        ("module a { const long X = -TRUE; };", 1, 28, "can't have a sign"),
        ("module a { const a::msg::B X = 1; };", 1, 18, "a constant has a basic type"),
        ("module a { const long X = 1; const long X = 1; };", 1, 41, "already defined"),
        ('module a { const string X = "\\ud800"; };', 1, 29, "not a Unicode character"),
    ],
)  # fmt: skip
def test_errors(text: str, line: int, column: int, words: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_idl(text, "a/B", file="odd.idl")
    assert words in str(caught.value)
    assert (caught.value.file, caught.value.line, caught.value.column) == ("odd.idl", line, column)


def test_type_that_is_not_in_the_file() -> None:
    with pytest.raises(DefinitionError, match="the IDL has no a/msg/C, but a/msg/B"):
        parse_idl(wrapped("long x;"), "a/C")
    with pytest.raises(DefinitionError, match="the IDL has no a/srv/C_Request, but no struct"):
        parse_idl("", "a/srv/C")


def test_arguments_are_checked() -> None:
    with pytest.raises(InvalidNameError):
        parse_idl("", "a")
    with pytest.raises(DefinitionError, match="must be a str, got bytes"):
        parse_idl(b"", "a/B")  # type: ignore[arg-type]
    with pytest.raises(DefinitionError, match="the limit is"):
        parse_idl(" " * (4 * 1024 * 1024 + 1), "a/B")


def test_char_of_idl_is_described_as_such() -> None:
    """rosidl_generator_type_description: char is FIELD_TYPE_CHAR; a .msg file's is uint8."""
    text = wrapped("char a; sequence<char> b; char c[3]; sequence<char, 4> d; uint8 e;")
    definition = message(text, "a/msg/B")
    found = type_description(definition)["type_description"]["fields"]
    assert [field["type"]["type_id"] for field in found] == [13, 13 + 144, 13 + 48, 13 + 96, 3]
    kind = MessageType(definition)
    assert kind.decode(kind.encode(a=200, b=[1])).a == 200
