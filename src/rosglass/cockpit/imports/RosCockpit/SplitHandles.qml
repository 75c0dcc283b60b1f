// The edges between the children of a Split, in edit mode: dragged, or moved by the arrow keys.
import QtQuick 2.15
import RosControls 1.0
import "elements.js" as Elements

Item {
    id: handles

    property Item split: null
    readonly property bool vertical_: split !== null && split.vertical_
    readonly property string along_: vertical_ ? "height" : "width"

    function sizes_() { return split.elements_.map(child => child[along_]) }

    // Sizes with the edge behind a child moved by so many pixels.
    function moved_(sizes, index, by) {
        const name = vertical_ ? "minimumHeight_" : "minimumWidth_"
        const both = sizes[index] + sizes[index + 1]
        const least = at => Math.min(split.elements_[at][name] || split.least_, both / 2)
        let made = sizes.slice()
        made[index] = Math.max(least(index), Math.min(both - least(index + 1), sizes[index] + by))
        made[index + 1] = both - made[index]
        return made
    }

    // Shares for sizes; those that stay nearly as they are, stay.
    function shares_(sizes) {
        const before = split.elements_.map(child => Elements.share(child))
        const unit = before.reduce((a, b) => a + b, 0) / Math.max(1, sizes.reduce((a, b) => a + b, 0))
        return sizes.map(function(size, at) {
            const share = size * unit
            return Math.abs(share - before[at]) <= 0.005 * before[at] ? before[at] : Math.max(0.01, Math.round(share * 100) / 100)
        })
    }

    // Moves the edge behind a child, as the arrow keys do.
    function nudge(index, by) {
        split.cockpit_.resized(split, shares_(moved_(sizes_(), index, by)))
    }

    Repeater {
        model: handles.split && handles.split.cockpit_ && !handles.split.cockpit_.maximized ? Math.max(0, handles.split.elements_.length - 1) : 0
        MouseArea {
            id: handle
            objectName: "handle" + index
            readonly property Item before_: handles.split.elements_[index] || null
            property real start_: 0
            property var sizes_: []
            // A finger needs more than the gap.
            readonly property real more_: Math.round(3 * Theme.size)

            x: !before_ || handles.vertical_ ? 0 : before_.x + before_.width - more_
            y: !before_ || !handles.vertical_ ? 0 : before_.y + before_.height - more_
            width: handles.vertical_ ? handles.width : handles.split.spacing + 2 * more_
            height: handles.vertical_ ? handles.split.spacing + 2 * more_ : handles.height
            cursorShape: handles.vertical_ ? Qt.SplitVCursor : Qt.SplitHCursor
            preventStealing: true
            hoverEnabled: true
            activeFocusOnTab: true
            Accessible.role: Accessible.Separator
            Accessible.name: handles.vertical_ ? qsTr("Edge, moved by the up and down keys") : qsTr("Edge, moved by the left and right keys")
            Accessible.focusable: true

            function along_(mouse) {
                const point = mapToItem(handles.split, mouse.x, mouse.y)
                return handles.vertical_ ? point.y : point.x
            }

            onPressed: function(mouse) {
                start_ = along_(mouse)
                sizes_ = handles.sizes_()
            }
            onPositionChanged: function(mouse) {
                if (!pressed || !sizes_.length)
                    return
                handles.split.preview_ = handles.moved_(sizes_, index, along_(mouse) - start_)
                handles.split.arrange()
            }
            onReleased: {
                const split = handles.split
                if (split.preview_)
                    split.cockpit_.resized(split, handles.shares_(split.preview_))
                split.preview_ = null
            }
            onCanceled: handles.split.preview_ = null
            Keys.onPressed: function(event) {
                const keys = handles.vertical_ ? [Qt.Key_Up, Qt.Key_Down] : [Qt.Key_Left, Qt.Key_Right]
                const step = event.modifiers & Qt.ShiftModifier ? 1 : 20
                if (event.key === keys[0] || event.key === keys[1]) {
                    handles.nudge(index, event.key === keys[0] ? -step : step)
                    event.accepted = true
                } else if (event.key === Qt.Key_Escape && handles.split.preview_) {
                    handles.split.preview_ = null
                    sizes_ = []
                    event.accepted = true
                }
            }

            Rectangle {
                anchors.centerIn: parent
                width: handles.vertical_ ? Math.min(48, parent.width / 3) : 3
                height: handles.vertical_ ? 3 : Math.min(48, parent.height / 3)
                radius: 1.5
                color: handle.containsMouse || handle.pressed || handle.activeFocus ? Theme.accent : Theme.faint
            }
            FocusRing { item: handle; anchors.margins: 0; radius: 2 }
        }
    }
}
