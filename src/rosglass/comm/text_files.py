"""Small text files that people write: read whole, written in one go; and YAML from anywhere."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from rosglass.errors import ParameterError

__all__ = ["check_yaml", "explain_yaml_error", "load_yaml", "read_text", "write_text"]

#: Values that YAML may stand for, aliases written out: ``&a [*b, *b]`` makes small texts large.
_MOST_VALUES = 1_000_000
#: Levels that it may have; libyaml's and PyYAML's loaders recurse.
_DEEPEST = 100


def load_yaml(text: str, loader: Any = None) -> list[Any]:
    """Return the documents of a YAML text, whose aliases may stand for a million values at most.

    Args:
        text: The text.
        loader: A class of loaders; PyYAML's safe one by default.

    Raises:
        yaml.YAMLError: It is no YAML, or stands for too much.
    """
    import yaml  # noqa: PLC0415 - few programs read any

    check_yaml(text)
    try:
        return list(yaml.load_all(text, Loader=loader or yaml.SafeLoader))
    except yaml.YAMLError:
        raise
    except Exception as error:  # dates and numbers that there are not, tags that do not fit
        raise yaml.YAMLError(f"{type(error).__name__}: {error}") from error


def check_yaml(text: str) -> None:
    """Raise yaml.YAMLError if what a text stands for is too large or too deep to be loaded."""
    import yaml  # noqa: PLC0415

    #: Anchor and number of values of each list and mapping that is open; the text's first.
    open_ = [("", 0)]
    sizes: dict[str, int] = {}
    events = yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    while True:
        try:
            event = next(events)
        except (StopIteration, yaml.YAMLError):
            return  # what is no YAML at all is the loader's to say
        anchor, size = getattr(event, "anchor", None) or "", 1
        if isinstance(event, yaml.CollectionStartEvent):
            open_.append((anchor, 1))
            sizes.pop(anchor, None)  # it stands for nothing before its end
            problem = f"more than {_DEEPEST} levels" if len(open_) > _DEEPEST + 1 else ""
            size = 0
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, size = open_.pop()
            problem = ""
        elif isinstance(event, (yaml.ScalarEvent, yaml.AliasEvent)):
            size = sizes.get(anchor, 1) if isinstance(event, yaml.AliasEvent) else 1
            inside = isinstance(event, yaml.AliasEvent) and anchor in dict(open_)
            problem = f"*{anchor} is recursive: it stands for what it is in" if inside else ""
        else:
            continue
        if size:
            sizes[anchor] = size
            open_[-1] = open_[-1][0], open_[-1][1] + size
        if open_[-1][1] > _MOST_VALUES:
            problem = f"it stands for more than {_MOST_VALUES} values"
        if problem:
            mark: Any = event.start_mark
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


def explain_yaml_error(error: Exception, label: str, fault: str) -> str:
    """Return where a text is wrong, and why.

    Args:
        error: A yaml.YAMLError.
        label: Where the text came from.
        fault: What it is, or is not, e.g. ``not YAML``.
    """
    mark = getattr(error, "problem_mark", None)
    where = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
    problem = getattr(error, "problem", None) or str(error).partition("\n")[0]
    return f"{label}{where}: this is {fault}: {problem}"


def read_text(path: str | os.PathLike[str], most: int) -> tuple[str, str]:
    """Return a parameter file's text, and its path for messages.

    Args:
        path: The file.
        most: Bytes that it may have.

    Raises:
        ParameterError: It cannot be read, is too large, or is no UTF-8.
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
    """Write a file such that others see the old one or the new one, never a part.

    Raises:
        ParameterError: That is not possible.
    """
    target = Path(_checked(path))
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            mask = os.umask(0)
            os.umask(mask)
            Path(name).chmod(0o666 & ~mask)
            Path(name).replace(target)
        except BaseException:
            with suppress(OSError):
                Path(name).unlink()
            raise
    except OSError as error:
        raise ParameterError(f"{target} cannot be written: {error.strerror or error}") from None


def _checked(path: str | os.PathLike[str]) -> str:
    """Return a path that the system can be asked for."""
    name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else None
    if not isinstance(name, str):
        raise ParameterError(f"a parameter file is given by its path, got {path!r:.200}")
    try:
        impossible = b"\0" in os.fsencode(name)
    except UnicodeEncodeError:
        impossible = True
    if impossible or not name:
        raise ParameterError(f"{name!r:.200} is no path of a file")
    return name
