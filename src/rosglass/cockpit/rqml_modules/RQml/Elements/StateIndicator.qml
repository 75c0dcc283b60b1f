// A lamp for the state of a controller or a hardware component; other states than these are red.
import QtQuick

Rectangle {
    // "active", "inactive", "unconfigured", "unloaded" or "unknown".
    property string state: "unknown"

    height: Math.max(8, Math.min(16, (parent ? parent.height : 24) - 8))
    width: height
    radius: height / 2
    color: ({ active: "#3fae5a", inactive: "#3b82d0", unconfigured: "#e08a1e", unloaded: "#8b949c", unknown: "#8e5bb5" })[state] || "#d0404e"
    Accessible.role: Accessible.Indicator
    Accessible.name: state
}
