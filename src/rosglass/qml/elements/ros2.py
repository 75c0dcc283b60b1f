"""The module ``Ros2 1.0``: its singletons and registered types."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, TypeVar

from rosglass.comm.names import expand
from rosglass.comm.qos import QoS
from rosglass.comm.time import Time
from rosglass.errors import Error, InvalidNameError
from rosglass.qml.elements.action_client import ActionClient
from rosglass.qml.elements.action_server import ActionServer, server_functions
from rosglass.qml.elements.goal_handle import ActionGoalStatus
from rosglass.qml.elements.image_publisher import ImagePublisher
from rosglass.qml.elements.image_sinks import ImageItem
from rosglass.qml.elements.image_subscription import (
    ImageTransportManager,
    ImageTransportSubscription,
)
from rosglass.qml.elements.logger import Logger, LoggerLevel
from rosglass.qml.elements.message_item_model import MessageItemModel
from rosglass.qml.elements.parameter import Parameter
from rosglass.qml.elements.publisher import Publisher
from rosglass.qml.elements.replay import Replay
from rosglass.qml.elements.services import ServiceClient, ServiceServer, server_function
from rosglass.qml.elements.singleton import (
    ValueFunctions,
    check_type,
    full_type,
    is_list,
    strings,
)
from rosglass.qml.elements.subscription import DEFAULT_QOS, Subscription, next_message
from rosglass.qml.elements.synchronized_subscription import SynchronizedSubscription
from rosglass.qml.elements.tf_buffer import TfBuffer, TfTransformListener
from rosglass.qml.elements.tf_transform import TfBroadcaster, TfTransform
from rosglass.qml.engine.js_values import qos_from_js
from rosglass.qml.engine.runtime import own_runtime
from rosglass.qml.engine.waiting import FOLDER_TIMEOUT_S, within
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.engine.session import Session


__all__ = ["NATIVE", "TYPES", "AmentIndex", "Ros2"]

_T = TypeVar("_T")
_log = logging.getLogger("rosglass.qml")
#: Package list of an install space; see ament's resource index, section "File System Index".
_LIST = "share/ament_index/resource_index/packages"


class ClockTypes(QtCore.QObject):
    """Clock types, numbered as in rcl (``rcl_clock_type_t``).

    Values of a time's ``clockType``, a property in the Qt 5 plugin and a function in the Qt 6 one.
    """

    def _get(self, number: int) -> QJSValue:
        return own_runtime(self).clock(number)

    Uninitialized = Property(QJSValue, lambda self: self._get(0), constant=True)
    Ros = Property(QJSValue, lambda self: self._get(1), constant=True)
    System = Property(QJSValue, lambda self: self._get(2), constant=True)
    Steady = Property(QJSValue, lambda self: self._get(3), constant=True)


class AmentIndex(QtCore.QObject):
    """The packages in the install spaces of ``AMENT_PREFIX_PATH``, of which the first has priority.

    Empty without ROS 2. Install spaces that cannot be read are logged.
    """

    @Slot(str, result=str)
    def getPackageShareDirectory(self, package: str) -> str:
        """Return a package's share folder; empty if the package does not exist."""
        prefix = self.getPackagePrefix(package)
        return os.path.join(prefix, "share", package) if prefix else ""  # noqa: PTH118

    @Slot(str, result=str)
    def getPackagePrefix(self, package: str) -> str:
        """Return the install space of a package; empty if the package does not exist."""
        if not package or "/" in package or package.startswith("."):
            return ""
        return _look(lambda: _prefix(package), "")

    @Slot(result="QStringList")
    def getPackages(self) -> list[str]:
        """Return the names of all packages, sorted."""
        return _look(_packages, [])


def _look(search: Callable[[], _T], otherwise: _T) -> _T:
    try:
        return within(FOLDER_TIMEOUT_S, "a folder in AMENT_PREFIX_PATH", search)
    except Error as error:
        _log.error("AmentIndex: %s", error)
        return otherwise


