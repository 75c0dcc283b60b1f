import QtQuick

Item {
    width: : 3
}
