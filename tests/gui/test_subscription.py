"""The element Subscription."""

from __future__ import annotations


def test_message(running, wait):
    pub = running.robot.create_publisher("/chat", "std_msgs/msg/String")
    root = running.load("""QtObject {
        property string text: sub.message ? sub.message.data : "none"
        property list<string> log
        property QtObject sub: Subscription { id: sub; topic: "chat"; onNewMessage: (m) => root.log.push(m.data) }
        id: root
    }""")
    assert root.property("text") == "none"
    sub = root.property("sub")
    wait(lambda: sub.property("subscribed"))
    pub.publish(data="hello")
    wait(lambda: root.property("text") == "hello")
    print(
        sub.property("messageType"),
        root.property("log"),
        sub.property("stale"),
        sub.property("problem"),
    )
    wait(300)
    print(sub.property("age"), sub.property("frequency"))
