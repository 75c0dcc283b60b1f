import QtQuick 2.2
import QtQuick.Controls 2.5
import QtMultimedia 5.10
import Ros 1.0
Item {
  Component.onCompleted: Ros.init('qml_example_node')
  ImageTransportSubscriber {
    id: imageSubscriber
    topic: "/camera360/pinhole_front/image_rect_color"
  }
  VideoOutput { anchors.fill: parent; source: imageSubscriber }
  Rectangle {
    anchors.horizontalCenter: parent.horizontalCenter
    anchors.bottom: parent.bottom
    width: 120; height: 120
    radius: 60
    color: '#aaaaaa'
    MouseArea {
      anchors.fill: parent
      property var pub: Ros.advertise("geometry_msgs/Twist",
                                      "/cmd_vel", 1)
      onPositionChanged: {
        var x = -mouse.x / (width / 2) + 1
        var y = -mouse.y / (height / 2) + 1
        pub.publish({linear: {x: y}, angular: {z: x}})
      }
    }
  }
  Button {
    anchors.bottom: parent.bottom
    property bool isOn: true
    text: 'Flashlight: ' + (isOn ? 'On' : 'Off')
    onClicked: Service.call('/flashlight', 'std_srvs/SetBool',
                            {data: (isOn = !isOn)})
  }
}
