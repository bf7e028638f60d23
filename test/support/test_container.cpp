#include "camvox/test/test_container.hpp"

#include <algorithm>

#include "camvox/test/dds_domain.hpp"

namespace camvox::test {

void MemoryLogger::write(LogLevel level, std::string_view text) {
  const std::lock_guard lock(mutex_);
  text_ += std::string(to_string(level)) + ": " + std::string(text) + "\n";
}

std::string MemoryLogger::text() const {
  const std::lock_guard lock(mutex_);
  return text_;
}

dds::ParticipantOptions test_options(std::string name) {
  dds::ParticipantOptions options;
  options.name = std::move(name);
  options.domain_id = own_domain();
  return options;
}

TestContainer::TestContainer(const dds::ParticipantOptions& options, dds::TopicSettingsMap topics)
    : middleware_(dds::make_middleware(options, std::move(topics), *log_)) {}

TestContainer::~TestContainer() {
  for (auto& member : members_) end(member);
}

dds::ComponentContext& TestContainer::component(const std::string& name) {
  auto executor = std::make_shared<dds::Executor>(name);
  executor->start();
  const auto keep_error = [this](std::exception_ptr error) {
    const std::lock_guard lock(errors_mutex_);
    try {
      std::rethrow_exception(std::move(error));
    } catch (const std::exception& exception) {
      errors_.emplace_back(exception.what());
    }
  };
  auto context = std::make_unique<dds::ComponentContext>(
      dds::ComponentSettings{name, {}, {}}, middleware_, executor, log_, keep_error);
  members_.push_back({std::move(executor), std::move(context)});
  return *members_.back().context;
}

void TestContainer::activate() {
  for (auto& member : members_) {
    if (member.context && !member.active) member.context->activate();
    member.active = true;
  }
}

void TestContainer::remove(dds::ComponentContext& component) {
  const auto found = std::find_if(members_.begin(), members_.end(), [&](const Member& member) {
    return member.context.get() == &component;
  });
  if (found != members_.end()) end(*found);
}

void TestContainer::end(Member& member) {
  if (!member.context) return;
  if (member.active) (void)member.context->deactivate(std::chrono::seconds(10));
  member.context.reset();
  (void)member.executor->stop(std::chrono::seconds(10));
}

std::vector<std::string> TestContainer::errors() const {
  const std::lock_guard lock(errors_mutex_);
  return errors_;
}

}  // namespace camvox::test
