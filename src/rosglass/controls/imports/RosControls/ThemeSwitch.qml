// A switch of the theme, for what is on or off.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.Switch {
    id: toggle

    property color tint: Theme.accent

    // Not by click(), which does not report toggled() in Qt 5.
    function press_() {
        toggle.toggle()
        toggled()
        clicked()
    }

    implicitWidth: text ? label.implicitWidth : indicator.width
    implicitHeight: Theme.touch
    focusPolicy: Qt.StrongFocus
    Accessible.role: Accessible.CheckBox
    Accessible.name: text
    Keys.onReturnPressed: press_()
    Keys.onEnterPressed: press_()

    indicator: Rectangle {
        y: (toggle.height - height) / 2
        width: Theme.touch
        height: Theme.touch * 0.56
        radius: height / 2
        color: toggle.checked && toggle.enabled ? toggle.tint : Theme.track
        border { color: toggle.enabled ? toggle.tint : Theme.faint; width: 1 }
        Rectangle {
            x: 3 + toggle.visualPosition * (parent.width - width - 6)
            y: 3
            width: parent.height - 6
            height: width
            radius: width / 2
            color: !toggle.enabled ? Theme.faint : toggle.checked ? Theme.onAccent : toggle.tint
        }
        FocusRing { item: parent; radius: height / 2; visible: toggle.visualFocus }
    }
    contentItem: ThemeText {
        id: label
        leftPadding: Theme.touch + Theme.gap
        visible: toggle.text !== ""
        text: toggle.text
        color: toggle.enabled ? Theme.text : Theme.faint
        verticalAlignment: Text.AlignVCenter
    }
}
