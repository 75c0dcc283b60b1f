"""Field paths: from bytes to values without making a message."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosglass import DecodeError, FieldPathError
from rosglass.messages import MessageType, load

TEXT = """\
string name
uint8 flag
t/Part[] parts
t/Fixed[2] pair
t/Even[] even
float64[] values
int16[4] four
bool[] bits
string[] words
wstring wide
uint16 last
================================================================================
MSG: t/Part
string label
float64[] samples
t/Fixed inner
bool good
================================================================================
MSG: t/Fixed
uint8 small
float64 big
================================================================================
MSG: t/Even
float64 x
bool on
int32 n
"""
KIND = MessageType.from_text("t/msg/Everything", TEXT)
VALUE: dict[str, Any] = {
    "name": "grüße",
    "flag": 3,
    "parts": [
        {
            "label": f"part {i}",
            "samples": [i + 0.5] * i,
            "inner": {"small": i, "big": i / 2},
            "good": i % 2 == 0,
        }
        for i in range(5)
    ],
    "pair": [{"small": 1, "big": 2.0}, {"small": 3, "big": 4.0}],
    "even": [{"x": float(i), "on": i > 1, "n": -i} for i in range(4)],
    "values": [0.0, 1.0, 2.0, 3.0, 4.0],
    "four": [1, -2, 3, -4],
    "bits": [True, False, True],
    "words": ["zero", "one", "two"],
    "wide": "日本",
    "last": 65535,
}


def plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    if hasattr(value, "to_dict"):
        return plain(value.to_dict())
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(item) for item in value]
    return value


def reference(path: str) -> Any:
    """Return Python's value of the path, `[*]` being all elements."""
    head, star, tail = path.partition("[*].")
    if star:
        return [eval(f"item{bracketed(tail)}", {"item": item}) for item in reference(head)]
    return eval(f"value{bracketed(path.replace('[*]', '[:]'))}", {"value": VALUE})


def bracketed(path: str) -> str:
    parts = path.split(".")
    named = (part.partition("[") for part in parts)
    return "".join(f"[{name!r}]{mark}{rest}" for name, mark, rest in named)


@st.composite
def paths(draw: st.DrawFn) -> str:
    """A path into VALUE: fields, elements, at most one [*], and a slice at the end."""
    value: Any = VALUE
    path = ""
    while not path or draw(st.booleans()):
        if isinstance(value, dict):
            name = draw(st.sampled_from(sorted(value)))
            path, value = f"{path}.{name}" if path else name, value[name]
        elif isinstance(value, list) and value and "[*]" not in path:
            index = draw(st.integers(-len(value), len(value) - 1))
            inner = isinstance(value[0], dict)
            path, value = f"{path}[{'*' if inner and draw(st.booleans()) else index}]", value[index]
        else:
            break
    if isinstance(value, list) and "[*]" not in path and draw(st.booleans()):
        path += draw(st.sampled_from(["[*]", "[1:3]", "[1:]", "[:2]", "[::-2]"]))
    return path


#: The same paths every time.
steady = settings(max_examples=150, deadline=None, derandomize=True)


@pytest.mark.parametrize(
    "how", [{"wire": "cdr"}, {"wire": "cdr", "byteorder": "big"}, {"wire": "ros1"}]
)
@steady
@given(path=paths())
def test_paths_read_the_values(path: str, how: dict[str, str]) -> None:
    data = KIND.encode(VALUE, **how)
    read = KIND.path(path, wire=how["wire"])
    assert plain(read(data)) == reference(path)
    assert plain(read(bytearray(data))) == reference(path)
    assert plain(KIND.decode(data, wire=how["wire"])[path]) == reference(path)
    assert plain(KIND.create(VALUE)[path]) == reference(path)


def test_slices_of_messages_give_columns() -> None:
    data = KIND.encode(VALUE)
    assert KIND.path("parts[1:4].label")(data) == ["part 1", "part 2", "part 3"]
    column = KIND.path("parts[::2].inner.big")(data)
    assert isinstance(column, np.ndarray)
    assert column.tolist() == [0.0, 1.0, 2.0]
    assert KIND.path("even[1:].x")(data).tolist() == [1.0, 2.0, 3.0]
    message = KIND.decode(data)
    assert message["even[1:].on"].dtype == np.bool_
    assert message["parts[::2].inner.big"].tolist() == [0.0, 1.0, 2.0]


def test_columns_of_constant_layout_are_views() -> None:
    cloud = load("sensor_msgs/msg/PointCloud")
    data = cloud.encode(points=[{"x": i, "y": -i} for i in range(100)])
    column = cloud.path("points[*].y")(data)
    assert column.strides == (12,)
    assert np.shares_memory(column, np.frombuffer(data, np.uint8))
    assert cloud.path("points[*].y")(cloud.encode()).tolist() == []


