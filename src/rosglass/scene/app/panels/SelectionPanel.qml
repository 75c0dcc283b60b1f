import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// What is selected, by display, and its descriptions.
Pane {
    id: panel

    // The SceneView whose selection is shown.
    property SceneView view: null
    readonly property int count: view ? view.selection.count : 0
    readonly property var parts: view && visible ? view.selection.parts : []
    // Rows that the user has expanded or collapsed, by display and part.
    property var toggled: ({})
    readonly property var rows: lines(parts, toggled)

    padding: 4

    function toggle(key) { toggled = Object.assign({}, toggled, { [key]: !toggled[key] }) }
    // The rows: each display, its parts, and what there is to say about those that are expanded.
    function lines(parts, toggled) {
        const displays = new Map()
        for (const part of parts) {
            if (!displays.has(part.display))
                displays.set(part.display, [])
            displays.get(part.display).push(part)
        }
        const found = []
        for (const [display, inside] of displays) {
            const shown = !toggled[display]
            found.push({ depth: 0, key: display, expanded: shown, text: display + (inside.length > 1 ? " (" + inside.length + ")" : "") })
            for (const part of shown ? inside : []) {
                const key = display + "\n" + part.part
                // One alone is what the user wants to read; of many, which they are.
                const expanded = (inside.length === 1) !== (toggled[key] === true)
                found.push({ depth: 1, key: key, expanded: expanded, text: part.part })
                for (const line of expanded ? part.lines : [])
                    found.push({ depth: 2, key: "", expanded: false, text: line.name + ": " + line.value })
            }
        }
        return found
    }

    ColumnLayout {
        anchors.fill: parent
        RowLayout {
            Label { Layout.fillWidth: true; text: panel.count + " selected"; textFormat: Text.PlainText }
            Button { text: "Clear"; enabled: panel.count > 0; onClicked: panel.view.selection.clear() }
        }
        ListView {
            id: list

            objectName: "parts"
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            boundsBehavior: Flickable.StopAtBounds
            ScrollBar.vertical: ScrollBar { }
            // Rows stay where they are scrolled to while what is selected moves.
            model: panel.rows.length
            delegate: RowLayout {
                id: row

                required property int index
                readonly property var line: panel.rows[index] || ({ depth: 0, key: "", expanded: false, text: "" })

                width: list.width
                spacing: 2
                Label {
                    Layout.leftMargin: 12 * row.line.depth
                    Layout.preferredWidth: 12
                    Layout.alignment: Qt.AlignTop
                    text: row.line.key === "" ? "" : row.line.expanded ? "\u25be" : "\u25b8"
                    textFormat: Text.PlainText
                }
                Label {
                    Layout.fillWidth: true
                    Layout.rightMargin: 10
                    text: row.line.text
                    textFormat: Text.PlainText
                    wrapMode: Text.Wrap
                    maximumLineCount: 5
                    elide: Text.ElideRight
                    font.bold: row.line.depth === 0
                }
                TapHandler { enabled: row.line.key !== ""; onTapped: panel.toggle(row.line.key) }
            }
        }
        Label { visible: panel.count > panel.parts.length; text: "and " + (panel.count - panel.parts.length) + " more"; textFormat: Text.PlainText }
    }
}
