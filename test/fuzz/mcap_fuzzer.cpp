/// libFuzzer target: any bytes go through every reader of the library. What it must never do is
/// crash, hang, or take more memory than the limits allow. How to run it: see CMakeLists.txt.
#include <cstdint>
#include <memory>

#include "camvox/storage/doctor.hpp"
#include "camvox/storage/indexed_reader.hpp"
#include "camvox/storage/recover.hpp"
#include "camvox/storage/stream_reader.hpp"

namespace camvox::storage {
namespace {

/// Small, so that a hidden allocation shows under libFuzzer's memory limit.
constexpr ReadLimits kLimits{
    .max_record_size = 1 << 20, .max_chunk_size = 1 << 20, .max_pending_messages = 1 << 16};

void stream(const Source& source, bool skip_bad_chunks) {
  McapStreamReader reader(
      source,
      {.limits = kLimits, .verify_crc = !skip_bad_chunks, .skip_bad_chunks = skip_bad_chunks});
  while (reader.next() != nullptr) {
  }
}

void read_by_index(Bytes bytes) {
  const auto reader = McapIndexedReader::open(
      std::make_unique<MemorySource>(bytes),
      {.limits = kLimits, .verify_crc = false, .skip_bad_chunks = true, .cache_size = 1 << 16});
  if (!reader.ok()) return;
  auto cursor = (*reader)->messages();
  while (cursor.next() != nullptr) (void)cursor.channel();
  const auto& summary = (*reader)->summary();
  for (const auto& index : summary.metadata_indexes) (void)(*reader)->metadata(index).ok();
  ByteBuffer scratch;
  for (const auto& index : summary.attachment_indexes) {
    (void)(*reader)->attachment(index, scratch).ok();
  }
}

/// What was recovered must be a file without errors of its own.
void recover_and_check(const Source& source) {
  ByteBuffer out;
  const auto result = recover(source,
                              std::make_unique<MemorySink>(out),
                              {.limits = kLimits, .writer = {}, .compression = {}});
  if (!result.status.ok()) return;
  const MemorySource recovered(out.view());
  const auto summary = read_summary(recovered, {});
  if (!summary.ok() || summary->statistics.message_count != result.statistics.message_count) {
    __builtin_trap();
  }
}

}  // namespace
}  // namespace camvox::storage

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace camvox::storage;
  const Bytes bytes = std::as_bytes(std::span(data, size));
  const MemorySource source(bytes);
  stream(source, false);
  stream(source, true);
  read_by_index(bytes);
  recover_and_check(source);
  (void)doctor(source, kLimits).has_errors();
  return 0;
}
