/// The MCAP conformance suite: each file has the records that it holds as JSON beside it.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <set>

#include "camvox/storage/indexed_reader.hpp"
#include "camvox/storage/stream_reader.hpp"
#include "camvox/storage/writer.hpp"
#include "mcap_files.hpp"

namespace camvox::storage {
namespace {

using Fields = std::map<std::string, std::string>;
using Line = std::pair<std::string, Fields>;  // type of the record, its fields as text

template <typename T>
requires std::is_integral_v<T> std::string text_of(T number) { return std::to_string(number); }
std::string text_of(Bytes bytes) {
  std::string text = "[";
  for (const std::byte b : bytes) text += std::to_string(std::to_integer<int>(b)) + ",";
  return text + "]";
}
std::string text_of(const Fields& map) {
  std::string text = "{";
  for (const auto& [key, value] : map) text += key + ":" + value + ",";
  return text + "}";
}
template <typename A>
std::string text_of(const std::vector<std::pair<A, std::uint64_t>>& pairs) {
  Fields map;
  for (const auto& [first, second] : pairs) map[text_of(first)] = text_of(second);
  return text_of(map);
}

/// The suite names these fields; other records (chunks, indexes) it does not list.
struct ToLine {
  Line operator()(const Header& r) const {
    return {"Header", {{"library", r.library}, {"profile", r.profile}}};
  }
  Line operator()(const Footer& r) const {
    return {"Footer",
            {{"summary_crc", text_of(r.summary_crc)},
             {"summary_offset_start", text_of(r.summary_offset_start)},
             {"summary_start", text_of(r.summary_start)}}};
  }
  Line operator()(const Schema& r) const {
    return {"Schema",
            {{"data", text_of(as_bytes(r.data))},
             {"encoding", r.encoding},
             {"id", text_of(r.id)},
             {"name", r.name}}};
  }
  Line operator()(const Channel& r) const {
    return {"Channel",
            {{"id", text_of(r.id)},
             {"message_encoding", r.message_encoding},
             {"metadata", text_of(r.metadata)},
             {"schema_id", text_of(r.schema_id)},
             {"topic", r.topic}}};
  }
  Line operator()(const Message& r) const {
    return {"Message",
            {{"channel_id", text_of(r.channel_id)},
             {"data", text_of(r.data)},
             {"log_time", text_of(r.log_time_ns)},
             {"publish_time", text_of(r.publish_time_ns)},
             {"sequence", text_of(r.sequence)}}};
  }
  Line operator()(const ChunkIndex& r) const {
    return {"ChunkIndex",
            {{"chunk_length", text_of(r.chunk_length)},
             {"chunk_start_offset", text_of(r.chunk_start_offset)},
             {"compressed_size", text_of(r.compressed_size)},
             {"compression", r.compression},
             {"message_end_time", text_of(r.message_end_time_ns)},
             {"message_index_length", text_of(r.message_index_length)},
             {"message_index_offsets", text_of(r.message_index_offsets)},
             {"message_start_time", text_of(r.message_start_time_ns)},
             {"uncompressed_size", text_of(r.uncompressed_size)}}};
  }
  Line operator()(const Attachment& r) const {
    return {"Attachment",
            {{"create_time", text_of(r.create_time_ns)},
             {"data", text_of(r.data)},
             {"log_time", text_of(r.log_time_ns)},
             {"media_type", r.media_type},
             {"name", r.name}}};
  }
  Line operator()(const AttachmentIndex& r) const {
    return {"AttachmentIndex",
            {{"create_time", text_of(r.create_time_ns)},
             {"data_size", text_of(r.data_size)},
             {"length", text_of(r.length)},
             {"log_time", text_of(r.log_time_ns)},
             {"media_type", r.media_type},
             {"name", r.name},
             {"offset", text_of(r.offset)}}};
  }
  Line operator()(const Statistics& r) const {
    return {"Statistics",
            {{"attachment_count", text_of(r.attachment_count)},
             {"channel_count", text_of(r.channel_count)},
             {"channel_message_counts", text_of(r.channel_message_counts)},
             {"chunk_count", text_of(r.chunk_count)},
             {"message_count", text_of(r.message_count)},
             {"message_end_time", text_of(r.message_end_time_ns)},
             {"message_start_time", text_of(r.message_start_time_ns)},
             {"metadata_count", text_of(r.metadata_count)},
             {"schema_count", text_of(r.schema_count)}}};
  }
  Line operator()(const Metadata& r) const {
    return {"Metadata", {{"metadata", text_of(r.metadata)}, {"name", r.name}}};
  }
  Line operator()(const MetadataIndex& r) const {
    return {"MetadataIndex",
            {{"length", text_of(r.length)}, {"name", r.name}, {"offset", text_of(r.offset)}}};
  }
  Line operator()(const SummaryOffset& r) const {
    return {"SummaryOffset",
            {{"group_length", text_of(r.group_length)},
             {"group_opcode", text_of(static_cast<int>(r.group_opcode))},
             {"group_start", text_of(r.group_start)}}};
  }
  Line operator()(const DataEnd& r) const {
    return {"DataEnd", {{"data_section_crc", text_of(r.data_section_crc)}}};
  }
  Line operator()(const Chunk&) const { return {"", {}}; }
  Line operator()(const MessageIndex&) const { return {"", {}}; }
  Line operator()(const UnknownRecord&) const { return {"", {}}; }
};

std::string text_of(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  if (node.IsSequence()) {
    std::string text = "[";
    for (const auto& item : node) text += item.Scalar() + ",";
    return text + "]";
  }
  Fields map;
  for (const auto& item : node) map[item.first.Scalar()] = item.second.Scalar();
  return text_of(map);
}

struct Expected {
  std::vector<Line> lines;
  std::set<std::string> features;
};

Expected read_expected(std::filesystem::path path) {
  const YAML::Node root = YAML::LoadFile(path.replace_extension(".json").string());
  Expected expected;
  for (const auto& record : root["records"]) {
    Fields fields;
    for (const auto& field : record["fields"]) fields[field[0].Scalar()] = text_of(field[1]);
    expected.lines.emplace_back(record["type"].Scalar(), fields);
  }
  for (const auto& name : root["meta"]["variant"]["features"]) {
    expected.features.insert(name.Scalar());
  }
  return expected;
}

class Conformance : public ::testing::Test {
 protected:
  void SetUp() override {
    files_ = files_under(recordings() / "conformance", ".mcap");
    if (files_.empty()) GTEST_SKIP() << "no conformance files in " << recordings();
    ASSERT_EQ(files_.size(), 416U);
  }
  std::vector<std::filesystem::path> files_;
};

TEST_F(Conformance, StreamReaderGivesTheRecordsOfAll416Files) {
  for (const auto& path : files_) {
    const std::string file = read_text(path);
    const MemorySource source(as_bytes(file));
    McapStreamReader reader(source);
    std::vector<Line> lines;
    while (const Record* record = reader.next()) {
      Line line = std::visit(ToLine(), *record);
      if (!line.first.empty()) lines.push_back(std::move(line));
    }
    EXPECT_TRUE(reader.status().ok()) << path << reader.status().message();
    EXPECT_TRUE(reader.problems().empty()) << path;
    EXPECT_EQ(lines, read_expected(path).lines) << path;
  }
}

/// Lines of one type, messages in order of their log time.
std::vector<Line> select(const std::vector<Line>& lines, const std::string& type) {
  std::vector<Line> selected;
  for (const auto& line : lines) {
    const bool repeated = std::find(selected.begin(), selected.end(), line) != selected.end();
    if (line.first == type && !(type == "Schema" && repeated)) selected.push_back(line);
  }
  if (type != "Message") return selected;
  std::stable_sort(selected.begin(), selected.end(), [](const Line& a, const Line& b) {
    return std::stoull(a.second.at("log_time")) < std::stoull(b.second.at("log_time"));
  });
  return selected;
}

/// The suite asks the indexed reader for messages, schemas and statistics, of files with all
/// indexes; the others must give the same after a scan.
TEST_F(Conformance, IndexedReaderGivesMessagesSchemasAndStatisticsOfAllFiles) {
  int indexed = 0;
  for (const auto& path : files_) {
    const auto reader = McapIndexedReader::open(path);
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    const auto expected = read_expected(path);
    std::vector<Line> messages;
    auto cursor = (*reader)->messages();
    while (const Message* message = cursor.next()) messages.push_back(ToLine()(*message));
    EXPECT_TRUE(cursor.status().ok()) << path << cursor.status().message();
    EXPECT_EQ(messages, select(expected.lines, "Message")) << path;
    std::vector<Line> schemas;
    for (const auto& [id, schema] : (*reader)->summary().schemas) {
      schemas.push_back(ToLine()(schema));
    }
    EXPECT_EQ(schemas, select(expected.lines, "Schema")) << path;
    const auto statistics = select(expected.lines, "Statistics");
    if (!statistics.empty()) {
      auto actual = ToLine()((*reader)->summary().statistics);
      EXPECT_EQ(actual, statistics[0]) << path;
    }
    const auto has = [&](const char* feature) { return expected.features.contains(feature); };
    if (!messages.empty() && has("ch") && has("chx") && has("rch") && has("rsh") && has("st")) {
      EXPECT_FALSE((*reader)->summary().rebuilt) << path;
      ++indexed;
    }
  }
  EXPECT_EQ(indexed, 16);
}

McapWriterOptions options_of(const std::set<std::string>& features) {
  McapWriterOptions options;
  options.profile = "";
  options.library = "";
  options.chunked = features.contains("ch");
  options.message_index = features.contains("mx");
  options.statistics = features.contains("st");
  options.repeat_schemas = features.contains("rsh");
  options.repeat_channels = features.contains("rch");
  options.attachment_index = features.contains("ax");
  options.metadata_index = features.contains("mdx");
  options.chunk_index = features.contains("chx");
  options.summary_offsets = features.contains("sum");
  return options;
}

/// Feeds the data section of a file (checked above against the JSON) to a writer.
struct Feed {
  McapWriter& writer;
  Status operator()(const Schema& r) const { return writer.add_schema(r); }
  Status operator()(const Channel& r) const { return writer.add_channel(r); }
  Status operator()(const Message& r) const { return writer.write(r); }
  Status operator()(const Attachment& r) const { return writer.write(r); }
  Status operator()(const Metadata& r) const { return writer.write(r); }
  template <typename T>
  Status operator()(const T&) const {
    return {};
  }
};

TEST_F(Conformance, WriterGivesTheSameBytesForEveryVariantWithoutPadding) {
  int count = 0;
  for (const auto& path : files_) {
    const auto features = read_expected(path).features;
    if (features.contains("pad")) continue;
    const std::string file = read_text(path);
    const MemorySource source(as_bytes(file));
    McapStreamReader reader(source);
    ByteBuffer out;
    McapWriter writer(options_of(features));
    ASSERT_TRUE(writer.open(std::make_unique<MemorySink>(out)).ok());
    while (const Record* record = reader.next()) {
      if (std::holds_alternative<DataEnd>(*record)) break;
      EXPECT_TRUE(std::visit(Feed{writer}, *record).ok());
    }
    ASSERT_TRUE(writer.close().ok());
    EXPECT_EQ(as_text(out.view()), file) << path;
    ++count;
  }
  EXPECT_EQ(count, 208);
}

}  // namespace
}  // namespace camvox::storage
