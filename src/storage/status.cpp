#include "camvox/storage/status.hpp"

namespace camvox::storage {

std::string_view to_string(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return "ok";
    case StatusCode::kIo:
      return "input/output error";
    case StatusCode::kTruncated:
      return "truncated";
    case StatusCode::kBadMagic:
      return "not an MCAP file";
    case StatusCode::kCorrupt:
      return "corrupt";
    case StatusCode::kCrcMismatch:
      return "CRC mismatch";
    case StatusCode::kLimit:
      return "over the limit";
    case StatusCode::kUnsupported:
      return "unsupported";
    case StatusCode::kInvalid:
      return "invalid request";
  }
  return "unknown";
}

}  // namespace camvox::storage
