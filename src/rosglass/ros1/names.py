"""ROS 1's graph resource names: validation and resolution.

Rules: ROS wiki, "Names"; where it and the clients differ, roscpp's ``names.cpp``.
"""

from __future__ import annotations

import re

from rosglass.errors import InvalidNameError
from rosglass.wires.tcpros.graph import split

__all__ = ["absolute_namespace", "expand", "split", "validate_node_name"]

_FORBIDDEN = re.compile(r"[^A-Za-z0-9_/]")
_NODE_FORBIDDEN = re.compile(r"[^A-Za-z0-9_]")


def validate_node_name(name: str) -> None:
    """Raise InvalidNameError unless `name` can be a node's base name."""
    if not isinstance(name, str) or not name:
        raise InvalidNameError(f"a node name must be a non-empty string, got {name!r}")
    if not name[0].isalpha() and not _NODE_FORBIDDEN.match(name):
        raise InvalidNameError(f"node name {name!r} must begin with a letter")
    found = _NODE_FORBIDDEN.search(name)
    if found:
        hint = "; give the namespace separately" if found.group() == "/" else ""
        raise InvalidNameError(
            f"node name {name!r}: {found.group()!r} at position {found.start()}; only letters, "
            f"digits and '_' are allowed{hint}"
        )


def absolute_namespace(text: str, what: str, *, relative: bool = True) -> str:
    """Return a normalized namespace: absolute, without a slash at its end.

    Args:
        text: As written; ``arm`` means ``/arm``, as in ROS_NAMESPACE and ``__ns``.
        what: Where it was given, for the error.
        relative: Whether the first slash may be missing.

    Raises:
        InvalidNameError: It breaks ROS's rules.
    """
    if not isinstance(text, str) or not text:
        raise InvalidNameError(f"a {what} must be a non-empty string, got {text!r}")
    if not relative and not text.startswith("/"):
        raise InvalidNameError(f"{what} {text!r} is not absolute; write {'/' + text!r}")
    _check(what, text, text)
    return "/" + "/".join(part for part in text.split("/") if part)


def expand(name: str, node: str, namespace: str) -> str:
    """Return the absolute name that `name` means for a node.

    Args:
        name: ``/absolute``, ``relative`` to the namespace, or ``~private`` to the node.
        node: The node's base name.
        namespace: The node's absolute namespace.

    Raises:
        InvalidNameError: `name` breaks ROS's rules; the message names the place.
    """
    if not isinstance(name, str) or not name:
        raise InvalidNameError(f"a name must be a non-empty string, got {name!r}")
    rest = name[1:] if name.startswith("~") else name
    _check("name", rest, name)
    if not (name[0] in "~/" or name[0].isalpha()):
        raise InvalidNameError(f"name {name!r} must begin with a letter, '/' or '~'")
    prefix = namespace.rstrip("/")
    if name.startswith("~"):
        full = f"{prefix}/{node}/{rest}"
    elif name.startswith("/"):
        full = name
    else:
        full = f"{prefix}/{name}"
    clean = re.sub(r"/{2,}", "/", full)
    return clean.rstrip("/") or "/"


def _check(what: str, text: str, whole: str) -> None:
    found = _FORBIDDEN.search(text)
    if found:
        position = found.start() + len(whole) - len(text)
        raise InvalidNameError(
            f"{what} {whole!r}: {found.group()!r} at position {position}; only letters, digits, "
            "'_' and '/' are allowed"
        )
