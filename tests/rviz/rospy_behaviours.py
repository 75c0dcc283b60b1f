"""FlexBE's action with rospy and actionlib: one behaviour ends, one keeps running, one fails."""

import actionlib
import rospy
from flexbe_msgs.msg import (
    BehaviorExecutionAction,
    BehaviorExecutionFeedback,
    BehaviorExecutionResult,
)


def execute(goal):
    if goal.behavior_name == "Flippers up":
        server.set_aborted(text="the flippers are jammed")
        return
    while goal.behavior_name == "Turn around":
        server.publish_feedback(BehaviorExecutionFeedback("turning"))
        if server.is_preempt_requested():
            server.set_preempted()
            return
        rospy.sleep(0.05)
    server.set_succeeded(BehaviorExecutionResult("finished"))


rospy.init_node("flexbe")
server = actionlib.SimpleActionServer(
    "/flexbe/execute_behavior", BehaviorExecutionAction, execute, auto_start=False
)
server.start()
rospy.spin()
