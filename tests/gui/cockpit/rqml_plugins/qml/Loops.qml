import QtQuick

Item {
    Timer { interval: 20; running: context.loop ?? true; onTriggered: { while (true); } }
}
