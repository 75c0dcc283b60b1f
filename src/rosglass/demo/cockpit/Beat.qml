// When the screen changes: with each camera picture, so that one redraw serves everything, and ten
// times a second when there is no picture. What cannot wait does not wait for it.
pragma Singleton
import QtQuick

QtObject {
    id: beat

    signal tick()

    function picture() {
        fallback.restart()
        beat.tick()
    }

    readonly property Timer fallback: Timer {
        id: fallback
        interval: 100
        running: true
        repeat: true
        onTriggered: beat.tick()
    }
}
