// Colours and sizes of the cockpit, in one place.
pragma Singleton
import QtQuick

QtObject {
    readonly property color background: "#070b10"
    readonly property color panel: "#0e151d"
    readonly property color panelEdge: "#1d2935"
    readonly property color text: "#e6eef5"
    readonly property color dim: "#7f93a5"
    readonly property color faint: "#3a4a59"
    readonly property color accent: "#3fd2e8"
    readonly property color good: "#41d98a"
    readonly property color warn: "#ffb63d"
    readonly property color bad: "#ff4256"
    readonly property color shade: "#c0070b10"

    readonly property int small: 11
    readonly property int normal: 13
    readonly property int large: 20
    readonly property int gap: 10
    readonly property int radius: 10
}
