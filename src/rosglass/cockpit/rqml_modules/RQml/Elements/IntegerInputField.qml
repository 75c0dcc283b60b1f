// A field for a whole number.
import QtQuick

NumberField {
    property var value: 0

    get: () => value
    set: number => value = number
    shown: number => Number(number).toFixed(0)
    parse: text => parseInt(text, 10)
    inputMethodHints: Qt.ImhDigitsOnly
    validator: RegularExpressionValidator { regularExpression: /[-+]?\d*/ }
    onValueChanged: show()
    Component.onCompleted: show()
}
