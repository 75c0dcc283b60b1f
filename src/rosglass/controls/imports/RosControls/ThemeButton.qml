// A button of the theme; `tint` is its colour, e.g. Theme.bad for what cannot be undone.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.AbstractButton {
    id: button

    property color tint: Theme.accent
    // Whether it is shown as the chosen one of several, or as on.
    property bool selected: false
    readonly property bool lit_: down || checked || selected

    function press_() {
        if (checkable)
            toggle()
        clicked()
    }

    implicitWidth: Math.max(Theme.touch, label.implicitWidth + 2 * Theme.gap)
    implicitHeight: Theme.touch
    focusPolicy: Qt.StrongFocus
    hoverEnabled: true
    Accessible.role: checkable ? Accessible.CheckBox : Accessible.Button
    Accessible.name: text
    Accessible.checked: checked || selected
    Accessible.onPressAction: press_()
    Keys.onReturnPressed: press_()
    Keys.onEnterPressed: press_()

    contentItem: ThemeText {
        id: label
        text: button.text
        color: !button.enabled ? Theme.faint : button.lit_ ? Theme.onAccent : button.tint
        font.weight: Font.DemiBold
        horizontalAlignment: Text.AlignHCenter
        verticalAlignment: Text.AlignVCenter
    }
    background: Rectangle {
        radius: Theme.radius
        color: !button.enabled ? "transparent" : button.lit_ ? button.tint
            : button.hovered ? Theme.track : "transparent"
        border { color: button.enabled ? button.tint : Theme.faint; width: 1 }
        FocusRing { item: parent; visible: button.visualFocus }
    }
}
