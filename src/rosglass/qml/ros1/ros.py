"""The singleton ``Ros``: the node, the graph, and the makers of everything else."""
# ruff: noqa: N802 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from rosglass.comm.qos import History
from rosglass.errors import Error, InvalidNameError
from rosglass.qml.action_server import RosActionServer, server_functions
from rosglass.qml.dialect import Dialect, within_namespace
from rosglass.qml.graph import GraphSingleton
from rosglass.qml.log import Caller, log_from_qml
from rosglass.qml.message_waiting import next_message
from rosglass.qml.profiles import queue_from_js
from rosglass.qml.publisher import RosPublisher
from rosglass.qml.ros1.console import Console, InitOptions, short_logger
from rosglass.qml.ros1.package import Package
from rosglass.qml.service_server import RosServiceServer, server_function
from rosglass.qml.singleton import check_type, is_list, strings
from rosglass.qml.subscription import DEFAULT_QOS, Subscriber
from rosglass.qml.value_functions import ValueFunctions
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.qml.session import Session

__all__ = ["Ros"]

_OPTIONS = sum(InitOptions.Option)


class Ros(ValueFunctions, GraphSingleton):
    """What QML calls ``Ros``; one per engine, all of a session sharing its node."""

    DIALECT = Dialect.ROS1
    NAME = "Ros"

    shutdown = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._console: Console | None = None
        self._package: Package | None = None

    def _listen(self, session: Session) -> None:
        super()._listen(session)
        session.about_to_shutdown.connect(self.shutdown)

    # The node.

    @Slot(QJSValue)
    @Slot(QJSValue, QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue)
    def init(
        self, first: QJSValue, second: QJSValue | None = None, third: QJSValue | None = None
    ) -> None:
        """Ask for a node; arguments are optional command line, name, optional RosInitOptions."""
        args: Sequence[str] = ()
        if is_list(first):
            args, first, second = strings(first), second or QJSValue(), third
        try:
            if not first.isString():
                raise InvalidNameError(
                    'the name must be a text: Ros.init("name"), or Ros.init(arguments, "name")'
                )
            options = 0 if second is None or second.isUndefined() else second.toInt()
            if options & ~_OPTIONS:
                raise InvalidNameError(f"the options {options} are not of RosInitOptions")
            self._init(first.toString(), options, args)
        except Error as error:
            self._runtime.throw(f"Ros.init: {error}")

    def _init(self, name: str, options: int, args: Sequence[str]) -> None:
        if options & InitOptions.Option.AnonymousName:
            from rosglass.comm.names import anonymous_name  # noqa: PLC0415 - few ask for it

            name = anonymous_name(name)
        if options & InitOptions.Option.NoRosout:
            self._log(logging.WARNING, "Ros.init: NoRosout has no effect: every node has its log")
        self._session.init(name, arguments=args)

    @Slot()
    def spinOnce(self) -> None:
        """Do nothing: callbacks come by themselves."""

    @Slot(int)
    def setThreads(self, count: int) -> None:
        """Do nothing: messages are received beside the interface whatever their number."""
        if count < 0:
            self._runtime.throw(f"Ros.setThreads: {count} is negative")

    # Topics.

    @Slot(QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    def advertise(self, *given: QJSValue) -> QtCore.QObject | None:
        """Return a publisher; it lives as long as JavaScript holds it.

        Arguments are optional namespace, message type, topic, queue size (0 for no limit), and
        optionally whether
        new subscribers get the last message.
        """
        try:
            texts, rest = _split(given, "Ros.advertise([ns,] type, topic, queueSize, latch)")
            namespace, type_name, topic = texts
            qos = queue_from_js(rest[0], DEFAULT_QOS)
            size = 0 if qos.history is History.KEEP_ALL else qos.depth
            check_type(type_name, topic)
            topic = within_namespace(namespace, topic)
            self._check_topic(topic)
        except Error as error:
            self._runtime.throw(f"Ros.advertise: {error}")
            return None
        latch = len(rest) > 1 and rest[1].toBool()
        return self._runtime.keep(RosPublisher(self._runtime, type_name, topic, size, latch))

    @Slot(QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    def subscribe(self, *given: QJSValue) -> QtCore.QObject | None:
        """Return a subscriber; arguments are optional namespace, topic and queue size."""
        try:
            if not all(value.isString() for value in given[:-1]):
                raise InvalidNameError("write Ros.subscribe([ns,] topic, queueSize)")
            names = [value.toString() for value in given[:-1]]
            namespace = names[0] if len(names) > 1 else ""
            self._check_topic(within_namespace(namespace, names[-1]))
            qos = queue_from_js(given[-1], DEFAULT_QOS)
        except Error as error:
            self._runtime.throw(f"Ros.subscribe: {error}")
            return None
        subscriber = Subscriber(None, self._runtime)
        subscriber.configure_within(namespace, names[-1], qos)
        return self._runtime.keep(subscriber)

    @Slot(str, QJSValue, result=QJSValue)
    @Slot(str, QJSValue, QJSValue, result=QJSValue)
    @Slot(str, result=QJSValue)
    def waitForMessageAsync(
        self, topic: str, first: QJSValue | None = None, second: QJSValue | None = None
    ) -> QJSValue:
        """Give the next message of a topic to a function, undefined when none came in time.

        Arguments are topic, optional milliseconds (0: for ever) and function. Without a function,
        a promise of the message is returned.
        """
        return next_message(Subscriber(None, self._runtime), self._runtime, topic, first, second)

    # Services.

    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def advertiseService(
        self, type_name: str, name: str, handler: QJSValue
    ) -> QtCore.QObject | None:
        """Offer a service for as long as JavaScript holds what is returned.

        Args:
            type_name: Service type, ``pkg/Type``.
            name: Service name.
            handler: Told the request; returns the response, or a promise of it.
        """
        return self._offer(
            "advertiseService", RosServiceServer, name, type_name, lambda: server_function(handler)
        )

    # Actions.

    @Slot(QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    def createActionClient(self, *given: QJSValue) -> QtCore.QObject | None:
        """Return a client of an action; it lives as long as JavaScript holds it, or a goal runs.

        Arguments are optional namespace, action type (``pkg/DoAction``) and name.
        """
        texts = [value.toString() for value in given if value.isString()]
        try:
            if len(texts) != len(given) or not texts[-2] or not texts[-1]:
                raise InvalidNameError("write Ros.createActionClient([ns,] type, name)")
            check_type(texts[-2], texts[-1])
            name = within_namespace(texts[0] if len(texts) > 2 else "", texts[-1])
            self._check_topic(name)
        except Error as error:
            self._runtime.throw(f"Ros.createActionClient: {error}")
            return None
        from rosglass.qml.ros1.action_client import RosActionClient  # noqa: PLC0415 - few have any

        return self._runtime.keep(RosActionClient(self._runtime, name, texts[-2]))

    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def advertiseAction(
        self, type_name: str, name: str, execute: QJSValue
    ) -> QtCore.QObject | None:
        """Offer an action for as long as JavaScript holds what is returned.

        Args:
            type_name: Action type, ``pkg/DoAction``.
            name: Action name.
            execute: Told the goal and its handle; returns the result, or a promise of it, or
                nothing, and ends the goal by its handle. Or an object of ``execute``, ``accept``
                and ``cancel``.
        """
        return self._offer(
            "advertiseAction", RosActionServer, name, type_name, lambda: server_functions(execute)
        )

    def _check_topic(self, topic: str) -> None:
        """Raise InvalidNameError unless ROS 1 takes this for a name."""
        from rosglass.ros1.names import expand  # noqa: PLC0415 - not needed at start-up

        expand(topic, "node", "/")

    # The graph.

    @Slot(result=QJSValue)
    def queryTopicInfo(self) -> QJSValue:
        """Return ``{name, datatype}`` of every topic."""
        infos = [
            {"name": name, "datatype": self._spell(types[0]) if types else ""}
            for name, types in self._topics().items()
        ]
        return self._runtime.value(infos)

    @Slot(str, result=str)
    def queryTopicType(self, topic: str) -> str:
        """Return a topic's type; empty when nobody knows it."""
        types = self._types("queryTopicType", topic, self._topics())
        return types[0] if types else ""

    # Logging.

    def _log(self, level: int, message: str, name: str = "") -> None:
        super()._log(level, message, short_logger(name))

    @Slot(int, str, str, int, QJSValue)
    @Slot(int, str, str, int, QJSValue, str)
    def logInternal(
        self, level: int, function: str, file: str, line: int, message: QJSValue, name: str = ""
    ) -> None:
        """Log a message from a place that the caller gives; `level` is of RosConsoleLevels."""
        levels = (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR, logging.CRITICAL)
        if not 0 <= level < len(levels):
            self._runtime.throw(f"Ros.logInternal: {level} is not one of RosConsoleLevels")
            return
        caller = Caller(file, max(line, 0), function)
        log_from_qml(short_logger(name), levels[level], message.toString(), caller)

    def _get_console(self) -> Console:
        if self._console is None:
            self._console = Console(self._runtime, self)
        return self._console

    def _get_package(self) -> Package:
        if self._package is None:
            self._package = Package(self._runtime, self)
        return self._package

    console = Property(QtCore.QObject, _get_console, constant=True)
    package = Property(QtCore.QObject, _get_package, constant=True)


def _split(given: Sequence[QJSValue], usage: str) -> tuple[tuple[str, str, str], list[QJSValue]]:
    """Return namespace (or an empty text), type and topic, and the arguments that follow."""
    texts = [value.toString() for value in given if value.isString()]
    count = len(texts)
    if count not in {2, 3} or not all(value.isString() for value in given[:count]):
        raise InvalidNameError(f"write {usage}")
    if len(given) == count or not all(texts[-2:]):
        raise InvalidNameError(f"something is missing; write {usage}")
    namespace, type_name, topic = texts if count == 3 else ("", *texts)
    return (namespace, type_name, topic), list(given[count:])
