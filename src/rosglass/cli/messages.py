"""Messages and their types on the command line: YAML and JSON, in and out."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import yaml

from rosglass.comm import Durability, History, QoS, Reliability
from rosglass.comm.text_files import load_yaml
from rosglass.errors import ConversionError, Error
from rosglass.messages.message import finite, plain

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from rosglass.messages import MessageType

__all__ = [
    "SHOWN",
    "SHOWN_JSON",
    "fields",
    "parse_fields",
    "print_json",
    "profile",
    "split_type",
    "template",
    "to_json",
    "to_yaml",
]

#: Number of elements of an array that are shown, unless all are requested.
SHOWN = 36
#: The same for programs, which accept more, but not whole images.
SHOWN_JSON = 10_000


def fields(value: Any, limit: int | None = SHOWN) -> Any:
    """Return a message, or a field of one, as dicts, lists and plain values, long arrays cut.

    Args:
        value: The message or field.
        limit: Elements of an array to keep; None for all. A longer one becomes its first elements
            and a text with their number.
    """
    if hasattr(value, "_schema__"):
        value = value.to_dict()
    return plain(value) if limit is None else _cut(value, limit)


def _cut(value: Any, limit: int) -> Any:
    if hasattr(value, "_schema__"):
        value = value.to_dict()
    if isinstance(value, dict):
        return {key: _cut(inner, limit) for key, inner in value.items()}
    if isinstance(value, str):
        text: str = plain(value)
        # A robot's description is a string of 100 kB.
        return text if len(text) <= 100 * limit else f"{text[: 100 * limit]}... {len(text)} in all"
    if not hasattr(value, "__len__"):
        return value
    count = len(value)
    few = value[:limit]
    items = plain(few)
    if isinstance(few, list):
        items = [_cut(item, limit) for item in few]
    return items if count <= limit else [*items, f"... {count} in all"]


def to_yaml(value: object) -> str:
    """Return the result of :func:`fields` as YAML; lists of numbers take one line."""

    class Dumper(yaml.SafeDumper):
        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - PyYAML's signature
            return True

    def sequence(dumper: Any, items: list[Any]) -> Any:
        flow = not any(isinstance(item, (dict, list)) for item in items)
        return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=flow)

    Dumper.add_representer(list, sequence)
    dumped: str = yaml.dump(
        value, Dumper=Dumper, sort_keys=False, default_flow_style=False, allow_unicode=True,
        width=2**31,
    )  # fmt: skip
    return dumped.removesuffix("...\n")


def to_json(value: object) -> str:
    """Return the result of :func:`fields` as strict JSON, in one line."""
    return json.dumps(finite(value), ensure_ascii=False, allow_nan=False)


def print_json(value: object) -> None:
    """Print a value as strict JSON on several lines; bytes become a list of numbers."""
    print(json.dumps(finite(value), indent=2, ensure_ascii=False, default=list), flush=True)


def template(message_type: MessageType) -> str:
    """Return an empty message of the type as one line of YAML."""
    text: str = yaml.safe_dump(
        fields(message_type.create(), 3), default_flow_style=True, sort_keys=False, width=2**31
    )
    return text.strip()


def parse_fields(text: str, type_name: str, template: str = "") -> dict[str, Any]:
    """Return the fields of a YAML (or JSON) text, e.g. ``{linear: {x: 0.5}}``.

    Args:
        text: The text; empty for no fields.
        type_name: Their type, for errors.
        template: An example for errors.

    Raises:
        ConversionError: The text is not YAML, or not a mapping.
    """
    hint = f"YAML such as '{template}'" if template else "YAML such as '{x: 1, name: arm}'"
    try:
        documents = load_yaml(text) if text.strip() else [{}]
    except yaml.YAMLError as error:
        where = str(getattr(error, "problem", "") or error).splitlines()[0]
        raise ConversionError("values", text, f"{hint} ({where})", type_name) from error
    value = documents[0] if len(documents) == 1 else documents or {}
    if value is None:
        value = {}
    if not isinstance(value, dict):
        raise ConversionError("values", text, hint, type_name)
    return value


def split_type(rest: Sequence[str]) -> tuple[str | None, str]:
    """Split ``[TYPE] [VALUES]``, both of which may be left out.

    Raises:
        Error: There are more than two, or the first of two is not the name of a type.
    """
    if len(rest) > 1 and (rest[0].endswith(":") or rest[0].startswith("{")):
        raise Error(f"put the values into one pair of quotes: '{' '.join(rest)}'")
    if len(rest) > 2:
        raise Error(
            f"too many arguments: {' '.join(rest[2:])!r}; put the values into one pair of quotes, "
            "as in '{linear: {x: 0.5}}'"
        )
    looks_like_type = [part.count("/") in (1, 2) and not set(part) & set("{}:[ ") for part in rest]
    if len(rest) == 2 and not looks_like_type[0]:
        raise Error(f"{rest[0]!r} is not a type; write e.g. geometry_msgs/msg/Twist")
    if len(rest) == 1 and not looks_like_type[0]:
        return None, rest[0]
    return (rest[0] if rest else None), (rest[1] if len(rest) == 2 else "")


def profile(args: argparse.Namespace) -> QoS:
    """Return the profile of ``--qos`` and its companions; raises ArgumentError."""
    found = QoS.preset(args.qos)
    if args.depth is not None:
        found = found.with_depth(args.depth)
    policies: dict[str, Any] = {
        "reliability": args.qos_reliability and Reliability(args.qos_reliability),
        "durability": args.qos_durability and Durability(args.qos_durability),
        "history": args.qos_history and History(args.qos_history),
    }
    return replace(found, **{name: policy for name, policy in policies.items() if policy})
