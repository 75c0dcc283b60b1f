"""What the choosers of properties offer: topics of the robot, and its frames."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.session import Session
    from rosglass.qml.tf_link import TfLink
    from rosglass.rviz.registered_property import RegisteredProperty

__all__ = ["FIXED_FRAME", "Sources"]

_log = logging.getLogger("rosglass.rviz")
#: As RViz's own displays call the fixed frame.
FIXED_FRAME = "<Fixed Frame>"


class Sources:
    """Asks a session's node; knows nothing while there is none.

    Args:
        session: The session.
        tell: Shows a text to who edits, e.g. in RViz's status bar.
    """

    def __init__(self, session: Session, tell: Callable[[str], Any]) -> None:
        self._session, self._tell = session, tell
        self._link: TfLink | None = None
        self._linked: Any = None

    def topics(self, type_name: str) -> list[str]:
        """Return the topics of a type, of all types where it is empty."""
        node = self._session.node
        if node is None:
            return []
        wanted = type_name.replace("/msg/", "/")
        try:
            known = node.topics()
        except Error as error:
            _log.warning("topics cannot be listed: %s", error)
            return []
        names = {
            name: {kind.replace("/msg/", "/") for kind in kinds} for name, kinds in known.items()
        }
        return sorted(name for name, kinds in names.items() if not wanted or wanted in kinds)

    def frames(self, *, fixed: bool) -> list[str]:
        """Return the frames that are known, before them the fixed one if that is asked for."""
        self.listen()
        known = sorted(self._link.buffer.tree()) if self._link is not None else []
        return [FIXED_FRAME, *known] if fixed else known

    def listen(self) -> None:
        """Begin to receive frames, for a chooser that is to be opened."""
        node = self._session.node
        if node is not self._linked:
            self.close()
            self._linked = node
            if node is not None:
                from rosglass.qml.tf_link import TfLink  # noqa: PLC0415 - brings in the transforms

                self._link = TfLink.join(self._session, node, "/", self)

    def edit(self, model: RegisteredProperty, value: Any) -> None:
        """Change a property for who has chosen a value; a refused one is told."""
        try:
            if not model.readOnly:
                model.set(value)
        except Error as error:
            self.complain(f"{'/'.join(model.path)}: {error}")

    def complain(self, text: str) -> None:
        """Tell who edits what is wrong."""
        _log.warning("property %s", text)
        self._tell(text)

    def close(self) -> None:
        """Receive frames no longer; safe to call twice."""
        link, self._link, self._linked = self._link, None, None
        if link is not None:
            link.leave(self)
