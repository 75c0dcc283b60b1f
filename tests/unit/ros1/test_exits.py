"""Callbacks that call sys.exit() in the node's own threads: they end none of these."""

from __future__ import annotations

import pytest

from rosglass.comm import IMMEDIATE

STRING = "std_msgs/String"


def leave(*_):
    raise SystemExit(3)


@pytest.mark.parametrize("where", ["message", "graph", "status"])
def test_sys_exit_in_an_immediate_callback_ends_nothing_else(
    connect, master, eventually, caplog, where
):
    robot, panel = connect("robot", own_services=False), connect("panel", own_services=False)
    bad, good = (robot.create_publisher(name, STRING) for name in ("/bad", "/good"))
    if where == "message":
        panel.create_subscription("/bad", STRING, leave, executor=IMMEDIATE)
        eventually(bad.subscription_count)
    elif where == "graph":
        panel.on_graph_change(leave, IMMEDIATE)
    else:
        panel.on_status_change(leave, IMMEDIATE)
        master.stop()
        eventually(lambda: "SystemExit" in caplog.text)
        master.start()
    seen = []
    panel.create_subscription("/good", STRING, lambda message: seen.append(message.data))
    eventually(good.subscription_count)
    for number in range(3):
        bad.publish(data="x")
        good.publish(data=f"{number}")
        eventually(lambda number=number: seen[-1:] == [f"{number}"])
    eventually(lambda: "SystemExit" in caplog.text)
    # What the loop and the thread that talks to the master do goes on, too.
    robot.create_publisher("/later", STRING)
    eventually(lambda: "/later" in panel.topics())
