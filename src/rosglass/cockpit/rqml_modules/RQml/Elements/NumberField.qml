// A field for one number. What is typed counts when it is finished; what is not a number is taken back.
import QtQuick
import QtQuick.Controls

TextField {
    id: field

    // Limits; null or undefined for none.
    property var from: null
    property var to: null
    // Returns a number as it is shown, and the number of a text: NaN if it is not one.
    property var shown: number => String(number)
    property var parse: text => Number(text)
    // Returns the value, and sets it.
    property var get: () => 0
    property var set: number => undefined

    function show() {
        const next = String(shown(get()))
        if (text !== next)
            text = next
    }

    selectByMouse: true
    onEditingFinished: {
        let number = text.trim() === "" ? NaN : parse(text)
        if (!isNaN(number)) {
            if (from !== null && from !== undefined && number < from)
                number = from
            if (to !== null && to !== undefined && number > to)
                number = to
            if (number !== get())
                set(number)
        }
        show()
    }
}
