#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "camvox/component/fake_context.hpp"
#include "camvox/sync_component/sync_component.hpp"
#include "sensor_streams.hpp"

namespace camvox::test {

inline constexpr std::uint32_t kWidth = 64, kHeight = 48;

/// A sync component of a small camera, and its sensors by the time in ms after the start.
class SyncTest : public ::testing::Test {
 protected:
  SyncTest() : fake_("sync") {
    fake_.set_now_ns(kStart_ns);
    fake_.set_parameter("camera.width_px", std::int64_t{kWidth});
    fake_.set_parameter("camera.height_px", std::int64_t{kHeight});
  }

  void make() { component_ = std::make_unique<SyncComponent>(fake_); }
  void image_at(std::int64_t ms, std::uint8_t brightness = 100) {
    fake_.send("image", grey_image(kStart_ns + ms * kMs, kWidth, kHeight, brightness));
  }
  void scan_at(std::int64_t ms, std::int64_t duration_ms = 100) {
    fake_.send("lidar", livox_message(kStart_ns + ms * kMs, duration_ms * kMs));
  }
  void imu_between(std::int64_t first_ms, std::int64_t last_ms, double force_z = 9.81) {
    for (std::int64_t ms = first_ms; ms <= last_ms; ms += 5) {
      fake_.send("imu", imu_message(kStart_ns + ms * kMs, force_z));
    }
  }
  [[nodiscard]] std::vector<std::shared_ptr<const camvox_interfaces::msg::Scan>> scans() const {
    return fake_.published<camvox_interfaces::msg::Scan>("scan");
  }
  [[nodiscard]] std::vector<std::shared_ptr<const camvox_interfaces::msg::FrameImage>> images()
      const {
    return fake_.published<camvox_interfaces::msg::FrameImage>("frame_image");
  }
  [[nodiscard]] std::uint64_t counter(const std::string& name) {
    fake_.advance(std::chrono::seconds(1));
    return std::stoull(fake_.diagnostics().status().values.at(name));
  }

  FakeContext fake_;
  std::unique_ptr<SyncComponent> component_;
};

}  // namespace camvox::test
