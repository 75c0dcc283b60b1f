// The roscpp side of benchmarks/ros1_topics.py: one publisher for all, and one of the subscribers.
//
//   roscpp_peer publish KIND HZ SECONDS
//   roscpp_peer subscribe KIND CASE
//
// Both print "ready" and wait for a line on standard input. The publisher prints how many messages
// it sent; the subscriber, at another line, what it measured. Each message carries the system time
// of its sending: the header's stamp, or the first 20 digits of a String.

#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

namespace {

int64_t now() {
  timespec t;
  clock_gettime(CLOCK_REALTIME, &t);
  return t.tv_sec * 1000000000LL + t.tv_nsec;
}

ros::Time stamp() {
  const int64_t t = now();
  return ros::Time(t / 1000000000LL, t % 1000000000LL);
}

std::vector<int64_t> got, sent;
size_t count = 0;
bool timed = true;

void note(int64_t when) {
  ++count;
  if (!timed) return;
  got.push_back(now());
  sent.push_back(when);
}

void note(const ros::Time& when) { note(when.sec * 1000000000LL + when.nsec); }

void wait() {
  std::string line;
  std::getline(std::cin, line);
}

template <class Message, class Renew>
void publish(Message message, Renew renew, double hz, double seconds) {
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<Message>("/bench", 1000);
  while (publisher.getNumSubscribers() == 0) ros::WallDuration(0.01).sleep();
  ros::WallDuration(0.3).sleep();
  std::puts("ready");
  std::fflush(stdout);
  wait();
  const double end = ros::WallTime::now().toSec() + seconds;
  ros::WallRate rate(hz);
  long count = 0;
  while (ros::WallTime::now().toSec() < end) {
    renew(message);
    publisher.publish(message);
    ++count;
    rate.sleep();
  }
  std::printf("%ld %f\n", count, seconds);
  std::fflush(stdout);
  wait();
  ros::shutdown();
}

void report() {
  std::vector<double> latencies;
  for (size_t i = std::min<size_t>(5, got.size()); i < got.size(); ++i)
    latencies.push_back((got[i] - sent[i]) / 1e6);
  std::sort(latencies.begin(), latencies.end());
  const size_t n = latencies.size();
  std::printf("{\"count\": %zu, \"median\": %f, \"p99\": %f, \"cpu_s\": %f}\n",
              count, n ? latencies[n / 2] : 0.0, n ? latencies[n * 99 / 100] : 0.0,
              std::clock() / double(CLOCKS_PER_SEC));
  std::fflush(stdout);
}

template <class Message, class Take>
void subscribe(Take take) {
  ros::NodeHandle node;
  got.reserve(100000);
  sent.reserve(100000);
  ros::Subscriber subscriber = node.subscribe<Message>(
      "/bench", 1000000, boost::function<void(const boost::shared_ptr<Message const>&)>(take),
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  std::puts("ready");
  std::fflush(stdout);
  ros::AsyncSpinner spinner(1);
  spinner.start();
  wait();
  spinner.stop();
  report();
  ros::shutdown();
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, std::string("roscpp_") + argv[1],
            ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  const std::string what = argv[1], message = argv[2];
  if (what == "publish") {
    const double hz = std::atof(argv[3]), seconds = std::atof(argv[4]);
    if (message == "image") {
      sensor_msgs::Image image;
      image.height = 1080;
      image.width = 1920;
      image.encoding = "rgb8";
      image.step = 3 * 1920;
      image.data.resize(3 * 1920 * 1080);
      publish(image, [](sensor_msgs::Image& m) { m.header.stamp = stamp(); }, hz, seconds);
    } else if (message == "pose") {
      publish(geometry_msgs::PoseStamped(),
              [](geometry_msgs::PoseStamped& m) { m.header.stamp = stamp(); }, hz, seconds);
    } else {
      publish(std_msgs::String(), [](std_msgs::String& m) {
        char text[64];
        std::snprintf(text, sizeof text, "%020" PRId64 "%040d", now(), 0);
        m.data = text;
      }, hz, seconds);
    }
  } else if ((timed = argv[3] != std::string("rate")), message == "image") {
    subscribe<sensor_msgs::Image>([](const sensor_msgs::ImageConstPtr& m) { note(m->header.stamp); });
  } else if (message == "point") {
    subscribe<geometry_msgs::PointStamped>(
        [](const geometry_msgs::PointStampedConstPtr& m) { note(m->header.stamp); });
  } else if (message == "pose") {
    subscribe<geometry_msgs::PoseStamped>(
        [](const geometry_msgs::PoseStampedConstPtr& m) { note(m->header.stamp); });
  } else {
    subscribe<std_msgs::String>(
        [](const std_msgs::StringConstPtr& m) { note(std::atoll(m->data.substr(0, 20).c_str())); });
  }
  return 0;
}
