"""The display Effort: the torques of a robot's joints, as arcs around their axes."""
# ruff: noqa: N802, N815 - the names of slots and properties are QML's

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from rosglass.errors import Error, ExtrapolationException, TransformException
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Signal, Slot, is_alive
from rosglass.scene.configs.settings import Setting
from rosglass.scene.data.urdf import parse_urdf
from rosglass.scene.displays.display import Status
from rosglass.scene.displays.parts import Parts
from rosglass.scene.displays.robot_model import DescriptionLoader, DescriptionSource
from rosglass.scene.displays.topic_display import HistoryDisplay
from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.matrices import rotation_of_z_to
from rosglass.scene.render.mesh_shapes import CONE
from rosglass.scene.render.point_colors import rainbow

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.data.urdf import Joint
    from rosglass.scene.render.scene_tree import Group

__all__ = ["EffortDisplay"]

#: Milliseconds until a description that is not there is looked up again.
_RETRY_MS = 2000
#: Seconds between two drawn messages if they arrive faster.
_INTERVAL_S = 1 / 30
#: Seconds for which efforts may wait for the transforms of their time before that is an error.
_LATE_S = 1.0
#: Seconds for which the joints of other messages are shown beside those of the newest one.
_COMBINED_S = 3.0
#: Names that one message may have.
_MAX_NAMES = 10_000
#: Status lines of joints, before the rest is counted.
_MAX_JOINT_LINES = 10
#: Joints that are drawn: a torque turns them.
_TURNING = ("revolute", "continuous")
# RViz's arc: the radius in metres without an effort, what is added to the share of the limit, and
# 30 of 32 points of a circle, clockwise from y.
_INNER_M, _LEAST_PART = 0.05, 0.05
_ANGLES = np.arange(30) * math.pi / 16
_ARC = np.stack([np.sin(_ANGLES), np.cos(_ANGLES), np.zeros(30)], axis=1)


class _NoDescriptionError(Error):
    """The robot description cannot be received."""


class _Endpoint:
    """The subscription to joint states, and where the robot description comes from."""

    def __init__(self, source: DescriptionSource, subscriptions: Any) -> None:
        self._parts = (source, subscriptions)

    def close(self) -> None:
        """Close both; safe to call twice."""
        for part in self._parts:
            part.close()


class _Efforts(NamedTuple):
    """The drawn values of one message.

    Attributes:
        values: Effort and position in the message, by name of the joint.
        poses: Known poses of the joints in the fixed frame, with the axis along z.
    """

    values: dict[str, tuple[float, int]]
    poses: dict[str, NDArray[np.float64]]


