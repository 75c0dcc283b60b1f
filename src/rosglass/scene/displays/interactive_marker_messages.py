"""Messages of interactive markers as records, made in the node's thread.

Controls without markers get RViz's arrows and rings.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.errors import Error
from rosglass.qml.elements.message_queue import frame_and_stamp
from rosglass.scene.displays.marker_messages import (
    ARROW,
    TEXT,
    TRIANGLE_LIST,
    MarkerRecord,
    read_marker,
)
from rosglass.scene.render.arrays import check_numbers
from rosglass.scene.render.matrices import instance_matrix, matrix_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Matrix = NDArray[np.float64]

__all__ = [
    "HELP",
    "MAX_PARTS",
    "ControlRecord",
    "InteractiveMarkerRecord",
    "MarkerUpdate",
    "description_control",
    "read_interactive_marker",
    "read_update",
]

# visualization_msgs/InteractiveMarkerControl: orientation and interaction modes.
INHERIT, FIXED, VIEW_FACING = range(3)
NONE, MENU, BUTTON, MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE = range(7)
MOVE_3D, ROTATE_3D, MOVE_ROTATE_3D = range(7, 10)
#: Instructions for the mouse by mode, as in RViz's status bar.
HELP = {
    MENU: "Left-Click: Show menu.",
    BUTTON: "Left-Click: Activate.",
    MOVE_AXIS: "Left-Click: Move.",
    MOVE_PLANE: "Left-Click: Move.",
    ROTATE_AXIS: "Left-Click: Rotate.",
    MOVE_ROTATE: "Left-Click: Move / Rotate.",
    MOVE_3D: "Left-Click: Move X/Y. Shift: Move Z.",
    ROTATE_3D: "Left-Click: Rotate around X/Y. Shift: Rotate around Z.",
    MOVE_ROTATE_3D: (
        "Left-Click: Move X/Y. Shift: Move Z. Ctrl: Rotate around X/Y. "
        "Ctrl + Shift: Rotate around Z."
    ),
}
_MAX_CONTROLS, _MAX_SHAPES = 1000, 10_000
#: Entries of a menu, how deep they are in each other, and letters of a title.
_MAX_ENTRIES, _MAX_DEPTH, _MAX_TITLE = 500, 10, 200
#: Interactive markers of a message; controls of all that are shown, and what these look like.
_MAX_MARKERS, MAX_PARTS = 2000, 6000
# visualization_msgs/InteractiveMarkerUpdate: types.
_KEEP_ALIVE = 0
#: RViz's opacity of the arrows and rings that it makes.
AUTOMATIC_ALPHA = 0.5
_RING_STEPS = 36


class ControlRecord(NamedTuple):
    """One control of an interactive marker.

    Attributes:
        name: Its name, unique in its marker.
        mode: Its interaction mode, e.g. :data:`MOVE_AXIS`.
        facing: Its orientation mode, e.g. :data:`VIEW_FACING`.
        turn: Its orientation, 3 x 3; x is its axis.
        description: For the user.
        always_visible: Whether it is shown while the mouse does something else, too.
        independent: Whether its markers turn with the interactive marker though it faces the view.
        markers: Its markers.
        automatic: Whether RViz's arrows and rings stand for markers that it does not have.
    """

    name: str
    mode: int
    facing: int
    turn: Matrix
    description: str = ""
    always_visible: bool = False
    independent: bool = False
    markers: tuple[MarkerRecord, ...] = ()
    automatic: bool = False


class InteractiveMarkerRecord(NamedTuple):
    """An interactive marker, read from its message.

    Attributes:
        name: Its name.
        description: The text above it.
        frame: Its frame.
        stamp: Its time in nanoseconds; 0 where it moves with its frame.
        pose: In its frame, 4 x 4.
        scale: Metres.
        controls: Its controls.
        menu: Entries of its menu, each with ``id``, ``title`` and ``children``.
        programs: Command lines by the number of the entry that wants to run them.
        problem: Why it is not shown, or not as it should be; empty otherwise.
    """

    name: str
    description: str = ""
    frame: str = ""
    stamp: int = 0
    pose: Matrix = np.eye(4)
    scale: float = 1.0
    controls: tuple[ControlRecord, ...] = ()
    menu: tuple[dict[str, Any], ...] = ()
    programs: dict[int, str] = {}  # noqa: RUF012 - never written
    problem: str = ""

    @property
    def parts(self) -> int:
        """Number of its controls and shapes."""
        return sum(1 + len(control.markers) for control in self.controls)


# -- messages --------------------------------------------------------------------------------------


def read_interactive_marker(message: Any) -> InteractiveMarkerRecord:
    """Return the record of a ``visualization_msgs/InteractiveMarker`` of ROS 1 or ROS 2."""
    name = message.name
    frame, stamp = frame_and_stamp(message)
    try:
        pose = matrix_of(message.pose)
        scale = float(message.scale) or 1.0
        if not (math.isfinite(scale) and scale > 0):
            raise Error(f"scale {scale}: expected a positive number of metres")
        check_numbers("scale", scale)
        shapes = sum(len(control.markers) for control in message.controls)
        if len(message.controls) > _MAX_CONTROLS or shapes > _MAX_SHAPES:
            raise Error(
                f"{len(message.controls)} controls with {shapes} markers are more than the "
                f"{_MAX_CONTROLS} with {_MAX_SHAPES} that are shown"
            )
        controls = list(_read_controls(message, scale))
    except Error as error:
        return InteractiveMarkerRecord(name, frame=frame, stamp=stamp, problem=str(error))
    menu, programs, problem = _read_menu(message.menu_entries)
    bad = next((one.problem for c in controls for one in c.markers if one.problem), "")
    problem = problem or bad or ("" if controls else "it has no controls")
    return InteractiveMarkerRecord(
        name,
        message.description,
        frame,
        stamp,
        pose,
        scale,
        tuple(controls),
        tuple(menu),
        programs,
        problem,
    )


def _read_controls(message: Any, scale: float) -> Iterable[ControlRecord]:
    taken: set[str] = set()
    number = 0
    for control in message.controls:
        name = control.name
        while name in taken:
            name = f"{control.name}_u{number}"  # as RViz calls them
            number += 1
        taken.add(name)
        q = control.orientation
        rotation = (q.x, q.y, q.z, q.w)
        if not np.isfinite(rotation).all():
            raise Error(f"control {name!r}: orientation {rotation} is not finite")
        if not NONE <= control.interaction_mode <= MOVE_ROTATE_3D:
            raise Error(f"control {name!r}: interaction_mode {control.interaction_mode} is invalid")
        if not INHERIT <= control.orientation_mode <= VIEW_FACING:
            raise Error(f"control {name!r}: orientation_mode {control.orientation_mode} is invalid")
        record = ControlRecord(
            name,
            control.interaction_mode,
            control.orientation_mode,
            instance_matrix(rotation=rotation)[:3, :3],
            control.description,
            control.always_visible,
            control.independent_marker_orientation,
            tuple(read_marker(one, ("", n)) for n, one in enumerate(control.markers)),
        )
        yield record if record.markers else _complete(record, scale)


def _read_menu(entries: Any) -> tuple[list[dict[str, Any]], dict[int, str], str]:
    """Return the tree of a menu, what it wants to run, and what is wrong with it."""
    top: list[dict[str, Any]] = []
    nodes: dict[int, list[dict[str, Any]]] = {0: top}
    depths = {0: 0}
    programs: dict[int, str] = {}
    problems: list[str] = []
    if len(entries) > _MAX_ENTRIES:
        problems.append(f"menu_entries: {len(entries)}, of which {_MAX_ENTRIES} are shown")
    for entry in entries[:_MAX_ENTRIES]:
        above = nodes.get(entry.parent_id)
        if above is None:
            problems.append(f"menu entry {entry.id}: its parent {entry.parent_id} is not above it")
            continue
        if entry.id in nodes:
            problems.append(f"menu entry {entry.id} occurs twice, or has the id 0")
            continue
        depth = depths[entry.id] = depths[entry.parent_id] + 1
        if depth > _MAX_DEPTH:
            problems.append(f"menu entry {entry.id} is deeper than {_MAX_DEPTH} menus")
            continue
        children = nodes[entry.id] = []
        above.append({"id": entry.id, "title": _title(entry.title), "children": children})
        if entry.command_type:
            programs[entry.id] = entry.command
    return top, programs, problems[0] if problems else ""


def _title(title: str) -> str:
    """Return the title of a menu entry; RViz's marks are boxes."""
    title = title[:_MAX_TITLE]
    for mark, box in (("[x]", "\u2611"), ("[ ]", "\u2610")):
        if title.startswith(mark):
            return f"{box} {title.removeprefix(mark).strip()}"
    return title


