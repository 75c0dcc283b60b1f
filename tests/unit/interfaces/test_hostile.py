"""Definitions made to hang, crash or exhaust their reader."""

from __future__ import annotations

import time
import tracemalloc
from typing import TYPE_CHECKING

import pytest

from rosglass.errors import DefinitionError, Error
from rosglass.interfaces import Library, md5, parse_idl, parse_message, rihs01

if TYPE_CHECKING:
    from collections.abc import Iterator

MEGABYTE = 1_000_000
SECONDS = 60.0  # far more than needed, even traced on a busy machine; what hangs takes hours


@pytest.fixture(autouse=True)
def in_time() -> Iterator[None]:
    start = time.perf_counter()
    yield
    assert time.perf_counter() - start < SECONDS


@pytest.fixture
def in_memory(in_time: None) -> Iterator[None]:
    tracemalloc.start()
    yield
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200 * MEGABYTE


@pytest.mark.usefixtures("in_memory")
@pytest.mark.parametrize(
    "text",
    [
        "\n" * MEGABYTE,
        "#" * MEGABYTE,
        "# x\n" * (MEGABYTE // 4),
        " " * MEGABYTE,
        " #\n" * (MEGABYTE // 3),
    ],
    ids=["lines", "comment", "comments", "blanks", "indented"],
)
def test_megabyte_of_nothing(text: str) -> None:
    assert parse_message(text, "my_msgs/Odd").fields == ()


@pytest.mark.parametrize(
    "text",
    [
        "x" * MEGABYTE,
        "int32 " + "x" * MEGABYTE + "__",
        "int32 X=" + "9" * MEGABYTE,
        "float64 X=" + "9" * MEGABYTE,
        "int32 x " + "0x" + "f" * MEGABYTE,
        "string x '" + "\\'" * (MEGABYTE // 2),
        'string x "' + '\\"" ' * (MEGABYTE // 4) + '"',
        "string[] x ['" + "\\'" * (MEGABYTE // 2) + "]",
        "string[] x [" + "'a" * (MEGABYTE // 2) + "]",
        "int8[" * (MEGABYTE // 5) + " x",
        "a/" * (MEGABYTE // 2) + "B x",
        "int8 A" + "A" * MEGABYTE + "_=1",
        "int32 " + "a_" * (MEGABYTE // 2) + " 1",
        "===\n" * (MEGABYTE // 4),
        "===\nMSG: a/" + "B" * MEGABYTE + "/",
        "\ud800 x",
        "int32 \x00",
    ],
    ids=range(17),
)
def test_megabyte_of_errors(text: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_message(text, "my_msgs/Odd")
    assert len(str(caught.value)) < 3 * MEGABYTE


@pytest.mark.parametrize(
    "text",
    [
        "string x " + "'\"" * (MEGABYTE // 2),
        "string X=" + "[" * MEGABYTE,
        "int8[] x [" + "1," * (MEGABYTE // 2) + "1]",
        "int8 x # " + "[" * MEGABYTE,
        "int8 x # " + "[m]" * (MEGABYTE // 3),
        "int8 x # [" + "m/" * (MEGABYTE // 2) + "]",
    ],
    ids=range(6),
)
def test_megabyte_in_one_element(text: str) -> None:
    assert parse_message(text, "my_msgs/Odd")


def test_too_much_text() -> None:
    with pytest.raises(DefinitionError, match="has 1048577 characters, the limit is 1048576"):
        parse_message("#" * (1024 * 1024 + 1), "my_msgs/Odd")


def test_fields_up_to_the_limit(library: Library) -> None:
    text = "\n".join(f"geometry_msgs/Point p{n}\nint32 C{n}={n}" for n in range(750))
    definition = library.add_text("my_msgs/Odd", text)
    assert len(definition.fields) == 750  # type: ignore[union-attr]
    assert rihs01(library.definition("my_msgs/Odd")).startswith("RIHS01_")
    library.add_text("my_msgs/More", f"{text}\nint8 x")
    with pytest.raises(DefinitionError, match="my_msgs/msg/More has more than 3000 fields"):
        library.definition("my_msgs/More")


def joined(texts: dict[str, str]) -> str:
    return "\n".join(f"===\nMSG: a/{name}\n{text}" for name, text in texts.items())


@pytest.mark.parametrize("ros", [1, 2])
def test_nesting_up_to_the_limit(library: Library, ros: int) -> None:
    chain = {f"T{n}": f"T{n + 1} x" for n in range(62)} | {"T62": "int8 x"}
    definition = library.add_text("a/Root", "T0 x\n" + joined(chain), ros)
    found = library.definition("a/Root", ros)
    assert len(found.nested) == 63  # type: ignore[union-attr]
    assert (md5 if ros == 1 else rihs01)(found)
    assert definition.name == "a/msg/Root"


def test_nesting_beyond_the_limit(library: Library) -> None:
    chain = {f"T{n}": f"T{n + 1} x" for n in range(5000)} | {"T5000": "int8 x"}
    library.add_text("a/Root", "T0 x\n" + joined(chain))
    with pytest.raises(DefinitionError, match="types nest deeper than 64 levels"):
        library.definition("a/Root")


@pytest.mark.usefixtures("in_memory")
def test_nesting_beyond_the_limit_that_begins_at_its_end(library: Library) -> None:
    chain = {f"T{n}": f"T{n - 1} x" for n in range(1, 400)} | {"T0": "int8 x"}
    text = "".join(f"T{n} x{n}\n" for n in range(400))
    library.add_text("a/Root", text + joined(chain))
    with pytest.raises(DefinitionError, match="types nest deeper than 64 levels"):
        library.definition("a/Root")


def test_nesting_that_doubles_at_every_level(library: Library) -> None:
    """2**60 messages when unfolded; those of 2**10 and more are refused by name."""
    chain = {f"T{n}": f"T{n + 1} x\nT{n + 1} y" for n in range(60)} | {"T60": "int32[] x"}
    for ros in (1, 2):
        library.add_text("a/Root", "T0 x\n" + joined(chain), ros)
        with pytest.raises(DefinitionError, match="a/msg/T50 has more than 3000 fields"):
            library.definition("a/Root", ros)
        assert library.definition("a/T51", ros)
    chain = {f"T{n}": f"T{n + 1}[] x\nT{n + 1}[] y" for n in range(60)} | {"T60": "int32[] x"}
    library.add_text("b/Root", ("T0 x\n" + joined(chain)).replace("a/", "b/"), 1)
    with pytest.raises(DefinitionError, match="b/msg/T50 has more than 3000 fields"):
        library.definition("b/Root", 1)
    assert len(md5(library.definition("b/T51", 1))) == 32


@pytest.mark.usefixtures("in_memory")
@pytest.mark.parametrize(
    "text",
    [
        "int8[4294967295] x",
        "A[65536] x\n===\nMSG: a/A\nint8[65536] x",
        "\n".join(f"int64[1000000] x{n}" for n in range(10)),
        "std_msgs/String[8388609] x",
    ],
)
def test_fixed_arrays_that_no_memory_holds(library: Library, text: str) -> None:
    library.add_text("a/Root", text)
    with pytest.raises(DefinitionError, match="would always take more than 33554432 bytes"):
        library.definition("a/Root")


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("std_msgs/Empty[1073741823] x", "more than 1024 messages without fields"),
        ("A[32] x\n===\nMSG: a/A\nstd_msgs/Empty[32] x\nstd_msgs/Empty y", "without fields"),
        ("string[100001] x", "more than 100000 values"),
        ("A[400] x\n===\nMSG: a/A\nstd_msgs/Int8[400] x", "more than 100000 values"),
    ],
)
def test_fixed_arrays_of_too_many_values(
    library: Library, text: str, reason: str, ros: int
) -> None:
    library.add_text("a/Root", text, ros)
    with pytest.raises(DefinitionError, match=f"a a/msg/Root would always hold .*{reason}"):
        library.definition("a/Root", ros)


@pytest.mark.usefixtures("in_memory")
def test_many_types_in_one(library: Library) -> None:
    many = {f"T{n}": "int8 x" for n in range(1500)}
    library.add_text(
        "a/Root", "\n".join(f"{name} x{name[1:]}" for name in many) + "\n" + joined(many)
    )
    with pytest.raises(DefinitionError, match="a/msg/Root needs more than 500 other types"):
        library.definition("a/Root")


@pytest.mark.parametrize(
    "text",
    [
        "module a { " * 100_000,
        "(" * MEGABYTE,
        '"' + "x" * MEGABYTE,
        "/*" * (MEGABYTE // 2),
        "module a { module msg { struct B { long x; }; const long X = " + "(" * 100_000,
        "module a { module msg { struct B { @default (value="
        + "-" * MEGABYTE
        + "1) long x; }; };};",
        "module a { module msg { struct B { sequence<" + "sequence<" * 100_000,
        "module a { module msg { struct B { x" + "::x" * 100_000 + " y; }; }; };",
        "@verbatim(text=" + '"x" ' * (MEGABYTE // 4),
        "@a(" * (MEGABYTE // 3),
        "#" * MEGABYTE,
    ],
    ids=range(11),
)
def test_hostile_idl(text: str) -> None:
    try:
        parse_idl(text, "a/B")
    except Error:
        return
    assert "-" * 100 in text  # an even number of signs is odd but legal


@pytest.mark.usefixtures("in_memory")
def test_many_structs_in_idl() -> None:
    structs = "".join(f"struct S{n} {{ long x; }};" for n in range(10_000))
    definition = parse_idl(f"module a {{ module msg {{ {structs} }}; }};", "a/S7")
    assert definition.name == "a/msg/S7"
