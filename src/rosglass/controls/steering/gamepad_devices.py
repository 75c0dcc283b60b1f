"""Gamepads by SDL: found, read and shaken by one thread for the whole process; no Qt.

Needs the extra ``gamepad`` (PySDL2, and SDL's library by pysdl2-dll).
"""

from __future__ import annotations

import logging
import re
import threading
import time
import warnings
from collections import deque
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.comm.handle import guarded
from rosglass.errors import Error
from rosglass.extras import explain_missing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

__all__ = ["Element", "Pad", "Snapshot", "devices", "parse_element", "smooth"]

_log = logging.getLogger("rosglass.gamepad")

#: Seconds between two looks at the devices; while there are none, between two searches for some.
_POLL_S, _SEARCH_S = 0.004, 0.1
#: Seconds after which listeners are called although nothing has changed: inputs must be fresh.
_BEAT_S = 0.04
#: Gamepads that are read; others are not shown.
_MOST_PADS = 16
#: Controls of one gamepad that are read.
_MOST_CONTROLS = 128
_MOST_EVENTS = 64
#: Events and requests that wait for the thread, or for a listener that is busy.
_MOST_WAITING = 64
_MAX_NAME = 80
_ELEMENT = re.compile(r"(-?)(?:([ab])(\d{1,3})|h(\d{1,3})\.([1248]))\Z")
_MAPPED = re.compile(r"([+-]?)(?:([ab])(\d{1,3})(~?)|h(\d{1,3})\.([1248]))\Z")
#: SDL's bits of a hat: up, right, down, left.
_UP, _RIGHT, _DOWN, _LEFT = 1, 2, 4, 8
_TRIGGERS = ("lefttrigger", "righttrigger")


@dataclass(frozen=True)
class Element:
    """One axis, button or direction of a hat, as SDL's mappings write it.

    Attributes:
        kind: ``a``, ``b`` or ``h``.
        index: Its number on the device.
        bit: SDL's bit of a hat's direction.
        half: 1 or -1 if only this half of an axis counts.
        reversed: Whether an axis counts from its other end.
        trigger: Whether it is an axis from 0 (let go) to 1.
    """

    kind: str
    index: int
    bit: int = 0
    half: int = 0
    reversed: bool = False
    trigger: bool = False

    def __str__(self) -> str:
        return f"{self.kind}{self.index}" + (f".{self.bit}" if self.kind == "h" else "")


def parse_element(text: str) -> Element | None:
    """Return what ``a1``, ``-a1`` (reversed), ``b0`` or ``h0.4`` name; None for other texts."""
    found = _ELEMENT.match(text)
    if found is None:
        return None
    minus, kind, index, hat, bit = found.groups()
    if kind:
        return Element(kind, int(index), reversed=bool(minus))
    return Element("h", int(hat), int(bit), reversed=bool(minus))


def _mapped(mapping: str) -> dict[str, Element]:
    """Return the controls that a mapping of SDL's game controller database names."""
    names: dict[str, Element] = {}
    for part in mapping.split(",")[2:]:
        name, _, text = part.partition(":")
        found = _MAPPED.match(text)
        if not name or found is None:
            continue
        sign, kind, index, tilde, hat, bit = found.groups()
        half = {"+": 1, "-": -1, "": 0}[sign]
        trigger = name in _TRIGGERS
        if kind:
            names[name] = Element(kind, int(index), 0, half, bool(tilde), trigger)
        else:
            names[name] = Element("h", int(hat), int(bit))
    return names


def smooth(raw: float, dead_zone: float) -> float:
    """Return an axis from -1 to 1 without its dead zone, and without a step at the zone's edge.

    Args:
        raw: SDL's value, -32768 to 32767.
        dead_zone: Share of the way that counts as zero, 0 to less than 1.
    """
    value = max(-1.0, min(1.0, raw / 32767))
    way = abs(value) - dead_zone
    return 0.0 if way <= 0 else (way if value > 0 else -way) / (1 - dead_zone)


