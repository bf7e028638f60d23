#include <unistd.h>

#include <cmath>
#include <cstring>
#include <iomanip>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "camvox/bringup/parameter_file.hpp"
#include "camvox/interfaces/geometry_msgs.hpp"
#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/simulation/simulator.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// Rendering on a machine with other work.
constexpr std::chrono::minutes kPatience(3);

std::string content(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// All messages of a topic.
template <typename T>
std::vector<T> messages(const fs::path& bag, const std::string& topic) {
  auto reader = storage::BagReader::open(bag);
  EXPECT_TRUE(reader.ok());
  std::vector<T> found;
  auto cursor = (*reader)->messages();
  while (const auto* message = cursor.next()) {
    if ((*reader)->topics()[message->topic].name != topic) continue;
    EXPECT_TRUE(interfaces::message_type<T>().read_cdr(
        reinterpret_cast<const std::uint8_t*>(message->data.data()),
        message->data.size(),
        &found.emplace_back()));
  }
  return found;
}

/// Simulates a small camera: quick, and everything else as on the rig.
class CommandSimulate : public CommandFixture {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("simulate_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path bag(const std::string& name) const { return folder_ / name; }

  [[nodiscard]] Result simulate(const fs::path& output, std::vector<std::string> more) const {
    std::vector<std::string> words = {"simulate", "standstill", "-o", output};
    for (const char* set : {"duration_s=0.45",
                            "intrinsics.width_px=152",
                            "intrinsics.height_px=56",
                            "intrinsics.fx_px=95.8",
                            "intrinsics.fy_px=95.5",
                            "intrinsics.cx_px=79.0",
                            "intrinsics.cy_px=25.0"}) {
      words.insert(words.end(), {"--set", set});
    }
    words.insert(words.end(), more.begin(), more.end());
    const auto process = begin(words);
    const int code = process->wait(kPatience);
    return {code, process->output()};
  }

  /// Nothing that looks like a bag is left.
  void expect_empty() const {
    for (const auto& entry : fs::directory_iterator(folder_)) ADD_FAILURE() << entry.path();
  }

  fs::path folder_;
};

/// A rig.yaml.
struct CalibrationFile {
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;
  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("camera", self.camera);
    field("rig", self.rig);
  }
};

/// What the simulator itself says of the test's recording.
simulation::SimulationOptions options_of(const fs::path& bag) {
  std::vector<config::Problem> problems;
  simulation::SimulationOptions options;
  const auto parameters = read_parameter_file(bag / "simulation.yaml", problems);
  for (auto& problem : config::load(parameters, options)) problems.push_back(problem);
  EXPECT_TRUE(problems.empty());
  return options;
}

std::int64_t stamp_ns(const auto& message) {
  const auto& stamp = message.header().stamp();
  return std::int64_t{1'000'000'000} * stamp.sec() + stamp.nanosec();
}

/// Compares a bag's topics, message by message, with what the simulator says.
class Comparison {
 public:
  explicit Comparison(const fs::path& bag)
      : images_(messages<sensor_msgs::msg::Image>(bag, "/camera/image_raw")),
        infos_(messages<sensor_msgs::msg::CameraInfo>(bag, "/camera/camera_info")),
        depths_(messages<sensor_msgs::msg::Image>(bag, "/ground_truth/depth/image_raw")),
        scans_(messages<livox_ros_driver2::msg::CustomMsg>(bag, "/livox/lidar")),
        points_(messages<sensor_msgs::msg::PointCloud2>(bag, "/ground_truth/points")),
        imus_(messages<sensor_msgs::msg::Imu>(bag, "/livox/imu")),
        biases_(messages<sensor_msgs::msg::Imu>(bag, "/ground_truth/imu_bias")),
        fixes_(messages<sensor_msgs::msg::NavSatFix>(bag, "/gnss/fix")),
        truths_(messages<nav_msgs::msg::Odometry>(bag, "/ground_truth/odometry")) {}

  void next(const simulation::SimulatedFrame& frame) {
    const auto& image = images_.at(image_);
    EXPECT_EQ(image.encoding(), "rgb8");
    EXPECT_EQ(image.step(), 3U * 152U);
    EXPECT_EQ(image.data(), frame.image.rgb);
    EXPECT_EQ(stamp_ns(image), frame.stamp_ns);
    EXPECT_EQ(stamp_ns(infos_.at(image_)), frame.stamp_ns);
    EXPECT_THAT(infos_.at(image_).d(), ElementsAre(-0.12, 0.1162, 0.0, 0.0, 0.0));
    EXPECT_EQ(infos_.at(image_).k()[2], 79.0);
    const auto& depth = depths_.at(image_++);
    EXPECT_EQ(depth.encoding(), "32FC1");
    ASSERT_EQ(depth.data().size(), 4 * frame.depth.z_m.size());
    EXPECT_EQ(std::memcmp(depth.data().data(), frame.depth.z_m.data(), depth.data().size()), 0);
  }

  void next(const simulation::LidarScan& sent) {
    const auto& scan = scans_.at(scan_);
    const auto& points = points_.at(scan_++);
    EXPECT_EQ(scan.timebase(), static_cast<std::uint64_t>(sent.stamp_ns));
    EXPECT_EQ(stamp_ns(scan), sent.stamp_ns);
    ASSERT_EQ(scan.point_num(), sent.points.size());
    ASSERT_EQ(scan.points().size(), sent.points.size());
    ASSERT_EQ(points.width(), sent.points.size());
    for (std::size_t i = 0; i < sent.points.size(); i += 97) {
      const auto& read = scan.points()[i];
      EXPECT_EQ(read.offset_time(), sent.points[i].offset_ns);
      EXPECT_EQ(Eigen::Vector3f(read.x(), read.y(), read.z()), sent.points[i].p_lidar);
      EXPECT_EQ(read.reflectivity(), sent.points[i].reflectivity);
      EXPECT_EQ(read.tag(), sent.points[i].tag);
      EXPECT_EQ(read.line(), sent.points[i].line);
      EXPECT_EQ(std::memcmp(&points.data()[16 * i], sent.truth[i].p_lidar_stamp.data(), 12), 0);
    }
  }

  void next(const simulation::ImuSample& sample) {
    const auto& imu = imus_.at(imu_);
    EXPECT_EQ(stamp_ns(imu), sample.stamp_ns);
    EXPECT_EQ(imu.angular_velocity().z(), sample.omega_rad_s.z());
    EXPECT_EQ(imu.linear_acceleration().y(), sample.force_m_s2.y());
    EXPECT_EQ(imu.orientation_covariance()[0], -1.0);
    EXPECT_EQ(biases_.at(imu_++).angular_velocity().x(), sample.gyro_bias_rad_s.x());
  }

  void next(const simulation::GnssSample& sample) {
    const auto& fix = fixes_.at(fix_++);
    EXPECT_EQ(stamp_ns(fix), sample.stamp_ns);
    EXPECT_EQ(fix.latitude(), sample.fix.latitude_deg);
    EXPECT_NEAR(fix.position_covariance()[8], 4e-4, 1e-12);
  }

  void next(const simulation::TruthState& state) {
    const auto& truth = truths_.at(truth_++);
    EXPECT_EQ(stamp_ns(truth), state.stamp_ns);
    EXPECT_EQ(truth.header().frame_id(), "world");
    EXPECT_EQ(truth.pose().pose().position().x(), state.body.T_world_body.translation().x());
  }

  void expect_all_seen() const {
    EXPECT_EQ(image_, 5U);
    EXPECT_GE(scan_, 4U);
    EXPECT_EQ(image_, images_.size());
    EXPECT_EQ(scan_, scans_.size());
    EXPECT_EQ(imu_, imus_.size());
    EXPECT_EQ(fix_, fixes_.size());
    EXPECT_EQ(truth_, truths_.size());
  }

 private:
  std::vector<sensor_msgs::msg::Image> images_;
  std::vector<sensor_msgs::msg::CameraInfo> infos_;
  std::vector<sensor_msgs::msg::Image> depths_;
  std::vector<livox_ros_driver2::msg::CustomMsg> scans_;
  std::vector<sensor_msgs::msg::PointCloud2> points_;
  std::vector<sensor_msgs::msg::Imu> imus_;
  std::vector<sensor_msgs::msg::Imu> biases_;
  std::vector<sensor_msgs::msg::NavSatFix> fixes_;
  std::vector<nav_msgs::msg::Odometry> truths_;
  std::size_t image_ = 0, scan_ = 0, imu_ = 0, fix_ = 0, truth_ = 0;
};

TEST_F(CommandSimulate, WritesWhatTheSimulatorSays) {
  const auto result = simulate(bag("one"), {"--images", "raw", "--truth-depth", "--truth-points"});
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("/livox/lidar"));
  Comparison bag_says(bag("one"));
  simulation::Simulator simulator(options_of(bag("one")), 2);
  while (const auto event = simulator.next()) {
    std::visit([&](const auto& message) { bag_says.next(message); }, event->message);
  }
  bag_says.expect_all_seen();
}

TEST_F(CommandSimulate, JpegIsThePresetAndDecodes) {
  ASSERT_EQ(simulate(bag("jpeg"), {"--set", "scans=false"}).exit_code, 0);
  const auto images =
      messages<sensor_msgs::msg::CompressedImage>(bag("jpeg"), "/camera/image_raw/compressed");
  ASSERT_EQ(images.size(), 5U);
  EXPECT_EQ(images[0].format(), "jpeg");
  const cv::Mat image = cv::imdecode(images[0].data(), cv::IMREAD_COLOR);
  EXPECT_EQ(image.size(), cv::Size(152, 56));
  cv::Scalar mean, sigma;
  cv::meanStdDev(image, mean, sigma);
  EXPECT_GT(sigma[0], 10.0);  // It shows something.
}

TEST_F(CommandSimulate, CalibrationStandsBesideTheBagAsRecordedAndAsTrue) {
  ASSERT_EQ(simulate(bag("rig"),
                     {"--set",
                      "extrinsics_error_deg=[1.0, 0.0, 0.0]",
                      "--set",
                      "extrinsics_error_m=[0.0, 0.05, 0.0]",
                      "--set",
                      "scans=false",
                      "--set",
                      "images=false"})
                .exit_code,
            0);
  const auto read = [&](const char* name) {
    std::vector<config::Problem> problems;
    CalibrationFile file;
    const auto parameters = read_parameter_file(bag("rig") / name, problems);
    EXPECT_FALSE(parameters.empty());
    for (auto& problem : config::load(parameters, file)) problems.push_back(problem);
    EXPECT_TRUE(problems.empty());
    EXPECT_EQ(file.camera.width_px, 152);
    return sensors::make_rig_calibration(file.rig);
  };
  const auto recorded = read("rig.yaml");
  const auto truth = read("truth_rig.yaml");
  const auto error = (truth.T_lidar_camera.inverse() * recorded.T_lidar_camera);
  EXPECT_NEAR(error.rotation().log().x(), M_PI / 180.0, 1e-9);
  EXPECT_NEAR(error.translation().y(), 0.05, 1e-9);

  // /tf_static says the same as rig.yaml.
  const auto transforms = messages<tf2_msgs::msg::TFMessage>(bag("rig"), "/tf_static");
  ASSERT_EQ(transforms.size(), 1U);
  std::map<std::string, Eigen::Vector3d> children;
  for (const auto& transform : transforms[0].transforms()) {
    EXPECT_EQ(transform.header().frame_id(), "base_link");
    const auto& t = transform.transform().translation();
    children[transform.child_frame_id()] = {t.x(), t.y(), t.z()};
  }
  EXPECT_EQ(children.size(), 4U);
  EXPECT_LT((children["livox_frame"] - recorded.T_body_lidar().translation()).norm(), 1e-9);
  EXPECT_LT((children["imu_link"] - recorded.T_body_imu().translation()).norm(), 1e-9);
  EXPECT_EQ(messages<tf2_msgs::msg::TFMessage>(bag("rig"), "/ground_truth/tf_static").size(), 1U);
}

TEST_F(CommandSimulate, TruthFilesHoldAPoseForEachImage) {
  ASSERT_EQ(simulate(bag("tum"), {"--set", "scans=false"}).exit_code, 0);
  const auto infos = messages<sensor_msgs::msg::CameraInfo>(bag("tum"), "/camera/camera_info");
  std::istringstream camera(content(bag("tum") / "truth_camera.tum"));
  std::istringstream body(content(bag("tum") / "truth_body.tum"));
  for (const auto& info : infos) {
    std::string stamp, ignored;
    double x = 0, y = 0, z = 0, body_x = 0, body_y = 0, body_z = 0;
    camera >> stamp >> x >> y >> z;
    std::getline(camera, ignored);
    body >> ignored >> body_x >> body_y >> body_z;
    std::getline(body, ignored);
    std::ostringstream expected;
    expected << info.header().stamp().sec() << '.' << std::setw(9) << std::setfill('0')
             << info.header().stamp().nanosec();
    EXPECT_EQ(stamp, expected.str());
    EXPECT_NEAR(z - body_z, 0.9, 0.01);  // The camera's height on the robot.
    EXPECT_NEAR(std::hypot(x - body_x, y - body_y), 0.2, 0.01);
  }
  EXPECT_EQ(camera.peek(), EOF);
  EXPECT_THAT(content(bag("tum") / "loop_pairs.csv"), HasSubstr("earlier_stamp_ns"));
}

TEST_F(CommandSimulate, SameBytesWithAnyNumberOfJobs) {
  fs::create_directories(folder_ / "a");
  fs::create_directories(folder_ / "b");
  ASSERT_EQ(simulate(folder_ / "a" / "bag", {"--jobs", "1"}).exit_code, 0);
  ASSERT_EQ(simulate(folder_ / "b" / "bag", {"--jobs", "3"}).exit_code, 0);
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "a" / "bag")) {
    const auto name = entry.path().filename();
    EXPECT_TRUE(content(entry) == content(folder_ / "b" / "bag" / name)) << name;
    ++files;
  }
  EXPECT_EQ(files, 8U);
}

