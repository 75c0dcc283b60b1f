"""Reads and atomically replaces parameter files, and loads YAML within limits."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from rosglass.errors import ParameterError

__all__ = [
    "check_yaml",
    "explain_yaml_error",
    "load_pyyaml",
    "load_yaml",
    "read_text",
    "write_text",
]

#: Maximum number of values in a YAML text, after expanding aliases (``&a [*b, *b]``).
_MAX_VALUES = 1_000_000
#: Maximum levels of nesting; the loaders of libyaml and PyYAML recurse.
_MAX_DEPTH = 100


def load_pyyaml() -> Any:
    """Return PyYAML, which is slow to import, and which few programs need."""
    import yaml  # noqa: PLC0415 - as above

    return yaml


def load_yaml(text: str, loader: Any = None) -> list[Any]:
    """Return the documents of a YAML text of at most a million values, with aliases expanded.

    Args:
        text: The text.
        loader: The loader class; None for PyYAML's SafeLoader.

    Raises:
        yaml.YAMLError: The text is not valid YAML, or exceeds the limits.
    """
    yaml = load_pyyaml()
    check_yaml(text)
    try:
        return list(yaml.load_all(text, Loader=loader or yaml.SafeLoader))
    except yaml.YAMLError:
        raise
    except (
        ValueError,
        LookupError,
        AttributeError,
        TypeError,
        ArithmeticError,
        RecursionError,
    ) as error:  # invalid dates, numbers and tags
        raise yaml.YAMLError(f"{type(error).__name__}: {error}") from error


def check_yaml(text: str, max_values: int = _MAX_VALUES) -> None:
    """Raise yaml.YAMLError if a text is too large to be loaded, or too deep.

    Args:
        text: The text.
        max_values: Maximum number of values, with aliases expanded.
    """
    yaml = load_pyyaml()
    #: Anchor and number of values of each open list and mapping; the text itself is the first.
    open_ = [("", 0)]
    sizes: dict[str, int] = {}
    events = yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    while True:
        try:
            event = next(events)
        except (StopIteration, yaml.YAMLError):
            return  # the loader reports invalid YAML
        anchor, size = getattr(event, "anchor", None) or "", 1
        if isinstance(event, yaml.CollectionStartEvent):
            open_.append((anchor, 1))
            sizes.pop(anchor, None)  # undefined before its end
            problem = f"more than {_MAX_DEPTH} levels" if len(open_) > _MAX_DEPTH + 1 else ""
            size = 0
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, size = open_.pop()
            problem = ""
        elif isinstance(event, (yaml.ScalarEvent, yaml.AliasEvent)):
            size = sizes.get(anchor, 1) if isinstance(event, yaml.AliasEvent) else 1
            inside = isinstance(event, yaml.AliasEvent) and anchor in dict(open_)
            problem = f"*{anchor} is recursive: it contains itself" if inside else ""
        else:
            continue
        if size:
            sizes[anchor] = size
            open_[-1] = open_[-1][0], open_[-1][1] + size
        if open_[-1][1] > max_values:
            problem = f"it has more than {max_values} values"
        if problem:
            mark: Any = event.start_mark
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


def explain_yaml_error(error: Exception, label: str, fault: str) -> str:
    """Return the error message for an invalid text.

    Args:
        error: A yaml.YAMLError.
        label: The text's origin, e.g. its file.
        fault: What is wrong, e.g. ``not YAML``.
    """
    mark = getattr(error, "problem_mark", None)
    where = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
    problem = getattr(error, "problem", None) or str(error).partition("\n")[0]
    return f"{label}{where}: this is {fault}: {problem}"


def read_text(path: str | os.PathLike[str], most: int) -> tuple[str, str]:
    """Return a parameter file's text, and its path for error messages.

    Args:
        path: The file.
        most: Its maximum size in bytes.

    Raises:
        ParameterError: It cannot be read, is too large, or is not UTF-8.
    """
    label = _checked(path)
    try:
        size = Path(label).stat().st_size
        if size > most:
            raise ParameterError(f"{label} has {size} bytes, too many for a parameter file")
        return Path(label).read_text(encoding="utf-8"), label
    except OSError as error:
        raise ParameterError(f"{label} cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise ParameterError(f"{label} is not UTF-8 text (byte {error.start})") from None


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Replace a file atomically: readers see the old text or the new one, never a part.

    Raises:
        ParameterError: The file cannot be written.
    """
    target = Path(_checked(path))
    try:
        part = target.with_name(f".{target.name}.{os.getpid()}.{time.time_ns()}")
        with part.open("x", encoding="utf-8") as file:
            try:
                file.write(text)
                file.close()
                part.replace(target)
            except BaseException:
                with suppress(OSError):  # the first error is the one to report
                    part.unlink()
                raise
    except OSError as error:
        raise ParameterError(f"{target} cannot be written: {error.strerror or error}") from None


def _checked(path: str | os.PathLike[str]) -> str:
    """Return a path as a string; raises ParameterError if it is not valid."""
    name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else None
    if not isinstance(name, str):
        raise ParameterError(f"a parameter file is given by its path, got {path!r:.200}")
    try:
        impossible = b"\0" in os.fsencode(name)
    except UnicodeEncodeError:
        impossible = True
    if impossible or not name:
        raise ParameterError(f"{name!r:.200} is not a valid path")
    return name