def test_several_paths_in_any_order() -> None:
    paths = ["last", "values[-1]", "name", "values[0]", "parts[3].label", "parts[1].label"]
    paths += ["parts[*].inner.big", "values", "pair", "pair[0].big", "name"]
    for wire in ("cdr", "ros1"):
        data = KIND.encode(VALUE, wire=wire)
        got = KIND.path(*paths, wire=wire)(data)
        assert plain(got) == [reference(path) for path in paths]


def test_constant_offsets_in_any_order() -> None:
    twist = load("geometry_msgs/msg/Twist")
    data = twist.encode(linear={"x": 1.0, "z": 3.0}, angular={"y": 5.0})
    assert twist.path("angular.y", "linear.x", "linear.z")(data) == (5.0, 1.0, 3.0)
    assert twist.path("linear.x", "linear.x")(data) == (1.0, 1.0)
    big = twist.encode(twist.decode(data), byteorder="big")
    assert twist.path("angular.y")(big) == 5.0


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        ("", "cannot be empty"),
        ("nmae", "did you mean 'name'"),
        ("name.x", "is a string and has no fields"),
        ("flag[0]", "'flag' is not an array"),
        ("[0]", "'the message' is not an array"),
        ("parts.label", r"write parts\[0\] or parts\[\*\]"),
        ("parts[0][1]", "'parts' is not an array"),
        ("four[4]", "index 4 is out of range, the array holds 4"),
        ("four[-5]", "index -5 is out of range"),
        ("parts[0].inner.bgi", "did you mean 'big'"),
        ("values[1", "malformed at character 7"),
        ("values[a]", "malformed"),
        ("values[::0]", "step cannot be 0"),
        ("parts[0]label", "malformed"),
        (".name", "malformed at character 1"),
        ("name.", "malformed"),
        ("a b", "malformed"),
    ],
)
def test_paths_that_do_not_exist(path: str, problem: str) -> None:
    with pytest.raises(FieldPathError, match=problem):
        KIND.path(path)
    with pytest.raises(FieldPathError, match=problem):
        _ = KIND.create(VALUE)[path]


def test_path_is_a_string() -> None:
    with pytest.raises(FieldPathError, match="is a str"):
        KIND.path(3)  # type: ignore[arg-type]


@pytest.mark.parametrize("path", ["values[5]", "values[-6]", "parts[5].label", "words[3]"])
def test_indexes_beyond_the_array(path: str) -> None:
    with pytest.raises(FieldPathError, match="the array holds"):
        KIND.path(path)(KIND.encode(VALUE))
    with pytest.raises(FieldPathError, match="the array holds"):
        _ = KIND.create(VALUE)[path]


def outcome(read: Callable[[bytes], Any], data: bytes) -> Any:
    try:
        return plain(read(data))
    except DecodeError as error:
        return error.type_name.split("/")[0]


@pytest.mark.parametrize("wire", ["cdr", "ros1"])
@steady
@given(path=paths())
def test_cut_off_bytes_give_the_value_or_an_error(path: str, wire: str) -> None:
    data = KIND.encode(VALUE, wire=wire)
    # Cut off at the right place, wide characters of 4 bytes are a whole message with those of 2.
    read, right = KIND.path(path, wire=wire, wstring_width=4), reference(path)
    outcomes = [outcome(read, data[:length]) for length in range(len(data))]
    assert outcomes[0] == "t"
    assert all(found in ("t", right) for found in outcomes)


def test_foreign_headers_are_reported() -> None:
    twist = load("geometry_msgs/msg/Twist")
    for path in ("linear.x", "linear"):
        read = twist.path(path)
        with pytest.raises(DecodeError, match=r"PL_CDR_LE \(0x0003\)"):
            read(b"\0\3" + twist.encode()[2:])
        with pytest.raises(DecodeError, match="expected bytes to decode, got str"):
            read("abc")
        with pytest.raises(DecodeError, match="4-byte header"):
            read(b"\0")


def test_path_set_writes_into_messages() -> None:
    message = KIND.decode(KIND.encode(VALUE))
    message["parts[2].inner.big"] = 9.0
    message["words[1]"] = "eins"
    message["values[1:3]"] = [7.0, 8.0]
    message["last"] = 5
    message["pair[0]"] = {"small": 9, "big": 1.0}
    again = KIND.decode(KIND.encode(message))
    assert again["parts[2].inner.big"] == 9.0
    assert again.words == ["zero", "eins", "two"]
    assert again.values.tolist() == [0.0, 7.0, 8.0, 3.0, 4.0]
    assert (again.last, again.pair[0].small) == (5, 9)
    with pytest.raises(FieldPathError, match="only the last step"):
        message["parts[*].label"] = "x"
    with pytest.raises(FieldPathError, match="out of range"):
        message["values[5]"] = 1.0
