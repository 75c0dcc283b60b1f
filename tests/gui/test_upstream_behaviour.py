"""Members that ``docs/compatibility.md`` calls "same" behave as the reference plugins' do.

Each one has an expression here with what the plugins answer, by their documentation and headers, or
names the test that shows it with a real robot.
"""
# ruff: noqa: ISC004, SIM905 - tables

from __future__ import annotations

import json
import socket
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from rosglass.comm import QoS, Time
from rosglass.tf import StaticTransformBroadcaster, Transform, TransformBroadcaster

HERE = Path(__file__).parent
HOST = socket.gethostname().partition(".")[0]

#: Enumerations, with the numbers of ROS's headers.
NUMBERS = {
    ("Ros", "ActionCommStates"): "WAITING_FOR_GOAL_ACK PENDING ACTIVE WAITING_FOR_RESULT "
    "WAITING_FOR_CANCEL_ACK RECALLING PREEMPTING DONE",
    ("Ros", "ActionTerminalStates"): "RECALLED REJECTED PREEMPTED ABORTED SUCCEEDED LOST UNKNOWN",
    ("Ros", "RosConsoleLevels"): "Debug Info Warn Error Fatal Count",
    ("Ros", "RosInitOptions"): {"NoSigintHandler": 1, "AnonymousName": 2, "NoRosout": 4},
    ("Ros2", "ActionGoalStatus"): "Unknown Accepted Executing Canceling Succeeded Canceled Aborted",
    ("Ros2", "Ros2LoggerLevel"): dict(
        zip("Unset Debug Info Warn Error Fatal".split(), range(0, 60, 10), strict=True)
    ),
    ("Ros2", "Ros2ClockTypes"): "Uninitialized Ros System Steady",
}

