#include "camvox/mapping/map_file.hpp"

#include <gmock/gmock.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <random>

#include "camvox/storage/cdr_value.hpp"
#include "camvox/storage/indexed_reader.hpp"
#include "camvox/storage/stream_reader.hpp"
#include "camvox/storage/writer.hpp"
#include "mapping_world.hpp"

namespace camvox::mapping {
namespace {

namespace fs = std::filesystem;
using storage::StatusCode;
using ::testing::HasSubstr;

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

class MapFileTest : public testing::Test {
 protected:
  MapFileTest() {
    folder_ = fs::path(testing::TempDir()) / ("map_file_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~MapFileTest() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path file(const std::string& name = "map.mcap") const { return folder_ / name; }
  void save(const Mapper& mapper) const {
    const auto status =
        save_map(file(), mapper.map(), mapper.epoch(), mapper.model().camera(), mapper.loop_ends());
    ASSERT_TRUE(status.ok()) << status.message();
  }
  [[nodiscard]] storage::Result<LoadedMap> load(const fs::path& path,
                                                const MapFileLimits& limits = {}) const {
    return load_map(path, world_.camera(), limits);
  }
  /// What `load` says of these bytes.
  [[nodiscard]] storage::Status status_of(const std::string& bytes) const {
    write_text(file("other.mcap"), bytes);
    return load(file("other.mcap")).status();
  }

  /// The file again, its messages changed by `change`, with checksums that are right; without what
  /// is of the type `left_out`.
  using Change = std::function<void(const std::string& type, std::string& message)>;
  [[nodiscard]] storage::Status status_of_forged(const Change& change,
                                                 const std::string& left_out = "") const {
    const auto source = storage::FileSource::open(file());
    storage::McapStreamReader reader(**source);
    storage::ByteBuffer buffer;
    storage::McapWriterOptions options;
    options.profile = "camvox_map";
    storage::McapWriter writer(options);
    EXPECT_TRUE(writer.open(std::make_unique<storage::MemorySink>(buffer)).ok());
    std::map<std::uint16_t, std::string> types;
    while (const auto* record = reader.next()) {
      const auto* schema = std::get_if<storage::Schema>(record);
      const auto* channel = std::get_if<storage::Channel>(record);
      const auto* message = std::get_if<storage::Message>(record);
      if (schema != nullptr && schema->name.ends_with("/" + left_out)) continue;
      if (channel != nullptr && channel->schema_id != 0 && !types.contains(channel->schema_id)) {
        continue;
      }
      if (message != nullptr && !types.contains(message->channel_id)) continue;
      if (schema != nullptr && schema->id != 0) (void)writer.add_schema(*schema);
      if (schema != nullptr) types[schema->id] = schema->name.substr(15);
      if (channel != nullptr) (void)writer.add_channel(*channel);
      if (message == nullptr) continue;
      std::string content(storage::as_text(message->data));
      change(types.at(message->channel_id), content);
      auto forged = *message;
      forged.data = storage::as_bytes(content);
      EXPECT_TRUE(writer.write(forged).ok());
    }
    EXPECT_TRUE(writer.close().ok());
    return status_of(std::string(storage::as_text(buffer.view())));
  }

  MappingWorld world_;
  fs::path folder_;
};

template <typename T>
void put(std::string& message, std::size_t at, T value) {
  std::memcpy(message.data() + 4 + at, &value, sizeof(value));
}

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same_pose(const geometry::SE3& a, const geometry::SE3& b) {
  EXPECT_EQ(a.translation(), b.translation());
  EXPECT_EQ(a.rotation().quaternion().coeffs(), b.rotation().quaternion().coeffs());
}

void expect_same_keyframe(const MapKeyframe& a, const MapKeyframe& b) {
  EXPECT_EQ(a.parent, b.parent);
  EXPECT_EQ(a.children, b.children);
  EXPECT_EQ(a.shared, b.shared);
  EXPECT_EQ(a.frame.frame_id, b.frame.frame_id);
  EXPECT_EQ(a.frame.stamp_ns, b.frame.stamp_ns);
  EXPECT_EQ(a.frame.map_epoch, b.frame.map_epoch);
  EXPECT_EQ(a.frame.parent_id, b.frame.parent_id);
  expect_same_pose(a.frame.T_map_camera, b.frame.T_map_camera);
  expect_same_pose(a.frame.T_parent_camera, b.frame.T_parent_camera);
  EXPECT_EQ(a.frame.covariance_camera, b.frame.covariance_camera);
  EXPECT_EQ(a.frame.landmark_ids, b.frame.landmark_ids);
  const auto &one = a.frame.features, &two = b.frame.features;
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one.key_points[i].u_px, two.key_points[i].u_px);
    EXPECT_EQ(one.key_points[i].angle_rad, two.key_points[i].angle_rad);
    EXPECT_EQ(one.key_points[i].response, two.key_points[i].response);
    EXPECT_EQ(one.key_points[i].octave, two.key_points[i].octave);
  }
  EXPECT_EQ(one.undistorted_px, two.undistorted_px);
  EXPECT_EQ(one.descriptors, two.descriptors);
  EXPECT_TRUE(same_bytes(one.depth_m, two.depth_m));
  EXPECT_TRUE(same_bytes(one.depth_sigma_m, two.depth_sigma_m));
}

TEST_F(MapFileTest, ComesBackToTheBit) {
  auto mapper = drive(world_, 12);
  LoopProposal proposal{mapper.epoch(), 12, 1, {}};
  proposal.poses[12] = mapper.map().keyframe(12).frame.T_map_camera;
  ASSERT_EQ(mapper.correct(proposal), "");
  save(mapper);
  const auto loaded = load(file());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->epoch, 1U);
  const auto &before = mapper.map(), &after = loaded->map;
  ASSERT_EQ(before.keyframes().size(), after.keyframes().size());
  for (const auto& [id, keyframe] : before.keyframes()) {
    expect_same_keyframe(keyframe, after.keyframe(id));
  }
  ASSERT_EQ(before.landmark_ids(), after.landmark_ids());
  for (const auto id : before.landmark_ids()) {
    const auto &one = before.landmark(id), &two = after.landmark(id);
    EXPECT_EQ(one.landmark.p_map, two.landmark.p_map);
    EXPECT_EQ(one.landmark.f_map, two.landmark.f_map);
    EXPECT_EQ(one.landmark.min_distance_m, two.landmark.min_distance_m);
    EXPECT_EQ(one.landmark.max_distance_m, two.landmark.max_distance_m);
    EXPECT_EQ(one.landmark.sigma_m, two.landmark.sigma_m);
    EXPECT_EQ(one.landmark.descriptor, two.landmark.descriptor);
    EXPECT_EQ(one.observations, two.observations);
    EXPECT_EQ(one.born_at, two.born_at);
    EXPECT_EQ(one.visible, two.visible);
    EXPECT_EQ(one.found, two.found);
  }
}

TEST_F(MapFileTest, SameMapSameBytesAlsoAfterLoading) {
  const auto mapper = drive(world_, 8);
  save(mapper);
  const auto bytes = read_text(file());
  save(mapper);
  EXPECT_EQ(bytes, read_text(file()));
  const auto loaded = load(file());
  ASSERT_TRUE(loaded.ok());
  ASSERT_TRUE(save_map(file("again.mcap"), loaded->map, loaded->epoch, world_.camera()).ok());
  EXPECT_EQ(bytes, read_text(file("again.mcap")));
}

// What comes next must not depend on whether the map was saved and loaded in between.
TEST_F(MapFileTest, MappingGoesOnAsIfNothingHadHappened) {
  auto mapper = drive(world_, 8);
  save(mapper);
  auto loaded = load(file());
  ASSERT_TRUE(loaded.ok());
  Mapper resumed({}, world_.camera());
  resumed.restore(std::move(loaded->map), loaded->epoch, std::move(loaded->loop_ends));
  for (int i = 8; i < 11; ++i) {
    const auto keyframe = world_.look(MappingWorld::on_street(i), mapper);
    ASSERT_TRUE(mapper.process(keyframe).inserted);
    ASSERT_TRUE(resumed.process(keyframe).inserted);
  }
  EXPECT_EQ(mapper.map().landmark_ids(), resumed.map().landmark_ids());
  expect_same_pose(mapper.map().keyframe(11).frame.T_map_camera,
                   resumed.map().keyframe(11).frame.T_map_camera);
}

TEST_F(MapFileTest, AnEmptyMapIsAMap) {
  save(Mapper({}, world_.camera()));
  const auto loaded = load(file());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_TRUE(loaded->map.keyframes().empty());
}

// The schemas in the file are what any tool decodes it by.
TEST_F(MapFileTest, ItsSchemasDescribeItsMessages) {
  const auto mapper = drive(world_, 3);
  save(mapper);
  const auto reader = storage::McapIndexedReader::open(file());
  ASSERT_TRUE(reader.ok());
  auto cursor = (*reader)->messages();
  std::int64_t keyframes = 0, landmarks = 0;
  while (const auto* message = cursor.next()) {
    const auto& schema = (*reader)->summary().schemas.at(cursor.channel().schema_id);
    const auto parsed = storage::MessageSchema::parse(schema.name, schema.data);
    ASSERT_TRUE(parsed.ok()) << parsed.status().message();
    const auto value = storage::decode_cdr(*parsed, message->data);
    ASSERT_TRUE(value.ok()) << value.status().message();
    if (schema.name == "camvox_map/msg/Keyframe") {
      ++keyframes;
      const auto id = static_cast<KeyframeId>(*value->at("id")->as_integer());
      const auto& frame = mapper.map().keyframe(id).frame;
      EXPECT_EQ(value->at("map_camera[2]")->as_double(), frame.T_map_camera.translation().z());
      EXPECT_EQ(value->at("features[6]")->as_double(), frame.features.key_points[1].u_px);
    } else if (schema.name == "camvox_map/msg/LoopEnds") {
      EXPECT_EQ(std::get<storage::CdrArray>(value->at("keyframe_ids")->data).size(), 0U);
    } else if (schema.name == "camvox_map/msg/Landmarks") {
      landmarks +=
          static_cast<std::int64_t>(std::get<storage::CdrArray>(value->at("ids")->data).size());
    } else {
      EXPECT_EQ(value->at("keyframes")->as_integer(), 3);
      EXPECT_EQ(value->at("pinhole_px[0]")->as_double(), 700.0);
    }
  }
  EXPECT_TRUE(cursor.status().ok());
  EXPECT_EQ(keyframes, 3);
  EXPECT_EQ(landmarks, static_cast<std::int64_t>(mapper.map().landmark_count()));
}

TEST_F(MapFileTest, EveryTruncationIsRefused) {
  save(drive(world_, 2));
  const auto bytes = read_text(file());
  for (std::size_t size = 0; size < bytes.size(); size += size < 200 ? 1 : 1999) {
    EXPECT_FALSE(status_of(bytes.substr(0, size)).ok()) << "of " << size << " bytes";
  }
  EXPECT_FALSE(status_of(bytes.substr(0, bytes.size() - 1)).ok());
}

TEST_F(MapFileTest, EveryFlippedByteIsRefused) {
  save(drive(world_, 2));
  const auto bytes = read_text(file());
  for (std::size_t i = 0; i < bytes.size(); i += (i < 200 || i + 600 > bytes.size()) ? 1 : 1999) {
    auto damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x41);
    EXPECT_FALSE(status_of(damaged).ok()) << "at " << i << " of " << bytes.size();
  }
}

