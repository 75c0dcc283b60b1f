import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// The displays of a view, with their status and settings, as in RViz.
Pane {
    id: panel

    // The SceneView that is shown and changed.
    property alias view: rows.view
    // The row that is selected; it follows rows that come and go above it.
    property alias current: list.currentIndex
    readonly property bool ofDisplay: current >= 0 && list.currentItem !== null && list.currentItem.ofDisplay
    readonly property int rowHeight: 24
    // What the user has entered and does not fit.
    property string problem: ""

    padding: 0

    DisplaysModel {
        id: rows
        active: panel.visible
        onRefused: text => { panel.problem = text; forget.restart() }
        onAccepted: panel.problem = ""
    }
    Connections {
        target: rows
        // The list would select the row that takes the place of one that goes; Delete would remove its display.
        function onRowsAboutToBeRemoved(parent, first, last) {
            if (panel.current >= first && panel.current <= last)
                panel.current = rows.collapsedInto(first)
        }
    }
    Timer { id: forget; interval: 8000; onTriggered: panel.problem = "" }

    // A display that is dragged to another place, by the mouse or by a finger that is held down.
    QtObject {
        id: dragging

        property bool active: false
        // Until the button is released.
        property bool canceled: false
        property int source: -1
        property string label: ""
        // Where it is held, in the list.
        property point at
        // Where it would go: see DisplaysModel.dropTarget().
        property var target: ({})
        readonly property real y: at.y + list.contentY - list.originY
        readonly property int row: Math.max(0, Math.min(Math.floor(y / panel.rowHeight), list.count))
        readonly property real part: y / panel.rowHeight - row

        function begin(row, label) {
            source = row
            dragging.label = label
            rows.frozen = true
            active = true
        }
        function follow(point) {
            at = point
            target = rows.dropTarget(source, row, part)
        }
        function drop() {
            if (!active)
                return
            const to = target.row === undefined ? source : rows.drop(source, row, part)
            end()
            panel.current = to
        }
        function end() {
            active = false
            rows.frozen = false
            target = {}
        }
    }
    Timer {
        interval: 30
        repeat: true
        running: dragging.active && (dragging.at.y < panel.rowHeight || dragging.at.y > list.height - panel.rowHeight)
        onTriggered: {
            const last = list.originY + Math.max(0, list.contentHeight - list.height)
            const step = dragging.at.y < panel.rowHeight ? -8 : 8
            list.contentY = Math.max(list.originY, Math.min(list.contentY + step, last))
            dragging.follow(dragging.at)
        }
    }
    // Gets the keys once a row is clicked.
    Item {
        id: keys

        readonly property var moves: ({ [Qt.Key_Up]: "up", [Qt.Key_Down]: "down", [Qt.Key_Right]: "in", [Qt.Key_Left]: "out" })

        Keys.onPressed: event => {
            const row = list.currentItem
            const moves = event.modifiers & Qt.AltModifier
            event.accepted = true
            if (dragging.active && event.key === Qt.Key_Escape) {
                dragging.end()
                dragging.canceled = true
            } else if (dragging.active || event.modifiers & (Qt.ControlModifier | Qt.MetaModifier))
                event.accepted = false
            else if (moves && panel.ofDisplay && event.key in keys.moves)
                panel.current = rows.shift(panel.current, keys.moves[event.key])
            else if (moves)
                event.accepted = false
            else if (event.key === Qt.Key_Up)
                list.decrementCurrentIndex()
            else if (event.key === Qt.Key_Down)
                list.incrementCurrentIndex()
            else if (row && row.expandable && event.key === (row.expanded ? Qt.Key_Left : Qt.Key_Right))
                rows.toggle(panel.current)
            else if (row && (row.ofDisplay || row.kind === "part") && event.key === Qt.Key_Space)
                rows.setEnabled(panel.current, !row.checked)
            else if (panel.ofDisplay && event.key === Qt.Key_Delete)
                rows.remove(panel.current)
            else if (panel.ofDisplay && event.key === Qt.Key_F2)
                renaming.open()
            else
                event.accepted = false
        }
    }

    ColumnLayout {
        anchors.fill: parent
        spacing: 4

        ListView {
            id: list
            objectName: "displayRows"
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            model: rows
            currentIndex: -1
            boundsBehavior: Flickable.StopAtBounds
            ScrollBar.vertical: ScrollBar { }

            // Where a display that is dragged would go.
            Rectangle {
                parent: list.contentItem
                z: 2
                visible: dragging.active && dragging.target.row !== undefined
                x: visible ? 4 + 14 * dragging.target.depth : 0
                y: visible ? list.originY + dragging.target.row * panel.rowHeight - (dragging.target.into ? 0 : 1) : 0
                width: list.width - x
                height: dragging.target.into ? panel.rowHeight : 2
                color: dragging.target.into ? "transparent" : palette.highlight
                border { width: dragging.target.into ? 2 : 0; color: palette.highlight }
            }
            Label {
                objectName: "dragged"
                parent: list
                z: 3
                visible: dragging.active
                x: Math.min(dragging.at.x + 12, list.width - width)
                y: dragging.at.y + 4
                padding: 4
                text: dragging.label
                textFormat: Text.PlainText
                background: Rectangle { color: palette.window; border.color: palette.mid; opacity: 0.9 }
            }

            delegate: Rectangle {
                id: row
                required property int index
                required property int depth
                required property string label
                required property string kind
                required property var value
                required property string description
                required property string level
                required property bool checked
                required property bool expandable
                required property bool expanded
                required property var choices
                required property string placeholder
                readonly property bool ofDisplay: kind === "display"
                readonly property bool current: index === panel.current
                readonly property color tint: level === "error" ? (current ? "#ffc8c0" : "#c62818")
                                            : level === "warn" ? (current ? "#ffe0a0" : "#9a5b00")
                                            : current ? palette.highlightedText : palette.text

                width: list.width
                height: panel.rowHeight
                opacity: dragging.active && index === dragging.source ? 0.5 : 1
                color: current ? palette.highlight
                     : ofDisplay || kind === "options" ? palette.alternateBase : "transparent"

                MouseArea {
                    property point start
                    // A finger scrolls the list.
                    property bool byFinger: false

                    anchors.fill: parent
                    hoverEnabled: true
                    preventStealing: row.ofDisplay && !byFinger || dragging.active
                    cursorShape: dragging.active ? Qt.ClosedHandCursor : Qt.ArrowCursor
                    onPressed: mouse => {
                        start = Qt.point(mouse.x, mouse.y)
                        dragging.canceled = false
                        byFinger = mouse.source !== Qt.MouseEventNotSynthesized
                        keys.forceActiveFocus()
                        if (!byFinger)
                            panel.current = row.index
                    }
                    onPressAndHold: if (byFinger && row.ofDisplay) { panel.current = row.index; dragging.begin(row.index, row.label) }
                    onPositionChanged: mouse => {
                        const far = Math.max(Math.abs(mouse.x - start.x), Math.abs(mouse.y - start.y))
                        if (pressed && !byFinger && row.ofDisplay && !dragging.active && !dragging.canceled && far > Application.styleHints.startDragDistance)
                            dragging.begin(row.index, row.label)
                        if (dragging.active)
                            dragging.follow(mapToItem(list, mouse.x, mouse.y))
                    }
                    onReleased: dragging.drop()
                    onCanceled: dragging.end()
                    onClicked: panel.current = row.index
                    onDoubleClicked: if (row.expandable) rows.toggle(row.index)
                    PlainToolTip {
                        // Beside the panel: above the row it would hide those that the mouse goes to next.
                        x: parent.width
                        y: 0
                        visible: parent.containsMouse && row.description !== ""
                        plain: row.description
                    }
                }
                RowLayout {
                    anchors { fill: parent; leftMargin: 4 + 14 * row.depth; rightMargin: 10 }
                    spacing: 4

                    Text {
                        Layout.preferredWidth: 12
                        text: row.expandable ? (row.expanded ? "\u25be" : "\u25b8") : ""
                        textFormat: Text.PlainText
                        color: palette.text
                        MouseArea { anchors.fill: parent; anchors.margins: -6; enabled: row.expandable; onClicked: rows.toggle(row.index) }
                    }
                    CheckBox {
                        visible: row.ofDisplay || row.kind === "part"
                        checked: row.checked
                        onToggled: rows.setEnabled(row.index, checked)
                    }
                    Text {
                        Layout.fillWidth: true
                        Layout.preferredWidth: 100
                        text: row.label
                        textFormat: Text.PlainText
                        elide: Text.ElideRight
                        font.bold: row.ofDisplay
                        color: row.tint
                    }
                    Text {
                        visible: row.kind === "status" || row.kind === "text"
                        Layout.fillWidth: true
                        Layout.preferredWidth: 160
                        text: String(row.value)
                        textFormat: Text.PlainText
                        elide: Text.ElideRight
                        color: row.tint
                    }
                    SettingEditor {
                        kind: row.kind
                        value: row.value
                        choices: row.choices
                        placeholder: row.placeholder
                        onEdited: value => rows.edit(row.index, value)
                        onColorAsked: before => {
                            panel.current = row.index
                            rows.pick(row.index)
                            chooser.ask(before, row.label)
                        }
                    }
                }
            }
        }
        Text {
            Layout.fillWidth: true
            Layout.margins: 4
            visible: panel.problem !== ""
            text: panel.problem
            textFormat: Text.PlainText
            wrapMode: Text.Wrap
            maximumLineCount: 20
            elide: Text.ElideRight
            color: "#c62818"
        }
        RowLayout {
            Layout.margins: 4
            component PanelButton: Button { Layout.fillWidth: true; Layout.preferredWidth: 60; Layout.minimumWidth: 0 }

            PanelButton { objectName: "addDisplay"; text: "Add"; onClicked: adding.open() }
            PanelButton { text: "Duplicate"; enabled: panel.ofDisplay; onClicked: panel.current = rows.duplicate(panel.current) }
            PanelButton { text: "Remove"; enabled: panel.ofDisplay; onClicked: rows.remove(panel.current) }
            PanelButton { text: "Rename"; enabled: panel.ofDisplay; onClicked: renaming.open() }
        }
    }

    ColorChooser { id: chooser; objectName: "colors"; onTried: color => rows.setPicked(color) }
    Dialog {
        id: renaming
        title: "New name of the display"
        modal: true
        standardButtons: Dialog.Ok | Dialog.Cancel
        parent: Overlay.overlay
        anchors.centerIn: parent
        contentItem: TextField { id: newName; selectByMouse: true; onAccepted: renaming.accept() }
        onOpened: { newName.text = list.currentItem ? list.currentItem.label : ""; newName.selectAll(); newName.forceActiveFocus() }
        onAccepted: rows.rename(panel.current, newName.text)
    }
    Dialog {
        id: adding

        // What can be added: the display of each, and its topic.
        property var topics: []
        property var types: []
        readonly property var words: filter.text.toLowerCase().split(" ")
        readonly property var found: matching(tabs.currentIndex === 0 ? topics : types)
        readonly property var chosen: found[choices.currentIndex] || null

        objectName: "addDialog"
        title: "Add a display"
        modal: true
        width: 420
        height: parent ? Math.min(480, parent.height - 20) : 480
        parent: Overlay.overlay
        anchors.centerIn: parent
        function matching(ones) {
            return ones.filter(one => words.every(word => (one.topic + " " + one.display).toLowerCase().includes(word)))
        }
        onOpened: {
            topics = rows.suggestions()
            types = rows.types().map(name => ({ topic: "", display: name }))
            filter.clear()
            filter.forceActiveFocus()
        }
        onAccepted: {
            const row = rows.add(chosen.display, chosen.topic)
            if (row >= 0)
                panel.current = row
        }
        onClosed: keys.forceActiveFocus()
        footer: DialogButtonBox {
            Button { objectName: "addChosen"; text: "OK"; enabled: adding.chosen !== null; DialogButtonBox.buttonRole: DialogButtonBox.AcceptRole }
            Button { text: "Cancel"; DialogButtonBox.buttonRole: DialogButtonBox.RejectRole }
        }
        ColumnLayout {
            anchors.fill: parent
            TabBar {
                id: tabs
                Layout.fillWidth: true
                // The filter keeps the keyboard: letters and Enter are for the list.
                TabButton { objectName: "addByTopic"; text: "By topic"; onClicked: filter.forceActiveFocus() }
                TabButton { objectName: "addByType"; text: "By type"; onClicked: filter.forceActiveFocus() }
            }
            TextField {
                id: filter
                objectName: "addFilter"
                Layout.fillWidth: true
                placeholderText: "Filter"
                onAccepted: if (adding.chosen) adding.accept()
                Keys.onUpPressed: choices.decrementCurrentIndex()
                Keys.onDownPressed: choices.incrementCurrentIndex()
            }
            ListView {
                id: choices
                objectName: "addChoices"
                Layout.fillWidth: true
                Layout.fillHeight: true
                clip: true
                model: adding.found
                // The first match of a filter: Enter adds it.
                onModelChanged: currentIndex = filter.text && adding.found.length > 0 ? 0 : -1
                ScrollBar.vertical: ScrollBar { }
                Keys.onReturnPressed: if (adding.chosen) adding.accept()
                Keys.onEnterPressed: if (adding.chosen) adding.accept()
                delegate: ItemDelegate {
                    id: choice

                    required property int index
                    required property var modelData

                    width: ListView.view.width
                    highlighted: ListView.isCurrentItem
                    contentItem: RowLayout {
                        readonly property color tint: choice.highlighted ? palette.highlightedText : palette.text
                        Label { Layout.fillWidth: true; text: choice.modelData.topic || choice.modelData.display; textFormat: Text.PlainText; elide: Text.ElideRight; color: parent.tint }
                        Label { visible: choice.modelData.topic !== ""; text: choice.modelData.display; textFormat: Text.PlainText; color: parent.tint }
                    }
                    focusPolicy: Qt.NoFocus
                    onClicked: { choices.currentIndex = index; choices.forceActiveFocus() }
                    onDoubleClicked: { choices.currentIndex = index; adding.accept() }
                }
                Label {
                    // Matches of the other list: a robot's model, for one, has no topic here.
                    readonly property var others: adding.matching(tabs.currentIndex === 0 ? adding.types : adding.topics)

                    objectName: "addNothing"
                    anchors.centerIn: parent
                    width: parent.width - 20
                    visible: choices.count === 0
                    horizontalAlignment: Text.AlignHCenter
                    wrapMode: Text.Wrap
                    maximumLineCount: 20
                    elide: Text.ElideRight
                    textFormat: Text.PlainText
                    text: adding.topics.length === 0 && tabs.currentIndex === 0 ? "The robot publishes nothing that a display shows."
                        : others.length === 0 ? "Nothing has these words."
                        : "Nothing here has these words. " + (tabs.currentIndex === 0 ? "By type" : "By topic") + ": "
                            + others.slice(0, 3).map(one => one.topic || one.display).join(", ")
                }
            }
        }
    }
}