#: Objects that expressions refer to, by module; `robot` publishes the rest.
SCENES = {
    "Ros": """
        property var pub: Ros.advertise("std_msgs/String", "out", 7)
        property var latched: Ros.advertise("left", "std_msgs/String", "mode", 1, true)
        property var made: Ros.subscribe("/chat", 3)
        property Subscriber sub: Subscriber { topic: "chat"; ns: "/" }
        property Subscriber far: Subscriber { topic: "chat"; ns: "far" }
        property TfTransform tf: TfTransform { sourceFrame: "base"; targetFrame: "map" }
        property TfTransform off: TfTransform {
            sourceFrame: "base"; targetFrame: "map"; enabled: false
        }
        property ImageTransportSubscriber image: ImageTransportSubscriber { topic: "camera" }
        property var client: Ros.createActionClient("actionlib_tutorials/FibonacciAction", "count")
        function set(name, value) { root[name] = value; return "" }
    """,
    "Ros2": """
        property var pub: Ros2.createPublisher("out", "std_msgs/msg/String", 7)
        property var usual: Ros2.createPublisher("usual", "std_msgs/msg/String")
        property var made: Ros2.createSubscription("/chat", "std_msgs/msg/String", 3)
        property Subscription sub: Subscription { topic: "chat" }
        property Subscription never: Subscription { topic: "/never" }
        property TfTransform tf: TfTransform { sourceFrame: "base"; targetFrame: "map" }
        property TfTransform off: TfTransform {
            sourceFrame: "base"; targetFrame: "map"; enabled: false
        }
        property TfBuffer buffer: TfBuffer {}
        property TfTransform mine: TfTransform {
            sourceFrame: "base"; targetFrame: "map"; buffer: root.buffer
        }
        property ImageTransportSubscription image: ImageTransportSubscription { topic: "camera" }
        property var service: Ros2.createServiceClient("add", "example_interfaces/srv/AddTwoInts")
        property var client: Ros2.createActionClient("count", "example_interfaces/action/Fibonacci")
        property ServiceServer server: ServiceServer {
            name: "serve"; type: "std_srvs/srv/Trigger"; processRequest: () => ({success: true})
        }
        property ActionServer actions: ActionServer {
            name: "act"; type: "example_interfaces/action/Fibonacci"; onGoalAccepted: h => {}
        }
        property MessageItemModel model: MessageItemModel {}
        property int edits: 0
        function show(message) { model.message = message; return model.message }
    """,
}
Q = "[q.reliability, q.durability, q.history, q.depth()]"
IMAGE = {
    # Resolved once it is subscribed.
    "topic": ("image.topic", "camera"),
    "defaultTransport": ("image.defaultTransport", "compressed"),
    "enabled": ("image.enabled", True),
    "timeout": ("image.timeout", 3000),
    # Without an image.
    "framerate": ("image.framerate", 0),
    "latency": ("image.latency", -1),
    "networkLatency": ("image.networkLatency", -1),
    "processingLatency": ("image.processingLatency", -1),
    # Lazily: only with a sink.
    "subscribed": ("image.subscribed", False),
}
TF = {
    "sourceFrame": ("tf.sourceFrame", "base"),
    "targetFrame": ("tf.targetFrame", "map"),
    "transform": ("tf.transform.transform.translation.x", 2),
    "message": ("[tf.message.header.frame_id, tf.message.child_frame_id, tf.message.valid]",
                ["map", "base", True]),
    "translation": ("[tf.translation.x, off.translation.x]", [2, 0]),
    "enabled": ("[off.enabled, off.valid, off.message.valid]", [False, False, False]),
}  # fmt: skip
FRAMES = {
    "getFrameAuthority": ("['base', 'map', 'moon'].map(f => L.getFrameAuthority(f))",
                          ["/robot", "", ""]),
    "getFrame": ("""[L.getFrame('moon') === undefined, L.getFrame('map').parentId,
                     L.getFrame('base').parentId, L.getFrame('base').isStatic,
                     L.getFrame('arm').isStatic, L.getFrame('base').children,
                     L.getFrame('base').translation.x, L.getFrame('map').rotation.w]""",
                 [True, "", "map", False, True, ["arm"], 2, 1]),
    "getAllFrames": ("L.getAllFrames().map(f => f.frameId).sort()", ["arm", "base", "map"]),
    # Now minus the newest stamp, of static ones, too; the arm's is zero.
    "getTransformAge": ("""[L.getTransformAge('moon'), L.getTransformAge('map'),
                            L.getTransformAge('base') >= 0, L.getTransformAge('arm') > 1e9]""",
                        [-1, -1, True, True]),
    "canTransform": ("""[L.canTransform('map', 'base'), typeof L.canTransform('map', 'moon'),
                         L.canTransform('map', 'base', new Date(NaN)),
                         L.canTransform('map', new Date(NaN), 'base', new Date(NaN), 'map')]""",
                     [True, "string", True, True]),
    "lookUpTransform": ("""[L.lookUpTransform('map', 'base').valid,
                            L.lookUpTransform('map', 'base').transform.translation.x,
                            L.lookUpTransform('map', 'moon').valid,
                            L.lookUpTransform('map', 'moon').exception]""",
                        [True, 2, False, "LookupException"]),
}  # fmt: skip
LOG = dict.fromkeys(
    "debug error fatal info warn".split(), "test_logging.py::test_levels_and_places"
)
YAML = dict.fromkeys(("readYaml", "writeYaml"), "test_yaml_io.py::test_values_come_back")


def frames(where: str) -> dict[str, Any]:
    """Return what a buffer answers about frames."""
    return {
        name: (text.replace("L.", where + "."), found) for name, (text, found) in FRAMES.items()
    }


