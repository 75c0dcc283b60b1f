// The map with costmaps, the robot, its track, scans, paths and particles; goals, waypoints and the
// robot's pose are set by dragging.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: view

    // The map; without one, the first nav_msgs/OccupancyGrid without "costmap" in its name.
    property string topic
    property string ns
    // Further topics; "*" for those that are found by their type, [] for none.
    property var costmaps: ["*"]
    property var scans: ["*"]
    property var paths: ["*"]
    property var footprints: ["*"]
    property var particles: ["*"]
    // The fixed frame; without one, that of the map.
    property string frame
    // The robot's frame.
    property string robotFrame: "base_link"
    // Namespace of the topics tf and tf_static, where they are not global.
    property string tfNs
    // Colours of the map: "theme", "map" as in RViz, "costmap", "raw".
    property string colorScheme: "theme"
    // Whether the robot stays in the middle.
    property bool follow: false
    // Whether the robot is seen heading up.
    property bool headingUp: false
    // Whether the robot's track is drawn.
    property bool track: true
    // Whether the buttons are shown; without them it is an image that can be moved.
    property bool tools: true
    // What a drag does: "" moves the map, "goal", "waypoints", "pose".
    property string tool: ""
    // Names of actions and topics, where they are not found: see MapGoals.
    property alias goalAction: goals_.goalAction
    property alias waypointsAction: goals_.waypointsAction
    property alias goalTopic: goals_.goalTopic
    property alias poseTopic: goals_.poseTopic

    readonly property QtObject scene: scene_
    readonly property QtObject camera: camera_
    readonly property QtObject goals: goals_
    // Metres driven since the track began.
    readonly property real driven: scene_.driven
    // {x, y, yaw} in metres and radians: waypoints that are not sent yet.
    property var waypoints: []

    // A click, in metres.
    signal clicked(real x, real y)

    // Show the whole map.
    function fit() {
        const box = scene_.bounds()
        if (box.width > 0) {
            follow = false
            camera_.fit(box.x, box.y, box.x + box.width, box.y + box.height)
            fitted_ = true
        }
    }
    function zoomBy(factor) {
        camera_.zoomBy(factor, plane.width / 2, plane.height / 2)
    }
    function sendWaypoints() {
        if (goals_.sendWaypoints(waypoints))
            tool = ""
    }

    property bool fitted_: false

    function place_(x, y, yaw) {
        const what = tool
        if (what === "waypoints") {
            if (waypoints.length < 100)
                waypoints = waypoints.concat([{ x: x, y: y, yaw: yaw }])
            else
                goals_.refuse_(qsTr("there are 100 waypoints already"))
            return
        }
        tool = ""
        if (what === "goal")
            goals_.send(x, y, yaw)
        else if (what === "pose")
            goals_.setPose(x, y, yaw)
    }
    function lookAtRobot_() {
        if (!scene_.robotSeen || !follow)
            return
        if (headingUp)
            camera_.rotation = Math.PI / 2 - scene_.robotYaw
        camera_.lookAt(scene_.robotX, scene_.robotY)
    }
    // The map was moved by hand.
    function leave_() {
        follow = false
        fitted_ = true
    }
    // The first view of a robot that is followed: as large as the map, but not from too far.
    function fitAround_() {
        const box = scene_.bounds(), most = 30
        if (!(box.width > 0))
            return
        fitted_ = true
        camera_.fit(box.x, box.y, box.x + box.width, box.y + box.height)
        if (camera_.span > most)
            camera_.zoomBy(camera_.span / most, plane.width / 2, plane.height / 2)
        lookAtRobot_()
    }
    function fitOnce_() {
        if (fitted_ || !(plane.width > 0 && plane.height > 0))
            return
        if (scene_.hasMap && follow)
            fitAround_()
        else if (scene_.hasMap)
            fit()
        else if (scene_.robotSeen)
            camera_.lookAt(scene_.robotX, scene_.robotY)
    }

    title: qsTr("Map")
    stale: scene_.stale
    age: scene_.age
    problem: scene_.problem
    note: scene_.robotSeen && track ? qsTr("%1 m driven").arg(scene_.driven.toFixed(1)) : ""
    contentWidth: 320 * Theme.size
    contentHeight: 240 * Theme.size
    onNsChanged: {
        tool = ""
        fitted_ = false
        goals_.leave_()
    }
    onFollowChanged: lookAtRobot_()
    onHeadingUpChanged: lookAtRobot_()
    onToolChanged: {
        bar.open = false
        if (tool) {
            // What became of the last goal has been read.
            if (!goals_.active) {
                goals_.status = ""
                goals_.failed = false
            }
            goals_.prepare(tool)
        }
        else
            waypoints = []
    }

    MapCamera {
        id: camera_
        width: plane.width
        height: plane.height
        onChanged: view.fitOnce_()
    }
    MapScene {
        id: scene_
        topic: view.topic
        ns: view.ns
        costmaps: view.costmaps
        scans: view.scans
        paths: view.paths
        footprints: view.footprints
        particles: view.particles
        frame: view.frame
        robotFrame: view.robotFrame
        tfNs: view.tfNs
        camera: camera_
        colorScheme: view.colorScheme
        freeColor: Theme.mapFree
        occupiedColor: Theme.mapOccupied
        onRobotMoved: view.lookAtRobot_()
        onRepaint: view.fitOnce_()
    }
    MapGoals {
        id: goals_
        scene: scene_
        ns: view.ns
    }

    MapPlane {
        id: plane
        objectName: "plane"
        anchors.fill: parent
        camera: camera_
        aims: view.tool !== ""
        from: scene_.robotSeen ? { x: scene_.robotX, y: scene_.robotY } : null
        centered: view.follow
        Accessible.name: view.title
        Accessible.description: view.status || view.note
        onMoved: view.leave_()
        onPosed: function(x, y, yaw) { view.place_(x, y, yaw) }
        onClicked: function(x, y) {
            // What became of a goal has been read.
            if (!goals_.active)
                goals_.status = ""
            view.clicked(x, y)
        }
        onHomeKey: view.fit()
        onFollowKey: view.follow = !view.follow
        onEscapeKey: view.tool = ""

        Repeater {
            model: scene_.layers
            MapTiles {
                source: modelData.tiles || null
                opacity: !modelData.opacity ? 0 : modelData.stale ? modelData.opacity * 0.35 : modelData.opacity
            }
        }
        MapMarks {
            objectName: "marks"
            anchors.fill: parent
            scene: scene_
            track: view.track
            scanColor: Theme.bad
            pathColor: Theme.good
            footprintColor: Theme.warn
            particleColor: Theme.accent
            trackColor: Theme.accent
        }
        Repeater {
            model: goals_.poses.concat(view.waypoints).concat(plane.draft ? [plane.draft] : [])
            MapMark {
                camera: camera_
                pose: modelData
                label: goals_.poses.length + view.waypoints.length > 1 ? index + 1 : ""
                color: index < goals_.poses.length ? (index < goals_.reached ? Theme.faint : Theme.good) : Theme.accent
            }
        }
        MapMark {
            objectName: "robot"
            camera: camera_
            visible: scene_.robotSeen
            pose: ({ x: scene_.robotX, y: scene_.robotY, yaw: scene_.robotYaw })
            color: scene_.robotKnown ? Theme.warn : Theme.bad
        }

        ThemeText {
            anchors { left: parent.left; bottom: parent.bottom; margins: Theme.gap / 2 }
            width: Math.min(implicitWidth, parent.width / 2)
            visible: plane.hovered
            text: plane.hovered ? scene_.describe(plane.at.x, plane.at.y) : ""
            color: Theme.dim
            font.pixelSize: Theme.small
        }
        MapScale {
            anchors { right: parent.right; bottom: parent.bottom; margins: Theme.gap / 2 }
            pixelsPerMetre: camera_.scale
            longest: Math.min(120 * Theme.size, parent.width / 3)
        }
    }
    MapTools {
        id: bar
        view: plane
        shown: view.tools
        visible: view.tools || goals_.active !== ""
        anchors { left: parent.left; right: parent.right; top: parent.top; margins: Theme.gap / 2 }

        MapButton { objectName: "fit"; visible: bar.unfolded; text: qsTr("Fit"); onClicked: { bar.open = false; view.fit() } }
        MapButton {
            visible: bar.unfolded
            text: qsTr("Follow")
            checkable: true
            checked: view.follow
            onClicked: view.follow = !view.follow
        }
        MapButton {
            objectName: "goal"
            visible: bar.unfolded
            text: qsTr("Goal")
            checkable: true
            checked: view.tool === "goal"
            onClicked: view.tool = view.tool === "goal" ? "" : "goal"
        }
        MapButton {
            objectName: "waypoints"
            visible: bar.unfolded
            text: qsTr("Waypoints")
            checkable: true
            checked: view.tool === "waypoints"
            onClicked: view.tool = view.tool === "waypoints" ? "" : "waypoints"
        }
        MapButton {
            objectName: "sendWaypoints"
            visible: view.waypoints.length > 0
            text: qsTr("Drive %1").arg(view.waypoints.length)
            tint: Theme.good
            onClicked: view.sendWaypoints()
        }
        MapButton {
            objectName: "pose"
            visible: bar.unfolded
            text: qsTr("Pose")
            checkable: true
            checked: view.tool === "pose"
            onClicked: view.tool = view.tool === "pose" ? "" : "pose"
        }
        MapButton {
            id: layersButton
            objectName: "layers"
            visible: bar.unfolded && scene_.layers.length > 1
            text: qsTr("Layers")
            checkable: true
        }
        MapButton {
            objectName: "cancel"
            visible: goals_.active !== ""
            text: qsTr("Cancel goal")
            tint: Theme.bad
            enabled: !goals_.canceling
            onClicked: goals_.cancel()
        }
    }
    Rectangle {
        anchors { left: parent.left; top: bar.visible ? bar.bottom : parent.top; topMargin: Theme.gap / 2; leftMargin: Theme.gap / 2 }
        visible: message.text !== ""
        width: message.width + Theme.gap
        height: message.height + Theme.gap / 2
        radius: Theme.radius / 2
        color: Theme.shade

        ThemeText {
            id: message
            objectName: "message"
            anchors.centerIn: parent
            width: Math.min(implicitWidth, plane.width - 2 * Theme.gap)
            text: view.tool && goals_.failed ? goals_.status
                : view.tool === "goal" ? qsTr("press at the goal, drag to its heading")
                : view.tool === "pose" ? qsTr("press where the robot is, drag to its heading")
                : view.tool === "waypoints" ? qsTr("press and drag for each waypoint")
                : goals_.status ? qsTr("Goal: %1").arg(goals_.status) : ""
            color: goals_.failed ? Theme.bad : Theme.text
            font.pixelSize: Theme.small
        }
    }
    Rectangle {
        anchors { right: parent.right; top: bar.visible ? bar.bottom : parent.top; topMargin: Theme.gap / 2; rightMargin: Theme.gap / 2 }
        visible: layersButton.visible && layersButton.checked
        width: Math.min(260 * Theme.size, plane.width - Theme.gap)
        height: Math.min(list.contentHeight + Theme.gap, plane.height - y - Theme.gap)
        radius: Theme.radius / 2
        color: Theme.shade

        ListView {
            id: list
            objectName: "list"
            anchors { fill: parent; margins: Theme.gap / 2 }
            clip: true
            model: scene_.layers
            delegate: Column {
                width: list.width

                ThemeSwitch {
                    width: parent.width
                    text: modelData.topic
                    checked: modelData.shown
                    onClicked: modelData.shown = checked
                }
                ThemeText {
                    width: parent.width
                    visible: text !== ""
                    text: modelData.shown ? modelData.problem : ""
                    color: modelData.stale ? Theme.bad : Theme.warn
                    font.pixelSize: Theme.small
                    wrapMode: Text.Wrap
                    maximumLineCount: 3
                }
            }
            footer: ThemeText {
                width: list.width
                visible: scene_.more > 0
                height: visible ? implicitHeight : 0
                text: qsTr("%1 more topics; name those to show").arg(scene_.more)
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
    }
}
