"""Requests about services."""

import threading
import time

import genpy
import roslib.message
import rospy


def do_serve(peer, service, type, returns=None, fails="", delay=0.0):
    """Offer a service that answers `returns`; each request is reported as `served`."""

    def answer(request):
        content = peer.plain(request) if len(repr(request)) < 1000 else None
        peer.report(served={"service": service, "request": content})
        time.sleep(delay)
        if fails == "exception":
            raise ValueError("the arm is stuck")
        if fails == "refusal":
            raise rospy.ServiceException("not homed")
        if fails == "none":
            return None
        made = kind._response_class()
        genpy.message.fill_message_args(made, [returns or {}])
        return made

    kind = roslib.message.get_service_class(type)
    peer.kept["service", service] = rospy.Service(service, kind, answer)


def do_unserve(peer, service):
    """Withdraw a service."""
    peer.kept.pop(("service", service)).shutdown("the test says so")


def do_call(peer, service, type, request=None, persistent=False, count=1, together=False, **_):
    """Call a service `count` times; return the responses, or the error that came instead."""
    kind = roslib.message.get_service_class(type)
    rospy.wait_for_service(service, 20)
    made = kind._request_class()
    genpy.message.fill_message_args(made, [request or {}])
    answers = []

    def call(proxy):
        try:
            answers.append(peer.plain(proxy(made)))
        except rospy.ServiceException as error:
            answers.append(f"{error}")

    proxy = rospy.ServiceProxy(service, kind, persistent=persistent)
    if together:
        proxies = [rospy.ServiceProxy(service, kind) for _ in range(count)]
        threads = [threading.Thread(target=call, args=(one,)) for one in proxies]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    else:
        for _ in range(count):
            call(proxy)
    proxy.close()
    return answers
