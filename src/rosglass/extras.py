"""The optional packages of rosglass, and the command that installs them."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import unquote, urlsplit

__all__ = ["explain_missing", "install_command"]

#: Module of an optional package -> the extra that installs it.
_EXTRA_OF = {
    "PySide6": "qml",
    "zenoh": "zenoh",
    "xxhash": "zenoh",
    "cyclonedds": "dds",
    "cv2": "images",
    "av": "video",
    "sdl2": "gamepad",
    "mcap": "bags",
    "rosbags": "bags",
    "argcomplete": "completion",
}


def install_command(extra: str) -> str:
    """Return the command that installs an extra from where rosglass itself came.

    The name "rosglass" alone would be looked up on PyPI, which does not have it.

    Args:
        extra: Its name, such as ``zenoh``.
    """
    return f'pip install "{_requirement(extra)}"'


def _requirement(extra: str) -> str:
    """Return the requirement for pip (PEP 508, or a path), by pip's record (PEP 610)."""
    # Slow to import; used by errors only.
    from importlib.metadata import PackageNotFoundError, distribution  # noqa: PLC0415

    try:
        record = distribution("rosglass").read_text("direct_url.json")
        origin = json.loads(record or "{}")
        url = origin.get("url", "")
    except (PackageNotFoundError, ValueError, AttributeError):
        origin, url = {}, ""
    if "dir_info" in origin and url.startswith("file:"):
        return f"{unquote(urlsplit(url).path)}[{extra}]"
    if url:
        prefix = f"{origin['vcs_info']['vcs']}+" if "vcs_info" in origin else ""
        return f"rosglass[{extra}] @ {prefix}{url}"
    clone = Path(__file__).parents[2]
    if (clone / "pyproject.toml").is_file():
        return f"{clone}[{extra}]"
    return f"rosglass[{extra}]"


def explain_missing(error: ModuleNotFoundError) -> str:
    """Return how to install a missing package; empty if no extra installs it."""
    extra = _EXTRA_OF.get((error.name or "").partition(".")[0])
    if extra is None:
        return ""
    return f"{error.name} is not installed; install it with: {install_command(extra)}"
