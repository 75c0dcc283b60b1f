import QtQuick
import RosScene 1.0

// A panel over a view for each display of pictures in it; the user may move and resize them.
Item {
    id: area

    // The SceneView.
    property SceneView view: null

    Repeater {
        model: area.view ? area.view.scene.pictureList : []
        ImagePanel {
            id: panel
            required property int index
            required property QtObject modelData
            // As the user has left it; until then in a row at the lower edge.
            readonly property rect saved: modelData.panelGeometry
            readonly property bool placed: saved.width > 0

            function keep(rect) { modelData.panelGeometry = rect }

            display: modelData
            movable: true
            border { width: 1; color: "#606060" }
            width: placed ? saved.width : Math.min(320, area.width / 2 - 20)
            height: placed ? saved.height : width * 0.75
            x: placed ? Math.max(0, Math.min(saved.x, area.width - 40)) : 10 + index * (width + 10)
            y: placed ? Math.max(0, Math.min(saved.y, area.height - 40)) : area.height - height - 10
            onDragged: (dx, dy) => keep(Qt.rect(Math.max(0, x + dx), Math.max(0, y + dy), width, height))
            onResized: (dx, dy) => keep(Qt.rect(x, y, Math.max(80, width + dx), Math.max(60, height + dy)))
        }
    }
}
