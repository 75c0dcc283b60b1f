// Requests about parameters, the log and the clock.
#include <ros/console.h>
#include <ros/param.h>

#include <stdexcept>

#include "roscpp_peer.hpp"

namespace {

std::string name_of(const Plan &plan) { return plan.get<std::string>("name"); }

/// Returns a parameter as XML-RPC has it.
Request get_param("get_param", [](const Plan &plan) {
  XmlRpc::XmlRpcValue value;
  const bool found = plan.get("cached", false) ? ros::param::getCached(name_of(plan), value)
                                               : ros::param::get(name_of(plan), value);
  if (!found) {
    throw std::runtime_error("it is not set");
  }
  return quoted(value.toXml());
});

/// Sets a parameter to a text, a number or a list of numbers, by what there is in the plan.
Request set_param("set_param", [](const Plan &plan) {
  if (const auto text = plan.get_optional<std::string>("text")) {
    ros::param::set(name_of(plan), *text);
  } else if (const auto number = plan.get_optional<double>("real")) {
    ros::param::set(name_of(plan), *number);
  } else {
    std::vector<int> items;
    for (const auto &item : plan.get_child("items")) {
      items.push_back(item.second.get_value<int>());
    }
    ros::param::set(name_of(plan), items);
  }
  return std::string("null");
});

/// Logs a text.
Request log("log", [](const Plan &plan) {
  const std::string text = plan.get<std::string>("text");
  ROS_INFO("%s", text.c_str());
  return std::string("null");
});

/// Returns the node's time in seconds.
Request now("now", [](const Plan &) { return std::to_string(ros::Time::now().toSec()); });

}  // namespace
