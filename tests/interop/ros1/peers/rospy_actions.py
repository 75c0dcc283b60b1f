"""Requests about actions of the type actionlib/Test.

A goal of n above 0 sends 0 to n - 1 as feedback, one each 20 ms, and succeeds with n as its result.
0 is rejected, -1 aborts, -2 stays pending; one that is cancelled ends with what it has done.
"""

import contextlib
import threading

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from actionlib_msgs.msg import GoalStatus


class _Server:
    def __init__(self, name):
        self.stopped = {}
        self.server = actionlib.ActionServer(name, TestAction, self.begin, self.cancel, False)
        self.server.start()

    def begin(self, handle):
        stop = self.stopped[handle.get_goal_id().id] = threading.Event()
        threading.Thread(target=self.work, args=(handle, stop), daemon=True).start()

    def cancel(self, handle):
        self.stopped[handle.get_goal_id().id].set()

    def work(self, handle, stop):
        with contextlib.suppress(rospy.ROSException):  # the server was withdrawn before it ended
            self.execute(handle, stop)

    def execute(self, handle, stop):
        wanted = handle.get_goal().goal
        if wanted == 0:
            handle.set_rejected(TestResult(-1), "not zero")
            return
        if wanted == -2:
            stop.wait()
            handle.set_canceled(TestResult(-1), "recalled")
            return
        handle.set_accepted("begun")
        if wanted == -1:
            handle.set_aborted(TestResult(-1), "unlucky")
            return
        for done in range(wanted):
            handle.publish_feedback(TestFeedback(done))
            if stop.wait(0.02):
                handle.set_canceled(TestResult(done), "stopped")
                return
        handle.set_succeeded(TestResult(wanted), "finished")


def do_action_server(peer, name):
    """Offer an action that executes any number of goals at once."""
    peer.kept["action server", name] = _Server(name)


def do_simple_action_server(peer, name):
    """Offer an action that executes one goal at a time."""

    def execute(goal):
        for done in range(goal.goal):
            server.publish_feedback(TestFeedback(done))
            rospy.sleep(0.02)
            if server.is_preempt_requested():
                server.set_preempted(TestResult(done), "stopped")
                return
        server.set_succeeded(TestResult(goal.goal), "finished")

    server = actionlib.SimpleActionServer(name, TestAction, execute, False)
    server.start()
    peer.kept["action server", name] = server


def do_stop_action_server(peer, name):
    """Withdraw an action."""
    peer.kept.pop(("action server", name)).server.stop()


def do_wait_for_client(peer, name):
    """Wait until feedback and results have a subscriber; before, rospy drops published messages."""
    server = peer.kept["action server", name].server
    for publisher in (server.feedback_pub, server.result_pub):
        while not publisher.get_num_connections():
            rospy.sleep(0.01)


def _client(peer, name):
    client = peer.kept.get(("action client", name))
    if client is None:
        client = peer.kept["action client", name] = actionlib.ActionClient(name, TestAction)
    return client


def do_wait_for_server(peer, name, timeout=30.0):
    """Return whether a server appears within the time."""
    return _client(peer, name).wait_for_server(rospy.Duration(timeout))


def do_send_goal(peer, name, goal, key):
    """Send a goal, and report its states (`state KEY`) and feedback (`feedback KEY`)."""

    def changed(handle):
        state = handle.get_comm_state()
        report = {"state": actionlib.CommState.to_string(state)}
        if state == actionlib.CommState.DONE:
            result = handle.get_result()
            report["terminal"] = GoalStatus.to_string(handle.get_terminal_state())
            report["text"] = handle.get_goal_status_text()
            report["result"] = None if result is None else result.result
        peer.report(**{f"state {key}": report})

    def fed(handle, feedback):
        peer.report(**{f"feedback {key}": feedback.feedback})

    client = _client(peer, name)
    peer.kept["goal", key] = client.send_goal(TestGoal(goal), changed, fed)


def do_cancel_goal(peer, key):
    """Cancel a goal."""
    peer.kept["goal", key].cancel()


def do_cancel_all(peer, name):
    """Cancel all goals."""
    _client(peer, name).cancel_all_goals()


def do_cancel_before(peer, name, key):
    """Cancel all goals that are not newer than one of them."""
    machine = peer.kept["goal", key].comm_state_machine
    _client(peer, name).cancel_goals_at_and_before_time(machine.action_goal.goal_id.stamp)


def do_simple_goal(peer, name, goal, cancel_after=None):
    """Send a goal as a SimpleActionClient and wait for its end; return how it ended."""
    client = actionlib.SimpleActionClient(name, TestAction)
    if not client.wait_for_server(rospy.Duration(30)):
        raise RuntimeError("no server")
    client.send_goal(TestGoal(goal))
    if cancel_after is not None:
        rospy.sleep(cancel_after)
        client.cancel_goal()
    if not client.wait_for_result(rospy.Duration(30)):
        raise RuntimeError("no result")
    ended = {
        "terminal": GoalStatus.to_string(client.get_state()),
        "text": client.get_goal_status_text(),
        "result": client.get_result().result,
    }
    client.stop_tracking_goal()
    return ended
