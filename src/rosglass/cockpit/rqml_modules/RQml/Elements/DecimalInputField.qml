// A field for a number with decimals.
import QtQuick

NumberField {
    id: field

    property int decimals: 3
    property real value: 0

    function formatValue(number) { return Number(Number(number).toFixed(Math.max(0, decimals))) }

    get: () => value
    set: number => value = number
    shown: number => formatValue(number)
    parse: text => parseFloat(text)
    inputMethodHints: Qt.ImhFormattedNumbersOnly
    validator: RegularExpressionValidator { regularExpression: /[-+]?\d*\.?\d*([eE][-+]?\d*)?/ }
    onValueChanged: show()
    onDecimalsChanged: show()
    Component.onCompleted: show()
}
