import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Dialogs
import QtQuick.Layouts
import RosScene 1.0

// What is around the 3D view in the window of `rosglass view`: tool bar, panels, status bar and dialogs.
Page {
    id: page

    // The root of View.qml.
    required property Window window
    required property SceneView scene
    // Where the 3D view goes.
    readonly property rect place: Qt.rect(middle.x, contentItem.y, middle.width, Math.max(middle.height, 0))
    readonly property int aboveOverlays: 1000000

    function openOther() {
        if (program.mayClose())
            opening.open()
        else
            unsaved.ask(() => opening.open())
    }
    function save() {
        if (program.configName)
            program.save("")
        else
            saving.ask(null)
    }

    Connections {
        target: page.window
        function onClosing(close) {
            if (!program.mayClose()) {
                close.accepted = false
                unsaved.ask(() => { program.discard(); page.window.close() })
            }
        }
    }

    Shortcut { sequences: [StandardKey.Save]; onActivated: page.save() }
    Shortcut { sequences: [StandardKey.Open]; onActivated: page.openOther() }
    Shortcut { sequence: "F10"; onActivated: page.window.panels = !page.window.panels }
    Shortcut { sequence: "F11"; onActivated: page.window.visibility = page.window.visibility === Window.FullScreen ? Window.Windowed : Window.FullScreen }

    header: ToolBar {
        visible: page.window.panels
        RowLayout {
            anchors.fill: parent
            // In a narrow window, tools go on in further lines.
            Flow {
                Layout.fillWidth: true
                ToolButton { text: "Open"; onClicked: page.openOther() }
                ToolButton { text: "Save"; onClicked: page.save() }
                ToolButton { text: "Save as"; onClicked: saving.ask(null) }
                ToolSeparator { height: 26 }
                Repeater {
                    model: page.scene.tools.all
                    ToolButton {
                        required property var modelData

                        text: modelData.name
                        down: modelData.selected ? true : undefined
                        // Keys are the view's.
                        focusPolicy: Qt.NoFocus
                        onClicked: modelData.select()
                        PlainToolTip {
                            visible: parent.hovered
                            plain: modelData.description + (modelData.shortcutKey ? " (" + modelData.shortcutKey.toUpperCase() + ")" : "")
                        }
                    }
                }
                ToolButton {
                    objectName: "addTool"
                    text: "+"
                    onClicked: newTools.popup()
                    PlainToolTip { visible: parent.hovered; plain: "Add a tool" }
                    Menu {
                        id: newTools
                        Repeater {
                            model: page.scene.tools.types
                            MenuItem {
                                required property string modelData
                                text: page.scene.tools.nameOf(modelData)
                                contentItem: Label { text: parent.text; textFormat: Text.PlainText }
                                onTriggered: program.say(page.scene.tools.addTool(modelData))
                            }
                        }
                    }
                }
                ToolButton {
                    objectName: "removeTool"
                    text: "−"
                    enabled: page.scene.tools.all.length > 1
                    onClicked: oldTools.popup()
                    PlainToolTip { visible: parent.hovered; plain: "Remove a tool" }
                    Menu {
                        id: oldTools
                        Repeater {
                            model: page.scene.tools.all
                            MenuItem {
                                required property var modelData
                                text: modelData.name
                                contentItem: Label { text: parent.text; textFormat: Text.PlainText }
                                onTriggered: page.scene.tools.removeTool(modelData)
                            }
                        }
                    }
                }
            }
            ToolButton {
                objectName: "reset"
                text: "Reset"
                focusPolicy: Qt.NoFocus
                onClicked: page.scene.reset()
                PlainToolTip { visible: parent.hovered; plain: "Drop all data that was received" }
            }
            ToolSeparator { }
            ToolButton {
                objectName: "leftDock"
                text: "Displays"
                checkable: true
                checked: !program.hidesLeftDock
                onToggled: program.hideDocks(!checked, program.hidesRightDock)
                PlainToolTip { visible: parent.hovered; plain: "Show the Displays panel; F10 hides everything but the 3D view" }
            }
            ToolButton {
                objectName: "rightDock"
                text: "Views"
                checkable: true
                checked: !program.hidesRightDock
                onToggled: program.hideDocks(program.hidesLeftDock, !checked)
                PlainToolTip { visible: parent.hovered; plain: "Show the panels Views, Tools and Selection; F10 hides everything but the 3D view" }
            }
        }
    }

    SplitView {
        anchors.fill: parent
        DisplaysPanel {
            objectName: "displaysPanel"
            visible: page.window.panels && !program.hidesLeftDock
            SplitView.preferredWidth: 330
            view: page.scene
        }
        Item {
            id: middle
            SplitView.fillWidth: true
            SplitView.minimumWidth: 100
        }
        ColumnLayout {
            visible: page.window.panels && !program.hidesRightDock
            SplitView.preferredWidth: 250
            spacing: 0
            TabBar {
                id: tabs

                Layout.fillWidth: true
                TabButton { text: "Views" }
                TabButton { text: "Tools" }
                TabButton { text: "Selection" }
            }
            StackLayout {
                currentIndex: tabs.currentIndex
                ViewsPanel { view: page.scene }
                ToolsPanel { view: page.scene }
                SelectionPanel { view: page.scene }
            }
        }
    }

    FontMetrics { id: line; font: page.font }
    footer: Pane {
        visible: page.window.panels
        padding: 4
        contentHeight: Math.ceil(line.height)
        RowLayout {
            anchors.fill: parent
            Label { Layout.maximumWidth: page.width / 2; text: program.connection; textFormat: Text.PlainText; elide: Text.ElideRight; color: program.connected ? palette.text : "#9a5b00" }
            ToolSeparator { }
            Label { text: program.time; textFormat: Text.PlainText }
            ToolSeparator { }
            // What was sent to the robot, or was not, comes first.
            Label { objectName: "status"; Layout.fillWidth: true; text: page.scene.tools.outcome || program.message || page.scene.statusText; textFormat: Text.PlainText; elide: Text.ElideRight }
            Label { objectName: "recording"; visible: text !== ""; text: program.recording; textFormat: Text.PlainText; color: "#c02020" }
            Label { text: program.frameRate + " fps"; textFormat: Text.PlainText }
        }
    }

    // As in RViz, keys are the view's while the mouse is over it, except for those of a text.
    HoverHandler {
        parent: page.scene
        onHoveredChanged: if (hovered && !(page.window.activeFocusItem instanceof TextInput)) page.scene.forceActiveFocus()
    }
    // A goal can be ended from everywhere, as in RViz's panel of Nav2.
    Button {
        parent: page.scene
        objectName: "cancelGoal"
        readonly property var tool: page.scene.tools.all.find(one => one.goalActive === true) || null
        z: page.aboveOverlays
        anchors { left: parent.left; top: parent.top; margins: 8 }
        visible: tool !== null
        text: "Cancel goal"
        focusPolicy: Qt.NoFocus
        onClicked: tool.cancelGoal()
    }
    // Without the status bar: keys still select tools, which send something.
    Label {
        parent: page.scene
        objectName: "bareStatus"
        z: page.aboveOverlays
        anchors { left: parent.left; bottom: parent.bottom; margins: 8 }
        width: Math.min(implicitWidth, parent.width - 16)
        visible: !page.window.panels && text !== ""
        text: page.scene.tools.outcome || (program.connected ? "" : program.connection)
        textFormat: Text.PlainText
        elide: Text.ElideRight
        padding: 6
        color: "white"
        background: Rectangle { color: "#c0202020"; radius: 4 }
    }
    Label {
        parent: page.scene
        anchors.centerIn: parent
        width: Math.min(implicitWidth, parent.width - 40)
        visible: page.scene.problem !== ""
        text: page.scene.problem
        textFormat: Text.PlainText
        wrapMode: Text.Wrap
        maximumLineCount: 20
        elide: Text.ElideRight
        padding: 12
        color: "white"
        background: Rectangle { color: "#c0801010"; radius: 6 }
    }

    FileDialog {
        id: opening
        title: "Open an RViz config"
        nameFilters: ["RViz configs (*.rviz)", "All files (*)"]
        onAccepted: program.open(selectedFile)
    }
    FileDialog {
        id: saving
        // What waits until it is saved, e.g. closing.
        property var then: null
        // Where the name is typed: Qt's own dialog neither has it focused nor accepts it by Return.
        property QtObject nameField: null
        property bool byReturn: false
        function ask(job) { then = job; byReturn = false; open(); Qt.callLater(focusName) }
        function focusName() {
            const field = program.findNameField(page.window)
            if (field === null) return  // a dialog of the system
            if (field !== nameField) {
                nameField = field
                field.accepted.connect(acceptName)
            }
            field.forceActiveFocus()
            field.selectAll()
        }
        function acceptName() {
            if (nameField.text.trim() === "") return
            byReturn = true
            accept()
        }
        function save(file) {
            program.save(file)
            if (then && program.mayClose()) then()
        }
        title: "Save the RViz config"
        fileMode: FileDialog.SaveFile
        defaultSuffix: "rviz"
        nameFilters: ["RViz configs (*.rviz)"]
        onAccepted: {
            const typed = program.typedFile(selectedFile)
            const isPath = typed.toString() !== ""
            // The dialog shows this folder the next time.
            if (isPath)
                selectedFile = typed
            // Its button has asked, for a file in the folder.
            if ((isPath || byReturn) && program.exists(selectedFile))
                replacing.ask(selectedFile)
            else
                save(selectedFile)
        }
    }
    MessageDialog {
        id: replacing
        property url file
        function ask(file) { replacing.file = file; open() }
        title: "rosglass view"
        text: "There is such a file already. Replace it?"
        informativeText: file.toString().replace(/^file:\/\//, "")
        buttons: MessageDialog.Yes | MessageDialog.No
        onButtonClicked: (button, role) => { if (button === MessageDialog.Yes) saving.save(file) }
    }
    MessageDialog {
        id: unsaved
        property var then: null
        function ask(job) { then = job; open() }
        title: "rosglass view"
        text: "The view has changed. Save it?"
        buttons: MessageDialog.Save | MessageDialog.Discard | MessageDialog.Cancel
        onButtonClicked: (button, role) => {
            if (button === MessageDialog.Save) {
                if (program.configName) {
                    program.save("")
                    if (program.mayClose()) then()
                } else {
                    saving.ask(then)
                }
            } else if (button === MessageDialog.Discard) {
                then()
            }
        }
    }
}
