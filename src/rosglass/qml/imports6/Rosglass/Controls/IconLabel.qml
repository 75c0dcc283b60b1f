// Takes the place of Qt's IconLabel, the content of buttons, menu items and delegates: shows plain text.
import QtQuick 2.15
// Qt's own type; ours is of all later versions.
import QtQuick.Controls.impl 2.3 as Impl

Item {
    id: root

    property string text
    property alias icon: label.icon
    property alias display: label.display
    property alias spacing: label.spacing
    property alias mirrored: label.mirrored
    property alias alignment: label.alignment
    property alias font: label.font
    property alias color: label.color
    property color defaultIconColor: "transparent"
    property alias topPadding: label.topPadding
    property alias leftPadding: label.leftPadding
    property alias rightPadding: label.rightPadding
    property alias bottomPadding: label.bottomPadding

    // Beyond this it is elided: the style Material draws shadows of a button in its size, in memory.
    implicitWidth: Math.min(label.implicitWidth, 4096)
    implicitHeight: Math.min(label.implicitHeight, 4096)
    baselineOffset: label.baselineOffset

    // An alias to what is new in version 6.11 would be an endless loop in Qt's cache of compiled files.
    Binding { target: label; property: "defaultIconColor"; value: root.defaultIconColor }

    Impl.IconLabel {
        id: label
        anchors.fill: parent
        // A word joiner, which is not drawn: Qt takes the text for no markup then.
        text: root.text.replace(/<|&(?=lt;)/g, "$&\u2060")
    }
}
