// Several cameras side by side; a click or the keyboard makes one of them big. Only those that can be seen are received.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import Ros2 1.0
import RosControls 1.0
import "cameras.js" as Cameras
import "fields.js" as Fields

FocusScope {
    id: grid

    // Base topics of the cameras; empty for all that there are.
    property var topics: []
    property string ns
    // Name of the image transport, such as "raw", "compressed" or "ffmpeg".
    property string transport: "compressed"
    // Columns; 0 for as many as suit the shape.
    property int columns: 0
    // Least width of a camera, in pixels; further ones are reached by scrolling.
    property real cellWidth: 200 * Theme.size
    // Images per second of the small ones at most; 0 for all.
    property real maxRate: 10
    // Index of the big one; -1 for none.
    property int big: -1
    // "fit", "crop" or "stretch".
    property string fillMode: "fit"

    // The cameras that are shown.
    readonly property var cameras: topics && topics.length ? topics.map(topic => Fields.resolve(ns, String(topic))) : Cameras.bases(finder.candidates)
    // The camera that the arrow keys have reached.
    readonly property int current: current_
    property int current_: 0
    readonly property int count_: list.count
    readonly property int columns_: columns > 0 ? columns
        : Math.max(1, Math.min(Math.max(1, Math.floor((width + gap_) / (cellWidth + gap_))), Math.ceil(Math.sqrt(count_ * Math.max(0.1, width / Math.max(1, height)) * 9 / 16))))
    readonly property int rows_: Math.ceil(count_ / columns_)
    readonly property real gap_: Theme.gap / 2
    readonly property real wide_: (width - (columns_ - 1) * gap_) / columns_
    // As high as fits, but not lower than a camera's shape needs.
    readonly property real high_: Math.max(Math.min(wide_ * 9 / 16, cellWidth * 9 / 16), (height - (rows_ - 1) * gap_) / Math.max(1, rows_))
    // The list of cameras is compared by value.
    readonly property string names_: cameras.join("\n")

    implicitWidth: 480 * Theme.size
    implicitHeight: 270 * Theme.size
    activeFocusOnTab: true
    Accessible.role: Accessible.List
    Accessible.name: qsTr("Cameras")
    Accessible.description: qsTr("%1 cameras").arg(count_)

    // Makes a camera big, or all of them small again with -1.
    function show(index) {
        big = index >= 0 && index < count_ ? index : -1
        if (big >= 0)
            current_ = big
    }
    function move_(by) {
        if (!count_)
            return
        current_ = Math.max(0, Math.min(count_ - 1, current_ + by))
        if (big >= 0)
            big = current_
        const top = Math.floor(current_ / columns_) * (high_ + gap_)
        scroll.contentY = Math.max(0, Math.min(top, Math.max(scroll.contentY, top + high_ - height)))
    }

    onNames_Changed: update_()
    Component.onCompleted: update_()
    // Cameras keep their items, and the big one stays big, while others appear and leave.
    function update_() {
        const names = cameras.filter((name, at) => cameras.indexOf(name) === at)
        const was = big >= 0 && big < list.count ? list.get(big).topic : ""
        for (let at = list.count - 1; at >= 0; --at)
            if (names.indexOf(list.get(at).topic) < 0)
                list.remove(at)
        for (let at = 0; at < names.length; ++at) {
            let before = at
            while (before < list.count && list.get(before).topic !== names[at])
                ++before
            if (before === list.count)
                list.insert(at, { topic: names[at] })
            else if (before !== at)
                list.move(before, at, 1)
        }
        if (was)
            big = names.indexOf(was)
        else if (big >= list.count)
            big = -1
        current_ = Math.max(0, Math.min(current_, list.count - 1))
    }
    ListModel { id: list }

    Keys.onPressed: function(event) {
        const step = { [Qt.Key_Left]: -1, [Qt.Key_Right]: 1, [Qt.Key_Up]: -columns_, [Qt.Key_Down]: columns_ }[event.key]
        event.accepted = true
        if (step !== undefined)
            move_(big >= 0 ? Math.sign(step) : step)
        else if (event.key === Qt.Key_Return || event.key === Qt.Key_Enter || event.key === Qt.Key_Space)
            show(big >= 0 ? -1 : current_)
        else if (event.key === Qt.Key_Escape && big >= 0)
            show(-1)
        else
            event.accepted = false
    }

    LiveTopic {
        id: finder
        enabled: false
        ns: grid.ns
        types: Cameras.TYPES
    }
    ThemeText {
        anchors.centerIn: parent
        width: Math.min(implicitWidth, parent.width)
        visible: grid.count_ === 0
        text: Fields.unconnected(Ros2.connectionState, Ros2.connectionDetail) || qsTr("NO CAMERA FOUND")
        wrapMode: Text.Wrap
        horizontalAlignment: Text.AlignHCenter
        color: Theme.bad
        font.weight: Font.Bold
    }
    Flickable {
        id: scroll
        anchors.fill: parent
        clip: true
        interactive: grid.big < 0 && contentHeight > height
        contentHeight: grid.big >= 0 ? height : grid.rows_ * (grid.high_ + grid.gap_) - grid.gap_
        boundsBehavior: Flickable.StopAtBounds
        T.ScrollBar.vertical: ThemeScrollBar { visible: scroll.interactive }

        Repeater {
            model: list
            delegate: Item {
                id: cell
                objectName: "cell_" + index
                readonly property bool isBig: grid.big === index
                x: isBig ? 0 : (index % grid.columns_) * (grid.wide_ + grid.gap_)
                y: isBig ? scroll.contentY : Math.floor(index / grid.columns_) * (grid.high_ + grid.gap_)
                width: isBig ? grid.width : grid.wide_
                height: isBig ? grid.height : grid.high_
                visible: grid.big < 0 || isBig
                readonly property bool seen: visible && (isBig || (y + height > scroll.contentY && y < scroll.contentY + scroll.height))

                CameraView {
                    objectName: "camera_" + index
                    anchors.fill: parent
                    activeFocusOnTab: false
                    topic: model.topic
                    transport: grid.transport
                    fillMode: grid.fillMode
                    active: cell.seen
                    tools: cell.isBig
                    maxRate: cell.isBig ? 0 : grid.maxRate
                    timeout: !cell.isBig && grid.maxRate > 0 ? Math.max(500, 3000 / grid.maxRate) : 500
                }
                MouseArea {
                    anchors { fill: parent; bottomMargin: cell.isBig ? 2 * Theme.touch : 0 }
                    onClicked: {
                        grid.forceActiveFocus()
                        grid.current_ = index
                        grid.show(cell.isBig ? -1 : index)
                    }
                }
                Rectangle {
                    anchors.fill: parent
                    visible: grid.activeFocus && grid.current_ === index && !cell.isBig
                    color: "transparent"
                    border { color: Theme.accent; width: 3 }
                }
            }
        }
    }
}
