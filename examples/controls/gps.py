"""A robot with a satellite receiver that drives in circles, to try GeoMap: ``gps.py [URL]``."""

import math
import sys
import time

import rosglass

node = rosglass.connect(sys.argv[1] if len(sys.argv) > 1 else None, "gps")
publisher = node.create_publisher("/fix", "sensor_msgs/msg/NavSatFix")
while True:
    angle = time.monotonic() / 3
    publisher.publish(
        header={"frame_id": "gps"},
        status={"status": 0},
        latitude=47.3769 + 0.0004 * math.sin(angle),
        longitude=8.5417 + 0.0006 * math.cos(angle),
        altitude=408.0,
        position_covariance=[4.0, 0, 0, 0, 4.0, 0, 0, 0, 9.0],
        position_covariance_type=2,
    )
    time.sleep(0.1)
