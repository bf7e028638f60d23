#include "camvox/sync_component/sync_component.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "camvox/interfaces/header.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::FrameImage;
using livox_ros_driver2::msg::CustomMsg;
using sensor_msgs::msg::CompressedImage;
using sensor_msgs::msg::Image;
using sensor_msgs::msg::Imu;
using sensor_msgs::msg::PointCloud2;

// Drivers may publish best-effort; in lockstep much can wait while other components work.
constexpr Qos kImageReader{16, false, false};
constexpr Qos kLidarReader{256, false, false};
constexpr Qos kImuReader{2000, false, false};

constexpr Port kImage{"image", topics::kImage};
constexpr Port kCompressedImage{"compressed_image", topics::kCompressedImage};
constexpr Port kLidar{"lidar", topics::kLidar};
constexpr Port kImu{"imu", topics::kImu};
constexpr Port kDepth{"depth", topics::kRegisteredDepth};

constexpr int kLooksBeforeMissing = 5;  // one a second
constexpr int kBitsOfRun = 32;          // frames of a run, before a restart: four years at 30 Hz

/// An image may come in either way.
std::vector<Port> image_ports(const std::string& transport) {
  if (transport == "raw") return {kImage};
  if (transport == "compressed") return {kCompressedImage};
  return {kImage, kCompressedImage};
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

}  // namespace

SyncComponent::SyncComponent(Context& context)
    : context_(context),
      config_(sync_component::checked(context.parameters<SyncComponentConfig>())),
      lidar_options_(sync_component::lidar_input_options(config_)),
      image_input_(config_.camera, config_.encoding),
      assembler_(config_.sync, sync_component::assembler_options(config_)),
      depth_pairing_(sync::to_ns(config_.sync.max_time_difference_s),
                     sync::to_ns(config_.sync.clock_jump_s),
                     static_cast<std::size_t>(config_.sync.max_pending_frames)),
      stationary_(config_.stationary),
      progress_(context),
      next_frame_id_((context.earlier_runs() << kBitsOfRun) + 1) {
  const int loans = config_.sync.max_pending_frames + 2;
  frame_images_ = context.advertise<FrameImage>({"frame_image", topics::kFrameImage},
                                                {.qos = qos::kFrames, .max_loans = loans});
  if (has_lidar()) {
    scans_ = context.advertise<Scan>({"scan", topics::kScan}, {.qos = qos::kFrames});
  } else {
    depth_images_ = context.advertise<DepthImage>({"depth_image", topics::kDepthImage},
                                                  {.qos = qos::kFrames, .max_loans = loans});
  }
  subscribe_camera();
  subscribe_depth_source();
  context.every(std::chrono::milliseconds(20), [this] { publish_ready(); });
  context.every(std::chrono::seconds(1), [this] {
    report_.write(context_.diagnostics(), assembler_, force_unit_.implausible());
    tell_missing_inputs(false);
    if (!has_lidar()) {
      report_.write_stream(context_.diagnostics(), "depth", depth_pairing_.counters());
    }
  });
}

void SyncComponent::stop() {
  tell_missing_inputs(true);
  const auto shortfall = sync_component::shortfall(assembler_);
  if (!shortfall.empty()) context_.log().info("{}", shortfall);
}

/// Says once which inputs nothing has come on: in a recording they may just not be there.
void SyncComponent::tell_missing_inputs(bool at_end) {
  struct Input {
    std::vector<Port> ports;  // any of them
    bool used;
    std::uint64_t received;
  };
  const auto& imu = assembler_.imu().counters();
  const std::array inputs = {
      Input{image_ports(config_.image_transport), true, assembler_.image_counters().received},
      Input{{kLidar}, has_lidar(), assembler_.lidar().counters().received},
      Input{{kImu}, has_lidar() && config_.sync.use_imu, imu.received},
      Input{{kDepth}, !has_lidar(), depth_pairing_.counters().received}};
  const auto came = [](const Input& input) { return input.used && input.received > 0; };
  const bool any = std::any_of(inputs.begin(), inputs.end(), came);
  if (missing_told_ || (!any && !at_end)) return;
  if (!at_end && ++looks_ < kLooksBeforeMissing) return;
  missing_told_ = true;
  for (const auto& input : inputs) {
    if (!input.used || input.received > 0) continue;
    std::vector<std::string> read;
    for (const auto& port : input.ports) read.push_back(context_.topic_of(port));
    context_.log().warn(
        "nothing came on input '{}' (topic {})", input.ports.front().name, fmt::join(read, " or "));
  }
}

