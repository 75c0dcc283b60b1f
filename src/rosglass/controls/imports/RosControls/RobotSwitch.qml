// The robots of a graph, one of which is shown and steered: its namespace is `current`.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: robots

    // The namespace of the robot that is shown; bind the `ns` of other controls to it.
    property string current
    // Namespaces to choose from; empty for those in which the graph has `topic`.
    property var namespaces: []
    // What every robot has, relative to its namespace.
    property string topic: "cmd_vel"
    // The TwistCommand, which is halted before another robot is selected.
    property var command: null
    // Whether the first robot is selected while none is.
    property bool automatic: true

    // The robots: {ns, name, present, problem}.
    property var found: []

    // Another robot was selected, by hand.
    signal selected(string ns)

    property string problem_
    property bool complete_: false

    title: qsTr("Robot")
    source: null
    stale: false
    needsRobot: true
    age: 0
    problem: problem_
    contentWidth: 200 * Theme.size
    contentHeight: flow.height
    note: found.length > 1 ? qsTr("%1 robots").arg(found.length) : ""

    function select(ns) {
        if (ns === current)
            return
        // First: nothing that was meant for one robot reaches another.
        if (command)
            command.halt()
        current = ns
        refresh_()
        selected(ns)
    }

    // Select the next robot (1), or the one before (-1), which is present.
    function next(step) {
        const there = found.filter(function(one) { return one.present || one.ns === current })
        if (there.length === 0)
            return
        const at = there.findIndex(function(one) { return one.ns === current })
        select(there[at < 0 ? 0 : (at + step + there.length) % there.length].ns)
    }

    function name_(ns) {
        return ns === "/" ? qsTr("(no namespace)") : ns.replace(/^\//, "")
    }

    function refresh_() {
        if (!complete_)
            return
        const present = graph.namespaces(topic)
        const given = namespaces.map(function(ns) { return "/" + String(ns).replace(/^\/+|\/+$/g, "") })
        const listed = (given.length ? given : present).concat(current && complete_ ? [current] : [])
            .filter(function(ns, at, all) { return all.indexOf(ns) === at }).sort()
        const twins = graph.duplicateNodes
        found = listed.map(function(ns) {
            const inside = ns === "/" ? "/" : ns + "/"
            const twin = Object.keys(twins).find(function(node) { return node.startsWith(inside) && node !== graph.nodeName })
            return { ns: ns, name: name_(ns), present: present.indexOf(ns) >= 0,
                     problem: twin ? Fields.fill(qsTr("%1 robots of this name: that many nodes are called %2"), [twins[twin], twin]) : "" }
        })
        if (!current && automatic && found.length > 0 && found[0].present)
            select(found[0].ns)
        const shown = found.find(function(one) { return one.ns === robots.current })
        problem_ = !shown ? (current ? "" : qsTr("no robot")) : shown.problem ? shown.problem
            : shown.present ? "" : qsTr("%1 is not there").arg(shown.name)
    }

    Component.onCompleted: {
        complete_ = true
        refresh_()
    }
    onNamespacesChanged: refresh_()
    onTopicChanged: refresh_()
    onCurrentChanged: refresh_()

    GraphWatch {
        id: graph
        onChanged: robots.refresh_()
    }

    Flow {
        id: flow
        width: parent.width
        spacing: Theme.gap / 2
        Repeater {
            id: buttons
            model: robots.found
            ThemeButton {
                id: button
                objectName: "robot" + index
                readonly property bool current: modelData.ns === robots.current
                text: modelData.name + (modelData.problem ? " ⚠" : modelData.present ? "" : " " + qsTr("(gone)"))
                width: Math.min(implicitWidth, flow.width)
                tint: modelData.problem ? Theme.warn : !modelData.present ? Theme.dim : Theme.accent
                checkable: false
                down: pressed || current
                Accessible.role: Accessible.RadioButton
                Accessible.name: modelData.name
                Accessible.description: modelData.problem || (modelData.present ? "" : qsTr("gone"))
                Accessible.checked: current
                onClicked: robots.select(modelData.ns)
                Keys.onRightPressed: robots.focus_(index + 1)
                Keys.onDownPressed: robots.focus_(index + 1)
                Keys.onLeftPressed: robots.focus_(index - 1)
                Keys.onUpPressed: robots.focus_(index - 1)
            }
        }
    }

    function focus_(index) {
        const item = buttons.itemAt((index + buttons.count) % buttons.count)
        if (item)
            item.forceActiveFocus(Qt.TabFocusReason)
    }
}