TEST_F(CommandSimulate, ItsOwnOptionsFileMakesTheSameRecording) {
  fs::create_directories(folder_ / "a");
  const std::vector<std::string> imu_only = {"--set", "images=false", "--set", "scans=false"};
  ASSERT_EQ(simulate(folder_ / "a" / "bag", imu_only).exit_code, 0);
  ASSERT_EQ(
      command({"simulate", folder_ / "a" / "bag" / "simulation.yaml", "-o", bag("bag")}).exit_code,
      0);
  EXPECT_TRUE(content(bag("bag") / "bag_0.mcap") == content(folder_ / "a/bag/bag_0.mcap"));
  const auto file =
      write("options.yaml", "preset: standstill\nduration_s: 0.2\nimages: false\nscans: false\n");
  EXPECT_EQ(command({"simulate", file, "-o", bag("c")}).exit_code, 0);
  EXPECT_EQ(messages<sensor_msgs::msg::Imu>(bag("c"), "/livox/imu").size(), 41U);
}

TEST_F(CommandSimulate, DrivesAlongATumFile) {
  std::string poses;
  for (int i = 0; i <= 20; ++i) {
    poses += std::to_string(100 + 0.1 * i) + " 0 0 " + std::to_string(0.1 * i) + " 0 0 0 1\n";
  }
  const auto result = command({"simulate",
                               "loop_400m",
                               "-o",
                               bag("given"),
                               "--trajectory",
                               write("motion.tum", poses),
                               "--trajectory-of",
                               "camera",
                               "--set",
                               "images=false",
                               "--set",
                               "scans=false"});
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto truths = messages<nav_msgs::msg::Odometry>(bag("given"), "/ground_truth/odometry");
  const auto& end = truths.back().pose().pose().position();
  EXPECT_NEAR(end.x(), 2.0, 0.1);  // The camera's z is the body's x.
  EXPECT_NEAR(end.y(), 0.0, 1e-6);
  EXPECT_NEAR(end.z(), 0.0, 1e-6);
}

