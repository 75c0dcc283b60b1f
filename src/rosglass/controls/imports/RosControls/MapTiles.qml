// The tiles of one layer of a map; a part of the maps.
import QtQuick 2.15

Item {
    id: tiled

    // A tile layer of a MapScene or GeoScene.
    property var source: null

    visible: !!source && source.shown

    Item {
        transform: Matrix4x4 { matrix: tiled.source ? tiled.source.matrix : Qt.matrix4x4() }

        Repeater {
            model: tiled.source ? tiled.source.tiles : null

            Image {
                x: model.left
                y: model.up
                z: model.order
                width: model.wide
                height: model.high
                source: model.image
                smooth: tiled.source ? tiled.source.smooth : true
                cache: false
            }
        }
    }
}
