// Sends goals, waypoints and the robot's pose to its navigation, and follows what becomes of them; a
// part of MapView, which shows nothing by itself.
import QtQuick 2.15
import Ros2 1.0
import "fields.js" as Fields

QtObject {
    id: goals

    // The map, whose fixed frame the poses are in.
    property var scene: null
    property string ns
    // Names that override those that are found: of actions, or of the topics without a server.
    property string goalAction
    property string waypointsAction
    property string goalTopic
    property string poseTopic: "initialpose"

    // "", "goal" or "waypoints": what the robot is driving to.
    property string active: ""
    // Whether the server has been asked to cancel.
    property bool canceling: false
    // {x, y, yaw} in metres and radians: the goals that are driven to.
    property var poses: []
    // The number of waypoints that are behind the robot.
    property int reached: 0
    // Metres left to drive; NaN while unknown.
    property real distance: NaN
    // What became of the last goal, in words; whether that is bad.
    property string status: ""
    property bool failed: false

    property var handle_: null
    property var publishers_: ({})
    property int number_: 0
    property bool accepted_: false
    property string action_: ""
    // While it runs, feedback does not replace the reason of a refusal.
    property Timer reading_: Timer { interval: 5000 }

    function pose_(pose) {
        return { position: { x: pose.x, y: pose.y, z: 0 },
                 orientation: { x: 0, y: 0, z: Math.sin(pose.yaw / 2), w: Math.cos(pose.yaw / 2) } }
    }
    function stamped_(pose) {
        return { header: { frame_id: scene.fixedFrame }, pose: pose_(pose) }
    }
    function publisher_(topic, type, qos) {
        const name = Fields.resolve(ns, topic)
        if (!publishers_[name])
            publishers_[name] = Ros2.createPublisher(name, type, qos)
        return publishers_[name]
    }
    function refuse_(why) {
        status = Fields.bounded(why)
        failed = true
        return false
    }
    function usable_(list) {
        if (!scene || !scene.fixedFrame)
            return refuse_(qsTr("not sent: the frame of the map is not known"))
        for (const pose of list)
            if (!isFinite(pose.x) || !isFinite(pose.y) || !isFinite(pose.yaw))
                return refuse_(Fields.fill(qsTr("not sent: %1, %2, %3 is not a pose"), [pose.x, pose.y, pose.yaw]))
        return true
    }

    // Advertise what will be published, so that subscribers are connected by then.
    function prepare(what) {
        if (what === "pose")
            publisher_(poseTopic, "geometry_msgs/msg/PoseWithCovarianceStamped")
        else if (what === "goal" && !(goalAction || scene.goalAction))
            publisher_(goalTopic || scene.goalTopic, "geometry_msgs/msg/PoseStamped", Ros2.CommandQoS())
    }
    // Drive to a pose.
    function send(x, y, yaw) {
        const pose = { x: x, y: y, yaw: yaw }
        if (!usable_([pose]))
            return false
        const action = goalAction || scene.goalAction
        if (!action)
            return publishGoal_(pose)
        const type = goalAction ? "" : scene.goalType
        const isMoveBase = type ? type.indexOf("MoveBase") >= 0 : /move_base/.test(action)
        return start_("goal", action, type, isMoveBase ? { target_pose: stamped_(pose) } : { pose: stamped_(pose) }, [pose])
    }
    // Drive to one pose after another.
    function sendWaypoints(list) {
        if (!list.length)
            return refuse_(qsTr("not sent: there are no waypoints"))
        if (!usable_(list))
            return false
        const action = waypointsAction || scene.waypointsAction
        if (!action)
            return refuse_(qsTr("not sent: no server of FollowWaypoints or NavigateThroughPoses"))
        return start_("waypoints", action, waypointsAction ? "" : scene.waypointsType, { poses: list.map(stamped_) }, list)
    }
    // Set where the localization sees the robot.
    function setPose(x, y, yaw) {
        const pose = { x: x, y: y, yaw: yaw }
        if (!usable_([pose]))
            return false
        // RViz's standard deviations: half a metre, and 15 degrees.
        const covariance = new Array(36).fill(0)
        covariance[0] = covariance[7] = 0.25
        covariance[35] = 0.0685
        const publisher = publisher_(poseTopic, "geometry_msgs/msg/PoseWithCovarianceStamped")
        const sent = publisher.publish({ header: { frame_id: scene.fixedFrame },
                                         pose: { pose: pose_(pose), covariance: covariance } })
        status = sent ? qsTr("the pose was sent to %1").arg(scene.absolute(Fields.resolve(ns, poseTopic))) : qsTr("the pose was not sent: %1").arg(publisher.problem || qsTr("no connection"))
        failed = !sent
        return sent
    }
    function publishGoal_(pose) {
        const publisher = publisher_(goalTopic || scene.goalTopic, "geometry_msgs/msg/PoseStamped", Ros2.CommandQoS())
        const name = scene.absolute(Fields.resolve(ns, goalTopic || scene.goalTopic))
        if (scene.subscribers(name) === 0)
            return refuse_(qsTr("not sent: there is no navigation action, and %1 has no subscriber").arg(name))
        if (!publisher.publish(stamped_(pose)))
            return refuse_(qsTr("not sent: %1").arg(publisher.problem || qsTr("no connection")))
        poses = [pose]
        status = qsTr("the goal was sent to %1, which reports nothing back").arg(name)
        failed = false
        return true
    }
    function start_(what, action, type, goal, list) {
        // Servers end their goal for a new one, but not that of another server.
        if (active && handle_ && action_ !== action)
            handle_.cancel()
        action_ = action
        const number = ++number_
        const isCurrent = () => number === goals.number_
        const client = Ros2.createActionClient(action, type)
        status = qsTr("sending …")
        failed = canceling = accepted_ = false
        distance = NaN
        reached = 0
        poses = list
        active = what
        reading_.stop()
        try {
            handle_ = client.sendGoalAsync(goal, {
                onGoalResponse: function(handle) {
                    if (!isCurrent())
                        return
                    goals.accepted_ = !!handle
                    if (handle)
                        goals.status = qsTr("accepted")
                },
                onFeedback: function(handle, feedback) {
                    if (isCurrent())
                        goals.follow_(feedback, client.actionType)
                },
                onResult: function(result) {
                    if (isCurrent())
                        goals.end_(result)
                }
            })
            handle_.cancelFailed.connect(function(reason) {
                if (isCurrent()) {
                    goals.canceling = false
                    goals.refuse_(qsTr("not cancelled: %1").arg(reason))
                    goals.reading_.restart()
                }
            })
        } catch (error) {
            active = ""
            poses = []
            return refuse_(qsTr("not sent: %1").arg(error.message))
        }
        return true
    }
    function follow_(feedback, type) {
        if (!active)
            return
        // Reading a field that a type does not have is logged.
        if (/NavigateToPose|NavigateThroughPoses/.test(type))
            distance = feedback.distance_remaining
        if (/MoveBase/.test(type) && poses.length === 1)
            distance = Math.hypot(feedback.base_position.pose.position.x - poses[0].x, feedback.base_position.pose.position.y - poses[0].y)
        if (/FollowWaypoints/.test(type))
            reached = feedback.current_waypoint
        if (/NavigateThroughPoses/.test(type))
            reached = Math.max(0, poses.length - feedback.number_of_poses_remaining)
        if (canceling || reading_.running)
            return
        const parts = []
        if (active === "waypoints")
            parts.push(Fields.fill(qsTr("waypoint %1 of %2"), [Math.min(reached + 1, poses.length), poses.length]))
        parts.push(isFinite(distance) ? qsTr("%1 m left").arg(distance.toFixed(1)) : qsTr("driving"))
        status = parts.join(", ")
        failed = false
    }
    function end_(result) {
        const has = name => result.result && Object.keys(result.result).indexOf(name) >= 0
        const missed = has("missed_waypoints") ? result.result.missed_waypoints.length : 0
        const reason = result.reason || (has("error_msg") ? result.result.error_msg : "")
        status = result.code === ActionGoalStatus.Succeeded && missed ? qsTr("reached, without %1 of the waypoints").arg(missed)
             : result.code === ActionGoalStatus.Succeeded ? qsTr("reached")
             : result.code === ActionGoalStatus.Canceled ? qsTr("cancelled")
             : result.code === ActionGoalStatus.Aborted && !accepted_ ? qsTr("refused: %1").arg(reason)
             : result.code === ActionGoalStatus.Aborted ? (reason ? qsTr("not reached: %1").arg(reason) : qsTr("not reached"))
             : qsTr("outcome unknown: %1").arg(reason)
        status = Fields.bounded(status)
        failed = result.code !== ActionGoalStatus.Succeeded && result.code !== ActionGoalStatus.Canceled || missed > 0
        active = ""
        canceling = false
        handle_ = null
        poses = []
        distance = NaN
    }
    // Follow the goal no longer: it is another robot's.
    function leave_() {
        ++number_
        status = active ? qsTr("the goal of the other robot goes on") : ""
        failed = active !== ""
        active = ""
        canceling = false
        handle_ = null
        poses = []
        distance = NaN
    }
    // Ask the server to end what it does.
    function cancel() {
        if (!active || !handle_)
            return false
        canceling = true
        status = qsTr("cancelling …")
        handle_.cancel()
        return true
    }
}
