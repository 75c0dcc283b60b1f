"""Names in rclpy and rospy, and their counterparts here, for hints in errors."""

from __future__ import annotations

import inspect
from typing import NoReturn, TypeVar

from rosglass.errors import InvalidNameError, TypeNotFoundError
from rosglass.interfaces.names import split_name

__all__ = ["FUNCTIONS", "MEMBERS", "check_order", "hint_at_function", "hint_at_members"]

_T = TypeVar("_T")
_CLOSE = "close() ends it, and so does closing the node"
_NO_SPIN = "callbacks run on threads of their own; node.spin() waits until Ctrl-C or close()"
_ENDS = dict.fromkeys(("destroy", "shutdown"), _CLOSE)
_TOPIC_ENDS = {**_ENDS, "unregister": _CLOSE}
_PARAMETERS = {
    "declare_parameter": "node.parameters.declare(name, value)",
    "declare_parameters": "node.parameters.declare(name, value), one by one",
    "undeclare_parameter": "node.parameters.undeclare(name)",
    "get_parameter": "node.parameters.get(name), which returns the value itself",
    "get_parameters": "node.parameters.get(name), one by one",
    "get_parameter_or": "node.parameters.get(name)",
    "has_parameter": "name in node.parameters.names()",
    "list_parameters": "node.parameters.names()",
    "set_parameters": "node.parameters.set({name: value})",
    "set_parameters_atomically": "node.parameters.set({name: value})",
    "describe_parameter": "node.parameters.describe(name)",
    "describe_parameters": "node.parameters.describe(name)",
    "add_on_set_parameters_callback": "node.parameters.on_set(callback)",
    "add_post_set_parameters_callback": "node.parameters.on_change(callback)",
}
#: Class -> member of rclpy's or rospy's class -> its replacement.
MEMBERS: dict[str, dict[str, str]] = {
    "Node": {
        "create_client": "node.create_service_client(name, type)",
        "create_service": "node.create_service_server(name, type, callback)",
        "create_rate": "node.create_timer(period, callback), or node.clock.sleep(seconds)",
        "destroy_node": "node.close()",
        "destroy": "node.close()",
        **{
            f"destroy_{end}": f"the {end}'s own close()"
            for end in ("publisher", "subscription", "client", "service", "timer")
        },
        "spin_once": _NO_SPIN,
        "executor": _NO_SPIN,
        "get_logger": "node.logger, as in node.logger.info('docked')",
        "get_clock": "node.clock, and node.now() for its time",
        "get_name": "node.name",
        "get_namespace": "node.namespace",
        "get_fully_qualified_name": "node.resolve(node.name)",
        "resolve_topic_name": "node.resolve(name)",
        "resolve_service_name": "node.resolve(name)",
        "get_node_names": "node.nodes()",
        "get_node_names_and_namespaces": "node.nodes()",
        "get_fully_qualified_node_names": "node.nodes()",
        "wait_for_node": "node.nodes(), after node.on_graph_change(callback) has called back",
        "get_topic_names_and_types": "node.topics()",
        "get_service_names_and_types": "node.services()",
        "get_publishers_info_by_topic": "node.publishers(topic)",
        "get_subscriptions_info_by_topic": "node.subscriptions(topic)",
        **dict.fromkeys(
            (
                "get_client_names_and_types_by_node",
                "get_publisher_names_and_types_by_node",
                "get_service_names_and_types_by_node",
                "get_subscriber_names_and_types_by_node",
            ),
            "node.endpoints(name)",
        ),
        "count_publishers": "len(node.publishers(topic))",
        "count_subscribers": "len(node.subscriptions(topic))",
        "count_services": "len(node.service_servers(name))",
        "count_clients": "len(node.service_clients(name))",
        **_PARAMETERS,
    },
    "Publisher": {
        **_TOPIC_ENDS,
        "get_subscription_count": "subscription_count()",
        "get_num_connections": "subscription_count()",
        "topic_name": "topic",
    },
    "Subscription": {
        **_TOPIC_ENDS,
        "get_publisher_count": "publisher_count()",
        "get_num_connections": "publisher_count()",
        "topic_name": "topic",
    },
    "ServiceClient": {
        **_ENDS,
        "service_is_ready": "ready",
        "wait_for_service": "wait_for_server(timeout)",
        "service_name": "name",
        "srv_name": "name",
    },
    "ServiceServer": {**_ENDS, "service_name": "name", "srv_name": "name"},
    "ActionClient": {
        **_ENDS,
        "send_goal_async": "send_goal(goal), which returns at once",
        "server_is_ready": "ready",
    },
    "ActionServer": _ENDS,
    "ClientGoal": {
        "get_result": "result(timeout)",
        "get_result_async": "done, a promise, or result(timeout)",
        "cancel_goal": "cancel()",
        "cancel_goal_async": "cancel()",
        "goal_id": "id_text",
    },
    "ServerGoal": {"request": "goal", "goal_id": "id_text"},
    "Timer": {
        "cancel": "close()",
        "destroy": "close()",
        "shutdown": "close()",
        "reset": "close() and node.create_timer(period, callback)",
        "timer_period_ns": "period.nanoseconds",
    },
    "Clock": {"sleep_for": "sleep(duration)", "create_jump_callback": "on_jump(callback)"},
    "Time": {
        "to_msg": "to_dict(), or the time itself as the field's value",
        "from_msg": "Time.from_parts(stamp.sec, stamp.nanosec)",
        "seconds_nanoseconds": "sec and nanosec",
        "to_sec": "seconds",
        "to_nsec": "nanoseconds",
    },
    "Duration": {
        "to_msg": "the duration itself as the field's value",
        "to_sec": "seconds",
        "to_nsec": "nanoseconds",
    },
    "NodeLogger": {
        "get_child": "getChild(name)",
        "set_level": "setLevel(level)",
        "get_effective_level": "getEffectiveLevel()",
        "is_enabled_for": "isEnabledFor(level)",
    },
}
_CONNECT = "rosglass.connect(url, name='panel') creates the node; no other setup is needed"
_LOG = "node.logger, as in node.logger.info('docked')"
_OWN_PARAMETERS = "node.parameters, or in ROS 1 node.parameter_server"
#: Function or class of the modules rclpy and rospy -> its replacement.
FUNCTIONS = {
    "init": _CONNECT,
    "init_node": _CONNECT,
    "create_node": _CONNECT,
    "spin": "node.spin()",
    "spin_once": _NO_SPIN,
    "spin_until_future_complete": "what call_async() returns has result(timeout)",
    "ok": "node.status(), or spin the node with node.spin()",
    "is_shutdown": "node.status(), or spin the node with node.spin()",
    "shutdown": "node.close()",
    "try_shutdown": "node.close()",
    "signal_shutdown": "node.close()",
    "Publisher": "node.create_publisher(topic, type)",
    "Subscriber": "node.create_subscription(topic, type, callback)",
    "Subscription": "node.create_subscription(topic, type, callback)",
    "Service": "node.create_service_server(name, type, callback)",
    "ServiceProxy": "node.create_service_client(name, type)",
    "ActionClient": "node.create_action_client(name, type)",
    "ActionServer": "node.create_action_server(name, type, execute)",
    "SimpleActionClient": "node.create_action_client(name, type)",
    "SimpleActionServer": "node.create_action_server(name, type, execute, simple=True)",
    "Timer": "node.create_timer(period, callback)",
    "Rate": "node.create_timer(period, callback), or node.clock.sleep(seconds)",
    "sleep": "node.clock.sleep(seconds)",
    "get_time": "node.now().seconds",
    "get_rostime": "node.now()",
    "get_logger": _LOG,
    **dict.fromkeys(("logdebug", "loginfo", "logwarn", "logerr", "logfatal", "logging"), _LOG),
    "wait_for_message": "node.wait_for_message(topic)",
    "wait_for_service": "node.create_service_client(name).wait_for_server(timeout)",
    **dict.fromkeys(("get_param", "set_param", "has_param", "delete_param"), _OWN_PARAMETERS),
    "get_name": "node.name",
    "get_namespace": "node.namespace",
    "get_published_topics": "node.topics()",
}


