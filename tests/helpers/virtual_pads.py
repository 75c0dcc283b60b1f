"""SDL's virtual gamepads."""

from __future__ import annotations

import ctypes
import warnings
from typing import Any

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # that it uses the library of pysdl2-dll
    import sdl2


class VirtualPad:
    """A gamepad made by SDL, once SDL is started; unplugged by :meth:`unplug`.

    Attributes:
        rumbles: The intensities that its motors were given: strong, weak.
    """

    def __init__(
        self,
        name: str = "Test Pad",
        axes: int = 6,
        buttons: int = 15,
        hats: int = 0,
        type: int = 1,
        pressed: tuple[int, ...] = (),
    ) -> None:
        self.rumbles: list[tuple[float, float]] = []

        def rumble(_: Any, low: int, high: int) -> int:
            self.rumbles.append((low / 65535, high / 65535))
            return 0

        description = sdl2.SDL_VirtualJoystickDesc()
        description.version = sdl2.SDL_VIRTUAL_JOYSTICK_DESC_VERSION
        description.type = type
        description.naxes, description.nbuttons, description.nhats = axes, buttons, hats
        description.name = name.encode()
        description.Rumble = kind_of_rumble(rumble)
        self._description = description  # SDL keeps pointers to what is in it
        sdl2.SDL_LockJoysticks()
        index = sdl2.SDL_JoystickAttachVirtualEx(ctypes.byref(description))
        assert index >= 0, sdl2.SDL_GetError()
        self._device = sdl2.SDL_JoystickOpen(index)
        for button in pressed:
            self.button(button)
        sdl2.SDL_UnlockJoysticks()
        assert self._device, sdl2.SDL_GetError()
        self.id = sdl2.SDL_JoystickInstanceID(self._device)
        self._plugged = True

    def axis(self, number: int, value: float) -> None:
        """Move an axis, -1 to 1 as SDL counts: forward and left are negative."""
        assert sdl2.SDL_JoystickSetVirtualAxis(self._device, number, round(32767 * value)) == 0

    def button(self, number: int, down: bool = True) -> None:
        """Press or release a button."""
        assert sdl2.SDL_JoystickSetVirtualButton(self._device, number, int(down)) == 0

    def hat(self, number: int, bits: int) -> None:
        """Press a hat: 1 up, 2 right, 4 down, 8 left."""
        assert sdl2.SDL_JoystickSetVirtualHat(self._device, number, bits) == 0

    def unplug(self) -> None:
        """Pull the plug; safe to call twice."""
        if not self._plugged:
            return
        self._plugged = False
        sdl2.SDL_LockJoysticks()
        for index in range(sdl2.SDL_NumJoysticks()):
            if sdl2.SDL_JoystickGetDeviceInstanceID(index) == self.id:
                assert sdl2.SDL_JoystickDetachVirtual(index) == 0
                break
        sdl2.SDL_UnlockJoysticks()
        sdl2.SDL_JoystickClose(self._device)


kind_of_rumble = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_uint16, ctypes.c_uint16)
#: Buttons and axes of a virtual gamepad.
A, B, LEFT_SHOULDER, RIGHT_SHOULDER = 0, 1, 9, 10
LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y, LEFT_TRIGGER, RIGHT_TRIGGER = range(6)
