"""What users give to a buffer: names of frames and times."""

from __future__ import annotations

from rosglass.comm.time import Time
from rosglass.errors import InvalidArgumentException

__all__ = ["check_name", "nanoseconds_of"]


def check_name(name: object, what: str) -> None:
    """Raise InvalidArgumentException unless `name` can be that of a frame."""
    if not isinstance(name, str) or not name:
        raise InvalidArgumentException(f"{what}: expected the name of a frame, got {name!r}")
    if name[0] == "/":
        raise InvalidArgumentException(
            f"\"{name}\" passed as {what} is not valid: in tf2 frame_ids cannot start with a '/'; "
            f"use '{name.lstrip('/')}'"
        )


def nanoseconds_of(time: Time | None, what: str) -> int:
    """Return a time, 0 for the newest; raises InvalidArgumentException."""
    if time is None:
        return 0
    if not isinstance(time, Time):
        raise InvalidArgumentException(
            f"{what}: expected a rosglass.Time, or None for the newest, got {time!r}"
        )
    return time.nanoseconds
