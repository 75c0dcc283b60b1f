// A few hints beside the places that they are about; they take no clicks but their own. Escape ends them.
import QtQuick 2.15
import RosControls 1.0

Item {
    id: tour

    // [{ item: the place, text: the hint }, ...]
    property var steps: []
    readonly property bool running: at_ >= 0
    property int at_: -1
    readonly property var step_: running ? steps[at_] : null
    readonly property Item place_: step_ ? step_.item : null

    signal ended()

    function start() {
        at_ = 0
        next.forceActiveFocus(Qt.TabFocusReason)
    }

    function end() {
        if (!running)
            return
        at_ = -1
        ended()
    }

    function forward_() {
        if (at_ + 1 < steps.length)
            at_ += 1
        else
            end()
    }

    visible: running
    onPlace_Changed: box.follow()

    // The place moves when robots are found, and with the window.
    Timer {
        interval: 200
        repeat: true
        running: tour.running
        onTriggered: box.follow()
    }
    Rectangle {
        id: box
        objectName: "hint"

        // The place in this item.
        property rect target

        function follow() {
            const place = tour.place_
            if (!place || !place.visible) {
                target = Qt.rect(tour.width / 2, 0, 0, 0)
                return
            }
            const at = place.mapToItem(tour, 0, 0)
            target = Qt.rect(at.x, at.y, place.width, Math.min(place.height, tour.height / 3))
        }
        width: Math.min(340 * Theme.size, tour.width - 2 * Theme.gap)
        height: column.implicitHeight + 2 * Theme.gap
        x: Math.max(Theme.gap, Math.min(target.x, tour.width - width - Theme.gap))
        y: Math.max(Theme.gap, Math.min(target.y + target.height + Theme.gap, tour.height - height - Theme.gap))
        radius: Theme.radius
        color: Theme.panel
        border { color: Theme.accent; width: 2 }
        Accessible.role: Accessible.Dialog
        Accessible.name: qsTr("Tour")
        Accessible.description: said.text

        // A press on the box is not one on what is below it.
        MouseArea { anchors.fill: parent }
        Column {
            id: column
            anchors { left: parent.left; right: parent.right; top: parent.top; margins: Theme.gap }
            spacing: Theme.gap
            ThemeText {
                id: said
                objectName: "hintText"
                width: parent.width
                text: tour.step_ ? tour.step_.text : ""
                wrapMode: Text.Wrap
                Accessible.role: Accessible.AlertMessage
                Accessible.name: text
            }
            Item {
                width: parent.width
                height: next.height
                ThemeText {
                    anchors.verticalCenter: parent.verticalCenter
                    text: qsTr("%1 of %2").arg(tour.at_ + 1).arg(tour.steps.length)
                    color: Theme.dim
                }
                ThemeButton {
                    objectName: "hintSkip"
                    anchors { right: next.left; rightMargin: Theme.gap }
                    visible: tour.at_ + 1 < tour.steps.length
                    text: qsTr("Skip")
                    Accessible.name: qsTr("Skip the tour")
                    onClicked: tour.end()
                }
                ThemeButton {
                    id: next
                    objectName: "hintNext"
                    anchors.right: parent.right
                    text: tour.at_ + 1 < tour.steps.length ? qsTr("Next") : qsTr("Done")
                    onClicked: tour.forward_()
                }
            }
        }
    }
    Rectangle {
        x: box.target.x - 3
        y: box.target.y - 3
        width: box.target.width + 6
        height: box.target.height + 6
        visible: box.target.width > 0
        color: "transparent"
        radius: Theme.radius
        border { color: Theme.warn; width: 2 }
    }
}
