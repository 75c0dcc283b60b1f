// Steering by keyboard: W A S D or the arrow keys, held down.
import QtQuick

QtObject {
    id: keys

    required property var drive
    property real speed: 0.8
    property real turn: 0.8
    // Keys held down now, by direction.
    property var down: ({})

    readonly property var directions: ({
        [Qt.Key_W]: "forward", [Qt.Key_Up]: "forward",
        [Qt.Key_S]: "back", [Qt.Key_Down]: "back",
        [Qt.Key_A]: "left", [Qt.Key_Left]: "left",
        [Qt.Key_D]: "right", [Qt.Key_Right]: "right"
    })

    // Return whether the key is one of ours.
    function press(key) {
        if (!(key in directions))
            return false
        down[key] = true
        apply()
        return true
    }

    function lift(key) {
        delete down[key]
        apply()
    }

    // Forget all keys: their release may have gone to another window.
    function clear() {
        if (Object.keys(down).length === 0)
            return
        down = {}
        apply()
    }

    function holds(direction) {
        for (const key in down)
            if (directions[key] === direction)
                return true
        return false
    }

    function apply() {
        if (Object.keys(down).length === 0) {
            drive.release()
            return
        }
        const forward = (holds("forward") ? 1 : 0) - (holds("back") ? 1 : 0)
        const left = (holds("left") ? 1 : 0) - (holds("right") ? 1 : 0)
        drive.steer(forward * speed, left * turn)
    }
}