def _prefix(package: str) -> str:
    # Unlike pathlib's, this never raises.
    found = (
        prefix
        for prefix in _prefixes()
        if os.path.isfile(os.path.join(prefix, _LIST, package))  # noqa: PTH113, PTH118
    )
    return next(found, "")


def _packages() -> list[str]:
    names: set[str] = set()
    for prefix in _prefixes():
        folder = os.path.join(prefix, _LIST)  # noqa: PTH118
        try:
            names.update(os.listdir(folder))  # noqa: PTH208
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            _log.warning("AmentIndex: %s cannot be read: %s", folder, error.strerror)
    return sorted(name for name in names if not name.startswith("."))


def _prefixes() -> list[str]:
    return [path for path in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if path]


class Ros2(ValueFunctions):
    """The singleton ``Ros2``, one per engine; all of a session share its node."""

    aboutToShutdown = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._loggers: dict[str, Logger] = {}

    def _listen(self, session: Session) -> None:
        super()._listen(session)
        session.about_to_shutdown.connect(self.aboutToShutdown)

    # The node.

    @Slot(str)
    @Slot(str, QJSValue)
    @Slot(str, QJSValue, QJSValue)
    def init(
        self, name: str, first: QJSValue | None = None, second: QJSValue | None = None
    ) -> None:
        """Request a node; arguments are name, optional command line, optional init options."""
        args, options = (first, second) if is_list(first) else (None, first)
        try:
            namespace, domain = _read_options(options)
            given = strings(args) if args is not None else ()
            self._session.init(name, namespace, domain, given)
        except Error as error:
            self._runtime.throw(f"Ros2.init: {error}")

    @Slot()
    def shutdown(self) -> None:
        """Close the node."""
        self._session.shutdown()

    @Slot(result=QJSValue)
    def now(self) -> QJSValue:
        """Return the time of the node's clock; the system time before there is a node."""
        node = self._session.node
        return self._runtime.time(node.now() if node is not None else Time.now())

    @Slot(result=QJSValue)
    def createInitOptions(self) -> QJSValue:
        """Return empty init options, with methods setNamespace() and setDomainId()."""
        return self._runtime.options()

    # Profiles.

    @Slot(result=QJSValue)
    def QoS(self) -> QJSValue:
        """Return a profile: best effort, volatile, only the newest message."""
        return self._runtime.qos(DEFAULT_QOS)

    @Slot(result=QJSValue)
    def CommandQoS(self) -> QJSValue:
        """Return a profile: reliable, only the newest message, dropped if not sent in 0.3 s."""
        return self._runtime.qos(QoS.command())

    @Slot(result=QJSValue)
    def SensorDataQoS(self) -> QJSValue:
        """Return a profile: best effort, the newest 5."""
        return self._runtime.qos(QoS.sensor_data())

    @Slot(result=QJSValue)
    def SystemDefaultsQoS(self) -> QJSValue:
        """Return a profile: reliable, volatile, the newest 10."""
        return self._runtime.qos(QoS())

    @Slot(result=QJSValue)
    def ServicesQoS(self) -> QJSValue:
        """Return a profile: reliable, volatile, the newest 10."""
        return self._runtime.qos(QoS.services())

    @Slot(result=QJSValue)
    def ClockQoS(self) -> QJSValue:
        """Return a profile: best effort, only the newest message."""
        return self._runtime.qos(QoS.clock())

    @Slot(result=QJSValue)
    def BestAvailableQoS(self) -> QJSValue:
        """Return a profile: the strongest that matches all publishers, the newest 10."""
        return self._runtime.qos(QoS.best_available())

    # Topics.

    @Slot(str, str, result=QtCore.QObject)
    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def createPublisher(
        self, topic: str, type_name: str, qos: QJSValue | None = None
    ) -> QtCore.QObject | None:
        """Return a publisher, which exists while JavaScript refers to it.

        Args:
            topic: Topic name.
            type_name: Message type, ``pkg/msg/Type`` or ``pkg/Type``.
            qos: Profile, or the depth of a reliable one; 10 by default.
        """
        try:
            self._check_topic(topic)
            if not type_name:
                raise InvalidNameError(f"the message type of topic {topic!r} is empty")
            check_type(type_name, topic)
            profile = qos_from_js(qos, QoS())
        except Error as error:
            self._runtime.throw(f"Ros2.createPublisher: {error}")
            return None
        publisher = Publisher(self._runtime, topic, full_type(type_name), profile)
        return self._runtime.keep(publisher)

    @Slot(str, result=QtCore.QObject)
    @Slot(str, QJSValue, result=QtCore.QObject)
    @Slot(str, QJSValue, QJSValue, result=QtCore.QObject)
    def createSubscription(
        self, topic: str, first: QJSValue | None = None, second: QJSValue | None = None
    ) -> QtCore.QObject | None:
        """Return a subscription, which exists while JavaScript refers to it.

        Args:
            topic: Topic name.
            first: Message type; if the type is omitted, profile or queue size.
            second: Profile or queue size after a type.
        """
        type_name, qos = "", first
        if first is not None and first.isString():
            type_name, qos = first.toString(), second
        try:
            self._check_topic(topic)
            profile = qos_from_js(qos, DEFAULT_QOS)
        except Error as error:
            self._runtime.throw(f"Ros2.createSubscription: {error}")
            return None
        subscription = Subscription(None, self._runtime)
        subscription.configure(topic, full_type(type_name), profile)
        return self._runtime.keep(subscription)

    @Slot(str, result=QJSValue)
    @Slot(str, QJSValue, result=QJSValue)
    @Slot(str, QJSValue, QJSValue, result=QJSValue)
    def waitForMessageAsync(
        self, topic: str, first: QJSValue | None = None, second: QJSValue | None = None
    ) -> QJSValue:
        """Call a function with the next message of a topic; with undefined after a timeout.

        Arguments are topic, optional milliseconds (0 for no timeout) and function. Without a
        function, a promise of the message is returned.
        """
        return next_message(Subscription(None, self._runtime), self._runtime, topic, first, second)

    # Services.

    @Slot(str, str, result=QtCore.QObject)
    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def createServiceClient(
        self, name: str, type_name: str, qos: QJSValue | None = None
    ) -> QtCore.QObject | None:
        """Return a service client, which exists while JavaScript refers to it.

        Args:
            name: Service name.
            type_name: Service type, ``pkg/srv/Type`` or ``pkg/Type``; empty uses the server's.
            qos: Profile of requests and replies; the default for services if omitted.
        """
        try:
            self._check_topic(name)
            check_type(type_name, name)
            profile = None if qos is None else qos_from_js(qos, QoS.services())
        except Error as error:
            self._runtime.throw(f"Ros2.createServiceClient: {error}")
            return None
        kind = full_type(type_name, "srv")
        client = ServiceClient(self._runtime, name, kind, self.DIALECT, profile)
        return self._runtime.keep(client)

    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def createServiceServer(
        self, name: str, type_name: str, handler: QJSValue
    ) -> QtCore.QObject | None:
        """Offer a service while JavaScript refers to the returned server.

        Args:
            name: Service name.
            type_name: Service type, ``pkg/srv/Type`` or ``pkg/Type``.
            handler: Called with the request; returns the response, or a promise of it.
        """
        return self._offer(
            "createServiceServer", ServiceServer, name, type_name, lambda: server_function(handler)
        )

    # Actions.

    @Slot(str, str, result=QtCore.QObject)
    def createActionClient(self, name: str, type_name: str) -> QtCore.QObject | None:
        """Return an action client, which exists while JavaScript refers to it or a goal is active.

        Args:
            name: Action name.
            type_name: Action type, ``pkg/action/Type`` or ``pkg/Type``; empty uses the server's.
        """
        try:
            self._check_topic(name)
            check_type(type_name, name)
        except Error as error:
            self._runtime.throw(f"Ros2.createActionClient: {error}")
            return None
        client = ActionClient(self._runtime, name, full_type(type_name, "action"))
        return self._runtime.keep(client)

    @Slot(str, str, QJSValue, result=QtCore.QObject)
    def createActionServer(
        self, name: str, type_name: str, execute: QJSValue
    ) -> QtCore.QObject | None:
        """Offer an action while JavaScript refers to the returned server.

        Args:
            name: Action name.
            type_name: Action type, ``pkg/action/Type`` or ``pkg/Type``.
            execute: Called with the goal and its handle; returns the result or a promise of it, or
                returns nothing and ends the goal by its handle. Or an object with ``execute``,
                ``accept`` and ``cancel``.
        """
        return self._offer(
            "createActionServer", ActionServer, name, type_name, lambda: server_functions(execute)
        )

    @Slot(str, result=bool)
    def isValidTopic(self, topic: str) -> bool:
        """Return whether a topic name follows ROS 2's rules."""
        try:
            self._check_topic(topic)
        except Error:
            return False
        return True

    # The graph.

    @Slot(result=QJSValue)
    def queryTopicInfo(self) -> QJSValue:
        """Return ``{name, datatypes}`` of every topic."""
        infos = [{"name": name, "datatypes": types} for name, types in self._topics().items()]
        return self._runtime.value(infos)

    @Slot(str, result="QStringList")
    def queryTopicTypes(self, topic: str) -> list[str]:
        """Return the types announced for a topic; alias of getTopicTypes."""
        types: list[str] = self.getTopicTypes(topic)
        return types

    def _check_topic(self, topic: str) -> None:
        """Raise InvalidNameError unless `topic` is a valid name in ROS 2."""
        session = self._session
        expand(topic, session.name or "node", session.namespace or "/")

    # Logging.

    @Slot(result=QtCore.QObject)
    @Slot(str, result=QtCore.QObject)
    def getLogger(self, name: str = "") -> QtCore.QObject:
        """Return a logger; the node's own if `name` is empty."""
        if name not in self._loggers:
            self._loggers[name] = Logger(self._runtime, name, self)
        return self._loggers[name]


