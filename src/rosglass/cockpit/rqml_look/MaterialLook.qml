// Around a plugin that imports the Material style: its colours are the theme's.
import QtQuick
import QtQuick.Controls.Material

Item {
    id: look

    property var colors: ({})
    readonly property color window_: colors.window ?? "black"

    Material.theme: window_.hslLightness < 0.5 ? Material.Dark : Material.Light
    Material.accent: colors.accent ?? Material.Cyan
    Material.primary: colors.accent ?? Material.Cyan
    Material.background: colors.base ?? window_
    Material.foreground: colors.text ?? "white"
}
