// A page of the documentation over the window; Escape closes it.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

T.Popup {
    id: box

    readonly property color links_: Theme.accent
    onLinks_Changed: program.useLinkColor(links_)
    Component.onCompleted: program.useLinkColor(links_)

    parent: T.Overlay.overlay
    anchors.centerIn: parent
    width: parent ? Math.min(820 * Theme.size, parent.width - 4 * Theme.gap) : 100
    height: parent ? parent.height - 8 * Theme.gap : 100
    modal: true
    focus: true
    padding: 2 * Theme.gap
    onClosed: program.closeHelp()

    background: Rectangle {
        color: Theme.panel
        radius: Theme.radius
        border { color: Theme.edge; width: 1 }
    }
    contentItem: FocusScope {
        Flickable {
            id: flick
            anchors { left: parent.left; right: parent.right; top: parent.top; bottom: done.top; bottomMargin: Theme.gap }
            contentWidth: width
            contentHeight: page.implicitHeight
            clip: true
            focus: true
            Keys.onDownPressed: contentY = Math.min(contentY + 60, Math.max(0, contentHeight - height))
            Keys.onUpPressed: contentY = Math.max(0, contentY - 60)
            Text {
                id: page
                objectName: "helpPage"
                width: flick.width - Theme.gap
                // Only rosglass's own pages are shown here.
                textFormat: Text.MarkdownText
                text: program.helpText
                color: Theme.text
                linkColor: Theme.accent
                wrapMode: Text.WordWrap
                font.pixelSize: Theme.normal
                Accessible.role: Accessible.StaticText
                Accessible.name: text
                onLinkActivated: function(link) { program.follow(link) }
            }
            T.ScrollBar.vertical: ThemeScrollBar {}
        }
        ThemeButton {
            id: done
            anchors { right: parent.right; bottom: parent.bottom }
            text: qsTr("Close")
            onClicked: box.close()
        }
    }
}
