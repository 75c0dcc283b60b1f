"""What only ``import Ros 1.0`` has."""

from rosglass.qml.action_server import RosActionServer
from rosglass.qml.goal_states import ActionCommStates, ActionGoalStatus, ActionTerminalStates
from rosglass.qml.image_item import ImageItem
from rosglass.qml.image_manager import ImageTransportManager
from rosglass.qml.image_publisher import RosImagePublisher
from rosglass.qml.image_subscription import ImageTransportSubscriber
from rosglass.qml.parameter import Parameter
from rosglass.qml.replay import Replay
from rosglass.qml.ros1.console import ConsoleLevels, InitOptions
from rosglass.qml.ros1.ros import Ros
from rosglass.qml.ros1.service import Service
from rosglass.qml.ros1.time import Time, WallTime
from rosglass.qml.service_server import RosServiceServer
from rosglass.qml.subscription import Subscriber
from rosglass.qml.synchronized_subscription import RosSynchronizedSubscription
from rosglass.qml.tf_broadcaster import RosTfBroadcaster
from rosglass.qml.tf_buffer import RosTfBuffer, RosTfTransformListener
from rosglass.qml.tf_transform import RosTfTransform

__all__ = ["NATIVE", "TYPES"]

#: Bases of the module's singletons (``imports/Ros/*.qml``), by their name in ``Ros.Native``.
NATIVE = {
    "TfTransformListenerNative": RosTfTransformListener,
    "RosNative": Ros,
    "ServiceNative": Service,
    "TimeNative": Time,
    "WallTimeNative": WallTime,
    "ImageTransportManagerNative": ImageTransportManager,
}
#: What QML can write, by name.
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
