"""Properties that an interface registers, shown in its entry of the Displays panel."""
# ruff: noqa: N815 - the names of slots, signals and properties are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, cast

from rosglass.errors import Error
from rosglass.qml.from_js import plain_from_js
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive
from rosglass.rviz.face import VARIANT, errors_to_js, spell_checked, switch, text, to_python
from rosglass.rviz.property_values import KINDS, merged, shown, writable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.property_values import Kind

__all__ = ["RegisteredProperties", "RegisteredProperty"]


_log = logging.getLogger("rosglass.rviz")


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
        """Change the value, also of a property that is read-only in the panel.

        Raises:
            Error: The property cannot hold it.
        """
        new = self.kind.read(to_python(value))
        if new != self._value or type(new) is not type(self._value):
            self._value = new
            self.valueChanged.emit(new)
            self._owner.edited.emit()

    def _set_value(self, value: Any) -> None:
        with errors_to_js(self._owner.runtime, f"property {'/'.join(self.path)}", value):
            self.set(value)

    #: The value; one that does not fit throws.
    value = Property(VARIANT, get, _set_value, notify=valueChanged)
    name = Property(str, lambda self: self._name, constant=True)
    #: Of `bool`, `int`, `float`, `string`, `path`, `topic`, `frame`, `enum`, `color`, `vector`,
    #: `quaternion` and `container`.
    kindName = Property(str, lambda self: self.kind.NAME, constant=True)

    def _get_description(self) -> str:
        return cast("str", self._about["description"])

    def _set_description(self, value: Any) -> None:
        self._change("description", value, text())

    description = Property(VARIANT, _get_description, _set_description, notify=aboutChanged)

    def _get_read_only(self) -> bool:
        return cast("bool", self._about["readOnly"])

    def _set_read_only(self, value: Any) -> None:
        self._change("readOnly", value, switch())

    #: People cannot change it; the interface can.
    readOnly = Property(VARIANT, _get_read_only, _set_read_only, notify=aboutChanged)

    def _get_hidden(self) -> bool:
        return cast("bool", self._about["hidden"])

    def _set_hidden(self, value: Any) -> None:
        self._change("hidden", value, switch())

    #: It is not shown in the panel.
    hidden = Property(VARIANT, _get_hidden, _set_hidden, notify=aboutChanged)

    def _change(self, name: str, value: Any, takes: Callable[[Any], Any]) -> None:
        what = f"property {'/'.join(self.path)}.{name}"
        with errors_to_js(self._owner.runtime, what, value):
            self._update(**{name: takes(to_python(value))})

    def _update(self, **about: Any) -> None:
        if not about.items() <= self._about.items():
            self._about.update(about)
            self.aboutChanged.emit()

    def adopt(self, kind: Kind, about: dict[str, Any]) -> None:
        """Adopt a later registration; a value out of its range becomes the default.

        Args:
            kind: Of the same class as before.
            about: `description`, `readOnly` and `hidden`, as far as they are given.
        """
        changed = kind.options != self.kind.options
        self.kind = kind
        self._update(**about)
        if changed:
            self.aboutChanged.emit()
            try:
                kind.read(self._value)
            except Error as error:
                _log.warning("property %s: %s; it is %r now", self._name, error, kind.default)
                self.set(kind.default)

    def restore(self, saved: Any) -> None:
        """Take its value from a file; log one that does not fit."""
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


#: Options that every kind has.
_COMMON = ("description", "readOnly", "hidden")


def _registering(name: str, kind: str, *order: str) -> Any:
    """Return the function that registers properties of a kind, for QML and Python.

    Args:
        name: Its name.
        kind: See :attr:`RegisteredProperty.kindName`.
        order: The arguments after the name of the property.
    """
    names = ("name", *order) if "description" in order else ("name", *order, "description")

    def call(self: RegisteredProperties, *arguments: Any, **options: Any) -> Any:
        with errors_to_js(self.runtime, f"rviz.{name}", *arguments):
            given = [to_python(argument) for argument in arguments]
            return self.register(kind, **_named(names, given, options))
        return None

    call.__name__ = name
    # A parent may come first, options come last, and one too many is an error of ours.
    for count in range(len(names) + 4):
        call = Slot(*[QJSValue] * count, result=QtCore.QObject)(call)
    return call


