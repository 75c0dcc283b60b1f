// Below the layout: the time of the recording that is shown, and the recorder while it is used.
import QtQuick 2.15
import RosControls 1.0

Rectangle {
    id: strip

    readonly property alias recording: recorder.recording
    readonly property alias elapsed: recorder.elapsed
    // Whether there is anything to show.
    readonly property bool used: program.recording !== "" || usesRecorder_
    readonly property bool usesRecorder_: recorder.recording || recorder.completing || opened_
    // Whether the recorder stays although it does not record.
    property bool opened_: false

    // Shows the recorder, and starts or stops it.
    function record() {
        opened_ = true
        recorder.recording = !recorder.recording
    }
    function mark() {
        if (!recorder.recording)
            program.say(qsTr("nothing is being recorded"))
        else if (recorder.mark(qsTr("Mark")))
            program.say(qsTr("mark %1 written").arg(recorder.markCount))
    }

    implicitHeight: column.height + Theme.gap
    color: Theme.background
    Accessible.role: Accessible.Pane
    Accessible.name: qsTr("Recording")

    Column {
        id: column
        anchors { left: parent.left; right: parent.right; leftMargin: Theme.gap; rightMargin: Theme.gap }
        y: Theme.gap / 2
        spacing: Theme.gap / 2

        Loader {
            objectName: "timelineLoader"
            width: parent.width
            active: program.recording !== ""
            visible: active
            height: active && item ? item.implicitHeight : 0
            sourceComponent: Timeline {
                objectName: "timeline"
                title: program.recording
                topicRows: Math.max(3, Math.min(8, Math.floor(strip.parent.height / 140)))
                tools: true
            }
        }
        Item {
            id: box
            objectName: "recorderBox"
            width: parent.width
            visible: strip.usesRecorder_
            height: visible ? Math.max(recorder.implicitHeight, limits.height) : 0
            Rectangle {
                anchors { fill: parent; margins: -Theme.gap / 4 }
                visible: recorder.recording
                color: "transparent"
                radius: Theme.radius
                border { color: Theme.bad; width: 3 }
            }
            Recorder {
                id: recorder
                objectName: "recorder"
                anchors { left: parent.left; right: limits.left; rightMargin: Theme.gap; top: parent.top; bottom: parent.bottom }
                title: qsTr("Recorder")
                sizeLimit: limit.currentIndex < limit.bytes.length ? limit.bytes[limit.currentIndex] : 0
                onFinished: function(file, reason) { program.say(file ? qsTr("recorded to %1").arg(file) + " (" + reason + ")" : reason) }
                onFailed: function(reason) { program.say(reason) }
            }
            Column {
                id: limits
                anchors { right: parent.right; top: parent.top }
                spacing: Theme.gap / 2
                ThemeText { text: qsTr("ends at"); color: Theme.dim; font.pixelSize: Theme.small }
                ThemeChoice {
                    id: limit
                    objectName: "sizeLimit"
                    readonly property var bytes: [1e9, 4e9, 16e9, 64e9]
                    name: qsTr("Size at which the recording ends")
                    enabled: !recorder.recording
                    model: [qsTr("1 GB"), qsTr("4 GB"), qsTr("16 GB"), qsTr("64 GB"), qsTr("no limit")]
                    currentIndex: 1
                }
                ThemeButton {
                    objectName: "closeRecorder"
                    text: qsTr("Close")
                    visible: !recorder.recording
                    onClicked: strip.opened_ = false
                }
            }
        }
    }
}
