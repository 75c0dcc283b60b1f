// What the parts of a robot report about themselves, of diagnostic_msgs/DiagnosticArray.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: diagnostics

    // The topic; without one, the first of this type.
    property string topic
    property string ns
    // Seconds without a report after which a part counts as silent.
    property alias silentAfter: live.silentAfter
    // Shows only parts whose name, hardware or text has it; empty for all.
    property alias filter: live.filter
    // Numbers of parts.
    readonly property alias oks: live.oks
    readonly property alias warnings: live.warnings
    readonly property alias errors: live.errors
    readonly property alias stales: live.stales
    readonly property alias total: live.total
    // A DiagnosticsTopic, for an AlarmList.
    readonly property var reports: live

    readonly property var tints_: [Theme.good, Theme.warn, Theme.bad, Theme.dim]

    function level_(level) { return [qsTr("ok"), qsTr("warning"), qsTr("error"), qsTr("stale")][level] }

    title: qsTr("Diagnostics")
    source: live
    contentWidth: 260 * Theme.size
    contentHeight: 120 * Theme.size
    note: {
        const parts = []
        if (errors)
            parts.push(errors === 1 ? qsTr("1 error") : qsTr("%1 errors").arg(errors))
        if (stales)
            parts.push(qsTr("%1 stale").arg(stales))
        if (warnings)
            parts.push(warnings === 1 ? qsTr("1 warning") : qsTr("%1 warnings").arg(warnings))
        return !total ? "" : parts.join(", ") || qsTr("all good")
    }

    DiagnosticsTopic {
        id: live
        topic: diagnostics.topic
        ns: diagnostics.ns
    }

    ThemeList {
        id: list
        objectName: "list"
        anchors.fill: parent
        name: diagnostics.title
        model: live.rows
        // The worst are above: what is below is as bad only if what is hidden first is.
        moreTint: live.omitted ? Theme.warn : Theme.dim
        more: {
            const parts = []
            const hidden = live.total - (live.rows ? live.rows.count : 0)
            if (live.filter && hidden > 0)
                parts.push(qsTr("%1 filtered out").arg(hidden))
            if (live.omitted)
                parts.push(qsTr("%1 reports of further parts not shown").arg(live.omitted))
            if (live.lost)
                parts.push(qsTr("%1 messages lost").arg(live.lost))
            return parts.join(" · ")
        }
        onChosen: function(index) { live.toggle(index) }
        delegate: Item {
            id: row
            readonly property color tint: diagnostics.tints_[model.level]
            readonly property string summary: model.silent >= 0 ? Fields.fill(qsTr("silent for %1 s, said: %2"), [model.silent, model.text]) : model.text
            width: ListView.view.width
            height: line.height + (details.item ? details.item.height + Theme.gap / 2 : 0)

            Accessible.role: Accessible.ListItem
            Accessible.name: model.name + ": " + diagnostics.level_(model.level) + ", " + summary
            Accessible.onPressAction: live.toggle(index)

            Rectangle {
                anchors.fill: parent
                visible: row.ListView.isCurrentItem
                color: Theme.track
                radius: 3
            }
            Item {
                id: line
                width: parent.width
                height: Math.round(Theme.normal * 1.7)
                Rectangle {
                    x: 2
                    anchors.verticalCenter: parent.verticalCenter
                    width: Theme.gap * 0.8; height: width; radius: width / 2
                    color: row.tint
                }
                ThemeText {
                    id: partName
                    x: Theme.gap * 1.5
                    anchors.verticalCenter: parent.verticalCenter
                    width: Math.min(implicitWidth, row.width * 0.45)
                    text: model.name
                }
                ThemeText {
                    visible: width > 20
                    anchors { left: partName.right; leftMargin: Theme.gap; right: first.left; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                    text: row.summary
                    color: model.level === 0 ? Theme.dim : row.tint
                    maximumLineCount: 1
                }
                ThemeText {
                    id: first
                    anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                    width: Math.min(implicitWidth, row.width * 0.25)
                    text: model.silent < 0 && model.values.length && !model.open ? model.values[0].value : ""
                    maximumLineCount: 1
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
                TapHandler {
                    onTapped: {
                        list.currentIndex = index
                        live.toggle(index)
                    }
                }
            }
            Loader {
                id: details
                active: model.open
                anchors { top: line.bottom; left: parent.left; leftMargin: Theme.gap * 1.5; right: parent.right; rightMargin: Theme.gap }
                sourceComponent: Column {
                    ThemeText {
                        width: parent.width
                        text: row.summary
                        color: row.tint
                        wrapMode: Text.Wrap
                        font.pixelSize: Theme.small
                    }
                    ThemeText {
                        width: parent.width
                        visible: text !== ""
                        text: model.hardware ? qsTr("hardware: %1").arg(model.hardware) : ""
                        color: Theme.dim
                        font.pixelSize: Theme.small
                    }
                    Repeater {
                        model: row.values_
                        Item {
                            width: parent.width
                            height: Math.max(key.height, value.height)
                            ThemeText {
                                id: key
                                width: parent.width * 0.4 - Theme.gap
                                text: modelData.key
                                color: Theme.dim
                                font.pixelSize: Theme.small
                            }
                            ThemeText {
                                id: value
                                x: parent.width * 0.4
                                width: parent.width * 0.6
                                text: modelData.value
                                wrapMode: Text.Wrap
                                maximumLineCount: 20
                                font.pixelSize: Theme.small
                            }
                        }
                    }
                    ThemeText {
                        visible: text !== ""
                        text: row.more_ ? qsTr("%1 more values").arg(row.more_) : ""
                        color: Theme.warn
                        font.pixelSize: Theme.small
                    }
                }
            }
            readonly property var values_: model.open ? model.values : []
            readonly property int more_: model.more
        }
    }
}
