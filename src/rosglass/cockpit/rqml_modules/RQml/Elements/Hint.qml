// A text that says what to do next.
import QtQuick
import QtQuick.Controls

Label {
    font.italic: true
    textFormat: Text.PlainText
    wrapMode: Text.WordWrap
}
