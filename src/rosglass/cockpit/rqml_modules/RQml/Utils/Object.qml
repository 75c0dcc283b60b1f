// An object that is not shown, and may have any objects in it.
import QtQuick

QtObject {
    id: object

    default property alias children: object.inside_
    property list<QtObject> inside_
}
