// The buttons over a map; on a small one they are behind one button, and go when one of them was
// used. A part of the maps.
import QtQuick 2.15

Flow {
    id: tools

    // The map's view.
    property Item view: parent
    // Whether there are any buttons.
    property bool shown: true
    readonly property bool folds: view.width < 250 * Theme.size || view.height < 160 * Theme.size
    property bool open: false
    // Whether the buttons are seen.
    readonly property bool unfolded: shown && (open || !folds)

    spacing: Theme.gap / 2
    onFoldsChanged: open = false

    MapButton {
        objectName: "tools"
        visible: tools.shown && tools.folds
        text: qsTr("Tools")
        checkable: true
        checked: tools.open
        onClicked: tools.open = !tools.open
    }
}
