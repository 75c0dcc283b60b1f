// The colours and sizes of all controls. `mode` selects the colours; `scale` enlarges everything.
pragma Singleton
import QtQuick 2.15

QtObject {
    id: theme

    // "dark" for rooms, "bright" for sunlight, "contrast" for eyes that need more.
    property string mode: "dark"
    // 1 for a desktop; larger for touch with gloves. Without a value of one's own, that of the screen.
    property real scale: automaticScale
    // What suits the first screen, by its size and its pixels per millimetre: from 1 to 4.
    readonly property real automaticScale: {
        const screens = Qt.application.screens
        return screens && screens.length ? scaleFor_(screens[0].width, screens[0].height, screens[0].pixelDensity) : 1
    }

    // For a screen in (device-independent) pixels, and pixels per millimetre, which not all screens know.
    function scaleFor_(width, height, density) {
        const dpi = 25.4 * density
        const fine = dpi >= 120 && dpi <= 600 ? dpi / 110 : 1
        // A 4K screen shows what a full HD one does; on none there are less than 800x480 such pixels.
        const wanted = Math.max(fine, Math.min(width / 1920, height / 1080))
        return Math.max(1, Math.min(4, Math.round(4 * Math.min(wanted, width / 800, height / 480)) / 4)) || 1
    }

    readonly property var modes: ["dark", "bright", "contrast"]
    readonly property var palette_: ({
        dark: {
            background: "#070b10", panel: "#0e151d", edge: "#1d2935", text: "#e6eef5", dim: "#8fa3b5",
            faint: "#3a4a59", track: "#16202a", accent: "#3fd2e8", good: "#41d98a", warn: "#ffb63d",
            bad: "#ff5566", onAccent: "#04141a", shade: "#c0070b10",
            sky: "#1f5583", ground: "#5a4026",
            mapUnknown: "#0a1016", mapFree: "#1b2631", mapOccupied: "#7e97ad",
            series: ["#3fd2e8", "#ffb63d", "#9d8cff", "#41d98a", "#ff7ab8", "#d6e04a", "#6ea8ff", "#ff8a5c", "#b8c4cf", "#38c7a5"]
        },
        bright: {
            background: "#eef1f4", panel: "#ffffff", edge: "#b7c0c9", text: "#0b1117", dim: "#4a5763",
            faint: "#9aa6b1", track: "#dde3e9", accent: "#00647a", good: "#0a6b38", warn: "#8a5200",
            bad: "#b3001b", onAccent: "#ffffff", shade: "#c0ffffff",
            sky: "#8fc4ea", ground: "#d0ab7c",
            mapUnknown: "#ccd3da", mapFree: "#ffffff", mapOccupied: "#10161c",
            series: ["#00647a", "#b35900", "#5b3fc4", "#0a6b38", "#b0186a", "#6b6b00", "#0b4fc2", "#a1320a", "#4a5763", "#00695c"]
        },
        contrast: {
            background: "#000000", panel: "#000000", edge: "#ffffff", text: "#ffffff", dim: "#ffffff",
            faint: "#a0a0a0", track: "#303030", accent: "#00ffff", good: "#00ff66", warn: "#ffd400",
            bad: "#ff8080", onAccent: "#000000", shade: "#e0000000",
            sky: "#003c78", ground: "#5a3200",
            mapUnknown: "#000000", mapFree: "#303030", mapOccupied: "#ffffff",
            series: ["#00ffff", "#ffd400", "#ff66ff", "#00ff66", "#ff9933", "#ffffff", "#66b3ff", "#ff8080", "#ccff33", "#c0a0ff"]
        }
    })
    readonly property var colors: palette_[mode] || palette_.dark

    readonly property color background: colors.background
    readonly property color panel: colors.panel
    readonly property color edge: colors.edge
    readonly property color text: colors.text
    readonly property color dim: colors.dim
    readonly property color faint: colors.faint
    readonly property color track: colors.track
    readonly property color accent: colors.accent
    // QML takes a binding here for a handler of a signal "accent".
    property color onAccent
    readonly property QtObject onAccent_: Binding { target: theme; property: "onAccent"; value: theme.colors.onAccent }
    readonly property color good: colors.good
    readonly property color warn: colors.warn
    readonly property color bad: colors.bad
    readonly property color shade: colors.shade
    readonly property color sky: colors.sky
    readonly property color ground: colors.ground
    // Unknown, free and occupied cells of a map.
    readonly property color mapUnknown: colors.mapUnknown
    readonly property color mapFree: colors.mapFree
    readonly property color mapOccupied: colors.mapOccupied
    // Of the series of a plot, one after another.
    readonly property var series: colors.series

    // The same in all modes: an emergency stop is red on yellow.
    readonly property color emergency: "#e0001b"
    readonly property color emergencyText: "#ffffff"
    readonly property color emergencyCollar: "#e8c21c"

    // Pixels.
    readonly property real size: scale >= 0.5 && scale <= 8 ? scale : 1
    readonly property int small: Math.round(11 * size)
    readonly property int normal: Math.round(13 * size)
    readonly property int large: Math.round(20 * size)
    readonly property int gap: Math.round(10 * size)
    readonly property int radius: Math.round(8 * size)
    // The least height of what a finger presses.
    readonly property int touch: Math.round(36 * size)

    onModeChanged: {
        if (!palette_[mode])
            console.error("Theme.mode is one of " + modes.join(", ") + "; got \"" + mode + "\"")
    }
    onScaleChanged: {
        // Not by `size`, which may not have changed yet.
        if (!(scale >= 0.5 && scale <= 8))
            console.error("Theme.scale is from 0.5 to 8; got " + scale)
    }
}
