// Uses what RQml offers to a plugin: context, uniqueName, RQml, a least size, the palette.
import QtQuick
import Ros2
import "parts"

Rectangle {
    id: root

    property var kddockwidgets_min_size: Qt.size(500, 120)
    property var before: context.count
    property var shown: context.count ?? "none"
    property string name: uniqueName
    property var topicsAtStart: []
    property color background: palette.base
    readonly property Item inner: part

    function write(key, value) { context[key] = value }
    function change() { context.limits.max = 5 }
    function api(name, args) { return RQml[name].apply(RQml, args) }

    anchors.fill: parent
    color: palette.base
    Component.onCompleted: topicsAtStart = Ros2.queryTopics()

    Part { id: part }
}
