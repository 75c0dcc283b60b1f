// Sets when the screen changes: with each camera image, so that one redraw serves everything, and ten
// times a second without images. Urgent changes do not wait for it.
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
