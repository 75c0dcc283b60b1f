import QtQuick

Item {
    property int alive: 1
    Component.onCompleted: noSuchFunction()
    function later() { timer.start() }
    Timer { id: timer; interval: 1; onTriggered: undefined.field = 1 }
}
