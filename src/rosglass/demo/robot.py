"""The simulated robot as a node: its threads, topics and services, and the commands it accepts.

Three threads, so that none waits for another: the body moves at 100 Hz and never sends anything;
the reporter sends the small topics; the camera renders and sends images. Commands arrive on the
node's own thread and take effect with the body's next step.
"""

from __future__ import annotations

import logging
import math
import random
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.comm import ParameterDescriptor, QoS, Range, Time
from rosglass.comm.handle import guarded
from rosglass.demo import telemetry
from rosglass.demo.simulation import CommandRejectedError, Simulation
from rosglass.demo.world import LaserScanner, occupancy
from rosglass.errors import Error, NodeClosedError, TypeNotFoundError, UnsupportedError
from rosglass.images.encodings import opencv

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import Node, ParameterEvent, Publisher, ServerGoal
    from rosglass.demo.equipment import Equipment
    from rosglass.demo.simulation import RobotState
    from rosglass.messages import Message

__all__ = ["ReleaseCounter", "Robot", "RobotOptions", "Services"]

_log = logging.getLogger("rosglass.demo.robot")
_MOVE_PERIOD_S, _REPORT_PERIOD_S, _TURN_PERIOD_S = 0.01, 1 / 30, 0.1
#: Topic -> one message in so many reports.
_REPORTS_PER_MESSAGE = {"scan": 3, "joints": 2, "confirm": 5, "battery": 15, "diagnostics": 15}
#: Metres per cell of the map.
_MAP_RESOLUTION = 0.05
#: Seconds between two log messages about refused commands.
_LOG_PERIOD_S = 2.0
_SPEED_PARAMETER = "max_speed"
#: Limits of that parameter in metres per second.
_MIN_SPEED, _MAX_SPEED = 0.1, 1.2
#: Seconds after which a release of the emergency stop is too late.
_RELEASE_TIMEOUT_S = 2.0
#: Rate of a turn in radians per second, and its tolerance in radians.
_TURN_RATE, _TURN_TOLERANCE = 0.8, 0.03


@dataclass(frozen=True)
class RobotOptions:
    """The options of a robot.

    Attributes:
        fps: Images per second, more than 0 and at most 120.
        raw: Whether to send ``/camera/image_raw``.
        compressed: Whether to send ``/camera/image_raw/compressed`` (while it has subscribers).
        jpeg_quality: 1 to 100.
        equipped: Whether it has :class:`~rosglass.demo.equipment.Equipment` as well.
        mode: The initial one of :data:`~rosglass.demo.operation.MODES`, if it is equipped.
    """

    fps: float = 30.0
    raw: bool = True
    compressed: bool = True
    jpeg_quality: int = 80
    equipped: bool = False
    mode: str = "supervised"

    def __post_init__(self) -> None:
        if not 0 < self.fps <= 120:
            raise Error(f"--fps {self.fps}: expected more than 0 and at most 120")
        if not 1 <= self.jpeg_quality <= 100:
            raise Error(f"--jpeg-quality {self.jpeg_quality}: expected 1 to 100")


