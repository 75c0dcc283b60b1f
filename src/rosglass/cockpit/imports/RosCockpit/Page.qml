// One page of a Cockpit; only one is shown at a time. Several children are side by side, as in a Split.
import QtQuick 2.15
import RosControls 1.0

Split {
    id: page

    element_: "page"
    // Its name on the bar.
    property string title

    anchors { fill: parent; margins: spacing }
    // Below what is written beside the pages.
    z: -1
    visible: !cockpit_ || cockpit_.page === page
    Accessible.role: Accessible.Pane
    Accessible.name: title
}
