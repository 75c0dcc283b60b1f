// Where a field of a MessageView is dropped: reports its path. An array counts as its first element.
import QtQuick 2.15

DropArea {
    id: area

    // Whether paths of all elements of an array ("ranges[*]") are taken as they are.
    property bool arrays: false

    // A field was dropped.
    signal taken(string path)

    keys: ["rosglass/path"]
    onDropped: function(drop) {
        const path = drop.source && drop.source.path ? drop.source.path : drop.getDataAsString("rosglass/path")
        if (path)
            taken(arrays ? path : path.replace("[*]", "[0]"))
        drop.accept()
    }
    Rectangle {
        anchors.fill: parent
        visible: area.containsDrag
        color: "transparent"
        border { color: Theme.accent; width: 2 }
    }
}
