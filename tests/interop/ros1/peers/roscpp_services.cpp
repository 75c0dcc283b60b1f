// Requests about services of std_srvs and roscpp, whose classes are compiled in.
#include <roscpp/GetLoggers.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "roscpp_peer.hpp"

namespace {
std::map<std::string, ros::ServiceServer> servers;

/// Does what a test wants before a response goes out; returns whether it does.
bool proceed(const Plan &plan) {
  const auto fails = plan.get<std::string>("fails", "");
  std::this_thread::sleep_for(std::chrono::duration<double>(plan.get<double>("delay", 0.0)));
  if (fails == "exception") throw std::runtime_error("the arm is stuck");
  return fails.empty();
}

/// service, type, fails (`exception`, `false`), delay in seconds; reported as `served`.
Request serve("serve", [](const Plan &plan) -> std::string {
  const auto name = plan.get<std::string>("service");
  const auto type = plan.get<std::string>("type");
  if (type == "std_srvs/SetBool") {
    using Service = std_srvs::SetBool;
    const boost::function<bool(Service::Request &, Service::Response &)> answer =
        [plan, name](Service::Request &request, Service::Response &response) {
          report("served", object({{"service", quoted(name)},
                                   {"request", request.data ? "true" : "false"}}));
          response.success = request.data;
          response.message = std::string(plan.get<size_t>("length", 2), 'o');
          return proceed(plan);
        };
    servers[name] = node().advertiseService<Service::Request, Service::Response>(name, answer);
  } else if (type == "std_srvs/Empty") {
    using Service = std_srvs::Empty;
    const boost::function<bool(Service::Request &, Service::Response &)> answer =
        [plan, name](Service::Request &, Service::Response &) {
          report("served", object({{"service", quoted(name)}}));
          return proceed(plan);
        };
    servers[name] = node().advertiseService<Service::Request, Service::Response>(name, answer);
  } else {
    throw std::runtime_error("the peer was not compiled for " + type);
  }
  return "null";
});

Request unserve("unserve", [](const Plan &plan) -> std::string {
  servers.erase(plan.get<std::string>("service"));
  return "null";
});

template <typename Service, typename Show>
std::string call_as(const Plan &plan, typename Service::Request request, Show show) {
  const auto name = plan.get<std::string>("service");
  if (!ros::service::waitForService(name, 20000)) throw std::runtime_error("no " + name);
  auto client = node().serviceClient<Service>(name, plan.get<bool>("persistent", false));
  std::string made;
  for (long left = plan.get<long>("count", 1); left > 0; --left) {
    typename Service::Response response;
    const bool good = client.call(request, response);
    made += (made.empty() ? "" : ", ") + (good ? show(response) : std::string("false"));
  }
  return "[" + made + "]";
}

/// service, type, data, persistent, count; returns the responses, false for failures.
Request call("call", [](const Plan &plan) -> std::string {
  const auto type = plan.get<std::string>("type");
  if (type == "std_srvs/SetBool") {
    std_srvs::SetBool::Request request;
    request.data = plan.get<bool>("data", false);
    return call_as<std_srvs::SetBool>(plan, request, [](const std_srvs::SetBool::Response &found) {
      return object({{"success", found.success ? "true" : "false"},
                     {"message", quoted(found.message)}});
    });
  }
  if (type == "std_srvs/Trigger") {
    return call_as<std_srvs::Trigger>(
        plan, {}, [](const std_srvs::Trigger::Response &found) { return quoted(found.message); });
  }
  if (type == "std_srvs/Empty") {
    return call_as<std_srvs::Empty>(
        plan, {}, [](const std_srvs::Empty::Response &) { return std::string("{}"); });
  }
  if (type == "roscpp/GetLoggers") {
    return call_as<roscpp::GetLoggers>(
        plan, {},
        [](const roscpp::GetLoggers::Response &found) { return std::to_string(found.loggers.size()); });
  }
  throw std::runtime_error("the peer was not compiled for " + type);
});
}  // namespace
