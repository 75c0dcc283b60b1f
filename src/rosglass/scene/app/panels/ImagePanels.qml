import QtQuick
import RosScene 1.0

// A panel over a view for each of its image displays; the user may move, resize and close them.
Item {
    id: area

    // The SceneView.
    property SceneView view: null
    // Panels that the user has not moved are in rows from the lower edge, as large as all of them fit.
    readonly property int count: view ? view.scene.pictureList.length : 0
    readonly property int columns: {
        let found = Math.max(2, Math.floor((width - 20) / 330))
        while (found < count && Math.ceil(count / found) * rowHeight(found) > height - 10)
            found++
        return found
    }

    function columnWidth(columns) { return Math.min(330, (width - 20) / columns) }
    function rowHeight(columns) { return (columnWidth(columns) - 10) * 0.75 + 10 }

    Repeater {
        model: area.view ? area.view.scene.pictureList : []
        ImagePanel {
            id: panel
            required property int index
            required property QtObject modelData
            // As the user has left it.
            readonly property rect saved: modelData.panelGeometry
            readonly property bool placed: saved.width > 0

            function keep(rect) { modelData.panelGeometry = rect }

            display: modelData
            movable: true
            border { width: 1; color: "#606060" }
            width: placed ? saved.width : area.columnWidth(area.columns) - 10
            height: placed ? saved.height : width * 0.75
            x: placed ? Math.max(0, Math.min(saved.x, area.width - 40)) : 10 + index % area.columns * area.columnWidth(area.columns)
            y: placed ? Math.max(0, Math.min(saved.y, area.height - 40))
                : Math.max(0, area.height - (1 + Math.floor(index / area.columns)) * area.rowHeight(area.columns))
            onDragged: (dx, dy) => keep(Qt.rect(Math.max(0, x + dx), Math.max(0, y + dy), width, height))
            onResized: (dx, dy) => keep(Qt.rect(x, y, Math.max(80, width + dx), Math.max(60, height + dy)))
        }
    }
}
