// Colours and sizes, in one place.
pragma Singleton
import QtQuick 2.15

QtObject {
    readonly property color background: "#e6070b10"
    readonly property color bar: "#090e14"
    readonly property color panel: "#0e151d"
    readonly property color edge: "#1d2935"
    readonly property color button: "#1a2531"
    readonly property color text: "#e6eef5"
    readonly property color dim: "#7f93a5"
    readonly property color accent: "#3fd2e8"
    readonly property color good: "#41d98a"
    readonly property color warn: "#ffb63d"
    readonly property color bad: "#ff4256"
    readonly property int gap: 8
}
