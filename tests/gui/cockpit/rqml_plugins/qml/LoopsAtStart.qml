import QtQuick

Item {
    Component.onCompleted: { while (true); }
}
