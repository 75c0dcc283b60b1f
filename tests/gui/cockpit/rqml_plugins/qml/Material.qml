import QtQuick
import QtQuick.Controls
import QtQuick.Controls.Material

Rectangle {
    color: palette.base
    Label { objectName: "label"; text: "text" }
}