# -- what RViz makes -------------------------------------------------------------------------------


def _complete(control: ControlRecord, scale: float) -> ControlRecord:
    """Return a control with the arrows or the ring that RViz gives it."""
    pose = np.eye(4)
    pose[:3, :3] = control.turn
    axis = np.abs(control.turn[:, 0])
    red, green, blue = (axis / axis.max()).tolist()
    tint = (red, green, blue, AUTOMATIC_ALPHA)
    made: list[MarkerRecord] = []
    if control.mode == MOVE_AXIS:
        size = (0.15 * scale, 0.25 * scale, 0.2 * scale)
        for number, side in enumerate((scale, -scale)):
            ends = np.array([[0.5 * side, 0, 0], [0.9 * side, 0, 0]], np.float32)
            made.append(
                MarkerRecord(("", number), ARROW, 0, pose=pose, scale=size, color=tint, points=ends)
            )
    elif control.mode in (MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE):
        points, shades = _ring(control.mode)
        colors = np.empty((len(shades), 4), np.float32)
        colors[:, :3] = np.outer(shades, (red, green, blue))
        colors[:, 3] = 1.0  # multiplied with that of the marker
        if control.mode == MOVE_ROTATE:
            colors[shades == 1.0, 3] /= 2  # as in RViz
        size = (scale, scale, scale)
        ring = MarkerRecord(
            ("", 0), TRIANGLE_LIST, 0, pose=pose, scale=size, color=tint, points=points
        )
        # Without colours of its own, it is lit.
        made.append(ring if control.mode == MOVE_PLANE else ring._replace(colors=colors))
    elif control.mode == MENU:
        height = 0.25 * scale
        pose = instance_matrix((-0.1 * height, 0, 1.2 * scale - 0.1 * height))
        made.append(
            MarkerRecord(
                ("", 0), TEXT, 0, pose=pose, scale=(height,) * 3, text=control.description or "menu"
            )
        )
        return control._replace(markers=tuple(made), facing=VIEW_FACING, independent=False)
    return control._replace(markers=tuple(made), automatic=True)


