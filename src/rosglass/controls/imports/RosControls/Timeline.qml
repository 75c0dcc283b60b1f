// The time of a recording that an interface shows: play, pause, drag, speed, loop, and its event marks.
import QtQml 2.15 as Qml
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields
import "units.js" as Units

LiveFrame {
    id: timeline

    // The recording that replaces the robot; empty for that of `rosglass run --url replay:...`.
    property string file
    // A Replay to control instead of the timeline's own one.
    property var replay: null
    // Speeds to choose from.
    property var rates: [0.1, 0.25, 0.5, 1, 2, 4, 10]
    // Seconds by which the arrow keys move; ten times as many with Shift.
    property real step: 1
    // Topics whose density over time is shown at once, from 0 to 20; all of them by scrolling.
    property int topicRows: 0
    // Whether it has buttons for single messages and for a part of the recording.
    property bool tools: false

    // Whether there is a recording, and whether it is played.
    readonly property bool ready: !!replay_ && replay_.ready
    readonly property bool playing: !!replay_ && replay_.playing
    // Seconds.
    readonly property real position: replay_ ? replay_.position : 0
    readonly property real duration: replay_ ? replay_.duration : 0
    // {time, text} of each event mark of the recording.
    readonly property var marks: replay_ && replay_.marks ? replay_.marks : []

    // The part that is played and repeated, in seconds.
    readonly property real rangeStart: replay_ ? replay_.rangeStart : 0
    readonly property real rangeEnd: replay_ ? replay_.rangeEnd : 0
    readonly property bool hasRange: ready && (rangeStart > 0 || rangeEnd < duration)

    readonly property var replay_: replay ? replay : own.item ? own.item.replay : null

    function play() { if (replay_) replay_.playing = true }
    function pause() { if (replay_) replay_.playing = false }
    function toggle() { playing ? pause() : play() }
    // Moves to a position in seconds; one beyond the ends, to that end.
    function seek(seconds) {
        if (ready && isFinite(seconds))
            replay_.seek(Math.max(0, Math.min(duration, seconds)))
    }
    // Moves to the next event mark; with -1, to the one before.
    function seekMark(direction) {
        const times = marks.map(mark => mark.time).sort((a, b) => a - b)
        const found = direction < 0 ? times.filter(time => time < position - 0.5).pop() : times.filter(time => time > position + 0.05)[0]
        if (found !== undefined)
            seek(found)
    }

    // Plays the next message, and pauses.
    function stepMessage() { if (replay_) replay_.step() }
    // Plays and repeats a part, in seconds; without arguments, the whole recording again.
    function setRange(start, end) {
        if (!ready)
            return
        const first = start === undefined ? 0 : Math.max(0, Math.min(duration, start))
        const last = end === undefined ? duration : Math.max(0, Math.min(duration, end))
        if (first < last)
            replay_.setRange(first, last)
    }

    function faster_(by) {
        if (!replay_)
            return
        const sorted = rates.slice().sort((a, b) => a - b)
        const at = by > 0 ? sorted.filter(rate => rate > replay_.rate)[0] : sorted.filter(rate => rate < replay_.rate).pop()
        if (at !== undefined)
            replay_.rate = at
    }

    title: qsTr("Recording")
    stale: false
    problem: replay_ && replay_.problem ? Fields.bounded(replay_.problem) : !ready && (file || replay) ? qsTr("NO RECORDING YET") : ""
    note: !ready ? (problem ? "" : qsTr("no recording is shown")) : playing ? (replay_.rate !== 1 ? qsTr("playing, %1 x").arg(replay_.rate) : qsTr("playing")) : qsTr("PAUSED")
    contentWidth: 420 * Theme.size
    contentHeight: density.height + slider.height + row.height + Theme.gap / 2
    activeFocusOnTab: true
    Accessible.description: status || Fields.fill(qsTr("%1 of %2"), [Units.clock(position, true), Units.clock(duration, true)])

    Keys.onPressed: function(event) {
        const far = step * (event.modifiers & Qt.ShiftModifier ? 10 : 1)
        event.accepted = true
        if (event.key === Qt.Key_Space)
            toggle()
        else if (event.key === Qt.Key_Left)
            seek(position - far)
        else if (event.key === Qt.Key_Right)
            seek(position + far)
        else if (event.key === Qt.Key_Home)
            seek(0)
        else if (event.key === Qt.Key_End)
            seek(duration)
        else if (event.key === Qt.Key_PageUp)
            seekMark(-1)
        else if (event.key === Qt.Key_PageDown)
            seekMark(1)
        else if (event.key === Qt.Key_Plus || event.key === Qt.Key_Minus)
            faster_(event.key === Qt.Key_Plus ? 1 : -1)
        else if (event.key === Qt.Key_Period)
            stepMessage()
        else if (event.key === Qt.Key_A && event.modifiers === Qt.NoModifier)
            setRange(position, rangeEnd > position ? rangeEnd : duration)
        else if (event.key === Qt.Key_B && event.modifiers === Qt.NoModifier)
            setRange(rangeStart < position ? rangeStart : 0, position)
        else if (event.key === Qt.Key_R && event.modifiers === Qt.NoModifier)
            setRange()
        else if (event.key === Qt.Key_L && replay_)
            replay_.loop = !replay_.loop
        else
            event.accepted = false
    }

    Loader {
        id: own
        active: !timeline.replay
        sourceComponent: Item {
            property alias replay: source
            Replay { id: source; file: timeline.file; parts: timeline.topicRows > 0 ? 240 : 0 }
        }
    }
    // At most twenty jumps a second while dragging, and the last one in any case.
    Timer {
        id: jump
        interval: 50
        property real target: NaN
        onTriggered: {
            const to = target
            target = NaN
            timeline.seek(to)
        }
    }

    // One row for each topic: the denser its messages, the brighter.
    ListView {
        id: density
        objectName: "density"
        readonly property var topics: timeline.topicRows > 0 && timeline.replay_ && timeline.replay_.density ? timeline.replay_.density : []
        anchors { left: parent.left; right: parent.right; top: parent.top }
        height: Math.max(0, Math.min(topics.length, timeline.topicRows, 20)) * Theme.small * 1.4
        clip: true
        boundsBehavior: Flickable.StopAtBounds
        model: topics.length
        Accessible.role: Accessible.List
        Accessible.name: qsTr("Topics of the recording")
        T.ScrollBar.vertical: ThemeScrollBar { policy: density.contentHeight > density.height + 1 ? T.ScrollBar.AlwaysOn : T.ScrollBar.AlwaysOff }
        delegate: Item {
            id: topicRow
            readonly property var about: density.topics[index] || ({ topic: "", type: "", count: 0 })
            width: density.width
            height: Theme.small * 1.4
            Accessible.role: Accessible.ListItem
            Accessible.name: Fields.fill(qsTr("%1: %2 messages"), [Fields.bounded(about.topic, 100), about.count])
            Canvas {
                x: slider.leftPadding
                width: slider.availableWidth
                height: parent.height - 2
                readonly property color ink: Theme.accent
                readonly property color empty: Theme.track
                onInkChanged: requestPaint()
                onWidthChanged: requestPaint()
                onPaint: {
                    const paper = getContext("2d"), parts = timeline.replay_ ? timeline.replay_.partsOf(index) : []
                    paper.clearRect(0, 0, width, height)
                    paper.fillStyle = empty
                    paper.fillRect(0, height - 1, width, 1)
                    const most = parts.reduce((before, one) => Math.max(before, one), 1), each = width / Math.max(1, parts.length)
                    paper.fillStyle = ink
                    for (let at = 0; at < parts.length; ++at) {
                        if (!parts[at])
                            continue
                        paper.globalAlpha = 0.25 + 0.5 * parts[at] / most
                        paper.fillRect(at * each, 0, Math.max(1, each), height)
                    }
                    paper.globalAlpha = 1
                }
            }
            ThemeText {
                anchors { left: parent.left; right: parent.right; leftMargin: slider.leftPadding + 2; verticalCenter: parent.verticalCenter }
                text: Fields.fill(qsTr("%1 · %2"), [Fields.bounded(topicRow.about.topic, 100), topicRow.about.count])
                elide: Text.ElideMiddle
                font.pixelSize: Theme.small * 0.9
            }
        }
    }
    Rectangle {
        visible: density.height > 0
        x: slider.leftPadding + slider.visualPosition * slider.availableWidth
        width: 1
        height: density.height
        color: Theme.text
    }
    ThemeSlider {
        id: slider
        objectName: "slider"
        anchors { left: parent.left; right: parent.right; top: density.bottom }
        enabled: timeline.ready
        name: qsTr("Time of the recording")
        to: Math.max(0.001, timeline.duration)
        // The keys are those of the timeline.
        Keys.forwardTo: [timeline]
        onMoved: {
            jump.target = value
            if (!jump.running)
                jump.start()
        }
        Qml.Binding { target: slider; property: "value"; value: timeline.position; when: !slider.pressed && !jump.running; restoreMode: Qml.Binding.RestoreNone }

        Rectangle {
            objectName: "range"
            visible: timeline.hasRange
            x: slider.leftPadding + slider.availableWidth * timeline.rangeStart / slider.to
            width: Math.max(2, slider.availableWidth * (timeline.rangeEnd - timeline.rangeStart) / slider.to)
            y: slider.height / 2 + Theme.gap / 2
            height: 4
            color: Theme.warn
            Accessible.role: Accessible.StaticText
            Accessible.name: Fields.fill(qsTr("from %1 to %2"), [Units.clock(timeline.rangeStart, true), Units.clock(timeline.rangeEnd, true)])
        }
        Repeater {
            model: timeline.marks
            delegate: Rectangle {
                objectName: "mark_" + index
                x: slider.leftPadding + slider.availableWidth * Math.max(0, Math.min(1, modelData.time / slider.to)) - width / 2
                y: 0
                width: 3
                height: slider.height / 2 - 2
                color: Theme.warn
                Accessible.role: Accessible.StaticText
                Accessible.name: Fields.fill(qsTr("%1: %2"), [Units.clock(modelData.time, true), Fields.bounded(modelData.text, 100)])
                MouseArea {
                    anchors { fill: parent; margins: -4 }
                    hoverEnabled: true
                    onContainsMouseChanged: hint.text = containsMouse ? parent.Accessible.name : ""
                    onClicked: timeline.seek(modelData.time)
                }
            }
        }
    }
    Row {
        id: row
        anchors { left: parent.left; right: parent.right; top: slider.bottom; topMargin: Theme.gap / 2 }
        spacing: narrow ? Theme.gap / 2 : Theme.gap
        readonly property bool narrow: width < 460 * Theme.size

        ThemeButton {
            objectName: "play"
            width: Math.max(implicitWidth, (row.narrow ? 60 : 80) * Theme.size)
            text: timeline.playing ? qsTr("Pause") : qsTr("Play")
            enabled: timeline.ready
            onClicked: timeline.toggle()
        }
        ThemeButton {
            objectName: "step"
            text: qsTr("Step")
            visible: timeline.tools
            enabled: timeline.ready
            Accessible.name: qsTr("Play the next message")
            onClicked: timeline.stepMessage()
        }
        ThemeButton {
            objectName: "previous"
            text: "⏮"
            visible: timeline.marks.length > 0
            enabled: timeline.ready
            Accessible.name: qsTr("Previous mark")
            onClicked: timeline.seekMark(-1)
        }
        ThemeButton {
            objectName: "next"
            text: "⏭"
            visible: timeline.marks.length > 0
            enabled: timeline.ready
            Accessible.name: qsTr("Next mark")
            onClicked: timeline.seekMark(1)
        }
        ThemeChoice {
            objectName: "rate"
            width: (row.narrow ? 60 : 80) * Theme.size
            enabled: timeline.ready
            name: qsTr("Speed")
            model: timeline.rates.map(rate => qsTr("%1 x").arg(rate))
            currentIndex: timeline.replay_ ? timeline.rates.indexOf(timeline.replay_.rate) : -1
            displayText: timeline.replay_ ? qsTr("%1 x").arg(timeline.replay_.rate) : ""
            onActivated: function(index) { timeline.replay_.rate = timeline.rates[index] }
        }
        ThemeSwitch {
            id: loop
            objectName: "loop"
            text: row.narrow ? "" : qsTr("Loop")
            enabled: timeline.ready
            Accessible.name: qsTr("Loop")
            onToggled: timeline.replay_.loop = checked
            Qml.Binding { target: loop; property: "checked"; value: !!timeline.replay_ && timeline.replay_.loop; restoreMode: Qml.Binding.RestoreNone }
        }
        ThemeButton {
            objectName: "from"
            text: qsTr("From here")
            visible: timeline.tools
            enabled: timeline.ready && timeline.position < timeline.duration
            Accessible.name: qsTr("Play from here on")
            onClicked: timeline.setRange(timeline.position, timeline.rangeEnd > timeline.position ? timeline.rangeEnd : timeline.duration)
        }
        ThemeButton {
            objectName: "until"
            text: qsTr("Until here")
            visible: timeline.tools
            enabled: timeline.ready && timeline.position > 0
            Accessible.name: qsTr("Play until here")
            onClicked: timeline.setRange(timeline.rangeStart < timeline.position ? timeline.rangeStart : 0, timeline.position)
        }
        ThemeButton {
            objectName: "whole"
            text: qsTr("Whole")
            visible: timeline.tools && timeline.hasRange
            Accessible.name: qsTr("Play the whole recording")
            onClicked: timeline.setRange()
        }
        ThemeText {
            objectName: "time"
            anchors.verticalCenter: parent.verticalCenter
            width: Math.max(0, Math.min(implicitWidth, row.width - x))
            text: Fields.fill(qsTr("%1 / %2"), [Units.clock(timeline.position, true), Units.clock(timeline.duration, true)])
            color: timeline.ready ? Theme.text : Theme.dim
        }
        ThemeText {
            id: hint
            anchors.verticalCenter: parent.verticalCenter
            width: Math.max(0, Math.min(implicitWidth, row.width - x))
            color: Theme.warn
            font.pixelSize: Theme.small
        }
    }
    FocusRing { visible: timeline.activeFocus }
}
