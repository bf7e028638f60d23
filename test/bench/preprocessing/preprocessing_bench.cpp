// Processor time of sync and deskew for frames of the CamVox rig: 1520x568 images, 24 000 returns,
// 200 Hz IMU, one thread. The messages are filled again and again, as loans in a container are.
#include <algorithm>
#include <cstdio>
#include <ctime>

#include "camvox/lidar/deskew.hpp"
#include "camvox/lidar/inertial_motion.hpp"
#include "camvox/lidar/stationary.hpp"
#include "camvox/simulation/image.hpp"
#include "camvox/simulation/jpeg.hpp"
#include "camvox/sync/frame_assembler.hpp"
#include "camvox/sync_component/image_input.hpp"
#include "camvox/sync_component/lidar_input.hpp"
#include "camvox/sync_component/scan_output.hpp"
#include "camvox/test/moving_rig.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::FrameImage;
using camvox_interfaces::msg::Scan;

constexpr std::int64_t kFrame_ns = 100'000'000;
constexpr std::uint32_t kWidth = 1520, kHeight = 568;
constexpr std::size_t kReturns = 24'000;
constexpr int kFrames = 200;

double thread_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

class Stopwatch {
 public:
  template <typename Work>
  void measure(Work work) {
    const double begin_s = thread_time_s();
    work();
    times_ms_.push_back(1e3 * (thread_time_s() - begin_s));
  }
  void print(const char* what) {
    times_ms_.erase(times_ms_.begin(), times_ms_.begin() + 10);  // warms up
    std::ranges::sort(times_ms_);
    std::printf("%-44s median %6.3f ms, 5%% %6.3f, 95%% %6.3f\n",
                what,
                times_ms_[times_ms_.size() / 2],
                times_ms_[times_ms_.size() / 20],
                times_ms_[times_ms_.size() * 19 / 20]);
  }

 private:
  std::vector<double> times_ms_;
};

livox_ros_driver2::msg::CustomMsg livox_message(const test::MovingScan& scan) {
  livox_ros_driver2::msg::CustomMsg message;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    livox_ros_driver2::msg::CustomPoint point;
    point.offset_time(scan.offset_ns[i]);
    point.x(scan.points[i][0]);
    point.y(scan.points[i][1]);
    point.z(scan.points[i][2]);
    message.points().push_back(point);
  }
  return message;
}

/// With texture, so that a JPEG of it has a usual size.
simulation::ColorImage coloured_image() {
  simulation::ColorImage image;
  image.width_px = kWidth;
  image.height_px = kHeight;
  image.rgb.resize(std::size_t{3} * kWidth * kHeight);
  const simulation::CounterRandom random(1, 1);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const auto u = static_cast<double>(i / 3 % kWidth);
    const double value =
        120.0 + 60.0 * std::sin(0.05 * u) + 12.0 * static_cast<double>(random.fast_normal(i));
    image.rgb[i] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
  }
  return image;
}

sensor_msgs::msg::Image raw_image(const std::string& encoding, std::uint32_t channels) {
  sensor_msgs::msg::Image image;
  image.width(kWidth);
  image.height(kHeight);
  image.step(channels * kWidth);
  image.encoding(encoding);
  image.data().assign(std::size_t{channels} * kWidth * kHeight, 90);
  return image;
}

/// All that sync does for one frame, from the messages to the filled loans.
class Sync {
 public:
  void run(const test::MovingRig& rig) {
    const auto message = livox_message(rig.scan(0, 0, kReturns));
    Stopwatch returns, cuts, still;
    for (int frame = 1; frame <= kFrames; ++frame) {
      const std::int64_t image_ns = frame * kFrame_ns;
      auto timed = message;
      timed.timebase(static_cast<std::uint64_t>(image_ns - kFrame_ns));
      returns.measure([&] {
        sync::LidarChunk chunk;
        chunk.returns = assembler_.lidar().take_spare();
        if (!sync_component::read_livox(timed, {}, chunk).empty()) std::abort();
        assembler_.add_lidar(std::move(chunk), image_ns);
      });
      cuts.measure([&] { cut(image_ns); });
      still.measure([&] {
        auto blocks = lidar::block_means(image_->data().data(), kWidth, kHeight, kWidth);
        stationary_.add(std::move(blocks), {scan_->imu().data(), 20});
      });
    }
    returns.print("sync: read 24 000 returns of a Livox");
    cuts.print("sync: IMU, pairing, cut 24 000 returns");
    still.print("sync: standstill");
  }

