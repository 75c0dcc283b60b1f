// A list that shows when it is being loaded.
import QtQuick
import QtQuick.Controls

ListView {
    id: list

    property bool isLoading: false

    clip: true
    boundsBehavior: Flickable.StopAtBounds
    ScrollBar.vertical: ScrollBar { policy: list.contentHeight > list.height ? ScrollBar.AlwaysOn : ScrollBar.AlwaysOff }

    Rectangle {
        z: 3
        anchors.fill: parent
        visible: list.isLoading
        color: list.palette.base
        opacity: 0.6
    }
    BusyIndicator {
        z: 4
        anchors.centerIn: parent
        running: list.isLoading
    }
}
