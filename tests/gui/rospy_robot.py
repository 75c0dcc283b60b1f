"""Run by Debian's own Python: a robot of rospy, with camera, wheels and flashlight.

Prints a JSON object for each message and request that it receives.
"""

import json
import sys

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image
from std_srvs.srv import SetBool, SetBoolResponse

WIDTH, HEIGHT = 320, 240
ORANGE = bytes((230, 120, 20))


def report(**what):
    print(json.dumps(what), flush=True)


def switch(request):
    report(lamp=request.data)
    return SetBoolResponse(True, "done")


def main():
    rospy.init_node("robot", disable_signals=True)
    topic = "/camera360/pinhole_front/image_rect_color"
    camera = rospy.Publisher(topic, Image, queue_size=1)
    rospy.Subscriber("/cmd_vel", Twist, lambda m: report(speed=m.linear.x, turn=m.angular.z))
    rospy.Service("/flashlight", SetBool, switch)
    report(ready=True)
    picture = Image(width=WIDTH, height=HEIGHT, encoding="rgb8", step=3 * WIDTH)
    picture.data = ORANGE * (WIDTH * HEIGHT)
    rate = rospy.Rate(15)
    while not rospy.is_shutdown():
        picture.header.stamp = rospy.Time.now()
        camera.publish(picture)
        rate.sleep()


sys.exit(main())
