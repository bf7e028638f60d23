#include "camvox/test/dds_domain.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>

namespace camvox::test {
namespace {

// Domain d uses the ports 7400 + 250 d to 7649 + 250 d; above 100 they meet the ephemeral ones.
constexpr int kFirstDomain = 20;
constexpr int kLastDomain = 99;

int reserve_domain() {
  for (int domain = kFirstDomain; domain <= kLastDomain; ++domain) {
    const auto path = std::filesystem::temp_directory_path() /
                      ("camvox_test_domain_" + std::to_string(domain) + ".lock");
    const int file = open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return domain;  // kept until exit
    if (file >= 0) close(file);
  }
  throw std::runtime_error("no free DDS domain for this test");
}

}  // namespace

int own_domain() {
  static const int domain = reserve_domain();
  return domain;
}

}  // namespace camvox::test
