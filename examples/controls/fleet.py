"""Robots with namespaces, to try RobotTiles: ``fleet.py [URL] [COUNT]``."""

import colorsys
import io
import sys
import time

from PIL import Image, ImageDraw

import rosglass

NAMES = ("anna", "bert", "carl", "dora", "emil", "fred")


class Robot:
    """A robot that sends a camera's images, its battery, its mode and diagnostics."""

    def __init__(self, url: str | None, number: int) -> None:
        name = NAMES[number] if number < len(NAMES) else f"robot{number:02}"
        self.number = number
        self.node = rosglass.connect(url, "base", namespace=f"/{name}")
        create = self.node.create_publisher
        self.camera = create("camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage")
        self.battery = create("battery_state", "sensor_msgs/msg/BatteryState")
        self.mode = create("mode/state", "std_msgs/msg/String")
        self.alarms = create("diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        self.commands = self.node.create_subscription("cmd_vel", "geometry_msgs/msg/Twist", print)

    def send(self, tick: int) -> None:
        """Send an image, and the rest once a second."""
        self.camera.publish(format="jpeg", data=self.image(tick), header=self.header())
        if tick % 10 == 0:
            level = (0, 0, 1, 0, 2)[self.number % 5]
            status = {"name": "motor", "level": level, "message": "warm"}
            self.alarms.publish(header=self.header(), status=[status])
            self.battery.publish(header=self.header(), percentage=0.95 - 0.17 * (self.number % 6))
            self.mode.publish(data=("autonomous", "manual", "charging")[self.number % 3])

    def header(self) -> dict[str, object]:
        """Return a header with the time of now."""
        now = time.time_ns()
        return {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}}

    def image(self, tick: int) -> bytes:
        """Return a JPEG of a dot that moves."""
        hue = self.number / 7
        colors = [
            tuple(round(255 * part) for part in colorsys.hsv_to_rgb(hue, 0.5, value))
            for value in (0.25, 0.9)
        ]
        image = Image.new("RGB", (320, 180), colors[0])
        left = 10 + 4 * tick % 280
        ImageDraw.Draw(image).ellipse((left, 70, left + 40, 110), fill=colors[1])
        buffer = io.BytesIO()
        image.save(buffer, "jpeg")
        return buffer.getvalue()


def main() -> None:
    """Run the robots."""
    url = sys.argv[1] if len(sys.argv) > 1 else None
    robots = [Robot(url, number) for number in range(int(sys.argv[2]) if len(sys.argv) > 2 else 6)]
    tick = 0
    while True:
        for robot in robots:
            robot.send(tick)
        tick += 1
        time.sleep(0.1)


main()
