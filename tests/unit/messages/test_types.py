"""Types: finding them, what they say about themselves, and definitions that cannot be used."""

from __future__ import annotations

import inspect
import pickle
import threading
import traceback

import pytest

import rosglass
from rosglass import (
    CyclicTypeError,
    DefinitionError,
    Library,
    TypeNotFoundError,
    UnsupportedError,
)
from rosglass.interfaces.definition import ArrayKind, Definition, Field, FieldType
from rosglass.messages import MessageType, default_library, load, type_of


def test_load_takes_both_spellings_and_keeps_types() -> None:
    one, other = load("geometry_msgs/msg/Pose"), load("geometry_msgs/Pose")
    assert one == other
    assert hash(one) == hash(other)
    assert load("geometry_msgs/msg/Pose") is one
    assert one.name == "geometry_msgs/msg/Pose"
    assert one.wire == "cdr"
    assert [field.name for field in one.fields] == ["position", "orientation"]


def test_worlds_and_libraries_are_kept_apart() -> None:
    two, one = load("std_msgs/msg/Header"), load("std_msgs/msg/Header", ros=1)
    assert one != two
    assert (one.wire, two.wire) == ("ros1", "cdr")
    assert [field.name for field in one.fields] == ["seq", "stamp", "frame_id"]
    other = Library()
    assert load("std_msgs/msg/Header", library=other) is not two
    assert load("std_msgs/msg/Header", library=other) == two
    assert default_library() is default_library()


def test_services_and_actions_have_their_messages() -> None:
    service = load("example_interfaces/srv/AddTwoInts")
    request = service.request.encode(a=1, b=2)
    assert service.request.decode(request).b == 2
    assert service.response.create(sum=3).sum == 3
    assert service.rihs01.startswith("RIHS01_")
    action = load("example_interfaces/action/Fibonacci")
    assert action.goal.create(order=5).order == 5
    assert list(action.result.create(sequence=[1, 1]).sequence) == [1, 1]
    assert type_of(action.feedback.create()) == action.feedback
    assert [field.name for field in service.fields["request"]] == ["a", "b"]
    assert list(action.fields) == list(action.parts) == ["goal", "result", "feedback"]
    assert service.constants == {"request": {}, "response": {}}
    assert load("example_interfaces/srv/AddTwoInts", library=Library()) == service != action
    assert "AddTwoInts" in repr(service)
    assert "Fibonacci" in repr(action)


def test_hashes_are_the_well_known_ones() -> None:
    assert load("geometry_msgs/PoseStamped", ros=1).md5 == "d3812c3cbc69362b77dc0b19b345f8f5"
    assert load("std_srvs/SetBool", ros=1).md5 == "09fb03525b03e7ea1fd3992bafd87e16"
    assert load("std_msgs/msg/String").rihs01 == (
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )


@pytest.mark.parametrize("name", ["std_msgs/msg/String", "std_srvs/srv/Trigger"])
@pytest.mark.parametrize(("ros", "there", "missing"), [(1, "md5", "rihs01"), (2, "rihs01", "md5")])
def test_types_can_be_inspected(name: str, ros: int, there: str, missing: str) -> None:
    kind = load(name, ros=ros)
    with pytest.raises(UnsupportedError, match="which has no"):
        getattr(kind, missing)
    assert hasattr(kind, there)
    assert not hasattr(kind, missing)
    assert there in dict(inspect.getmembers(kind))


def test_constants_by_name_and_attribute() -> None:
    constants = load("visualization_msgs/msg/Marker").constants
    assert constants.CUBE == constants["CUBE"] == 1
    assert "SPHERE" in dir(constants)
    with pytest.raises(AttributeError, match="no constant 'CUBES'"):
        _ = constants.CUBES


def test_structure_decides_not_the_source() -> None:
    given = MessageType.from_text("geometry_msgs/msg/Point", "float64 x\nfloat64 y\nfloat64 z")
    assert given == load("geometry_msgs/msg/Point")
    pose = load("geometry_msgs/msg/Pose").create(position=given.create(x=1.0))
    assert pose.position.x == 1.0
    other = MessageType.from_text("geometry_msgs/msg/Point", "float32 x\nfloat32 y\nfloat32 z")
    with pytest.raises(rosglass.ConversionError, match="with the same definition"):
        load("geometry_msgs/msg/Pose").create(position=other.create())


def test_type_is_reached_from_every_message() -> None:
    marker = load("visualization_msgs/msg/Marker").create(type=2, ns="a")
    assert marker.type == 2
    assert type_of(marker) == load("visualization_msgs/msg/Marker")
    pose = load("geometry_msgs/msg/Pose").create()
    assert pose.type.name == "geometry_msgs/msg/Pose"
    assert pose.position.type == load("geometry_msgs/msg/Point")


@pytest.mark.parametrize(
    "name",
    [
        "sensor_msgs/msg/Image",
        "std_msgs/msg/Empty",
        "std_srvs/srv/SetBool",
        "tf2_msgs/action/LookupTransform",
    ],
)
def test_types_can_be_pickled(name: str) -> None:
    again = pickle.loads(pickle.dumps(load(name)))
    assert again == load(name)
    assert hash(again) == hash(load(name))
    assert again.rihs01 == load(name).rihs01


