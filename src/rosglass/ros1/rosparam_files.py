"""Parameter files of ROS 1: YAML as in ``rosparam load`` and ``rosparam dump``.

Rules: ROS wiki, "rosparam" and "YAML Overview": several documents, ``_ns`` for a document's
namespace, ``!degrees``, ``!radians``, ``deg(90)``, ``rad(pi/2)`` for angles.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.comm.text_files import (
    explain_yaml_error,
    load_pyyaml,
    load_yaml,
    read_text,
    write_text,
)
from rosglass.errors import ParameterError

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

__all__ = ["dump", "parse", "parse_value", "read", "write"]

#: Bytes of a file.
_MAX_SIZE = 64 * 1024 * 1024
_NAMESPACE = "_ns"
_DEGREES = re.compile(r"^deg\([^)]*\)$")
_RADIANS = re.compile(r"^rad\([^)]*\)$")
_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}


def read(path: str | os.PathLike[str]) -> list[tuple[str, Any]]:
    """Read a parameter file; return pairs of a namespace, often empty, and what to set there.

    Raises:
        ParameterError: It is not a parameter file; the message has file, line and column.
    """
    return parse(*read_text(path, _MAX_SIZE))


def parse(text: str, label: str = "<text>") -> list[tuple[str, Any]]:
    """Read the text of a parameter file; results and errors as of :func:`read`.

    Args:
        text: The text.
        label: Its source, for messages.
    """
    found = []
    for document in _documents(text, label):
        if document is None:
            continue  # an empty file, or nothing between two "---"
        namespace = ""
        if isinstance(document, dict) and _NAMESPACE in document:
            namespace = document.pop(_NAMESPACE)
            if not isinstance(namespace, str):
                raise ParameterError(f"{label}: {_NAMESPACE} must be a name, got {namespace!r}")
        found.append((namespace, document))
    return found


def parse_value(text: str, label: str) -> Any:
    """Return the value of a YAML text; None for an empty one.

    Raises:
        ParameterError: It is not YAML.
    """
    values = _documents(text, label, "not YAML")
    if len(values) > 1:
        raise ParameterError(f"{label}: this is more than one value")
    return values[0] if values else None


def dump(value: Any) -> str:
    """Return a value or namespace as YAML, in the layout of ``rosparam dump``."""
    yaml = load_pyyaml()

    class Dumper(yaml.SafeDumper):  # type: ignore[misc, name-defined]
        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - PyYAML's
            return True  # equal values are written in full, for readers

    text: str = yaml.dump(value, Dumper=Dumper, default_flow_style=False, allow_unicode=True)
    return text.removesuffix("...\n")


def write(path: str | os.PathLike[str], value: Any) -> None:
    """Write a parameter file atomically; raises ParameterError if that fails."""
    write_text(path, dump(value))


def _documents(text: str, label: str, fault: str = "not a parameter file") -> list[Any]:
    try:
        return load_yaml(text, _loader())
    except load_pyyaml().YAMLError as error:
        raise ParameterError(explain_yaml_error(error, label, fault)) from None


class _Constructors:
    """YAML with angles, in which duplicate keys are errors; for PyYAML's SafeLoader."""

    construct_mapping: Callable[..., dict[Any, Any]]
    construct_scalar: Callable[[Any], Any]

    def mapping(self, node: Any) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key, _ in node.value:
            if isinstance(key, load_pyyaml().ScalarNode):
                if key.value in seen:
                    raise _problem(key, f"{key.value!r} occurs twice")
                seen.add(key.value)
        return self.construct_mapping(node, deep=True)

    def degrees(self, node: Any) -> float:
        text = _inside(str(self.construct_scalar(node)), "deg")
        try:
            return float(text) * math.pi / 180.0
        except ValueError:
            raise _problem(node, f"{text!r} is not a number of degrees; e.g. deg(90)") from None

    def radians(self, node: Any) -> float:
        text = _inside(str(self.construct_scalar(node)), "rad")
        try:
            return _calculate(ast.parse(text, mode="eval").body)
        except (SyntaxError, ValueError, ZeroDivisionError, OverflowError, RecursionError):
            raise _problem(
                node, f"{text!r} is not a number of radians; e.g. rad(pi/2): numbers, pi, + - * /"
            ) from None


@cache
def _loader() -> Any:
    class Loader(_Constructors, load_pyyaml().SafeLoader):  # type: ignore[misc]
        pass

    Loader.add_constructor("tag:yaml.org,2002:map", Loader.mapping)
    Loader.add_constructor("!degrees", Loader.degrees)
    Loader.add_constructor("!radians", Loader.radians)
    Loader.add_implicit_resolver("!degrees", _DEGREES, ["d"])
    Loader.add_implicit_resolver("!radians", _RADIANS, ["r"])
    return Loader


def _inside(text: str, word: str) -> str:
    text = text.strip()
    return text[len(word) + 1 : -1].strip() if text.startswith(f"{word}(") else text


def _calculate(node: ast.AST) -> float:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return float(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_calculate(node.left), _calculate(node.right))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_calculate(node.operand))
    raise ValueError


def _problem(node: Any, problem: str) -> Exception:
    made: Exception = load_pyyaml().MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
    return made
