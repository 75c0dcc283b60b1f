"""The base class of views: the camera that follows a frame, by mouse, wheel, fingers and keys."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.comm.names import similar
from rosglass.errors import ArgumentError, Error, shown
from rosglass.scene.configs.rviz_formats import FIXED_FRAME
from rosglass.scene.render.camera import (
    FOV_RAD,
    Camera,
    Matrix,
    inverse,
    pose_matrix,
    three_numbers,
)
from rosglass.scene.view_controllers.events import Action, Button, Drag, Modifier, Touch, Wheel
from rosglass.scene.view_controllers.view_settings import (
    MAX_NAME_LENGTH,
    FlagSetting,
    FrameSetting,
    NumberSetting,
    ViewSetting,
    finite_number,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import ArrayLike

__all__ = [
    "DEFAULT_DISTANCE_M",
    "DRAG_ZOOM",
    "WHEEL_ZOOM",
    "FocalShape",
    "ViewController",
    "wheel_ratio",
]

#: Metres from the camera to its focal point.
DEFAULT_DISTANCE_M = 10.0
#: Share by which one unit of a drag, and one step of the wheel, zooms.
DRAG_ZOOM, WHEEL_ZOOM = 0.01, 0.12


class FocalShape(NamedTuple):
    """The flat ball that RViz shows, while a button is held, at the point that is orbited.

    Attributes:
        pose: Its pose in the fixed frame, 4 x 4.
        size: Metres across in x, y and z.
        color: RGBA, 0 to 1.
    """

    pose: Matrix
    size: tuple[float, float, float]
    color: tuple[float, float, float, float]


class ViewController:
    """Base class of the view controllers, which :data:`VIEWS` lists.

    A view follows its target frame, and keeps its settings in it. The scene calls
    :meth:`update_target` before each frame, and draws :meth:`camera`.

    Args:
        class_id: RViz's, e.g. ``rviz/Orbit``; RViz 2's by default.

    Attributes:
        name: Name of the view, as saved views have one.
        problem: Why the target frame cannot be followed; empty if it can.
        on_change: Called after each change of a setting.
        on_target: Called after another target frame was chosen.
    """

    #: Name of the type, as in RViz's Views panel.
    TYPE = ""
    #: A sentence about the type.
    DESCRIPTION = ""

    #: The effect of dragging with the left and the right button, without and with Shift.
    _LEFT = (Action.ROTATE_3D, Action.MOVE_XY)
    _RIGHT = (Action.ZOOM, Action.MOVE_Z)
    #: Instructions for the status bar, without and with Shift.
    _HELP = ("", "")

    near_clip = NumberSetting(
        "Near Clip Distance",
        0.01,
        "Anything closer to the camera than this threshold will not get rendered.",
        0.001,
        10_000.0,
    )
    invert_z = FlagSetting(
        "Invert Z Axis", False, "Invert camera's Z axis for Z-down environments/models."
    )
    target_frame = FrameSetting(
        "Target Frame", FIXED_FRAME, "TF frame whose motion this view will follow."
    )

    def __init__(self, class_id: str = "") -> None:
        self.class_id = class_id or f"rviz_default_plugins/{self.TYPE}"
        self.name = "Current View"
        self.problem = ""
        self.on_change: Callable[[], None] | None = None
        self.on_target: Callable[[], None] | None = None
        self._values: dict[str, Any] = {s.name: s.default for s in self.settings()}
        self._unknown: dict[str, Any] = {}
        #: The target frame's pose in the fixed frame, and as much of it as the view follows.
        self._target_pose: Matrix = np.eye(4)
        self._target: Matrix = np.eye(4)
        #: Another frame was chosen while the view was shown: the camera stays where it is.
        self._target_chosen = self._was_shown = False

    @classmethod
    def settings(cls) -> tuple[ViewSetting[Any], ...]:
        """Return the settings, in the order of RViz's panel."""
        found = {
            name: member
            for base in reversed(cls.__mro__)
            for name, member in vars(base).items()
            if isinstance(member, ViewSetting)
        }
        return tuple(found.values())

    # Panels and files

    def get(self, name: str) -> Any:
        """Return the value of a setting, by RViz's name.

        Raises:
            Error: There is none of this name.
        """
        return self._values[self._setting(name).name]

    def set(self, name: str, value: Any) -> None:
        """Change a setting, by RViz's name; numbers are clamped to its limits, as in RViz.

        Raises:
            Error: There is none of this name, or it cannot hold the value.
        """
        self._setting(name).__set__(self, value)

    def describe(self) -> Iterator[dict[str, Any]]:
        """Iterate over the settings: path, kind, value, default, description and limits."""
        for setting in self.settings():
            yield {
                "path": setting.name,
                "kind": setting.KIND,
                "value": setting.write(self._values[setting.name]),
                "default": setting.write(setting.default),
                "description": setting.description,
                **setting.options(),
            }

    def _setting(self, name: str) -> ViewSetting[Any]:
        names = {setting.name: setting for setting in self.settings()}
        if not isinstance(name, str) or name not in names:
            hint = similar(name, names) if isinstance(name, str) and len(name) < 100 else ""
            hint = hint or f"; there are: {', '.join(names)}"
            raise Error(f"the view {self.TYPE} has no setting {shown(name)}{hint}")
        return names[name]

    def state(self) -> dict[str, Any]:
        """Return the view as it stands in a ``.rviz`` file, under Views: Current or Saved."""
        found = {s.name: s.write(self._values[s.name]) for s in self.settings()}
        found.update(Class=self.class_id, Name=self.name)
        package, _, kind = self.class_id.rpartition("/")
        if package != "rviz":
            # RViz 1.14 no longer writes it.
            found["Value"] = f"{kind} ({package})"
        return dict(sorted({**copy.deepcopy(self._unknown), **found}.items()))

    def restore(self, state: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a ``.rviz`` file; others stay as they are.

        Args:
            state: As from :meth:`state`, of RViz 1 or 2. Unknown keys are kept.

        Returns:
            A warning for each value that was ignored, beginning with the setting's name.

        Raises:
            ArgumentError: The state is not a mapping.
        """
        if not isinstance(state, Mapping):
            raise ArgumentError("the view", state, "a mapping of settings by name")
        warnings = []
        self._was_shown = False
        # An axis to point towards comes before the angles, which it sets.
        for setting in sorted(self.settings(), key=lambda s: s.KIND != "enum"):
            if setting.name in state:
                try:
                    setting.__set__(self, state[setting.name])
                except ArgumentError as error:
                    warnings.append(str(error))
        name = state.get("Name", self.name)
        if isinstance(name, str) and len(name) <= MAX_NAME_LENGTH:
            self.name = name
        else:
            warnings.append(f"Name: expected a text of one line, got {shown(name)}")
        known = {s.name for s in self.settings()} | {"Class", "Name"}
        self._unknown = {
            key: copy.deepcopy(value)
            for key, value in state.items()
            if isinstance(key, str) and key not in known
        }
        return warnings

    # What the scene asks

    def update_target(self, pose: ArrayLike | None, reason: str = "") -> bool:
        """Follow the target frame; the camera stays where it is while there is no transform.

        Args:
            pose: Its pose in the fixed frame, 4 x 4; None if it is not known. The fixed frame's
                own needs no update.
            reason: Why it is not known, for :attr:`problem`.

        Returns:
            Whether the camera has moved.
        """
        try:
            whole = None if pose is None else pose_matrix(pose, "the transform")
        except Error as error:
            whole, reason = None, str(error)
        if whole is None:
            reason = reason or f"no transform from {self.target_frame} to the fixed frame"
            self.problem = f"{type(self).target_frame.name}: {reason}"
            return False
        self.problem = ""
        before, self._target_pose = self._target, whole
        self._target = self._followed(whole)
        if self._target_chosen:
            self._target_chosen = False
            self._carry(inverse(self._target) @ before)
        return not np.array_equal(before, self._target)

    def camera(self, width: float, height: float) -> Camera:
        """Return the camera for an item of a size."""
        self._was_shown = True
        return Camera(
            self._target @ self._eye_pose(),
            (max(width, 1.0), max(height, 1.0)),
            self._fov(),
            near=self.near_clip,
            focus_distance=self._focus_distance(),
        )

    def focal_shape(self) -> FocalShape | None:
        """Return the shape to show while a button is held, if any."""
        return None

    def action(self, buttons: Button, modifiers: Modifier) -> Action:
        """Return the effect of a drag, which is also the mouse's cursor."""
        shift = bool(modifiers & Modifier.SHIFT)
        if buttons & Button.LEFT:
            return self._LEFT[shift]
        if buttons & Button.MIDDLE:
            return Action.MOVE_XY
        return (self._RIGHT if buttons & Button.RIGHT else self._LEFT)[shift]

    def help(self, modifiers: Modifier) -> str:
        """Return the instructions for the status bar; bold as in HTML."""
        return self._HELP[bool(modifiers & Modifier.SHIFT)]

    # Events

    def on_drag(self, drag: Drag) -> None:
        """Move the camera by the mouse."""
        if not drag.buttons:
            return
        action = self.action(drag.buttons, drag.modifiers)
        if action is Action.ROTATE_3D:
            self._rotate(drag)
        elif action is Action.ROTATE_2D:
            self._turn(drag)
        elif action is Action.MOVE_XY:
            self._move(drag)
        elif action is Action.MOVE_Z:
            self._move_z(drag.dy)
        elif action is Action.ZOOM:
            self._zoom(1 + DRAG_ZOOM * drag.dy)

    def on_wheel(self, wheel: Wheel) -> None:
        """Zoom by the mouse's wheel, 12 % for a step."""
        self._zoom(wheel_ratio(wheel.steps))

    def on_touch(self, touch: Touch) -> None:
        """Rotate by one finger; move, zoom and turn by two."""
        button = Button.LEFT if touch.fingers == 1 else Button.MIDDLE
        if touch.dx or touch.dy:
            position = (touch.x, touch.y, touch.dx, touch.dy)
            self.on_drag(Drag(*position, button, Modifier.NONE, touch.size))
        if touch.fingers > 1:
            if touch.pinch > 0:
                self._pinch(touch.pinch)
            if touch.twist:
                self._twist(touch.twist)

    def on_key(self, key: str, pointed: Sequence[float] | None = None) -> bool:
        """Handle RViz's keys: F looks at what is under the mouse, Z resets the view.

        Args:
            key: The character.
            pointed: The point under the mouse in the fixed frame; None if there is nothing.

        Returns:
            Whether the view has used it.
        """
        if key.lower() == "f" and pointed is not None:
            self.look_at(pointed)
            return True
        if key.lower() == "z":
            self.reset()
            return True
        return False

    # Commands

    def look_at(self, point: Sequence[float]) -> None:
        """Turn the camera towards a point; a view from above moves above it.

        Args:
            point: x, y, z in the fixed frame, metres.

        Raises:
            Error: It is not three finite numbers.
        """
        self._look_at(self._to_target(three_numbers(point, "a point to look at", finite=True)))

    def reset(self) -> None:
        """Return to the start; target frame, near clip distance and z axis stay."""
        raise NotImplementedError

    def mimic(self, other: ViewController) -> None:
        """Take over from another view: its target frame, and what it shows as far as possible."""
        for name in (s.name for s in ViewController.settings()):
            self._store(name, other._values[name])
        self._target_pose = other._target_pose
        self._target = self._followed(other._target_pose)
        self.problem, self._target_chosen = other.problem, other._target_chosen
        self._take_over(other, inverse(self._target) @ other._target @ other._eye_pose())

    # What each view has of its own

    def _followed(self, pose: Matrix) -> Matrix:
        """Return as much of the target frame's pose as the view follows: its position."""
        followed = np.eye(4)
        followed[:3, 3] = pose[:3, 3]
        return followed

    def _carry(self, change: Matrix) -> None:
        """Stay where it was in the fixed frame, by the matrix from the old target to the new."""

    def _eye_pose(self) -> Matrix:
        """Return the camera's pose in the target frame."""
        raise NotImplementedError

    def _fov(self) -> float | None:
        return FOV_RAD

    def _focus_distance(self) -> float:
        return DEFAULT_DISTANCE_M

    def _look_at(self, point: Matrix) -> None:
        """Look at a point of the target frame."""

    def _take_over(self, other: ViewController, pose: Matrix) -> None:
        """Show the same as another view, by its camera's pose in the target frame."""

    def _rotate(self, drag: Drag) -> None: ...

    def _turn(self, drag: Drag) -> None: ...

    def _move(self, drag: Drag) -> None: ...

    def _move_z(self, dy: float) -> None: ...

    def _zoom(self, ratio: float) -> None:
        """Change the distance to what is seen by a ratio."""

    def _pinch(self, ratio: float) -> None:
        """Magnify the view by a ratio."""
        self._zoom(1 / ratio)

    def _twist(self, angle: float) -> None:
        """Turn the view clockwise by radians."""

    # Common parts

    def _store(self, name: str, value: Any) -> None:
        if self._values[name] != value:
            self._values[name] = value
            if self.on_change is not None:
                self.on_change()

    def _on_set(self, name: str) -> None:
        """Handle a setting that a user or a program has set."""
        if name == type(self).target_frame.name:
            self._target_chosen = self._was_shown
            if self.target_frame == FIXED_FRAME:
                self.update_target(np.eye(4))
            if self.on_target is not None:
                self.on_target()

    def _to_target(self, point: Sequence[float] | Matrix) -> Matrix:
        """Return a point of the fixed frame in the target frame."""
        found: Matrix = (inverse(self._target) @ np.append(point, 1.0))[:3]
        return found


def wheel_ratio(steps: float) -> float:
    """Return the ratio of distances for steps of the wheel.

    RViz multiplies for each event. An event of many steps, as a fast wheel or a touchpad gives it,
    counts as one for each.
    """
    steps = min(max(finite_number(steps, "steps of the wheel"), -100.0), 100.0)
    events = max(1, math.ceil(abs(steps)))
    return float((1 - WHEEL_ZOOM * steps / events) ** events)