#: An expression and its value, or the test, by module, type and member.
SAME: dict[tuple[str, str], dict[str, Any]] = {
    ("Ros", "Ros"): {
        **LOG,
        "console": ("Ros.console.defaultName", "ros.qml_ros_plugin"),
        "package": ("typeof Ros.package.getPath", "function"),
        "io": ("typeof Ros.io.readYaml", "function"),
        "isInitialized": ("Ros.isInitialized()", True),
        "ok": ("Ros.ok()", True),
        "initialized": "test_ros1_module.py::test_init",
        # As ros::this_node.
        "getName": ("Ros.getName()", "/ui"),
        "getNamespace": ("Ros.getNamespace()", "/"),
        "queryTopics": ("[Ros.queryTopics().includes('/chat'), Ros.queryTopics('std_msgs/Bool'),"
                        " Ros.queryTopics('std_msgs/String').includes('/chat')]", [True, [], True]),
        "queryTopicInfo": ("Ros.queryTopicInfo().filter(t => t.name === '/chat')",
                           [{"name": "/chat", "datatype": "std_msgs/String"}]),
        "queryTopicType": ("[Ros.queryTopicType('/chat'), Ros.queryTopicType('/none')]",
                           ["std_msgs/String", ""]),
        "createEmptyMessage": ("[Ros.createEmptyMessage('geometry_msgs/Point'),"
                               " Ros.createEmptyMessage('no_msgs/None') === undefined]",
                               [{"x": 0, "y": 0, "z": 0}, True]),
        "createEmptyServiceRequest": ("Ros.createEmptyServiceRequest('std_srvs/SetBool')",
                                      {"data": False}),
        "getEnvironmentVariable": ("[Ros.getEnvironmentVariable('NO_SUCH_VARIABLE'),"
                                   " Ros.getEnvironmentVariable('PATH') !== '']", ["", True]),
        "logInternal": "test_ros1_module.py::test_loggers",
        "subscribe": ("[made.topic, made.queueSize, made.message.data]", ["/chat", 3, "hello"]),
        "createActionClient": "test_ros1_actions.py::test_names_within_a_namespace",
    },
    ("Ros", "Console"): {
        "defaultName": ("Ros.console.defaultName", "ros.qml_ros_plugin"),
        "setLoggerLevel": (
            "Ros.console.setLoggerLevel(Ros.console.defaultName, RosConsoleLevels.Info)", True
        ),
    },
    ("Ros", "Package"): dict.fromkeys(
        "command getAll getPath getPlugins".split(), "test_ros1_module.py::test_packages"
    ),
    ("Ros", "IO"): YAML,
    ("Ros", "Publisher"): {
        "type": ("pub.type", "std_msgs/String"),
        "topic": ("[pub.topic, latched.topic]", ["/out", "/left/mode"]),
        "queueSize": ("pub.queueSize", 7),
        "isLatched": ("[pub.isLatched, latched.isLatched]", [False, True]),
        "isAdvertised": ("pub.isAdvertised", True),
        "getNumSubscribers": ("pub.getNumSubscribers()", 1),
        **dict.fromkeys(("advertised", "connected", "disconnected"),
                        "test_ros1_module.py::test_publishing"),
    },
    ("Ros", "Subscriber"): {
        "topic": ("[sub.topic, far.topic]", ["/chat", "/far/chat"]),
        "ns": ("far.ns", "/far"),
        "queueSize": ("sub.queueSize", 1),
        "message": ("[sub.message.data, far.message === undefined]", ["hello", True]),
        "getNumPublishers": ("[sub.getNumPublishers(), far.getNumPublishers()]", [1, 0]),
        "newMessage": "test_ros1_module.py::test_subscribing",
    },
    ("Ros", "ActionClient"): {
        "actionType": ("client.actionType", "actionlib_tutorials/FibonacciAction"),
        "isServerConnected": ("client.isServerConnected()", False),
        "sendGoal": "test_ros1_actions.py::test_a_goal",
        **dict.fromkeys(("cancelAllGoals", "cancelGoalsAtAndBeforeTime"),
                        "test_ros1_actions.py::test_cancelling"),
    },
    ("Ros", "GoalHandle"): {
        **dict.fromkeys(("commState", "terminalState", "getResult", "resend", "expired"),
                        "test_ros1_actions.py::test_a_goal"),
        "cancel": "test_ros1_actions.py::test_cancelling",
    },
    ("Ros", "ImageTransportSubscriber"): {
        **IMAGE,
        "throttleRate": ("image.throttleRate", 0),
        "playbackState": ("image.playbackState", 1),
        "videoSurface": "test_video_output.py::test_every_encoding_shows_the_right_colours",
        "play": "test_image_views.py::test_stop_takes_it_off_the_screen",
        "stop": "test_image_views.py::test_stop_takes_it_off_the_screen",
    },
    ("Ros", "TfTransform"): {**TF, "active": ("[tf.active, off.active]", [True, False])},
    ("Ros", "TfTransformListener"): {
        **{k: v for k, v in frames("TfTransformListener").items() if "Transform" in k},
        "transformChanged": "test_tf.py::test_changes_are_notified",
    },
    ("Ros", "Time"): {
        "now": ("Time.now().toSec() > 1e9", True),
        "create": ("[Time.create(1.5).nsec, Time.create(3, 4).sec, Time.create(3, 4).nsec]",
                   [500_000_000, 3, 4]),
        "isSimTime": ("Time.isSimTime()", False),
        "isSystemTime": ("Time.isSystemTime()", True),
        "isValid": ("Time.isValid()", True),
    },
    ("Ros", "WallTime"): {
        "now": ("WallTime.now().toSec() > 1e9", True),
        "create": ("[WallTime.create(1.5).nsec, WallTime.create(3, 4).sec]", [500_000_000, 3]),
    },
    ("Ros2", "Ros2"): {
        **LOG,
        "hostname": ("Ros2.hostname.split('.')[0]", HOST),
        "io": ("typeof Ros2.io.readYaml", "function"),
        "createInitOptions": ("""(o => [typeof o.setNamespace, typeof o.setDomainId,
                                       typeof o.useDefaultDomainId])(Ros2.createInitOptions())""",
                              ["function"] * 3),
        "QoS": (f"(q => {Q})(Ros2.QoS())", ["best_effort", "volatile", "keep_last", 1]),
        "BestAvailableQoS": (f"(q => {Q})(Ros2.BestAvailableQoS())",
                             ["best_available", "best_available", "keep_last", 10]),
        "ClockQoS": (f"(q => {Q})(Ros2.ClockQoS())", ["best_effort", "volatile", "keep_last", 1]),
        "SensorDataQoS": (f"(q => {Q})(Ros2.SensorDataQoS())",
                          ["best_effort", "volatile", "keep_last", 5]),
        "ServicesQoS": (f"(q => {Q})(Ros2.ServicesQoS())",
                        ["reliable", "volatile", "keep_last", 10]),
        "isInitialized": ("Ros2.isInitialized()", True),
        "ok": ("Ros2.ok()", True),
        "initialized": "test_ros2.py::test_life",
        "aboutToShutdown": "test_ros2.py::test_life",
        "shutdown": "test_ros2.py::test_life",
        # As rclcpp's node: without its namespace.
        "getName": ("Ros2.getName()", "ui"),
        "getNamespace": ("Ros2.getNamespace()", "/"),
        "now": ("[Ros2.now().seconds() > 1e9, Ros2.now().clockType() == Ros2ClockTypes.Ros]",
                [True, True]),
        "isValidTopic": ("['/a/b', 'a', '~/a', '', 'a b', '/a//b', '1a']"
                         ".map(t => Ros2.isValidTopic(t))", [True] * 3 + [False] * 4),
        "queryTopics": ("[Ros2.queryTopics().includes('/chat'), Ros2.queryTopics('std_msgs/Int8'),"
                        " Ros2.queryTopics('std_msgs/String').includes('/chat'),"
                        " Ros2.queryTopics().filter(t => t.includes('/_action/'))]",
                        [True, [], True, []]),
        "queryTopicInfo": ("Ros2.queryTopicInfo().filter(t => t.name === '/chat')",
                           [{"name": "/chat", "datatypes": ["std_msgs/msg/String"]}]),
        "queryTopicTypes": ("[Ros2.queryTopicTypes('/chat'), Ros2.queryTopicTypes('/none')]",
                            [["std_msgs/msg/String"], []]),
        "getTopicTypes": ("Ros2.getTopicTypes('/chat')", ["std_msgs/msg/String"]),
        "getTopicNamesAndTypes": ("Ros2.getTopicNamesAndTypes()['/chat']", ["std_msgs/msg/String"]),
        "getServiceNamesAndTypes": ("Ros2.getServiceNamesAndTypes()['/serve']",
                                    ["std_srvs/srv/Trigger"]),
        "getServiceTypes": ("[Ros2.getServiceTypes('/serve'), Ros2.getServiceTypes('/none')]",
                            [["std_srvs/srv/Trigger"], []]),
        "getActionNamesAndTypes": ("Ros2.getActionNamesAndTypes()['/act']",
                                   ["example_interfaces/action/Fibonacci"]),
        "getActionTypes": ("[Ros2.getActionTypes('/act'), Ros2.getActionTypes('/none')]",
                           [["example_interfaces/action/Fibonacci"], []]),
        # As rcl: those that have a client only, too.
        "queryActions": ("[Ros2.queryActions(), Ros2.queryActions('example_interfaces/Fibonacci'),"
                         " Ros2.queryActions('a_msgs/action/Other')]",
                         [["/act", "/count"], ["/act", "/count"], []]),
        "createEmptyMessage": ("[Ros2.createEmptyMessage('geometry_msgs/msg/Point'),"
                               " Ros2.createEmptyMessage('no_msgs/msg/None') === undefined]",
                               [{"x": 0, "y": 0, "z": 0}, True]),
        "createEmptyServiceRequest": ("Ros2.createEmptyServiceRequest('std_srvs/SetBool')",
                                      {"data": False}),
        "createEmptyActionGoal": ("Ros2.createEmptyActionGoal('example_interfaces/Fibonacci')",
                                  {"order": 0}),
        "getLogger": ("[typeof Ros2.getLogger().info, typeof Ros2.getLogger('arm').warn]",
                      ["function"] * 2),
        "createPublisher": ("[pub, usual].map(p => [p.qos.reliability, p.queueSize])",
                            [["reliable", 7], ["reliable", 10]]),
        "createSubscription": ("[made.qos.reliability, made.queueSize, made.messageType]",
                               ["best_effort", 3, "std_msgs/msg/String"]),
        "createServiceClient": ("[service.name, service.type]",
                                ["add", "example_interfaces/srv/AddTwoInts"]),
        "createActionClient": ("[client.name, client.type]",
                               ["count", "example_interfaces/action/Fibonacci"]),
    },
    ("Ros2", "Logger"): {**LOG, "setLoggerLevel": "test_logging.py::test_levels_can_be_set"},
    ("Ros2", "IO"): YAML,
    ("Ros2", "Publisher"): {
        "type": ("pub.type", "std_msgs/msg/String"),
        "topic": ("pub.topic", "/out"),
        "queueSize": ("[pub.queueSize, usual.queueSize]", [7, 10]),
        "qos": (f"(q => {Q})(pub.qos)", ["reliable", "volatile", "keep_last", 7]),
        "advertised": "test_publisher.py::test_properties",
        "getSubscriptionCount": ("[pub, usual].map(p => p.getSubscriptionCount())", [1, 0]),
    },
    ("Ros2", "Subscription"): {
        "topic": ("sub.topic", "/chat"),
        "qos": (f"(q => {Q})(sub.qos)", ["best_effort", "volatile", "keep_last", 1]),
        "message": ("[sub.message.data, never.message === undefined]", ["hello", True]),
        "throttleRate": ("sub.throttleRate", 20),
        "subscribed": ("[sub.subscribed, never.subscribed]", [True, False]),
        "frequency": "test_subscription.py::test_frequency_and_bandwidth_follow_the_topic",
        "bandwidth": "test_subscription.py::test_frequency_and_bandwidth_follow_the_topic",
        "getPublisherCount": ("[sub.getPublisherCount(), never.getPublisherCount()]", [1, 0]),
        "newMessage": "test_subscription.py::test_type_is_discovered_and_signals_come_in_order",
    },
    ("Ros2", "ServiceClient"): {
        "name": ("service.name", "add"),
        "type": ("service.type", "example_interfaces/srv/AddTwoInts"),
        "connectionTimeout": ("service.connectionTimeout", 10_000),
        "pendingRequests": ("service.pendingRequests", 0),
        "serviceReadyChanged": "test_services.py::test_a_client",
    },
    ("Ros2", "ServiceServer"): {
        "name": ("server.name", "serve"),
        "type": ("server.type", "std_srvs/srv/Trigger"),
        "qos": (f"(q => {Q})(server.qos)", ["reliable", "volatile", "keep_last", 10]),
    },
    ("Ros2", "ActionServer"): {
        "name": ("actions.name", "act"),
        "type": ("actions.type", "example_interfaces/action/Fibonacci"),
        "advertised": ("actions.advertised", True),
        "handleGoal": "test_action_server.py::test_a_server_in_the_way_of_qml6_ros2_plugin",
        "handleCancel": "test_action_server.py::test_without_handle_cancel_a_cancel_is_refused",
    },
    ("Ros2", "ActionServerGoalHandle"): dict.fromkeys(
        (
            *("goal", "isActive", "isCanceling", "isExecuting", "abort", "cancelRequested"),
            *("canceled", "publishFeedback", "succeed", "terminated"),
        ),
        "test_action_server.py::test_a_server_in_the_way_of_qml6_ros2_plugin",
    ),
    ("Ros2", "ActionClient"): {
        "name": ("client.name", "count"),
        "type": ("client.type", "example_interfaces/action/Fibonacci"),
        "actionType": ("client.actionType", "example_interfaces/action/Fibonacci"),
        "connectionTimeout": ("client.connectionTimeout", 10_000),
        "isServerReady": ("client.isServerReady()", False),
        "sendGoalAsync": "test_action_client.py::test_a_goal",
        "serverReadyChanged": "test_action_client.py::test_a_goal",
        "cancelAllGoals": "test_action_client.py::test_cancelling_all",
        "cancelGoalsBefore": "test_action_client.py::test_cancelling_until_a_time",
    },
    ("Ros2", "GoalHandle"): {
        **dict.fromkeys(("status", "goalStamp", "isActive"), "test_action_client.py::test_a_goal"),
        "cancel": "test_action_client.py::test_cancelling",
    },
    ("Ros2", "TfTransform"): {
        **TF,
        "rotation": ("[tf.rotation.w, off.rotation.w]", [1, 1]),
        "rate": ("tf.rate", 62.5),
        "buffer": ("[mine.buffer === buffer, mine.translation.x, tf.buffer === null]",
                   [True, 2, True]),
    },
    ("Ros2", "TfTransformListener"): {
        **frames("TfTransformListener"),
        "initialize": ("TfTransformListener.initialize() === undefined", True),
    },
    ("Ros2", "TfBuffer"): {
        **frames("buffer"),
        "ns": ("buffer.ns", ""),
        "clear": "test_tf.py::test_namespaces_are_apart",
    },
    ("Ros2", "AmentIndex"): {
        **dict.fromkeys(("getPackagePrefix", "getPackageShareDirectory", "getPackages"),
                        "test_ros2.py::test_packages_of_install_spaces"),
    },
    ("Ros2", "MessageItemModel"): {
        # Missing fields get their defaults, and the type is the message's.
        "message": ("show({'#messageType': 'geometry_msgs/msg/Point', x: 1})",
                    {"x": 1, "y": 0, "z": 0}),
        "messageType": ("show({'#messageType': 'geometry_msgs/msg/Point'}) && model.messageType",
                        "geometry_msgs/msg/Point"),
        "modified": "test_message_item_model.py::test_leaves_can_be_edited",
    },
    ("Ros2", "ImageTransportSubscription"): {
        **IMAGE,
        "encoding": ("image.encoding", ""),
        "hasAlpha": ("image.hasAlpha", False),
        "isColor": "test_image_subscription.py::test_raw_images_are_shown",
        "videoSink": "test_image_subscription.py::test_raw_images_are_shown",
        "videoSurface": "test_video_output.py::test_every_encoding_shows_the_right_colours",
    },
}  # fmt: skip


