// All robots at a glance: a tile for each, with camera, battery, mode, alarms and age. A click or Return selects one.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import Ros2 1.0
import RosControls 1.0
import "cameras.js" as Cameras
import "fields.js" as Fields

LiveFrame {
    id: tiles

    // Namespaces to show; empty for those in which the graph has `topic`.
    property alias namespaces: own.namespaces
    // What every robot has, relative to its namespace.
    property alias topic: own.topic
    // The TwistCommand, which is halted before another robot is selected.
    property alias command: own.command
    // Whether the first robot is selected while none is.
    property alias automatic: own.automatic
    // A RobotSwitch that selects as well; without one, the tiles select alone.
    property var robots: null
    // Topic of the mode, relative to the namespace: std_msgs/String or an integer.
    property string modeTopic: "mode/state"
    // Name of the image transport, such as "raw", "compressed" or "ffmpeg".
    property string transport: "compressed"
    // Images per second of each camera at most; 0 for no cameras.
    property real maxRate: 2
    // Least width of a tile, in pixels; further ones are reached by scrolling.
    property real tileWidth: 200 * Theme.size
    // Milliseconds without anything from a robot, its battery or its diagnostics, after which that is old.
    property int timeout: 5000
    // Shares of a battery's capacity from 0 to 1 below which it is shown as low and as empty.
    property real low: 0.3
    property real empty: 0.15

    // The namespace of the robot that is selected; bind the `ns` of other controls to it.
    readonly property string selected: switch_.current
    // The robots: {ns, name, present, problem}.
    readonly property var found: switch_.found
    // Robots with an error, a twin, or without data.
    readonly property int troubled: troubled_

    // A tile was chosen by hand, also that of the robot that was selected already.
    signal chosen(string ns)

    // Robots that have a tile; the others are counted.
    readonly property int mostTiles_: 100
    readonly property var switch_: robots || own
    property int current_: 0
    property int troubled_: 0
    property var offered_: ({})
    readonly property int count_: list.count
    readonly property real gap_: Theme.gap / 2
    // The rest is for the scroll bar.
    readonly property real usable_: view.width - Theme.gap
    readonly property int columns_: Math.max(1, Math.min(Math.max(1, count_), Math.floor((usable_ + gap_) / (tileWidth + gap_))))
    readonly property real wide_: Math.max(1, Math.min(2 * tileWidth, (usable_ - (columns_ - 1) * gap_) / columns_))
    readonly property real high_: Math.round((maxRate > 0 ? (wide_ - 2 * Theme.gap) * 9 / 16 + gap_ : 0)
        + 3.1 * Theme.small + 1.5 * Theme.normal + 2.6 * Theme.gap)
    readonly property string names_: found.map(function(one) { return one.ns }).join("\n")

    title: qsTr("Robots")
    source: null
    stale: false
    needsRobot: true
    age: 0
    filled: count_ > 0
    problem: count_ ? "" : Fields.fill(qsTr("no robot: no namespace has %1"), [topic])
    note: (found.length === 1 ? qsTr("1 robot") : qsTr("%1 robots").arg(found.length))
        + (troubled ? " · " + qsTr("%1 in trouble").arg(troubled) : "")
        + (found.length > count_ ? " · " + qsTr("%1 not shown").arg(found.length - count_) : "")
    contentWidth: 2 * tileWidth + gap_
    contentHeight: high_
    activeFocusOnTab: true
    Accessible.role: Accessible.List
    Accessible.description: status || note

    // Selects a robot; what is steered is halted first.
    function select(ns) {
        if (ns === selected)
            return
        if (robots && command)
            command.halt()
        switch_.select(ns)
    }

    function choose_(index) {
        if (!(index >= 0 && index < count_))
            return
        current_ = index
        const ns = list.get(index).ns
        select(ns)
        chosen(ns)
        if (shell_ && shell_.showRobot_)
            shell_.showRobot_(ns)
    }
    function move_(by) {
        current_ = Math.max(0, Math.min(count_ - 1, current_ + by))
        const top = Math.floor(current_ / columns_) * (high_ + gap_)
        view.contentY = Math.max(0, Math.min(top, Math.max(view.contentY, top + high_ - view.height)))
    }
    function count_troubled_() {
        let count = 0
        for (let at = 0; at < cells.count; ++at) {
            const one = cells.itemAt(at)
            if (one && one.troubled)
                ++count
        }
        troubled_ = count
    }

    // Tiles keep their items while other robots appear and leave.
    function update_() {
        const names = found.slice(0, mostTiles_).map(function(one) { return one.ns })
        for (let at = list.count - 1; at >= 0; --at)
            if (names.indexOf(list.get(at).ns) < 0)
                list.remove(at)
        for (let at = 0; at < names.length; ++at) {
            let before = at
            while (before < list.count && list.get(before).ns !== names[at])
                ++before
            if (before === list.count)
                list.insert(at, { ns: names[at] })
            else if (before !== at)
                list.move(before, at, 1)
        }
        current_ = Math.max(0, Math.min(current_, list.count - 1))
        offer_()
    }
    // What each robot offers: one look at the graph for all of them.
    function offer_() {
        const spaces = found.map(function(one) { return one.ns })
        const cameras = graph.topicsWithin(spaces, Cameras.TYPES)
        const batteries = graph.topicsWithin(spaces, ["sensor_msgs/msg/BatteryState"])
        const alarms = graph.topicsWithin(spaces, ["diagnostic_msgs/msg/DiagnosticArray"])
        const made = {}
        for (const ns of spaces) {
            const bases = Cameras.bases(cameras[ns] || []).filter(function(name) { return !/depth/i.test(name) })
            made[ns] = { camera: bases[0] || "", battery: (batteries[ns] || [""])[0], alarms: (alarms[ns] || [""])[0] }
        }
        offered_ = made
        count_troubled_()
    }

    onNames_Changed: update_()
    Component.onCompleted: update_()
    ListModel { id: list }
    GraphWatch {
        id: graph
        onChanged: tiles.offer_()
    }
    // It finds and selects; nothing of it is shown.
    RobotSwitch {
        id: own
        visible: false
        width: 0
        height: 0
    }

    Keys.onPressed: function(event) {
        const step = { [Qt.Key_Left]: -1, [Qt.Key_Right]: 1, [Qt.Key_Up]: -columns_, [Qt.Key_Down]: columns_ }[event.key]
        event.accepted = true
        if (step !== undefined)
            move_(step)
        else if (event.key === Qt.Key_Return || event.key === Qt.Key_Enter || event.key === Qt.Key_Space)
            choose_(current_)
        else
            event.accepted = false
    }

    Flickable {
        id: view
        anchors.fill: parent
        clip: true
        contentHeight: Math.ceil(tiles.count_ / tiles.columns_) * (tiles.high_ + tiles.gap_) - tiles.gap_
        interactive: contentHeight > height
        boundsBehavior: Flickable.StopAtBounds
        T.ScrollBar.vertical: ThemeScrollBar { visible: view.interactive }

        Repeater {
            id: cells
            model: list
            delegate: Item {
                id: cell
                objectName: "tile_" + index
                x: (index % tiles.columns_) * (tiles.wide_ + tiles.gap_)
                y: Math.floor(index / tiles.columns_) * (tiles.high_ + tiles.gap_)
                width: tiles.wide_
                height: tiles.high_
                readonly property string ns: model.ns
                readonly property var robot: tiles.found.find(function(one) { return one.ns === cell.ns }) || ({ ns: ns, name: ns, present: false, problem: "" })
                readonly property var offers: tiles.offered_[ns] || ({ camera: "", battery: "", alarms: "" })
                readonly property bool seen: tiles.visible && y + height > view.contentY && y < view.contentY + view.height
                readonly property bool isSelected: tiles.selected === ns
                readonly property bool troubled: frame.wrong || alarms.errors > 0
                onTroubledChanged: tiles.count_troubled_()
                // Seconds since something of the robot was received; -1 for never.
                readonly property real age: {
                    const all = [battery.age, alarms.age, mode.age, camera.item ? camera.item.age : -1].filter(function(one) { return one >= 0 })
                    return all.length ? Math.min.apply(null, all) : -1
                }
                readonly property bool offersNothing: !offers.battery && !offers.alarms && !offers.camera && mode.message === undefined

                readonly property real share: {
                    const got = battery.message
                    return got && got.percentage >= 0 ? Math.min(1, got.percentage) : got && got.charge >= 0 && got.capacity > 0 ? Math.min(1, got.charge / got.capacity) : NaN
                }
                readonly property string batteryText: !offers.battery ? qsTr("no battery")
                    : isNaN(share) ? qsTr("? %")
                    : battery.stale ? qsTr("%1 %, OLD").arg((100 * share).toFixed(0)) : qsTr("%1 %").arg((100 * share).toFixed(0))
                readonly property string modeText: mode.message === undefined ? "" : Fields.bounded(mode.message.data, 40)
                readonly property string alarmText: !offers.alarms ? qsTr("no diagnostics")
                    : alarms.age < 0 ? qsTr("diagnostics: none yet")
                    : alarms.stale ? qsTr("diagnostics silent")
                    : alarms.errors ? (alarms.errors === 1 ? qsTr("1 error") : qsTr("%1 errors").arg(alarms.errors))
                    : alarms.stales ? qsTr("%1 silent").arg(alarms.stales)
                    : alarms.warnings ? (alarms.warnings === 1 ? qsTr("1 warning") : qsTr("%1 warnings").arg(alarms.warnings)) : qsTr("no alarm")

                Accessible.role: Accessible.ListItem
                Accessible.name: robot.name
                Accessible.description: [frame.status || frame.note, batteryText, modeText, alarmText, isSelected ? qsTr("selected") : ""].filter(function(part) { return part !== "" }).join(", ")
                Accessible.onPressAction: tiles.choose_(index)

                LiveTopic {
                    id: battery
                    topic: cell.offers.battery
                    enabled: tiles.visible && topic !== ""
                    types: ["sensor_msgs/msg/BatteryState"]
                    timeout: tiles.timeout
                }
                LiveTopic {
                    id: mode
                    topic: Fields.resolve(cell.ns, tiles.modeTopic)
                    enabled: tiles.visible && tiles.modeTopic !== ""
                    types: ["std_msgs/msg/String", "std_msgs/msg/UInt8", "std_msgs/msg/Int8", "std_msgs/msg/UInt16", "std_msgs/msg/Int16", "std_msgs/msg/UInt32", "std_msgs/msg/Int32"]
                    qos: Ros2.BestAvailableQoS()
                    timeout: 0
                }
                DiagnosticsTopic {
                    id: alarms
                    topic: cell.offers.alarms
                    enabled: tiles.visible && topic !== ""
                    timeout: tiles.timeout
                }

                LiveFrame {
                    id: frame
                    objectName: "frame"
                    anchors.fill: parent
                    title: Fields.bounded(cell.robot.name, 60)
                    source: null
                    needsRobot: false
                    age: cell.age
                    stale: !cell.robot.present || (!cell.offersNothing && !(cell.age >= 0 && 1000 * cell.age < tiles.timeout))
                    filled: cell.age >= 0
                    problem: cell.robot.problem ? qsTr("TWO OF THIS NAME") : !cell.robot.present ? qsTr("GONE") : cell.offersNothing ? qsTr("nothing to show") : ""
                    note: cell.age < 0 ? "" : qsTr("%1 s").arg(cell.age < 1 ? "< 1" : cell.age.toFixed(0))

                    Column {
                        anchors.fill: parent
                        spacing: Theme.gap / 2
                        Item {
                            width: parent.width
                            height: width * 9 / 16
                            visible: tiles.maxRate > 0
                            ThemeText {
                                anchors.centerIn: parent
                                visible: cell.offers.camera === ""
                                text: qsTr("no camera")
                                color: Theme.dim
                                font.pixelSize: Theme.small
                            }
                            Loader {
                                id: camera
                                anchors.fill: parent
                                active: cell.seen && cell.offers.camera !== "" && tiles.maxRate > 0
                                sourceComponent: CameraView {
                                    objectName: "camera"
                                    activeFocusOnTab: false
                                    topic: cell.offers.camera
                                    transport: tiles.transport
                                    maxRate: Math.min(2, tiles.maxRate)
                                    timeout: Math.max(1000, 3000 / maxRate)
                                    tools: false
                                    label: false
                                    fillMode: "crop"
                                }
                            }
                        }
                        Row {
                            width: parent.width
                            spacing: Theme.gap
                            ThemeText {
                                id: charge
                                objectName: "battery"
                                width: Math.min(implicitWidth, parent.width)
                                text: cell.batteryText
                                font.pixelSize: Theme.normal
                                color: !cell.offers.battery || isNaN(cell.share) ? Theme.dim : battery.stale || cell.share < tiles.empty ? Theme.bad
                                    : cell.share < tiles.low ? Theme.warn : Theme.good
                            }
                            ThemeText {
                                objectName: "mode"
                                width: Math.max(0, parent.width - charge.width - parent.spacing)
                                horizontalAlignment: Text.AlignRight
                                text: cell.modeText
                                font.pixelSize: Theme.normal
                            }
                        }
                        ThemeText {
                            objectName: "alarm"
                            width: parent.width
                            text: cell.robot.problem || cell.alarmText
                            font.pixelSize: Theme.small
                            color: cell.robot.problem || alarms.errors || (cell.offers.alarms && alarms.stale) ? Theme.bad
                                : alarms.warnings || alarms.stales ? Theme.warn : Theme.dim
                        }
                    }
                }
                Rectangle {
                    anchors.fill: parent
                    visible: cell.isSelected || (tiles.activeFocus && tiles.current_ === index)
                    color: "transparent"
                    radius: Theme.radius
                    border { color: Theme.accent; width: tiles.activeFocus && tiles.current_ === index ? 4 : 2 }
                }
                MouseArea {
                    anchors.fill: parent
                    onClicked: {
                        tiles.forceActiveFocus(Qt.MouseFocusReason)
                        tiles.choose_(index)
                    }
                }
            }
        }
    }
}
