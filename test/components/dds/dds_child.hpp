#pragma once

#include <string>

#include "camvox/test/child_process.hpp"
#include "camvox/test/dds_domain.hpp"

namespace camvox::test {

/// Starts dds_child.cpp in this test's domain. Transports: "any", "udp", "shm", or "shared" for
/// any with zero_copy: interprocess.
inline ChildProcess start_child(const std::string& transport, const std::string& mode) {
  return ChildProcess({DDS_CHILD, std::to_string(own_domain()), transport, mode});
}

}  // namespace camvox::test