@pytest.mark.both_qt
@pytest.mark.parametrize(("module", "type"), SAME, ids=lambda value: value)
def test_members_answer_as_in_the_reference(bench: Any, wait: Any, module: str, type: str) -> None:
    bench.module = f"{module} 1.0"
    root: Any = bench.load(
        "Item { id: root\n"
        + SCENES[module]
        + "function answer(code) { return JSON.stringify(eval(code)) }\n}",
        "import QtQuick 2.15",
    )
    robot = bench.robot
    moving, still = TransformBroadcaster(robot), StaticTransformBroadcaster(robot)
    still.send_transform(
        Transform((1.0, 0.0, 0.0), frame_id="base", child_frame_id="arm"),
    )
    robot.create_subscription("/out", "std_msgs/msg/String", print)
    chat = robot.create_publisher("/chat", "std_msgs/msg/String", QoS(10))
    bench.session.init("ui")
    wait(lambda: chat.subscription_count() >= 2)
    chat.publish(data="hello")
    moving.send_transform(
        Transform((2.0, 0.0, 0.0), stamp=Time.now(), frame_id="map", child_frame_id="base")
    )
    for member, entry in SAME[module, type].items():
        if isinstance(entry, str):
            continue
        code, expected = entry

        def answer(code: str = code) -> Any:
            text = root.answer(code)  # None if it throws, as long as there is no message
            return None if text is None else json.loads(text)

        wait(
            lambda expected=expected, answer=answer: answer() == expected,
            lambda member=member, answer=answer: f"{type}.{member}: {answer()}",
        )


