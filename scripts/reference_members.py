"""The members of the reference plugins' types, and how ours differ where they do.

Reference: qml_ros_plugin 1.0.0 (``Ros``), qml_ros2_plugin 2.26.30 and qml6_ros2_plugin 4.26.42
(``Ros2``), and the servers of the latter's main branch; their public QML interfaces.
"""

from __future__ import annotations

__all__ = ["NOTES", "REFERENCE"]

_TF = "canTransform lookUpTransform"
_FRAMES = "getFrameAuthority getFrame getAllFrames getTransformAge"
_IMAGE = (
    "topic defaultTransport subscribed networkLatency processingLatency latency framerate timeout "
    "enabled"
)
#: Members by module and type.
REFERENCE = {
    "Ros": {
        "Ros": "console package io debug info warn error fatal isInitialized init ok spinOnce "
        "setThreads getName getNamespace queryTopics queryTopicInfo queryTopicType "
        "createEmptyMessage createEmptyServiceRequest waitForMessageAsync getEnvironmentVariable "
        "logInternal advertise subscribe createActionClient initialized shutdown",
        "Console": "defaultName setLoggerLevel",
        "Package": "command getPath getAll getPlugins",
        "IO": "writeYaml readYaml",
        "Publisher": "type topic isLatched queueSize isAdvertised getNumSubscribers publish "
        "advertised connected disconnected",
        "Subscriber": "topic queueSize ns message messageType throttleRate running "
        "getNumPublishers newMessage",
        "Service": "call callAsync",
        "ActionClient": "connected actionType isServerConnected sendGoal cancelAllGoals "
        "cancelGoalsAtAndBeforeTime",
        "GoalHandle": "expired terminalState commState cancel resend getResult",
        "TfTransformListener": f"{_TF} transformChanged",
        "TfTransform": "sourceFrame targetFrame enabled active transform message translation "
        "rotation rate valid",
        "Time": "now create isSimTime isSystemTime isValid",
        "WallTime": "now create",
        "ImageTransportSubscriber": f"videoSurface throttleRate playbackState play pause stop "
        f"{_IMAGE}",
        "RosInitOptions": "NoSigintHandler AnonymousName NoRosout",
        "RosConsoleLevels": "Debug Info Warn Error Fatal Count",
        "ActionCommStates": "WAITING_FOR_GOAL_ACK PENDING ACTIVE WAITING_FOR_RESULT "
        "WAITING_FOR_CANCEL_ACK RECALLING PREEMPTING DONE",
        "ActionTerminalStates": "RECALLED REJECTED PREEMPTED ABORTED SUCCEEDED LOST UNKNOWN",
    },
    "Ros2": {
        "Ros2": "hostname io debug info warn error fatal createInitOptions QoS BestAvailableQoS "
        "ClockQoS SensorDataQoS ServicesQoS SystemDefaultsQoS init shutdown isInitialized ok "
        "getName getNamespace now isValidTopic queryTopics queryTopicInfo queryTopicTypes "
        "getTopicTypes getTopicNamesAndTypes queryServices getServiceNamesAndTypes "
        "getServiceTypes queryActions getActionNamesAndTypes getActionTypes createEmptyMessage "
        "createEmptyServiceRequest createEmptyActionGoal getLogger createPublisher "
        "createSubscription createServiceClient createActionClient initialized aboutToShutdown",
        "Logger": "debug info warn error fatal setLoggerLevel",
        "IO": "writeYaml readYaml",
        "Publisher": "type topic queueSize qos isAdvertised advertised getSubscriptionCount "
        "publish",
        "Subscription": "topic queueSize qos message messageType throttleRate enabled subscribed "
        "frequency bandwidth getPublisherCount newMessage",
        "ServiceClient": "ready serviceReadyChanged name type connectionTimeout pendingRequests "
        "sendRequestAsync",
        "ActionClient": "ready serverReadyChanged name type actionType connectionTimeout "
        "isServerReady sendGoalAsync cancelAllGoals cancelGoalsBefore",
        "GoalHandle": "status goalId goalStamp isActive cancel",
        "ServiceServer": "name type qos processRequest advertised sendResponse",
        "ActionServer": "name type handleGoal handleCancel advertised goalAccepted",
        "ActionServerGoalHandle": "goal goalId isCanceling isActive isExecuting succeed abort "
        "canceled publishFeedback cancelRequested terminated",
        "TfTransformListener": f"initialize {_TF} {_FRAMES}",
        "TfBuffer": f"ns clear {_TF} {_FRAMES}",
        "TfTransform": "sourceFrame targetFrame enabled transform message translation rotation "
        "rate valid buffer",
        "AmentIndex": "getPackageShareDirectory getPackagePrefix getPackages",
        "MessageItemModel": "message messageType modified",
        "ImageTransportSubscription": f"videoSink videoSurface encoding hasAlpha isColor {_IMAGE}",
        "Ros2LoggerLevel": "Unset Debug Info Warn Error Fatal",
        "ActionGoalStatus": "Unknown Accepted Executing Canceling Succeeded Canceled Aborted",
        "Ros2ClockTypes": "Uninitialized Ros System Steady",
    },
}

