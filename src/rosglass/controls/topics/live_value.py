"""The element ``LiveValue``: the number at a field path of a topic."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.controls.topics.live_topic import LiveTopic
from rosglass.errors import FieldPathError
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import Slot

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["LiveValue", "number_of"]


def number_of(value: Any, path: str) -> float:
    """Return the value of a field as a number; a boolean as 0 or 1, a time in seconds.

    Raises:
        FieldPathError: It is not a single number.
    """
    # Slow to import, and there is a message when it is needed.
    from rosglass.messages import Message  # noqa: PLC0415

    if isinstance(value, Message):
        seconds = getattr(value, "seconds", None)
        if isinstance(seconds, float):
            return seconds
        raise FieldPathError(f"{path} is a {value._schema__.name}; name one of its fields")
    if isinstance(value, (bytes, bytearray)) and len(value) == 1:
        return float(value[0])
    if isinstance(value, str):
        raise FieldPathError(f"{path} is a text, not a number")
    try:
        return float(value)
    except (TypeError, ValueError):
        raise FieldPathError(f"{path} is an array; name one of its elements: {path}[0]") from None


class LiveValue(LiveTopic):
    """Receives the number at a field path of a topic. See its page in ``docs/controls``."""

    #: Topic and field, as ``/odom:twist.twist.linear.x``.
    path = Writable(str, "", then="_set_parts")
    #: The number; NaN without one.
    number = ReadOnly(float, math.nan)

    _path: str

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._field = self._fault = ""
        self.messageChanged.connect(self._read)

    def _set_parts(self) -> None:
        topic, _, field = self._path.partition(":")
        topic, self._field = topic.strip(), field.strip()
        self._fault = ""
        if self._path and not (topic and self._field):
            self._fault = (
                f"path {self._path!r}: expected topic:field, such as /odom:twist.twist.linear.x"
            )
        self._set_topic("" if self._fault else topic)
        self._read()

    @Slot()
    def _read(self) -> None:
        message, value = self._message, math.nan
        if message is not None and self._field and not self._refuses_type():
            self._fault = ""
            try:
                value = number_of(message[self._field], self._field)
            except FieldPathError as error:
                self._fault = f"{self._resolved}: {error}"
        report(self, number=value)
        self._announce_problem()

    def _wanted(self) -> Any:
        # Without a topic, any would be taken.
        return super()._wanted() if self._topic else None

    def _get_problem(self) -> str:
        return super()._get_problem() or self._fault

    def _is_old(self) -> bool:
        return bool(self._fault) or super()._is_old()
