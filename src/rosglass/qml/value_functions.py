"""What both ``Ros`` and ``Ros2`` have for values: empty messages, constants, times, files."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, InvalidNameError, TypeNotFoundError
from rosglass.qt import Property, QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.messages import ActionType, Message, MessageType, ServiceType
    from rosglass.qml.singleton import RosSingleton as _Base
else:
    _Base = object

__all__ = ["ValueFunctions"]


class ValueFunctions(_Base):
    """Mixed into the singletons; what they give follows their dialect."""

    @Slot(str, result=QJSValue)
    def createEmptyMessage(self, type_name: str) -> QJSValue:
        """Return a message with every field at its default; undefined for unknown types."""
        return self._empty("createEmptyMessage", type_name, "message")

    @Slot(str, result=QJSValue)
    def createEmptyServiceRequest(self, type_name: str) -> QJSValue:
        """Return a service's request with every field at its default; undefined if unknown."""
        return self._empty("createEmptyServiceRequest", type_name, "service")

    @Slot(str, result=QJSValue)
    def createEmptyActionGoal(self, type_name: str) -> QJSValue:
        """Return an action's goal with every field at its default; undefined if unknown."""
        return self._empty("createEmptyActionGoal", type_name, "action")

    def _empty(self, function: str, type_name: str, wanted: str) -> QJSValue:
        try:
            found = self._load(type_name, wanted == "action")
            parts: dict[str, MessageType] = getattr(found, "parts", {"message": found})
            first = {"message": "message", "service": "request", "action": "goal"}[wanted]
            if first not in parts:
                raise InvalidNameError(f"{type_name} is no {wanted} type")
            message: Message = parts[first].create()
            return self._runtime.message(message, self.DIALECT)
        except Error as error:
            self._log(logging.WARNING, f"{self.NAME}.{function}: {error}")
            return QJSValue()

    @Slot(str, result=QJSValue)
    def constants(self, type_name: str) -> QJSValue:
        """Return the constants of a message type by name.

        Those of services and actions come as ``request``, ``response``, ``goal``, ``result`` and
        ``feedback``; an unknown type throws.
        """
        from rosglass.qml.to_js import constants_of  # noqa: PLC0415 - brings in the messages

        return self._parts("constants", type_name, lambda kind: constants_of(kind.definition))

    @Slot(str, result=QJSValue)
    def documentation(self, type_name: str) -> QJSValue:
        """Return what a type's definition says about it, its fields and its constants.

        Services and actions as in :meth:`constants`; an unknown type throws.
        """
        return self._parts("documentation", type_name, self._document)

    def _document(self, kind: MessageType) -> dict[str, Any]:
        from rosglass.qml.to_js import constants_of  # noqa: PLC0415 - brings in the messages

        definition = kind.definition
        values = constants_of(definition)
        return {
            "type": self.DIALECT.type_name(definition.name),
            "comment": definition.comment,
            "fields": {
                field.name: {
                    "type": str(field.type),
                    "comment": field.comment,
                    "unit": field.unit,
                    "default": _plain(field.default),
                }
                for field in definition.fields
            },
            "constants": {
                constant.name: {
                    "type": constant.type,
                    "value": values[constant.name],
                    "comment": constant.comment,
                }
                for constant in definition.constants
            },
        }

    def _parts(self, function: str, type_name: str, show: Any) -> QJSValue:
        try:
            found = self._load(type_name)
        except Error as error:
            self._runtime.throw(f"{self.NAME}.{function}: {error}")
            return QJSValue()
        parts: dict[str, MessageType] | None = getattr(found, "parts", None)
        if parts is None:
            return self._runtime.value(show(found))
        return self._runtime.value({name: show(part) for name, part in parts.items()})

    def _load(self, name: str, action: bool = False) -> MessageType | ServiceType | ActionType:
        """Return a type, of the module's ROS if it is known there, otherwise of the other."""
        from rosglass.messages import load  # noqa: PLC0415 - brings in the definitions

        # ROS 1 calls actions by their message, pkg/DoAction.
        names = [name.removesuffix("Action"), name] if action else [name]
        tries = [(ros, one) for ros in (self.DIALECT.ros, 3 - self.DIALECT.ros) for one in names]
        for ros, one in tries:
            with suppress(TypeNotFoundError):
                return load(one, ros=ros)
        return load(name, ros=self.DIALECT.ros)

    # Times.

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def time(self, first: QJSValue, second: QJSValue | None = None) -> QJSValue:
        """Return a time of seconds, of seconds and nanoseconds, of decimal text, of a Date."""
        return self._create_time("time", first, second)

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def duration(self, first: QJSValue, second: QJSValue | None = None) -> QJSValue:
        """Return a duration of seconds, of seconds and nanoseconds, of decimal text."""
        return self._create_time("duration", first, second)

    def _create_time(self, kind: str, first: QJSValue, second: QJSValue | None) -> QJSValue:
        runtime = self._runtime
        made = runtime.create_time(self.DIALECT, kind, first, second or QJSValue())
        if made.isError():
            runtime.throw(f"{self.NAME}.{kind}: {made.property('message').toString()}")
            return QJSValue()
        return made

    # Files.

    def _get_io(self) -> QtCore.QObject:
        found: QtCore.QObject | None = getattr(self, "_io", None)
        if found is None:
            from rosglass.qml.yaml_io import Io  # noqa: PLC0415 - few interfaces have files

            found = self._io = Io(self._runtime, self.DIALECT, self)
        return found

    io = Property(QtCore.QObject, _get_io, constant=True)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
