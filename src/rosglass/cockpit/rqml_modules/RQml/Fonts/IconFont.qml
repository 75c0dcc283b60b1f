// Icons as letters of a font, or plain letters where the font is not installed.
pragma Singleton
import QtQuick
import RosCockpit 1.0

FontLoader {
    id: icons

    // Code points of Font Awesome's names.
    readonly property string iconAdd: icon_("+", "+")
    readonly property string iconArrowsLeftRight: icon_("\uf07e", "↔")
    readonly property string iconArrowsUpDown: icon_("\uf07d", "↕")
    readonly property string iconChevronDown: icon_("\uf078", "▾")
    readonly property string iconChevronLeft: icon_("\uf053", "◂")
    readonly property string iconChevronRight: icon_("\uf054", "▸")
    readonly property string iconChevronUp: icon_("\uf077", "▴")
    readonly property string iconClose: icon_("\uf00d", "×")
    readonly property string iconCopy: icon_("\uf0c5", "C")
    readonly property string iconCrosshairs: icon_("\uf05b", "⌖")
    readonly property string iconDebug: icon_("\uf188", "D")
    readonly property string iconEdit: icon_("\uf044", "E")
    readonly property string iconError: icon_("\uf057", "!!")
    readonly property string iconExpand: icon_("\uf065", "⤢")
    readonly property string iconFatal: icon_("\uf714", "F")
    readonly property string iconFilter: icon_("\uf0b0", "F")
    readonly property string iconInfo: icon_("\uf05a", "i")
    readonly property string iconLoad: icon_("\uf56f", "L")
    readonly property string iconMagnifyingGlassMinus: icon_("\uf010", "−")
    readonly property string iconMagnifyingGlassPlus: icon_("\uf00e", "+")
    readonly property string iconMessage: icon_("\uf075", "M")
    readonly property string iconPause: icon_("\uf04c", "||")
    readonly property string iconPlay: icon_("\uf04b", "▶")
    readonly property string iconRefresh: icon_("\uf021", "R")
    readonly property string iconRightLeft: icon_("\uf362", "⇄")
    readonly property string iconRotateLeft: icon_("\uf0e2", "↺")
    readonly property string iconRotateRight: icon_("\uf01e", "↻")
    readonly property string iconSave: icon_("\uf0c7", "S")
    readonly property string iconSearch: icon_("\uf002", "?")
    readonly property string iconSettings: icon_("\uf013", "⚙")
    readonly property string iconStar: icon_("\uf005", "★")
    readonly property string iconTrash: icon_("\uf1f8", "X")
    readonly property string iconWarning: icon_("\uf071", "!")
    readonly property IconFontFile file_: IconFontFile {}

    function icon_(letter, plain) { return file_.url ? letter : plain }

    source: file_.url
}
