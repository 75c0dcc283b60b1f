// What the requests of the roscpp peer share; README.md says how requests and answers look.
#pragma once

#include <ros/ros.h>

#include <boost/property_tree/ptree.hpp>
#include <functional>
#include <map>
#include <string>

using Plan = boost::property_tree::ptree;

/// Does what is asked and returns the answer's value as JSON; throws std::exception on failure.
using Handler = std::function<std::string(const Plan &)>;

/// Adds a request: `static Request count("count", [](const Plan &plan) { return number(3); });`
struct Request {
  Request(const std::string &name, Handler handler);
};

/// Prints the line {"event": value} in one piece; `json` is JSON already.
void report(const std::string &event, const std::string &json);

/// Returns `text` as a JSON string.
std::string quoted(const std::string &text);

/// Returns a JSON object of members that are JSON already.
std::string object(const std::map<std::string, std::string> &members);

/// Returns the node's handle.
ros::NodeHandle &node();