@dataclass(frozen=True)
class Pad:
    """A gamepad's state at one moment.

    Attributes:
        id: SDL's number of this connection of the device; a new one after each plugging in.
        name: Its name; a number is appended where several have the same.
        axes: SDL's values, -32768 to 32767; forward and left are negative.
        buttons: 1 while pressed.
        hats: SDL's bits.
        names: SDL's names of its controls; empty for a device that SDL does not know.
        rumbles: Whether it has motors.
    """

    id: int
    name: str
    axes: tuple[int, ...] = ()
    buttons: tuple[int, ...] = ()
    hats: tuple[int, ...] = ()
    names: Mapping[str, Element] = field(default_factory=dict, compare=False)
    rumbles: bool = False

    def joy_axes(self, dead_zone: float) -> list[float]:
        """Return the axes as ``joy_node`` orders them: left and forward positive, then hats."""
        axes = [0.0 - smooth(raw, dead_zone) for raw in self.axes]
        for hat in self.hats:
            axes.append(float(bool(hat & _LEFT)) - float(bool(hat & _RIGHT)))
            axes.append(float(bool(hat & _UP)) - float(bool(hat & _DOWN)))
        return axes

    def released(self) -> Pad:
        """Return this gamepad with nothing pressed and everything in its middle."""
        resting = {e.index for e in self.names.values() if e.trigger and e.kind == "a"}
        axes = tuple(-32768 if at in resting else 0 for at in range(len(self.axes)))
        return replace(
            self, axes=axes, buttons=(0,) * len(self.buttons), hats=(0,) * len(self.hats)
        )

    def has(self, element: Element) -> bool:
        """Return whether the device has this control."""
        many = {"a": self.axes, "b": self.buttons, "h": self.hats}[element.kind]
        return element.index < len(many)

    def axis(self, element: Element, dead_zone: float) -> float:
        """Return a control as an axis: left and forward positive; 0 to 1 of triggers, buttons."""
        if not self.has(element):
            return 0.0
        if element.kind == "b":
            value = float(self.buttons[element.index])
        elif element.kind == "h":
            value = float(bool(self.hats[element.index] & element.bit))
        else:
            raw = float(self.axes[element.index])
            if element.trigger and not element.half:
                raw = (raw + 32768) / 2
            elif element.half:
                raw = max(0.0, element.half * raw)
            one_way = element.trigger or element.half
            value = smooth(raw, dead_zone) * (1 if one_way else -1)
            if element.trigger and element.reversed:
                return 1 - value
        # Not -0.0, which is shown with its sign.
        return 0.0 + (-value if element.reversed else value)

    def is_pressed(self, element: Element) -> bool:
        """Return whether a control is pressed: of an axis, more than half of its way."""
        return abs(self.axis(element, 0.0)) > 0.5


@dataclass(frozen=True)
class Snapshot:
    """All gamepads at one moment.

    Attributes:
        at: The moment, by :func:`time.monotonic`.
        pads: The gamepads, in the order of their connection.
        problem: Why there cannot be any; empty without a problem.
    """

    at: float = 0.0
    pads: tuple[Pad, ...] = ()
    problem: str = ""


def _load() -> Any:
    """Import SDL, and start its part for gamepads.

    Raises:
        Error: It is not installed, or does not start.
    """
    try:
        with warnings.catch_warnings():
            # That it uses the library of pysdl2-dll.
            warnings.simplefilter("ignore")
            sdl2: Any = import_module("sdl2")  # optional, and without types
    except ModuleNotFoundError as error:
        raise Error(explain_missing(error) or str(error)) from None
    except (ImportError, RuntimeError, OSError) as error:
        raise Error(f"SDL cannot be loaded: {error}") from None
    hints = {
        # It would swallow SIGTERM and SIGINT.
        "SDL_NO_SIGNAL_HANDLERS": b"1",
        # There is no window of SDL's; the user of a gamepad watches Qt's.
        "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": b"1",
    }
    for name, value in hints.items():
        sdl2.SDL_SetHint(name.encode(), value)
    if sdl2.SDL_Init(sdl2.SDL_INIT_JOYSTICK) != 0:
        raise Error(f"SDL does not find gamepads: {_text(sdl2.SDL_GetError())}")
    return sdl2


def _text(name: bytes | None) -> str:
    return (name or b"").decode("utf-8", "replace")[:_MAX_NAME]


