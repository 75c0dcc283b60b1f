"""The equipment that a full operator station needs: model, cloud, cameras, modes."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from rosglass.comm import QoS, Time
from rosglass.demo import telemetry
from rosglass.demo.cloud import Cloud
from rosglass.demo.model import PARTS, urdf
from rosglass.demo.operation import Operation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import Node
    from rosglass.demo.camera import Camera
    from rosglass.demo.scan import LaserScanner
    from rosglass.demo.simulation import RobotState, Simulation

__all__ = ["CAMERAS", "Equipment"]

CAMERAS = ("rear", "left", "right", "thermal")
_CLOUD_PERIOD_S, _CAMERA_PERIOD_S = 0.5, 0.1
#: Seconds after which an unchanged cloud is sent again.
_CLOUD_REPEAT_S = 1.4
_WIDTH, _HEIGHT = 320, 240


class Equipment:
    """Additional sensors and cameras of the robot; they cost little without subscribers.

    Args:
        node: Node that offers it.
        simulation: The robot.
        camera: Renders pictures of its world.
        scanner: Its laser.
        drive: Takes metres and radians per second.
        flippers: Takes four angles.
        mode: The initial mode.
    """

    def __init__(
        self,
        node: Node,
        simulation: Simulation,
        camera: Camera,
        scanner: LaserScanner,
        drive: Callable[[float, float], None],
        flippers: Callable[[Sequence[float]], None],
        mode: str,
    ) -> None:
        self._node, self._simulation, self._camera = node, simulation, camera
        self._scanner, self._cloud = scanner, Cloud(simulation.world)
        dock = simulation.world.dock
        self.operation = Operation(node, lambda: simulation.state, drive, flippers, dock, mode)
        sensor = QoS.sensor_data()
        self._points = node.create_publisher("/points", "sensor_msgs/msg/PointCloud2", sensor)
        self._pictures = {
            name: node.create_publisher(
                f"/{name}_camera/image_raw", "sensor_msgs/msg/Image", sensor
            )
            for name in CAMERAS
        }

    def describe(self) -> None:
        """Publish the robot's model: in ROS 1 a parameter, in ROS 2 a topic."""
        if self._node.wire == "ros1":
            server: Any = self._node
            server.parameter_server.set("/robot_description", urdf())
        else:
            topic = "/robot_description"
            self._node.create_publisher(topic, "std_msgs/msg/String", QoS.latched()).publish(
                data=urdf()
            )

    @staticmethod
    def frames(stamp: Time) -> list[dict[str, Any]]:
        """Return the poses of its parts, for ``/tf_static``."""
        return [telemetry.part(stamp, name, place, turn) for name, place, turn in PARTS]

    def scan(self, ending: Callable[[float], bool]) -> None:
        """Publish the cloud until `ending`, which waits some seconds, returns true."""
        sent, changed = -math.inf, False
        while not ending(_CLOUD_PERIOD_S):
            state, now = self._simulation.state, time.monotonic()
            if abs(state.pitch) + abs(state.roll) < 0.3:
                ranges = self._scanner.scan(state.x, state.y, state.yaw, state.carrier_phase)
                changed |= self._cloud.look(state, ranges)
            # Displays rebuild it for each message.
            due = changed or now - sent >= _CLOUD_REPEAT_S
            if due and self._points.subscription_count():
                self._points.publish(self._cloud.message(Time.now()))
                sent, changed = now, False

    def film(self, ending: Callable[[float], bool]) -> None:
        """Publish the subscribed images until `ending` returns true."""
        while not ending(_CAMERA_PERIOD_S):
            for name, publisher in self._pictures.items():
                if publisher.subscription_count():
                    picture = self._picture(name)
                    publisher.publish(
                        header=telemetry.header(Time.now(), f"{name}_camera_link"),
                        height=_HEIGHT,
                        width=_WIDTH,
                        encoding="rgb8",
                        is_bigendian=0,
                        step=3 * _WIDTH,
                        data=picture.reshape(-1),
                    )

    def _picture(self, name: str) -> Any:
        state = self._simulation.state
        turn = {"rear": math.pi, "left": math.pi / 2, "right": -math.pi / 2}.get(name, 0.0)
        whole = self._camera.render(_turned(state, turn), body=name in ("rear", "thermal"))
        small = cv2.resize(whole, (_WIDTH, _HEIGHT), interpolation=cv2.INTER_AREA)
        if name == "thermal":
            red, _, blue = (small[..., k].astype(np.int16) for k in range(3))
            heat = np.clip(blue // 4 + 2 * np.maximum(red - blue, 0), 0, 255).astype(np.uint8)
            small = cv2.cvtColor(cv2.applyColorMap(heat, cv2.COLORMAP_INFERNO), cv2.COLOR_BGR2RGB)
        clock = time.strftime("%H:%M:%S")
        cv2.putText(small, clock, (6, _HEIGHT - 7), 0, 0.38, (235, 235, 235), 1, cv2.LINE_AA)
        return small


def _turned(state: RobotState, turn: float) -> RobotState:
    """Return a state whose camera looks in the direction of another camera, turned by an angle."""
    c, s = math.cos(turn), math.sin(turn)
    front_left, front_right, rear_left, rear_right = state.flippers
    return replace(
        state,
        yaw=state.yaw + turn,
        roll=c * state.roll + s * state.pitch,
        pitch=c * state.pitch - s * state.roll,
        flippers=(rear_right, rear_left, front_right, front_left) if c < 0 else state.flippers,
        flashlight=state.flashlight and turn == 0.0,
    )
