// The paper's dashboard, which logs what each of its panels shows; for test_view_demo.py.
import QtQuick 2.15
import "../../examples/rviz"

Item {
    id: top
    property Item tabs
    property int at: 0

    Dashboard { id: dashboard; anchors.fill: parent }

    function texts(item, found) {
        // ROS 1 has no descriptions of parameters.
        if (item.visible && item.textFormat !== undefined && item.text && item.objectName !== "detail")
            found.push(item.text)
        for (let i = 0; item.visible && i < item.children.length; ++i)
            texts(item.children[i], found)
        return found
    }
    function panels(item, found) {
        if (item.names !== undefined && item.current !== undefined)
            tabs = item
        if ((item.stale !== undefined || item.live !== undefined) && item.title && item.framed !== false && item.visible)
            found[item.title] = texts(item, [])
        for (let i = 0; i < item.children.length; ++i)
            panels(item.children[i], found)
        return found
    }

    Timer {
        interval: 500; running: true; repeat: true
        onTriggered: {
            console.log("PANELS " + JSON.stringify(panels(dashboard, {})))
            if (tabs && ++at % 4 === 0)
                tabs.current = (tabs.current + 1) % tabs.names.length
        }
    }
}
