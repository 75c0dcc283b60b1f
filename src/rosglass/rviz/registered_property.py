"""One property that an interface has declared: its value, and what is said about it."""
# ruff: noqa: N815 - the names of slots, signals and properties are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, cast

from rosglass.errors import Error
from rosglass.qt import Property, QJSValue, QtCore, Signal
from rosglass.rviz.face import VARIANT, given, switch_of, text_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.property_kinds import Kind
    from rosglass.rviz.registered_properties import RegisteredProperties

__all__ = ["RegisteredProperty", "answering", "python_value"]

_log = logging.getLogger("rosglass.rviz")


def python_value(value: Any) -> Any:
    """Return what JavaScript gave, as Python and Qt have it.

    Raises:
        ConversionError: It is a function, refers to itself, or is too large.
    """
    return given(value) if isinstance(value, QJSValue) else value


def answering(runtime: Runtime | None, what: str, error: Error, *given_by_js: Any) -> None:
    """Throw an error into the JavaScript that is running; where none is, raise it."""
    # Where JavaScript's own getters have thrown, it no longer tells where it is.
    sure = any(isinstance(value, QJSValue) for value in given_by_js)
    if runtime is None or not (sure or runtime.caller().file != "<python>"):
        raise Error(f"{what}: {error}") from error
    runtime.throw(f"{what}: {error}")


class RegisteredProperty(QtCore.QObject):
    """One property; made by :class:`RegisteredProperties` only.

    Args:
        owner: Whose it is.
        parent: The property that it stands below; None for none.
        name: Its name there.
        kind: What it holds.
        default: Its value as yet.
    """

    #: What errors call it.
    CALLED = "property"

    valueChanged = Signal(VARIANT)
    #: Its description, range, choices, or whether it can be changed or seen.
    aboutChanged = Signal()

    def __init__(
        self,
        owner: RegisteredProperties,
        parent: RegisteredProperty | None,
        name: str,
        kind: Kind,
        default: Any,
    ) -> None:
        super().__init__(owner)
        self._owner, self._name = owner, name
        self.container = parent
        self.kind = kind
        #: What JavaScript has for it, if there is any.
        self.for_js: QJSValue | None = None
        #: Properties below this one.
        self.properties: dict[str, RegisteredProperty] = {}
        self._value = default
        self._about: dict[str, Any] = {"description": "", "readOnly": False, "hidden": False}

    @property
    def path(self) -> tuple[str, ...]:
        """Its name, after those of the properties that it stands below."""
        return (*(self.container.path if self.container else ()), self._name)

    def get(self) -> Any:
        """Return the value."""
        return self._value

    def set(self, value: Any) -> None:
        """Change the value, also of one that is read-only to people.

        Raises:
            Error: The property cannot hold it.
        """
        new = self.kind.read(python_value(value))
        if new != self._value or type(new) is not type(self._value):
            self._value = new
            self.valueChanged.emit(new)
            self._owner.edited.emit()

    def _set_value(self, value: Any) -> None:
        try:
            self.set(value)
        except Error as error:
            answering(self._owner.runtime, f"property {'/'.join(self.path)}", error, value)

    #: The value; one that does not fit throws.
    value = Property(VARIANT, get, _set_value, notify=valueChanged)
    name = Property(str, lambda self: self._name, constant=True)
    #: Of `bool`, `int`, `float`, `string`, `path`, `topic`, `frame`, `enum`, `color`, `vector`,
    #: `quaternion` and `container`.
    kindName = Property(str, lambda self: self.kind.NAME, constant=True)

    def _get_description(self) -> str:
        return cast("str", self._about["description"])

    def _set_description(self, text: Any) -> None:
        self._change("description", text, text_of)

    description = Property(VARIANT, _get_description, _set_description, notify=aboutChanged)

    def _get_read_only(self) -> bool:
        return cast("bool", self._about["readOnly"])

    def _set_read_only(self, read_only: Any) -> None:
        self._change("readOnly", read_only, switch_of)

    #: People cannot change it; the interface can.
    readOnly = Property(VARIANT, _get_read_only, _set_read_only, notify=aboutChanged)

    def _get_hidden(self) -> bool:
        return cast("bool", self._about["hidden"])

    def _set_hidden(self, hidden: Any) -> None:
        self._change("hidden", hidden, switch_of)

    #: It is not shown in the panel.
    hidden = Property(VARIANT, _get_hidden, _set_hidden, notify=aboutChanged)

    def _change(self, name: str, value: Any, read: Callable[[Any], Any]) -> None:
        try:
            self._tell(**{name: read(value)})
        except Error as error:
            answering(self._owner.runtime, f"property {'/'.join(self.path)}.{name}", error, value)

    def _tell(self, **about: Any) -> None:
        if not about.items() <= self._about.items():
            self._about.update(about)
            self.aboutChanged.emit()

    def adopt(self, kind: Kind, about: dict[str, Any]) -> None:
        """Take over what a later registration says; a value out of its range becomes the default.

        Args:
            kind: Of the same class as before.
            about: `description`, `readOnly` and `hidden`, as far as they are given.
        """
        changed = kind.options != self.kind.options
        self.kind = kind
        self._tell(**about)
        if changed:
            self.aboutChanged.emit()
            try:
                kind.read(self._value)
            except Error as error:
                _log.warning("property %s: %s; it is %r now", self._name, error, kind.default)
                self.set(kind.default)

    def restore(self, saved: Any) -> None:
        """Take the value that a file has for it; one that does not fit is told in the log."""
        own = saved.get("Value") if self.properties and isinstance(saved, dict) else saved
        if isinstance(saved, dict) and "Value" in saved and self.kind.HOLDS_OTHERS:
            own = saved["Value"]
        if self.kind.NAME == "container" or own is None:
            return
        try:
            value = self.kind.restore(own)
        except Error as error:
            _log.warning(
                "property %s: the file's value is left out: %s", "/".join(self.path), error
            )
            return
        self.set(value)
