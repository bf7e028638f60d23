#include "camvox/sync_component/sync_component.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace camvox {
namespace {

using camvox_interfaces::msg::FrameImage;
using livox_ros_driver2::msg::CustomMsg;
using sensor_msgs::msg::CompressedImage;
using sensor_msgs::msg::Image;
using sensor_msgs::msg::Imu;
using sensor_msgs::msg::PointCloud2;
using sync_component::stamp_of;

// Drivers may publish best-effort; in lockstep much can wait while other components work.
constexpr Qos kImageReader{16, false, false};
constexpr Qos kLidarReader{256, false, false};
constexpr Qos kImuReader{2000, false, false};

SyncComponentConfig checked(SyncComponentConfig config) {
  auto problems = sensors::check(config.camera);
  std::ranges::move(sensors::check(config.rig), std::back_inserter(problems));
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return config;
}

lidar::NoiseConfidence noise_of(const std::string& name) {
  if (name == "off") return lidar::NoiseConfidence::kKeepAll;
  if (name == "high") return lidar::NoiseConfidence::kHigh;
  return name == "low" ? lidar::NoiseConfidence::kLow : lidar::NoiseConfidence::kModerate;
}

sync::AssemblerOptions options_of(const SyncComponentConfig& config) {
  sync::AssemblerOptions options;
  options.use_lidar = config.depth_source != "depth_image";
  options.lockstep = config.lockstep;
  options.camera_time_offset_ns =
      config.rig.camera_time_offset_ns +
      std::llround(1e9 * config.row_time_s * 0.5 * (config.camera.height_px - 1));
  options.imu_time_offset_ns = config.rig.imu_time_offset_ns;
  options.max_imu_samples = camvox_interfaces::msg::SCAN_IMU_SAMPLES;
  return options;
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

}  // namespace

SyncComponent::SyncComponent(Context& context)
    : context_(context),
      config_(checked(context.parameters<SyncComponentConfig>())),
      lidar_options_{noise_of(config_.noise_filter),
                     config_.point_time_unit,
                     sync::to_ns(config_.sync.clock_jump_s)},
      image_input_(config_.camera, config_.encoding),
      assembler_(config_.sync, options_of(config_)),
      depth_pairing_(sync::to_ns(config_.sync.max_time_difference_s),
                     sync::to_ns(config_.sync.clock_jump_s),
                     static_cast<std::size_t>(config_.sync.max_pending_frames)),
      stationary_(config_.stationary),
      progress_(context) {
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
    if (!has_lidar()) {
      report_.write_stream(context_.diagnostics(), "depth", depth_pairing_.counters());
    }
  });
}

void SyncComponent::subscribe_camera() {
  if (config_.image_transport != "compressed") {
    context_.subscribe<Image>({"image", topics::kImage},
                              [this](const auto& image) { on_image(*image); },
                              {.qos = kImageReader, .required = false});
  }
  if (config_.image_transport != "raw") {
    context_.subscribe<CompressedImage>({"compressed_image", topics::kCompressedImage},
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
    context_.subscribe<Image>({"depth", topics::kRegisteredDepth},
                              [this](const auto& image) { on_depth(*image); },
                              {.qos = kImageReader, .required = false});
    return;
  }
  SubscribeOptions options{.qos = kLidarReader, .required = false};
  const Port port{"lidar", topics::kLidar};
  if (config_.depth_source == "point_cloud") {
    context_.subscribe<PointCloud2>(
        port,
        [this](const auto& cloud) { on_lidar(*cloud, sync_component::read_point_cloud); },
        options);
  } else {
    if (config_.depth_source == "livox_interfaces")
      options.type_name = "livox_interfaces/msg/CustomMsg";
    context_.subscribe<CustomMsg>(
        port,
        [this](const auto& message) { on_lidar(*message, sync_component::read_livox); },
        options);
  }
  if (!config_.sync.use_imu) return;
  context_.subscribe<Imu>({"imu", topics::kImu},
                          [this](const auto& imu) { on_imu(*imu); },
                          {.qos = kImuReader, .required = false});
}

template <typename ImageMessage>
void SyncComponent::on_image(const ImageMessage& image) {
  const auto work = progress_.measure();
  const std::int64_t stamp_ns = stamp_of(image.header());
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
  const std::int64_t stamp_ns = stamp_of(image.header());
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
  const auto& rate = imu.angular_velocity();
  const auto& force = imu.linear_acceleration();
  const double norm = std::hypot(force.x(), force.y(), force.z());
  if (!std::isfinite(norm + rate.x() + rate.y() + rate.z())) {
    ++assembler_.imu().counters().malformed;
    return;
  }
  force_unit_.add(norm);
  const double unit_m_s2 = force_unit_.factor_m_s2().value_or(1.0);
  const std::int64_t now_ns = context_.now_ns();
  const std::int64_t stamp_ns = stamp_of(imu.header());
  report_.imu_came(seconds(now_ns - stamp_ns));
  assembler_.add_imu({stamp_ns,
                      {rate.x(), rate.y(), rate.z()},
                      {unit_m_s2 * force.x(), unit_m_s2 * force.y(), unit_m_s2 * force.z()}},
                     now_ns);
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
      write_scan(frame, *scan, *image);
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

void SyncComponent::write_scan(const sync::Frame& frame, Scan& scan, const FrameImage& image) {
  const std::size_t capacity = scan.points().size();
  auto* const rows = reinterpret_cast<float(*)[4]>(scan.points().data()->data());
  const auto cut = assembler_.lidar().cut(frame.window,
                                          {{rows, capacity},
                                           {scan.point_offset_ns().data(), capacity},
                                           {scan.point_line().data(), capacity}});
  if (cut.over_capacity) {
    ++assembler_.frame_counters().over_capacity;
    report_.set_input_problem("window holds more returns than a scan can carry; shorten window_s");
  }
  scan.header().stamp_ns(cut.stamp_ns);
  scan.header().frame_id(next_frame_id_);
  scan.image_stamp_ns(frame.stamp_ns);
  const auto count = static_cast<std::uint32_t>(cut.count);
  scan.points_count(count);
  scan.point_offset_ns_count(count);
  scan.point_line_count(count);
  const auto imu_count = static_cast<std::uint32_t>(frame.imu.size());
  for (std::size_t i = 0; i < frame.imu.size(); ++i) {
    const auto& sample = frame.imu[i];
    scan.imu_stamp_ns()[i] = sample.stamp_ns;
    std::ranges::copy(sample.gyro_rad_s, scan.imu()[i].begin());
    std::ranges::copy(sample.force_m_s2, scan.imu()[i].begin() + 3);
  }
  scan.imu_stamp_ns_count(imu_count);
  scan.imu_count(imu_count);
  // Interleaved colours average to brightness as well: blocks just get narrower.
  auto blocks = lidar::block_means(
      image.data().data(), image.row_step_bytes(), image.height_px(), image.row_step_bytes());
  scan.stationary(stationary_.add(std::move(blocks), {scan.imu().data(), imu_count}) ? 1 : 0);
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