def _ring(mode: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the triangles of a ring around x, (n * 3, 3), and how bright each is."""
    angles = np.arange(_RING_STEPS) * (2 * np.pi / _RING_STEPS)
    inner = np.zeros((_RING_STEPS, 3), np.float32)
    inner[:, 1], inner[:, 2] = 0.5 * np.cos(angles), 0.5 * np.sin(angles)
    outer = 1.3 * inner
    steps = np.arange(_RING_STEPS)
    second, third = (steps + 1) % _RING_STEPS, (steps + 2) % _RING_STEPS
    shades = np.ones(2 * _RING_STEPS, np.float32)
    if mode == ROTATE_AXIS:
        corners = [inner, outer[second], inner[second], inner[second], outer[second], outer[third]]
        shades = np.repeat(np.where(steps % 2, 1.0, 0.6), 2).astype(np.float32)
        return np.stack(corners, axis=1).reshape(-1, 3), shades
    if mode == MOVE_ROTATE:
        # Teeth, dark inside and bright outside.
        i, j, k = steps[::2], second[::2], third[::2]
        dark = [inner[i], outer[j], inner[j], inner[j], outer[j], inner[k]]
        bright = [outer[i], outer[j], inner[i], outer[j], outer[k], inner[k]]
        shades = np.tile(np.array([0.6, 0.6, 1.0, 1.0], np.float32), _RING_STEPS // 2)
        return np.stack(dark + bright, axis=1).reshape(-1, 3), shades
    corners = [inner, outer, inner[second], outer, outer[second], inner[second]]
    return np.stack(corners, axis=1).reshape(-1, 3), shades


def description_control(marker: InteractiveMarkerRecord) -> ControlRecord:
    """Return the control that shows the description of a marker above it."""
    text = MarkerRecord(
        ("", 0),
        TEXT,
        0,
        pose=instance_matrix((0, 0, 1.4 * marker.scale)),
        scale=(0.15 * marker.scale,) * 3,
        text=marker.description,
    )
    shown = (text,) if marker.description else ()
    return ControlRecord("", NONE, VIEW_FACING, np.eye(3), always_visible=True, markers=shown)


# -- updates ---------------------------------------------------------------------------------------


class MarkerUpdate(NamedTuple):
    """A message of a server.

    Attributes:
        server: Its name; empty in ROS 2, where one server has a namespace.
        number: The number of its last change.
        full: Whether these are all its markers.
        alive: Whether it only says that it is there.
        markers: Markers that are new, or that have changed.
        poses: Markers that were moved: name, frame, time in nanoseconds, pose or what is wrong.
        erased: Names of markers that are gone.
        size: Bytes of it as it was received.
    """

    server: str
    number: int
    full: bool
    alive: bool
    markers: tuple[InteractiveMarkerRecord, ...] = ()
    poses: tuple[tuple[str, str, int, Matrix | str], ...] = ()
    erased: tuple[str, ...] = ()
    size: int = 0


def read_update(message: Any, *, named: bool) -> MarkerUpdate:
    """Return the record of an update, of all markers, or of the service's response."""
    if len(message.markers) > _MAX_MARKERS:
        count = len(message.markers)
        raise Error(f"markers: {count} are more than the {_MAX_MARKERS} that are shown")
    server = message.server_id if named else ""
    markers = tuple(read_interactive_marker(one) for one in message.markers)
    if "type" not in message:
        number = message.seq_num if "seq_num" in message else message.sequence_number
        return MarkerUpdate(server, number, True, False, markers)
    if message.type == _KEEP_ALIVE:
        return MarkerUpdate(server, message.seq_num, False, True)
    poses = tuple(_read_pose(one) for one in message.poses[:_MAX_MARKERS])
    erased = tuple(message.erases)
    return MarkerUpdate(server, message.seq_num, False, False, markers, poses, erased)


def _read_pose(message: Any) -> tuple[str, str, int, Matrix | str]:
    header = message.header
    stamp = header.stamp
    parts = (stamp.secs, stamp.nsecs) if "secs" in stamp else (stamp.sec, stamp.nanosec)
    at = parts[0] * 1_000_000_000 + parts[1]
    try:
        return message.name, header.frame_id.lstrip("/"), at, matrix_of(message.pose)
    except Error as error:
        return message.name, header.frame_id.lstrip("/"), at, str(error)