_THROWS = "a value that does not fit throws a JavaScript Error with the field's path"
_HELD = "messages published right after creation are queued until subscribers connect"
_LOST = "false again when the server is lost"
#: Verdict and reason where it is not plainly the same, or new.
NOTES = {
    ("Ros", "Ros", "spinOnce"): ("different", "no effect: callbacks need no spinning"),
    ("Ros", "Ros", "setThreads"): ("different", "no effect: receiving has its own threads"),
    ("Ros", "Ros", "init"): (
        "better",
        "`initialized` is emitted once `isInitialized()` is true; works again after a shutdown",
    ),
    ("Ros", "Ros", "advertise"): (
        "better",
        "invalid arguments throw; type and queue size are required",
    ),
    ("Ros", "Ros", "waitForMessageAsync"): ("better", "also latched messages; or a promise"),
    ("Ros", "Publisher", "publish"): ("better", f"{_HELD}; {_THROWS}"),
    ("Ros", "Ros", "shutdown"): ("better", "`rosnode kill` also ends `rosglass run`, with code 1"),
    ("Ros", "Subscriber", "throttleRate"): ("better", "0 delivers every message"),
    ("Ros", "Subscriber", "running"): ("better", "false unsubscribes"),
    ("Ros", "Subscriber", "messageType"): ("better", "writable"),
    ("Ros", "Service", "call"): (
        "better",
        "the interface stays responsive; waits up to 5 s for a server",
    ),
    ("Ros", "Service", "callAsync"): ("better", "calls the callback for unknown types, too"),
    ("Ros", "Console", "setLoggerLevel"): ("same", ""),
    ("Ros", "TfTransform", "rate"): ("better", "0 means no limit, as documented"),
    ("Ros", "TfTransform", "valid"): ("better", "`message` changes before `validChanged`"),
    ("Ros", "TfTransform", "rotation"): ("better", "the identity while unknown"),
    ("Ros", "ActionClient", "connected"): ("better", _LOST),
    ("Ros", "ImageTransportSubscriber", "pause"): ("better", "really pauses"),
    ("Ros2", "Publisher", "publish"): ("better", f"{_HELD}; {_THROWS}"),
    ("Ros2", "Publisher", "isAdvertised"): ("better", "false after a shutdown, true after init"),
    ("Ros2", "Subscription", "enabled"): ("better", "false unsubscribes"),
    ("Ros2", "Subscription", "queueSize"): ("better", "its change signal is emitted"),
    ("Ros2", "Subscription", "messageType"): ("better", "several types are reported, not guessed"),
    ("Ros2", "Ros2", "SystemDefaultsQoS"): (
        "different",
        "always reliable, volatile, keep last 10; in R2 the defaults of the middleware in use",
    ),
    ("Ros2", "ServiceClient", "ready"): ("better", _LOST),
    ("Ros2", "ServiceClient", "sendRequestAsync"): (
        "better",
        f"the callback is optional; {_THROWS}",
    ),
    ("Ros", "ActionClient", "sendGoal"): ("better", f"waits for a server; {_THROWS}"),
    ("Ros2", "ActionClient", "sendGoalAsync"): ("better", f"waits for a server; {_THROWS}"),
    ("Ros2", "Ros2", "createPublisher"): ("better", "invalid arguments throw"),
    ("Ros2", "Ros2", "createSubscription"): ("better", "invalid arguments throw"),
    ("Ros2", "Ros2", "getLogger"): ("better", "also before init"),
    ("Ros2", "ActionClient", "ready"): ("better", _LOST),
    ("Ros2", "ServiceServer", "processRequest"): (
        "better",
        "or a promise; without it, or if it fails, clients are answered at once",
    ),
    ("Ros2", "ServiceServer", "sendResponse"): ("better", _THROWS),
    ("Ros2", "ServiceServer", "advertised"): ("better", "true again after a shutdown and init"),
    ("Ros2", "ActionServer", "goalAccepted"): (
        "better",
        "a goal whose handler throws, or is missing, is aborted at once",
    ),
    ("Ros2", "ActionServerGoalHandle", "goalId"): (
        "better",
        "as in ROS 2's tools, with the digits in order",
    ),
    ("Ros2", "GoalHandle", "goalId"): ("better", "as in ROS 2's tools, with the digits in order"),
    ("Ros2", "Ros2", "queryServices"): ("better", "hides the services of actions"),
    ("Ros2", "Ros2", "init"): (
        "better",
        "every ROS argument; elements work again after a shutdown",
    ),
    ("Ros2", "TfTransform", "valid"): ("better", "recovers with an unchanged stamp, too"),
    ("Ros2", "ImageTransportSubscription", "videoSurface"): ("same", "Qt 5"),
    ("Ros2", "ImageTransportSubscription", "videoSink"): ("same", "Qt 6; an ImageItem, too"),
}