class RegisteredProperties(QtCore.QObject):
    """The properties of one overlay, and the free `config` beside them.

    From QML, every function takes `[parent,] name, default, description` and at last a map of
    options: `readOnly`, `hidden`; `min`, `max` and `step` for numbers; `choices`, `messageType` and
    `includeFixedFrame` also have their place among the others. From Python, options are keywords::

        speed = overlay.properties.registerFloatProperty("Speed", 0.5, "m/s", min=0, max=2)
        speed.valueChanged.connect(drive)

    A property that there is already is returned as it is, with its value. What does not fit throws
    into the calling JavaScript, or raises a :class:`rosglass.Error`.
    """

    #: A property came, below another or at the top.
    registered = Signal(object)
    #: A property is gone.
    unregistered = Signal(object)
    #: Something that a file would keep is another now.
    edited = Signal()
    configChanged = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        #: The engine's whose JavaScript calls; errors are thrown there.
        self.runtime: Runtime | None = None
        #: Properties at the top, by name.
        self.properties: dict[str, RegisteredProperty] = {}
        self._saved: dict[str, Any] = {}
        self._config: dict[str, Any] = {}
        self._older: set[RegisteredProperty] = set()

    # The free map.

    def get_config(self) -> dict[str, Any]:
        """Return the map that is kept with the display."""
        return self._config

    def set_config(self, config: Any) -> None:
        """Change the map that is kept with the display, as a whole.

        Raises:
            Error: A file could not keep it; the error says which part.
        """
        value = plain_from_js(config) if isinstance(config, QJSValue) else config
        if not isinstance(value, dict):
            raise Error(f"expected a map, e.g. {{speed: 1}}, got {shown(value)}")
        new = writable(value, "config")
        if new != self._config or repr(new) != repr(self._config):
            self._config = new
            self.configChanged.emit()
            self.edited.emit()

    def _set_config(self, config: Any) -> None:
        with errors_to_js(self.runtime, "rviz.config", config):
            self.set_config(config)

    #: Assign whole maps: a change inside of what was read is not seen.
    config = Property(VARIANT, get_config, _set_config, notify=configChanged)

    # Registering.

    #: A property without a value, below which others stand.
    registerPropertyContainer = _registering("registerPropertyContainer", "container")
    #: A check box.
    registerBoolProperty = _registering("registerBoolProperty", "bool", "default")
    #: A whole number.
    registerIntProperty = _registering(
        "registerIntProperty", "int", "default", "description", "min", "max"
    )
    #: A number.
    registerFloatProperty = _registering(
        "registerFloatProperty", "float", "default", "description", "min", "max"
    )
    #: A text.
    registerStringProperty = _registering("registerStringProperty", "string", "default")
    #: One of the texts `choices`.
    registerEnumProperty = _registering("registerEnumProperty", "enum", "default", "choices")
    #: A colour.
    registerColorProperty = _registering("registerColorProperty", "color", "default")
    #: A vector of x, y and z.
    registerVectorProperty = _registering("registerVectorProperty", "vector", "default")
    #: A quaternion of x, y, z and w.
    registerQuaternionProperty = _registering("registerQuaternionProperty", "quaternion", "default")
    #: The name of a topic of the type `messageType`.
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
        """Return the property of a name, created if there is none.

        Args:
            kind: See :attr:`RegisteredProperty.kindName`.
            name: Unique below its parent.
            parent: The property below which it stands.
            default: Its value where no file has another.
            options: Of all properties and of this kind.

        Raises:
            Error: Something does not fit; the error says what, and what would.
        """
        if not isinstance(name, str) or not name.strip():
            raise Error(f"the name must be a text, e.g. 'Speed', got {shown(name)}")
        about, narrow = self._sorted(kind, name, options)
        try:
            made = KINDS[kind](**narrow)
            value = made.default if default is None else made.read(default)
        except Error as error:
            raise Error(f"{name}: {error}") from None
        siblings = self._siblings(parent, name)
        found = siblings.get(name)
        if found is not None and kind != found.kind.NAME:
            if found not in self._older:
                raise Error(
                    f"{name}: there is one of this name already, of kind {found.kind.NAME}; "
                    "give this one another name"
                )
            self.unregister(found)
            found = None
        if found is not None:
            self._older.discard(found)
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
            made.for_js = spell_checked(self.runtime, made)
        siblings[made.path[-1]] = made
        saved: Any = self._saved
        for step in made.path:
            saved = saved.get(step) if isinstance(saved, dict) else None
        if saved is not None:
            made.restore(saved)
        self.registered.emit(made)
        return made

    @staticmethod
    def _sorted(
        kind: str, name: str, options: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Split options into those of all kinds and those of this kind, and check them."""
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
            raise Error(f"{name}: files keep the parent's own value by this name; take another one")
        return parent.properties

    def all(self) -> Iterator[RegisteredProperty]:
        """Iterate over all properties, each before those below it."""
        waiting = list(self.properties.values())
        while waiting:
            found = waiting.pop(0)
            yield found
            waiting[:0] = found.properties.values()

    def unregister(self, found: RegisteredProperty) -> None:
        """Remove a property with those below it; its value is kept for one of its name."""
        self._saved = self.save()
        siblings = found.container.properties if found.container else self.properties
        if siblings.get(found.path[-1]) is found:
            del siblings[found.path[-1]]
            self.unregistered.emit(found)

    def begin_load(self) -> None:
        """Allow properties to be registered with another kind, as the interface is loaded anew."""
        self._older = set(self.all())

    # Files.

    def save(self) -> dict[str, Any]:
        """Return all values by name, nested; those that a file had for others stay in it."""
        return merged(self._saved, _saved(self.properties))

    def load(self, saved: dict[str, Any]) -> None:
        """Restore values from a file, now or when a property is registered.

        Args:
            saved: As :meth:`save` gave it; scalars may be text.
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
    """Return arguments by name: a parent first, where there is one, and options at last."""
    found = dict(options)
    if given and (given[0] is None or isinstance(given[0], QtCore.QObject)):
        found["parent"] = given.pop(0)
    usage = f"[parent,] {', '.join(names)}, {{options}}"
    # The default of a vector is a map as well.
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
