import QtQuick 2.15
import QtQuick.Controls 2.15
import QtQuick.Window 2.15

ApplicationWindow {
    id: window

    readonly property var images: [
        "http://0.0.0.0:9/a.png", "file:///nothing/a.png", "image://nothing/a", "a.png", ""
    ]
    property int turn: 0
    // There from the start, and later others.
    property string hostile: "<img src='" + images[turn % images.length] + "'> <b>" + turn + "</b>"

    width: 600; height: 800; visible: true
    title: hostile
    onFrameSwapped: turn < 12 ? ++turn : console.log("all texts were shown")

    menuBar: MenuBar {
        Menu {
            id: menu
            title: window.hostile
            MenuItem { text: window.hostile }
            Menu { title: window.hostile; MenuItem { text: window.hostile } }
            Action { text: window.hostile }
        }
    }
    header: ToolBar { ToolButton { text: window.hostile } }
    footer: TabBar { TabButton { text: window.hostile } }

    Flow {
        anchors.fill: parent
        Button { objectName: "button"; text: window.hostile }
        Button { text: window.hostile; icon.source: "nothing.png"; display: AbstractButton.TextUnderIcon }
        Button { action: Action { text: window.hostile } }
        RoundButton { text: window.hostile }
        DelayButton { text: window.hostile }
        CheckBox { objectName: "check"; text: window.hostile }
        RadioButton { text: window.hostile }
        Switch { text: window.hostile }
        ItemDelegate { objectName: "item"; text: window.hostile }
        CheckDelegate { text: window.hostile }
        RadioDelegate { text: window.hostile }
        SwitchDelegate { text: window.hostile }
        SwipeDelegate { text: window.hostile }
        ComboBox { id: choice; model: [window.hostile, "other"] }
        ComboBox { model: [window.hostile]; editable: true; displayText: window.hostile }
        GroupBox { title: window.hostile }
        Label { text: window.hostile }
        Text { text: window.hostile }
        TextField { text: window.hostile; placeholderText: window.hostile }
        TextField { placeholderText: window.hostile }
        TextArea { text: window.hostile }
        TextArea { placeholderText: window.hostile }
        SpinBox { textFromValue: function () { return window.hostile } }
        Tumbler { model: [window.hostile] }
        Frame { Label { text: window.hostile } }
        DialogButtonBox { Button { text: window.hostile } }
        ListView { width: 100; height: 100; model: 3; delegate: ItemDelegate { text: window.hostile } }
        Repeater { model: window.turn; Button { text: window.hostile } }
        Item {
            width: 10; height: 10
            ToolTip { visible: true; text: window.hostile }
        }
        Item {
            width: 10; height: 10
            ToolTip.visible: true
            ToolTip.text: window.hostile
        }
    }
    Dialog { id: dialog; title: window.hostile; standardButtons: Dialog.Ok; Label { text: window.hostile } }
    Component.onCompleted: {
        choice.popup.open()
        menu.open()
        dialog.open()
    }
}
