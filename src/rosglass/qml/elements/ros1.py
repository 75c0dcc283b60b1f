"""The module ``Ros 1.0``: its singletons and registered types."""
# ruff: noqa: N802 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import os
import shlex
import threading
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from rosglass.comm.names import anonymous_name
from rosglass.comm.qos import Durability, History, QoS
from rosglass.comm.time import Time as Moment
from rosglass.errors import Error, InvalidNameError, UnsupportedError
from rosglass.interfaces.provider import workspace, workspace_variables
from rosglass.qml.elements.action_client import RosActionClient
from rosglass.qml.elements.action_server import RosActionServer, server_functions
from rosglass.qml.elements.goal_handle import (
    ActionCommStates,
    ActionGoalStatus,
    ActionTerminalStates,
)
from rosglass.qml.elements.image_publisher import RosImagePublisher
from rosglass.qml.elements.image_sinks import ImageItem
from rosglass.qml.elements.image_subscription import ImageTransportManager, ImageTransportSubscriber
from rosglass.qml.elements.logger import Console, ConsoleLevels, InitOptions, short_logger
from rosglass.qml.elements.parameter import Parameter
from rosglass.qml.elements.publisher import RosPublisher
from rosglass.qml.elements.replay import Replay
from rosglass.qml.elements.services import RosServiceServer, Service, server_function
from rosglass.qml.elements.singleton import ValueFunctions, check_type, is_list, strings
from rosglass.qml.elements.subscription import ROS1_QOS, Subscriber, next_message
from rosglass.qml.elements.synchronized_subscription import RosSynchronizedSubscription
from rosglass.qml.elements.tf_buffer import RosTfBuffer, RosTfTransformListener
from rosglass.qml.elements.tf_transform import RosTfBroadcaster, RosTfTransform
from rosglass.qml.engine.dialect import Dialect, within_namespace
from rosglass.qml.engine.js_values import queue_from_js
from rosglass.qml.engine.log import Caller, log_from_qml
from rosglass.qml.engine.runtime import Runtime, own_runtime
from rosglass.qml.engine.waiting import FOLDER_TIMEOUT_S, MOST_WAITING, wait_for, within
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot
from rosglass.wires.tcpros.graph import expand

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.interfaces.provider import Folders
    from rosglass.qml.engine.session import Session


__all__ = ["NATIVE", "TYPES", "Package", "Ros", "Time", "WallTime"]


class WallTime(QtCore.QObject):
    """The singleton ``WallTime``: the time of the operator's machine."""

    @property
    def _runtime(self) -> Runtime:
        return own_runtime(self)

    @Slot(result=QJSValue)
    def now(self) -> QJSValue:
        """Return the system time."""
        return self._runtime.time(Moment.now(), Dialect.ROS1)

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def create(self, first: QJSValue, second: QJSValue | None = None) -> QJSValue:
        """Create a time from seconds, or from whole seconds and nanoseconds."""
        runtime = self._runtime
        made = runtime.create_time(Dialect.ROS1, "time", first, second or QJSValue())
        if made.isError():
            name = type(self).__name__
            runtime.throw(f"{name}.create: {made.property('message').toString()}")
            return QJSValue()
        return made


class Time(WallTime):
    """The singleton ``Time``: the time of the robot, which may be simulated."""

    def _now(self) -> Moment:
        session = self._runtime.session
        if session.node is not None:
            return session.node.now()
        # While the node is connecting, it is unknown whether time is simulated.
        return Moment.now() if session.is_initialized else Moment()

    @Slot(result=QJSValue)
    def now(self) -> QJSValue:
        """Return the node's time; zero before init, and before the first simulated time."""
        return self._runtime.time(self._now(), Dialect.ROS1)

    @Slot(result=bool)
    def isSimTime(self) -> bool:
        """Return whether time is simulated."""
        node = self._runtime.session.node
        try:
            return node is not None and node.clock.is_simulated
        except UnsupportedError:
            return False

    @Slot(result=bool)
    def isSystemTime(self) -> bool:
        """Return whether the time is the system time of the operator's machine."""
        return not self.isSimTime()

    @Slot(result=bool)
    def isValid(self) -> bool:
        """Return whether time is valid: false before init, and before the first simulated time."""
        return self._now() != Moment()


_T = TypeVar("_T")

#: Seconds that the program ``rospack`` may take.
_ROSPACK_TIMEOUT_S = 10


