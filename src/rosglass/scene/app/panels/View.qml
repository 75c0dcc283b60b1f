import QtQuick
import RosScene 1.0

// The window of `rosglass view`: the 3D view, and what is around it once the first picture is on the screen, as
// loading Qt's controls takes long. `program` is a ViewProgram.
Window {
    id: window

    property bool panels: !program.kiosk
    // Whether the first picture is on the screen.
    property bool drawn: false
    // Where the 3D view is; until the panels are there, about where it will be.
    readonly property rect place: around.item ? around.item.place : !panels ? Qt.rect(0, 0, width, height)
        : Qt.rect(left, 27, Math.max(width - left - (program.hidesRightDock ? 0 : 252), 100), Math.max(height - 49, 0))
    readonly property int left: program.hidesLeftDock ? 0 : 332

    width: 1280
    height: 800
    visible: true
    color: palette.window
    title: (program.configName || "new view") + (program.modified ? " *" : "") + " - rosglass"

    Component.onCompleted: { scene.bare = !panels; program.begin(scene) }
    // Later: the picture is not on the screen before this handler has ended.
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
        // Overlays may want it alone.
        onBareChanged: window.panels = !bare

        // Its types are loaded with the first display of pictures.
        Loader {
            objectName: "imagePanels"
            anchors.fill: parent
            active: window.drawn && scene.scene.pictureList.length > 0
            source: "ImagePanels.qml"
            onLoaded: item.view = scene
        }
    }
}
