"""Names of rclpy and rospy are answered with their counterpart in rosglass."""

from __future__ import annotations

import importlib
import pkgutil
import re
import signal
import subprocess
import sys
import threading

import pytest

import rosglass
from rosglass import Duration, InvalidNameError, Time, TypeNotFoundError
from rosglass.comm import rclpy_names
from rosglass.comm.log import NodeLogger
from rosglass.ros1 import Ros1Node

TEXT, TRIGGER = "std_msgs/msg/String", "std_srvs/srv/Trigger"
#: Members that objects have, and their classes have not.
ON_OBJECTS = {"name", "namespace", "topic", "type", "period", "goal", "nanoseconds"}


@pytest.fixture(params=["ros1://127.0.0.1:1", "zenoh://127.0.0.1:1"])
def node(request):
    with rosglass.connect(request.param, name="panel", own_services=False) as made:
        yield made


def class_of(kind):
    return NodeLogger if kind == "NodeLogger" else getattr(rosglass.comm, kind)


def with_subclasses(kind):
    return [kind, *(found for child in kind.__subclasses__() for found in with_subclasses(child))]


@pytest.mark.parametrize("kind", rclpy_names.MEMBERS)
def test_counterpart_of_a_member_exists(kind):
    found = class_of(kind)
    for name, instead in rclpy_names.MEMBERS[kind].items():
        assert not hasattr(found, name)
        check(instead, found)


@pytest.mark.parametrize("kind", rclpy_names.MEMBERS)
def test_errors_about_members_cover_up_no_member_and_make_no_attribute_slow(kind):
    importlib.import_module("rosglass.bags.replay_node")
    for wire in (rosglass.ros1, rosglass.ros2):
        for module in pkgutil.iter_modules(wire.__path__, f"{wire.__name__}."):
            importlib.import_module(module.name)
    for found in with_subclasses(class_of(kind)):
        covered = [name for name in rclpy_names.MEMBERS[kind] if not hasattr(found, name)]
        assert all(sum(name in vars(base) for base in found.__mro__) <= 1 for name in covered)
        # With __getattr__ Python looks up each attribute of each object the long way.
        assert not hasattr(found, "__getattr__")


@pytest.mark.parametrize("name", rclpy_names.FUNCTIONS)
def test_counterpart_of_a_function_exists(name):
    with pytest.raises(AttributeError, match=f"{name!r}: use ") as raised:
        getattr(rosglass, name)
    check(str(raised.value).partition(": use ")[2], rosglass)


def check(instead, kind):
    paths = re.findall(r"\bnode\.(\w+)", instead)
    for name in paths:
        assert hasattr(Ros1Node, name) or name in ON_OBJECTS, instead
    for name in re.findall(r"\bparameters\.(\w+)", instead):
        assert hasattr(rosglass.comm.Parameters, name), instead
    if not paths and (first := re.match(r"(\w+)(\(|$| and |,)", instead)):
        assert hasattr(kind, first[1]) or first[1] in ON_OBJECTS, instead


def test_each_kind_of_object_says_it(node):
    message = r"use node\.create_service_client\(name, type\)"
    with pytest.raises(AttributeError, match=message):
        node.create_client(TRIGGER, "/reset")
    with pytest.raises(AttributeError, match=r"Publisher has no get_subscription_count: use sub"):
        node.create_publisher("/chat", TEXT).get_subscription_count()
    with pytest.raises(AttributeError, match="use setLevel"):
        node.logger.getChild("arm").set_level(10)
    with pytest.raises(AttributeError, match=r"Clock has no sleep_for: use sleep\(duration\)"):
        node.clock.sleep_for(1)
    with pytest.raises(AttributeError, match=r"Time has no to_msg: use to_dict\(\)"):
        node.now().to_msg()
    with pytest.raises(AttributeError, match=r"has no attribute 'create_publsher'$"):
        node.create_publsher("/chat")
    assert not hasattr(node, "create_client")
    assert "create_client" not in dir(node)
    assert {"create_service_client", "name"} <= set(dir(node))


def test_error_in_a_property_is_not_covered_up(node):
    class Broken(rosglass.comm.Handle):
        @property
        def value(self):
            return self.no_such_part

        def close(self):
            pass

    with pytest.raises(AttributeError, match="'Broken' object has no attribute 'no_such_part'"):
        _ = Broken().value