TEST_F(MapFileTest, SaysWhatIsWrongWithAForeignFile) {
  const auto missing = load(file("none.mcap")).status();
  EXPECT_EQ(missing.code(), StatusCode::kIo);
  EXPECT_THAT(missing.message(), HasSubstr("none.mcap"));
  EXPECT_THAT(status_of("").message(), HasSubstr("cannot be loaded"));
  EXPECT_THAT(status_of(std::string(1000, 'x')).message(), HasSubstr("not an MCAP file"));
  storage::ByteBuffer buffer;
  storage::McapWriter writer;
  ASSERT_TRUE(writer.open(std::make_unique<storage::MemorySink>(buffer)).ok());
  ASSERT_TRUE(writer.close().ok());
  EXPECT_THAT(status_of(std::string(storage::as_text(buffer.view()))).message(),
              HasSubstr("not a map (its profile is 'ros2')"));
}

TEST_F(MapFileTest, RefusesAMapOfAnotherCamera) {
  save(drive(world_, 2));
  auto camera = world_.camera();
  camera.pinhole.fx_px += 1.0;
  const auto status = load_map(file(), camera).status();
  EXPECT_EQ(status.code(), StatusCode::kInvalid);
  EXPECT_THAT(status.message(), HasSubstr("another camera: fx_px 700.0"));
}

