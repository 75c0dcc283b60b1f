// The properties of one panel as fields, with units, ranges, defaults, and names from the robot.
import QtQml 2.15 as Qml
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

FocusScope {
    id: form

    // The PropertyModel, which reports what is entered.
    property var model: null

    // The page of the panel was asked for.
    signal helpRequested(string page)

    readonly property var colors_: ["accent", "good", "warn", "bad", "text", "dim", "faint", "track", "panel", "background", "edge"]
    readonly property var frames_: frames.item ? frames.item.names() : []

    function find() { search.forceActiveFocus() }

    Accessible.role: Accessible.Form
    Accessible.name: model && model.title ? qsTr("Properties of %1").arg(model.title) : qsTr("Properties")

    // Only where a property is a frame: it subscribes to the transforms.
    Loader {
        id: frames
        active: form.model !== null && form.model.hasFrames
        sourceComponent: TfRows {
            function names() {
                const found = []
                for (let row = 0; row < Math.min(rows.count, 500); ++row)
                    found.push(rows.value(row, "key"))
                return found
            }
        }
    }
    Column {
        id: head
        width: parent.width
        spacing: Theme.gap / 2

        Item {
            width: parent.width
            height: help.height
            ThemeText {
                objectName: "panelName"
                anchors { left: parent.left; right: help.left; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                text: form.model && form.model.title ? form.model.title : qsTr("No panel is selected")
                font { pixelSize: Theme.large; weight: Font.DemiBold }
            }
            ThemeButton {
                id: help
                objectName: "help"
                anchors.right: parent.right
                visible: form.model !== null && form.model.page !== ""
                text: "?"
                Accessible.name: qsTr("Help about %1").arg(form.model ? form.model.title : "")
                onClicked: form.helpRequested(form.model.page)
            }
        }
        ThemeText {
            width: parent.width
            visible: text !== ""
            text: form.model ? form.model.line : ""
            color: Theme.dim
            font.pixelSize: Theme.small
            wrapMode: Text.Wrap
            maximumLineCount: 3
        }
        ThemeField {
            id: search
            objectName: "search"
            width: parent.width
            visible: form.model !== null && form.model.total > 0
            placeholderText: qsTr("search %1 properties").arg(form.model ? form.model.total : 0)
            onTextEdited: form.model.filter = text
            Keys.onEscapePressed: {
                text = ""
                form.model.filter = ""
            }
            Keys.onDownPressed: nextItemInFocusChain().forceActiveFocus()
        }
        ThemeText {
            width: parent.width
            visible: form.model !== null && form.model.total > 0 && form.model.count === 0
            text: qsTr("no property is similar to the text")
            color: Theme.dim
        }
    }
    ListView {
        id: list
        objectName: "properties"
        anchors { top: head.bottom; topMargin: Theme.gap; left: parent.left; right: parent.right; bottom: parent.bottom }
        clip: true
        spacing: Theme.gap / 2
        boundsBehavior: Flickable.StopAtBounds
        model: form.model ? form.model.rows : null
        T.ScrollBar.vertical: ThemeScrollBar { id: bar }

        delegate: Item {
            id: row
            objectName: "property_" + name

            readonly property string name: model.name
            readonly property string kind: model.kind
            readonly property string text: model.text
            readonly property string unit: model.unit
            readonly property string problem: model.problem
            readonly property var choices: model.choices
            readonly property bool checked: model.checked
            readonly property bool isSet: model.isSet
            readonly property string fallback: model.fallback
            readonly property bool locked: model.isBound && !model.isReplacing
            readonly property string range: isFinite(model.low) && isFinite(model.high) ? model.low + " … " + model.high
                : isFinite(model.low) ? qsTr("from %1 on").arg(model.low) : ""
            readonly property bool narrow: width < 300 * Theme.size

            function seen() { list.positionViewAtIndex(index, ListView.Contain) }
            function enter(text) { return form.model.setText(name, text) }

            width: list.width - (bar.visible ? bar.width + 4 : 0)
            height: editor.y + Math.max(editor.height, Theme.touch) + detail.implicitHeight + 2

            ThemeText {
                id: label
                anchors { left: parent.left; top: parent.top; right: row.narrow ? resetButton.left : editor.left; rightMargin: Theme.gap }
                height: row.narrow ? Theme.normal * 1.6 : Theme.touch
                text: row.unit ? row.name + " (" + row.unit + ")" : row.name
                color: row.isSet ? Theme.text : Theme.dim
                font.weight: row.isSet ? Font.DemiBold : Font.Normal
                verticalAlignment: Text.AlignVCenter
            }
            Loader {
                id: editor
                anchors { right: resetButton.left; rightMargin: Theme.gap / 2 }
                y: row.narrow ? label.height : 0
                width: (row.narrow ? parent.width : parent.width * 0.6) - resetButton.width - Theme.gap / 2
                height: Theme.touch
                sourceComponent: row.locked ? boundEditor
                    : row.kind === "bool" ? boolEditor
                    : row.kind === "choice" || row.choices.length > 1 ? choiceEditor
                    : row.kind === "color" || ["topic", "path", "frame", "node", "action", "service", "namespace"].indexOf(row.kind) >= 0 ? nameEditor
                    : textEditor
            }
            ThemeButton {
                id: resetButton
                objectName: "reset"
                anchors { right: parent.right; top: editor.top }
                width: Theme.touch
                text: "↺"
                enabled: row.isSet && !row.locked
                opacity: row.isSet ? 1 : 0
                Accessible.name: qsTr("Reset %1 to its default").arg(row.name)
                Accessible.ignored: !row.isSet
                onClicked: form.model.reset(row.name)
            }
            ThemeText {
                id: detail
                objectName: "detail"
                anchors { left: parent.left; right: parent.right; top: editor.bottom }
                text: row.problem ? qsTr("NOT CHANGED: %1").arg(row.problem)
                    : model.isReplacing ? qsTr("A value replaces the binding: %1").arg(model.expression)
                    : [model.line, model.types, row.range, (row.isSet || model.isComputed) && row.fallback ? qsTr("default: %1").arg(row.fallback) : ""].filter(part => part !== "").join(" · ")
                color: row.problem ? Theme.bad : model.isReplacing ? Theme.warn : Theme.dim
                font.pixelSize: Theme.small
                wrapMode: Text.Wrap
                maximumLineCount: 3
            }

            Component {
                id: boundEditor
                Item {
                    ThemeText {
                        objectName: "bound"
                        anchors { left: parent.left; right: replace.left; rightMargin: Theme.gap / 2; verticalCenter: parent.verticalCenter }
                        text: qsTr("bound: %1").arg(model.expression)
                        color: Theme.warn
                        Accessible.role: Accessible.StaticText
                        Accessible.name: row.name + ", " + text
                    }
                    ThemeButton {
                        id: replace
                        objectName: "replace"
                        anchors.right: parent.right
                        text: qsTr("Replace ...")
                        Accessible.description: qsTr("The binding of %1 is replaced by a value").arg(row.name)
                        onClicked: form.model.replace(row.name, true)
                        onActiveFocusChanged: if (activeFocus) row.seen()
                    }
                }
            }
            Component {
                id: boolEditor
                ThemeSwitch {
                    id: toggle
                    objectName: "editor"
                    Accessible.name: row.name
                    onToggled: form.model.setChecked(row.name, checked)
                    onActiveFocusChanged: if (activeFocus) row.seen()
                    Qml.Binding { target: toggle; property: "checked"; value: row.checked; restoreMode: Qml.Binding.RestoreNone }
                }
            }
            Component {
                id: choiceEditor
                ThemeChoice {
                    objectName: "editor"
                    name: row.name
                    model: row.choices
                    currentIndex: row.choices.indexOf(row.text)
                    displayText: row.text
                    onActivated: function(index) { row.enter(row.choices[index]) }
                    onActiveFocusChanged: if (activeFocus) row.seen()
                }
            }
            Component {
                id: nameEditor
                ThemeSuggest {
                    id: named
                    objectName: "editor"
                    problem: row.problem
                    placeholderText: row.fallback || (row.name === "topic" ? qsTr("found by type") : "")
                    leftPadding: row.kind === "color" ? Theme.touch : Theme.gap
                    Accessible.name: row.name
                    suggest: function(typed) {
                        return row.kind === "color" ? form.colors_.map(name => ({ text: "Theme." + name, detail: String(Theme[name]), suits: true }))
                            : form.model.suggestions(row.name, typed, form.frames_)
                    }
                    onChosen: function(text) {
                        // The field is still to be added to a topic.
                        if (row.kind !== "path" || text.slice(-1) !== ":")
                            row.enter(text)
                    }
                    onActiveFocusChanged: if (activeFocus) row.seen()
                    Keys.onEscapePressed: text = row.text
                    Rectangle {
                        visible: row.kind === "color"
                        x: Theme.gap / 2
                        anchors.verticalCenter: parent.verticalCenter
                        width: Theme.touch * 0.6
                        height: width
                        radius: Theme.radius / 2
                        border { color: Theme.edge; width: 1 }
                        color: row.text.indexOf("Theme.") === 0 ? Theme[row.text.slice(6)] || "transparent" : row.text && !row.locked && row.isSet ? row.text : "transparent"
                    }
                    Qml.Binding { target: named; property: "text"; value: row.isSet ? row.text : ""; when: !named.activeFocus; restoreMode: Qml.Binding.RestoreNone }
                }
            }
            Component {
                id: textEditor
                ThemeField {
                    id: field
                    objectName: "editor"
                    problem: row.problem
                    maximumLength: 20000
                    placeholderText: row.fallback
                    Accessible.name: row.name
                    onAccepted: row.enter(text)
                    onActiveFocusChanged: {
                        if (activeFocus)
                            row.seen()
                        else if (text !== row.text && (row.isSet || text !== ""))
                            row.enter(text)
                    }
                    Keys.onEscapePressed: text = row.text
                    Qml.Binding { target: field; property: "text"; value: row.isSet ? row.text : ""; when: !field.activeFocus; restoreMode: Qml.Binding.RestoreNone }
                }
            }
        }
    }
}
