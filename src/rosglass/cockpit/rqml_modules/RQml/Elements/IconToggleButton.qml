// An IconButton that stays pressed, with an icon and a hint for either state.
IconButton {
    property string iconOn
    property string iconOff
    property string tooltipTextOn
    property string tooltipTextOff

    checkable: true
    text: checked ? iconOn : iconOff
    tooltipText: checked ? tooltipTextOn : tooltipTextOff
}
