// A part in a file of its own, which uses the plugin's context.
import QtQuick

Text {
    property string clip_
    text: "count " + (context.count ?? "none") + " of " + uniqueName

    function copy() { RQml.copyTextToClipboard("copied") }
}
