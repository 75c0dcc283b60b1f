// One page of a Cockpit; only one is shown at a time. Several children are side by side, as in a Split.
import QtQuick 2.15
import RosControls 1.0
import "elements.js" as Elements

Split {
    id: page

    element_: "page"
    // Its name on the bar.
    property string title
    // Namespace of the robot that it is about; empty if it is not about one.
    property string ns
    readonly property bool isShown_: !cockpit_ || cockpit_.page === page

    anchors { fill: parent; margins: spacing }
    // A page from which a panel is dragged to another one keeps the mouse.
    visible: isShown_ || (cockpit_.drag_ && cockpit_.drag_.panel && Elements.contains(page, cockpit_.drag_.panel)) === true
    opacity: isShown_ ? 1 : 0
    z: isShown_ ? 1 : 0
    Accessible.role: Accessible.Pane
    Accessible.name: title
}
