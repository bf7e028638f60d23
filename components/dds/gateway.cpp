#include "gateway.hpp"

#include "plain_publisher.hpp"
#include "plain_subscription.hpp"
#include "topic_types.hpp"

namespace camvox::dds {
namespace {

using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;
constexpr std::chrono::milliseconds kDetachTimeout{1000};

std::shared_ptr<Tenant> make_tenant(const std::string& name, const std::shared_ptr<Logger>& log) {
  return std::make_shared<Tenant>(name, [name, log](std::exception_ptr error) {
    try {
      std::rethrow_exception(error);
    } catch (const std::exception& exception) {
      log->error("{}: {}", name, exception.what());
    } catch (...) {
      log->error("{}: unknown exception", name);
    }
  });
}

}  // namespace

/// Sends a topic of this container out while another process reads it.
class Gateway::Export : public std::enable_shared_from_this<Export> {
 public:
  Export(Gateway& gateway, const std::string& topic, const Entry& entry)
      : participant_(gateway.participant_),
        executor_(gateway.executor_),
        log_(gateway.log_),
        topic_(topic),
        type_(*entry.type),
        qos_(entry.qos),
        stats_(entry.export_stats),
        control_(make_tenant("export " + topic, log_)) {}

  /// Opens the wire side on the gateway's thread, where all else of an export happens as well: a
  /// match may be reported before the writer's constructor has returned.
  void open() {
    executor_->post(control_, [self = weak_from_this()] {
      if (const auto alive = self.lock()) alive->open_writer();
    });
  }

  void close() {
    executor_->remove(control_, kDetachTimeout);
    if (flow_) executor_->remove(flow_, kDetachTimeout);
    writer_.reset();
  }

 private:
  void open_writer() {
    writer_ = std::make_unique<WriterHandle>(
        participant_,
        wire_topic_name(topic_),
        new WireTopicType(type_.dds_name),
        wire_writer_qos(qos_),
        [self = weak_from_this(), executor = executor_, control = control_] {
          executor->post(control, [self] {
            if (const auto alive = self.lock()) alive->follow_readers();
          });
        });
  }

  /// Reads the in-place topic only while somebody outside wants it.
  void follow_readers() {
    const auto readers = writer_->reader_count();
    log_->debug("{}: {} readers in other processes", topic_, readers);
    const bool wanted = readers > 0;
    if (wanted == (flow_ != nullptr)) return;
    if (!wanted) {
      executor_->remove(std::exchange(flow_, nullptr), kDetachTimeout);
      return;
    }
    flow_ = make_tenant("export " + topic_, log_);
    SubscribeOptions options;
    options.qos = qos_;
    options.max_held = 0;
    PlainSubscription local(participant_, topic_, type_, options);
    local.attach(*executor_,
                 flow_,
                 [self = weak_from_this()](const std::shared_ptr<const void>& message,
                                           const MessageInfo& info) {
                   if (const auto alive = self.lock()) alive->send(message.get(), info);
                 });
  }

  void send(const void* message, const MessageInfo& info) {
    stats_->count(info);  // what it lost came faster than it can be serialised
    WireData data{&type_, const_cast<void*>(message)};
    auto parameters = write_parameters(info.publish_stamp_ns);
    if (!(*writer_)->write(&data, parameters)) ++stats_->lost;
  }

  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Executor> executor_;
  std::shared_ptr<Logger> log_;
  std::string topic_;
  const MessageType& type_;
  Qos qos_;
  std::shared_ptr<AtomicStats> stats_;
  std::shared_ptr<Tenant> control_;
  std::shared_ptr<Tenant> flow_;
  std::unique_ptr<WriterHandle> writer_;
};

/// Brings a topic of another process in, into in-place samples.
class Gateway::Import {
 public:
  Import(Gateway& gateway, const std::string& topic, const Entry& entry)
      : executor_(gateway.executor_),
        log_(gateway.log_),
        topic_(topic),
        tenant_(make_tenant("import " + topic, gateway.log_)),
        flow_(std::make_shared<Flow>(gateway, topic, entry)) {
    executor_->add_source(
        tenant_, flow_->reader.data_condition(), [flow = flow_] { return flow->take_one(); });
  }
  Import(const Import&) = delete;
  Import& operator=(const Import&) = delete;
  ~Import() {
    executor_->remove(tenant_, kDetachTimeout);
    log_->debug("{}: {} messages from {} writers in other processes at the end",
                topic_,
                flow_->stats->received.load(),
                flow_->reader.writer_count());
  }