class _Sdl:
    """SDL's gamepads, on one thread."""

    def __init__(self) -> None:
        self._sdl = sdl = _load()
        #: Open devices and their state, by id.
        self._open: dict[int, Any] = {}
        self.pads: dict[int, Pad] = {}
        self._events = (sdl.SDL_Event * _MOST_EVENTS)()
        _log.debug("gamepads are read by SDL %s", sdl.dll.version)

    def poll(self) -> list[tuple[Pad, ...]]:
        """Read what has happened; return the states since then, one for each button."""
        sdl, states = self._sdl, []
        before: dict[int, Pad] = dict(self.pads)
        sdl.SDL_PumpEvents()
        while True:
            count = sdl.SDL_PeepEvents(
                self._events,
                _MOST_EVENTS,
                sdl.SDL_GETEVENT,
                sdl.SDL_FIRSTEVENT,
                sdl.SDL_LASTEVENT,
            )
            for event in self._events[: max(0, count)]:
                if self._handle(event):
                    states.append(tuple(self.pads.values()))
                    before = dict(self.pads)
            if count < _MOST_EVENTS:
                break
        if self.pads != before:
            states.append(tuple(self.pads.values()))
        return states

    def _handle(self, event: Any) -> bool:
        """Apply an event; return whether listeners must see the state after it by itself."""
        sdl, kind = self._sdl, event.type
        if kind == sdl.SDL_JOYAXISMOTION:
            self._set(event.jaxis.which, "axes", event.jaxis.axis, event.jaxis.value)
        elif kind in (sdl.SDL_JOYBUTTONDOWN, sdl.SDL_JOYBUTTONUP):
            down = int(kind == sdl.SDL_JOYBUTTONDOWN)
            return self._set(event.jbutton.which, "buttons", event.jbutton.button, down)
        elif kind == sdl.SDL_JOYHATMOTION:
            return self._set(event.jhat.which, "hats", event.jhat.hat, event.jhat.value)
        elif kind == sdl.SDL_JOYDEVICEADDED:
            return self._add(event.jdevice.which)
        elif kind == sdl.SDL_JOYDEVICEREMOVED:
            return self._remove(event.jdevice.which)
        return False

    def _set(self, pad_id: int, what: str, index: int, value: int) -> bool:
        pad = self.pads.get(pad_id)
        if pad is None:
            return False
        values = getattr(pad, what)
        if index >= len(values) or values[index] == value:
            return False
        changed: Any = {what: (*values[:index], value, *values[index + 1 :])}
        self.pads[pad_id] = replace(pad, **changed)
        return True

    def _add(self, index: int) -> bool:
        sdl = self._sdl
        pad_id = sdl.SDL_JoystickGetDeviceInstanceID(index)
        if pad_id < 0 or pad_id in self.pads:
            return False  # it is unplugged already
        if len(self.pads) >= _MOST_PADS:
            _log.warning("a gamepad is not used: there are %d already", _MOST_PADS)
            return False
        mapping = _mapped(_long_text(sdl.SDL_GameControllerMappingForDeviceIndex(index)))
        device = sdl.SDL_JoystickOpen(index)
        if not device:
            _log.warning("a gamepad cannot be opened: %s", _text(sdl.SDL_GetError()))
            return False
        self._open[pad_id] = device
        name = _text(sdl.SDL_JoystickName(device)) or f"gamepad {pad_id}"
        taken = {pad.name for pad in self.pads.values()}
        unique = next(
            new
            for number in range(1, _MOST_PADS + 2)
            if (new := f"{name} ({number})" if number > 1 else name) not in taken
        )

        def read(count: int, get: Callable[[Any, int], int]) -> tuple[int, ...]:
            return tuple(get(device, at) for at in range(min(_MOST_CONTROLS, max(0, count))))

        self.pads[pad_id] = Pad(
            pad_id,
            unique,
            read(sdl.SDL_JoystickNumAxes(device), sdl.SDL_JoystickGetAxis),
            read(sdl.SDL_JoystickNumButtons(device), sdl.SDL_JoystickGetButton),
            read(sdl.SDL_JoystickNumHats(device), sdl.SDL_JoystickGetHat),
            mapping,
            bool(sdl.SDL_JoystickHasRumble(device)),
        )
        _log.info("gamepad connected: %s", unique)
        return True

    def _remove(self, pad_id: int) -> bool:
        pad, device = self.pads.pop(pad_id, None), self._open.pop(pad_id, None)
        if device is not None:
            self._sdl.SDL_JoystickClose(device)
        if pad is not None:
            _log.info("gamepad disconnected: %s", pad.name)
        return pad is not None

    def rumble(self, pad_id: int, strong: float, weak: float, seconds: float) -> None:
        """Let a gamepad's motors run; without motors, nothing happens."""
        device = self._open.get(pad_id)
        if device is not None:
            self._sdl.SDL_JoystickRumble(
                device, round(65535 * strong), round(65535 * weak), round(1000 * seconds)
            )

    def close(self) -> None:
        """Close the devices, and end SDL."""
        for device in self._open.values():
            self._sdl.SDL_JoystickRumble(device, 0, 0, 0)
            self._sdl.SDL_JoystickClose(device)
        self._open.clear()
        self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_JOYSTICK)


