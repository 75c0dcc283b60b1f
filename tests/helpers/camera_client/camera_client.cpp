// Moves RViz's camera by all services below a namespace, and tells what it hears.
#include <hector_rviz_plugins/MoveEye.h>
#include <hector_rviz_plugins/MoveEyeAndFocus.h>
#include <hector_rviz_plugins/SetViewMode.h>
#include <hector_rviz_plugins/TrackFrame.h>
#include <hector_rviz_plugins/ViewMode.h>
#include <ros/ros.h>
#include <std_msgs/String.h>

#include <iostream>

namespace hrp = hector_rviz_plugins;

int main(int argc, char** argv)
{
  ros::init(argc, argv, "camera_client");
  ros::NodeHandle node(argv[1]);
  int mode = -1;
  std::string frame = "nothing yet";
  auto on_mode = [&](const hrp::ViewMode::ConstPtr& heard) { mode = heard->mode; };
  auto on_frame = [&](const std_msgs::String::ConstPtr& heard) { frame = heard->data; };
  auto modes = node.subscribe<hrp::ViewMode>("view_mode", 5, on_mode);
  auto frames = node.subscribe<std_msgs::String>("tracked_frame", 5, on_frame);
  auto hear = [&](int wanted_mode, const std::string& wanted_frame) {
    for (int n = 0; n < 600 && !(mode == wanted_mode && frame == wanted_frame); ++n)
    {
      ros::spinOnce();
      ros::WallDuration(0.05).sleep();
    }
    std::cout << "heard " << mode << " '" << frame << "'" << std::endl;
  };
  auto call = [&](const std::string& name, auto& service) {
    ros::service::waitForService(node.resolveName(name), 20000);
    const bool done = ros::service::call(node.resolveName(name), service);
    std::cout << name << (done ? " done" : " refused") << std::endl;
  };

  hrp::MoveEye eye;
  eye.request.header.frame_id = "nowhere";
  call("move_eye", eye);
  hrp::SetViewMode set;
  set.request.mode.mode = hrp::ViewMode::MODE_2D;
  call("set_view_mode", set);
  hrp::TrackFrame track;
  track.request.frame = "map";
  call("set_tracked_frame", track);
  hear(hrp::ViewMode::MODE_2D, "map");
  hrp::MoveEyeAndFocus both;
  both.request.eye.x = 1;
  both.request.eye.y = 2;
  both.request.eye.z = 3;
  both.request.stop_tracking = true;
  call("move_eye_and_focus", both);
  hear(hrp::ViewMode::MODE_3D, "");
  eye.request.header.frame_id = "";
  eye.request.eye.x = 5;
  eye.request.eye.y = 6;
  eye.request.eye.z = 7;
  eye.request.disable_animation = true;
  call("move_eye", eye);
}
