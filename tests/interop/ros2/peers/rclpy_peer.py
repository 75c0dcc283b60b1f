"""A real ROS 2 node: rclpy, run with the Python of .venv-rclpy; ROS_DOMAIN_ID picks its domain.

`rclpy_peer.py NAME`. It runs tasks from standard input, one JSON object a line:
{"do": <a function below>, "number": N, ...its arguments}; what that returns it prints as
{"done N": ...}, and what its callbacks receive as {"received TOPIC": ...}, {"served SERVICE": ...}.
"""

from __future__ import annotations

import array
import importlib
import json
import sys
import threading
import time
from concurrent.futures import Future
from typing import Any

import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from summary import report, summary
from waiting import at_rate, eventually

#: Seconds that the peer waits for what its task needs.
LIMIT_S = 60.0

rclpy.init()
node = rclpy.create_node(sys.argv[1], namespace="/robot")
node.declare_parameter("speed", 0.5)
node.declare_parameter("name", "rover")
group = ReentrantCallbackGroup()
publishers: dict[str, Any] = {}
clients: dict[str, Any] = {}
#: Replies that ``take_replies`` waits for.
replies: list[Any] = []
#: Subscriptions, servers and action clients.
kept: list[Any] = []


def load(name: str) -> Any:
    package, kind, base = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), base)


def profile(latched: bool = False, best_effort: bool = False, depth: int = 10) -> QoSProfile:
    made = QoSProfile(depth=depth)
    if latched:
        made.durability = DurabilityPolicy.TRANSIENT_LOCAL
    if best_effort:
        made.reliability = ReliabilityPolicy.BEST_EFFORT
    return made