void SyncComponent::subscribe_camera() {
  if (config_.image_transport != "compressed") {
    context_.subscribe<Image>(kImage,
                              [this](const auto& image) { on_image(*image); },
                              {.qos = kImageReader, .required = false});
  }
  if (config_.image_transport != "raw") {
    context_.subscribe<CompressedImage>(kCompressedImage,
                                        [this](const auto& image) { on_image(*image); },
                                        {.qos = kImageReader, .required = false});
  }
  context_.subscribe<sensor_msgs::msg::CameraInfo>(
      {"camera_info", topics::kCameraInfo},
      [this](const auto& info) {
        auto problem = sync_component::camera_mismatch(*info, config_.camera);
        if (!problem.empty() && report_.camera_problem().empty())
          context_.log().error("{}", problem);
        report_.set_camera_problem(problem);
      },
      {.qos = kImageReader, .required = false});
}

void SyncComponent::subscribe_depth_source() {
  if (!has_lidar()) {
    context_.subscribe<Image>(kDepth,
                              [this](const auto& image) { on_depth(*image); },
                              {.qos = kImageReader, .required = false});
    return;
  }
  SubscribeOptions options{.qos = kLidarReader, .required = false};
  if (config_.depth_source == "point_cloud") {
    context_.subscribe<PointCloud2>(
        kLidar,
        [this](const auto& cloud) { on_lidar(*cloud, sync_component::read_point_cloud); },
        options);
  } else {
    if (config_.depth_source == "livox_interfaces")
      options.type_name = "livox_interfaces/msg/CustomMsg";
    context_.subscribe<CustomMsg>(
        kLidar,
        [this](const auto& message) { on_lidar(*message, sync_component::read_livox); },
        options);
  }
  if (!config_.sync.use_imu) return;
  context_.subscribe<Imu>(
      kImu, [this](const auto& imu) { on_imu(*imu); }, {.qos = kImuReader, .required = false});
}

template <typename ImageMessage>
void SyncComponent::on_image(const ImageMessage& image) {
  const auto work = progress_.measure();
  const std::int64_t stamp_ns = interfaces::stamp_of(image.header());
  report_.image_came(seconds(context_.now_ns() - stamp_ns));
  const auto verdict = assembler_.judge_image(stamp_ns);
  if (verdict == sync::ImageVerdict::kDuplicate) return;
  if (verdict != sync::ImageVerdict::kAccepted)
    return leave_out(stamp_ns, "its stamp is out of order");
  try {
    auto frame = frame_images_.loan();
    if (const auto problem = image_input_.read(image, *frame); !problem.empty()) {
      ++assembler_.image_counters().malformed;
      report_.set_input_problem("image " + problem);
      assembler_.leave_out();
      return leave_out(stamp_ns, problem);
    }
    assembler_.add_image(stamp_ns, context_.now_ns());
    images_.push_back(std::move(frame));
  } catch (const LoanError& error) {  // readers hold all images
    assembler_.leave_out();
    return leave_out(stamp_ns, error.what());
  }
  publish_ready();
}

void SyncComponent::on_depth(const Image& image) {
  const auto work = progress_.measure();
  const std::int64_t stamp_ns = interfaces::stamp_of(image.header());
  if (depth_pairing_.accepts(assembler_.lidar_time_ns(stamp_ns))) {
    auto loan = std::make_shared<Loan<DepthImage>>(depth_images_.loan());
    const auto problem = sync_component::read_depth(image, config_.camera, config_.rgbd, **loan);
    if (problem.empty()) {
      depth_pairing_.add(assembler_.lidar_time_ns(stamp_ns), std::move(loan));
    } else {
      ++depth_pairing_.counters().malformed;
      report_.set_input_problem("depth image " + problem);
    }
    assembler_.set_newest_depth(stamp_ns, context_.now_ns());
  }
  publish_ready();
}