TEST_F(CommandSimulate, BadWordsAreNamedWithTheNearestGood) {
  const auto fail = [&](const std::vector<std::string>& words, const std::string& message) {
    auto all = words;
    all.insert(all.begin(), "simulate");
    all.insert(all.end(), {"-o", bag("bad")});
    const auto result = command(all);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_THAT(result.output, HasSubstr(message));
  };
  fail({"dmo"}, "did you mean 'demo'?");
  fail({"demo", "--set", "camera.rate_hx=3"}, "camera.rate_hz");
  fail({"demo", "--set", "camera.rate_hz=-1.0"}, "greater than 0");
  fail({"demo", "--set", "seed=one"}, "seed");
  fail({"demo", "--set", "seed"}, "expected key=value");
  fail({"demo", "--set", "motion=corridor"}, "does not fit world.kind plaza");
  fail({"/nowhere/options.yaml"}, "there is no such file");
  fail({write("a.yaml", "preset: dmo\nsed: 1\n")}, "did you mean 'demo'?");
  fail({write("a.yaml", "preset: demo\nsed: 1\n")}, "a.yaml:2: sed");
  fail({"demo", "--images", "tiff"}, "--images");
  fail({"demo", "--jobs", "0"}, "--jobs");
  fail({}, "what");
  expect_empty();
}

