"""The parts of a command line that stand for messages and profiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError, Error

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from rosglass.comm import QoS

__all__ = ["parse_fields", "profile", "split_type"]


def parse_fields(text: str, type_name: str, template: str = "") -> dict[str, Any]:
    """Return the fields of a YAML (or JSON) text, e.g. ``{linear: {x: 0.5}}``.

    Args:
        text: The text; empty for no fields.
        type_name: Their type, for errors.
        template: An example for errors.

    Raises:
        ConversionError: It is no YAML, or no mapping.
    """
    import yaml

    from rosglass.comm.text_files import load_yaml

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
        Error: There are more than two, or the first of two is no type's name.
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
        raise Error(f"{rest[0]!r} is no type; write e.g. geometry_msgs/msg/Twist")
    if len(rest) == 1 and not looks_like_type[0]:
        return None, rest[0]
    return (rest[0] if rest else None), (rest[1] if len(rest) == 2 else "")


def profile(args: argparse.Namespace) -> QoS:
    """Return the profile of ``--qos`` and its companions; raises ArgumentError."""
    from dataclasses import replace

    from rosglass.comm import Durability, History, QoS, Reliability

    found = QoS.preset(args.qos)
    if args.depth is not None:
        found = found.with_depth(args.depth)
    policies: dict[str, Any] = {
        "reliability": args.qos_reliability and Reliability(args.qos_reliability),
        "durability": args.qos_durability and Durability(args.qos_durability),
        "history": args.qos_history and History(args.qos_history),
    }
    return replace(found, **{name: policy for name, policy in policies.items() if policy})