def _read_options(options: QJSValue | None) -> tuple[str, int]:
    """Return the namespace and domain of init options."""
    if options is None or options.isUndefined() or options.isNull():
        return "/", -1
    if not options.hasProperty("namespace"):
        raise InvalidNameError("the options must come from Ros2.createInitOptions()")
    namespace = options.property("namespace").toString() or "/"
    domain = options.property("domain").toNumber()
    if not domain.is_integer() or not -1 <= domain <= 232:
        raise InvalidNameError(f"the domain id must be 0 to 232, got {domain:g}")
    return namespace, int(domain)


#: Names in ``Ros2.Native`` -> base classes of the module's singletons (``imports/Ros2/*.qml``).
NATIVE = {
    "TfTransformListenerNative": TfTransformListener,
    "AmentIndexNative": AmentIndex,
    "Ros2ClockTypesNative": ClockTypes,
    "Ros2Native": Ros2,
    "ImageTransportManagerNative": ImageTransportManager,
}
#: Names in QML -> types.
TYPES = {
    "SynchronizedSubscription": SynchronizedSubscription,
    "Replay": Replay,
    "ImagePublisher": ImagePublisher,
    "TfBroadcaster": TfBroadcaster,
    "TfBuffer": TfBuffer,
    "TfTransform": TfTransform,
    "Parameter": Parameter,
    "ServiceServer": ServiceServer,
    "Subscription": Subscription,
    "ImageTransportSubscription": ImageTransportSubscription,
    "ImageItem": ImageItem,
    "MessageItemModel": MessageItemModel,
    "Ros2LoggerLevel": LoggerLevel,
    "ActionGoalStatus": ActionGoalStatus,
    "ActionServer": ActionServer,
}
