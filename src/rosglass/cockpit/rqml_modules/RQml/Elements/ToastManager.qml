// Messages at the bottom of a panel, which leave by themselves.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import RQml.Fonts

Item {
    id: toasts

    readonly property int count: messages.count
    property int maxToasts: 5
    // Milliseconds until a message leaves; it stays while the pointer is on it.
    property int dismissDuration: 5000

    // The level is "info", "warning" or "error".
    function show(message, level) {
        if (messages.count >= maxToasts)
            messages.remove(0)
        messages.append({ message: String(message), level: level || "info" })
    }

    anchors { right: parent ? parent.right : undefined; bottom: parent ? parent.bottom : undefined; margins: 12 }
    width: Math.min(420, parent ? parent.width * 0.8 : 420)
    height: list.contentHeight

    ListModel { id: messages }
    ListView {
        id: list
        anchors.fill: parent
        interactive: false
        spacing: 8
        model: messages
        delegate: Rectangle {
            id: toast
            required property int index
            required property string message
            required property string level
            width: list.width
            height: row.implicitHeight + 16
            radius: 6
            color: level === "error" ? "#a3222f" : level === "warning" ? "#94590a" : "#37474f"
            Accessible.role: Accessible.AlertMessage
            Accessible.name: message

            HoverHandler { id: pointer }
            Timer {
                running: !pointer.hovered
                interval: toasts.dismissDuration
                onTriggered: messages.remove(toast.index)
            }
            RowLayout {
                id: row
                anchors { fill: parent; margins: 8 }
                spacing: 10

                Label {
                    textFormat: Text.PlainText
                    text: toast.level === "error" ? IconFont.iconError : toast.level === "warning" ? IconFont.iconWarning : IconFont.iconInfo
                    font { family: IconFont.name; pixelSize: 18 }
                    color: "white"
                }
                Label {
                    Layout.fillWidth: true
                    text: toast.message
                    textFormat: Text.PlainText
                    wrapMode: Text.Wrap
                    maximumLineCount: 12
                    elide: Text.ElideRight
                    color: "white"
                }
                IconButton {
                    flat: true
                    text: IconFont.iconClose
                    tooltipText: qsTr("Close")
                    palette.buttonText: "white"
                    onClicked: messages.remove(toast.index)
                }
            }
        }
    }
}
