"""Names of nodes, topics, services and types: ROS 2's rules, expansion, and spelling over DDS.

For both ROS versions: :func:`similar` and :func:`anonymous_name`.

Rules: design article "Topic and Service name mapping to DDS" and the behaviour of ``rcl`` and
``rmw`` (``rcl_expand_topic_name``, ``rmw_validate_full_topic_name``, ``rmw_validate_node_name``,
``rmw_validate_namespace``).
"""

from __future__ import annotations

import itertools
import os
import re
import socket
import time
from typing import TYPE_CHECKING

from rosglass.errors import InvalidNameError, close_matches

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = [
    "MAX_NODE_NAME",
    "MAX_TOPIC_NAME",
    "action_of",
    "anonymous_name",
    "demangle_topic",
    "demangle_type",
    "expand",
    "hidden",
    "is_valid_node",
    "is_valid_topic",
    "mangle_type",
    "similar",
    "validate_namespace",
    "validate_node_name",
]

#: Longest topic or service name in characters; DDS allows 255 with ``rq/`` and ``Reply``.
MAX_TOPIC_NAME = 247
#: Longest node name in characters.
MAX_NODE_NAME = 255
#: Longest namespace in characters.
MAX_NAMESPACE = 245

_FORBIDDEN = re.compile(r"[^A-Za-z0-9_/]")
_FORBIDDEN_IN_PATTERN = re.compile(r"[^A-Za-z0-9_/~{}]")
_FORBIDDEN_IN_NODE = re.compile(r"[^A-Za-z0-9_]")
_FULL_NAME = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+\Z")
_DIGIT_FIRST = re.compile(r"(?:^|/)([0-9])")
_SUBSTITUTION = re.compile(r"\{([^{}]*)\}")
_DDS_TYPE = re.compile(r"([A-Za-z]\w*)::(\w+)::dds_::(\w+)_\Z")
_ACTION_PARTS = {"/_action/send_goal": "_SendGoal", "/_action/feedback": "_FeedbackMessage"}
#: Prefixes and suffixes of ROS 2's DDS topics.
_DDS_TOPICS = {"rt/": "", "rq/": "Request", "rr/": "Reply"}
_ROS_TYPE = re.compile(r"([A-Za-z]\w*)/(\w+)/(\w+)\Z")


def validate_node_name(name: str) -> None:
    """Raise InvalidNameError unless `name` can be a node's base name."""
    if not isinstance(name, str):
        raise InvalidNameError(f"a node name must be a string, got {name!r}")
    if not name:
        raise InvalidNameError("a node name must not be empty")
    _reject(_FORBIDDEN_IN_NODE, "node name", name, "only letters, digits and '_' are allowed")
    if name[0].isdigit():
        raise InvalidNameError(
            f"node name {name!r} starts with a digit; put a letter or '_' before it"
        )
    _limit("node name", name, MAX_NODE_NAME)


def validate_namespace(namespace: str) -> None:
    """Raise InvalidNameError unless `namespace` is a valid absolute namespace."""
    if not isinstance(namespace, str):
        raise InvalidNameError(f"a namespace must be a string, got {namespace!r}")
    if not namespace.startswith("/"):
        raise InvalidNameError(
            f"namespace {namespace!r} is not absolute; write {'/' + namespace!r}"
        )
    if namespace != "/":
        _validate_full("namespace", namespace, MAX_NAMESPACE)


def is_valid_topic(name: str) -> bool:
    """Return whether `name` is a valid absolute topic or service name in ROS 2."""
    return len(name) <= MAX_TOPIC_NAME and _FULL_NAME.match(name) is not None


def is_valid_node(full: str) -> bool:
    """Return whether a node's full name is printable; some peers allow more than rcl does."""
    return full.isprintable() and " " not in full


def expand(name: str, node: str, namespace: str) -> str:
    """Return the absolute topic or service name that `name` stands for in a node.

    Relative names are prefixed with the namespace, ``~`` and ``~/rest`` with the node's full name;
    ``{node}``, ``{ns}`` and ``{namespace}`` are replaced.

    Args:
        name: As the user wrote it.
        node: The node's base name.
        namespace: The node's absolute namespace.

    Raises:
        InvalidNameError: `name` or its expansion is invalid; the message gives the position.
    """
    what = "topic or service name"
    if not isinstance(name, str) or not name:
        raise InvalidNameError(f"a {what} must be a non-empty string, got {name!r}")
    allowed = "only letters, digits, '_', '/', and '~', '{', '}' for expansion are allowed"
    _reject(_FORBIDDEN_IN_PATTERN, what, name, allowed)
    tilde = name.find("~", 1)
    if tilde > 0:
        raise InvalidNameError(
            f"{what} {name!r}: '~' at position {tilde} must be the first character"
        )
    if name.startswith("~") and name[1:2] not in ("", "/"):
        raise InvalidNameError(f"{what} {name!r}: write {'~/' + name[1:]!r}")
    prefix = namespace.rstrip("/")
    full = _SUBSTITUTION.sub(lambda match: _substitute(match, name, node, namespace), name)
    if "{" in full or "}" in full:
        position = min(name.find(brace) for brace in "{}" if brace in full)
        raise InvalidNameError(f"{what} {name!r}: unbalanced brace at position {position}")
    if full.startswith("~"):
        full = f"{prefix}/{node}{full[1:]}"
    elif not full.startswith("/"):
        full = f"{prefix}/{full}"
    _validate_full(what, full, MAX_TOPIC_NAME, name)
    return full


