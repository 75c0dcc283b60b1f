"""Requests about transforms, with Debian's tf2_ros."""

import genpy
import rospy
from tf2_msgs.msg import TFMessage


def _message(value):
    from geometry_msgs.msg import TransformStamped

    made = TransformStamped()
    genpy.message.fill_message_args(made, [value])
    return made


class _OldMessage(TFMessage):
    """tf's own message: the same definition and sum under another name."""

    _type = "tf/tfMessage"
    __slots__ = TFMessage.__slots__


def do_tf_send(peer, transforms, static=False, old_on=None):
    """Send transforms through a tf2_ros broadcaster, or as tf's old message on a topic."""
    import tf2_ros

    messages = [_message(value) for value in transforms]
    if old_on:
        publisher = peer.kept.get(("tf", old_on))
        if publisher is None:
            publisher = rospy.Publisher(old_on, _OldMessage, queue_size=10, latch=True)
            peer.kept["tf", old_on] = publisher
        publisher.publish(_OldMessage(messages))
        return
    kind = tf2_ros.StaticTransformBroadcaster if static else tf2_ros.TransformBroadcaster
    broadcaster = peer.kept.get(("tf", static))
    if broadcaster is None:
        broadcaster = peer.kept["tf", static] = kind()
    broadcaster.sendTransform(messages)


def do_tf_lookup(peer, target, source, timeout=30.0):
    """Return where a frame is, as a tf2_ros listener has it."""
    import tf2_ros

    buffer = peer.kept.get("tf buffer")
    if buffer is None:
        buffer = peer.kept["tf buffer"] = tf2_ros.Buffer()
        peer.kept["tf listener"] = tf2_ros.TransformListener(buffer)
    found = buffer.lookup_transform(target, source, rospy.Time(0), rospy.Duration(timeout))
    return peer.plain(found)
