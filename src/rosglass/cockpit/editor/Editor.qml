// The window of `rosglass cockpit`: a layout, and in edit mode the catalogue and the properties around it.
import QtQuick 2.15
import QtQuick.Window 2.15
import RosControls 1.0

Window {
    id: window

    readonly property bool editing: program.opened && program.editing
    // Where the layout is shown.
    readonly property Item stage: stage_
    property bool sure_: false

    width: Math.min(1280, Screen.width)
    height: Math.min(800, Screen.height)
    visible: true
    color: Theme.background
    title: (program.modified ? "• " : "") + (program.opened ? program.name : qsTr("Cockpit")) + " – rosglass"

    onClosing: function(close) {
        if (!program.modified || sure_)
            return
        close.accepted = false
        closing.open()
    }
    Component.onCompleted: {
        program.begin(window, stage_)
        hint_()
    }

    function hint_() {
        // Questions come first.
        if (program.hints && !program.kiosk && program.question === "" && !tour.running)
            tour.start()
    }

    EditorBar {
        id: bar
        anchors { left: parent.left; right: parent.right; top: parent.top }
        visible: !program.kiosk
        height: visible ? implicitHeight : 0
        recordedSeconds: strip.recording ? strip.elapsed : -1
        onPaletteWanted: palette.open()
        onFileWanted: function(purpose) { files.ask(purpose) }
        onHelpWanted: program.help("")
    }
    CatalogueBox {
        id: catalogue
        objectName: "catalogue"
        anchors { left: parent.left; top: bar.bottom; bottom: strip.top }
        width: visible ? Math.min(280 * Theme.size, window.width * 0.3) : 0
        visible: window.editing
    }
    Item {
        id: stage_
        objectName: "stage"
        anchors { left: catalogue.right; right: properties.left; top: bar.bottom; bottom: strip.top }
        // What is held behind the start page lets go; an item that is only hidden keeps the keyboard.
        enabled: visible
        visible: program.opened
    }
    StartPage {
        id: startPage
        objectName: "startPage"
        anchors.fill: stage_
        visible: !program.opened
        onFileWanted: function(purpose) { files.ask(purpose) }
    }
    // Behind the layout in the order of Tab, as on the screen.
    PropertyBox {
        id: properties
        objectName: "properties"
        anchors { right: parent.right; top: bar.bottom; bottom: strip.top }
        width: visible ? Math.min(320 * Theme.size, window.width * 0.3) : 0
        visible: window.editing && program.selected
    }
    ErrorBox {
        anchors { fill: stage_; margins: Theme.gap }
        visible: program.problem !== ""
        text: program.problem
    }
    RecordingStrip {
        id: strip
        objectName: "strip"
        anchors { left: parent.left; right: parent.right; bottom: status.top }
        visible: !program.kiosk && used
        height: visible ? implicitHeight : 0
    }
    Connections {
        target: program
        function onRecordRequested() { strip.record() }
        function onMarkRequested() { strip.mark() }
    }
    Rectangle {
        id: status
        objectName: "status"
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        // Always there: the layout does not move when there is something to say.
        height: visible ? 28 * Theme.size : 0
        visible: !program.kiosk
        color: Theme.panel
        ThemeText {
            anchors { fill: parent; leftMargin: Theme.gap; rightMargin: Theme.gap }
            verticalAlignment: Text.AlignVCenter
            text: program.message || (program.opened ? program.path : "")
            color: program.message ? Theme.text : Theme.dim
            Accessible.role: Accessible.AlertMessage
            Accessible.name: text
        }
    }

    TourBox {
        id: tour
        objectName: "tour"
        anchors.fill: parent
        z: 1
        steps: [
            { item: bar.robotButton.visible ? bar.robotButton : startPage.robotTools, text: qsTr("Choose the robot here. Without one, try everything on a simulated robot.") },
            { item: program.opened ? (catalogue.visible ? catalogue : bar.editButton) : startPage.layoutTools, text: qsTr("Add panels: show all that suits the robot, or start with an empty layout and choose from the list on the left.") },
            { item: bar.editButton.visible ? bar.editButton : bar.commandsButton, text: qsTr("F4 changes between editing and using a layout. While it is used, nothing moves under your hand.") },
            { item: bar.commandsButton, text: qsTr("%1 finds every command by a part of its name, the list of keys and this tour included. F1 explains the current panel.").arg(program.keysOf("palette")) }
        ]
        onEnded: program.endHints()

        Shortcut {
            sequence: "Escape"
            enabled: tour.running && !palette.visible && !helpBox.visible && !question.visible && !closing.visible
            onActivated: tour.end()
        }
    }
    CommandPalette { id: palette; objectName: "palette" }
    FileBox { id: files }
    HelpBox {
        id: helpBox
        objectName: "helpBox"
        visible: program.helpText !== ""
    }
    QuestionBox {
        id: closing
        objectName: "closing"
        text: qsTr("%1 has changes that are not saved.").arg(program.name)
        answers: [qsTr("Save"), qsTr("Discard"), qsTr("Go on")]
        onAnswered: function(index) {
            if (index === 2 || index === 0 && !program.save(""))
                return
            if (index === 1)
                program.discard()
            window.sure_ = true
            window.close()
        }
    }
    QuestionBox {
        id: question
        objectName: "question"
        text: program.question
        answers: program.answers
        first: program.firstAnswer
        onAnswered: function(index) { program.answer(index) }
        Connections {
            target: program
            function onQuestionChanged() { if (program.question !== "") question.open(); else question.close() }
        }
    }

    Connections {
        target: program
        function onHintsChanged() { window.hint_() }
        function onQuestionChanged() { Qt.callLater(window.hint_) }
        function onFocusWanted(place) {
            if (place === "form")
                properties.find()
            else
                catalogue.find()
        }
    }
    // Without a panel; with one, F1 is its own.
    Shortcut {
        sequence: "F1"
        enabled: !program.opened || !program.selected
        onActivated: program.run("keys")
        onActivatedAmbiguously: program.run("keys")
    }
    Repeater {
        model: program.commands("")
        Item {
            Shortcut {
                sequences: modelData.keys ? [modelData.keys] : []
                context: Qt.ApplicationShortcut
                onActivated: modelData.name === "palette" ? palette.open()
                    : modelData.file ? files.ask(modelData.name) : program.run(modelData.name)
            }
        }
    }
}
