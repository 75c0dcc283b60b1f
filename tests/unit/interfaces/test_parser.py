"""Messages with every spacing, comment and literal that the field uses."""

from __future__ import annotations

import pytest

from rosglass.interfaces import ArrayKind, FieldType, parse_message


def fields(text: str, ros: int = 2) -> list[tuple[str, str]]:
    definition = parse_message(text, "my_msgs/Odd", ros=ros)
    return [(str(field.type), field.name) for field in definition.fields]


def constants(text: str, ros: int = 2) -> dict[str, object]:
    definition = parse_message(text, "my_msgs/Odd", ros=ros)
    return {constant.name: constant.value for constant in definition.constants}


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize(
    "line",
    [
        "int32 x",
        "  int32 x",
        "\tint32\tx\t",
        "int32    x   ",
        "int32 x#comment",
        "int32 x ##comment",
        "int32 x # a = b",
        "\ufeffint32 x",
        "int32 x\r",
        "\r\n\r\nint32 x\r\n",
        "# comment\nint32 x",
        "   \n\t\nint32 x\n\n",
        "int32 x\r# old Mac line ends\r",
    ],
)
def test_spacing_of_fields(line: str, ros: int) -> None:
    assert fields(line, ros) == [("int32", "x")]


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize(
    "line",
    ["int32 X=1", "int32 X =1", "int32 X= 1", "int32  X  =  1 ", "int32\tX\t=\t1", "int32 X=1# c",
     "int32 X=1 ## c = d", "int32 X=+1", "int32 X=01"],
)  # fmt: skip
def test_spacing_of_constants(line: str, ros: int) -> None:
    assert constants(line, ros) == {"X": 1}


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("Point p", "my_msgs/msg/Point"),
        ("geometry_msgs/Point p", "geometry_msgs/msg/Point"),
        ("geometry_msgs/msg/Point p", "geometry_msgs/msg/Point"),
        ("geometry_msgs/Point[] p", "geometry_msgs/msg/Point[]"),
        ("geometry_msgs/Point[10] p", "geometry_msgs/msg/Point[10]"),
        ("geometry_msgs/Point[<=10] p", "geometry_msgs/msg/Point[<=10]"),
        ("string<=12 p", "string<=12"),
        ("wstring<=12 p", "wstring<=12"),
        ("string<=3[<=4] p", "string<=3[<=4]"),
        ("string<=3[4] p", "string<=3[4]"),
        ("string<=3[] p", "string<=3[]"),
        ("float64[<=16] p", "float64[<=16]"),
        ("int8[4294967295] p", "int8[4294967295]"),
        ("other_msgs/action/Go_Goal p", "other_msgs/action/Go_Goal"),
    ],
)
def test_types_of_ros2(line: str, text: str) -> None:
    assert fields(line) == [(text, "p")]


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("Header h", "std_msgs/msg/Header"),
        ("Header[] h", "my_msgs/msg/Header[]"),  # genmsg abbreviates single ones only
        ("time[42] h", "time[42]"),
        ("duration h", "duration"),
        ("std_msgs/Header h", "std_msgs/msg/Header"),
        ("byte h", "byte"),
        ("char[3] h", "char[3]"),
        ("camelCase h", "my_msgs/msg/camelCase"),
    ],
)
def test_types_of_ros1(line: str, text: str) -> None:
    assert fields(line, 1) == [(text, "h")]


def test_header_of_ros2_is_a_message_of_the_package() -> None:
    assert fields("Header h") == [("my_msgs/msg/Header", "h")]


def test_field_type_attributes() -> None:
    kind = parse_message("string<=3[<=4] x", "a/B").fields[0].type
    assert kind == FieldType("string", ArrayKind.BOUNDED, 4, 3)
    assert not kind.is_compound


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("int8 X=-128", -128),
        ("uint64 X=18446744073709551615", 2**64 - 1),
        ("uint8 X=0xFF", 255),
        ("uint8 X=0b11", 3),
        ("uint8 X=0o17", 15),
        ("byte X=255", 255),
        ("char X=255", 255),
        ("bool X=TRUE", True),
        ("bool X=0", False),
        ("float32 X=1e-3", 1e-3),
        ("float64 X=-.5", -0.5),
        ("float64 X=-inf", float("-inf")),
        ("string X=", ""),
        ("string X=hello world # comment", "hello world"),
        ("string X='a # b' # comment", "a # b"),
        ('string X="say \\"hi\\""', 'say "hi"'),
        ("string X='tab\\tnew\\nline \\x41 \\u00e9 \\101 \\q'", "tab\tnew\nline A é A \\q"),
        ("string X=don't # stop", "don't"),
        ("string X='unfinished # comment", "'unfinished"),
        ("string X=a=b=c", "a=b=c"),
        ("wstring X='grüße'", "grüße"),
    ],
)
def test_constants_of_ros2(line: str, value: object) -> None:
    assert constants(line) == {"X": value}


