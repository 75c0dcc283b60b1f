// Requests that are about who talks to whom, and how.
#include "roscpp_peer.hpp"

#include <std_msgs/String.h>

namespace {

std::map<std::string, ros::Subscriber> subscribers;

/// topic, fallback: subscribe by UDP, or by TCP where that is refused; reports "udp": text.
Request subscribe_udp("subscribe_udp", [](const Plan &plan) -> std::string {
  const auto topic = plan.get<std::string>("topic");
  auto hints = ros::TransportHints().unreliable();
  if (plan.get<bool>("fallback")) {
    hints = hints.reliable();
  }
  const boost::function<void(const std_msgs::String::ConstPtr &)> callback =
      [](const std_msgs::String::ConstPtr &message) { report("udp", quoted(message->data)); };
  subscribers[topic] =
      node().subscribe<std_msgs::String>(topic, 10, callback, ros::VoidConstPtr(), hints);
  return "null";
});

/// topic: how many publishers a subscription of subscribe_udp is connected with.
Request udp_sources("udp_sources", [](const Plan &plan) {
  return std::to_string(subscribers.at(plan.get<std::string>("topic")).getNumPublishers());
});

}  // namespace
