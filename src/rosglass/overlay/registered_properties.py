"""Properties that an overlay registers, shown below its entry in the Displays panel."""
# ruff: noqa: N815 - the names of slots, signals and properties are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.property_values import KINDS, merged, shown, to_storable
from rosglass.overlay.qml_members import (
    VARIANT,
    boolean,
    errors_to_js,
    spell_checked,
    text,
    to_python,
)
from rosglass.qml.engine.from_js import plain_from_js
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.overlay.property_values import Kind
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["RegisteredProperties", "RegisteredProperty"]


_log = logging.getLogger("rosglass.overlay")


def _attribute(name: str, from_qml: Callable[[Any], Any], notify: Any) -> Any:
    """Return the QML property of an attribute that the panel shows."""

    def read(self: RegisteredProperty) -> Any:
        return self._attributes[name]

    def write(self: RegisteredProperty, value: Any) -> None:
        what = f"property {'/'.join(self.path)}.{name}"
        with errors_to_js(self._owner.runtime, what, value):
            self._update(**{name: from_qml(to_python(value))})

    return Property(VARIANT, read, write, notify=notify)


class RegisteredProperty(QtCore.QObject):
    """One registered property; created by :class:`RegisteredProperties` only."""

    #: Name in error messages.
    CALLED = "property"

    valueChanged = Signal(VARIANT)
    #: Its description, limits, choices, `readOnly` or `hidden` have changed.
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
        #: Its JavaScript object, if there is an engine.
        self.js_object: QJSValue | None = None
        #: Its children, by name.
        self.properties: dict[str, RegisteredProperty] = {}
        self._value = default
        self._attributes: dict[str, Any] = {"description": "", "readOnly": False, "hidden": False}

    @property
    def path(self) -> tuple[str, ...]:
        """The names of its parents and its own."""
        return (*(self.container.path if self.container else ()), self._name)

    def get(self) -> Any:
        """Return the value."""
        return self._value

    def set(self, value: Any) -> None:
        """Change the value, even if the property is read-only in the panel.

        Raises:
            Error: The value is invalid.
        """
        new = self.kind.read(to_python(value))
        if new != self._value or type(new) is not type(self._value):
            self._value = new
            self.valueChanged.emit(new)
            self._owner.edited.emit()

    def _set_value(self, value: Any) -> None:
        with errors_to_js(self._owner.runtime, f"property {'/'.join(self.path)}", value):
            self.set(value)

    #: The value; setting an invalid one throws.
    value = Property(VARIANT, get, _set_value, notify=valueChanged)
    name = Property(str, lambda self: self._name, constant=True)
    #: One of `bool`, `int`, `float`, `string`, `path`, `topic`, `frame`, `enum`, `color`,
    #: `vector`, `quaternion` and `container`.
    kindName = Property(str, lambda self: self.kind.NAME, constant=True)

    description = _attribute("description", text(), aboutChanged)
    #: Whether users cannot change it; the overlay can.
    readOnly = _attribute("readOnly", boolean(), aboutChanged)
    #: Whether the panel does not show it.
    hidden = _attribute("hidden", boolean(), aboutChanged)

    def _update(self, **about: Any) -> None:
        if not about.items() <= self._attributes.items():
            self._attributes.update(about)
            self.aboutChanged.emit()

    def adopt(self, kind: Kind, about: dict[str, Any]) -> None:
        """Apply another registration; a value that is invalid now becomes the default."""
        changed = kind.options != self.kind.options
        self.kind = kind
        self._update(**about)
        if changed:
            self.aboutChanged.emit()
            try:
                kind.read(self._value)
            except Error as error:
                _log.warning("property %s: %s; reset to %r", self._name, error, kind.default)
                self.set(kind.default)

    def restore(self, saved: Any) -> None:
        """Set the value from a file; log an invalid one."""
        own = saved.get("Value") if self.properties and isinstance(saved, dict) else saved
        if isinstance(saved, dict) and "Value" in saved and self.kind.HOLDS_OTHERS:
            own = saved["Value"]
        if self.kind.NAME == "container" or own is None:
            return
        try:
            value = self.kind.restore(own)
        except Error as error:
            _log.warning("property %s: ignoring the file's value: %s", "/".join(self.path), error)
            return
        self.set(value)


#: Options of all kinds.
_COMMON = ("description", "readOnly", "hidden")


def _registering(name: str, kind: str, *order: str) -> Any:
    """Return a method that registers properties of a kind, for QML and Python.

    Args:
        name: Name of the method.
        kind: See :attr:`RegisteredProperty.kindName`.
        order: Its parameters after the property's name.
    """
    names = ("name", *order) if "description" in order else ("name", *order, "description")

    def call(self: RegisteredProperties, *arguments: Any, **options: Any) -> Any:
        with errors_to_js(self.runtime, f"rviz.{name}", *arguments):
            given = [to_python(argument) for argument in arguments]
            return self.register(kind, **_named(names, given, options))
        return None

    call.__name__ = name
    # Accept a parent first, options last, and one more to report it ourselves.
    for count in range(len(names) + 4):
        call = Slot(*[QJSValue] * count, result=QtCore.QObject)(call)
    return call


