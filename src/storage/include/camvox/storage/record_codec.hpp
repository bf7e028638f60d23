#pragma once

#include <optional>

#include "camvox/storage/records.hpp"

namespace camvox::storage {

/// Opcode (1 byte) and length (8 bytes) before each record.
inline constexpr std::size_t kRecordHeadSize = 9;
/// Fields of a message before its data.
inline constexpr std::size_t kMessageHeadSize = 22;
/// The footer record with its head; the closing magic follows.
inline constexpr std::size_t kFooterRecordSize = kRecordHeadSize + 20;

/// Content of a record -> struct; nothing when the content is too short or contradicts itself.
/// Extra bytes at the end are skipped, as the format asks for.
[[nodiscard]] std::optional<Record> decode_record(std::uint8_t opcode, Bytes content);

/// Only a message; without the variant, for the readers' inner loops.
[[nodiscard]] std::optional<Message> decode_message(Bytes content);

/// A chunk whose content was cut off: `records` is what is left of them. Nothing when even the
/// fields before them are incomplete.
[[nodiscard]] std::optional<Chunk> decode_cut_chunk(Bytes content);

/// Appends the whole record (head and content). A chunk, attachment or message is copied whole.
void encode_record(const Record& record, ByteBuffer& out);

/// The head of a record whose content is `length` bytes.
void encode_head(Opcode opcode, std::uint64_t length, ByteBuffer& out);

/// Everything of a chunk record before its `size` bytes of records (chunk.records is not looked
/// at).
void encode_chunk_head(const Chunk& chunk, std::uint64_t size, ByteBuffer& out);

/// Everything of a message record before its data.
void encode_message_head(const Message& message, ByteBuffer& out);

/// Everything of an attachment before its data; the record ends with data and CRC.
void encode_attachment_head(const Attachment& attachment, ByteBuffer& out);

}  // namespace camvox::storage
