// The fields of a message (a MessageItemModel), with an editor for each by its type.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import RQml.Fonts

TreeView {
    id: tree

    property bool readonly: false

    clip: true
    boundsBehavior: Flickable.StopAtBounds
    columnSpacing: 4
    columnWidthProvider: column => {
        const first = Math.max(100, Math.min(tree.width * 0.55, tree.implicitColumnWidth(0)))
        return column === 0 ? first : Math.max(120, tree.width - first - tree.columnSpacing)
    }
    onWidthChanged: Qt.callLater(() => { if (tree) tree.forceLayout() })
    ScrollBar.vertical: ScrollBar {}

    delegate: Item {
        id: cell

        required property TreeView treeView
        required property bool isTreeNode
        required property bool expanded
        required property bool hasChildren
        required property int depth
        required property int row
        required property int column
        required property var model
        readonly property string type_: model.type ?? ""
        readonly property bool isLeaf_: type_ !== "array" && type_ !== "compound"

        implicitHeight: 40
        implicitWidth: isTreeNode ? 12 + 16 * depth + 20 + name.implicitWidth : 160

        Label {
            id: arrow
            textFormat: Text.PlainText
            visible: cell.isTreeNode && cell.hasChildren
            x: 4 + 16 * cell.depth
            anchors.verticalCenter: parent.verticalCenter
            text: cell.expanded ? IconFont.iconChevronDown : IconFont.iconChevronRight
            font { family: IconFont.name; pixelSize: 10 }
        }
        TruncatedLabel {
            id: name
            visible: cell.isTreeNode
            anchors { left: parent.left; leftMargin: 20 + 16 * cell.depth; right: parent.right; verticalCenter: parent.verticalCenter }
            text: !cell.isTreeNode ? "" : cell.model.isArrayElement ? "[" + cell.model.display + "]" : String(cell.model.display ?? "")
            Accessible.role: Accessible.TreeItem
            Accessible.name: text
        }
        TapHandler {
            enabled: cell.isTreeNode && cell.hasChildren
            onTapped: cell.treeView.toggleExpanded(cell.row)
        }
        RowLayout {
            visible: !cell.isTreeNode
            anchors { fill: parent; rightMargin: 8 }

            Label {
                textFormat: Text.PlainText
                visible: !cell.isTreeNode && cell.type_ === "array" && !cell.hasChildren
                text: "[]"
            }
            Loader {
                Layout.fillWidth: true
                active: !cell.isTreeNode && cell.isLeaf_
                sourceComponent: tree.readonly ? shownValue : cell.type_ === "bool" ? truth : cell.type_.indexOf("string") >= 0 ? words : number
            }
            Item { Layout.fillWidth: true }
            IconButton {
                visible: !tree.readonly && !cell.isTreeNode && cell.type_ === "array" && cell.model.edit !== undefined && cell.model.edit !== null
                text: IconFont.iconAdd
                tooltipText: qsTr("Add an element")
                onClicked: {
                    const index = cell.model.treeIndex
                    tree.model.insertRows(tree.model.rowCount(index), 1, index)
                    tree.expand(cell.row)
                }
            }
            IconButton {
                visible: !tree.readonly && !cell.isTreeNode && cell.model.isArrayElement
                text: IconFont.iconTrash
                tooltipText: qsTr("Remove this element")
                onClicked: {
                    const index = cell.model.treeIndex
                    tree.model.removeRows(index.row, 1, index.parent)
                }
            }
        }
        Component {
            id: shownValue
            TruncatedLabel { text: String(cell.model.display ?? "") }
        }
        Component {
            id: truth
            CheckBox {
                property bool value_: !!cell.model.edit
                onValue_Changed: checked = value_
                Component.onCompleted: checked = value_
                onToggled: cell.model.edit = checked
            }
        }
        Component {
            id: number
            TextField {
                id: field
                property var value_: cell.model.edit
                function show() { text = value_ === undefined || value_ === null ? "" : String(value_) }
                selectByMouse: true
                Accessible.name: cell.type_
                placeholderText: cell.type_
                onValue_Changed: if (!activeFocus) show()
                Component.onCompleted: show()
                onEditingFinished: {
                    // What does not fit into the field's type is logged and taken back.
                    if (text !== String(cell.model.edit))
                        cell.model.edit = text.trim()
                    text = String(cell.model.edit ?? "")
                }
            }
        }
        Component {
            id: words
            TextField {
                property string value_: String(cell.model.edit ?? "")
                selectByMouse: true
                placeholderText: cell.type_
                onValue_Changed: if (!activeFocus && text !== value_) text = value_
                Component.onCompleted: text = value_
                onTextEdited: cell.model.edit = text
            }
        }
    }
}
