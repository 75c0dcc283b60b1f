// A new message of any type, to fill in: with comments, units, ranges, constants, arrays, and what was sent before.
import QtQml 2.15 as Qml
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0
import "fields.js" as Fields

FocusScope {
    id: form

    // Type of a message, of a service (its request is filled in), or of an action (its goal).
    property string type
    // Whether history and favourites are shown.
    property bool keeps: true
    // Whether it scrolls by itself; otherwise it is as high as its rows.
    property bool scrolls: true

    // Whether the type is known, and whether all that was entered fits.
    readonly property bool ready: fields.ready
    readonly property bool valid: fields.valid
    // Full name of the message's own type.
    readonly property string messageType: fields.messageType
    // What is wrong, in words; empty if nothing is.
    readonly property string problem: fields.problem || fields.refusal
    // The MessageFields.
    readonly property QtObject messageFields: fields

    // A field was changed; Enter was pressed in one.
    signal edited()
    signal accepted()

    // The message, with the current time where it is "now"; undefined while something does not fit.
    function message() { return fields.message() }
    // Shows the fields of a message or object.
    function load(values) { return fields.load(values) }
    function clear() { fields.clear() }
    // Keeps the message in the history of its type.
    function remember() { fields.remember() }

    implicitWidth: 320 * Theme.size
    implicitHeight: head.height + scroll.contentHeight + Theme.gap / 2
    Accessible.role: Accessible.Form
    Accessible.name: messageType ? qsTr("Fields of %1").arg(messageType) : qsTr("Fields")

    MessageFields {
        id: fields
        type: form.type
        onMessageChanged: form.edited()
    }
    Column {
        id: head
        width: parent.width
        spacing: Theme.gap / 2

        Row {
            id: kept
            width: parent.width
            visible: form.keeps && form.ready
            spacing: Theme.gap / 2
            bottomPadding: Theme.gap / 2
            readonly property real part: (width - 2 * spacing - tools.width) / 2

            ThemeChoice {
                objectName: "history"
                width: parent.part
                name: qsTr("Sent before")
                enabled: fields.history.length > 0
                model: fields.history
                currentIndex: -1
                displayText: enabled ? qsTr("sent before") : qsTr("nothing sent yet")
                onActivated: function(index) { fields.recall(index) }
            }
            ThemeChoice {
                objectName: "favourites"
                width: parent.part
                name: qsTr("Favourites")
                enabled: fields.favourites.length > 0
                model: fields.favourites
                currentIndex: -1
                displayText: favouriteName.chosen || qsTr("favourites")
                onActivated: function(index) {
                    favouriteName.chosen = fields.favourites[index] || ""
                    fields.recallFavourite(favouriteName.chosen)
                }
            }
            Row {
                id: tools
                spacing: Theme.gap / 2
                ThemeButton {
                    objectName: "star"
                    width: Theme.touch
                    text: "★"
                    selected: favouriteName.visible
                    Accessible.name: qsTr("Keep as a favourite")
                    onClicked: {
                        favouriteName.shown = !favouriteName.shown
                        if (favouriteName.shown)
                            favouriteName.forceActiveFocus()
                    }
                }
                ThemeButton {
                    objectName: "clear"
                    width: Theme.touch
                    text: "↺"
                    Accessible.name: qsTr("Give all fields their defaults")
                    onClicked: fields.clear()
                }
            }
        }
        Row {
            width: parent.width
            visible: favouriteName.visible
            spacing: Theme.gap / 2
            ThemeField {
                id: favouriteName
                objectName: "favouriteName"
                property bool shown: false
                property string chosen
                width: parent.width - (drop.visible ? drop.width + parent.spacing : 0)
                visible: shown && kept.visible
                placeholderText: qsTr("name of the favourite, Enter keeps it")
                maximumLength: 60
                onAccepted: {
                    fields.addFavourite(text)
                    chosen = text.trim()
                    text = ""
                    shown = false
                }
                Keys.onEscapePressed: shown = false
            }
            ThemeButton {
                id: drop
                objectName: "forget"
                visible: favouriteName.visible && fields.favourites.indexOf(favouriteName.chosen) >= 0
                text: qsTr("Forget %1").arg(favouriteName.chosen.slice(0, 20))
                tint: Theme.bad
                onClicked: {
                    fields.removeFavourite(favouriteName.chosen)
                    favouriteName.chosen = ""
                    favouriteName.shown = false
                }
            }
        }
        ThemeText {
            objectName: "formProblem"
            width: parent.width
            visible: text !== ""
            text: fields.problem || (fields.valid ? fields.refusal : "") || (form.keeps ? fields.keepProblem : "") || (!form.type ? qsTr("no type is given") : "")
            color: form.type ? Theme.bad : Theme.dim
            font.pixelSize: Theme.small
            wrapMode: Text.Wrap
            maximumLineCount: 3
        }
    }
    Flickable {
        id: scroll
        objectName: "fields"
        anchors { top: head.bottom; left: parent.left; right: parent.right; bottom: parent.bottom }
        contentHeight: rows.height
        interactive: form.scrolls && contentHeight > height
        clip: form.scrolls
        boundsBehavior: Flickable.StopAtBounds
        T.ScrollBar.vertical: ThemeScrollBar { id: bar; visible: scroll.interactive }

        function see(item) {
            if (!form.scrolls)
                return
            const top = item.mapToItem(rows, 0, 0).y
            contentY = Math.max(0, Math.min(top, Math.max(contentY, top + item.height - height)))
        }

        Column {
            id: rows
            width: scroll.width - (bar.visible ? bar.width + 4 : 0)

            ThemeText {
                width: parent.width
                visible: fields.ready && lines.count === 0
                text: qsTr("%1 has no fields").arg(fields.messageType)
                color: Theme.dim
            }
            Repeater {
                id: lines
                model: fields.rows
                delegate: lineOf
            }
        }
    }
    Component {
        id: lineOf

        Item {
            id: line

            readonly property string key: model.key
            readonly property string kind: model.kind
            readonly property string text: model.text
            readonly property string problem: model.problem
            readonly property bool checked: model.checked
            readonly property var choices: model.choices
            readonly property bool canRise: model.canRise
            readonly property bool canSink: model.canSink
            readonly property bool canRemove: model.canRemove
            readonly property bool canInsert: model.canInsert && kind === "array"
            readonly property bool entered: kind === "number" || kind === "text" || kind === "time"
            readonly property var constant: choices.filter(one => one.value === text)[0] || null
            readonly property string said: problem ? problem
                : model.isOutside ? qsTr("outside of %1, which the comment names").arg(model.range)
                : [constant ? constant.text : "", model.range && model.comment.indexOf("[") < 0 ? model.range : "", model.comment].filter(part => part !== "").join(" · ")

            function enter(text) { fields.setText(key, text) }
            function act(name) {
                if (name === "now")
                    enter("now")
                else if (name === "rise" || name === "sink")
                    fields.move(key, name === "rise" ? -1 : 1)
                else if (name === "remove")
                    fields.remove(key)
                else
                    fields.insert(key)
            }

            width: rows.width
            height: Math.round(Theme.touch * (entered || kind === "bool" ? 1 : 0.8)) + (detail.visible ? detail.implicitHeight + 3 : 3)
            Accessible.role: Accessible.Grouping
            Accessible.name: model.unit ? Fields.fill(qsTr("%1 in %2"), [key, model.unit]) : key

            ThemeButton {
                id: fold
                objectName: "fold_" + line.key
                x: Math.min(model.depth * Theme.gap * 1.4, rows.width / 3)
                width: visible ? Theme.gap * 2.2 : Theme.gap * 0.4
                implicitHeight: Math.round(Theme.touch * 0.7)
                anchors.verticalCenter: label.verticalCenter
                visible: model.folds
                text: model.open ? "▾" : "▸"
                tint: Theme.dim
                Accessible.name: model.open ? qsTr("Fold %1").arg(line.key) : qsTr("Unfold %1").arg(line.key)
                onClicked: fields.toggle(line.key)
                onActiveFocusChanged: if (activeFocus) scroll.see(line)
            }
            ThemeText {
                id: label
                anchors { left: fold.right; leftMargin: Theme.gap / 2 }
                width: Math.max(0, (line.entered || line.kind === "bool" ? rows.width * 0.42 : rows.width - buttons.width - Theme.gap) - x)
                height: Math.round(Theme.touch * (line.entered || line.kind === "bool" ? 1 : 0.8))
                text: line.entered || line.kind === "bool" ? (model.unit ? Fields.fill(qsTr("%1 (%2)"), [model.name, model.unit]) : model.name)
                    : Fields.fill(qsTr("%1  %2"), [model.name, line.kind === "array" ? model.type + ": " + line.text : line.kind === "message" ? model.type : line.kind === "long" ? qsTr("a long text, which is kept") : ""])
                color: line.problem ? Theme.bad : line.kind === "message" || line.kind === "array" ? Theme.text : Theme.dim
                verticalAlignment: Text.AlignVCenter
            }
            Loader {
                id: editor
                anchors { left: label.right; right: buttons.left; rightMargin: buttons.width > 0 ? Theme.gap / 2 : 0 }
                height: Theme.touch
                sourceComponent: line.kind === "bool" ? boolEditor : line.entered ? (line.choices.length > 1 ? choiceEditor : textEditor) : null
            }
            Row {
                id: buttons
                anchors { right: parent.right; verticalCenter: label.verticalCenter }
                spacing: 2
                Repeater {
                    // Elements come and go by these; "now" is for times.
                    model: [
                        { name: "now", text: qsTr("now"), used: line.kind === "time", said: qsTr("Set %1 to the current time when it is sent") },
                        { name: "rise", text: "↑", used: line.canRise, said: qsTr("Move %1 up") },
                        { name: "sink", text: "↓", used: line.canSink, said: qsTr("Move %1 down") },
                        { name: "remove", text: "−", used: line.canRemove, said: qsTr("Remove %1") },
                        { name: "insert", text: "+", used: line.canInsert, said: qsTr("Add an element to %1") }
                    ].filter(one => one.used)
                    ThemeButton {
                        objectName: modelData.name + "_" + line.key
                        implicitHeight: Math.round(Theme.touch * 0.75)
                        implicitWidth: Math.max(implicitHeight, contentItem.implicitWidth + Theme.gap)
                        text: modelData.text
                        Accessible.name: modelData.said.arg(line.key)
                        onClicked: line.act(modelData.name)
                        onActiveFocusChanged: if (activeFocus) scroll.see(line)
                    }
                }
            }
            ThemeText {
                id: detail
                objectName: "detail_" + line.key
                anchors { left: fold.right; leftMargin: Theme.gap / 2; right: parent.right; bottom: parent.bottom; bottomMargin: 3 }
                visible: text !== ""
                text: line.said
                color: line.problem ? Theme.bad : model.isOutside ? Theme.warn : line.constant ? Theme.accent : Theme.dim
                font.pixelSize: Theme.small
                wrapMode: line.problem ? Text.Wrap : Text.NoWrap
                maximumLineCount: line.problem ? 3 : 1
            }

            Component {
                id: boolEditor
                ThemeSwitch {
                    id: toggle
                    objectName: "switch_" + line.key
                    Accessible.name: line.key
                    onToggled: line.enter(String(checked))
                    onActiveFocusChanged: if (activeFocus) scroll.see(line)
                    Qml.Binding { target: toggle; property: "checked"; value: line.checked; restoreMode: Qml.Binding.RestoreNone }
                }
            }
            Component {
                id: textEditor
                ThemeField {
                    id: field
                    objectName: "field_" + line.key
                    problem: line.problem
                    maximumLength: 20000
                    Accessible.name: line.key
                    onTextEdited: line.enter(text)
                    onAccepted: {
                        line.enter(text)
                        form.accepted()
                    }
                    onActiveFocusChanged: if (activeFocus) scroll.see(line)
                    Qml.Binding { target: field; property: "text"; value: line.text; when: !field.activeFocus || line.text === "now"; restoreMode: Qml.Binding.RestoreNone }
                }
            }
            Component {
                id: choiceEditor
                ThemeSuggest {
                    id: choice
                    objectName: "field_" + line.key
                    problem: line.problem
                    maximumLength: 20000
                    Accessible.name: line.key
                    suggest: function(typed) {
                        const wanted = typed.toLowerCase()
                        return line.choices.filter(one => one.text.toLowerCase().indexOf(wanted) >= 0 || one.value.indexOf(wanted) === 0)
                            .map(one => ({ text: one.value, detail: one.text, suits: true }))
                    }
                    onTextEdited: line.enter(text)
                    onChosen: function(text) { line.enter(text) }
                    onActiveFocusChanged: if (activeFocus) scroll.see(line)
                    Qml.Binding { target: choice; property: "text"; value: line.text; when: !choice.activeFocus; restoreMode: Qml.Binding.RestoreNone }
                }
            }
        }
    }
}
