// The state of a framed control, on the title of its panel or among the tabs.
import QtQuick 2.15
import RosControls 1.0

ThemeReason {
    id: status

    property Item panel: null

    text: panel ? panel.status_ : ""
    color: panel && panel.wrong_ ? Theme.bad : Theme.dim
    font.weight: panel && panel.wrong_ ? Font.Bold : Font.Normal
    Accessible.ignored: true
    Binding {
        target: status.panel
        property: "cut_"
        value: status.truncated
        when: status.panel !== null
    }
}
