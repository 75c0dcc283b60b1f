// Records topics to an MCAP file or a ROS 1 bag, with limits and event marks.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields
import "units.js" as Units

LiveFrame {
    id: control

    // Topics to record; empty for all.
    property alias topics: recorder.topics
    // Regular expression for topics that are never recorded.
    property alias exclude: recorder.exclude
    // Folder of the files; empty for the home folder.
    property alias folder: recorder.folder
    // Name of the next file; empty for one with date and time.
    property alias fileName: recorder.fileName
    // "mcap", or "bag" for ROS 1 bags.
    property alias format: recorder.format
    // Bytes after which a recording ends; 0 for no limit.
    property alias sizeLimit: recorder.sizeLimit
    // Seconds after which a recording ends; 0 for no limit.
    property alias timeLimit: recorder.timeLimit
    // Bytes that are free on the disk, below which that is shown as a warning.
    property real lowSpace: 1e9
    // Whether it records; setting it starts and stops.
    property alias recording: recorder.recording
    // Texts of buttons that write an event mark.
    property var markTexts: [qsTr("Mark")]

    // Whether the file is being completed.
    readonly property alias completing: recorder.completing
    // The file of the present or last recording.
    readonly property alias file: recorder.file
    // Why the last recording ended.
    readonly property alias ending: recorder.ending
    // Seconds, bytes, messages, lost messages, and event marks of the present or last recording.
    readonly property alias elapsed: recorder.elapsed
    readonly property alias size: recorder.size
    readonly property alias messageCount: recorder.messageCount
    readonly property alias lost: recorder.lost
    readonly property alias markCount: recorder.markCount
    // Bytes that are free on the disk; -1 while unknown.
    readonly property alias free: recorder.free

    // A recording is complete: its file (empty if nothing was recorded), and why it ended.
    signal finished(string file, string reason)
    // A recording did not begin, or ended by this error.
    signal failed(string reason)

    function start() { recorder.start() }
    function stop() { recorder.stop() }
    // Writes an event mark; returns whether it was written.
    function mark(text) { return recorder.mark(text === undefined ? "" : text) }


    title: qsTr("Recorder")
    stale: false
    needsRobot: true
    problem: Fields.bounded(recorder.problem)
    note: free < 0 ? "" : qsTr("%1 free").arg(Units.bytes(free))
    contentWidth: 300 * Theme.size
    contentHeight: column.implicitHeight
    Accessible.description: status || progress.text

    TopicRecorder {
        id: recorder
        onFinished: function(file, reason) { control.finished(file, reason) }
        onFailed: function(reason) { control.failed(reason) }
    }

    Column {
        id: column
        width: parent.width
        spacing: Theme.gap / 2

        Row {
            width: parent.width
            spacing: Theme.gap

            ThemeButton {
                objectName: "record"
                width: Math.max(implicitWidth, 90 * Theme.size)
                text: control.recording ? qsTr("Stop") : control.completing ? qsTr("saving ...") : qsTr("Record")
                tint: Theme.bad
                enabled: control.recording || !control.completing
                onClicked: control.recording = !control.recording
            }
            Rectangle {
                anchors.verticalCenter: parent.verticalCenter
                width: Theme.normal; height: width; radius: width / 2
                color: control.recording ? Theme.bad : Theme.track
                SequentialAnimation on opacity {
                    running: control.recording
                    loops: Animation.Infinite
                    PropertyAction { value: 1 }
                    PauseAnimation { duration: 700 }
                    PropertyAction { value: 0.3 }
                    PauseAnimation { duration: 500 }
                    onStopped: parent.opacity = 1
                }
            }
            ThemeText {
                objectName: "time"
                anchors.verticalCenter: parent.verticalCenter
                text: Units.clock(control.elapsed)
                color: control.recording ? Theme.text : Theme.dim
                font.pixelSize: Theme.large
            }
        }
        Flow {
            width: parent.width
            spacing: Theme.gap / 2
            visible: control.markTexts.length > 0
            Repeater {
                model: control.markTexts
                delegate: ThemeButton {
                    objectName: "mark_" + index
                    text: String(modelData)
                    enabled: control.recording && control.elapsed > 0
                    Accessible.name: qsTr("Write an event mark: %1").arg(text)
                    onClicked: control.mark(text)
                }
            }
        }
        ThemeText {
            id: progress
            objectName: "progress"
            width: parent.width
            text: {
                const parts = []
                if (control.recording && !control.elapsed)
                    return qsTr("starting ...")
                if (!control.recording && !control.file)
                    return qsTr("not recording")
                parts.push(Units.bytes(control.size) + (control.sizeLimit > 0 ? " / " + Units.bytes(control.sizeLimit) : ""))
                if (control.timeLimit > 0)
                    parts.push(qsTr("at most %1").arg(Units.clock(control.timeLimit)))
                parts.push(qsTr("%1 messages").arg(control.messageCount))
                if (control.markCount)
                    parts.push(qsTr("%1 marks").arg(control.markCount))
                if (control.lost)
                    parts.push(qsTr("%1 LOST: the disk is too slow").arg(control.lost))
                return parts.join(" · ")
            }
            color: control.lost ? Theme.bad : Theme.dim
            font.pixelSize: Theme.small
        }
        ThemeText {
            objectName: "file"
            width: parent.width
            visible: text !== ""
            text: !control.file || control.problem ? "" : control.recording ? control.file
                : control.completing ? qsTr("completing %1").arg(control.file) : control.size > 0 ? Fields.fill(qsTr("%1: %2"), [control.ending, control.file]) : control.ending
            color: Theme.dim
            elide: Text.ElideMiddle
            font.pixelSize: Theme.small
        }
        ThemeText {
            objectName: "warning"
            width: parent.width
            visible: text !== ""
            text: control.free >= 0 && control.free < control.lowSpace ? qsTr("DISK NEARLY FULL: %1 free").arg(Units.bytes(control.free))
                : control.recording && recorder.missing ? qsTr("not recorded: %1").arg(Fields.bounded(recorder.missing, 200)) : ""
            color: Theme.warn
            font.pixelSize: Theme.small
        }
    }
}