@pytest.mark.parametrize(
    ("line", "value", "text"),
    [
        ("string X=a # b", "a # b", "a # b"),
        ('string X="quotes" stay', '"quotes" stay', '"quotes" stay'),
        ("string X=  inner  spaces  ", "inner  spaces", "inner  spaces"),
        ("string  lower_Case = x=y", "x=y", "x=y"),
        ("byte X=-128", -128, "-128"),
        ("char X=255", 255, "255"),
        ("bool X=5", True, "5"),
        ("bool X=False", False, "False"),
        ("int32 X=0x10", 16, "0x10"),
        ("float32 X=1.50 # c", 1.5, "1.50"),
    ],
)
def test_constants_of_ros1(line: str, value: object, text: str) -> None:
    definition = parse_message(line, "my_msgs/Odd", ros=1)
    assert [(c.value, c.text) for c in definition.constants] == [(value, text)]


@pytest.mark.parametrize(
    ("line", "default"),
    [
        ("int32 x 5", 5),
        ("int32 x   -5   # comment", -5),
        ("uint8 x 0x10", 16),
        ("bool x true", True),
        ("float64 x 1", 1.0),
        ("string x hello world", "hello world"),
        ("string x 'a, b' # c", "a, b"),
        ('string x "it\'s"', "it's"),
        ("string x 'it\\'s'", "it's"),
        ('string x ""', ""),
        ("string x 'a=b'", "a=b"),
        ("string<=3 x abc", "abc"),
        ("int32[] x []", ()),
        ("int32[] x [ ]", ()),
        ("int32[] x [1,2]", (1, 2)),
        ("int32[3] x [1, 2 , 3] # c", (1, 2, 3)),
        ("float32[<=3] x [.5]", (0.5,)),
        ("bool[] x [true, 0, False]", (True, False, False)),
        ("string[] x ['a', \"b, c\", d e , '#']", ("a", "b, c", "d e", "#")),
        ("string[] x ['it\\'s', \"\"]", ("it's", "")),
    ],
)
def test_defaults(line: str, default: object) -> None:
    (field,) = parse_message(line, "my_msgs/Odd").fields
    assert field.default == default
    assert type(field.default) is type(default)


def test_field_without_default_has_none() -> None:
    assert parse_message("int32 x # 5", "my_msgs/Odd").fields[0].default is None


def test_order_is_kept_and_text_is_verbatim() -> None:
    text = "int32 b\nint32 B=1 # c\n\nint32 a 3\nint32 A=2\n"
    definition = parse_message(text, "my_msgs/Odd")
    assert [field.name for field in definition.fields] == ["b", "a"]
    assert [constant.name for constant in definition.constants] == ["B", "A"]
    assert definition.text == text
    assert definition.name == "my_msgs/msg/Odd"
    assert [field.place for field in definition.fields] == [(1, 1), (4, 1)]


def test_only_comments_is_an_empty_message() -> None:
    definition = parse_message("# nothing\n\n# at all\n", "my_msgs/Odd")
    assert (definition.fields, definition.constants) == ((), ())
    assert definition.comment == "nothing\n\nat all"


def test_constant_by_name() -> None:
    definition = parse_message("int8 A=1\nint8 B=2", "my_msgs/Odd")
    assert definition.constant("B").value == 2
    with pytest.raises(KeyError, match="it has: A, B"):
        definition.constant("C")


JOINED = """\
# A pose.
Header header
Pose pose
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id

================================================================================
MSG: my_msgs/Pose
float64 x
===
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
"""


def test_joined_definitions_of_connection_headers() -> None:
    definition = parse_message(JOINED, "my_msgs/PoseStamped", ros=1, file="bag")
    assert definition.text == "# A pose.\nHeader header\nPose pose"
    assert sorted(definition.nested) == ["my_msgs/msg/Pose", "std_msgs/msg/Header"]
    assert definition.nested["my_msgs/msg/Pose"].text == "float64 x"
    assert definition.nested["my_msgs/msg/Pose"].fields[0].place == (12, 1)


def test_joined_definitions_of_mcap() -> None:
    text = f"my_msgs/Pose pose\n{'=' * 80}\nMSG: my_msgs/Pose\nfloat64 x 1\n"
    definition = parse_message(text, "my_msgs/msg/PoseStamped")
    assert definition.nested["my_msgs/msg/Pose"].fields[0].default == 1.0
