// A button of a row of which one is selected: for pages, and for tabs.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

T.AbstractButton {
    id: button

    property bool selected: false
    // Whether something is wrong there.
    property bool wrong: false
    // What it says to screen readers, and its key.
    property string name: text
    property string hint

    implicitWidth: label.implicitWidth + 2 * Theme.gap
    focusPolicy: Qt.TabFocus
    hoverEnabled: true
    Accessible.role: Accessible.PageTab
    Accessible.name: name
    Accessible.description: hint
    Accessible.selected: selected
    Accessible.onPressAction: clicked()
    Keys.onReturnPressed: clicked()
    Keys.onEnterPressed: clicked()

    contentItem: ThemeText {
        id: label
        text: button.text
        color: button.wrong ? Theme.bad : button.selected ? Theme.text : Theme.dim
        font.weight: button.selected ? Font.DemiBold : Font.Normal
        horizontalAlignment: Text.AlignHCenter
        verticalAlignment: Text.AlignVCenter
    }
    background: Rectangle {
        color: button.hovered || button.down ? Theme.track : "transparent"
        Rectangle {
            anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
            height: Math.max(2, Math.round(3 * Theme.size))
            visible: button.selected
            color: Theme.accent
        }
        FocusRing { item: parent; anchors.margins: 1; visible: button.visualFocus }
    }
}
