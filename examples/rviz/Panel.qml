// A titled card, marked as old if `stale`, and dimmed if it `dims`.
import QtQuick 2.15

Rectangle {
    id: panel
    property string title
    property string note
    property bool stale: false
    // Whether the note is a warning.
    property bool alarming: false
    property bool dims: true
    // Too little room beside the title: shown below.
    readonly property bool narrow: width < 110
    default property alias content: body.data

    color: Theme.panel
    radius: 6
    border.color: stale ? Theme.bad : Theme.edge
    Text {
        x: 9; y: 6
        width: (panel.narrow ? parent.width : note.x) - 13
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: panel.title.toUpperCase()
        color: Theme.dim
        font { pixelSize: 10; letterSpacing: 1; weight: Font.DemiBold }
    }
    Item {
        id: body
        anchors { fill: parent; margins: 8; topMargin: 24 }
        opacity: panel.stale && panel.dims ? 0.3 : 1
    }
    Text {
        id: note
        x: panel.narrow ? (panel.width - width) / 2 : panel.width - width - 9
        y: panel.narrow ? panel.height - height - 7 : 6
        textFormat: Text.PlainText
        text: panel.stale ? "NO DATA" : panel.note
        color: panel.stale || panel.alarming ? Theme.bad : Theme.dim
        font { pixelSize: 10; weight: panel.stale || panel.alarming ? Font.Bold : Font.Normal }
    }
}
