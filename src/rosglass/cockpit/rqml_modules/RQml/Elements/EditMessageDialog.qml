// A dialog with the fields of a message, or its text as JSON.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import Ros2
import RQml.Fonts
import RQml.Utils

Dialog {
    id: dialog

    property alias message: fields.message
    property alias messageType: fields.messageType
    property bool readonly: false

    function json_() { return JSON.stringify(MessageUtils.toJavaScriptObject(message) ?? {}, null, 2) }

    // Returns whether the text could be taken over.
    function commit_() {
        if (readonly || !json.edited_)
            return true
        try {
            dialog.message = JSON.parse(json.text)
            wrong.text = ""
            json.edited_ = false
        } catch (error) {
            wrong.text = qsTr("This is not JSON: %1").arg(error.message)
        }
        return wrong.text === ""
    }

    title: readonly ? qsTr("Message") : qsTr("Edit Message Content")
    standardButtons: readonly ? Dialog.Close : Dialog.Ok | Dialog.Cancel
    onAboutToShow: json.refresh()

    ColumnLayout {
        anchors.fill: parent

        TabBar {
            id: tabs
            Layout.fillWidth: true
            TabButton {
                objectName: "editMessageDialogVisualTabButton"
                text: qsTr("Visual")
            }
            TabButton {
                objectName: "editMessageDialogJsonTabButton"
                text: qsTr("JSON")
            }
            onCurrentIndexChanged: {
                if (currentIndex === 1)
                    json.refresh()
                else
                    dialog.commit_()
            }
        }
        StackLayout {
            Layout.fillWidth: true
            Layout.fillHeight: true
            currentIndex: tabs.currentIndex

            MessageContentEditor {
                id: editor
                readonly: dialog.readonly
                model: MessageItemModel {
                    id: fields
                    onMessageChanged: Qt.callLater(() => { if (editor) editor.expandRecursively() })
                    onModified: json.refresh()
                }
            }
            ColumnLayout {
                ScrollView {
                    Layout.fillWidth: true
                    Layout.fillHeight: true
                    TextArea {
                        id: json
                        objectName: "editMessageDialogJsonTextArea"
                        property bool edited_: false
                        function refresh() {
                            text = dialog.json_()
                            edited_ = false
                        }
                        readOnly: dialog.readonly
                        wrapMode: TextEdit.NoWrap
                        textFormat: TextEdit.PlainText
                        onTextChanged: edited_ = activeFocus || edited_
                        onEditingFinished: dialog.commit_()
                    }
                }
                RowLayout {
                    Label {
                        id: wrong
                        Layout.fillWidth: true
                        textFormat: Text.PlainText
                        elide: Text.ElideRight
                        Accessible.role: Accessible.AlertMessage
                        Accessible.name: text
                    }
                    IconTextButton {
                        objectName: "editMessageDialogCopyJsonButton"
                        iconText: IconFont.iconCopy
                        text: qsTr("Copy JSON")
                        onClicked: RQml.copyTextToClipboard(json.text)
                    }
                }
            }
        }
    }
}
