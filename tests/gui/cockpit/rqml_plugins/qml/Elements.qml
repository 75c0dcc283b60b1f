// Every type of RQml.Elements, RQml.Fonts and RQml.Utils.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import Ros2
import RQml.Elements
import RQml.Fonts
import RQml.Utils

Rectangle {
    id: root

    property string icon: IconFont.iconTrash
    property string font: IconFont.name
    property var log: []

    function score(text, query) { return FuzzySearch.score(text, query) }
    function best(texts, query) { return texts.map(t => [FuzzySearch.score(t, query), t]).sort((a, b) => b[0] - a[0])[0][1] }
    function fields(texts, query) { return FuzzySearch.scoreFields(texts, query) }
    function plain(value) { return JSON.stringify(MessageUtils.toJavaScriptObject(value)) }
    function listed(value) { return JSON.stringify(MessageUtils.toListElement(value)) }
    function stripped(value) { return JSON.stringify(MessageUtils.stripEmptyFields(value)) }
    function empty(type) { return Ros2.createEmptyMessage(type) }
    function show(type) { model.message = Ros2.createEmptyMessage(type) }
    function edited() { return JSON.stringify(model.message) }

    anchors.fill: parent
    color: palette.base

    Object {
        id: parts
        objectName: "parts"
        property int number: 3
        QtObject {}
        Timer {}
    }
    ColumnLayout {
        anchors.fill: parent

        RowLayout {
            Title { text: "Title" }
            Caption { text: "Caption" }
            Hint { text: "Hint" }
            TruncatedLabel { text: "Truncated label"; Layout.preferredWidth: 60 }
            LetterIndicator { text: "S"; color: "red"; textColor: "white"; font.family: IconFont.name; tooltipText: "Source" }
            Item {
                implicitWidth: 24
                implicitHeight: 24
                StateIndicator { state: "active" }
            }
            IconButton { text: IconFont.iconTrash; tooltipText: "Remove" }
            IconTextButton { iconText: IconFont.iconCopy; text: "Copy"; tooltipText: "Copy it" }
            IconToggleButton { id: toggle; objectName: "toggle"; iconOn: "on"; iconOff: "off"; tooltipTextOn: "Stop"; tooltipTextOff: "Start" }
            RefreshButton { animate: false }
        }
        RowLayout {
            DecimalInputField { id: decimals; objectName: "decimals"; decimals: 2; from: -1; to: 10; value: 1.5 }
            IntegerInputField { id: integer; objectName: "integer"; from: 0; to: 255; value: 7 }
            DecimalSpinBox { id: spin; objectName: "spin"; from: 0; to: 9; suffix: "m"; value: 3.5 }
        }
        ChangeSlider { id: change; objectName: "change"; from: -1; to: 1; value: 0.5; currentValue: -0.5; Layout.fillWidth: true }
        SpeedSlider { id: speed; objectName: "speed"; from: -2; to: 2; Layout.preferredHeight: 140 }
        FuzzySelector {
            id: selector
            objectName: "selector"
            Layout.fillWidth: true
            model: ["/odom", "/camera/image", "/cmd_vel"]
            onAccepted: text => root.log = root.log.concat(text)
        }
        SearchBar { id: search; objectName: "search"; debounceInterval: 1; Layout.fillWidth: true; onNextRequested: root.log = root.log.concat("next") }
        LoadingListView {
            id: list
            objectName: "list"
            Layout.fillWidth: true
            Layout.preferredHeight: 60
            model: 2
            header: ListHeader { text: "Header" }
            delegate: Label { text: index }
        }
        MessageContentEditor {
            id: editor
            objectName: "editor"
            Layout.fillWidth: true
            Layout.fillHeight: true
            Layout.minimumHeight: 300
            model: MessageItemModel { id: model; objectName: "model" }
        }
    }
    EditMessageDialog { id: dialog; objectName: "dialog"; width: 300; height: 300 }
    ToastManager { id: toasts; objectName: "toasts"; maxToasts: 2; dismissDuration: 60000 }
}
