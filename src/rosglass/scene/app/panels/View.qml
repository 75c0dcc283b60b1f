import QtQuick
import RosScene 1.0

// The window of `rosglass view`: the 3D view, and the panels around it, which are loaded after the first frame, as
// loading Qt's controls takes long. `program` is a ViewProgram.
Window {
    id: window

    property bool panels: !program.kiosk
    // True once the first frame is on the screen.
    property bool drawn: false
    // The rectangle of the 3D view; an estimate until the panels are loaded.
    readonly property rect place: around.item ? around.item.place : !panels ? Qt.rect(0, 0, width, height)
        : Qt.rect(left, 27, Math.max(width - left - (program.hidesRightDock ? 0 : 252), 100), Math.max(height - 49, 0))
    readonly property int left: program.hidesLeftDock ? 0 : 332

    width: 1280
    height: 800
    visible: true
    color: palette.window
    title: (program.configName || "new view") + (program.modified ? " *" : "") + " - rosglass"

    Component.onCompleted: { scene.bare = !panels; program.begin(scene) }
    // Later, because the frame reaches the screen only after this handler.
    onFrameSwapped: if (!drawn) Qt.callLater(showPanels)
    onPanelsChanged: scene.bare = !panels

    function showPanels() {
        program.prepare_controls()
        around.setSource("WindowPanels.qml", { "window": window, "scene": scene })
        drawn = true
    }

    Loader { id: around; anchors.fill: parent }
    SceneView {
        id: scene
        objectName: "scene"
        x: window.place.x
        y: window.place.y
        width: window.place.width
        height: window.place.height
        focus: true
        focusOnClick: true
        // Overlays may request the view alone.
        onBareChanged: window.panels = !bare

        // Its types are loaded with the first image display.
        Loader {
            objectName: "imagePanels"
            anchors.fill: parent
            active: window.drawn && scene.scene.pictureList.length > 0
            source: "ImagePanels.qml"
            onLoaded: item.view = scene
        }
    }
}