class Robot:
    """A simulated robot on a node.

    Args:
        node: Its node; the caller closes it after the robot.
        options: Its options.
        logged_at: When it logged a refused command last, by :func:`time.monotonic`.
        simulation: Its body; a new one in the standard world by default.

    Attributes:
        options: Its options.
        logged_at: When it logged a refused command last, by :func:`time.monotonic`.
        services: Its service and action, and its highest speed, a parameter.

    Raises:
        ModuleNotFoundError: OpenCV is not installed.
    """

    def __init__(
        self,
        node: Node,
        options: RobotOptions | None = None,
        simulation: Simulation | None = None,
    ) -> None:
        from rosglass.demo.camera import Camera  # noqa: PLC0415 - needs OpenCV and paints a while

        self.options = options if options is not None else RobotOptions()
        self._simulation = simulation if simulation is not None else Simulation()
        self._camera = Camera(self._simulation.world)
        self._scanner = LaserScanner(self._simulation.world)
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._threads: list[threading.Thread] = []
        self._rejected, self.logged_at = 0, -_LOG_PERIOD_S
        self._frame_period, self._render_time = 0.0, 0.0
        self._releases = ReleaseCounter()
        self._send = _publishers(node, self.options)
        self._subscriptions = [
            node.create_subscription(topic, kind, self._counting_refusals(topic, handler), qos)
            for topic, kind, handler, qos in (
                # Only the newest command counts: an old one must not be driven after it.
                ("/cmd_vel", "geometry_msgs/msg/Twist", self._on_velocity, 1),
                ("/emergency_stop", "std_msgs/msg/Bool", self._on_stop, 10),
                ("/emergency_stop/release", "std_msgs/msg/UInt32", self._on_release, 1),
                ("/flashlight", "std_msgs/msg/Bool", self._on_flashlight, 10),
                (
                    "/flipper_controller/commands",
                    "std_msgs/msg/Float64MultiArray",
                    self._on_flippers,
                    1,
                ),
            )
        ]
        self.services = Services(node, lambda: self.state, self._switch, self._drive)
        self._equipment: Equipment | None = None
        if self.options.equipped:
            self._equipment = self._equip(node)

    @property
    def state(self) -> RobotState:
        """The robot's current state."""
        return self._simulation.state

    def start(self) -> None:
        """Start the threads."""
        now = Time.now()
        cells = occupancy(self._simulation.world, _MAP_RESOLUTION)
        frames, work = (
            telemetry.static_frames(now),
            [
                ("body", self._move),
                ("reporter", self._report),
                ("camera", self._film),
            ],
        )
        if (more := self._equipment) is not None:
            more.describe()
            frames["transforms"] += more.frames(now)
            work += [
                ("operation", more.operation.work),
                ("cloud", lambda: more.scan(self._ending.wait)),
                ("cameras", lambda: more.film(self._ending.wait)),
            ]
        self._send["/tf_static"].publish(frames)
        self._send["/map"].publish(telemetry.occupancy_grid(cells, _MAP_RESOLUTION, now))
        for name, job in work:
            thread = threading.Thread(
                target=self._stopping_after(job), name=f"robot {name}", daemon=True
            )
            self._threads.append(thread)
            thread.start()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until :meth:`close` is called or a thread fails; True when the robot has ended."""
        return self._ending.wait(timeout)

    def close(self) -> None:
        """Stop moving and end the threads; safe to call twice, from any thread but the robot's."""
        self._ending.set()
        self.services.close()
        if self._equipment is not None:
            self._equipment.operation.close()
        for subscription in self._subscriptions:
            subscription.close()
        for thread in self._threads:
            thread.join(2.0)

    def _stopping_after(self, work: Callable[[], None]) -> Callable[[], None]:
        """Return a thread's function: `work`, and the end of the robot, however it ends."""

        def run() -> None:
            try:
                # The node may be closed first.
                with guarded(_log, "the robot failed"), suppress(NodeClosedError):
                    work()
            finally:  # a robot that cannot see or report stops driving
                self._ending.set()

        return run

    def _counting_refusals(
        self, topic: str, handler: Callable[[Message], None]
    ) -> Callable[[Message], None]:
        def run(message: Message) -> None:
            try:
                handler(message)
            except Error as error:
                self._on_refused(topic, error)

        return run

    def _on_refused(self, topic: str, error: Error) -> None:
        self._rejected += 1
        now = time.monotonic()
        if now - self.logged_at >= _LOG_PERIOD_S:
            self.logged_at = now
            _log.warning("%s: %s (%d refused so far)", topic, error, self._rejected)

    def _on_velocity(self, message: Message) -> None:
        speed, turn = message.linear.x, message.angular.z
        for value in (message.linear.y, message.linear.z, message.angular.x, message.angular.y):
            # Also true for NaN. Tracks cannot do this: refuse it instead of obeying half of it.
            if not abs(value) < 1e-6:
                raise CommandRejectedError(
                    f"a motion only along linear.x and angular.z expected, "
                    f"got another component {value}"
                )
        if self._equipment is not None:
            self._equipment.operation.take_over()
        self._drive(speed, turn)

    def _equip(self, node: Node) -> Equipment:
        from rosglass.demo.equipment import Equipment  # noqa: PLC0415 - needs OpenCV

        return Equipment(
            node,
            self._simulation,
            self._camera,
            LaserScanner(self._simulation.world),
            self._drive,
            self._command_flippers,
            self.options.mode,
        )

    def _command_flippers(self, angles: Sequence[float]) -> None:
        with self._lock:
            self._simulation.command_flippers(angles)

    def _drive(self, speed: float, turn: float) -> None:
        fastest = self.services.max_speed
        if self._equipment is not None:
            fastest = min(fastest, self._equipment.operation.max_speed)
        if math.isfinite(speed) and abs(speed) <= self._simulation.limits.believable:
            speed = max(-fastest, min(fastest, speed))
        with self._lock:
            self._simulation.command_velocity(speed, turn)

    def _on_stop(self, message: Message) -> None:
        if not message.data:
            raise CommandRejectedError(
                "only true is accepted here; to release the stop, send the last number of "
                "/emergency_stop/counter to /emergency_stop/release"
            )
        with self._lock:
            # Also while it is latched: releases of the stops before must not undo this one.
            self._releases.invalidate()
            changed = not self.state.emergency_stop
            self._simulation.set_emergency_stop(True)
        if changed:
            _log.info("emergency stop latched")
        self._confirm()

    def _on_release(self, message: Message) -> None:
        with self._lock:
            if not self.state.emergency_stop:
                return  # cockpits repeat it until they receive the state
            self._releases.check(message.data)
            self._simulation.set_emergency_stop(False)
        _log.info("emergency stop released")
        self._confirm()

    def _on_flashlight(self, message: Message) -> None:
        self._switch(message.data)

    def _switch(self, on: bool) -> None:
        with self._lock:
            self._simulation.set_flashlight(on)
        self._send["/flashlight/state"].publish(data=self.state.flashlight)

    def _on_flippers(self, message: Message) -> None:
        self._command_flippers([float(angle) for angle in message.data])

    def _confirm(self) -> None:
        with self._lock:
            stopped, number = self.state.emergency_stop, self._releases.count()
        # First: who receives the state knows a number that is valid for it.
        self._send["/emergency_stop/counter"].publish(data=number)
        self._send["/emergency_stop/state"].publish(data=stopped)

    def _move(self) -> None:
        last = time.monotonic()
        while not self._ending.wait(_MOVE_PERIOD_S):
            now = time.monotonic()
            with self._lock:
                self._simulation.advance(now - last)
            last = now

    def _report(self) -> None:
        rate = _Rate(_REPORT_PERIOD_S)
        send, count = self._send, 0
        while not self._ending.wait(rate.remaining()):
            state, now = self.state, Time.now()
            send["/odom"].publish(telemetry.odometry(state, now))
            send["/tf"].publish(telemetry.moving_frames(state, now))
            send["/imu"].publish(telemetry.imu(state, now))
            if count % _REPORTS_PER_MESSAGE["joints"] == 0:
                send["/joint_states"].publish(telemetry.joints(state, now))
            if count % _REPORTS_PER_MESSAGE["scan"] == 0:
                ranges = self._scanner.scan(state.x, state.y, state.yaw, state.carrier_phase)
                send["/scan"].publish(telemetry.scan(ranges, now))
            if count % _REPORTS_PER_MESSAGE["confirm"] == 1:
                self._confirm()
                send["/flashlight/state"].publish(data=state.flashlight)
            if count % _REPORTS_PER_MESSAGE["battery"] == 2:
                send["/battery_state"].publish(telemetry.battery(state, now))
            if count % _REPORTS_PER_MESSAGE["diagnostics"] == 7:
                send["/diagnostics"].publish(
                    telemetry.diagnostics(
                        state,
                        now,
                        frames_per_second=1 / self._frame_period if self._frame_period else 0.0,
                        render_time=self._render_time,
                        rejected=self._rejected,
                    )
                )
            count += 1

    def _film(self) -> None:
        # Two cores must be enough for the robot, the cockpit and the middleware between them.
        opencv().setNumThreads(1)
        rate = _Rate(1 / self.options.fps)
        number, since = 0, time.monotonic()
        while not self._ending.wait(rate.remaining()):
            begin = time.perf_counter()
            picture = self._camera.render(self.state)
            stamp = Time.now()
            self._camera.stamp(picture, stamp.nanoseconds, number)
            self._render_time += 0.1 * (time.perf_counter() - begin - self._render_time)
            self._send_picture(picture, stamp)
            number += 1
            now = time.monotonic()
            period = now - since
            self._frame_period += (0.1 if number > 1 else 1.0) * (period - self._frame_period)
            since = now

    def _send_picture(self, picture: Any, stamp: Time) -> None:
        height, width = picture.shape[:2]
        header = telemetry.header(stamp, "camera_optical_frame")
        raw = self._send.get("/camera/image_raw")
        if raw is not None:
            raw.publish(
                header=header,
                height=height,
                width=width,
                encoding="rgb8",
                is_bigendian=0,
                step=3 * width,
                data=picture.reshape(-1),
            )
        info = self._send["/camera/camera_info"]
        info.publish(telemetry.camera_info(stamp, info.type.ros))
        compressed = self._send.get("/camera/image_raw/compressed")
        if compressed is not None and compressed.subscription_count():
            cv2 = opencv()
            _, data = cv2.imencode(
                ".jpg",
                cv2.cvtColor(picture, cv2.COLOR_RGB2BGR),
                [cv2.IMWRITE_JPEG_QUALITY, self.options.jpeg_quality],
            )
            compressed.publish(header=header, format="rgb8; jpeg compressed bgr8", data=data)


