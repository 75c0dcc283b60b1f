"""Names given together with a namespace."""

from __future__ import annotations

__all__ = ["within"]


def within(namespace: str, name: str) -> str:
    """Return `name` within `namespace`, as a NodeHandle of that namespace resolves it.

    Absolute (``/x``) and private (``~x``) names, and an empty namespace, leave it as it is. See
    http://wiki.ros.org/Names, section 1.2.
    """
    if not namespace or not name or name.startswith(("/", "~")):
        return name
    return f"{namespace.rstrip('/')}/{name}"
