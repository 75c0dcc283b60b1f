"""A node's parameters, and those of another node, on every wire."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import rosglass
from rosglass.comm import ParameterDescriptor, ParameterType
from rosglass.errors import ParameterError

EVENTS = "/parameter_events"


@pytest.fixture
def own(robot, topic, wire):
    """The robot's parameters, below a group that no other test uses."""
    return _Group(robot.parameters, topic.strip("/"), "/" if wire.is_ros1 else ".")


@pytest.fixture
def client(robot, console):
    with console.create_parameter_client("/robot") as client:
        assert client.wait_for_server(30)
        yield client


class _Group:
    """Parameters whose names begin with a group: those of ROS 1 outlive their node."""

    def __init__(self, parameters, group, separator):
        self.all, self.group, self.separator = parameters, group, separator

    def name(self, *parts):
        return self.separator.join((self.group, *parts))


# -- our own -----------------------------------------------------------------------------------


def test_declared_parameter_is_read_set_described_and_forgotten(own):
    speed, gain = own.name("speed"), own.name("arm", "gain")
    parameters = own.all
    described = ParameterDescriptor(description="In m/s.")
    assert parameters.declare(speed, 1.5, described) == 1.5
    assert parameters.declare(gain, 2) == 2
    assert speed in parameters
    assert {speed, gain} <= set(parameters.names())
    assert parameters.names() == sorted(parameters.names())
    parameters.set({speed: 2.5, gain: 3})
    assert (parameters.get(speed), parameters.get(gain)) == (2.5, 3)
    found = parameters.describe(speed)
    assert (found.name, found.type, found.description) == (speed, ParameterType.DOUBLE, "In m/s.")
    with pytest.raises(ParameterError, match="is declared already"):
        parameters.declare(speed, 1.0)
    parameters.undeclare(speed)
    assert speed not in parameters
    with pytest.raises(ParameterError):
        parameters.get(speed)


def test_one_of_several_threads_declares_a_parameter(own):
    described = ParameterDescriptor(description="In m/s.")

    def declare(name):
        try:
            return own.all.declare(name, 1.5, described)
        except ParameterError as error:
            return str(error)

    with ThreadPoolExecutor(4) as pool:
        for number in range(5):
            results = list(pool.map(declare, [own.name(f"speed{number}")] * 4))
            assert results.count(1.5) == 1
            assert sum("is declared already" in str(result) for result in results) == 3


@pytest.mark.parametrize(
    "value", [True, -7, 1.5, "Grüße", b"\0\xff", [True, False], [1, 2], [1.5, 2.5], ["a", ""]]
)
def test_values_keep_their_types(own, client, eventually, value):
    name = own.name("value")
    own.all.declare(name, value)
    (found,) = client.get([name]).values()
    assert (type(found), found) == (type(value), value)
    assert client.describe([name])[name].type.name == own.all.describe(name).type.name


def test_invalid_value_is_refused_before_it_is_set(own, client):
    name = own.name("odd")
    for value in (object(), 2**70, "\0", [1, object()]):
        with pytest.raises(ParameterError):
            own.all.declare(name, value)
    own.all.declare(name, 1)
    for value in (object(), 2**70):
        with pytest.raises(ParameterError):
            client.set({name: value})
    own.all.declare(second := own.name("second"), 1)
    with pytest.raises(ParameterError, match=second):
        own.all.set({name: 2, second: 2**70})
    assert own.all.get(name) == own.all.get(second) == 1, "all or none"
    for values in ("speed", None, [name]):
        with pytest.raises(ParameterError, match="set by a dict"):
            own.all.set(values)
        with pytest.raises(ParameterError, match="set by a dict"):
            client.set(values)


def test_numpys_values_become_plain_ones(own):
    one, many = own.name("one"), own.name("many")
    assert own.all.declare(one, 0.5) == 0.5
    own.all.declare(many, [0.5])
    own.all.set({one: np.float64(1.5), many: np.array([1.5, 2.5])})
    assert (own.all.get(one), own.all.get(many)) == (1.5, [1.5, 2.5])


def test_own_changes_are_reported_with_names_and_values(own, eventually):
    name, events = own.name("speed"), []
    own.all.declare(name, 1.5)
    with own.all.on_change(events.append):
        own.all.set({name: 2.5})
        eventually(lambda: [event.changed for event in events if event.changed] == [{name: 2.5}])
        own.all.undeclare(name)
        eventually(lambda: events[-1].deleted == (name,), lambda: events)
    assert {event.node for event in events} == {"/robot"}
    for callback in (5, None, _coroutine):
        with pytest.raises(rosglass.Error):
            own.all.on_change(callback)


async def _coroutine(_):
    """Would be called, and nothing in it would ever run."""


