// A text of a control: plain, whatever a robot sends, and cut with an ellipsis where it has no room.
import QtQuick 2.15

Text {
    textFormat: Text.PlainText
    elide: Text.ElideRight
    color: Theme.text
    font.pixelSize: Theme.normal
}