def hidden(name: str) -> bool:
    """Return whether a topic, service or node is hidden: a part of its name begins with ``_``.

    Listings omit such names, including those of an action's topics and services.
    """
    return "/_" in f"/{name}"


def action_of(name: str, type_name: str) -> tuple[str, str] | None:
    """Return name and type of the action that a topic or service belongs to; None if unknown.

    Only ``<action>/_action/send_goal`` and ``<action>/_action/feedback`` show the action's type.
    """
    for ending, suffix in _ACTION_PARTS.items():
        if name.endswith(ending) and type_name.endswith(suffix):
            return name.removesuffix(ending), type_name.removesuffix(suffix)
    return None


def mangle_type(type_name: str) -> str:
    """Return the spelling of a type over DDS: ``pkg/msg/T`` becomes ``pkg::msg::dds_::T_``."""
    match = _ROS_TYPE.match(type_name)
    if match is None:
        raise InvalidNameError(
            f"type name {type_name!r} is not of the form package/msg/Type, e.g. std_msgs/msg/String"
        )
    return "{}::{}::dds_::{}_".format(*match.groups())


def demangle_type(dds_type: str) -> str:
    """Return ``pkg/msg/T`` for ``pkg::msg::dds_::T_``; foreign spellings are returned unchanged."""
    match = _DDS_TYPE.match(dds_type)
    return "/".join(match.groups()) if match else dds_type


def demangle_topic(dds_topic: str) -> tuple[str, str] | None:
    """Return the prefix of a DDS topic, and the ROS topic or service; None if it is not ROS 2's.

    ``rt`` carries a topic's messages, ``rq`` a service's requests, ``rr`` its replies.
    """
    ending = _DDS_TOPICS.get(dds_topic[:3])
    name = dds_topic[2:]
    if ending is None or not name.endswith(ending) or len(name) - len(ending) < 2:
        return None
    return dds_topic[:2], name.removesuffix(ending)


def _substitute(match: re.Match[str], name: str, node: str, namespace: str) -> str:
    values = {"node": node, "ns": namespace, "namespace": namespace}
    if match[1] not in values:
        raise InvalidNameError(
            f"topic or service name {name!r}: unknown substitution {match[0]!r} at position "
            f"{match.start()}; known are {{node}}, {{ns}} and {{namespace}}"
        )
    return values[match[1]]


def _validate_full(what: str, name: str, limit: int, written: str = "") -> None:
    label = f"{what} {name!r}"
    if written and written != name:
        label += f" (expanded from {written!r})"
    _reject(_FORBIDDEN, what, name, "only letters, digits, '_' and '/' are allowed")
    if name.endswith("/"):
        raise InvalidNameError(f"{label} ends with '/'; leave that out")
    if "//" in name:
        raise InvalidNameError(
            f"{label} has '//' at position {name.index('//')}; write a single '/'"
        )
    digit = _DIGIT_FIRST.search(name)
    if digit:
        raise InvalidNameError(
            f"{label}: the part at position {digit.start(1)} starts with the digit {digit[1]!r}; "
            "put a letter or '_' before it"
        )
    _limit(what, name, limit)


def _reject(forbidden: re.Pattern[str], what: str, name: str, allowed: str) -> None:
    match = forbidden.search(name)
    if match:
        raise InvalidNameError(
            f"{what} {name!r} contains {match[0]!r} at position {match.start()}; {allowed}"
        )


def _limit(what: str, name: str, limit: int) -> None:
    if len(name) > limit:
        raise InvalidNameError(
            f"{what} {name[:40] + '...'!r} has {len(name)} characters; at most {limit} are allowed"
        )


_numbers = itertools.count(1)


def anonymous_name(name: str) -> str:
    """Return a unique node name that begins with `name`.

    As in rospy and roscpp, host, process id and time in milliseconds are appended. Process ids
    alone are not unique: programs in containers often have the same one. In ROS 1, a second node
    with a name shuts down the first one.
    """
    host = re.sub(r"[^A-Za-z0-9_]", "_", socket.gethostname())
    # ROS 2 forbids two underscores in a row.
    text = f"{name}_{host}_{os.getpid()}_{int(time.time() * 1000)}_{next(_numbers)}"
    return re.sub("__+", "_", text)


#: Names that are compared with one that is wrong, and letters of a name.
_MAX_COMPARED_NAMES, _MAX_COMPARED_LETTERS = 500, 100


def similar(name: str, known: Iterable[str]) -> str:
    """Return a hint at known names that are similar to `name`; empty if there are none.

    Also where comparing takes long: for a name of more than 100 letters, or more than 500 names.
    """
    names = [other for other in known if other != name and len(other) <= _MAX_COMPARED_LETTERS]
    if len(name) > _MAX_COMPARED_LETTERS or len(names) > _MAX_COMPARED_NAMES:
        return ""
    base = name.rpartition("/")[2]
    near = [other for other in names if other.rpartition("/")[2] == base]
    plain = _plain(name)
    near += [other for other in names if _plain(other) == plain]
    near += close_matches(name, names, 2, 0.8)
    return f"; did you mean {' or '.join(list(dict.fromkeys(near))[:2])}?" if near else ""


def _plain(name: str) -> str:
    """Return a name without differences in spelling, such as frameId and frame_id."""
    return name.replace("_", "").lower()