def fill(message: Any, value: dict[str, Any]) -> Any:
    """Set a message's fields; {"octet": N} is a byte's value, {"fill": N} that many bytes."""
    for name, given in value.items():
        field = getattr(message, name)
        if hasattr(field, "get_fields_and_field_types"):
            fill(field, given)
        elif isinstance(given, dict) and "octet" in given:
            setattr(message, name, bytes([given["octet"]]))
        elif isinstance(given, dict):
            count = given["fill"]
            pattern = bytes(range(251))
            data = pattern * (count // 251) + pattern[: count % 251]
            setattr(message, name, array.array("B", data))
        else:
            setattr(message, name, given)
    return message


def plain(value: Any) -> Any:
    """Return a message as plain data."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, list) and value and hasattr(value[0], "get_fields_and_field_types"):
        return [plain(item) for item in value]
    return value[0] if isinstance(value, bytes) else summary(value)


def finish(future: Any) -> Any:
    done: Future[Any] = Future()
    future.add_done_callback(lambda f: done.set_result(f.result()))
    return done.result(LIMIT_S)


# -- topics ----------------------------------------------------------------------------------------


def advertise(topic: str, type: str, **qos: Any) -> None:
    publishers[topic] = load(type), node.create_publisher(load(type), topic, profile(**qos))


def publish(topic: str, values: list[Any], period: float = 0.0, matched: int = 1) -> None:
    """Publish values on an advertised topic, once it has that many subscriptions."""
    kind, publisher = publishers[topic]
    eventually(lambda: publisher.get_subscription_count() >= matched, timeout=LIMIT_S)
    for number in at_rate(period, len(values)):
        publisher.publish(fill(kind(), values[number]))


def subscribe(topic: str, type: str, quiet: bool = False, **qos: Any) -> None:
    """Say what comes: the values, or, if quiet, when each came (nanoseconds of the system)."""

    def receive(message: Any) -> None:
        report(**{f"received {topic}": time.time_ns() if quiet else plain(message)})

    kept.append(node.create_subscription(load(type), topic, receive, profile(**qos)))


# -- services --------------------------------------------------------------------------------------


def serve(service: str, type: str, delay: float = 0.0) -> None:
    """Answer each request with its own values, those the response has, after a while."""

    def respond(request: Any, response: Any) -> Any:
        time.sleep(delay)
        names = set(response.get_fields_and_field_types())
        for name in names & set(request.get_fields_and_field_types()):
            setattr(response, name, getattr(request, name))
        report(**{f"served {service}": plain(request)})
        return response

    kept.append(node.create_service(load(type), service, respond))


def send_request(service: str, type: str, request: dict[str, Any]) -> None:
    """Call without waiting; ``take_replies`` does."""
    kind = load(type)
    if service not in clients:
        clients[service] = node.create_client(kind, service)
    assert clients[service].wait_for_service(LIMIT_S), service
    replies.append(clients[service].call_async(fill(kind.Request(), request)))


def take_replies() -> Any:
    """Return the replies to all requests that were sent, in the order of these."""
    answers = [plain(finish(reply)) for reply in replies]
    replies.clear()
    return answers


def call(service: str, type: str, requests: list[Any]) -> Any:
    """Call, one after the other."""
    answers = []
    for request in requests:
        send_request(service, type, request)
        answers += take_replies()
    return answers


# -- actions ---------------------------------------------------------------------------------------


def act(action: str) -> None:
    """Execute Fibonacci goals; those with an order above 100 go on until they are cancelled."""
    kind = load("test_msgs/action/Fibonacci")

    def execute(goal: Any) -> Any:
        sequence = [0, 1]
        feedback = kind.Feedback()
        while len(sequence) < goal.request.order:
            if goal.is_cancel_requested:
                goal.canceled()
                return kind.Result(sequence=sequence)
            sequence = [*sequence, 1 if len(sequence) > 40 else sequence[-1] + sequence[-2]]
            feedback.sequence = sequence
            goal.publish_feedback(feedback)
            time.sleep(0.05)
        goal.succeed()
        return kind.Result(sequence=sequence)

    kept.append(
        ActionServer(
            node, kind, action, execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT, callback_group=group,
        )
    )  # fmt: skip


def send_goal(action: str, order: int, cancel_after: int = 0) -> Any:
    """Send a Fibonacci goal; cancel it after that many feedbacks."""
    kind = load("test_msgs/action/Fibonacci")
    client = ActionClient(node, kind, action)
    kept.append(client)
    assert client.wait_for_server(LIMIT_S), action
    feedback: list[int] = []
    enough = threading.Event()

    def follow(message: Any) -> None:
        feedback.append(len(message.feedback.sequence))
        if len(feedback) >= cancel_after:
            enough.set()

    goal = finish(client.send_goal_async(kind.Goal(order=order), feedback_callback=follow))
    if goal.accepted and cancel_after:
        assert enough.wait(LIMIT_S)
        finish(goal.cancel_goal_async())
    ended = finish(goal.get_result_async()) if goal.accepted else None
    return ended and {
        "status": ended.status,
        "result": list(ended.result.sequence),
        "feedback": feedback,
    }


# -- parameters and graph --------------------------------------------------------------------------


def parameters(of: str, set: dict[str, Any]) -> Any:
    """Set parameters of a node, and get them back, with all it has."""
    client = AsyncParameterClient(node, of)
    assert client.wait_for_services(LIMIT_S), of
    results = finish(client.set_parameters([Parameter(n, value=v) for n, v in set.items()])).results
    values = finish(client.get_parameters(list(set))).values
    return {
        "values": [parameter_value_to_python(value) for value in values],
        "successful": [result.successful for result in results],
        "reasons": [result.reason for result in results],
        "names": list(finish(client.list_parameters([], 0)).result.names),
    }


def own_parameter(name: str) -> Any:
    return node.get_parameter(name).value


def graph() -> Any:
    """Say what is in the graph."""
    return {
        "nodes": sorted(f"{ns.rstrip('/')}/{n}" for n, ns in node.get_node_names_and_namespaces()),
        "topics": dict(node.get_topic_names_and_types()),
        "services": dict(node.get_service_names_and_types()),
    }


def endpoints(topic: str) -> Any:
    """Say who publishes and subscribes to a topic."""
    found = [
        *node.get_publishers_info_by_topic(topic),
        *node.get_subscriptions_info_by_topic(topic),
    ]
    return [
        {
            "node": f"{end.node_namespace.rstrip('/')}/{end.node_name}",
            "type": end.topic_type,
            "kind": end.endpoint_type.name,
            "reliability": end.qos_profile.reliability.name,
            "durability": end.qos_profile.durability.name,
            "hash": str(end.topic_type_hash),
        }
        for end in found
    ]


TASKS = {
    task.__name__: task
    for task in (
        advertise, publish, subscribe, serve, send_request, take_replies, call, act, send_goal,
        parameters, own_parameter, graph, endpoints
    )
}  # fmt: skip


def spin() -> None:
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    try:
        executor.spin()
    except ExternalShutdownException:
        pass
    except BaseException as error:
        report(spin_ended=repr(error))
        raise


threading.Thread(target=spin, daemon=True).start()
report(ready=True)
for line in sys.stdin:
    request = json.loads(line)
    number = request.pop("number")
    report(**{f"done {number}": TASKS[request.pop("do")](**request)})