class ReleaseCounter:
    """The numbers that a release of the emergency stop has to name.

    A release may lie in a network for a long time, while another operator presses stop. So the
    robot publishes a new number several times a second, and a release names the last one that the
    operator's machine had received when it was requested. It is refused if stop was pressed after
    that number was published, or if that is too long ago by the robot's own clock. No clocks of two
    machines are compared.
    """

    def __init__(self) -> None:
        # A release of the time before a restart must not name a new number by accident.
        self._number = random.SystemRandom().getrandbits(32)
        #: The numbers that are valid, each with the time when it was counted, monotonic.
        self._valid: deque[tuple[int, float]] = deque()

    def count(self) -> int:
        """Return the next number, to be published now."""
        now = time.monotonic()
        self._number = (self._number + 1) % 2**32
        self._valid.append((self._number, now))
        self._expire(now)
        return self._number

    def invalidate(self) -> None:
        """Refuse all numbers counted until now: stop was pressed."""
        self._valid.clear()

    def check(self, number: int) -> None:
        """Check the number that a release names.

        Raises:
            CommandRejectedError: It is too old, or no number of this robot.
        """
        self._expire(time.monotonic())
        if all(number != valid for valid, _ in self._valid):
            raise CommandRejectedError(
                f"a release has to name a number of /emergency_stop/counter that was published "
                f"after the last stop and in the last {_RELEASE_TIMEOUT_S:.0f} s; {number} was not"
            )

    def _expire(self, now: float) -> None:
        while self._valid and now - self._valid[0][1] > _RELEASE_TIMEOUT_S:
            self._valid.popleft()


