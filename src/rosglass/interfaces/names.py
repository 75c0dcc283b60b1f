"""Names of interface types, fields and constants, checked as rosidl and genmsg check them."""

from __future__ import annotations

import re

from rosglass.errors import InvalidNameError

__all__ = [
    "KINDS",
    "adding_definitions",
    "check_constant_name",
    "check_field_name",
    "check_package_name",
    "check_type_name",
    "join_name",
    "ros1_name",
    "spelled_ros1",
    "split_name",
]

#: The kinds of interfaces, which are also the names of folders and file extensions.
KINDS = ("msg", "srv", "action")

#: Matches type names in a text, but not parts of paths.
_IN_TEXT = re.compile(
    r"(?<![\w./-])([A-Za-z]\w*)/(?:msg|srv|action)/([A-Za-z]\w*)(?![\w/]|\.(?:msg|srv|action)\b)"
)
#: The command that prints the folder of a package, in ROS 1 and ROS 2.
_FIND = {1: "rospack find", 2: "ros2 pkg prefix --share"}
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_ROS1_CONSTANT = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ROS2_LOWER = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*")
_ROS2_UPPER = re.compile(r"[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*")
# rosidl: one camel-case word, plus the affixes of generated and sample messages.
_ROS2_TYPE = re.compile(
    r"(?:Sample_)?[A-Z][A-Za-z0-9]*"
    r"(?:_(?:SendGoal|GetResult))?"
    r"(?:_(?:Request|Response|Event|Goal|Result|Feedback|FeedbackMessage))*"
)
_ROS2_RULE = (
    "start with a lower-case letter, then lower-case letters, digits and single underscores"
)


def split_name(name: str) -> tuple[str, str, str]:
    """Split a type name into package, kind and type.

    Args:
        name: ``pkg/msg/Type``, ``pkg/srv/Type``, ``pkg/action/Type`` or ``pkg/Type``.

    Returns:
        Package, kind (empty for ``pkg/Type``) and type.

    Raises:
        InvalidNameError: `name` has none of these forms.
    """
    parts = name.split("/") if isinstance(name, str) else []
    if len(parts) == 2:
        package, kind, base = parts[0], "", parts[1]
    elif len(parts) == 3 and parts[1] in KINDS:
        package, kind, base = parts
    else:
        raise InvalidNameError(
            f"{name!r:.80} is not a type name; write pkg/msg/Type, pkg/srv/Type, pkg/action/Type "
            "or pkg/Type"
        )
    for part in (package, base):
        if not _IDENTIFIER.fullmatch(part):
            raise InvalidNameError(
                f"{name!r:.80} is not a type name: {part!r:.80} must start with a letter and may "
                "go on with letters, digits and underscores"
            )
    return package, kind, base


def join_name(name: str, default_kind: str = "msg") -> str:
    """Return the full form of a name; ``pkg/Type`` becomes ``pkg/<default_kind>/Type``.

    Raises:
        InvalidNameError: `name` is not a type name.
    """
    package, kind, base = split_name(name)
    return f"{package}/{kind or default_kind}/{base}"


def ros1_name(name: str) -> str:
    """Return `name` as ROS 1 spells it on the wire, ``pkg/Type``.

    Raises:
        InvalidNameError: `name` is not a type name.
    """
    package, _, base = split_name(name)
    return f"{package}/{base}"


def spelled_ros1(text: str) -> str:
    """Return a text with all type names in ROS 1's form, ``pkg/Type``."""
    return _IN_TEXT.sub(r"\1/\2", text)


def check_package_name(name: str, ros: int) -> str:
    """Return why a package name is invalid; empty if it is valid."""
    if ros == 1:
        return "" if _IDENTIFIER.fullmatch(name) else _identifier_fault("package", name)
    return "" if _ROS2_LOWER.fullmatch(name) else f"package name {name!r} must {_ROS2_RULE}"


def check_type_name(name: str, ros: int) -> str:
    """Return why a message, service or action name is invalid; empty if it is valid."""
    if ros == 1:
        return "" if _IDENTIFIER.fullmatch(name) else _identifier_fault("type", name)
    if _ROS2_TYPE.fullmatch(name):
        return ""
    return f"type name {name!r} must start with an upper-case letter, then letters and digits"


def check_field_name(name: str, ros: int) -> str:
    """Return why a field name is invalid; empty if it is valid."""
    if ros == 1:
        return "" if _IDENTIFIER.fullmatch(name) else _identifier_fault("field", name)
    return "" if _ROS2_LOWER.fullmatch(name) else f"field name {name!r} must {_ROS2_RULE}"


def check_constant_name(name: str, ros: int) -> str:
    """Return why a constant's name is invalid; empty if it is valid."""
    if ros == 1:
        return "" if _ROS1_CONSTANT.fullmatch(name) else _identifier_fault("constant", name)
    if _ROS2_UPPER.fullmatch(name):
        return ""
    return (
        f"constant name {name!r} must start with an upper-case letter, then upper-case letters, "
        "digits and single underscores"
    )


def _identifier_fault(what: str, name: str) -> str:
    return f"{what} name {name!r} must start with a letter, then letters, digits and underscores"


def adding_definitions(name: str, ros: int) -> str:
    """Return advice for a type that only the robot's workspace has.

    Args:
        name: Its name, with the package.
        ros: The robot's version of ROS.
    """
    package = name.partition("/")[0] if "/" in name else "PACKAGE"
    return (
        f"copy the folder of its package {package} from the robot ({_FIND[ros]} {package} says "
        f"where it is there) and add it: --definitions {package} on the command line, "
        f"in Python Library.add_path({package!r}) of the library given to connect(library=...)"
    )
