#include "camvox/component/background_thread.hpp"

#include <sys/resource.h>
#include <unistd.h>

namespace camvox {

void make_background_thread() {
  // Linux keeps a nice value for each thread, under its thread identifier. Who is nicer already
  // stays so; a refusal costs nothing but the courtesy.
  const auto thread = static_cast<id_t>(gettid());
  if (getpriority(PRIO_PROCESS, thread) < kBackgroundNice) {
    setpriority(PRIO_PROCESS, thread, kBackgroundNice);
  }
}

}  // namespace camvox
