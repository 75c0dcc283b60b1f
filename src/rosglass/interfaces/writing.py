"""Writing definitions as ``.msg`` text, for types that came without any."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.interfaces.names import split_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.interfaces.definition import Constant, Definition, Field, FieldType, Value

__all__ = ["message_text"]

_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"}


def message_text(definition: Definition) -> str:
    """Return `definition` as a ROS 2 ``.msg`` file would say it, comments and constants included.

    Parsing the text gives the same fields, defaults and constants.
    """
    head = definition.comment
    members: list[Constant | Field] = [*definition.constants, *definition.fields]
    # A head comment that touches the first member is that member's, too.
    shared = bool(head and members and _begins(members[0].comment, head))
    touching = shared and "\n" not in _own(members[0].comment, head)
    lines = list(_comment(head))
    if head and not touching:
        lines.append("")

    def write(member: Constant | Field, code: str) -> None:
        own = _own(member.comment, head)
        if touching and member is members[0]:
            lines.append(f"{code}  # {own}" if own else code)
        else:
            lines.extend((*_comment(own), code))

    for constant in definition.constants:
        write(constant, f"{constant.type} {constant.name}={_value(constant.value)}")
    if definition.constants and definition.fields:
        lines.append("")
    for field in definition.fields:
        default = "" if field.default is None else f" {_value(field.default)}"
        write(field, f"{_type(field.type)} {field.name}{default}")
    return "\n".join(lines)


def _begins(comment: str, head: str) -> bool:
    """Return whether a member's comment begins with the message's, which touches it."""
    return f"{comment}\n".startswith(f"{head}\n")


def _own(comment: str, head: str) -> str:
    """Return a member's comment without that of the message, which stands at the beginning."""
    return comment[len(head) :].lstrip("\n") if head and _begins(comment, head) else comment


def _comment(text: str) -> Iterator[str]:
    return (f"# {line}".rstrip() for line in text.splitlines())


def _type(kind: FieldType) -> str:
    if not kind.is_compound:
        return str(kind)
    package, folder, base = split_name(kind.name)
    short = f"{package}/{base}" if folder == "msg" else kind.name
    return str(kind).replace(kind.name, short, 1)


def _value(value: Value) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_value(element) for element in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return repr(value)
    return f'"{"".join(_character(sign) for sign in value)}"'


def _character(sign: str) -> str:
    known = _ESCAPES.get(sign)
    return known or (sign if sign.isprintable() else f"\\U{ord(sign):08x}")
