// What `rosglass cockpit` shows without a layout: robots that answer, what to show of them, and files opened lately.
import QtQuick 2.15
import RosControls 1.0

Rectangle {
    id: page

    // For the tour.
    readonly property Item robotTools: robotTools_
    readonly property Item layoutTools: proposals.visible ? proposals : layoutTools_

    signal fileWanted(string purpose)

    color: Theme.background
    Accessible.role: Accessible.Pane
    Accessible.name: qsTr("Start")

    Flickable {
        anchors { fill: parent; margins: 2 * Theme.gap }
        contentHeight: column.height
        clip: true

        Column {
            id: column
            width: parent.width
            spacing: 2 * Theme.gap

            ThemeText {
                width: parent.width
                text: program.recording !== "" ? program.recording : program.connected ? qsTr("Connected to %1").arg(program.url) : qsTr("Which robot?")
                font { pixelSize: 2 * Theme.large; weight: Font.DemiBold }
            }
            Column {
                width: parent.width
                spacing: Theme.gap
                Repeater {
                    model: program.robots
                    delegate: Rectangle {
                        width: parent.width
                        height: Math.max(Theme.touch, what.implicitHeight) + 2 * Theme.gap
                        radius: Theme.radius
                        color: Theme.panel
                        border { color: modelData.answers ? Theme.accent : Theme.edge; width: 1 }
                        Column {
                            id: what
                            anchors { left: parent.left; right: use.left; margins: Theme.gap; verticalCenter: parent.verticalCenter }
                            ThemeText {
                                width: parent.width
                                text: modelData.url
                                font.weight: Font.DemiBold
                            }
                            ThemeText {
                                width: parent.width
                                text: modelData.text
                                color: modelData.answers ? Theme.text : Theme.dim
                                wrapMode: Text.Wrap
                                maximumLineCount: 4
                            }
                        }
                        ThemeButton {
                            id: use
                            objectName: "use"
                            anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                            visible: modelData.answers
                            text: modelData.used ? qsTr("Connected") : qsTr("Connect")
                            selected: modelData.used
                            Accessible.name: qsTr("Connect to %1").arg(modelData.url)
                            onClicked: program.connectTo(modelData.url)
                        }
                    }
                }
            }
            Row {
                id: robotTools_
                spacing: Theme.gap
                ThemeField {
                    id: address
                    objectName: "address"
                    width: 360 * Theme.size
                    placeholderText: qsTr("another address, e.g. zenoh://robot.local:7447, ros1://robot:11311")
                    onAccepted: program.connectTo(text)
                }
                ThemeButton { text: qsTr("Connect"); enabled: address.text !== ""; onClicked: program.connectTo(address.text) }
                ThemeButton { objectName: "search"; text: program.searching ? qsTr("Searching …") : qsTr("Search again"); enabled: !program.searching; onClicked: program.searchRobots() }
                ThemeButton { objectName: "openRecording"; text: qsTr("Open a recording …"); onClicked: page.fileWanted("open recording") }
                ThemeButton { objectName: "tour"; text: qsTr("Try it on a simulated robot"); onClicked: program.startTour() }
            }

            Column {
                width: parent.width
                spacing: Theme.gap
                visible: program.proposals.length > 0
                Row {
                    id: proposals
                    spacing: Theme.gap
                    ThemeText {
                        anchors.verticalCenter: parent.verticalCenter
                        text: (program.recording !== "" ? qsTr("This recording has data for %1 panels") : qsTr("This robot offers data for %1 panels")).arg(program.proposals.length)
                        font { pixelSize: Theme.large; weight: Font.DemiBold }
                    }
                    ThemeButton { objectName: "addAll"; text: qsTr("Show all"); onClicked: program.addAll() }
                }
                Flow {
                    width: parent.width
                    spacing: Theme.gap
                    Repeater {
                        model: program.proposals
                        delegate: Rectangle {
                            width: Math.min(page.width - 4 * Theme.gap, 300 * Theme.size)
                            height: 2 * Theme.touch
                            radius: Theme.radius
                            color: Theme.panel
                            border { color: Theme.edge; width: 1 }
                            Column {
                                anchors { fill: parent; margins: Theme.gap }
                                ThemeText { width: parent.width; text: modelData.title; font.weight: Font.DemiBold }
                                ThemeText { width: parent.width; text: modelData.reason; color: Theme.dim; wrapMode: Text.Wrap; maximumLineCount: 2 }
                            }
                        }
                    }
                }
            }

            Column {
                width: parent.width
                spacing: Theme.gap
                ThemeText { text: qsTr("Layouts"); font { pixelSize: Theme.large; weight: Font.DemiBold } }
                Row {
                    id: layoutTools_
                    spacing: Theme.gap
                    ThemeButton { objectName: "new"; text: qsTr("New, empty"); onClicked: program.run("new") }
                    ThemeButton { text: qsTr("Open …"); onClicked: page.fileWanted("open") }
                    ThemeButton { objectName: "back"; visible: program.hasLayout; text: qsTr("Back to %1").arg(program.name); onClicked: program.run("home") }
                }
                Repeater {
                    model: program.recent
                    delegate: ThemeButton {
                        width: Math.min(parent.width, 700 * Theme.size)
                        text: modelData
                        Accessible.name: qsTr("Open %1").arg(modelData)
                        onClicked: program.open(modelData)
                    }
                }
            }
        }
    }
}
