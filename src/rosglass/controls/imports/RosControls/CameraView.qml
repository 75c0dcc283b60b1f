// A camera's image. An old, late or frozen image is never shown as live: it turns grey under a red frame that says what is
// wrong with it.
import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0
import "cameras.js" as Cameras
import "fields.js" as Fields

FocusScope {
    id: view

    // The camera's base topic, or that of a transport; without one, the first camera.
    property string topic
    property string ns
    // Name of the image transport, such as "raw", "compressed" or "ffmpeg".
    property alias transport: camera.defaultTransport
    // Text of the title.
    property string title: topic_
    // Whether it is received.
    property bool active: visible
    // Milliseconds after its arrival for which an image is live: at 30 images a second, losing fifteen is more than a hiccup.
    property int timeout: 500
    // Seconds of equal images after which a camera counts as frozen; 0 for never.
    property real frozenAfter: 3
    // Milliseconds from the robot's stamp to here beyond which an image is late, or the clocks too far apart to know.
    property real maxLatency: 1000
    // Why images may be missing altogether, such as a lost connection; shown with what is known here.
    property string problem
    // "fit", "crop" or "stretch".
    property string fillMode: "fit"
    // Degrees clockwise: 0, 90, 180 or 270.
    property int imageRotation: 0
    // Images per second at most; 0 for all.
    property alias maxRate: camera.throttleRate
    // Whether images are decoded in full, not in the size in which they are shown.
    property alias fullResolution: camera.fullResolution
    // Whether it has buttons, for snapshot, fill mode and rotation.
    property bool tools: true
    // Whether title, rate and latency are shown while it is live.
    property bool label: true
    // Folder of snapshots.
    property string folder: Ros2.getEnvironmentVariable("HOME") || "/tmp"

    // Topic to which dragging and the arrow keys send the camera's direction; empty for none.
    property string panTilt
    // sensor_msgs/JointState or geometry_msgs/Vector3 (angles), geometry_msgs/Twist (speeds); empty: that of the topic.
    property string panTiltType
    // Names of the joints, for JointState.
    property string panJoint: "pan"
    property string tiltJoint: "tilt"
    // The direction in radians, left and downwards positive; set it to where the camera is.
    property real pan: 0
    property real tilt: 0
    // Greatest angles to each side, in radians.
    property real maxPan: Math.PI
    property real maxTilt: Math.PI / 2
    // Radians across the image, for dragging.
    property real fieldOfView: 1
    // Greatest speed in radians per second, for Twist.
    property real maxTurnRate: 0.5

    readonly property bool live: fresh_ && !camera.stale && !late && !frozen
    readonly property bool stale: !live
    readonly property bool received: age >= 0
    // Seconds since the image arrived; -1 before the first.
    readonly property real age: camera.age
    readonly property bool late: fresh_ && Math.abs(latency) > maxLatency
    readonly property bool frozen: frozenAfter > 0 && fresh_ && camera.unchanged >= frozenAfter
    // Seconds during which images arrived that were all equal.
    readonly property real unchanged: camera.unchanged
    // Milliseconds from the robot's stamp to here; -1 while unknown.
    readonly property real latency: camera.latency
    // Images per second; -1 while unknown: it is a mean over some images, including an interruption among them.
    readonly property real framerate: settled_ ? camera.framerate : -1
    // Rectangle of the image, in this item's coordinates.
    readonly property rect imageRect: output.contentRect
    // Cameras that there are, by type.
    readonly property var cameras: Cameras.bases(finder.candidates)
    // What is wrong, in words; empty while it is live.
    readonly property string status: live ? "" : headline_ + ": " + detail_ + (received && unconnected_ ? "; " + unconnected_ : "")
    // The file of the last snapshot.
    readonly property string snapshotFile: file_

    // An image was shown.
    signal imageShown()
    signal snapshotSaved(string path)
    signal snapshotFailed(string reason)

    readonly property bool fresh_: age >= 0 && 1000 * age <= timeout
    readonly property string topic_: topic ? Fields.resolve(ns, topic) : found_
    // The camera found stays while it exists: another one that appears must not take its place.
    property string found_
    onCamerasChanged: keep_()
    function keep_() {
        if (cameras.length && cameras.indexOf(found_) < 0)
            found_ = cameras[0]
    }
    property bool settled_: false
    property string file_
    property string message_
    property bool isWrong_: false
    readonly property string unconnected_: Fields.unconnected(Ros2.connectionState, Ros2.connectionDetail)
    readonly property string headline_: frozen ? qsTr("IMAGE FROZEN") : !late ? qsTr("NO SIGNAL")
        : latency > 0 ? qsTr("IMAGE DELAYED") : qsTr("CLOCKS DIFFER")
    readonly property string detail_: frozen ? qsTr("images arrive, but have been equal for %1 s").arg(camera.unchanged.toFixed(0))
        : late ? qsTr("by %1 s").arg(Math.abs(latency / 1000).toFixed(1))
        : !received && unconnected_ ? unconnected_
        : !topic_ ? qsTr("no camera found")
        : !received ? qsTr("no image received yet")
        : qsTr("last image %1 s old").arg(age.toFixed(1))

    // Saves the image, in the camera's full resolution, to a new file in `folder`.
    function snapshot() {
        const name = (topic_.replace(/[^A-Za-z0-9]+/g, "_").replace(/^_+|_+$/g, "") || "camera").slice(0, 80)
        const time = new Date().toISOString().replace(/[:T]/g, "-").replace("Z", "")
        note_(qsTr("saving ..."), false)
        camera.saveSnapshot(folder.replace(/\/+$/, "") + "/" + name + "_" + time + ".png")
    }
    function note_(text, isWrong) {
        message_ = text
        isWrong_ = isWrong
    }
    // Shows the whole image, then its middle filling the item, then all of it stretched.
    function nextFillMode() { fillMode = fillMode === "fit" ? "crop" : fillMode === "crop" ? "stretch" : "fit" }
    // Turns the image by 90 degrees clockwise.
    function rotateImage() { imageRotation = (imageRotation + 90) % 360 }

    implicitWidth: 320 * Theme.size
    implicitHeight: 180 * Theme.size
    activeFocusOnTab: true
    Accessible.role: Accessible.Graphic
    Accessible.name: title || qsTr("Camera")
    Accessible.description: live ? qsTr("live") : status

    onLiveChanged: settled_ = false

    LiveTopic {
        id: finder
        enabled: false
        ns: view.ns
        types: Cameras.TYPES
    }
    ImageTransportSubscription {
        id: camera
        objectName: "cameraStream"
        topic: view.topic_
        enabled: view.active
        // The last image stays, so that the operator can see where the robot was; the frame says that it is old.
        timeout: 0
        rotation: [0, 90, 180, 270].indexOf(view.imageRotation) >= 0 ? view.imageRotation : 0
        onImageShown: view.imageShown()
        onSnapshotSaved: function(path) {
            view.file_ = path
            view.note_(qsTr("saved %1").arg(path), false)
            view.snapshotSaved(path)
        }
        onSnapshotFailed: function(reason) {
            view.note_(qsTr("NOT SAVED: %1").arg(Fields.bounded(reason)), true)
            view.snapshotFailed(reason)
        }
    }
    Timer {
        interval: 1200
        running: view.live && !view.settled_
        onTriggered: view.settled_ = true
    }
    Timer {
        interval: 8000
        running: view.message_ !== ""
        onTriggered: view.message_ = ""
    }

    VideoOutput {
        id: output
        objectName: "picture"
        anchors.fill: parent
        source: camera
        fillMode: Math.max(0, ["stretch", "fit", "crop"].indexOf(view.fillMode))
    }

    Rectangle {
        x: output.contentRect.x + Theme.gap
        y: output.contentRect.y + Theme.gap
        width: tag.width + 2 * Theme.gap
        height: Theme.small * 1.5 + Theme.gap
        radius: height / 2
        color: Theme.shade
        visible: view.label && view.live && output.contentRect.width > width / 2
        Row {
            id: tag
            anchors.centerIn: parent
            spacing: Theme.gap * 0.8
            readonly property real most: Math.max(1, output.contentRect.width - 4 * Theme.gap)
            Rectangle {
                anchors.verticalCenter: parent.verticalCenter
                width: Theme.small * 0.75; height: width; radius: width / 2
                color: Theme.bad
                SequentialAnimation on opacity {
                    running: view.live && view.label
                    loops: Animation.Infinite
                    PropertyAction { value: 1 }
                    PauseAnimation { duration: 700 }
                    PropertyAction { value: 0.25 }
                    PauseAnimation { duration: 500 }
                }
            }
            ThemeText {
                anchors.verticalCenter: parent.verticalCenter
                text: qsTr("LIVE")
                font { pixelSize: Theme.small; weight: Font.Bold; letterSpacing: 1 }
            }
            ThemeText {
                objectName: "label"
                anchors.verticalCenter: parent.verticalCenter
                width: Math.min(implicitWidth, tag.most - 5 * Theme.small)
                text: [Fields.bounded(view.title, 80),
                    view.framerate < 0 ? "" : qsTr("%1 Hz").arg(view.framerate.toFixed(0)),
                    view.latency < 0 ? "" : qsTr("%1 ms").arg(view.latency.toFixed(0))].filter(part => part !== "").join("   ")
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
    }

    // The image below this is not live and must not look live.
    Rectangle {
        objectName: "noSignal"
        anchors.fill: parent
        visible: !view.live
        // A veil, not a shader: one that has to be compiled first would come late.
        color: view.received ? Theme.shade : Theme.panel
        border { color: Theme.bad; width: Math.max(2, Math.min(6, view.width / 60)) }

        Rectangle {
            anchors.centerIn: parent
            width: Math.min(parent.width - 2 * Theme.gap, Math.max(banner.implicitWidth, 0) + 4 * Theme.gap)
            height: Math.min(parent.height - Theme.gap, banner.implicitHeight + 3 * Theme.gap)
            radius: Theme.radius
            color: Theme.panel
            border { color: Theme.bad; width: 2 }
            clip: true
            Column {
                id: banner
                anchors.centerIn: parent
                spacing: Theme.gap / 2
                readonly property real most: Math.max(1, view.width - 6 * Theme.gap)
                // In Qt 5, the implicit width of a wrapped text depends on its width.
                TextMetrics { id: detailSize; font: detail.font; text: detail.text }
                TextMetrics { id: reasonSize; font: reason.font; text: reason.text }
                ThemeText {
                    objectName: "headline"
                    anchors.horizontalCenter: parent.horizontalCenter
                    width: Math.min(implicitWidth, banner.most)
                    text: view.headline_
                    color: Theme.bad
                    font { pixelSize: Math.max(Theme.small, Math.min(3 * Theme.normal, view.width / 14)); weight: Font.Black }
                    SequentialAnimation on opacity {
                        running: !view.live && view.visible
                        loops: Animation.Infinite
                        PropertyAction { value: 1 }
                        PauseAnimation { duration: 600 }
                        PropertyAction { value: 0.45 }
                        PauseAnimation { duration: 300 }
                    }
                }
                ThemeText {
                    id: detail
                    objectName: "noSignalText"
                    anchors.horizontalCenter: parent.horizontalCenter
                    width: Math.min(Math.ceil(detailSize.advanceWidth) + 1, banner.most)
                    text: view.detail_
                    wrapMode: Text.Wrap
                    maximumLineCount: view.height > 120 * Theme.size ? 4 : 2
                    horizontalAlignment: Text.AlignHCenter
                    font.pixelSize: Math.min(Theme.large, Math.max(Theme.small, view.width / 20))
                }
                ThemeText {
                    id: reason
                    objectName: "reason"
                    anchors.horizontalCenter: parent.horizontalCenter
                    width: Math.min(Math.ceil(reasonSize.advanceWidth) + 1, banner.most)
                    visible: text !== "" && view.height > 120 * Theme.size
                    text: view.late ? qsTr("or the clocks of robot and operator differ by that much")
                        : Fields.bounded(view.problem || (view.received && view.unconnected_) || camera.problem)
                    color: Theme.dim
                    wrapMode: Text.Wrap
                    maximumLineCount: 6
                    horizontalAlignment: Text.AlignHCenter
                }
                ThemeText {
                    anchors.horizontalCenter: parent.horizontalCenter
                    width: Math.min(implicitWidth, banner.most)
                    text: Fields.bounded(view.title, 80)
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
            }
        }
    }

    // Pan and tilt.

    readonly property var panTypes_: ["sensor_msgs/msg/JointState", "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Twist"]
    readonly property string panTopic_: Fields.resolve(ns, panTilt)
    property string panFound_
    property var panPublisher_: null
    property real panRate_: 0
    property real tiltRate_: 0
    // Zeros that are still to be sent after letting go.
    property int zeros_: 0
    readonly property bool speeds_: panFound_ === panTypes_[2]
    readonly property string panProblem_: !panTilt || panPublisher_ ? ""
        : panTiltType ? qsTr("pan and tilt are not sent as %1").arg(Fields.bounded(panTiltType, 60))
        : qsTr("no camera listens to %1").arg(panTopic_)

    function findPanTilt_() {
        let type = ""
        if (panTilt) {
            const asked = panTiltType.indexOf("/msg/") > 0 || !panTiltType ? panTiltType : panTiltType.replace("/", "/msg/")
            const there = asked ? [asked] : Ros2.getTopicTypes(panTopic_)
            type = panTypes_.filter(one => there.indexOf(one) >= 0)[0] || ""
        }
        const key = type ? panTopic_ + " " + type : ""
        if (key === panKey_)
            return
        letGo_()
        panKey_ = key
        panFound_ = type
        panPublisher_ = null
        try {
            if (type)
                panPublisher_ = Ros2.createPublisher(panTopic_, type, Ros2.CommandQoS())
        } catch (error) {
            note_(Fields.bounded(error.message), true)
        }
    }
    property string panKey_
    property bool complete_: false
    onPanTopic_Changed: if (complete_) findPanTilt_()
    onPanTiltTypeChanged: if (complete_) findPanTilt_()
    Component.onCompleted: {
        complete_ = true
        keep_()
        findPanTilt_()
    }
    Connections {
        target: view.panTilt && !view.panFound_ ? Ros2 : null
        function onGraphChanged() { view.findPanTilt_() }
    }

    // Turns the camera by angles in radians, left and downwards positive.
    function aim(left, down) {
        if (!panPublisher_ || speeds_ || !isFinite(left) || !isFinite(down))
            return
        pan = Math.max(-maxPan, Math.min(maxPan, pan + left))
        tilt = Math.max(-maxTilt, Math.min(maxTilt, tilt + down))
        panPublisher_.publish(panFound_ === panTypes_[0]
            ? { header: { stamp: Ros2.now() }, name: [panJoint, tiltJoint], position: [pan, tilt] } : { x: 0, y: tilt, z: pan })
    }
    // Turns it at shares of maxTurnRate, -1 to 1, until letGo_().
    function turnAt_(left, down) {
        if (!panPublisher_ || !speeds_ || hidden_)
            return
        const first = !panRate_ && !tiltRate_
        panRate_ = Math.max(-1, Math.min(1, left)) * maxTurnRate
        tiltRate_ = Math.max(-1, Math.min(1, down)) * maxTurnRate
        zeros_ = 3
        if (first)
            sendRate_()
    }
    function letGo_() { panRate_ = tiltRate_ = 0 }
    function sendRate_() {
        if (!panPublisher_)
            return
        if (hidden_)
            letGo_()
        panPublisher_.publish({ angular: { y: tiltRate_, z: panRate_ } })
        if (!panRate_ && !tiltRate_)
            --zeros_
    }
    Timer {
        interval: 50
        repeat: true
        running: view.speeds_ && view.zeros_ > 0
        onTriggered: view.sendRate_()
    }
    readonly property bool hidden_: !visible || !enabled || !active
    // A window in a 3D view is never active; a hand that leaves one that was lets go.
    readonly property bool inFront_: Window.active
    onInFront_Changed: if (!inFront_) letGo_()
    onActiveFocusChanged: if (!activeFocus && !pointer.pressed) letGo_()
    Component.onDestruction: {
        if (speeds_ && zeros_ > 0) {
            letGo_()
            for (let left = 3; left > 0; --left)
                sendRate_()
        }
    }

    MouseArea {
        id: pointer
        anchors.fill: output
        enabled: view.panTilt !== ""
        property point last
        onPressed: function(mouse) { view.forceActiveFocus(); last = Qt.point(mouse.x, mouse.y) }
        onPositionChanged: function(mouse) {
            const wide = Math.max(1, output.contentRect.width)
            if (view.speeds_) {
                view.turnAt_(2 * (last.x - mouse.x) / wide, 2 * (mouse.y - last.y) / wide)
            } else {
                // The image follows the hand.
                view.aim((mouse.x - last.x) / wide * view.fieldOfView, -(mouse.y - last.y) / wide * view.fieldOfView)
                last = Qt.point(mouse.x, mouse.y)
            }
        }
        onReleased: view.letGo_()
        onCanceled: view.letGo_()
    }
    Keys.onPressed: function(event) {
        const left = event.key === Qt.Key_Left ? 1 : event.key === Qt.Key_Right ? -1 : 0
        const down = event.key === Qt.Key_Down ? 1 : event.key === Qt.Key_Up ? -1 : 0
        if (!panTilt || (!left && !down))
            return
        event.accepted = true
        if (speeds_)
            turnAt_(left, down)
        else
            aim(left * fieldOfView / 20, down * fieldOfView / 20)
    }
    Keys.onReleased: function(event) {
        if (panTilt && !event.isAutoRepeat && [Qt.Key_Left, Qt.Key_Right, Qt.Key_Up, Qt.Key_Down].indexOf(event.key) >= 0) {
            letGo_()
            event.accepted = true
        }
    }

    Row {
        id: tools
        anchors { right: parent.right; bottom: parent.bottom; margins: Theme.gap }
        spacing: Theme.gap / 2
        // Before the first image there is nothing to save or turn, and the reason needs the room.
        visible: view.tools && view.received && view.width > 3.5 * Theme.touch + 4 * Theme.gap && view.height > 2 * Theme.touch

        Rectangle {
            width: saveButton.implicitWidth; height: Theme.touch; radius: Theme.radius
            color: Theme.shade
            ThemeButton {
                id: saveButton
                objectName: "snapshot"
                text: qsTr("Save")
                enabled: view.received
                Accessible.name: qsTr("Save the image to a file")
                onClicked: view.snapshot()
            }
        }
        Rectangle {
            width: fillButton.width; height: Theme.touch; radius: Theme.radius
            color: Theme.shade
            ThemeButton {
                id: fillButton
                objectName: "fill"
                text: view.fillMode === "fit" ? qsTr("Fit") : view.fillMode === "crop" ? qsTr("Crop") : qsTr("Stretch")
                Accessible.name: qsTr("How the image fills the view: %1").arg(text)
                onClicked: view.nextFillMode()
            }
        }
        Rectangle {
            width: turnButton.width; height: Theme.touch; radius: Theme.radius
            color: Theme.shade
            ThemeButton {
                id: turnButton
                objectName: "turn"
                text: "⟳"
                Accessible.name: qsTr("Turn the image by 90 degrees")
                onClicked: view.rotateImage()
            }
        }
    }
    Rectangle {
        anchors { left: parent.left; bottom: parent.bottom; margins: Theme.gap }
        width: Math.min(parent.width - 2 * Theme.gap - (tools.visible ? tools.width + Theme.gap : 0), note.implicitWidth + 2 * Theme.gap)
        height: note.implicitHeight + Theme.gap
        radius: Theme.radius
        color: Theme.shade
        visible: note.text !== "" && width > 0
        ThemeText {
            id: note
            objectName: "note"
            anchors { left: parent.left; right: parent.right; verticalCenter: parent.verticalCenter; margins: Theme.gap }
            text: view.message_ || view.panProblem_
            elide: Text.ElideMiddle
            color: view.isWrong_ || !view.message_ ? Theme.bad : Theme.text
            font.pixelSize: Theme.small
        }
    }
    FocusRing { visible: view.activeFocus && view.panTilt !== "" }
}