class Package(QtCore.QObject):
    """The packages in ``ROS_PACKAGE_PATH`` and in sourced workspaces.

    Args:
        runtime: The engine's runtime.
        parent: The singleton.
    """

    def __init__(self, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime = runtime
        self._found: Folders | None = None
        self._searched: tuple[str | None, ...] = ()

    def _look(self, search: Callable[[Folders], _T], otherwise: _T, *, again: bool = False) -> _T:
        """Search the package folders; re-read them if `again` or if the environment changed."""
        paths = workspace_variables(os.environ)

        def look() -> _T:
            if self._found is None or paths != self._searched or again:
                self._found, self._searched = workspace(os.environ), paths
            return search(self._found)

        try:
            return within(FOLDER_TIMEOUT_S, "a folder of packages", look)
        except Error as error:
            text = f"Ros.package: {error}"
            log_from_qml("", logging.ERROR, text, self._runtime.caller())
            return otherwise

    @Slot(str, result=str)
    def getPath(self, package: str) -> str:
        """Return a package's folder; empty if the package does not exist."""
        return self._look(lambda folders: folders.package(package), "")

    @Slot(result="QStringList")
    def getAll(self) -> list[str]:
        """Return the names of all packages, sorted."""
        return self._look(lambda folders: sorted(folders.packages()), [])

    @Slot(str, str, result=QJSValue)
    @Slot(str, str, bool, result=QJSValue)
    def getPlugins(self, name: str, attribute: str, force_recrawl: bool = False) -> QJSValue:
        """Return the values that packages export for a package.

        Args:
            name: Name of the element in ``<export>``, usually the package that is extended.
            attribute: The attribute whose values are returned.
            force_recrawl: Whether to read the folders again.

        Returns:
            An object of package names to lists of values, in which ``${prefix}`` is the package's
            folder.
        """

        def search(folders: Folders) -> dict[str, list[str]]:
            return {
                package: values
                for package, folder in sorted(folders.packages().items())
                if (values := _exports(folder, name, attribute))
            }

        nothing: dict[str, list[str]] = {}
        return self._runtime.value(self._look(search, nothing, again=force_recrawl))

    @Slot(str, result=str)
    def command(self, command: str) -> str:
        """Return the output of the program ``rospack``; empty, with a log message, without it."""
        caller, session = self._runtime.caller(), self._runtime.session
        printed: list[str | Error] = [""]

        def begin(end: Callable[[], None]) -> None:
            def work() -> None:
                try:
                    printed[0] = _rospack(command)
                except Error as error:
                    printed[0] = error
                session.executor.post(end)

            # Not on the session's worker, where it would delay subscribing.
            threading.Thread(target=work, name="rospack", daemon=True).start()

        if not wait_for(session, begin):
            printed[0] = Error(f"{MOST_WAITING} calls wait already")
        result = printed[0]
        if isinstance(result, Error):
            text = f"Ros.package.command({command!r}) failed: {result}"
            log_from_qml("", logging.WARNING, text, caller)
            return ""
        return result


def _rospack(command: str) -> str:
    import subprocess  # noqa: PLC0415 - few interfaces need it

    try:
        words = ["rospack", *shlex.split(command)]
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=_ROSPACK_TIMEOUT_S, check=False
        )
    except FileNotFoundError:
        raise Error("rospack is not installed; getPath() and getAll() need no ROS") from None
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        raise Error(str(error)) from None
    if done.returncode:
        raise Error(done.stderr.strip())
    return done.stdout.strip()


def _exports(folder: str, name: str, attribute: str) -> list[str]:
    """Return the values of an attribute of ``<export><name .../></export>`` in a package.xml.

    Format: REP 140, "Package Manifest Format Two", section "<export>".
    """
    from xml.etree import ElementTree  # noqa: PLC0415 - few interfaces need it

    try:
        root = ElementTree.parse(os.path.join(folder, "package.xml")).getroot()  # noqa: PTH118
    except (OSError, ElementTree.ParseError):
        return []
    elements = [element for element in root.iterfind("./export/*") if element.tag == name]
    values = [element.get(attribute) for element in elements]
    return [value.replace("${prefix}", folder) for value in values if value is not None]


_OPTIONS = sum(InitOptions.Option)


