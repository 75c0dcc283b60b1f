"""Properties that an interface declares, shown in RViz's Displays panel and kept with its config.

Of the object ``rviz`` in QML, and of every overlay in Python; nothing here needs RViz itself.
"""
# ruff: noqa: N802 N815 - the names of slots, signals and properties are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.plain import plain_from_js
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive
from rosglass.rviz.face import VARIANT
from rosglass.rviz.property_kinds import KINDS
from rosglass.rviz.registered_property import RegisteredProperty, answering, python_value
from rosglass.rviz.saved_values import merged, writable
from rosglass.rviz.shown import shown
from rosglass.rviz.spelling import spelled

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml.runtime import Runtime

__all__ = ["RegisteredProperties"]

#: Options that every kind has.
_COMMON = ("description", "readOnly", "hidden")


def _slot(most: int) -> Callable[[Any], Any]:
    """Make a method callable from QML with up to `most` arguments of any kind."""

    def decorate(function: Any) -> Any:
        for count in range(most + 1):
            function = Slot(*[QJSValue] * count, result=QtCore.QObject)(function)
        return function

    return decorate


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
        try:
            self.set_config(config)
        except Error as error:
            answering(self.runtime, "rviz.config", error, config)

    #: Assign whole maps: a change inside of what was read is not seen.
    config = Property(VARIANT, get_config, _set_config, notify=configChanged)

    # Registering.

    @_slot(4)
    def registerPropertyContainer(self, *arguments: Any, **options: Any) -> Any:
        """Return a property that has no value, below which others stand."""
        return self._call("registerPropertyContainer", "container", (), arguments, options)

    @_slot(5)
    def registerBoolProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a check box."""
        return self._call("registerBoolProperty", "bool", ("default",), arguments, options)

    @_slot(8)
    def registerIntProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a whole number; after the description `min` and `max`, or options."""
        order = ("default", "description", "min", "max")
        return self._call("registerIntProperty", "int", order, arguments, options)

    @_slot(8)
    def registerFloatProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a number; after the description `min` and `max`, or options."""
        order = ("default", "description", "min", "max")
        return self._call("registerFloatProperty", "float", order, arguments, options)

    @_slot(5)
    def registerStringProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a text."""
        return self._call("registerStringProperty", "string", ("default",), arguments, options)

    @_slot(6)
    def registerEnumProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return one of the texts `choices`, which come after the default."""
        order = ("default", "choices")
        return self._call("registerEnumProperty", "enum", order, arguments, options)

    @_slot(5)
    def registerColorProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a colour."""
        return self._call("registerColorProperty", "color", ("default",), arguments, options)

    @_slot(5)
    def registerVectorProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a vector of x, y and z."""
        return self._call("registerVectorProperty", "vector", ("default",), arguments, options)

    @_slot(5)
    def registerQuaternionProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return a quaternion of x, y, z and w."""
        order = ("default",)
        return self._call("registerQuaternionProperty", "quaternion", order, arguments, options)

    @_slot(6)
    def registerRosTopicProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return the name of a topic of the type `messageType`, which comes after the default."""
        order = ("default", "messageType")
        return self._call("registerRosTopicProperty", "topic", order, arguments, options)

    @_slot(6)
    def registerTfFrameProperty(self, *arguments: Any, **options: Any) -> Any:
        """Return the name of a frame; `includeFixedFrame` comes after the description."""
        order = ("default", "description", "includeFixedFrame")
        return self._call("registerTfFrameProperty", "frame", order, arguments, options)

    def _call(
        self,
        function: str,
        kind: str,
        order: tuple[str, ...],
        arguments: tuple[Any, ...],
        options: dict[str, Any],
    ) -> RegisteredProperty | None:
        names = ("name", *order) if "description" in order else ("name", *order, "description")
        try:
            return self.register(
                kind, **_named(names, [python_value(a) for a in arguments], options)
            )
        except Error as error:
            answering(self.runtime, f"rviz.{function}", error, *arguments)
            return None

    def register(
        self,
        kind: str,
        name: Any = "",
        *,
        parent: RegisteredProperty | None = None,
        default: Any = None,
        **options: Any,
    ) -> RegisteredProperty:
        """Return the property of a name, which is made where there is none.

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
        made._tell(**about)
        if self.runtime is not None:
            made.for_js = spelled(self.runtime, made)
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
        """Return what is said about a property, and what narrows its values."""
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
        """Take a property away, with those below it; its value stays for one of its name."""
        self._saved = self.save()
        siblings = found.container.properties if found.container else self.properties
        if siblings.get(found.path[-1]) is found:
            del siblings[found.path[-1]]
            self.unregistered.emit(found)

    def begin_load(self) -> None:
        """Let each property be registered with another kind: the interface is loaded anew."""
        self._older = set(self.all())

    # Files.

    def save(self) -> dict[str, Any]:
        """Return all values by name, nested; those that a file had for others stay in it."""
        return merged(self._saved, _saved(self.properties))

    def load(self, saved: dict[str, Any]) -> None:
        """Take the values that a file has, now or for when a property is registered.

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
