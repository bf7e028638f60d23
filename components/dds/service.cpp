#include "camvox/dds/service.hpp"

#include <fastdds/rtps/common/WriteParams.h>

#include <map>
#include <mutex>
#include <thread>

#include "endpoints.hpp"
#include "topic_types.hpp"

namespace camvox::dds {
namespace {

using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::SampleIdentity;
using eprosima::fastrtps::rtps::WriteParams;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

constexpr std::chrono::milliseconds kClientMatchTimeout{500};
constexpr std::chrono::milliseconds kPollPeriod{2};
constexpr std::chrono::milliseconds kTearDownTimeout{1000};

std::string request_topic(const std::string& service) { return "rq" + service + "Request"; }
std::string reply_topic(const std::string& service) { return "rr" + service + "Reply"; }

/// Polls a condition that DDS changes on its own threads.
template <typename Condition>
bool wait_until(std::chrono::steady_clock::time_point deadline, Condition&& condition) {
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(kPollPeriod);
  }
  return true;
}

}  // namespace

struct ServiceServer::Implementation {
  Implementation(const std::shared_ptr<Participant>& participant,
                 const std::string& name,
                 const interfaces::MessageType& request,
                 const interfaces::MessageType& response,
                 Handler handle)
      : request_type(request),
        response_type(response),
        handler(std::move(handle)),
        replies(participant,
                reply_topic(name),
                new WireTopicType(response.dds_name),
                wire_writer_qos(qos::kServices)),
        requests(participant,
                 request_topic(name),
                 new WireTopicType(request.dds_name),
                 wire_reader_qos(qos::kServices)) {}

  bool take_one() {
    const auto request = interfaces::make_message(request_type);
    WireData data{&request_type, request.get()};
    eprosima::fastdds::dds::SampleInfo info;
    if (requests->take_next_sample(&data, &info) != ReturnCode::RETCODE_OK) return false;
    if (!info.valid_data || !data.well_formed) return true;
    const auto response = interfaces::make_message(response_type);
    handler(request.get(), response.get());
    reply(info, response.get());
    return true;
  }

  void reply(const eprosima::fastdds::dds::SampleInfo& info, void* response) {
    // The client names the reader of its replies; others are known by their request writer.
    const GUID_t reader = info.related_sample_identity.writer_guid();
    SampleIdentity related = info.sample_identity;
    if (reader != GUID_t::unknown()) related.writer_guid(reader);
    // Discovery is not symmetric: we may hear a request before we see the reader of its reply.
    wait_until(std::chrono::steady_clock::now() + kClientMatchTimeout, [&] {
      return reader == GUID_t::unknown() ? replies.reader_count() > 0 : replies.matches(reader);
    });
    WriteParams parameters;
    parameters.related_sample_identity(related);
    WireData data{&response_type, response};
    replies->write(&data, parameters);
  }

  const interfaces::MessageType& request_type;
  const interfaces::MessageType& response_type;
  Handler handler;
  WriterHandle replies;
  ReaderHandle requests;
};

ServiceServer::ServiceServer(std::shared_ptr<Participant> participant,
                             Executor& executor,
                             const std::shared_ptr<Tenant>& tenant,
                             const std::string& name,
                             const interfaces::MessageType& request_type,
                             const interfaces::MessageType& response_type,
                             Handler handler)
    : executor_(executor),
      tenant_(std::make_shared<Tenant>(
          name, [tenant](std::exception_ptr error) { tenant->report(error); })),
      implementation_(std::make_shared<Implementation>(
          participant, name, request_type, response_type, std::move(handler))) {
  executor_.add_source(tenant_,
                       implementation_->requests.data_condition(),
                       [state = implementation_] { return state->take_one(); });
}

ServiceServer::~ServiceServer() { (void)end(kTearDownTimeout); }

bool ServiceServer::end(std::chrono::milliseconds timeout) {
  return executor_.remove(tenant_, timeout);
}

bool call_service(const std::shared_ptr<Participant>& participant,
                  const std::string& name,
                  const interfaces::MessageType& request_type,
                  const void* request,
                  const interfaces::MessageType& response_type,
                  void* response,
                  std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  ReaderHandle replies(participant,
                       reply_topic(name),
                       new WireTopicType(response_type.dds_name),
                       wire_reader_qos(qos::kServices));
  WriterHandle requests(participant,
                        request_topic(name),
                        new WireTopicType(request_type.dds_name),
                        wire_writer_qos(qos::kServices));
  if (!wait_until(deadline,
                  [&] { return requests.reader_count() > 0 && replies.writer_count() > 0; })) {
    return false;
  }
  WriteParams parameters;
  SampleIdentity related;
  related.writer_guid(replies->guid());
  parameters.related_sample_identity(related);
  WireData outgoing{&request_type, const_cast<void*>(request)};
  requests->write(&outgoing, parameters);
  const SampleIdentity sent = parameters.sample_identity();
  return wait_until(deadline, [&] {
    const auto candidate = interfaces::make_message(response_type);
    WireData incoming{&response_type, candidate.get()};
    eprosima::fastdds::dds::SampleInfo info;
    if (replies->take_next_sample(&incoming, &info) != ReturnCode::RETCODE_OK) return false;
    const auto& answered = info.related_sample_identity;
    const bool ours =
        answered.sequence_number() == sent.sequence_number() &&
        (answered.writer_guid() == replies->guid() || answered.writer_guid() == requests->guid());
    if (!info.valid_data || !incoming.well_formed || !ours) return false;
    response_type.copy(candidate.get(), response);
    return true;
  });
}

}  // namespace camvox::dds