def test_unknown_types_are_errors() -> None:
    with pytest.raises(TypeNotFoundError, match="no_msgs/msg/Nothing"):
        load("no_msgs/msg/Nothing")
    with pytest.raises(UnsupportedError, match=r"rosglass\.load"):
        MessageType("std_msgs/msg/String")  # type: ignore[arg-type]
    with pytest.raises(UnsupportedError, match=r"a library is a rosglass\.Library"):
        load("std_msgs/msg/String", library="mine")  # type: ignore[arg-type]


def compound(name: str, *fields: tuple[str, str], **nested: Definition) -> Definition:
    made = tuple(Field(field, FieldType(kind)) for field, kind in fields)
    return Definition(name, 2, made, nested={d.name: d for d in nested.values()})


def test_cycles_are_errors() -> None:
    inner = compound("t/msg/B", ("a", "t/msg/A"))
    outer = compound("t/msg/A", ("b", "t/msg/B"))
    all_of_it = Definition(outer.name, 2, outer.fields, nested={"t/msg/B": inner, "t/msg/A": outer})
    with pytest.raises(CyclicTypeError, match="t/msg/A -> t/msg/B -> t/msg/A"):
        MessageType(all_of_it)


@pytest.mark.parametrize(
    ("definition", "problem"),
    [
        (compound("t/msg/A", ("b", "t/msg/B")), "no definition of 't/msg/B'"),
        (compound("t/msg/A", ("x", "int8"), ("x", "int8")), "appears twice"),
        (compound("t/msg/A", ("x y", "int8")), "is not a field name"),
        (compound("t/msg/A", ('x"]; import os', "int8")), "is not a field name"),
        (compound("t/msg/A", ("x", "complex128")), "no definition of 'complex128'"),
    ],
)
def test_unusable_definitions_are_errors(definition: Definition, problem: str) -> None:
    with pytest.raises(DefinitionError, match=problem.replace("]", r"\]")):
        MessageType(definition)


def test_deep_nesting_is_an_error() -> None:
    nested = {}
    for level in range(80):
        name = f"t/msg/L{level}"
        nested[name] = compound(name, ("x", f"t/msg/L{level + 1}"))
    nested["t/msg/L80"] = compound("t/msg/L80", ("x", "int8"))
    first = nested["t/msg/L0"]
    with pytest.raises(DefinitionError, match="deeper"):
        MessageType(Definition(first.name, 2, first.fields, nested=nested))


def test_text_has_to_bring_what_it_needs() -> None:
    text = "other_msgs/Part part\n" + "=" * 80 + "\nMSG: other_msgs/Part\nint8 x"
    assert MessageType.from_text("t/msg/A", text, ros=1).create(part={"x": 3}).part.x == 3
    with pytest.raises(DefinitionError, match=r":1:1: .* does not define other_msgs/msg/Part"):
        MessageType.from_text("t/msg/A", "other_msgs/Part part", ros=1)


def test_generated_code_shows_in_tracebacks() -> None:
    kind = MessageType.from_text("t/msg/Traced", "string a\nfloat64 b")
    try:
        kind.path("b")(kind.encode()[:9])
    except rosglass.DecodeError as error:
        text = "".join(traceback.format_exception(error))
    assert "rosglass generated: path b t/msg/Traced cdr" in text
    assert "return failed(b, error)" in text


def test_types_can_be_first_used_by_many_threads() -> None:
    text = "float64[] x\nstring[] y\nstd_msgs/Header[] h\n" + "=" * 80
    text += "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id"
    kind = MessageType.from_text("thread_msgs/msg/Fresh", text, ros=1)
    value = {"x": [1.0, 2.0], "y": ["a"], "h": [{"frame_id": "map"}] * 20}
    problems: list[Exception] = []

    def work(start: threading.Barrier) -> None:
        start.wait()
        try:
            for _ in range(5):
                data = kind.encode(value)
                assert kind.decode(data).h[3].frame_id == "map"
                assert kind.path("h[19].frame_id")(data) == "map"
        except Exception as error:
            problems.append(error)

    barrier = threading.Barrier(8)
    threads = [threading.Thread(target=work, args=(barrier,)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert problems == []


def test_defaults_of_definitions_are_honoured() -> None:
    text = 'float64 x 1.5\nint32[] v [1, 2]\nstring s "hey"\nint8[3] f [1, 2, 3]\nint32 LIMIT=5'
    kind = MessageType.from_text("t/msg/Defaults", text)
    for message in (kind.create(), kind.decode(kind.encode()), kind.decode(kind.encode(x=1.5))):
        assert message.to_dict()["x"] == 1.5
        assert list(message.v) == [1, 2]
        assert message.s == "hey"
        assert list(message.f) == [1, 2, 3]
    first, second = kind.create(), kind.create()
    first.v[0] = 9
    assert second.v[0] == 1
    assert kind.constants.LIMIT == 5
    assert kind.fields[1].type.array is ArrayKind.UNBOUNDED
