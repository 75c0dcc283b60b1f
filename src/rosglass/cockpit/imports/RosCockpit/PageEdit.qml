// What edit mode adds to the button of a page: rename, remove, and another place on the bar.
import QtQuick 2.15
import RosControls 1.0

MouseArea {
    id: edit

    property Item bar: null
    property Item page: null
    property int index: 0
    property real start_: 0

    preventStealing: true
    onPressed: function(mouse) {
        start_ = mouse.x
        bar.cockpit.showPage(page)
        parent.forceActiveFocus(Qt.TabFocusReason)
    }
    onDoubleClicked: rename()
    onReleased: function(mouse) {
        const at = mapToItem(bar, mouse.x, mouse.y)
        const other = Math.abs(mouse.x - start_) > 8 ? bar.pageAt(at.x, at.y) : null
        if (other && other !== page)
            bar.cockpit.pageMoved(page, bar.cockpit.pages.indexOf(other))
    }

    function rename() {
        field.active = true
    }

    // Returns whether it is a key of this.
    function key(event) {
        const both = Qt.ControlModifier | Qt.ShiftModifier
        const step = event.key === Qt.Key_Left ? -1 : event.key === Qt.Key_Right ? 1 : 0
        if (event.key === Qt.Key_F2) {
            rename()
        } else if (event.key === Qt.Key_Delete && !event.modifiers) {
            bar.cockpit.removed(page)
        } else if (step && (event.modifiers & both) === both) {
            if (index + step >= 0 && index + step < bar.cockpit.pages.length)
                bar.cockpit.pageMoved(page, index + step)
        } else {
            return false
        }
        return true
    }

    Loader {
        id: field
        anchors { left: parent.left; verticalCenter: parent.verticalCenter }
        active: false
        sourceComponent: ThemeField {
            objectName: "pageField"
            text: edit.page.title
            placeholderText: qsTr("Name of the page")
            Component.onCompleted: {
                forceActiveFocus()
                selectAll()
            }
            onEditingFinished: if (field.active) done_(true)
            Keys.onEscapePressed: done_(false)
            function done_(keep) {
                const wanted = text.trim()
                field.active = false
                if (keep && wanted && wanted !== edit.page.title)
                    edit.bar.cockpit.renamed(edit.page, wanted)
            }
        }
    }
}
