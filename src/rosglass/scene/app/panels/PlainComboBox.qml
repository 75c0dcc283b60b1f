import QtQuick
import QtQuick.Controls.Fusion

// A combo box whose texts are never taken for rich text: names come from the robot.
ComboBox {
    id: box

    delegate: ItemDelegate {
        id: row

        required property string modelData
        required property int index

        width: ListView.view.width
        highlighted: box.highlightedIndex === index
        contentItem: Text {
            text: row.modelData
            textFormat: Text.PlainText
            elide: Text.ElideRight
            color: row.highlighted ? row.palette.highlightedText : row.palette.text
        }
    }
}
