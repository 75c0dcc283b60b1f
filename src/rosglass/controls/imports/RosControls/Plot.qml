// Numbers of any topics over time, or one against another, with every sample kept.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: plot

    // Declared series; more can be given as paths.
    default property list<PlotSeries> series
    // Topics and fields that are plotted, such as "/odom:twist.twist.linear.x".
    property var paths: []
    property string ns
    // Seconds that are visible.
    property alias window: plotted.window
    // Seconds for which samples are kept; 0 for no limit.
    property alias history: plotted.history
    // Whether it stands still; samples are kept all the same.
    property alias paused: plotted.paused
    // Whether times are those of the headers; otherwise, of reception.
    property alias stamps: plotted.stamps
    // Whether a recording is plotted as a whole at once, not only what was played.
    property alias whole: plotted.whole
    // Seconds without samples that are a gap in a line; 0 for 5 times its usual pause, at least 1 s.
    property alias gap: plotted.gap
    // Milliseconds without any sample after which the plot is stale.
    property alias timeout: plotted.timeout
    // The ends of the axes; NaN where the data decides.
    property alias leftMin: plotted.leftMin
    property alias leftMax: plotted.leftMax
    property alias rightMin: plotted.rightMin
    property alias rightMax: plotted.rightMax
    // Whether the axis is logarithmic.
    property alias leftLog: plotted.leftLog
    property alias rightLog: plotted.rightLog
    // Where the buttons CSV and PNG write; without a folder, there are none.
    property string folder
    // Whether it has buttons.
    property bool tools: true
    // Place of the cursor from 0 to 1; negative for none.
    property real cursor: -1
    // Messages received; lost on their way or unreadable; samples removed as older than the history.
    readonly property real received: plotted.received
    readonly property real lost: plotted.lost
    readonly property real removed: plotted.removed

    // A file was written; why it was not.
    signal saved(string file)
    signal saveFailed(string reason)

    // Plot a path as well; stop plotting it.
    function add(path) {
        if (path && paths.indexOf(path) < 0)
            paths = paths.concat([path])
    }
    function remove(path) { paths = paths.filter(function(one) { return one !== path }) }
    function mark(text) { plotted.mark(text) }
    function zoomBy(factor, at) { plotted.zoomBy(factor, at === undefined ? 1 : at) }
    function scroll(seconds) { plotted.scroll(seconds) }
    function fit() { plotted.fit() }
    function saveCsv(file) { plotted.saveCsv(file) }
    function savePng(file) {
        const local = String(file).replace(/^file:\/\//, "")
        const begun = plot.grabToImage(function(result) {
            if (result.saveToFile(local))
                plot.saved(local)
            else
                plot.saveFailed(qsTr("%1 could not be written").arg(local))
        })
        if (!begun)
            plot.saveFailed(qsTr("%1: the plot is not on the screen").arg(local))
    }

    function save_(ending) {
        const file = folder.replace(/^file:\/\//, "") + "/plot-" + Qt.formatDateTime(new Date(), "yyyyMMdd-HHmmss") + ending
        ending === ".csv" ? saveCsv(file) : savePng(file)
    }
    function isOwn_(path) { return paths.indexOf(path) >= 0 }
    function key_(event) {
        const shift = event.modifiers & Qt.ShiftModifier, control = event.modifiers & Qt.ControlModifier
        if (shift && (event.key === Qt.Key_Left || event.key === Qt.Key_Right)) {
            const step = event.key === Qt.Key_Left ? -0.01 : 0.01
            cursor = Math.max(0, Math.min(1, (cursor < 0 ? 1 : cursor) + step))
        } else if (event.key === Qt.Key_Left || event.key === Qt.Key_Right) {
            plotted.scroll((event.key === Qt.Key_Left ? -0.1 : 0.1) * plotted.window)
        } else if (event.key === Qt.Key_Plus || event.key === Qt.Key_Minus || event.key === Qt.Key_Equal) {
            const factor = event.key === Qt.Key_Minus ? 0.8 : 1.25
            control ? plotted.zoomValuesBy(factor, 0.5) : plotted.zoomBy(factor, cursor < 0 ? 1 : cursor)
        } else if (event.key === Qt.Key_Space) {
            paused = !paused
        } else if (event.key === Qt.Key_Home) {
            plotted.toOldest()
        } else if (event.key === Qt.Key_End) {
            paused = false
        } else if (event.key === Qt.Key_0) {
            fit()
        } else if (event.key === Qt.Key_Escape && cursor >= 0) {
            cursor = -1
        } else {
            return false
        }
        return true
    }

    title: qsTr("Plot")
    source: plotted
    contentWidth: 480 * Theme.size
    contentHeight: 260 * Theme.size
    note: paused ? (plotted.behind > 0.5 ? qsTr("PAUSED, %1 s ago").arg(plotted.behind.toFixed(0)) : qsTr("PAUSED"))
        : plotted.reading < 1 ? qsTr("reading, %1 %").arg((100 * plotted.reading).toFixed(0))
        : plotted.merged > 0 ? qsTr("extremes of %1 samples").arg((plotted.received).toFixed(0))
        : lost > 0 ? qsTr("%1 lost").arg(lost.toFixed(0)) : ""

    PlotData {
        id: plotted
        objectName: "plotData"
        ns: plot.ns
        paths: plot.paths
        series: {
            const found = []
            for (let at = 0; at < plot.series.length; ++at)
                found.push(plot.series[at])
            return found
        }
        colors: Theme.series
        onSaved: function(file) { plot.saved(file) }
        onSaveFailed: function(reason) { plot.saveFailed(reason) }
    }

    Flow {
        id: legend
        objectName: "legend"
        readonly property int most: 12
        anchors { left: parent.left; right: toolbar.left; top: parent.top; rightMargin: Theme.gap }
        spacing: Theme.gap
        Repeater {
            model: Math.min(plotted.legend.length, legend.most)
            Row {
                id: entry
                readonly property var line: plotted.legend[index] || ({ name: "", color: Theme.dim, unit: "", axis: "", path: "", problem: "" })
                spacing: Theme.gap / 2
                Accessible.role: Accessible.StaticText
                Accessible.name: name.text + ": " + reading.text
                Rectangle {
                    width: Theme.gap; height: 3
                    anchors.verticalCenter: parent.verticalCenter
                    color: entry.line.color
                }
                ThemeText {
                    id: name
                    width: Math.min(implicitWidth, 260 * Theme.size, Math.max(0, legend.width - reading.width - 5 * Theme.gap))
                    text: entry.line.name + (entry.line.axis === "right" ? " ⟶" : "")
                    elide: Text.ElideLeft
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
                ThemeText {
                    id: reading
                    text: (plotted.readings[index] || "–") + (entry.line.unit ? " " + entry.line.unit : "")
                    font.pixelSize: Theme.small
                }
                ThemeText {
                    visible: text !== ""
                    width: Math.min(implicitWidth, Math.max(0, legend.width - x - 3 * Theme.gap))
                    text: entry.line.problem
                    color: Theme.bad
                    font.pixelSize: Theme.small
                }
                ThemeText {
                    visible: plot.isOwn_(entry.line.path)
                    text: "×"
                    color: remover.activeFocus ? Theme.accent : Theme.dim
                    font.pixelSize: Theme.small
                    Accessible.role: Accessible.Button
                    Accessible.name: qsTr("Remove %1").arg(entry.line.path)
                    Accessible.onPressAction: plot.remove(entry.line.path)
                    MouseArea {
                        id: remover
                        anchors { fill: parent; margins: -Theme.gap / 2 }
                        activeFocusOnTab: true
                        onClicked: plot.remove(entry.line.path)
                        Keys.onReturnPressed: plot.remove(entry.line.path)
                        Keys.onSpacePressed: plot.remove(entry.line.path)
                        FocusRing {}
                    }
                }
            }
        }
        ThemeText {
            visible: plotted.legend.length > legend.most
            text: qsTr("and %1 more").arg(plotted.legend.length - legend.most)
            color: Theme.dim
            font.pixelSize: Theme.small
        }
        ThemeText {
            visible: plotted.legend.length === 0
            text: qsTr("Set paths, e.g. \"/odom:twist.twist.linear.x\", or drop a field here")
            width: Math.min(implicitWidth, legend.width)
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
    Row {
        id: toolbar
        anchors { right: parent.right; top: parent.top }
        spacing: Theme.gap / 2
        visible: plot.tools
        width: visible ? implicitWidth : 0
        PlotButton_ { objectName: "pause"; text: plot.paused ? qsTr("Live") : qsTr("Pause"); onClicked: plot.paused = !plot.paused }
        PlotButton_ { objectName: "zoomIn"; text: "+"; Accessible.name: qsTr("Show less time"); onClicked: plotted.zoomBy(2, 1) }
        PlotButton_ { objectName: "zoomOut"; text: "−"; Accessible.name: qsTr("Show more time"); onClicked: plotted.zoomBy(0.5, 1) }
        PlotButton_ { objectName: "fit"; text: qsTr("Fit"); Accessible.name: qsTr("Fit the axes to the data"); onClicked: plot.fit() }
        PlotButton_ { visible: plot.folder !== ""; text: qsTr("CSV"); Accessible.name: qsTr("Save as CSV"); onClicked: plot.save_(".csv") }
        PlotButton_ { visible: plot.folder !== ""; text: qsTr("PNG"); Accessible.name: qsTr("Save as PNG"); onClicked: plot.save_(".png") }
    }

    Item {
        id: area
        objectName: "area"
        readonly property real textHeight: Theme.small * 1.5
        anchors {
            fill: parent
            topMargin: Math.max(legend.height, toolbar.visible ? toolbar.height : 0) + Theme.gap / 2
            leftMargin: Theme.small * 4.5
            rightMargin: plotted.rightTicks.length ? Theme.small * 4.5 : Theme.gap
            bottomMargin: textHeight
        }
        activeFocusOnTab: true
        Accessible.role: Accessible.Chart
        Accessible.name: plot.title
        Accessible.description: plot.status || qsTr("%1 s are shown").arg(plotted.window.toPrecision(3))
        Accessible.focusable: true
        Keys.onPressed: function(event) { event.accepted = plot.key_(event) }

        Repeater {
            model: plotted.leftTicks
            Item {
                y: Math.round((1 - modelData.at) * (area.height - 1))
                width: area.width
                Rectangle { width: parent.width; height: 1; color: Theme.edge }
                ThemeText {
                    anchors { right: parent.left; rightMargin: Theme.gap / 2; verticalCenter: parent.top }
                    text: modelData.text
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
            }
        }
        PlotLines {
            objectName: "lines"
            anchors.fill: parent
            clip: true
            source: plotted
            background: Theme.panel
            grid: Theme.edge
        }
        Repeater {
            model: plotted.rightTicks
            ThemeText {
                x: area.width + Theme.gap / 2
                y: Math.round((1 - modelData.at) * (area.height - 1) - height / 2)
                text: modelData.text
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
        Repeater {
            model: plotted.bottomTicks
            Item {
                x: Math.round(modelData.at * (area.width - 1))
                height: area.height
                Rectangle { width: 1; height: parent.height; color: Theme.edge; opacity: 0.5 }
                ThemeText {
                    anchors { top: parent.bottom; topMargin: 2 }
                    x: Math.max(-parent.x - Theme.small, Math.min(area.width - parent.x - width + Theme.small, -width / 2))
                    text: modelData.text
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
            }
        }
        Repeater {
            model: plotted.markCount
            Item {
                id: flag
                readonly property var made: plotted.markAt(index)
                x: Math.round(area.width * (1 - (plotted.end - made.time) / plotted.window))
                visible: !plotted.isXY && x >= 0 && x <= area.width
                height: area.height
                Rectangle { width: 1; height: parent.height; color: Theme.warn }
                ThemeText {
                    x: flag.x + width + 4 > area.width ? -width - 4 : 4
                    width: Math.min(implicitWidth, area.width / 3)
                    text: flag.made.text
                    color: Theme.warn
                    font.pixelSize: Theme.small
                }
            }
        }
        Rectangle {
            objectName: "moment"
            // NaN of a robot would be the left edge.
            x: isFinite(plotted.moment) ? Math.round(area.width * (1 - (plotted.end - plotted.moment) / plotted.window)) : -1
            visible: !plotted.isXY && x >= 0 && x <= area.width
            width: 1
            height: area.height
            color: Theme.accent
        }
        PinchHandler {
            property real before_: 1
            target: null
            onActiveChanged: before_ = 1
            onActiveScaleChanged: {
                if (active && activeScale > 0)
                    plotted.zoomBy(activeScale / before_, centroid.position.x / area.width)
                before_ = activeScale
            }
        }
        MouseArea {
            property real from_: 0
            anchors.fill: parent
            hoverEnabled: true
            onPressed: function(mouse) { area.forceActiveFocus(); from_ = mouse.x }
            onPositionChanged: function(mouse) {
                plot.cursor = mouse.x / width
                if (pressed && Math.abs(mouse.x - from_) >= 1) {
                    plotted.scroll((from_ - mouse.x) / width * plotted.window)
                    from_ = mouse.x
                }
            }
            onExited: plot.cursor = -1
            onDoubleClicked: { plot.fit(); plot.paused = false }
            onWheel: function(wheel) {
                const turn = wheel.angleDelta.y || wheel.angleDelta.x
                if (!turn)
                    return
                if (wheel.modifiers & Qt.ControlModifier)
                    plotted.zoomValuesBy(turn > 0 ? 1.25 : 0.8, 1 - wheel.y / height)
                else if ((wheel.modifiers & Qt.ShiftModifier) || !wheel.angleDelta.y)
                    plotted.scroll((turn > 0 ? -0.1 : 0.1) * plotted.window)
                else
                    plotted.zoomBy(turn > 0 ? 1.25 : 0.8, plot.paused ? wheel.x / width : 1)
            }
        }
        Rectangle {
            visible: plot.cursor >= 0 && !plotted.isXY
            x: Math.round(plot.cursor * (area.width - 1))
            width: 1
            height: area.height
            color: Theme.text
            opacity: 0.6
        }
        Rectangle {
            id: bubble
            objectName: "cursorValues"
            readonly property int most: 12
            // Asked for again while the plot scrolls.
            readonly property var found: visible && plotted.end ? plotted.valuesAt(plot.cursor) : ({ time: "", values: [] })
            visible: plot.cursor >= 0 && !plotted.isXY && plotted.legend.length > 0
            x: plot.cursor > 0.5 ? plot.cursor * area.width - width - Theme.gap : plot.cursor * area.width + Theme.gap
            y: Theme.gap / 2
            width: list.width + Theme.gap
            height: list.height + Theme.gap
            radius: Theme.radius / 2
            color: Theme.panel
            border { color: Theme.edge; width: 1 }
            opacity: 0.9
            Column {
                id: list
                x: Theme.gap / 2
                y: Theme.gap / 2
                ThemeText {
                    text: bubble.found.time
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
                Repeater {
                    model: Math.min(plotted.legend.length, bubble.most)
                    ThemeText {
                        readonly property var line: plotted.legend[index] || ({ name: "", color: Theme.dim, unit: "" })
                        width: Math.min(implicitWidth, 200 * Theme.size)
                        text: (bubble.found.values[index] || "–") + " " + line.unit
                        color: line.color
                        font.pixelSize: Theme.small
                    }
                }
            }
        }
        PathDrop {
            anchors.fill: parent
            arrays: true
            onTaken: function(path) { plot.add(path) }
        }
        FocusRing {}
    }

    component PlotButton_: ThemeButton {
        implicitHeight: Theme.touch * 0.7
        implicitWidth: Math.max(Theme.touch * 0.8, contentItem.implicitWidth + Theme.gap)
    }
}
