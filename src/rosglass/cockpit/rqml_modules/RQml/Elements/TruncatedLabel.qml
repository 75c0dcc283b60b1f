// A text that ends with an ellipsis where it has no room; the pointer shows all of it.
import QtQuick
import QtQuick.Controls

Label {
    id: label

    elide: Text.ElideRight
    // A text of several lines is not cut by the ellipsis.
    clip: contentWidth > width
    textFormat: Text.PlainText

    HoverHandler { id: pointer }
    ToolTip {
        delay: 500
        text: label.text
        visible: pointer.hovered && (label.truncated || label.contentWidth > label.width + 1 || label.contentHeight > label.height + 1)
    }
}
