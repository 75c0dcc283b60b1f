// The slim title bar of a panel.
import QtQuick 2.15
import RosControls 1.0

FocusScope {
    id: bar

    property Item panel: null
    readonly property Item cockpit_: panel ? panel.cockpit_ : null

    focus: true
    Accessible.role: Accessible.TitleBar
    Accessible.name: panel ? panel.title_ : ""
    Accessible.focusable: true
    Keys.onPressed: function(event) {
        if (cockpit_ && cockpit_.drag_)
            event.accepted = cockpit_.drag_.key(panel, event)
    }

    function rename() {
        field.active = true
    }

    // Nothing of it exists for a panel in tabs.
    Loader {
        id: face
        anchors.fill: parent
        active: bar.height > 0
        sourceComponent: Item {
            HoverHandler { id: hover }
            PanelGrip {
                anchors.fill: parent
                panel: bar.panel
            }
            ThemeText {
                id: title
                anchors { left: parent.left; leftMargin: Theme.gap * 0.8; verticalCenter: parent.verticalCenter }
                width: Math.max(0, Math.min(implicitWidth, status.x - x - Theme.gap))
                visible: !field.active
                text: bar.panel ? bar.panel.title_ : ""
                color: bar.panel && bar.panel.current_ ? Theme.text : Theme.dim
                font { pixelSize: Theme.small; weight: Font.DemiBold }
            }
            PanelStatus {
                id: status
                anchors { right: buttons.left; rightMargin: Theme.gap * 0.8; verticalCenter: parent.verticalCenter }
                width: Math.max(0, Math.min(implicitWidth, (buttons.x - Theme.gap) * (title.text ? 0.65 : 1)))
                panel: bar.panel
            }
            FocusRing { anchors.margins: 1; radius: Theme.radius / 2; visible: bar.activeFocus && !field.active }
            PanelButtons {
                id: buttons
                anchors { right: parent.right; top: parent.top; bottom: parent.bottom }
                panel: bar.panel
                hovered: hover.hovered
            }
        }
    }
    Loader {
        id: field
        anchors { left: parent.left; right: parent.right; verticalCenter: parent.verticalCenter }
        active: false
        sourceComponent: ThemeField {
            objectName: "titleField"
            height: Math.max(bar.height, Math.round(24 * Theme.size))
            topPadding: 0
            bottomPadding: 0
            font.pixelSize: Theme.small
            text: bar.panel.title
            placeholderText: qsTr("Title")
            Component.onCompleted: {
                forceActiveFocus()
                selectAll()
            }
            onEditingFinished: if (field.active) done_(true)
            Keys.onEscapePressed: done_(false)
            function done_(keep) {
                const wanted = text.trim()
                field.active = false
                bar.forceActiveFocus()
                if (keep && wanted !== bar.panel.title && bar.cockpit_)
                    bar.cockpit_.renamed(bar.panel, wanted)
            }
        }
    }
}
