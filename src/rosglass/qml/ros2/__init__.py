"""What only ``import Ros2 1.0`` has."""

from rosglass.qml.action_server import ActionServer
from rosglass.qml.clock_types import ClockTypes
from rosglass.qml.goal_states import ActionGoalStatus
from rosglass.qml.image_item import ImageItem
from rosglass.qml.image_manager import ImageTransportManager
from rosglass.qml.image_publisher import ImagePublisher
from rosglass.qml.image_subscription import ImageTransportSubscription
from rosglass.qml.logger import LoggerLevel
from rosglass.qml.message_item_model import MessageItemModel
from rosglass.qml.parameter import Parameter
from rosglass.qml.replay import Replay
from rosglass.qml.ros2.ament_index import AmentIndex
from rosglass.qml.ros2.ros2 import Ros2
from rosglass.qml.service_server import ServiceServer
from rosglass.qml.subscription import Subscription
from rosglass.qml.synchronized_subscription import SynchronizedSubscription
from rosglass.qml.tf_broadcaster import TfBroadcaster
from rosglass.qml.tf_buffer import TfBuffer, TfTransformListener
from rosglass.qml.tf_transform import TfTransform

__all__ = ["NATIVE", "TYPES"]

#: Bases of the module's singletons (``imports/Ros2/*.qml``), by their name in ``Ros2.Native``.
NATIVE = {
    "TfTransformListenerNative": TfTransformListener,
    "AmentIndexNative": AmentIndex,
    "Ros2ClockTypesNative": ClockTypes,
    "Ros2Native": Ros2,
    "ImageTransportManagerNative": ImageTransportManager,
}
#: What QML can write, by name.
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