 private:
  struct Flow {
    Flow(Gateway& gateway, const std::string& topic, const Entry& entry)
        : type(*entry.type),
          stats(entry.border_stats),
          publisher(gateway.participant_, topic, type, {.qos = entry.qos, .max_loans = 1}, {}),
          reader(gateway.participant_,
                 wire_topic_name(topic),
                 new WireTopicType(type.dds_name),
                 wire_reader_qos(entry.qos)) {}

    bool take_one() {
      void* message = nullptr;
      try {
        message = publisher.loan();
      } catch (const LoanError&) {
        ++stats->starved;  // what waits stays where it is until the next look
        return false;
      }
      WireData data{&type, message};
      eprosima::fastdds::dds::SampleInfo info;
      const auto code = reader->take_next_sample(&data, &info);
      const bool taken = code == ReturnCode::RETCODE_OK;
      const bool valid = taken && info.valid_data;
      if (valid) ++stats->received;
      if (valid) stats->lost += tracker.track(info).lost_before;
      if (valid && !data.well_formed) ++stats->rejected;
      if (valid && data.well_formed) {
        publisher.publish_as_of(message, info.source_timestamp.to_ns());
      } else {
        publisher.discard(message);
      }
      return taken;
    }

    const MessageType& type;
    std::shared_ptr<AtomicStats> stats;
    SequenceTracker tracker;
    PlainPublisher publisher;
    ReaderHandle reader;
  };

  std::shared_ptr<Executor> executor_;
  std::shared_ptr<Logger> log_;
  std::string topic_;
  std::shared_ptr<Tenant> tenant_;
  std::shared_ptr<Flow> flow_;
};

Gateway::Gateway(std::shared_ptr<Participant> participant, std::shared_ptr<Logger> log)
    : participant_(std::move(participant)),
      log_(std::move(log)),
      executor_(std::make_shared<Executor>("gateway")) {
  executor_->start();
}

Gateway::~Gateway() {
  for (auto& [topic, entry] : entries_) {
    if (entry.outgoing) entry.outgoing->close();
  }
  entries_.clear();
  executor_->stop(kDetachTimeout);
}

std::shared_ptr<void> Gateway::add_producer(const std::string& topic,
                                            const MessageType& type,
                                            const Qos& qos) {
  return add(topic, type, qos, &Entry::producers);
}

std::shared_ptr<void> Gateway::add_consumer(const std::string& topic,
                                            const MessageType& type,
                                            const Qos& qos) {
  return add(topic, type, qos, &Entry::consumers);
}

std::shared_ptr<void> Gateway::add_shared_consumer(const std::string& topic,
                                                   const MessageType& type,
                                                   const Qos& qos) {
  return add(topic, type, qos, &Entry::shared_consumers);
}

bool Gateway::is_produced(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  return entries_[topic].producers > 0;
}

std::shared_ptr<const AtomicStats> Gateway::border_stats(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  return entries_[topic].border_stats;
}

std::shared_ptr<const AtomicStats> Gateway::export_stats(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  return entries_[topic].export_stats;
}

bool Gateway::may_produce(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  return entries_[topic].shared_consumers == 0;
}

std::shared_ptr<void> Gateway::add(const std::string& topic,
                                   const MessageType& type,
                                   const Qos& qos,
                                   int Entry::*role) {
  {
    const std::lock_guard lock(mutex_);
    auto& entry = entries_[topic];
    const bool first = entry.producers + entry.consumers + entry.shared_consumers == 0;
    if (first || role == &Entry::producers) entry.qos = qos;
    entry.type = &type;
    ++(entry.*role);
  }
  update(topic);
  return {nullptr, [self = shared_from_this(), topic, role](void*) {
            {
              const std::lock_guard lock(self->mutex_);
              --(self->entries_[topic].*role);
            }
            self->update(topic);
          }};
}

void Gateway::update(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  auto& entry = entries_[topic];
  const bool exported = entry.producers > 0;
  const bool imported = entry.consumers > 0 && !exported;
  if (!imported) entry.incoming.reset();
  if (!exported && entry.outgoing) std::exchange(entry.outgoing, nullptr)->close();
  if (exported && !entry.outgoing) {
    entry.outgoing = std::make_shared<Export>(*this, topic, entry);
    entry.outgoing->open();
  }
  if (imported && !entry.incoming) {
    entry.incoming = std::make_shared<Import>(*this, topic, entry);
  }
}

}  // namespace camvox::dds
