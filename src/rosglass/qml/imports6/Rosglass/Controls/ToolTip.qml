// Takes the place of Qt's template, from which the tool tips of all styles derive: shows plain text of limited length.
import QtQuick 2.15
// Qt's own type; ours is of all later versions.
import QtQuick.Templates 6.8 as Templates

Templates.ToolTip {
    // Reading it creates the style's text, before that is laid out.
    readonly property Item rosglassContent: contentItem

    onRosglassContentChanged: {
        if (!(contentItem instanceof Text) || contentItem.textFormat !== Text.AutoText)
            return
        contentItem.textFormat = Text.PlainText
        // To wrap a long word, Qt takes time with the square of its length.
        contentItem.maximumLineCount = 40
        contentItem.elide = Text.ElideRight
    }
}
