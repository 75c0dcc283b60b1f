"""Requests about parameters, the log and the clock."""

import logging

import rospy


def do_get_param(peer, name, cached=False):
    """Return a parameter, and the name of its type."""
    value = rospy.get_param_cached(name) if cached else rospy.get_param(name)
    return [value, type(value).__name__]


def do_set_param(peer, name, value):
    """Set a parameter."""
    rospy.set_param(name, value)


def do_delete_param(peer, name):
    """Delete a parameter."""
    rospy.delete_param(name)


def do_search_param(peer, name):
    """Search a parameter from the node's namespace upwards."""
    return rospy.search_param(name)


def do_log(peer, level, text):
    """Log a text; `level` is debug, info, warn, err or fatal."""
    getattr(rospy, "log" + level)(text)


def do_log_level(peer):
    """Return the least severe level that the node logs."""
    return logging.getLevelName(logging.getLogger("rosout").getEffectiveLevel())


def do_now(peer):
    """Return the node's time."""
    return peer.plain(rospy.Time.now())
