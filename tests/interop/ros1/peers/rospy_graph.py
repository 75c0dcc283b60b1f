"""Requests that are about who talks to whom, and under which names."""

import rospy


def do_relay(peer, source, target):
    """Pass on whatever comes, as a publisher of any type: type and md5 sum are ``*``."""
    publisher = rospy.Publisher(target, rospy.AnyMsg, queue_size=10)
    peer.kept["relay", target] = rospy.Subscriber(source, rospy.AnyMsg, publisher.publish)


def do_names(peer):
    """Return the node's name, and what some names resolve to."""
    return [rospy.get_name(), *map(rospy.resolve_name, ["chatter", "/chatter", "~chatter"])]


def do_private(peer, name):
    """Return the value of a private parameter."""
    return rospy.get_param(f"~{name}")
