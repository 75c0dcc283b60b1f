"""A node's own parameters, by ROS's rules."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import IMMEDIATE, ParameterDescriptor, ParameterEvent, ParameterType, Range
from rosglass.errors import ConversionError, ParameterError
from rosglass.ros2.parameters import Ros2Parameters, TypedValue

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

D, T = ParameterDescriptor, ParameterType
EVERYWHERE = ["start_type_description_service", "use_sim_time"]


@pytest.fixture
def parameters() -> Ros2Parameters:
    return Ros2Parameters("/arm", IMMEDIATE, {"given": 7, "wrong": "text"})


def test_parameters_of_every_node_are_declared_from_the_start(parameters: Ros2Parameters) -> None:
    assert parameters.names() == EVERYWHERE
    assert parameters.describe("start_type_description_service").read_only
    assert parameters.get("use_sim_time") is False
    assert "use_sim_time" in parameters
    assert "other" not in parameters


def test_overrides_win_over_defaults(parameters: Ros2Parameters) -> None:
    assert parameters.declare("given", 1) == 7
    assert parameters.overrides == {"given": 7, "wrong": "text"}
    with pytest.raises(ParameterError, match=r"of type integer, .* 'text' .* was started with"):
        parameters.declare("wrong", 1)
    assert "wrong" not in parameters


def test_lists_are_copied(parameters: Ros2Parameters) -> None:
    default = [1, 2]
    got = parameters.declare("list", default)
    default.append(3)
    got.append(4)  # type: ignore[union-attr]
    parameters.get("list").append(5)  # type: ignore[union-attr]
    assert parameters.get("list") == [1, 2]


@pytest.mark.parametrize(
    ("default", "descriptor", "message"),
    [
        (None, None, "has neither a default nor a type"),
        ([], None, "an empty list does not say its type"),
        (1, D(type=T.DOUBLE), "of type double, and cannot be set to 1 of type integer; write 1.0"),
        ([1], D(type=T.DOUBLE_ARRAY), "write 1.0 instead of 1"),
        (5, D(range=Range(0, 3)), "5 is outside 0 to 3"),
        ("x", D(range=Range(0, 3)), "does not go with the type string"),
        (1, D(range=Range(3, 0)), "is empty"),
        (1, D(range=Range(0, 3, -1)), "is empty"),
        (1, D(range=Range(0, 2.5)), "must be of whole numbers"),
        (1.0, D(range=Range(float("-inf"), 1.0, 0.5)), "counts steps from an infinite end"),
        (1, "text", "is not a ParameterDescriptor"),
        ({}, None, "a parameter is a bool"),
    ],
)
def test_bad_declarations_are_refused(
    parameters: Ros2Parameters, default: Any, descriptor: Any, message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        parameters.declare("p", default, descriptor)
    assert "p" not in parameters


def test_type_without_a_default_is_not_set(parameters: Ros2Parameters) -> None:
    assert parameters.declare("p", None, D(type=T.INTEGER)) is None
    assert parameters.get("p") is None
    with pytest.raises(ParameterError, match="of type integer"):
        parameters.set({"p": "x"})
    parameters.set({"p": 3})
    assert parameters.get("p") == 3


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (2, "is of type double, and cannot be set to 2 of type integer; write 1.0 instead of 1"),
        ("1.0", "cannot be set to '1.0' of type string"),
        (None, "cannot be set to None of type not set"),
        (5.5, "5.5 is outside 0.0 to 5.0"),
        (1.1, "1.1 is not among"),
    ],
)
def test_types_and_ranges_are_kept(parameters: Ros2Parameters, value: Any, message: str) -> None:
    parameters.declare("speed", 1.0, D(range=Range(0.0, 5.0, 0.5)))
    with pytest.raises(ParameterError, match=message):
        parameters.set({"speed": value})
    assert parameters.get("speed") == 1.0
    parameters.set({"speed": 2.5})
    assert parameters.get("speed") == 2.5


def test_empty_list_keeps_the_type(parameters: Ros2Parameters) -> None:
    parameters.declare("names", ["a"])
    parameters.declare("blob", b"a")
    parameters.set({"names": [], "blob": []})
    assert (parameters.get("names"), parameters.get("blob")) == ([], b"")
    parameters.set({"names": ["b"]})
    with pytest.raises(ParameterError, match="of type string array"):
        parameters.set({"names": [1]})


def test_dynamic_typing_lets_types_change_and_none_forget(parameters: Ros2Parameters) -> None:
    parameters.declare("any", 1, D(dynamic_typing=True))
    parameters.set({"any": "text"})
    assert parameters.describe("any").type is T.STRING
    parameters.set({"any": None})
    assert "any" not in parameters


def test_read_only_parameters_stay(parameters: Ros2Parameters) -> None:
    parameters.declare("fixed", 1, D(read_only=True))
    with pytest.raises(ParameterError, match="/arm: parameter 'fixed' is read-only"):
        parameters.set({"fixed": 2})
    with pytest.raises(ParameterError, match="read-only and cannot be undeclared"):
        parameters.undeclare("fixed")
    assert parameters.get("fixed") == 1


@pytest.mark.parametrize(
    "use",
    [
        lambda p: p.get("Speed"),
        lambda p: p.set({"Speed": 1.0}),
        lambda p: p.describe("Speed"),
        lambda p: p.undeclare("Speed"),
    ],
)
def test_undeclared_parameter_is_reported(
    parameters: Ros2Parameters, use: Callable[[Ros2Parameters], None]
) -> None:
    with pytest.raises(ParameterError, match=r"/arm: parameter 'Speed' is not declared; declare"):
        use(parameters)
    parameters.declare("speed", 1.0)
    with pytest.raises(ParameterError, match="did you mean 'speed'"):
        use(parameters)


def test_changes_are_notified(parameters: Ros2Parameters) -> None:
    events: list[ParameterEvent] = []
    handle = parameters.on_change(events.append)
    parameters.declare("a", 1)
    parameters.declare("b", [1.0])
    parameters.set({"a": 2, "b": []})
    parameters.undeclare("a")
    assert events == [
        ParameterEvent("/arm", {"a": 1}, {}, ()),
        ParameterEvent("/arm", {"b": [1.0]}, {}, ()),
        ParameterEvent("/arm", {}, {"a": 2, "b": []}, ()),
        ParameterEvent("/arm", {}, {}, ("a",)),
    ]
    handle.close()
    parameters.set({"b": [2.0]})
    assert len(events) == 4


def test_changes_made_in_a_callback_are_notified_afterwards(parameters: Ros2Parameters) -> None:
    seen: list[Any] = []
    parameters.declare("a", 0)

    def follow(event: ParameterEvent) -> None:
        if event.changed["a"] == 1:
            parameters.set({"a": 2})
        seen.append(event.changed["a"])

    parameters.on_change(follow)
    parameters.set({"a": 1})
    assert seen == [1, 2]


def test_callbacks_may_refuse_values(
    parameters: Ros2Parameters, caplog: pytest.LogCaptureFixture
) -> None:
    parameters.declare("a", 1)
    asked: list[Mapping[str, Any]] = []

    def even(values: Mapping[str, Any]) -> str:
        asked.append(dict(values))
        return "" if values.get("a", 0) % 2 == 0 else f"{values['a']} is odd"

    handle = parameters.on_set(even)
    parameters.set({"a": 2})
    with pytest.raises(ParameterError, match="/arm: 3 is odd"):
        parameters.set({"a": 3})
    assert asked == [{"a": 2}, {"a": 3}]
    handle.close()
    handle.close()
    parameters.set({"a": 3})

    parameters.on_set(lambda values: None if "b" in values else 1 / 0)  # type: ignore[arg-type, return-value]
    with pytest.raises(ParameterError, match="refused with ZeroDivisionError"):
        parameters.set({"a": 4})
    assert "a callback of on_set() failed" in caplog.text
    parameters.declare("b", 1)


def test_callbacks_are_asked_again_when_another_thread_was_faster(
    parameters: Ros2Parameters,
) -> None:
    parameters.declare("a", 1)
    parameters.declare("b", 1)
    asked = 0

    def slow(values: Mapping[str, Any]) -> str:
        nonlocal asked
        if "a" in values:
            asked += 1
            if asked == 1:  # another thread sets something in the middle of it
                thread = threading.Thread(target=lambda: parameters.set({"b": 2}))
                thread.start()
                thread.join(5)
        return ""

    parameters.on_set(slow)
    parameters.set({"a": 2})
    assert asked == 2
    assert (parameters.get("a"), parameters.get("b")) == (2, 2)


def test_bad_callbacks_are_refused(parameters: Ros2Parameters) -> None:
    async def never() -> None:
        """Would be called, and nothing in it would ever run."""

    for callback in (3, never):
        with pytest.raises(ConversionError, match="on_set"):
            parameters.on_set(callback)  # type: ignore[arg-type]
        with pytest.raises(ConversionError, match="on_change"):
            parameters.on_change(callback)  # type: ignore[arg-type]
    parameters.on_set(lambda _: 3)  # type: ignore[arg-type, return-value]
    with pytest.raises(ParameterError, match="returned 3 instead of a text"):
        parameters.set({"use_sim_time": True})


@pytest.mark.parametrize(
    ("prefixes", "depth", "names"),
    [
        ([], 0, ["a", "a.b", "a.b.c", "ab.c", *EVERYWHERE]),
        ([], 1, ["a", *EVERYWHERE]),
        ([], 2, ["a", "a.b", "ab.c", *EVERYWHERE]),
        (["a"], 0, ["a", "a.b", "a.b.c"]),
        (["a"], 1, ["a", "a.b"]),
        (["a.b", "ab"], 0, ["a.b", "a.b.c", "ab.c"]),
        (["nothing"], 0, []),
    ],
)
def test_names_are_found_by_prefix_and_depth(
    parameters: Ros2Parameters, prefixes: list[str], depth: int, names: list[str]
) -> None:
    for name in ("a", "a.b", "a.b.c", "ab.c"):
        parameters.declare(name, 1)
    assert parameters.find(prefixes, depth) == names


def test_file_is_given_by_its_path(parameters: Ros2Parameters) -> None:
    with pytest.raises(ParameterError, match="given by its path, got 5"):
        parameters.load(5)  # type: ignore[arg-type]


def test_try_set_gives_a_reason_instead_of_raising(parameters: Ros2Parameters) -> None:
    assert "not declared" in parameters.try_set({"x": TypedValue(T.BOOL, True)})
    assert parameters.try_set({"use_sim_time": TypedValue(T.BOOL, True)}) == ""
    assert parameters.typed_value("use_sim_time") == TypedValue(T.BOOL, True)
    assert parameters.typed_value("x") == TypedValue(T.NOT_SET, None)


def test_files_that_do_not_fit(parameters: Ros2Parameters, tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    parameters.declare("a.b", 1.0)
    file.write_text("/arm: {ros__parameters: {a: {b: 1}}}")
    with pytest.raises(
        ParameterError, match=r"arm\.yaml: /arm: parameter 'a\.b' is of type double"
    ):
        parameters.load(file)
    file.write_text("/leg: {ros__parameters: {a: 1}}")
    with pytest.raises(ParameterError, match=r"arm\.yaml has no parameters for /arm"):
        parameters.load(file)


def test_no_callback_runs_after_closing(parameters: Ros2Parameters) -> None:
    events: list[ParameterEvent] = []
    parameters.on_change(events.append)
    parameters.on_set(lambda _: "never")
    parameters.close()
    parameters.close()
    assert not parameters.try_set({"use_sim_time": TypedValue(T.BOOL, True)})
    assert not events