@pytest.mark.parametrize(
    ("method", "name", "kind", "more"),
    [
        ("create_subscription", "/chat", TEXT, (print, 10)),
        ("create_subscription", "chat", TEXT, (print, 10)),
        ("create_publisher", "/chat", TEXT, (10,)),
        ("create_service_client", "/reset", TRIGGER, ()),
        ("create_service_server", "/reset", TRIGGER, (print,)),
        ("create_action_client", "/dock", "example_interfaces/action/Fibonacci", ()),
        ("create_action_server", "/dock", "example_interfaces/action/Fibonacci", (print,)),
    ],
)
@pytest.mark.parametrize("given", ["name", "type"])
def test_name_and_type_swapped(node, method, name, kind, more, given):
    first = kind if given == "name" else rosglass.load(kind)
    message = f"{method}() takes the name first, then the type: {method}({name!r}, {kind!r}, ...)"
    with pytest.raises(InvalidNameError, match=f"^{re.escape(message)}$"):
        getattr(node, method)(first, name, *more)


def test_classes_of_rclpy_and_rospy_and_callbacks_as_types(node):
    rclpy = type("String", (), {"__module__": "std_msgs.msg._string"})
    rospy = type("String", (), {"__module__": "std_msgs.msg._String", "_type": "std_msgs/String"})
    message = re.escape(f"create_subscription('/chat', {TEXT!r}, ...)")
    with pytest.raises(TypeNotFoundError, match=message):
        node.create_subscription("/chat", rclpy, print)
    with pytest.raises(InvalidNameError, match=message):
        node.create_subscription(rclpy, "/chat", print)
    with pytest.raises(TypeNotFoundError, match=r"'std_msgs/String', \.\.\."):
        node.create_subscription("/chat", rospy, print)
    with pytest.raises(
        TypeNotFoundError, match=re.escape("create_subscription('/chat', callback=")
    ):
        node.create_subscription("/chat", print)


@pytest.mark.parametrize("name", ["camera/image", "std_msgs/msg/String"])
def test_topics_that_look_like_types_are_topics(node, name):
    with pytest.raises(rosglass.Error) as raised:
        node.create_subscription(name, "image" if name == "camera/image" else "no_msgs/msg/Such")
    assert "takes the name first" not in str(raised.value)
    node.create_subscription(name, TEXT).close()


@pytest.mark.parametrize("wire", ["cdr", "ros1"])
def test_times_less_the_stamps_of_messages(wire):
    ros1 = wire == "ros1"
    kind = rosglass.load("visualization_msgs/msg/Marker", ros=1 if ros1 else 2)
    words = ("secs", "nsecs") if ros1 else ("sec", "nanosec")
    fields = {
        "header": {"stamp": dict(zip(words, (5, 7), strict=True))},
        "lifetime": dict(zip(words, (2, 1), strict=True)),
    }
    message = kind.decode(kind.encode(fields, wire=wire), wire=wire)
    now, stamp = Time.from_parts(8, 9), message.header.stamp
    assert now - stamp == Duration(3_000_000_002)
    assert stamp - now == Duration(-3_000_000_002)
    assert now - message.lifetime == Time(6_000_000_008)
    assert now + message.lifetime == Time(10_000_000_010)
    for wrong in (5, "5", message):
        with pytest.raises(TypeError):
            now - wrong


def test_spinning_ends_as_the_node_is_closed(node):
    spinning = threading.Thread(target=node.spin)
    spinning.start()
    node.close()
    spinning.join(30)
    assert not spinning.is_alive()
    node.spin()


PROGRAM = """
import rosglass
node = rosglass.connect("ros1://127.0.0.1:1", name="panel", own_services=False)
node.create_timer(0.05, lambda: print("tick", flush=True))
node.spin()
print("closed", node.status().state.value)
"""


def test_ctrl_c_ends_a_program_that_spins():
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert program.stdout.readline() == "tick\n"
    program.send_signal(signal.SIGINT)
    out, err = program.communicate(timeout=60)
    assert out.endswith("closed closed\n")
    assert "Traceback" not in err
    assert program.returncode == 0
