// Requests about actions of the type actionlib/Test; rospy_actions.py says what goals do.
#include <actionlib/TestAction.h>
#include <actionlib/client/action_client.h>
#include <actionlib/client/simple_action_client.h>
#include <actionlib/server/action_server.h>
#include <actionlib/server/simple_action_server.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

#include "roscpp_peer.hpp"

namespace {
using Server = actionlib::ActionServer<actionlib::TestAction>;
using SimpleServer = actionlib::SimpleActionServer<actionlib::TestAction>;
using Client = actionlib::ActionClient<actionlib::TestAction>;
using SimpleClient = actionlib::SimpleActionClient<actionlib::TestAction>;

actionlib::TestResult result_of(int value) {
  actionlib::TestResult made;
  made.result = value;
  return made;
}

actionlib::TestFeedback feedback_of(int value) {
  actionlib::TestFeedback made;
  made.feedback = value;
  return made;
}

class Offer {
 public:
  explicit Offer(const std::string &name)
      : server_(
            node(), name, [this](Server::GoalHandle handle) { begin(handle); },
            [this](Server::GoalHandle handle) { cancel(handle); }, false) {
    server_.start();
  }

 private:
  void begin(Server::GoalHandle handle) {
    std::thread([this, handle]() { work(handle); }).detach();
  }

  void cancel(Server::GoalHandle handle) {
    const std::lock_guard<std::mutex> guard(lock_);
    stopped_.insert(handle.getGoalID().id);
    changed_.notify_all();
  }

  bool stopped(const Server::GoalHandle &handle, std::chrono::milliseconds patience) {
    std::unique_lock<std::mutex> guard(lock_);
    return changed_.wait_for(guard, patience,
                             [&]() { return stopped_.count(handle.getGoalID().id) > 0; });
  }

  void work(Server::GoalHandle handle) {
    const int wanted = handle.getGoal()->goal;
    if (wanted == 0) {
      handle.setRejected(result_of(-1), "not zero");
      return;
    }
    if (wanted == -2) {
      stopped(handle, std::chrono::minutes(1));
      handle.setCanceled(result_of(-1), "recalled");
      return;
    }
    handle.setAccepted("begun");
    if (wanted == -1) {
      handle.setAborted(result_of(-1), "unlucky");
      return;
    }
    for (int done = 0; done < wanted; ++done) {
      handle.publishFeedback(feedback_of(done));
      if (stopped(handle, std::chrono::milliseconds(20))) {
        handle.setCanceled(result_of(done), "stopped");
        return;
      }
    }
    handle.setSucceeded(result_of(wanted), "finished");
  }

  std::mutex lock_;
  std::condition_variable changed_;
  std::set<std::string> stopped_;
  Server server_;
};

class SimpleOffer {
 public:
  explicit SimpleOffer(const std::string &name)
      : server_(
            node(), name,
            [this](const actionlib::TestGoalConstPtr &goal) { execute(goal->goal); }, false) {
    server_.start();
  }

 private:
  void execute(int wanted) {
    for (int done = 0; done < wanted; ++done) {
      server_.publishFeedback(feedback_of(done));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (server_.isPreemptRequested()) {
        server_.setPreempted(result_of(done), "stopped");
        return;
      }
    }
    server_.setSucceeded(result_of(wanted), "finished");
  }

  SimpleServer server_;
};

std::mutex lock;
std::map<std::string, std::shared_ptr<void>> servers;
std::map<std::string, std::shared_ptr<Client>> clients;
std::map<std::string, Client::GoalHandle> goals;

Client &client(const std::string &name) {
  const std::lock_guard<std::mutex> guard(lock);
  auto &found = clients[name];
  if (!found) found = std::make_shared<Client>(node(), name);
  return *found;
}

Client::GoalHandle &goal(const Plan &plan) {
  const std::lock_guard<std::mutex> guard(lock);
  return goals.at(plan.get<std::string>("key"));
}

const Request serve("action_server", [](const Plan &plan) {
  const auto name = plan.get<std::string>("name");
  const auto made = std::make_shared<Offer>(name);
  const std::lock_guard<std::mutex> guard(lock);
  servers[name] = made;
  return std::string("null");
});

const Request serve_simple("simple_action_server", [](const Plan &plan) {
  const auto name = plan.get<std::string>("name");
  const auto made = std::make_shared<SimpleOffer>(name);
  const std::lock_guard<std::mutex> guard(lock);
  servers[name] = made;
  return std::string("null");
});

const Request stop_server("stop_action_server", [](const Plan &plan) {
  const std::lock_guard<std::mutex> guard(lock);
  servers.erase(plan.get<std::string>("name"));
  return std::string("null");
});

const Request wait_for_server("wait_for_server", [](const Plan &plan) {
  const ros::Duration timeout(plan.get<double>("timeout", 10.0));
  const bool found =
      client(plan.get<std::string>("name")).waitForActionServerToStart(timeout);
  return std::string(found ? "true" : "false");
});

const Request send("send_goal", [](const Plan &plan) {
  const auto key = plan.get<std::string>("key");
  actionlib::TestGoal wanted;
  wanted.goal = plan.get<int>("goal");
  const auto handle = client(plan.get<std::string>("name"))
                          .sendGoal(
                              wanted,
                              [key](Client::GoalHandle changed) {
                                const auto state = changed.getCommState();
                                std::map<std::string, std::string> fields{
                                    {"state", quoted(state.toString())}};
                                if (state == actionlib::CommState::DONE) {
                                  const auto end = changed.getTerminalState();
                                  const auto result = changed.getResult();
                                  fields["terminal"] = quoted(end.toString());
                                  fields["text"] = quoted(end.getText());
                                  fields["result"] =
                                      result ? std::to_string(result->result) : "null";
                                }
                                report("state " + key, object(fields));
                              },
                              [key](Client::GoalHandle,
                                    const actionlib::TestFeedbackConstPtr &feedback) {
                                report("feedback " + key, std::to_string(feedback->feedback));
                              });
  const std::lock_guard<std::mutex> guard(lock);
  goals[key] = handle;
  return std::string("null");
});

const Request cancel_goal("cancel_goal", [](const Plan &plan) {
  goal(plan).cancel();
  return std::string("null");
});

const Request cancel_all("cancel_all", [](const Plan &plan) {
  client(plan.get<std::string>("name")).cancelAllGoals();
  return std::string("null");
});

const Request simple_goal("simple_goal", [](const Plan &plan) {
  SimpleClient simple(plan.get<std::string>("name"), false);
  if (!simple.waitForServer(ros::Duration(10))) throw std::runtime_error("no server");
  actionlib::TestGoal wanted;
  wanted.goal = plan.get<int>("goal");
  simple.sendGoal(wanted);
  if (plan.count("cancel_after")) {
    ros::Duration(plan.get<double>("cancel_after")).sleep();
    simple.cancelGoal();
  }
  if (!simple.waitForResult(ros::Duration(10))) throw std::runtime_error("no result");
  const auto end = simple.getState();
  return object({{"terminal", quoted(end.toString())},
                 {"text", quoted(end.getText())},
                 {"result", std::to_string(simple.getResult()->result)}});
});
}  // namespace
