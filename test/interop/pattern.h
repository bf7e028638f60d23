/* What the messages of the interop test hold, computed alike on both sides. C and C++. */
#pragma once

#include <stdint.h>

enum {
  kPrimer = -1, /* sent until the reader says that it hears; Cyclone drops what a volatile reader */
                /* gets before a writer's first heartbeat */
  kMessages = 5,
  kImuDoubles = 37,
  kPointBytes = 26, /* Livox' ROS 2 driver, PointCloud2 */
  kPoints = 100000, /* 2.6 MB */
  kPointFields = 7,
  kInternalPoints = 1000
};

static const char* const kFrame = "livox_frame";
static const char* const kFieldNames[] = {"x", "y", "z", "intensity", "tag", "line", "timestamp"};
static const uint32_t kFieldOffsets[] = {0, 4, 8, 12, 16, 17, 18};
static const uint8_t kFieldTypes[] = {7, 7, 7, 7, 2, 2, 8};

static inline int32_t pattern_sec(int message) { return 1600000000 + message; }
static inline uint32_t pattern_nanosec(int message) { return 123456789u + (uint32_t)message; }
static inline double pattern_double(int message, int place) {
  return 1000.0 * message + place + 0.0625;
}
static inline float pattern_float(int message, uint32_t place) {
  return (float)message * 4096.0f + (float)place + 0.5f;
}
static inline uint8_t pattern_byte(int message, uint32_t place) {
  return (uint8_t)(place * 7u + place / 251u + (uint32_t)message);
}
