"""RViz draws the simulated robot from its own description and frames."""

from __future__ import annotations

from contextlib import closing
from typing import Any
from xml.etree import ElementTree

import rosglass
from rosglass.comm import QoS, Time
from rosglass.demo import telemetry
from rosglass.demo.equipment import Equipment, urdf
from rosglass.demo.simulation import RobotState


def test_its_description_and_frames_are_complete(app: Any, master: str, wait: Any) -> None:
    url = master.replace("http:", "ros1:")
    with closing(rosglass.connect(url, name="robot")) as node:
        node.parameter_server.set("/robot_description", urdf())
        still = node.create_publisher("/tf_static", "tf2_msgs/msg/TFMessage", QoS.latched())
        moving = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage", 10)
        now = Time.now()
        frames = telemetry.static_frames(now)["transforms"] + Equipment.frames(now)
        still.publish(transforms=frames)
        app.fixed_frame = "map"
        links = [link.get("name") for link in ElementTree.fromstring(urdf()).findall("link")]
        assert len(links) > 10
        display = app.rviz.displays.add("rviz/RobotModel", "Robot")

        def drawn() -> bool:
            moving.publish(telemetry.moving_frames(RobotState(), Time.now()))
            lines = display.status.text.splitlines()
            return {"URDF: URDF parsed OK", *(f"{link}: Transform OK" for link in links)} <= {
                *lines
            }

        try:
            wait(drawn)
            assert display.status.level == "ok"
        finally:
            app.rviz.displays.remove(display)