TEST_F(CommandSimulate, AnExistingBagIsReplacedOnlyOnRequest) {
  const std::vector<std::string> imu_only = {"--set", "images=false", "--set", "scans=false"};
  ASSERT_EQ(simulate(bag("bag"), imu_only).exit_code, 0);
  const auto again = simulate(bag("bag"), imu_only);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.output, HasSubstr("exists"));
  auto replacing = imu_only;
  replacing.insert(replacing.end(), {"--overwrite", "--set", "seed=9"});
  EXPECT_EQ(simulate(bag("bag"), replacing).exit_code, 0);
  EXPECT_EQ(options_of(bag("bag")).seed, 9);
  fs::create_directories(bag("home"));
  EXPECT_EQ(simulate(bag("home"), replacing).exit_code, 1);
  EXPECT_TRUE(fs::exists(bag("home")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 2);
}

TEST_F(CommandSimulate, CtrlCLeavesNothing) {
  const auto process = begin({"simulate", "standstill", "-o", bag("stopped")});
  const auto partial = [&] { return !fs::is_empty(folder_); };
  ASSERT_TRUE(test::wait_until(partial, kPatience));
  kill(process->pid(), SIGINT);
  EXPECT_EQ(process->wait(kPatience), 130);
  EXPECT_THAT(process->output(), HasSubstr("interrupted"));
  expect_empty();
}

TEST_F(CommandSimulate, FullDiskIsSaidAndLeavesNothing) {
  const std::string disk = folder_;
  const std::string script = "mount -t tmpfs -o size=512k none " + disk +
                             " && " CAMVOX_COMMAND " simulate standstill -o " + disk +
                             "/full --compression none"
                             " --set images=false; echo exit code $?; ls -A " +
                             disk + "; echo end of list";
  test::ChildProcess child({"unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script});
  EXPECT_EQ(child.wait(kPatience), 0);
  const auto output = child.output();
  if (output.find("unshare:") != std::string::npos || output.find("mount:") != std::string::npos) {
    GTEST_SKIP() << "no private mounts here: " << output;
  }
  EXPECT_THAT(output, HasSubstr("No space left on device"));
  EXPECT_THAT(output, Not(HasSubstr("recovered")));
  EXPECT_THAT(output, HasSubstr("exit code 1\nend of list"));
}

}  // namespace
}  // namespace camvox::bringup
