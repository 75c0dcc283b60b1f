// Where a robot with a satellite receiver is, on map tiles from this machine's disk; nothing is
// downloaded.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: view

    // The topic (sensor_msgs/NavSatFix); without one, the first of this type.
    property string topic
    property string ns
    // A folder with z/x/y.png or .jpg, or an MBTiles file; without one, a grid of degrees is shown.
    property url tiles
    // Topics of geographic_msgs/GeoPath.
    property var paths: []
    // Degrees clockwise from north; NaN while unknown.
    property real heading: NaN
    // Whether the robot stays in the middle.
    property bool follow: true
    // Whether the robot's track is drawn.
    property bool track: true
    // Whether the buttons are shown.
    property bool tools: true
    // Whose data the tiles are; without one, what the MBTiles file says.
    property string attribution

    // Degrees and metres; NaN while unknown.
    readonly property real latitude: fixed_ ? message.latitude : NaN
    readonly property real longitude: fixed_ ? message.longitude : NaN
    readonly property real altitude: fixed_ ? message.altitude : NaN
    // Radius in metres around the position that holds 95 % of all; NaN while unknown.
    readonly property real accuracy: fixed_ ? scene_.accuracy : NaN
    // What the receiver says about its position, in words.
    readonly property string fix: !message ? qsTr("no data")
        : message.status.status === -2 ? qsTr("fix unknown")
        : message.status.status < 0 ? qsTr("NO FIX")
        : !valid_ ? qsTr("no valid position")
        : message.status.status === 2 ? qsTr("fix, ground-based augmentation")
        : message.status.status === 1 ? qsTr("fix, satellite-based augmentation")
        : qsTr("fix")
    readonly property var message: live.message
    readonly property QtObject scene: scene_
    readonly property QtObject camera: camera_

    // A click, in degrees.
    signal clicked(real latitude, real longitude)

    // Show a position, and a number of metres across.
    function lookAt(latitude, longitude, metres) {
        follow = false
        const at = scene_.toMap(latitude, longitude)
        camera_.lookAt(at.x, at.y)
        if (metres > 0)
            camera_.scale = Math.min(plane.width, plane.height) / (metres * scene_.stretch(at.y))
    }
    function zoomBy(factor) {
        camera_.zoomBy(factor, plane.width / 2, plane.height / 2)
    }

    readonly property bool valid_: isValid_(message)
    readonly property bool fixed_: valid_ && message.status.status !== -1
    property bool placed_: false

    function isValid_(message) {
        return !!message && Math.abs(message.latitude) <= 90 && Math.abs(message.longitude) <= 180
    }
    function place_() {
        // Not by fixed_, which may change after the message.
        if (!isValid_(message) || message.status.status === -1)
            return
        const known = message.position_covariance_type !== 0
        const matrix = message.position_covariance
        scene_.setPosition(message.latitude, message.longitude, known ? matrix[0] : NaN, known ? matrix[4] : NaN, known ? matrix[1] : NaN)
        if (!placed_) {
            placed_ = true
            camera_.scale = Math.min(plane.width, plane.height) / (200 * scene_.stretch(scene_.robotY))
        }
        if (follow)
            camera_.lookAt(scene_.robotX, scene_.robotY)
    }
    function path_(source) {
        const text = decodeURIComponent(String(source))
        return text.indexOf("file://") === 0 ? text.slice(7) : text
    }

    title: qsTr("Position")
    source: live
    problem: live.problem ? live.problem
        : message && !fixed_ ? (scene_.robotSeen ? qsTr("%1: the last position is shown").arg(fix) : fix)
        : network_ ? qsTr("%1 is not read: tiles come from a folder or an MBTiles file").arg(Fields.bounded(path_(tiles), 100))
        : scene_.tilesProblem
    note: fixed_ && isFinite(accuracy) ? qsTr("± %1 m").arg(accuracy < 10 ? accuracy.toFixed(2) : accuracy.toFixed(0)) : ""
    contentWidth: 320 * Theme.size
    contentHeight: 240 * Theme.size
    onMessageChanged: place_()
    onFollowChanged: place_()
    Accessible.description: status || fix

    readonly property bool network_: /^[a-z]{2,}:/.test(String(tiles)) && String(tiles).indexOf("file:") !== 0

    LiveTopic {
        id: live
        topic: view.topic
        ns: view.ns
        types: ["sensor_msgs/msg/NavSatFix"]
    }
    MapCamera {
        id: camera_
        width: plane.width
        height: plane.height
        minSpan: 1
        maxSpan: 4e7
        scale: 0.001
    }
    GeoScene {
        id: scene_
        tilesPath: view.network_ ? "" : view.path_(view.tiles)
        paths: view.paths
        camera: camera_
    }
    MapPlane {
        id: plane
        objectName: "plane"
        anchors.fill: parent
        camera: camera_
        centered: view.follow
        Accessible.name: view.title
        Accessible.description: view.status || view.fix
        onMoved: view.follow = false
        onClicked: function(x, y) {
            const at = scene_.toDegrees(x, y)
            view.clicked(at.x, at.y)
        }
        onHomeKey: view.follow = true
        onFollowKey: view.follow = !view.follow

        MapTiles { source: scene_.tiles }
        MapMarks {
            anchors.fill: parent
            scene: scene_
            track: view.track
            trackColor: Theme.accent
            pathColor: Theme.good
            gridColor: Theme.dim
            gridSize: Theme.small
        }
        Rectangle {
            objectName: "circle"
            readonly property real pixels: 2 * scene_.accuracy * scene_.stretch(scene_.robotY) * camera_.scale
            visible: mark.visible && pixels > 4 && pixels < 20000
            width: visible ? pixels : 0
            height: width
            radius: width / 2
            x: mark.x + mark.width / 2 - radius
            y: mark.y + mark.height / 2 - radius
            color: "transparent"
            border { color: mark.color; width: 2 }

            Rectangle {
                anchors.fill: parent
                radius: width / 2
                color: mark.color
                opacity: 0.15
            }
        }
        MapMark {
            id: mark
            objectName: "mark"
            camera: camera_
            visible: scene_.robotSeen
            isDot: isNaN(view.heading)
            pose: ({ x: scene_.robotX, y: scene_.robotY, yaw: isNaN(view.heading) ? 0 : Math.PI / 2 - view.heading * Math.PI / 180 })
            color: view.fixed_ && !view.stale ? Theme.warn : Theme.bad
        }
    }
    ThemeText {
        anchors { left: parent.left; bottom: parent.bottom; margins: Theme.gap / 2 }
        width: Math.min(implicitWidth, parent.width / 2)
        text: plane.hovered ? scene_.describe(plane.at.x, plane.at.y) : scene_.robotSeen ? scene_.describe(scene_.robotX, scene_.robotY) : ""
        color: Theme.text
        font.pixelSize: Theme.small
        style: Text.Outline
        styleColor: Theme.panel
    }
    ThemeText {
        objectName: "attribution"
        anchors { right: parent.right; bottom: scale.top; margins: Theme.gap / 2 }
        width: Math.min(implicitWidth, parent.width * 0.8)
        text: scene_.hasTiles ? view.attribution || scene_.attribution : ""
        color: Theme.text
        font.pixelSize: Theme.small * 0.9
        style: Text.Outline
        styleColor: Theme.panel
    }
    MapScale {
        id: scale
        anchors { right: parent.right; bottom: parent.bottom; margins: Theme.gap / 2 }
        pixelsPerMetre: camera_.scale * scene_.stretch(camera_.centerY)
        longest: Math.min(120 * Theme.size, parent.width / 3)
    }
    MapTools {
        id: bar
        view: plane
        shown: view.tools
        visible: view.tools
        anchors { left: parent.left; right: parent.right; top: parent.top; margins: Theme.gap / 2 }

        MapButton {
            objectName: "follow"
            visible: bar.unfolded
            text: qsTr("Follow")
            checkable: true
            checked: view.follow
            onClicked: view.follow = !view.follow
        }
        MapButton { visible: bar.unfolded; text: "+"; Accessible.name: qsTr("Zoom in"); onClicked: view.zoomBy(1.5) }
        MapButton { visible: bar.unfolded; text: "−"; Accessible.name: qsTr("Zoom out"); onClicked: view.zoomBy(1 / 1.5) }
        MapButton { text: qsTr("Clear track"); visible: bar.unfolded && view.track; onClicked: scene_.clearTrack() }
    }
}
