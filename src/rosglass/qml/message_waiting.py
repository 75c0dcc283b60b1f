"""``waitForMessageAsync``: the next message of a topic, once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rosglass.comm.qos import QoS
from rosglass.qml.callbacks import Deferred, call_back
from rosglass.qt import QJSValue, QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.runtime import Runtime
    from rosglass.qml.subscription import Subscription

__all__ = ["next_message", "wait_for_message"]

#: Milliseconds that Qt's timers can wait, 24 days.
_LONGEST = 2**31 - 1


def next_message(
    subscription: Subscription,
    runtime: Runtime,
    topic: str,
    first: QJSValue | None,
    second: QJSValue | None,
) -> QJSValue:
    """Do what ``waitForMessageAsync`` was asked for.

    Args:
        subscription: A new one, made for this.
        runtime: The engine's runtime.
        topic: Topic name.
        first: Milliseconds, or the function.
        second: The function after milliseconds.

    Returns:
        A promise of the message; undefined when there is a function.
    """
    timed = first is not None and first.isNumber()
    callback = second if timed else first
    milliseconds = first.toNumber() if timed and first is not None else 0.0
    if math.isnan(milliseconds):
        runtime.throw(f"waitForMessageAsync({topic!r}): the milliseconds to wait are NaN")
        subscription.deleteLater()
        return QJSValue()
    if callback is not None and callback.isCallable():

        def tell(message: QJSValue | None) -> None:
            call_back(runtime, callback, QJSValue() if message is None else message)

        wait_for_message(runtime, subscription, topic, milliseconds, tell)
        return QJSValue()
    if callback is not None:
        runtime.throw(f"waitForMessageAsync({topic!r}): the callback is not a function")
        subscription.deleteLater()
        return QJSValue()
    deferred = Deferred(runtime, f"waiting for a message on {topic}")

    def settle(message: QJSValue | None) -> None:
        if message is None:
            deferred.reject(f"none came within {milliseconds:g} ms")
        else:
            deferred.resolve(message)

    wait_for_message(runtime, subscription, topic, milliseconds, settle)
    return deferred.promise


def wait_for_message(
    runtime: Runtime,
    subscription: Subscription,
    topic: str,
    milliseconds: float,
    done: Callable[[QJSValue | None], None],
) -> None:
    """Give the next message of a topic, a latched one included, to a function.

    Args:
        runtime: The engine's runtime, which keeps the subscription.
        subscription: A new one, made for this.
        topic: Topic name.
        milliseconds: How long to wait, 0 or infinity for ever.
        done: Told the message; None when none came.
    """
    subscription.setParent(runtime)
    subscription.configure(topic, "", QoS.best_available())
    ended = False

    def end(message: QJSValue | None) -> None:
        nonlocal ended
        if ended:
            return
        ended = True
        if is_alive(subscription):
            subscription.deleteLater()
        done(message)

    subscription.newMessage.connect(end)
    if 0 < milliseconds < math.inf:
        QtCore.QTimer.singleShot(round(min(milliseconds, _LONGEST)), lambda: end(None))
