#include "camvox/component/background_thread.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace camvox {
namespace {

int own_nice() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(BackgroundThread, GivesWayAloneOfItsProcess) {
  const int before = own_nice();
  int inside = 0;
  std::thread([&] {
    make_background_thread();
    inside = own_nice();
  }).join();
  EXPECT_EQ(inside, std::max(before, kBackgroundNice));
  EXPECT_EQ(own_nice(), before);
}

TEST(BackgroundThread, ANicerOneStaysSo) {
  int inside = 0;
  std::thread([&] {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 15);
    make_background_thread();
    inside = own_nice();
  }).join();
  EXPECT_GE(inside, 15);
}

}  // namespace
}  // namespace camvox
