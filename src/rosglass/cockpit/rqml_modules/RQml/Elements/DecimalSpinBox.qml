// A spin box for a number with decimals and a unit.
import QtQuick
import QtQuick.Controls

Item {
    id: box

    property int decimals: 1
    property real from: 0
    property real to: 100
    property real stepSize: 0.1
    property real value: 0
    property string suffix
    property alias editable: spin.editable
    readonly property int decimalFactor: Math.pow(10, decimals)

    function decimalToInt(number) { return Math.round(number * decimalFactor) }

    implicitWidth: spin.implicitWidth
    implicitHeight: spin.implicitHeight
    onValueChanged: spin.value = decimalToInt(value)

    SpinBox {
        id: spin
        anchors.fill: parent
        editable: true
        from: box.decimalToInt(box.from)
        to: box.decimalToInt(box.to)
        stepSize: Math.max(1, box.decimalToInt(box.stepSize))
        value: box.decimalToInt(box.value)
        validator: RegularExpressionValidator { regularExpression: /.*/ }
        textFromValue: (whole, locale) => Number(whole / box.decimalFactor).toLocaleString(locale, "f", box.decimals) + box.suffix
        valueFromText: (text, locale) => {
            const plain = box.suffix && text.endsWith(box.suffix) ? text.slice(0, -box.suffix.length) : text
            let number = NaN
            try {
                number = Number.fromLocaleString(locale, plain.trim())
            } catch (error) {
                // It stays as it was.
            }
            return isNaN(number) ? spin.value : box.decimalToInt(number)
        }
        onValueModified: box.value = value / box.decimalFactor
    }
}