void SyncComponent::on_imu(const Imu& imu) {
  const auto work = progress_.measure();
  const auto sample = sync_component::read_imu(imu, force_unit_);
  if (!sample) {
    ++assembler_.imu().counters().malformed;
    return;
  }
  const std::int64_t now_ns = context_.now_ns();
  report_.imu_came(seconds(now_ns - sample->stamp_ns));
  assembler_.add_imu(*sample, now_ns);
  publish_ready();
}

template <typename Message, typename Read>
void SyncComponent::on_lidar(const Message& message, Read read) {
  const auto work = progress_.measure();
  sync::LidarChunk chunk;
  chunk.returns = assembler_.lidar().take_spare();
  if (const auto problem = read(message, lidar_options_, chunk); !problem.empty()) {
    ++assembler_.lidar().counters().malformed;
    report_.set_input_problem("lidar message " + problem);
    return;
  }
  report_.lidar_came(seconds(context_.now_ns() - chunk.end_ns));
  assembler_.add_lidar(std::move(chunk), context_.now_ns());
  publish_ready();
}

void SyncComponent::publish_ready() {
  const auto work = progress_.measure();
  while (const auto frame = assembler_.take_ready(context_.now_ns())) publish(*frame);
}

void SyncComponent::publish(const sync::Frame& frame) {
  auto image = std::move(images_.front());
  images_.pop_front();
  image->header().stamp_ns(frame.stamp_ns);
  image->header().frame_id(next_frame_id_);
  try {
    if (has_lidar()) {
      auto scan = scans_.loan();
      fill(*scan, frame, *image);
      frame_images_.publish(std::move(image));
      scans_.publish(std::move(scan));
    } else {
      publish_depth(frame);
      frame_images_.publish(std::move(image));
    }
  } catch (const LoanError& error) {  // readers hold all scans
    assembler_.leave_out();
    return leave_out(frame.stamp_ns, error.what());
  }
  report_progress(frame.stamp_ns, next_frame_id_++);
}

void SyncComponent::fill(Scan& scan, const sync::Frame& frame, const FrameImage& image) {
  scan.header(image.header());
  if (!sync_component::write_scan(frame, assembler_.lidar(), scan)) {
    ++assembler_.frame_counters().over_capacity;
    report_.set_input_problem("window holds more returns than a scan can carry; shorten window_s");
  }
  // Interleaved colours average to brightness as well: blocks just get narrower.
  auto blocks = lidar::block_means(
      image.data().data(), image.row_step_bytes(), image.height_px(), image.row_step_bytes());
  const bool still = stationary_.add(std::move(blocks), {scan.imu().data(), scan.imu_count()});
  scan.stationary(still ? 1 : 0);
  // Of the image before: the message that begins with this one is not there yet.
  if (previous_image_ns_) {
    const auto nearest_ns = assembler_.lidar().nearest_stamp_ns(*previous_image_ns_);
    if (nearest_ns) report_.frame_made(seconds(*previous_image_ns_ - *nearest_ns));
  }
  previous_image_ns_ = frame.stamp_ns;
}

void SyncComponent::publish_depth(const sync::Frame& frame) {
  auto paired = depth_pairing_.take(frame.stamp_ns);
  auto depth = paired ? std::move(**paired) : depth_images_.loan();  // a new one counts no pixels
  depth->header().stamp_ns(frame.stamp_ns);
  depth->header().frame_id(next_frame_id_);
  depth_images_.publish(std::move(depth));
}

void SyncComponent::leave_out(std::int64_t stamp_ns, const std::string& why) {
  context_.log().debug("image at {} ns left out: {}", stamp_ns, why);
  report_progress(assembler_.lidar_time_ns(stamp_ns), 0);
}

void SyncComponent::report_progress(std::int64_t stamp_ns, std::uint64_t frame_id) {
  camvox_interfaces::msg::MessageHeader header;
  header.stamp_ns(stamp_ns);
  header.frame_id(frame_id);
  progress_.done(header);
}

}  // namespace camvox
