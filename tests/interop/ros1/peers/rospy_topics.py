"""Requests about topics."""

import base64
import threading

import genpy
import genpy.dynamic
import roslib.message
import rospy


def _message(type, value):
    made = roslib.message.get_message_class(type)()
    genpy.message.fill_message_args(made, [value])
    return made


def do_publish(peer, topic, type, value=None, rate=None, count=1, latch=False, queue=100, **more):
    """Publish `value`, `count` times at `rate` (1/s; forever with count 0); keep the publisher."""
    publisher = peer.kept.get(("publisher", topic))
    if publisher is None:
        kind = roslib.message.get_message_class(type)
        publisher = rospy.Publisher(topic, kind, queue_size=queue, latch=latch, **more)
        peer.kept["publisher", topic] = publisher
    if value is None:
        return
    message = _message(type, _expand(value))

    def send():
        ticker = rospy.Rate(rate) if rate else None
        sent = 0
        while not rospy.is_shutdown() and ("publisher", topic) in peer.kept:
            publisher.publish(message)
            sent += 1
            if sent == count:
                break
            if ticker:
                ticker.sleep()

    if count == 1:
        send()
    else:
        threading.Thread(target=send, daemon=True).start()


def _expand(value):
    """Return `value` with {"repeat": byte, "length": n} as that many bytes."""
    if isinstance(value, dict):
        if set(value) == {"repeat", "length"}:
            return bytes([value["repeat"]]) * value["length"]
        return {key: _expand(item) for key, item in value.items()}
    return value


def do_unpublish(peer, topic):
    """End a publisher."""
    peer.kept.pop(("publisher", topic)).unregister()


def do_connections(peer, topic):
    """Return how many subscribers a publisher has."""
    return peer.kept["publisher", topic].get_num_connections()


def do_subscribe(peer, topic, type="*", reports=True, **more):
    """Subscribe, and report each message: topic, value, raw bytes in base64, connection header.

    Large messages come without raw bytes.
    """
    kind = rospy.AnyMsg if type == "*" else roslib.message.get_message_class(type)
    counts = peer.kept["count", topic] = [0]

    def received(message):
        counts[0] += 1
        if not reports:
            return
        raw = message._buff if type == "*" else None
        peer.report(
            received={
                "topic": topic,
                "value": None if type == "*" else peer.plain(message),
                "raw": base64.b64encode(raw).decode() if raw and len(raw) < 100000 else None,
                "header": {
                    key: text if isinstance(text, str) else text.decode()
                    for key, text in message._connection_header.items()
                },
            }
        )

    peer.kept["subscriber", topic] = rospy.Subscriber(topic, kind, received, **more)


def do_unsubscribe(peer, topic):
    """End a subscription."""
    peer.kept.pop(("subscriber", topic)).unregister()


def do_count(peer, topic):
    """Return how many messages a subscription received."""
    return peer.kept["count", topic][0]


def do_time(peer):
    """Return the node's time in seconds, which follows /clock with use_sim_time."""
    return rospy.get_time()


def do_publish_own(peer, topic, type, text, value, latch=False):
    """Publish `value` in a type that only this node has; return its md5 sum."""
    kind = genpy.dynamic.generate_dynamic(type, text)[type]
    publisher = rospy.Publisher(topic, kind, queue_size=100, latch=latch)
    peer.kept["publisher", topic] = publisher
    made = kind()
    genpy.message.fill_message_args(made, [value])
    publisher.publish(made)
    return kind._md5sum
