#include "camvox/storage/records.hpp"

#include <array>

namespace camvox::storage {

std::string_view to_string(Opcode opcode) {
  static constexpr std::array<std::string_view, 16> kNames = {"",
                                                              "Header",
                                                              "Footer",
                                                              "Schema",
                                                              "Channel",
                                                              "Message",
                                                              "Chunk",
                                                              "MessageIndex",
                                                              "ChunkIndex",
                                                              "Attachment",
                                                              "AttachmentIndex",
                                                              "Statistics",
                                                              "Metadata",
                                                              "MetadataIndex",
                                                              "SummaryOffset",
                                                              "DataEnd"};
  const auto index = static_cast<std::size_t>(opcode);
  return index > 0 && index < kNames.size() ? kNames[index] : "unknown record";
}

}  // namespace camvox::storage