class _Owner:
    """The result of picking arcs or their heads.

    Attributes:
        names: Names of the joints, in the order in which they are drawn.

    Args:
        display: The display.
        efforts: Nm, by name of the joint.
        rows: Drawn rows of each joint: lines of an arc, or one head.
    """

    def __init__(self, display: EffortDisplay, efforts: dict[str, float], rows: int) -> None:
        self.display, self.names = display, tuple(efforts)
        self._efforts, self._rows = efforts, rows

    def __repr__(self) -> str:
        return f"efforts of {', '.join(self.names)}"

    def describe(self, number: int) -> list[tuple[str, str]]:
        """Return the lines of the Selection panel for one of the rows."""
        name = self.names[number // self._rows]
        return [
            ("Joint", name),
            ("Effort", f"{self._efforts[name]:g} Nm"),
            ("Max Effort", f"{self.display.maxEffort(name):g} Nm"),
        ]


class _JointStates:
    """Reads joint states, and combines those of several publishers, as arms and grippers have.

    Used in the node's threads.

    Args:
        combines: Whether joints that other messages have had in the last 3 s are added.
    """

    def __init__(self, combines: bool) -> None:
        self._combines = combines
        self._lock = threading.Lock()
        #: Effort, position in its message and time of arrival, by name of the joint.
        self._latest: dict[str, tuple[float, int, float]] = {}

    def read(self, message: Any) -> _Efforts | None:
        """Return the efforts to show; None for a message without any, beside others that have some.

        Raises:
            Error: Names and efforts do not fit, or no message has efforts.
        """
        names, efforts = message.name, np.asarray(message.effort, np.float64)
        now = time.monotonic()
        with self._lock:
            self._latest = {
                name: one
                for name, one in self._latest.items()
                if self._combines and now - one[2] < _COMBINED_S
            }
            if not len(efforts) and self._latest:
                return None
            if len(names) != len(efforts):
                hint = "; the publisher measures none" if not len(efforts) else ""
                raise Error(f"name has {len(names)} entries, effort {len(efforts)}{hint}")
            if len(names) > _MAX_NAMES:
                raise Error(
                    f"name: {len(names)} joints are more than the {_MAX_NAMES} that are read"
                )
            values = efforts.tolist()
            own = {str(name): (values[at], at, now) for at, name in enumerate(names)}
            combined = {**self._latest, **own}
            self._latest = combined if len(combined) <= _MAX_NAMES else own
            return _Efforts({name: one[:2] for name, one in self._latest.items()}, {})


def _joints_of(text: str, source: str, *_: Any) -> tuple[str, dict[str, Joint]]:
    """Return the robot's name, and its joints that turn."""
    if not text.strip():
        raise Error(f"{source}: the robot description is empty")
    robot = parse_urdf(text, source)
    return robot.name, {
        name: joint for name, joint in robot.joints.items() if joint.type in _TURNING
    }


class EffortDisplay(HistoryDisplay):
    """The efforts of ``sensor_msgs/JointState``. See its page in ``docs/scene.md``."""

    TYPE = "Effort"
    LENGTH = "History Length"
    MESSAGES = ("sensor_msgs/JointState",)
    # Joint states name no frame: each joint has its own.
    HAS_FRAMES = True
    IS_CONTINUOUS = True

    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    width = Setting("Width", "float", 0.02, "Line width of the arcs, in metres.", min=0.0)
    scale = Setting(
        "Scale", "float", 1.0, "Diameter of an arc at the joint's limit, in metres.", min=0.0
    )
    historyLength = Setting(
        "History Length", "int", 1, "Number of messages.", min=1, max=100_000, then="_on_length"
    )
    robotDescription = Setting(
        "Robot Description", "string", "robot_description",
        "Name of the description's parameter (ROS 1) or topic (ROS 2).",
        then="_on_source",
    )  # fmt: skip
    tfPrefix = Setting(
        "TF Prefix", "string", "", "Prefix of the links' frames, joined by a slash.",
        then="_on_prefix",
    )  # fmt: skip

    jointsChanged = Signal()
    #: Names of the joints that have a limit of their effort.
    joints: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        #: All joints that turn; None until the description is read.
        self._turning: dict[str, Joint] | None = None
        self._robot_name = ""
        self._text: str | None = None
        self._loader = DescriptionLoader(_joints_of, weak_callback(self._set_robot))
        self._urdf = Status("warn", "")
        #: The poses that :meth:`_place` has found for the next message of :meth:`show`.
        self._poses: dict[str, NDArray[np.float64]] = {}
        self._next_at = 0.0
        super().__init__(parent, runtime)
        self.parts: Parts = Parts(
            "Joints",
            lambda: self.joints,
            self._restyle,
            describe=lambda joint: (
                ("Effort", f"{self.effort(joint):g} Nm"),
                ("Max Effort", f"{self.maxEffort(joint):g} Nm"),
            ),
            as_mapping=True,
        )
        self._again = single_shot(self, self._create_again)
        self._throttle = single_shot(self, self._on_throttle)

    @Slot()
    def _on_throttle(self) -> None:
        self._on_items()

    # -- the description -------------------------------------------------------------------------

    def _on_source(self) -> None:
        self._text = self._turning = None
        self.reset()
        self.clear_status()
        report(self, joints=[])
        self._close_endpoint()
        self._schedule()

    def _wanted(self) -> tuple[Any, ...] | None:
        wanted = super()._wanted()
        name = self.robotDescription.strip()
        if wanted is not None and not name:
            self.set_status("URDF", "error", "Robot Description is empty: name it")
            return None
        return None if wanted is None else (*wanted, name)

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        node, *rest, name = wanted
        kind = "Parameter" if hasattr(node, "parameter_server") else "Topic"
        subscribe = super()._factory(node, *rest)
        executor, take = self._executor, weak_callback(self._take_text)
        if self._turning is None:
            self._urdf = Status("warn", f"waiting for the description: {kind.lower()} {name}")
        self.set_status("URDF", *self._urdf)

        def on_text(text: str) -> None:
            executor.post(lambda: take(text, name))

        def create() -> _Endpoint:
            try:
                source = DescriptionSource(node, kind, name, on_text)
            except Error as error:
                raise _NoDescriptionError(str(error)) from None
            try:
                return _Endpoint(source, subscribe())
            except Error:
                source.close()
                raise

        return create

    def _on_create_failed(self, error: Error) -> None:
        if isinstance(error, _NoDescriptionError):
            self._set_urdf("error", str(error))
            self._again.start(_RETRY_MS)
        else:
            super()._on_create_failed(error)

    def _set_urdf(self, level: str, text: str) -> None:
        self._urdf = Status(level, text)
        self.set_status("URDF", level, text)

    def _take_text(self, text: str, source: str) -> None:
        if not is_alive(self) or self.scene is None or text == self._text:
            return
        self._text = text
        self._loader.load(self.scene, text, source)

    def _set_robot(self, text: str, result: tuple[str, dict[str, Joint]] | Error) -> None:
        if not is_alive(self) or text != self._text:
            return
        if isinstance(result, Error):
            self._turning = None
            self._set_urdf("error", str(result))
            report(self, joints=[])
            self._restyle()
            return
        self._robot_name, self._turning = result
        limited = sorted(name for name in self._turning if self._limit_of(name) is not None)
        report(self, joints=limited)
        self.check_parts()
        text = f"Robot model parsed Ok: {len(limited)} joints with a limit of their effort"
        self._set_urdf("ok" if limited else "warn", text)
        self._restyle()
        self._show_waiting()

    def _limit_of(self, name: str) -> float | None:
        """Return the limit of a joint's effort in Nm; None where there is none."""
        joint = (self._turning or {}).get(name)
        if joint is None or joint.limits is None or joint.limits.effort <= 0:
            return None
        return joint.limits.effort

    # -- the joints ------------------------------------------------------------------------------

    @Slot(str, bool)
    def setJointEnabled(self, joint: str, enabled: bool) -> None:
        """Show or hide the effort of a joint."""
        self.switch_part(joint, enabled)

    @Slot(str, result=bool)
    def isJointEnabled(self, joint: str) -> bool:
        """Return whether the effort of a joint is shown."""
        return self.parts.is_enabled(joint)

    @Slot(str, result=float)
    def maxEffort(self, joint: str) -> float:
        """Return the limit of a joint's effort in Nm; 0 where there is none."""
        return self._limit_of(joint) or 0.0

    @Slot(str, result=float)
    def effort(self, joint: str) -> float:
        """Return the effort of a joint in Nm, in the newest message shown; NaN without one."""
        values = self._kept[-1].data.values if self._kept else {}
        return float(values.get(joint, (math.nan, 0))[0])

    # -- messages --------------------------------------------------------------------------------

    def _on_items(self) -> None:
        """Show new messages at most 30 times per second: robots send states at 1 kHz."""
        if not is_alive(self):
            return
        wait_s = self._next_at - time.monotonic()
        if wait_s > 0:
            if not self._throttle.isActive():
                self._throttle.start(math.ceil(wait_s * 1000))
            return
        self._next_at = time.monotonic() + _INTERVAL_S
        super()._on_items()

    def preparer(self) -> Callable[[Any], Any]:
        """Return the function that reads names and efforts."""
        # Beside earlier messages, each is shown as it is.
        return _JointStates(combines=not self.shows_all()).read

    def _on_prefix(self) -> None:
        self.on_fixed_frame()

    def _frame_of(self, joint: Joint) -> str:
        prefix = self.tfPrefix.strip("/")
        return f"{prefix}/{joint.child}" if prefix else joint.child

    def _place(self, item: Any) -> NDArray[np.float64] | None:
        if self._turning is None or self.scene is None:
            return None
        drawn = [name for name in item.data.values if self._limit_of(name) is not None]
        self._poses, missing = self._find_poses(drawn, item.stamp)
        is_late = time.monotonic() - self._placed_at > _LATE_S
        errors = list(missing.values())
        # Transforms of a moment often come after the data; a frame that does not exist may never.
        if errors and not is_late and (isinstance(errors[0], ExtrapolationException)):
            return None
        if errors and not self._poses:
            if is_late or not item.stamp:
                frame = self._frame_of(self._turning[next(iter(missing))])
                self.set_status("Transform", "error", f"no transform from [{frame}]: {errors[0]}")
            return None
        self._placed_at = time.monotonic()
        self.set_status("Transform", "ok", "Transform OK")
        self._report_joints(item.data, missing)
        return np.eye(4)

    def _find_poses(
        self, names: list[str], stamp: int
    ) -> tuple[dict[str, NDArray[np.float64]], dict[str, TransformException]]:
        """Return the poses of joints, and why others are not known; those yet to come first."""
        assert self._turning is not None
        assert self.scene is not None
        found: dict[str, NDArray[np.float64]] = {}
        missing: dict[str, TransformException] = {}
        for name in names:
            joint = self._turning[name]
            try:
                pose = self.scene.look_up(self._frame_of(joint), stamp)
            except TransformException as error:
                missing[name] = error
                continue
            turn = np.eye(4)
            turn[:3, :3] = rotation_of_z_to(np.array(joint.axis))
            found[name] = pose @ turn
        late = {k: e for k, e in missing.items() if isinstance(e, ExtrapolationException)}
        return found, {**late, **missing}

    def _report_joints(self, data: _Efforts, missing: Mapping[str, TransformException]) -> None:
        """Report efforts that are not drawn, and why."""
        assert self._turning is not None
        lines: dict[str, Status] = {}
        for name, (value, at) in data.values.items():
            joint = self._turning.get(name)
            if joint is None:
                continue
            limit = joint.limits.effort if joint.limits is not None else None
            if limit is None or limit <= 0:
                found = "no <limit>" if limit is None else f'<limit effort="{limit:g}">'
                text = f"the description has {found}: an effort above 0 is needed"
                lines[name] = Status("warn", text)
            elif not math.isfinite(value):
                lines[name] = Status("error", f"effort[{at}] is {value}")
            elif name in missing:
                frame = self._frame_of(joint)
                lines[name] = Status("error", f"no transform from [{frame}]: {missing[name]}")
        shown = {f"Joint {name}": lines[name] for name in list(lines)[:_MAX_JOINT_LINES]}
        if len(lines) > len(shown):
            worst = "error" if any(one.level == "error" for one in lines.values()) else "warn"
            shown["Joints"] = Status(worst, f"{len(lines)} joints of the message are not drawn")
        elif not self._turning.keys() & data.values.keys():
            text = f"name has no revolute or continuous joint of the robot {self._robot_name!r}"
            shown["Joints"] = Status("warn", text)
        for line in list(self.status_lines):
            if line.startswith("Joint") and line not in shown:
                self.delete_status(line)
        for line, status in shown.items():
            self.set_status(line, *status)

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:
        """Show the efforts of a message."""
        poses, self._poses = self._poses, {}
        if not poses and self._turning is not None:
            # In a new fixed frame, where joints were at the time may not be known any more.
            drawn = [name for name in data.values if self._limit_of(name) is not None]
            poses, _ = self._find_poses(drawn, 0)
        super().show(data._replace(poses=poses), pose, frame, stamp)

    def draw(self, data: Any, group: Group) -> None:
        """Draw an arc and its head for each joint."""
        efforts = {
            name: data.values[name][0]
            for name in data.poses
            if math.isfinite(data.values[name][0]) and self.isJointEnabled(name)
        }
        limits = {name: limit for name in efforts if (limit := self._limit_of(name)) is not None}
        if not limits:
            return
        efforts = {name: efforts[name] for name in limits}
        values = np.array(list(efforts.values()))
        parts = np.minimum(np.abs(values) / list(limits.values()), 1.0) + _LEAST_PART
        radii = _INNER_M + parts * self.scale / 2
        colors = np.full((len(values), 4), self.alpha)
        colors[:, :3] = rainbow(np.minimum(parts, 1.0))
        poses = np.array([data.poses[name] for name in efforts])
        # Near the first joint, numbers are small enough for the GPU.
        base = poses[0]
        poses = np.linalg.inv(base) @ poses

        points = radii[:, np.newaxis, np.newaxis] * _ARC
        points[values < 0, :, 0] *= -1
        points = points @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, np.newaxis, :3, 3]
        lines = np.stack([points[:, :-1], points[:, 1:]], axis=2)
        arcs = Lines(self.width, in_metres=True)
        arcs.set_segments(lines.reshape(-1, 2, 3), np.repeat(colors, lines.shape[1], axis=0))
        arcs.owner = _Owner(self, efforts, lines.shape[1])

        # From where the arc begins, along x.
        turn = np.where(values > 0, -1.0, 1.0)
        local = np.zeros((len(values), 4, 4))
        local[:, 0, 2], local[:, 1, 0], local[:, 2, 1] = 2 * turn, 4 * turn, 4.0
        local *= self.width
        local[:, 1, 3], local[:, 3, 3] = radii, 1.0
        heads = Mesh(CONE)
        heads.set_instances(poses @ local, colors)
        heads.owner = _Owner(self, efforts, 1)
        for item in (arcs, heads):
            item.pose = base
        group.add(arcs, heads)

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file of either RViz, and the visibility of joints."""
        return super().load_settings(saved) + self.parts.load(saved)

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz, with the joints that are shown."""
        kept = super().save_settings(older, ros)
        self.parts.save(kept)
        return kept