 private:
  void cut(std::int64_t image_ns) {
    for (std::int64_t time_ns = image_ns - kFrame_ns; time_ns <= image_ns;
         time_ns += kFrame_ns / 20) {
      assembler_.add_imu({time_ns, {}, {0.0, 0.0, 9.8}}, image_ns);
    }
    if (assembler_.judge_image(image_ns) != sync::ImageVerdict::kAccepted) std::abort();
    assembler_.add_image(image_ns, image_ns);
    const auto frame = assembler_.take_ready(image_ns);
    if (!frame) std::abort();
    if (!sync_component::write_scan(*frame, assembler_.lidar(), *scan_)) std::abort();
    if (scan_->points_count() < kReturns * 9 / 10) std::abort();
  }

  sync::FrameAssembler assembler_{sync::SyncConfig{}, sync::AssemblerOptions{}};
  lidar::StationaryDetector stationary_{lidar::StationaryConfig{}};
  std::unique_ptr<Scan> scan_ = std::make_unique<Scan>();
  std::unique_ptr<FrameImage> image_ = std::make_unique<FrameImage>();
};

template <typename Image>
void read_images(const char* what, const std::string& encoding, const Image& image) {
  sync_component::ImageInput input({}, encoding);
  const auto frame = std::make_unique<FrameImage>();
  Stopwatch time;
  for (int i = 0; i < kFrames / 2; ++i) {
    time.measure([&] {
      if (!input.read(image, *frame).empty()) std::abort();
    });
  }
  time.print(what);
}

void deskew(const test::MovingRig& rig) {
  lidar::InertialMotionFilter filter({});
  const auto readings = rig.imu(0, (kFrames + 1) * kFrame_ns, {});
  const auto scan = rig.scan(0, kFrame_ns, kReturns);
  std::vector<std::array<float, 4>> moved(kReturns);
  std::size_t next = 0;
  Stopwatch filters, motions, points;
  for (int frame = 2; frame <= kFrames; ++frame) {
    const std::int64_t image_ns = frame * kFrame_ns, known_ns = image_ns - kFrame_ns;
    filters.measure([&] {
      for (; next < readings.size() && readings[next].stamp_ns <= image_ns; ++next) {
        filter.add_reading(readings[next]);
      }
      filter.add_odometry(
          {known_ns - kFrame_ns,
           known_ns,
           rig.T_world_imu(known_ns - kFrame_ns).inverse() * rig.T_world_imu(known_ns)});
    });
    lidar::ScanMotion motion;
    motions.measure([&] {
      motion = lidar::inertial_scan_motion(filter.track(),
                                           filter.gyro_bias_rad_s(),
                                           filter.predict(image_ns),
                                           {known_ns, image_ns, image_ns},
                                           rig.rig().T_imu_lidar);
    });
    points.measure([&] {
      motion.apply({reinterpret_cast<const float(*)[4]>(scan.points.data()), kReturns},
                   scan.offset_ns,
                   known_ns,
                   {reinterpret_cast<float(*)[4]>(moved.data()), kReturns});
    });
  }
  filters.print("deskew: IMU and odometry into the filter");
  motions.print("deskew: motion of the scan");
  points.print("deskew: 24 000 returns");
}

}  // namespace
}  // namespace camvox

int main() {
  using namespace camvox;
  const auto rig = test::MovingRig::driving(22.0);
  deskew(rig);
  Sync().run(rig);
  const auto grey = raw_image("mono8", 1), colour = raw_image("bgr8", 3);
  read_images("sync: grey image as it comes", "mono8", grey);
  read_images("sync: bgr8 to mono8", "mono8", colour);
  read_images("sync: bgr8 to yuv420", "yuv420", colour);
  sensor_msgs::msg::CompressedImage jpeg;
  jpeg.data(simulation::encode_jpeg(coloured_image(), 85));
  std::printf("JPEG of %zu kB:\n", jpeg.data().size() / 1000);
  read_images("sync: JPEG to mono8", "mono8", jpeg);
  read_images("sync: JPEG to yuv420", "yuv420", jpeg);
  read_images("sync: JPEG to bgr8", "bgr8", jpeg);
}
