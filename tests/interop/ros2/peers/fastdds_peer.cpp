// A Fast DDS process that does what rmw_fastrtps does on the wire, moved by lines on standard input:
//
//     fastdds_peer DOMAIN
//     sub ID TOPIC TYPE [best_effort] [latched]     pub ID TOPIC TYPE [best_effort] [latched]
//     server ID SERVICE TYPE [echo]                 client ID SERVICE TYPE
//     send ID HEX           call ID NUMBER HEX           reply ID NUMBER HEX
//
// TOPIC, SERVICE and TYPE are DDS names: "rt/chatter", "add" for rq/addRequest and rr/addReply,
// "pkg::srv::dds_::Add" for Add_Request_ and Add_Response_. HEX is CDR with its encapsulation
// header. Each event is a line of JSON on standard output. An echoing server answers by itself.
//
// A client's request carries the identity of the client's reply reader, as rmw_fastrtps's do; a
// reply's related identity is that reader's, or the request writer's when none was given.

#include <chrono>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SampleIdentity;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;
using Bytes = std::vector<unsigned char>;

// Hands CDR on as it is.
class RawType : public TopicDataType {
public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 8 << 20;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    auto& bytes = *static_cast<Bytes*>(data);
    payload->length = static_cast<uint32_t>(bytes.size());
    payload->encapsulation = bytes[1] ? CDR_LE : CDR_BE;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    auto size = static_cast<uint32_t>(static_cast<Bytes*>(data)->size());
    return [size]() { return size; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

static std::mutex output;

static void report(const std::string& json) {
  std::lock_guard<std::mutex> lock(output);
  std::cout << "{" << json << "}" << std::endl;
}

static std::string hex(const unsigned char* data, size_t size) {
  static const char* digits = "0123456789abcdef";
  std::string text(2 * size, '0');
  for (size_t i = 0; i < size; ++i) {
    text[2 * i] = digits[data[i] >> 4];
    text[2 * i + 1] = digits[data[i] & 15];
  }
  return text;
}

static std::string hex(const GUID_t& guid) {
  return hex(guid.guidPrefix.value, 12) + hex(guid.entityId.value, 4);
}

static Bytes unhex(const std::string& text) {
  auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  Bytes bytes(text.size() / 2);
  for (size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<unsigned char>(digit(text[2 * i]) << 4 | digit(text[2 * i + 1]));
  return bytes;
}

static std::string quoted(const std::string& key, const std::string& value) {
  return "\"" + key + "\": \"" + value + "\"";
}

struct Endpoint : public DataReaderListener, public DataWriterListener {
  std::string id;
  bool is_server = false, is_client = false, echo = false;
  DataWriter* writer = nullptr;
  DataReader* reader = nullptr;
  std::mutex mutex;
  std::set<InstanceHandle_t> readers, writers;
  std::map<int64_t, long> calls;            // a client's numbers by sequence number
  std::map<long, SampleIdentity> requests;  // a server's open requests
  long last = 0;

  void matched(std::set<InstanceHandle_t>& who, const InstanceHandle_t& handle, int change) {
    std::lock_guard<std::mutex> lock(mutex);
    if (change > 0) who.insert(handle); else who.erase(handle);
    report(quoted("matched", id) + ", \"readers\": " + std::to_string(readers.size()) +
           ", \"writers\": " + std::to_string(writers.size()));
  }
  void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override {
    matched(readers, status.last_subscription_handle, status.current_count_change);
  }
  void on_subscription_matched(DataReader*, const SubscriptionMatchedStatus& status) override {
    matched(writers, status.last_publication_handle, status.current_count_change);
  }
  void on_data_available(DataReader* from) override {
    Bytes bytes;
    SampleInfo info;
    while (from->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) take(from, bytes, info);
  }
  void take(DataReader* from, Bytes& bytes, const SampleInfo& info) {
    auto data = ", " + quoted("data", hex(bytes.data(), bytes.size()));
    if (is_server) {
      auto identity = info.sample_identity;
      auto& given = info.related_sample_identity.writer_guid();
      if (given != GUID_t::unknown()) identity.writer_guid() = given;
      if (echo) return answer(identity, bytes);
      std::unique_lock<std::mutex> lock(mutex);
      auto number = ++last;
      requests[number] = identity;
      lock.unlock();
      report(quoted("request", id) + ", \"number\": " + std::to_string(number) + data);
    } else if (is_client) {
      auto& related = info.related_sample_identity;
      if (related.writer_guid() != from->guid() && related.writer_guid() != writer->guid())
        return report(quoted("foreign", id) + ", " + quoted("to", hex(related.writer_guid())));
      std::lock_guard<std::mutex> lock(mutex);
      auto call = calls.find(static_cast<int64_t>(related.sequence_number().to64long()));
      auto number = call == calls.end() ? -1 : call->second;
      report(quoted("reply", id) + ", \"number\": " + std::to_string(number) + data);
    } else {
      report(quoted("received", id) + data);
    }
  }
  void call(long number, Bytes bytes) {
    WriteParams params;
    params.related_sample_identity().writer_guid() = reader->guid();
    std::lock_guard<std::mutex> lock(mutex);
    writer->write(&bytes, params);
    calls[static_cast<int64_t>(params.sample_identity().sequence_number().to64long())] = number;
  }
  void answer(const SampleIdentity& identity, Bytes& bytes) {
    // A reply sent before the client's reader is matched would be lost; a writer is none.
    bool is_reader = identity.writer_guid().entityId.value[3] & 0x04;
    for (int i = 0; is_reader && i < 20; ++i) {
      std::unique_lock<std::mutex> lock(mutex);
      if (readers.count(InstanceHandle_t(identity.writer_guid()))) break;
      lock.unlock();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    WriteParams params;
    params.related_sample_identity(identity);
    writer->write(&bytes, params);
  }
};

int main(int, char** argv) {
  DomainParticipantQos participant_qos;
  participant_qos.user_data().data_vec({'e', 'n', 'c', 'l', 'a', 'v', 'e', '=', '/', ';'});
  auto participant = DomainParticipantFactory::get_instance()->create_participant(
      static_cast<DomainId_t>(std::stoul(argv[1])), participant_qos);
  auto publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  std::map<std::string, std::unique_ptr<Endpoint>> endpoints;

  auto topic = [&](const std::string& name, const std::string& type) -> Topic* {
    if (!participant->find_type(type)) TypeSupport(new RawType(type)).register_type(participant);
    auto known = participant->lookup_topicdescription(name);
    if (known) return dynamic_cast<Topic*>(known);
    return participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
  };
  auto reliability = [](const std::string& o) {
    return o.find("best_effort") == std::string::npos ? RELIABLE_RELIABILITY_QOS
                                                      : BEST_EFFORT_RELIABILITY_QOS;
  };
  auto durability = [](const std::string& o) {
    return o.find("latched") == std::string::npos ? VOLATILE_DURABILITY_QOS
                                                  : TRANSIENT_LOCAL_DURABILITY_QOS;
  };
  auto add_reader = [&](Endpoint* end, Topic* on, const std::string& options) {
    DataReaderQos qos;
    qos.reliability().kind = reliability(options);
    qos.durability().kind = durability(options);
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    end->reader = subscriber->create_datareader(on, qos, end);
  };
  auto add_writer = [&](Endpoint* end, Topic* on, const std::string& options) {
    DataWriterQos qos;
    qos.reliability().kind = reliability(options);
    qos.durability().kind = durability(options);
    qos.history().depth = 10;
    qos.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    end->writer = publisher->create_datawriter(on, qos, end);
  };

  report("\"ready\": true");
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string verb, id, name, type, options, data;
    long number = 0;
    words >> verb >> id;
    auto& slot = endpoints[id];
    if (!slot) {
      slot = std::make_unique<Endpoint>();
      slot->id = id;
    }
    auto end = slot.get();
    if (verb == "send") {
      words >> data;
      auto bytes = unhex(data);
      end->writer->write(&bytes);
    } else if (verb == "call") {
      words >> number >> data;
      end->call(number, unhex(data));
    } else if (verb == "reply") {
      words >> number >> data;
      auto bytes = unhex(data);
      std::unique_lock<std::mutex> lock(end->mutex);
      auto identity = end->requests[number];
      end->requests.erase(number);
      lock.unlock();
      end->answer(identity, bytes);
    } else {
      words >> name >> type;
      std::getline(words, options);
      end->echo = options.find("echo") != std::string::npos;
      if (verb == "sub") add_reader(end, topic(name, type), options);
      if (verb == "pub") add_writer(end, topic(name, type), options);
      end->is_server = verb == "server";
      end->is_client = verb == "client";
      if (end->is_server || end->is_client) {
        auto requests = topic("rq/" + name + "Request", type + "_Request_");
        auto replies = topic("rr/" + name + "Reply", type + "_Response_");
        add_writer(end, end->is_server ? replies : requests, "");
        add_reader(end, end->is_server ? requests : replies, "");
      }
      report(quoted("made", id));
    }
  }
  // No orderly end is needed: the test closes standard input when it is done.
  std::_Exit(0);
}
