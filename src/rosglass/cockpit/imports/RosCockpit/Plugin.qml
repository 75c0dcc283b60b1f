// A plugin of RQml. It fills the panel, and scrolls where that is smaller than the plugin allows.
import QtQuick 2.15
import RosControls 1.0
import RosCockpit 1.0

FocusScope {
    id: plugin

    // Path (in the layout's folder), package://PACKAGE/qml/File.qml, or the plugin's id.
    property string source
    // What the plugin keeps: numbers, texts, truth values, lists and objects.
    property var context: ({})
    // The name that the plugin gets as `uniqueName`; empty for one that is made.
    property string uniqueName

    // "empty", "waiting", "ready", "failed" or "stopped"; why it is not shown.
    readonly property string status: loader.status
    readonly property string problem: loader.problem
    // The last error of the running plugin, and how many there were.
    readonly property string complaint: loader.complaint
    readonly property int complaints: loader.complaints
    // The file that is shown, and the least size that it asks for, which a Panel reads.
    readonly property string file: loader.file
    readonly property size kddockwidgets_min_size: Qt.size(loader.leastWidth, loader.leastHeight)

    // The plugin has changed what it keeps: contextText() has it as QML.
    signal contextEdited()

    function contextText() { return loader.contextText() }
    function reload() { loader.reload() }

    implicitWidth: Math.max(loader.leastWidth, 240 * Theme.size)
    implicitHeight: Math.max(loader.leastHeight, 160 * Theme.size)
    clip: true
    Accessible.role: Accessible.Pane
    Accessible.name: source
    Accessible.description: problem || complaint

    Flickable {
        id: area
        width: parent.width
        height: parent.height - strip.height
        contentWidth: loader.width
        contentHeight: loader.height
        interactive: contentWidth > width || contentHeight > height
        boundsBehavior: Flickable.StopAtBounds
        clip: true
        visible: loader.status === "ready"

        PluginLoader {
            id: loader
            width: Math.max(area.width, leastWidth)
            height: Math.max(area.height, leastHeight)
            source: plugin.source
            values: plugin.context
            name: plugin.uniqueName
            colors: ({
                window: Theme.background, windowText: Theme.text, base: Theme.panel, alternateBase: Theme.track,
                text: Theme.text, button: Theme.track, buttonText: Theme.text, brightText: Theme.bad,
                light: Theme.edge, midlight: Theme.edge, mid: Theme.faint, dark: Theme.faint, shadow: Theme.background,
                highlight: Theme.accent, highlightedText: Theme.onAccent, link: Theme.accent, linkVisited: Theme.accent,
                toolTipBase: Theme.track, toolTipText: Theme.text, placeholderText: Theme.dim, accent: Theme.accent
            })
            onContextEdited: plugin.contextEdited()
        }
        // The bars show that there is more, and where.
        Rectangle {
            x: area.contentX + area.width - width
            y: area.contentY + area.visibleArea.yPosition * area.height
            width: 4
            height: area.visibleArea.heightRatio * area.height
            color: Theme.faint
            visible: area.contentHeight > area.height
        }
        Rectangle {
            x: area.contentX + area.visibleArea.xPosition * area.width
            y: area.contentY + area.height - height
            width: area.visibleArea.widthRatio * area.width
            height: 4
            color: Theme.faint
            visible: area.contentWidth > area.width
        }
    }
    Rectangle {
        id: strip
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: visible ? Theme.touch : 0
        visible: loader.status === "ready" && loader.complaints > 0
        color: Theme.track
        Accessible.role: Accessible.AlertMessage
        Accessible.name: complaintText.text

        ThemeText {
            id: complaintText
            anchors { left: parent.left; right: hide.left; verticalCenter: parent.verticalCenter; margins: Theme.gap / 2 }
            font.pixelSize: Theme.small
            color: Theme.warn
            maximumLineCount: 1
            text: (loader.complaints > 1 ? qsTr("%1 errors in this plugin, the last: ").arg(loader.complaints)
                : qsTr("An error in this plugin: ")) + loader.complaint.replace(/^\S*\//, "").replace(/\s+/g, " ")
        }
        ThemeButton {
            id: hide
            anchors { right: parent.right; verticalCenter: parent.verticalCenter; rightMargin: Theme.gap / 2 }
            height: parent.height - 4
            text: qsTr("Hide")
            tint: Theme.dim
            onClicked: loader.forgive()
        }
    }
    Item {
        anchors { fill: parent; margins: Theme.gap }
        visible: loader.status !== "ready"

        Flickable {
            anchors { left: parent.left; right: parent.right; top: parent.top; bottom: again.visible ? again.top : parent.bottom; bottomMargin: Theme.gap / 2 }
            contentHeight: said.implicitHeight
            clip: true
            boundsBehavior: Flickable.StopAtBounds

            ThemeText {
                id: said
                width: parent.width
                wrapMode: Text.Wrap
                elide: Text.ElideNone
                color: loader.problem ? Theme.bad : Theme.dim
                text: loader.status === "failed" ? qsTr("This plugin cannot be shown.\n%1").arg(loader.problem)
                    : loader.status === "stopped" ? qsTr("This plugin was stopped, so that the other panels live on.\n%1").arg(loader.problem)
                    : loader.status === "waiting" ? qsTr("Waiting for the robot ...")
                    : qsTr("Set source to the file of a plugin of RQml, or to its id.")
                Accessible.role: loader.problem ? Accessible.AlertMessage : Accessible.StaticText
                Accessible.name: text
            }
        }
        ThemeButton {
            id: again
            anchors { left: parent.left; bottom: parent.bottom }
            visible: loader.status === "failed" || loader.status === "stopped"
            text: qsTr("Load again")
            onClicked: loader.reload()
        }
    }
}
