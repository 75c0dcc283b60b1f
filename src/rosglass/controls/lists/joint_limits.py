"""The limits of a robot's joints, of a URDF."""

from __future__ import annotations

import math
from typing import NamedTuple

from rosglass.comm.xml_reader import XmlElement, XmlError, read_xml
from rosglass.errors import Error

__all__ = ["JointLimits", "read_joint_limits"]

_MAX_TEXT_BYTES = 20 << 20


class JointLimits(NamedTuple):
    """Type and limits of a joint, in rad, m, Nm, N, rad/s and m/s by its type; NaN for none."""

    type: str
    lower: float = math.nan
    upper: float = math.nan
    effort: float = math.nan
    velocity: float = math.nan


def read_joint_limits(text: str, source: str) -> tuple[dict[str, JointLimits], str]:
    """Return the limits by joint, and which joints' are not read and why; empty if all are.

    A URDF whose links are broken has limits all the same. :func:`rosglass.scene.parse_urdf` reads
    whole robots.

    Args:
        text: The URDF, with xacro's macros expanded.
        source: Topic or parameter that it is from, for messages.

    Raises:
        Error: The text is not a URDF; the error names the line.
    """
    try:
        root = read_xml(text, source, _MAX_TEXT_BYTES, lambda _: None)
    except XmlError as error:
        raise Error(str(error)) from None
    if root.tag != "robot":
        raise Error(f"{source}:{root.line}: expected <robot>, got <{root.tag}>")
    found, faults = {}, []
    for joint in root:
        if joint.tag != "joint" or not isinstance(joint, XmlElement):
            continue
        name, kind = joint.get("name", ""), joint.get("type", "")
        limit = joint.find("limit")
        found[name] = JointLimits(kind)
        if limit is None:
            continue
        try:
            lower, upper, effort, velocity = (
                _number(limit.get(key), _default(key, kind))
                for key in ("lower", "upper", "effort", "velocity")
            )
        except ValueError as error:
            faults.append(f"{source}:{joint.line}: limit of joint {name!r}: {error}")
            continue
        if lower > upper:
            faults.append(
                f"{source}:{joint.line}: limit of joint {name!r}: lower {lower:g} is above upper "
                f"{upper:g}"
            )
            continue
        found[name] = JointLimits(kind, lower, upper, effort, velocity)
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return found, str(Error(faults[0])) + more if faults else ""


def _default(key: str, kind: str) -> float:
    """Return a limit that is not given: 0 for the ends of a joint that has them, as in urdfdom."""
    return 0.0 if key in {"lower", "upper"} and kind in {"revolute", "prismatic"} else math.nan


def _number(text: str | None, default: float) -> float:
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"expected a finite number, got {text[:80]!r}")
    return value
