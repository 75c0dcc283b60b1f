// A roscpp node that obeys requests on its standard input; README.md says how.
#include "roscpp_peer.hpp"

#include <boost/property_tree/json_parser.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <mutex>
#include <sstream>
#include <thread>

namespace {
std::map<std::string, Handler> &requests() {
  static std::map<std::string, Handler> known;
  return known;
}

std::unique_ptr<ros::NodeHandle> handle;
std::mutex output;

void obey(const Plan &plan) {
  const auto number = plan.get<std::string>("number");
  try {
    const auto answer = requests().at(plan.get<std::string>("do"))(plan);
    report("answer " + number, object({{"value", answer}}));
  } catch (const std::exception &error) {
    report("answer " + number, object({{"error", quoted(error.what())}}));
  }
}
}  // namespace

Request::Request(const std::string &name, Handler handler) { requests()[name] = handler; }

void report(const std::string &event, const std::string &json) {
  const std::lock_guard<std::mutex> guard(output);
  std::cout << object({{event, json}}) << std::endl;
}

std::string quoted(const std::string &text) {
  std::string made = "\"";
  for (const unsigned char c : text) {
    if (c == '"' || c == '\\') {
      made += '\\';
      made += static_cast<char>(c);
    } else if (c < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", c);
      made += code;
    } else {
      made += static_cast<char>(c);
    }
  }
  return made + '"';
}

std::string object(const std::map<std::string, std::string> &members) {
  std::string made;
  for (const auto &member : members) {
    made += (made.empty() ? "{" : ", ") + quoted(member.first) + ": " + member.second;
  }
  return made.empty() ? "{}" : made + "}";
}

ros::NodeHandle &node() { return *handle; }

int main(int argc, char **argv) {
  const std::string name = argv[1];
  ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
  handle = std::make_unique<ros::NodeHandle>();
  ros::AsyncSpinner spinner(4);
  spinner.start();
  report("ready", "true");
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream text(line);
    Plan plan;
    boost::property_tree::read_json(text, plan);
    std::thread(obey, plan).detach();
  }
  // The requests' own objects go in no particular order: leave at once.
  ros::shutdown();
  std::cout.flush();
  std::_Exit(0);
}