def test_file_that_was_saved_is_loaded(own, tmp_path):
    names = {own.name("speed"): 1.5, own.name("arm", "list"): [1, 2], own.name("text"): "yes"}
    for name, value in names.items():
        own.all.declare(name, value)
    own.all.save(tmp_path / "robot.yaml")
    own.all.set({own.name("speed"): 2.5, own.name("arm", "list"): [3], own.name("text"): "no"})
    own.all.load(tmp_path / "robot.yaml")
    assert {name: own.all.get(name) for name in names} == names
    with pytest.raises(ParameterError, match="nowhere"):
        own.all.load(tmp_path / "nowhere.yaml")


# -- another node's ----------------------------------------------------------------------------


def test_parameters_of_another_node_are_read_and_set(own, client):
    speed, gain = own.name("speed"), own.name("arm", "gain")
    own.all.declare(speed, 1.5)
    own.all.declare(gain, 2)
    assert client.ready
    assert {speed, gain} <= set(client.names())
    assert client.names([own.group]) == client.names(own.group) == sorted((speed, gain))
    assert client.names(own.group, depth=1) == [speed]
    nix = own.name("nix")
    assert client.get([speed, nix, speed]) == {speed: 1.5, nix: None}
    assert client.get(speed) == {speed: 1.5}
    assert client.get([]) == {}
    assert client.get()[gain] == 2
    assert client.describe([gain])[gain].type is ParameterType.INTEGER
    assert client.describe([nix])[nix].type is ParameterType.NOT_SET
    results = client.set({speed: 2.5, gain: 3})
    assert [result.successful for result in results.values()] == [True, True]
    assert (own.all.get(speed), own.all.get(gain)) == (2.5, 3)
    assert client.set({}) == {}
    assert client.set_atomically({speed: 3.5}).successful
    assert own.all.get(speed) == 3.5


def test_wrong_arguments_are_refused(client):
    with pytest.raises(ParameterError, match="/robot: names must be a list of names, got 5"):
        client.get(5)
    with pytest.raises(ParameterError, match="/robot: prefixes must be a list of names, got 5"):
        client.names(5)
    for name in ("", 5, ["a"], None):
        with pytest.raises(ParameterError, match="name must be a non-empty string"):
            client.get([name])
    for depth in (-1, 1.5, True, "1", None):
        with pytest.raises(rosglass.ArgumentError, match="/robot: depth"):
            client.names(depth=depth)
    with pytest.raises(rosglass.ArgumentError, match="timeout"):
        client.get(timeout=-1)
    for callback in (5, None, _coroutine):
        with pytest.raises(rosglass.ArgumentError, match="watch"):
            client.watch(callback)


def test_first_change_after_watching_begins_is_reported(
    own, client, wire, robot, console, eventually
):
    name, other, changes = own.name("speed"), own.name("other"), []
    own.all.declare(name, 1.5)

    def is_linked():
        # Over DDS and Zenoh, events come from when the other node knows the subscription.
        ends = robot.subscriptions(EVENTS)
        return wire.is_ros1 or any(end.node.full == "/console" for end in ends)

    own.all.declare(other, 1)
    with client.watch(lambda e: changes.append((e.node, e.new, e.changed, e.deleted))):
        eventually(is_linked)
        assert client.set({name: 2.5})[name].successful
        eventually(lambda: changes == [("/robot", {}, {name: 2.5}, ())], lambda: changes)
        own.all.undeclare(other)
        eventually(lambda: changes[1:] == [("/robot", {}, {}, (other,))], lambda: changes)
    own.all.set({name: 3.5})
    later = []
    with client.watch(later.append):
        eventually(lambda: client.set({name: time.monotonic()}) and later)
    assert len(changes) == 2


def test_files_of_another_node(own, client, tmp_path):
    speed, text = own.name("speed"), own.name("text")
    own.all.declare(speed, 1.5)
    own.all.declare(text, "x")
    client.save(tmp_path / "robot.yaml")
    assert client.set({speed: 2.5})[speed].successful
    assert {speed, text} <= set(client.load(tmp_path / "robot.yaml"))
    assert own.all.get(speed) == 1.5
    (tmp_path / "empty.yaml").write_text("")
    with pytest.raises(ParameterError, match="has no parameters"):
        client.load(tmp_path / "empty.yaml")


def test_closed_client_raises(client, console):
    client.close()
    client.close()
    assert not client.ready
    assert "/robot" in repr(client)
    for use in (
        client.get,
        client.names,
        lambda: client.set({}),
        lambda: client.watch(print),
        lambda: client.wait_for_server(30),
    ):
        with pytest.raises(rosglass.NodeClosedError, match="closed"):
            use()


def test_parameters_of_a_closed_node_say_so(own, robot):
    name = own.name("speed")
    own.all.declare(name, 1.5)
    robot.close()
    for use in (
        lambda: own.all.get(name),
        lambda: own.all.set({name: 2.5}),
        lambda: own.all.declare(own.name("other"), 1),
        lambda: own.all.undeclare(name),
        lambda: own.all.describe(name),
        own.all.names,
        lambda: own.all.on_change(print),
        lambda: own.all.load("robot.yaml"),
        lambda: own.all.save("robot.yaml"),
        lambda: robot.parameters,
    ):
        with pytest.raises(rosglass.NodeClosedError, match="closed"):
            use()
