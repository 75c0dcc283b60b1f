"""``waitForMessageAsync``: the next message of a topic, once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm.qos import QoS
from rosglass.qt import QJSValue, QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.runtime import Runtime
    from rosglass.qml.subscription import Subscription

__all__ = ["wait_for_message"]


def wait_for_message(
    runtime: Runtime,
    subscription: Subscription,
    topic: str,
    type_name: str,
    milliseconds: float,
    done: Callable[[QJSValue | None], None],
) -> None:
    """Give the next message of a topic, a latched one included, to a function.

    Args:
        runtime: The engine's runtime, which keeps the subscription.
        subscription: A new one, made for this.
        topic: Topic name.
        type_name: Message type; empty takes the one that publishers announce.
        milliseconds: How long to wait, 0 for ever.
        done: Told the message; None when none came.
    """
    subscription.setParent(runtime)
    subscription.configure(topic, type_name, QoS.best_available())
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
    if milliseconds > 0:
        QtCore.QTimer.singleShot(round(milliseconds), lambda: end(None))
