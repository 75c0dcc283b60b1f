// The heading of a part.
import QtQuick
import QtQuick.Controls

Label {
    font.bold: true
    elide: Text.ElideRight
    textFormat: Text.PlainText
}