def _long_text(text: bytes | None) -> str:
    return (text or b"").decode("utf-8", "replace")


class _Devices:
    """The gamepads of this machine; its thread runs while there are listeners."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._listeners: dict[object, Callable[[Snapshot], None]] = {}
        self._thread: threading.Thread | None = None
        self._ended = threading.Event()
        self._rumbles: deque[tuple[int, float, float, float]] = deque(maxlen=_MOST_WAITING)

    def listen(self, listener: Callable[[Snapshot], None]) -> Callable[[], None]:
        """Call a function, on the devices' thread, with each new state, and 25 times a second.

        Returns:
            A function that ends this.
        """
        key = object()
        with self._lock:
            self._listeners = {**self._listeners, key: listener}
            if self._thread is None:
                self._ended = threading.Event()
                # After the one before, if that is still ending: SDL is one for the process.
                self._thread = threading.Thread(
                    target=self._run, args=(self._ended,), name="rosglass-gamepad", daemon=True
                )
                self._thread.start()

        def end() -> None:
            with self._lock:
                self._listeners = {k: v for k, v in self._listeners.items() if k is not key}
                if not self._listeners and self._thread is not None:
                    self._ended.set()
                    self._thread = None

        return end

    def rumble(self, pad_id: int, strong: float, weak: float, seconds: float) -> None:
        """Let a gamepad's motors run; thread-safe.

        Args:
            pad_id: Its id; unknown ones are ignored, as it may just have been unplugged.
            strong: The slow, heavy motor, 0 to 1.
            weak: The fast, light one, 0 to 1.
            seconds: 0 to 10.
        """
        self._rumbles.append((pad_id, strong, weak, seconds))

    def _run(self, ended: threading.Event) -> None:
        with _one_thread:
            if ended.is_set():
                return
            try:
                sdl = _Sdl()
            except Error as error:
                self._fail(ended, str(error))
                return
            try:
                with guarded(_log, "gamepads are not read any more"):
                    self._read(sdl, ended)
            finally:
                sdl.close()
            self._fail(ended, "gamepads are not read any more; the log says why")

    def _fail(self, ended: threading.Event, problem: str) -> None:
        """Report a problem, to later listeners as well."""
        while not ended.is_set():
            self._announce(Snapshot(time.monotonic(), (), problem))
            ended.wait(_SEARCH_S)

    def _read(self, sdl: _Sdl, ended: threading.Event) -> None:
        beat = 0.0
        while not ended.wait(_POLL_S if sdl.pads else _SEARCH_S):
            states = sdl.poll()
            while self._rumbles:
                sdl.rumble(*self._rumbles.popleft())
            now = time.monotonic()
            if not states and now - beat >= _BEAT_S:
                states = [tuple(sdl.pads.values())]
            for pads in states:
                beat = now
                self._announce(Snapshot(now, pads))

    def _announce(self, snapshot: Snapshot) -> None:
        for listener in self._listeners.values():
            with guarded(_log, "a listener of gamepads failed"):
                listener(snapshot)


#: Held by the thread that uses SDL.
_one_thread = threading.Lock()
#: The gamepads of this machine.
devices = _Devices()