class Services:
    """The robot's service ``/flashlight/set``, action ``/turn`` and parameter ``max_speed``.

    Args:
        node: Node that offers them.
        state: Returns the robot's current state.
        switch: Switches its flashlight.
        drive: Takes metres and radians per second.
    """

    def __init__(
        self,
        node: Node,
        state: Callable[[], RobotState],
        switch: Callable[[bool], None],
        drive: Callable[[float, float], None],
    ) -> None:
        self._state, self._switch, self._drive = state, switch, drive
        self._ending = threading.Event()
        what, limits = "Highest speed in metres per second", Range(_MIN_SPEED, _MAX_SPEED)
        try:
            speed = node.parameters.declare(
                _SPEED_PARAMETER, _MAX_SPEED, ParameterDescriptor(description=what, range=limits)
            )
        except UnsupportedError:
            # ROS 1 has no ranges.
            speed = node.parameters.declare(
                _SPEED_PARAMETER, _MAX_SPEED, ParameterDescriptor(description=what)
            )
        # Cached: ROS 1 reads it from the master, without which the robot must still drive.
        self._max_speed = speed
        self._parts: list[Any] = [
            node.parameters.on_change(self._on_parameters),
            node.create_service_server("/flashlight/set", "std_srvs/srv/SetBool", self._on_switch),
        ]
        try:
            kind = "turtlesim/action/RotateAbsolute"
            self._parts.append(node.create_action_server("/turn", kind, self._turn))
        except TypeNotFoundError:
            _log.info("/turn is not offered: ROS 1 has no turtlesim/RotateAbsolute")

    @property
    def max_speed(self) -> float:
        """Highest speed in metres per second; the slowest while its value is invalid."""
        value = self._max_speed
        if isinstance(value, (int, float)) and _MIN_SPEED <= value <= _MAX_SPEED:
            return float(value)
        return _MIN_SPEED

    def close(self) -> None:
        """Withdraw them; safe to call twice."""
        self._ending.set()
        for part in self._parts:
            part.close()

    def _on_parameters(self, event: ParameterEvent) -> None:
        self._max_speed = {**event.new, **event.changed}.get(_SPEED_PARAMETER, self._max_speed)
        if _SPEED_PARAMETER in event.deleted:
            self._max_speed = None

    def _on_switch(self, request: Message) -> dict[str, Any]:
        self._switch(request.data)
        on = self._state().flashlight
        return {"success": on == request.data, "message": "on" if on else "off"}

    def _turn(self, goal: ServerGoal) -> dict[str, float]:
        """Turn on the spot to a heading; ends where it is if cancelled or stopped."""
        wanted, start = float(goal.goal.theta), self._state().yaw
        if not math.isfinite(wanted):
            raise Error(f"the heading {wanted} is not an angle")
        while not self._ending.wait(_TURN_PERIOD_S):
            state = self._state()
            remaining = math.remainder(wanted - state.yaw, math.tau)
            goal.publish_feedback({"remaining": remaining})
            done = (
                abs(remaining) < _TURN_TOLERANCE or goal.is_cancel_requested or state.emergency_stop
            )
            self._drive(0.0, 0.0 if done else max(-_TURN_RATE, min(_TURN_RATE, 2 * remaining)))
            if state.emergency_stop:
                raise Error("the emergency stop is latched; release it first")
            if done:
                return {"delta": math.remainder(state.yaw - start, math.tau)}
        raise Error("the robot ends")