class _Missing:
    """A member that only rclpy's or rospy's class has; raises AttributeError with a hint.

    A class's ``__getattr__`` would also work, but slows down all attributes: 19 ns instead of 4.
    """

    def __init__(self, error: str) -> None:
        self._error = error

    def __repr__(self) -> str:
        return f"<{self._error}>"

    def __get__(self, _: object, owner: type) -> NoReturn:
        raise AttributeError(self._error)


def hint_at_members(kind: type[_T]) -> type[_T]:
    """Add hints about members that only rclpy's or rospy's class has; a class decorator."""
    for name, instead in MEMBERS[kind.__name__].items():
        if not hasattr(kind, name):
            setattr(kind, name, _Missing(f"{kind.__name__} has no {name}: use {instead}"))
    kind.__dir__ = _present  # type: ignore[method-assign]
    return kind


def _present(self: object) -> list[str]:
    """Return the members without the hints; used as a class's ``__dir__``."""
    names = object.__dir__(self)
    return [n for n in names if not isinstance(inspect.getattr_static(self, n, None), _Missing)]


def hint_at_function(name: str) -> str:
    """Return the replacement for a function of the modules rclpy and rospy; empty for none."""
    return FUNCTIONS.get(name, "")


def check_order(method: str, name: object, type: object) -> None:
    """Raise an error for rclpy's argument order (the type first), or for rclpy's classes.

    Args:
        method: The method that was called, e.g. ``create_subscription``.
        name: Its argument for the name of the topic, service or action.
        type: Its argument for the type.

    Raises:
        InvalidNameError: The two are swapped.
        TypeNotFoundError: The type is a class, or a callback.
    """
    named = _type_name(name)
    if isinstance(type, str) and isinstance(named, str):
        if named is not name or (_is_type(named, strictly=True) and not _is_type(type)):
            call = f"{method}({type!r}, {named!r}, ...)"
            raise InvalidNameError(f"{method}() takes the name first, then the type: {call}")
    elif inspect.isclass(type):
        raise TypeNotFoundError(
            f"{method}({name!r}): {type!r} is not a type of rosglass; give the type's name, e.g. "
            f"{method}({name!r}, {_type_name(type, 'std_msgs/msg/String')!r}, ...)"
        )
    elif inspect.isroutine(type):
        raise TypeNotFoundError(
            f"{method}({name!r}): {type!r} is not a type; to omit the type, name the callback: "
            f"{method}({name!r}, callback=...)"
        )


def _is_type(text: str, *, strictly: bool = False) -> bool:
    """Return whether a string can be a type's name; with `strictly`, and hardly a topic's."""
    try:
        base = split_name(text)[2]
    except InvalidNameError:
        return False
    return base[0].isupper() or not strictly


def _type_name(type: object, otherwise: str = "") -> object:
    """Return the name of a type, or of rclpy's or rospy's class; other objects unchanged."""
    if isinstance(type, str):
        return type
    ros1, module = getattr(type, "_type", None), getattr(type, "__module__", "")
    if isinstance(ros1, str):
        return ros1
    if inspect.isclass(type):
        # As rclpy's: class String of the module std_msgs.msg._string.
        package, kind, file = (module.split(".") * 3)[:3]
        known = kind in ("msg", "srv", "action") and file.startswith("_")
        return f"{package}/{kind}/{type.__name__}" if known else otherwise or type
    return getattr(type, "name", type)