@pytest.mark.both_qt
@pytest.mark.parametrize(("module", "type"), NUMBERS, ids=lambda value: value)
def test_enumerators_have_the_numbers_of_ros(bench: Any, module: str, type: str) -> None:
    names = NUMBERS[module, type]
    if isinstance(names, str):
        names = {name: number for number, name in enumerate(names.split())}
    bench.module = f"{module} 1.0"
    found = bench.run(f"return {json.dumps(list(names))}.map(name => Number({type}[name]))")
    assert found == list(names.values())


# PySide2 does not show a type's base.
@pytest.mark.skipif(find_spec("PySide6") is None, reason="the page is made with Qt 6")
def test_all_that_the_page_calls_same_is_here(app: Any) -> None:
    sys.path.insert(0, str(HERE.parents[1] / "scripts"))
    try:
        import compatibility
    finally:
        sys.path.pop(0)
    missing, tests = [], set()
    for module in ("Ros", "Ros2"):
        for name, kind in compatibility.types(module).items():
            reference = compatibility.REFERENCE[module].get(name, "").split()
            for member in compatibility.members(kind):
                known = "same" if member in reference else "new"
                verdict = compatibility.NOTES.get((module, name, member), (known, ""))[0]
                entry = SAME.get((module, name), {}).get(member)
                if verdict == "same" and entry is None and (module, name) not in NUMBERS:
                    missing.append(f"{module}: {name}.{member}")
                if isinstance(entry, str):
                    tests.add(entry)
    assert missing == []
    for place in sorted(tests):
        file, _, test = place.partition("::")
        assert f"def {test}(" in (HERE / file).read_text(), place
