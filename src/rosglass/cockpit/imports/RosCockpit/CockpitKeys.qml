// The keys of a Cockpit, in the window that this is in; each window of a layout has them.
import QtQuick 2.15

Item {
    id: keys

    property Item cockpit: null

    Repeater {
        model: 9
        Item {
            Shortcut {
                sequence: "Ctrl+" + (index + 1)
                enabled: keys.cockpit !== null && keys.cockpit.pages.length > index
                onActivated: keys.cockpit.showPage(index)
            }
        }
    }
    Shortcut {
        sequence: "Ctrl+PgDown"
        onActivated: keys.turn_(1)
    }
    Shortcut {
        sequence: "Ctrl+PgUp"
        onActivated: keys.turn_(-1)
    }
    Shortcut {
        sequence: "Ctrl+Tab"
        onActivated: keys.cockpit.nextTab(1)
    }
    Shortcut {
        sequences: ["Ctrl+Shift+Tab", "Ctrl+Shift+Backtab"]
        onActivated: keys.cockpit.nextTab(-1)
    }
    Shortcut {
        sequence: "F6"
        onActivated: keys.cockpit.nextPanel(1)
    }
    Shortcut {
        sequence: "Shift+F6"
        onActivated: keys.cockpit.nextPanel(-1)
    }
    Shortcut {
        sequence: "F11"
        enabled: keys.cockpit !== null && keys.cockpit.current !== null
        autoRepeat: false
        onActivated: keys.cockpit.current.toggleMaximized()
    }
    Shortcut {
        sequence: "F1"
        enabled: keys.cockpit !== null && keys.cockpit.current !== null
        autoRepeat: false
        onActivated: keys.cockpit.helpRequested(keys.cockpit.current)
    }
    Shortcut {
        sequences: ["Shift+F10", "Menu"]
        enabled: keys.cockpit !== null && keys.cockpit.current !== null
        autoRepeat: false
        onActivated: keys.cockpit.current.openMenu()
    }

    function turn_(step) {
        const count = cockpit.pages.length
        if (count > 1)
            cockpit.showPage((cockpit.pages.indexOf(cockpit.page) + step + count) % count)
    }
}
