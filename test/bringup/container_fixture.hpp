#pragma once

#include <gmock/gmock.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "camvox/bringup/container.hpp"
#include "camvox/test/dds_domain.hpp"
#include "camvox/test/deadline.hpp"

namespace camvox::bringup {

/// Keeps what all components logged: "level name: text" lines.
class RecordingLog {
 public:
  [[nodiscard]] LoggerFactory factory() {
    return [lines = lines_](const std::string& name) {
      return std::make_shared<RecordingLogger>(name, lines);
    };
  }
  [[nodiscard]] std::string text() const {
    const std::lock_guard lock(lines_->mutex);
    return lines_->text;
  }
  [[nodiscard]] bool has(const std::string& part) const {
    return text().find(part) != std::string::npos;
  }
  [[nodiscard]] int count(const std::string& part) const {
    const std::string all = text();
    int found = 0;
    for (auto at = all.find(part); at != std::string::npos; at = all.find(part, at + 1)) ++found;
    return found;
  }

 private:
  struct Lines {
    std::mutex mutex;
    std::string text;
  };
  class RecordingLogger final : public Logger {
   public:
    RecordingLogger(std::string name, std::shared_ptr<Lines> lines)
        : name_(std::move(name)), lines_(std::move(lines)) {}
    void write(LogLevel level, std::string_view text) override {
      const std::lock_guard lock(lines_->mutex);
      lines_->text += fmt::format("{} {}: {}\n", to_string(level), name_, text);
    }
    [[nodiscard]] bool enabled(LogLevel level) const override { return level >= LogLevel::kInfo; }

   private:
    std::string name_;
    std::shared_ptr<Lines> lines_;
  };

  std::shared_ptr<Lines> lines_ = std::make_shared<Lines>();
};

/// A container in this process, from the text of a config, on a domain of its own.
class ContainerFixture : public ::testing::Test {
 protected:
  void start(const std::string& text) {
    auto readout = parse_config(text, "rig.yaml");
    ASSERT_THAT(readout.problems, ::testing::IsEmpty());
    readout.config.container.domain_id = test::own_domain();
    auto probed = probe_system(readout.config, *plugins_);
    ASSERT_THAT(probed.problems, ::testing::IsEmpty());
    container_ = std::make_unique<Container>(
        std::move(readout.config), std::move(probed), plugins_, log_.factory());
    container_->start();
  }

  [[nodiscard]] ComponentInfo component(const std::string& name) const {
    for (const auto& info : container_->components()) {
      if (info.name == name) return info;
    }
    ADD_FAILURE() << "no component " << name;
    return {};
  }

  std::shared_ptr<PluginLoader> plugins_ = std::make_shared<PluginLoader>();
  RecordingLog log_;
  std::unique_ptr<Container> container_;
};

}  // namespace camvox::bringup
