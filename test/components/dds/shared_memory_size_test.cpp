#include <gmock/gmock.h>

#include <filesystem>

#include "camvox/dds/shared_memory.hpp"
#include "camvox/test/child_process.hpp"
#include "camvox/test/dds_domain.hpp"

namespace camvox {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Runs dds_child with a /dev/shm of that size, seen by no other process.
std::unique_ptr<test::ChildProcess> child_with_shared_memory(const std::string& size,
                                                             const std::string& transport,
                                                             const std::string& mode) {
  const std::string script = "mount -t tmpfs -o size=" + size +
                             " tmpfs /dev/shm || { echo not permitted; exit 77; }; exec \"$@\"";
  return std::make_unique<test::ChildProcess>(
      std::vector<std::string>{"unshare",
                               "--mount",
                               "--map-root-user",
                               "sh",
                               "-c",
                               script,
                               "sh",
                               DDS_CHILD,
                               std::to_string(test::own_domain()),
                               transport,
                               mode});
}

bool not_permitted(test::ChildProcess& child) {
  return child.wrote("not permitted", std::chrono::milliseconds(0)) ||
         child.wrote("unshare:", std::chrono::milliseconds(0));
}

TEST(SmallSharedMemory, StopsTheStartAndSaysHowMuchIsNeeded) {
  auto child = child_with_shared_memory("16m", "any", "read");
  const int result = child->wait();
  if (not_permitted(*child)) GTEST_SKIP() << "no private mounts here: " << child->output();
  EXPECT_EQ(result, 2) << child->output();
  EXPECT_THAT(child->output(),
              AllOf(HasSubstr("/dev/shm"), HasSubstr("16 MiB"), HasSubstr("66 MiB")));
}

TEST(SmallSharedMemory, IsEnoughWithoutSharedMemory) {
  auto child = child_with_shared_memory("64k", "udp", "read");
  const bool ready = child->wrote("ready");
  if (not_permitted(*child)) GTEST_SKIP() << "no private mounts here: " << child->output();
  EXPECT_TRUE(ready) << child->output();
  child->tell("quit");
  EXPECT_EQ(child->wait(), 0) << child->output();
}

// Fast DDS itself dies of SIGBUS when it touches memory that is not there.
TEST(SmallSharedMemory, ForAnInterprocessTopicIsAnErrorToo) {
  auto child = child_with_shared_memory("100m", "shared", "write_images");
  const int result = child->wait();
  if (not_permitted(*child)) GTEST_SKIP() << "no private mounts here: " << child->output();
  EXPECT_EQ(result, 2) << child->output();
  EXPECT_THAT(child->output(),
              AllOf(HasSubstr("/dev/shm"), HasSubstr("/camvox/frame_image"), HasSubstr("MiB")));
}

TEST(FreeSharedMemory, IsToldInBytes) {
  EXPECT_EQ(dds::free_shared_memory_bytes("/nowhere"), 0U);
  EXPECT_EQ(dds::free_shared_memory_bytes("/dev/shm"),
            std::filesystem::space("/dev/shm").available);
}

}  // namespace
}  // namespace camvox
