// Which keys are held down. On X11 a key held down repeats as releases and presses that Qt marks as
// repeats only when both wait in its queue: a press right after the release of the same key is
// therefore none, and a release counts only when no press follows it.
import QtQuick

QtObject {
    id: keyboard

    signal lifted(int key)

    property var down: ({})
    // Keys let go just now: for how many more ticks a press of them would be a repeat.
    property var leaving: ({})

    // Return whether the key was up before.
    function press(key) {
        const repeated = key in leaving
        delete leaving[key]
        if (repeated || key in down)
            return false
        down[key] = true
        return true
    }

    function lift(key) {
        // Also of a key that is not known to be down: it was pressed before the window had the keys.
        leaving[key] = 2
        ticker.start()
    }

    // Forget all keys: their release may have gone to another window.
    function clear() {
        down = {}
    }

    // Two ticks of 16 ms: after a hiccup, the press that waits in the queue is seen between them.
    readonly property Timer ticker: Timer {
        id: ticker
        interval: 16
        repeat: true
        onTriggered: {
            for (const key in keyboard.leaving) {
                if (--keyboard.leaving[key] > 0)
                    continue
                delete keyboard.leaving[key]
                if (key in keyboard.down) {
                    delete keyboard.down[key]
                    keyboard.lifted(Number(key))
                }
            }
            if (Object.keys(keyboard.leaving).length === 0)
                stop()
        }
    }
}
