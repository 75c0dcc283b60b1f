// Requests about topics. Any type is published and received as it is on the wire, and three types
// as compiled C++ classes, whose md5 sums roscpp checks.
#include <geometry_msgs/PoseStamped.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>

#include <atomic>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <vector>

#include "roscpp_peer.hpp"

/// A message as it is on the wire.
struct Raw {
  std::vector<uint8_t> data;
};

namespace ros {
namespace message_traits {
template <>
struct MD5Sum<Raw> {
  static const char *value() { return "*"; }
  static const char *value(const Raw &) { return value(); }
};
template <>
struct DataType<Raw> {
  static const char *value() { return "*"; }
  static const char *value(const Raw &) { return value(); }
};
template <>
struct Definition<Raw> {
  static const char *value() { return "*"; }
  static const char *value(const Raw &) { return value(); }
};
template <>
struct IsMessage<Raw> : TrueType {};
template <>
struct IsMessage<const Raw> : TrueType {};
}  // namespace message_traits
namespace serialization {
template <>
struct Serializer<Raw> {
  template <typename Stream>
  static void write(Stream &stream, const Raw &raw) {
    std::copy(raw.data.begin(), raw.data.end(), stream.advance(raw.data.size()));
  }
  template <typename Stream>
  static void read(Stream &stream, Raw &raw) {
    const uint32_t size = stream.getLength();
    const uint8_t *from = stream.advance(size);
    raw.data.assign(from, from + size);
  }
  static uint32_t serializedLength(const Raw &raw) {
    return static_cast<uint32_t>(raw.data.size());
  }
};
}  // namespace serialization
}  // namespace ros

namespace {
std::map<std::string, ros::Publisher> publishers;
std::map<std::string, ros::Subscriber> subscribers;
std::map<std::string, std::atomic<long>> counts;

std::vector<uint8_t> from_hex(const std::string &text) {
  std::vector<uint8_t> made;
  for (size_t i = 0; i + 1 < text.size(); i += 2) {
    made.push_back(static_cast<uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return made;
}

std::string to_hex(const std::vector<uint8_t> &data) {
  static const char digits[] = "0123456789abcdef";
  std::string made;
  for (const uint8_t byte : data) {
    made += digits[byte >> 4];
    made += digits[byte & 15];
  }
  return made;
}

std::string header_of(const ros::M_string &header) {
  std::map<std::string, std::string> members;
  for (const auto &entry : header) {
    members[entry.first] = quoted(entry.second);
  }
  return object(members);
}

void received(const std::string &topic, const ros::M_string &header, const std::string &value) {
  ++counts[topic];
  report("received", object({{"topic", quoted(topic)},
                             {"value", value},
                             {"header", header_of(header)}}));
}

template <typename T, typename Show>
ros::Subscriber subscribe_as(const std::string &topic, uint32_t queue, Show show) {
  const boost::function<void(const ros::MessageEvent<T const> &)> callback =
      [topic, show](const ros::MessageEvent<T const> &event) {
        received(topic, event.getConnectionHeader(), show(*event.getMessage()));
      };
  return node().subscribe<T>(topic, queue, callback, ros::VoidConstPtr(),
                             ros::TransportHints().tcpNoDelay());
}

/// type, md5, definition, data (hexadecimal), latch, queue, rate (1/s) and count of messages.
Request publish("publish", [](const Plan &plan) -> std::string {
  const auto topic = plan.get<std::string>("topic");
  if (!publishers.count(topic)) {
    ros::AdvertiseOptions options(topic, plan.get<uint32_t>("queue", 100),
                                  plan.get<std::string>("md5"), plan.get<std::string>("type"),
                                  plan.get<std::string>("definition"));
    options.latch = plan.get<bool>("latch", false);
    publishers[topic] = node().advertise(options);
  }
  const auto data = plan.get_optional<std::string>("data");
  if (data) {
    Raw raw;
    raw.data = from_hex(*data);
    raw.data.resize(raw.data.size() + plan.get<size_t>("padding", 0), 7);
    ros::Rate rate(plan.get<double>("rate", 1000.0));
    for (long left = plan.get<long>("count", 1); left > 0 && ros::ok(); --left) {
      publishers[topic].publish(raw);
      if (left > 1) rate.sleep();
    }
  }
  return "null";
});

Request unpublish("unpublish", [](const Plan &plan) -> std::string {
  publishers.erase(plan.get<std::string>("topic"));
  return "null";
});

Request connections("connections", [](const Plan &plan) {
  return std::to_string(publishers.at(plan.get<std::string>("topic")).getNumSubscribers());
});

/// type: `*` (in hexadecimal), std_msgs/String, geometry_msgs/PoseStamped, sensor_msgs/Image.
Request subscribe("subscribe", [](const Plan &plan) -> std::string {
  const auto topic = plan.get<std::string>("topic");
  const auto type = plan.get<std::string>("type", "*");
  const auto queue = plan.get<uint32_t>("queue", 100);
  counts[topic] = 0;
  if (type == "*") {
    subscribers[topic] = subscribe_as<Raw>(topic, queue, [](const Raw &raw) {
      return raw.data.size() > 100000 ? std::to_string(raw.data.size()) : quoted(to_hex(raw.data));
    });
  } else if (type == "std_msgs/String") {
    subscribers[topic] = subscribe_as<std_msgs::String>(
        topic, queue, [](const std_msgs::String &message) { return quoted(message.data); });
  } else if (type == "geometry_msgs/PoseStamped") {
    subscribers[topic] = subscribe_as<geometry_msgs::PoseStamped>(
        topic, queue, [](const geometry_msgs::PoseStamped &message) {
          return object({{"frame_id", quoted(message.header.frame_id)},
                         {"sec", std::to_string(message.header.stamp.sec)},
                         {"nsec", std::to_string(message.header.stamp.nsec)},
                         {"x", std::to_string(message.pose.position.x)},
                         {"w", std::to_string(message.pose.orientation.w)}});
        });
  } else if (type == "sensor_msgs/Image") {
    subscribers[topic] = subscribe_as<sensor_msgs::Image>(
        topic, queue, [](const sensor_msgs::Image &message) {
          uint64_t sum = 0;
          for (const uint8_t byte : message.data) sum += byte;
          return object({{"size", std::to_string(message.data.size())},
                         {"sum", std::to_string(sum)},
                         {"width", std::to_string(message.width)},
                         {"encoding", quoted(message.encoding)}});
        });
  } else {
    throw std::runtime_error("the peer was not compiled for " + type);
  }
  return "null";
});

Request unsubscribe("unsubscribe", [](const Plan &plan) -> std::string {
  subscribers.erase(plan.get<std::string>("topic"));
  return "null";
});

Request count("count", [](const Plan &plan) {
  return std::to_string(counts[plan.get<std::string>("topic")].load());
});
}  // namespace