class _Rate:
    """Keeps a rate; missed periods are skipped, not made up for."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._next = time.monotonic()

    def remaining(self) -> float:
        """Return the seconds until the next period."""
        self._next += self._period
        left = self._next - time.monotonic()
        if left < -self._period:
            self._next -= left
        return max(0.0, left)


def _publishers(node: Node, options: RobotOptions) -> dict[str, Publisher]:
    sensor, latched = QoS.sensor_data(), QoS.latched()
    topics: list[tuple[str, str, QoS | int]] = [
        ("/odom", "nav_msgs/msg/Odometry", 10),
        ("/tf", "tf2_msgs/msg/TFMessage", 100),
        ("/tf_static", "tf2_msgs/msg/TFMessage", latched),
        ("/imu", "sensor_msgs/msg/Imu", sensor),
        ("/scan", "sensor_msgs/msg/LaserScan", sensor),
        ("/joint_states", "sensor_msgs/msg/JointState", 10),
        ("/battery_state", "sensor_msgs/msg/BatteryState", 10),
        ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 10),
        ("/map", "nav_msgs/msg/OccupancyGrid", latched),
        ("/emergency_stop/state", "std_msgs/msg/Bool", latched),
        ("/emergency_stop/counter", "std_msgs/msg/UInt32", 1),
        ("/flashlight/state", "std_msgs/msg/Bool", latched),
        ("/camera/camera_info", "sensor_msgs/msg/CameraInfo", sensor),
    ]
    if options.raw:
        topics.append(("/camera/image_raw", "sensor_msgs/msg/Image", sensor))
    if options.compressed:
        topics.append(("/camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage", sensor))
    return {topic: node.create_publisher(topic, kind, qos) for topic, kind, qos in topics}