class RegisteredProperties(QtCore.QObject):
    """The registered properties of an overlay, and its free-form `config`.

    In QML, the parameters of all functions are `[parent,] name, default, description` and a map of
    options: `readOnly`, `hidden`; `min`, `max` and `step` for numbers; `choices`, `messageType` and
    `includeFixedFrame` may also be positional. In Python, options are keyword arguments::

        speed = overlay.properties.registerFloatProperty("Speed", 0.5, "m/s", min=0, max=2)
        speed.valueChanged.connect(drive)

    Registering an existing property returns it with its current value. Invalid arguments throw into
    the calling JavaScript, or raise a :class:`rosglass.Error`.
    """

    #: A property was added, at the top or below another one. Argument: the property.
    registered = Signal(object)
    #: A property was removed. Argument: the property.
    unregistered = Signal(object)
    #: A value that files store has changed.
    edited = Signal()
    configChanged = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        #: Runtime of the QML engine that errors are thrown into; None to raise them.
        self.runtime: Runtime | None = None
        #: The properties at the top, by name.
        self.properties: dict[str, RegisteredProperty] = {}
        self._saved: dict[str, Any] = {}
        self._config: dict[str, Any] = {}
        self._replaceable: set[RegisteredProperty] = set()

    # The free-form map.

    def get_config(self) -> dict[str, Any]:
        """Return the map that is saved with the overlay's entry."""
        return self._config

    def set_config(self, config: Any) -> None:
        """Replace the map that is saved with the overlay's entry.

        Raises:
            Error: A file cannot store it; the error names the part.
        """
        value = plain_from_js(config) if isinstance(config, QJSValue) else config
        if not isinstance(value, dict):
            raise Error(f"expected a map, e.g. {{speed: 1}}, got {shown(value)}")
        new = to_storable(value, "config")
        if new != self._config or repr(new) != repr(self._config):
            self._config = new
            self.configChanged.emit()
            self.edited.emit()

    def _set_config(self, config: Any) -> None:
        with errors_to_js(self.runtime, "rviz.config", config):
            self.set_config(config)

    #: Assign a new map to change it: changes inside the map are not detected.
    config = Property(VARIANT, get_config, _set_config, notify=configChanged)

    # Registration.

    #: A property without a value, as parent of others.
    registerPropertyContainer = _registering("registerPropertyContainer", "container")
    #: A boolean, shown as a check box.
    registerBoolProperty = _registering("registerBoolProperty", "bool", "default")
    #: An integer.
    registerIntProperty = _registering(
        "registerIntProperty", "int", "default", "description", "min", "max"
    )
    #: A number.
    registerFloatProperty = _registering(
        "registerFloatProperty", "float", "default", "description", "min", "max"
    )
    #: A text.
    registerStringProperty = _registering("registerStringProperty", "string", "default")
    #: One of the strings in `choices`.
    registerEnumProperty = _registering("registerEnumProperty", "enum", "default", "choices")
    #: A colour.
    registerColorProperty = _registering("registerColorProperty", "color", "default")
    #: A vector of x, y and z.
    registerVectorProperty = _registering("registerVectorProperty", "vector", "default")
    #: A quaternion of x, y, z and w.
    registerQuaternionProperty = _registering("registerQuaternionProperty", "quaternion", "default")
    #: The name of a topic of type `messageType`.
    registerRosTopicProperty = _registering(
        "registerRosTopicProperty", "topic", "default", "messageType"
    )
    #: The name of a frame.
    registerTfFrameProperty = _registering(
        "registerTfFrameProperty", "frame", "default", "description", "includeFixedFrame"
    )

    def register(
        self,
        kind: str,
        name: Any = "",
        *,
        parent: RegisteredProperty | None = None,
        default: Any = None,
        **options: Any,
    ) -> RegisteredProperty:
        """Return the property with the given name; create it if there is none.

        Args:
            kind: See :attr:`RegisteredProperty.kindName`.
            name: Its name, unique below its parent.
            parent: Its parent property; None at the top.
            default: Its initial value, unless a file has one.
            options: Options of all kinds and of this kind.

        Raises:
            Error: An argument is invalid; the error says what is expected.
        """
        if not isinstance(name, str) or not name.strip():
            raise Error(f"the name must be a text, e.g. 'Speed', got {shown(name)}")
        about, narrow = self._split_options(kind, name, options)
        try:
            made = KINDS[kind](**narrow)
            value = made.default if default is None else made.read(default)
        except Error as error:
            raise Error(f"{name}: {error}") from None
        siblings = self._siblings(parent, name)
        found = siblings.get(name)
        if found is not None and kind != found.kind.NAME:
            if found not in self._replaceable:
                raise Error(
                    f"{name}: a property of this name exists, of kind {found.kind.NAME}; "
                    "choose another name"
                )
            self.unregister(found)
            found = None
        if found is not None:
            self._replaceable.discard(found)
            found.adopt(made, about)
            return found
        return self._add(RegisteredProperty(self, parent, name, made, value), siblings, about)

    def _add(
        self,
        made: RegisteredProperty,
        siblings: dict[str, RegisteredProperty],
        about: dict[str, Any],
    ) -> RegisteredProperty:
        made._update(**about)
        if self.runtime is not None:
            made.js_object = spell_checked(self.runtime, made)
        siblings[made.path[-1]] = made
        saved: Any = self._saved
        for step in made.path:
            saved = saved.get(step) if isinstance(saved, dict) else None
        if saved is not None:
            made.restore(saved)
        self.registered.emit(made)
        return made

    @staticmethod
    def _split_options(
        kind: str, name: str, options: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Validate options, and split them into those of all kinds and those of this kind."""
        own = KINDS[kind].OPTIONS
        for option, value in options.items():
            if option not in (*_COMMON, *own):
                known = ", ".join((*own, *_COMMON))
                raise Error(f"{name}: there is no option {option!r} for this kind, only {known}")
            wanted = {"description": str, "readOnly": bool, "hidden": bool}.get(option)
            wanted = {"messageType": str, "includeFixedFrame": bool}.get(option, wanted)
            if wanted is not None and not isinstance(value, wanted):
                words = "a text" if wanted is str else "true or false"
                raise Error(f"{name}: {option}: expected {words}, got {shown(value)}")
        about = {key: options[key] for key in _COMMON if key in options}
        return about, {key: options[key] for key in own if key in options}

    def _siblings(
        self, parent: RegisteredProperty | None, name: str
    ) -> dict[str, RegisteredProperty]:
        if parent is None:
            return self.properties
        if not isinstance(parent, RegisteredProperty) or not is_alive(parent):
            raise Error(f"{name}: the parent must be a registered property, got {shown(parent)}")
        if parent not in set(self.all()):
            raise Error(f"{name}: the parent {parent.path[-1]} belongs to another overlay")
        if not parent.kind.HOLDS_OTHERS:
            what = f"{parent.path[-1]} is a {parent.kind.NAME}"
            raise Error(f"{name}: {what}, which holds no others; register a container for them")
        if name == "Value" and parent.kind.NAME != "container":
            raise Error(f"{name}: files store the parent's own value as Value; choose another name")
        return parent.properties

    def all(self) -> Iterator[RegisteredProperty]:
        """Iterate over all properties, parents before their children."""
        waiting = list(self.properties.values())
        while waiting:
            found = waiting.pop(0)
            yield found
            waiting[:0] = found.properties.values()

    def unregister(self, found: RegisteredProperty) -> None:
        """Remove a property and its children; a later property of its name gets its value."""
        self._saved = self.save()
        siblings = found.container.properties if found.container else self.properties
        if siblings.get(found.path[-1]) is found:
            del siblings[found.path[-1]]
            self.unregistered.emit(found)

    def begin_load(self) -> None:
        """Allow existing properties to be registered with another kind, when QML is reloaded."""
        self._replaceable = set(self.all())

    # Files.

    def save(self) -> dict[str, Any]:
        """Return all values as nested dicts, including a file's values of unknown properties."""
        return merged(self._saved, _saved(self.properties))

    def load(self, saved: dict[str, Any]) -> None:
        """Restore values from a file, for existing properties and for later ones.

        Args:
            saved: A result of :meth:`save`; scalars may be text.
        """
        self._saved = saved
        for found in self.all():
            here: Any = saved
            for step in found.path:
                here = here.get(step) if isinstance(here, dict) else None
            if here is not None:
                found.restore(here)


def _saved(properties: dict[str, RegisteredProperty]) -> dict[str, Any]:
    kept: dict[str, Any] = {}
    for name, found in properties.items():
        below = _saved(found.properties)
        if found.kind.NAME == "container":
            kept[name] = below
        else:
            own = found.kind.saved(found.get())
            kept[name] = {**below, "Value": own} if below else own
    return kept


def _named(names: tuple[str, ...], given: list[Any], options: dict[str, Any]) -> dict[str, Any]:
    """Return positional arguments by name, including a parent first and options last."""
    found = dict(options)
    if given and (given[0] is None or isinstance(given[0], QtCore.QObject)):
        found["parent"] = given.pop(0)
    usage = f"[parent,] {', '.join(names)}, {{options}}"
    # A map may also be the default of a vector.
    at_last = min(2, len(names) - 1)
    if len(given) > at_last and isinstance(given[-1], dict):
        found.update(given.pop())
    if len(given) > len(names):
        raise Error(f"{len(given)} arguments are too many; it takes {usage}")
    for name, value in zip(names, given, strict=False):
        if name in found:
            raise Error(f"{name} is given twice; it takes {usage}")
        if value is not None:
            found[name] = value
    return found