class Ros(ValueFunctions):
    """The singleton ``Ros``, one per engine; all of a session share its node."""

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
        """Request a node; arguments are optional command line, name, optional RosInitOptions."""
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
            name = anonymous_name(name)
        if options & InitOptions.Option.NoRosout:
            self._log(logging.WARNING, "Ros.init: NoRosout has no effect: every node has its log")
        self._session.init(name, arguments=args)

    @Slot(result=str)
    def getName(self) -> str:
        """Return the node's full name, e.g. ``/panel``; empty before init."""
        name, namespace = self._session.name, self._session.namespace
        return f"{namespace.rstrip('/')}/{name}" if name else ""

    @Slot()
    def spinOnce(self) -> None:
        """Do nothing: callbacks need no spinning."""

    @Slot(int)
    def setThreads(self, count: int) -> None:
        """Do nothing: messages are always received on other threads than the interface's."""
        if count < 0:
            self._runtime.throw(f"Ros.setThreads: {count} is negative")

    # Topics.

    @Slot(result=QJSValue)
    def CommandQoS(self) -> QJSValue:
        """Return the queue size for commands: the newest message, sent in 0.3 s or dropped."""
        return self._runtime.qos(QoS.command())

    @Slot(QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    def advertise(self, *arguments: QJSValue) -> QtCore.QObject | None:
        """Return a publisher, which exists while JavaScript refers to it.

        Arguments are optional namespace, message type, topic, queue size (0 for no limit) or
        ``Ros.CommandQoS()``, and optionally whether new subscribers get the last message.
        """
        try:
            texts, rest = _split(arguments, "Ros.advertise([ns,] type, topic, queueSize, latch)")
            namespace, type_name, topic = texts
            given = queue_from_js(rest[0], ROS1_QOS)
            size = 0 if given.history is History.KEEP_ALL else given.depth
            qos = QoS(given.depth, history=given.history, send_timeout=given.send_timeout)
            if len(rest) > 1 and rest[1].toBool():
                latched = Durability.TRANSIENT_LOCAL
                qos = replace(qos, depth=1, history=History.KEEP_LAST, durability=latched)
            check_type(type_name, topic)
            topic = within_namespace(namespace, topic)
            self._check_topic(topic)
        except Error as error:
            self._runtime.throw(f"Ros.advertise: {error}")
            return None
        return self._runtime.keep(RosPublisher(self._runtime, type_name, topic, size, qos))

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
            qos = queue_from_js(given[-1], ROS1_QOS)
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
        """Call a function with the next message of a topic; with undefined after a timeout.

        Arguments are topic, optional milliseconds (0 for no timeout) and function. Without a
        function, a promise of the message is returned.
        """
        return next_message(Subscriber(None, self._runtime), self._runtime, topic, first, second)

    # Services.

    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def advertiseService(
        self, type_name: str, name: str, handler: QJSValue
    ) -> QtCore.QObject | None:
        """Offer a service while JavaScript refers to the returned server.

        Args:
            type_name: Service type, ``pkg/Type``.
            name: Service name.
            handler: Called with the request; returns the response, or a promise of it.
        """
        return self._offer(
            "advertiseService", RosServiceServer, name, type_name, lambda: server_function(handler)
        )

    # Actions.

    @Slot(QJSValue, QJSValue, result=QtCore.QObject)
    @Slot(QJSValue, QJSValue, QJSValue, result=QtCore.QObject)
    def createActionClient(self, *given: QJSValue) -> QtCore.QObject | None:
        """Return an action client, which exists while JavaScript refers to it or a goal is active.

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
        return self._runtime.keep(RosActionClient(self._runtime, name, texts[-2]))

    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def advertiseAction(
        self, type_name: str, name: str, execute: QJSValue
    ) -> QtCore.QObject | None:
        """Offer an action while JavaScript refers to the returned server.

        Args:
            type_name: Action type, ``pkg/DoAction``.
            name: Action name.
            execute: Called with the goal and its handle; returns the result or a promise of it, or
                returns nothing and ends the goal by its handle. Or an object with ``execute``,
                ``accept`` and ``cancel``.
        """
        return self._offer(
            "advertiseAction", RosActionServer, name, type_name, lambda: server_functions(execute)
        )

    def _check_topic(self, topic: str) -> None:
        """Raise InvalidNameError unless `topic` is a valid name in ROS 1."""
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
        """Return a topic's type; empty if it is unknown."""
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
        """Log a message with a given location; `level` is one of RosConsoleLevels."""
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
    """Return the namespace (empty if omitted), type and topic, and the remaining arguments."""
    texts = [value.toString() for value in given if value.isString()]
    count = len(texts)
    if count not in {2, 3} or not all(value.isString() for value in given[:count]):
        raise InvalidNameError(f"write {usage}")
    if len(given) == count or not all(texts[-2:]):
        raise InvalidNameError(f"something is missing; write {usage}")
    namespace, type_name, topic = texts if count == 3 else ("", *texts)
    return (namespace, type_name, topic), list(given[count:])


#: Names in ``Ros.Native`` -> base classes of the module's singletons (``imports/Ros/*.qml``).
NATIVE = {
    "TfTransformListenerNative": RosTfTransformListener,
    "RosNative": Ros,
    "ServiceNative": Service,
    "TimeNative": Time,
    "WallTimeNative": WallTime,
    "ImageTransportManagerNative": ImageTransportManager,
}
#: Names in QML -> types.
TYPES = {
    "SynchronizedSubscription": RosSynchronizedSubscription,
    "Replay": Replay,
    "ImagePublisher": RosImagePublisher,
    "TfBroadcaster": RosTfBroadcaster,
    "TfBuffer": RosTfBuffer,
    "TfTransform": RosTfTransform,
    "Parameter": Parameter,
    "ServiceServer": RosServiceServer,
    "Subscriber": Subscriber,
    "ImageTransportSubscriber": ImageTransportSubscriber,
    "ImageItem": ImageItem,
    "RosConsoleLevels": ConsoleLevels,
    "RosInitOptions": InitOptions,
    "ActionCommStates": ActionCommStates,
    "ActionGoalStatus": ActionGoalStatus,
    "ActionServer": RosActionServer,
    "ActionTerminalStates": ActionTerminalStates,
}