TEST_F(MapFileTest, RefusesWhatIsOverTheLimits) {
  save(drive(world_, 4));
  EXPECT_EQ(load(file(), {.keyframes = 3}).status().code(), StatusCode::kLimit);
  EXPECT_EQ(load(file(), {.memory_bytes = 100'000}).status().code(), StatusCode::kLimit);
  const auto bytes = drive(world_, 4).map().memory_bytes();
  EXPECT_TRUE(load(file(), {.memory_bytes = 2 * bytes}).ok());
}

TEST_F(MapFileTest, RefusesForgedContent) {
  save(drive(world_, 3));
  const auto forged = [&](const char* which, const std::function<void(std::string&)>& change) {
    return status_of_forged([&](const std::string& type, std::string& message) {
             if (type == which) change(message);
           })
        .message();
  };
  EXPECT_EQ(forged("", [](std::string&) {}), "") << "the forger itself is at fault";
  EXPECT_THAT(forged("Header", [](auto& m) { put<std::uint32_t>(m, 0, 3); }),
              HasSubstr("a map of version 3; this program reads versions 1 to 2"));
  EXPECT_THAT(forged("Header", [](auto& m) { put<std::uint64_t>(m, 64, ~0ULL); }),
              HasSubstr("keyframes; at most 65536"));
  EXPECT_THAT(forged("Header", [](auto& m) { put<std::uint64_t>(m, 64, 5); }),
              HasSubstr("parts of it are missing"));
  EXPECT_THAT(forged("Keyframe", [](auto& m) { put<std::uint64_t>(m, 0, 7); }),
              HasSubstr("keyframe 7 comes twice"));
  EXPECT_THAT(forged("Keyframe", [](auto& m) { put<std::uint64_t>(m, 8, 77); }),
              HasSubstr("before its parent"));
  EXPECT_THAT(forged("Keyframe", [](auto& m) { put(m, 48, std::nan("")); }),
              HasSubstr("has a pose that is none"));
  EXPECT_THAT(forged("Landmarks", [](auto& m) { put<std::uint32_t>(m, 0, 0xFFFFFFF0U); }),
              HasSubstr("another length than it should be"));
  EXPECT_THAT(forged("Landmarks", [](auto& m) { m += '\0'; }),
              HasSubstr("another length than it should be"));
  EXPECT_THAT(forged("Landmarks",
                     [](auto& m) {
                       std::uint32_t last = 5000;  // the last observation's feature
                       put(m, m.size() - 8, last);
                     }),
              HasSubstr("that is not there"));
}

TEST_F(MapFileTest, RefusesForgedLoopEnds) {
  auto mapper = drive(world_, 3);
  LoopProposal loop{mapper.epoch(), 3, 1, {}, true};
  loop.poses[3] = mapper.map().keyframe(3).frame.T_map_camera;
  ASSERT_EQ(mapper.correct(loop), "");
  save(mapper);
  EXPECT_EQ(load(file())->loop_ends, (std::set<KeyframeId>{1, 3}));
  const auto forged = [&](const std::function<void(std::string&)>& change) {
    return status_of_forged([&](const std::string& type, std::string& message) {
             if (type == "LoopEnds") change(message);
           })
        .message();
  };
  EXPECT_THAT(forged([](auto& m) { put<std::uint64_t>(m, 16, 77); }),
              HasSubstr("a loop ends at keyframe 77, not there"));
  EXPECT_THAT(forged([](auto& m) { put<std::uint32_t>(m, 0, 9); }),
              HasSubstr("loop ends: another length than it should be"));
}

// As it was written before loop ends were.
TEST_F(MapFileTest, ReadsVersion1) {
  const auto mapper = drive(world_, 3);
  save(mapper);
  const auto status = status_of_forged(
      [](const std::string& type, std::string& message) {
        if (type == "Header") put<std::uint32_t>(message, 0, 1);
      },
      "LoopEnds");
  ASSERT_TRUE(status.ok()) << status.message();
  const auto loaded = load(file("other.mcap"));
  EXPECT_EQ(loaded->map.landmark_ids(), mapper.map().landmark_ids());
  EXPECT_TRUE(loaded->loop_ends.empty());
}

// Whatever the bytes, the answer is a map or a reason; never a crash. Run it with sanitizers.
TEST_F(MapFileTest, SurvivesAnyForgedByte) {
  MappingWorld small({.points = 60});
  Mapper mapper = drive(small, 3);
  save(mapper);
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    const auto status = status_of_forged([&](const std::string&, std::string& message) {
      for (int k = 0; k < 2; ++k) message[random() % message.size()] = static_cast<char>(random());
    });
    if (status.ok()) continue;  // a number that may be any
    EXPECT_THAT(status.message(), HasSubstr("cannot be loaded: "));
  }
}

TEST_F(MapFileTest, AFailedSaveLeavesTheOldFile) {
  save(drive(world_, 2));
  const auto bytes = read_text(file());
  fs::create_directories(file("map.mcap.part") / "in the way");
  const auto status = save_map(file(), {}, 0, world_.camera());
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(), HasSubstr("map.mcap: the map cannot be saved"));
  EXPECT_EQ(bytes, read_text(file()));
}

}  // namespace
}  // namespace camvox::mapping
