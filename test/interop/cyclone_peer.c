/* The other vendor's side of the interop test: `cyclone_peer <domain> publish|subscribe`. */
#include <string.h>

#include "camvox_peer.h"
#include "cyclone_common.h"
#include "pattern.h"

typedef sensor_msgs_msg_dds__Imu_ Imu;
typedef sensor_msgs_msg_dds__PointCloud2_ PointCloud2;
typedef camvox_interfaces_msg_dds__Cloud_ Cloud;

/* Every double of the message, in the order of its definition. */
static void imu_doubles(Imu* imu, double* all[kImuDoubles]) {
  double** next = all;
  *next++ = &imu->orientation.x;
  *next++ = &imu->orientation.y;
  *next++ = &imu->orientation.z;
  *next++ = &imu->orientation.w;
  for (int i = 0; i < 9; ++i) *next++ = &imu->orientation_covariance[i];
  *next++ = &imu->angular_velocity.x;
  *next++ = &imu->angular_velocity.y;
  *next++ = &imu->angular_velocity.z;
  for (int i = 0; i < 9; ++i) *next++ = &imu->angular_velocity_covariance[i];
  *next++ = &imu->linear_acceleration.x;
  *next++ = &imu->linear_acceleration.y;
  *next++ = &imu->linear_acceleration.z;
  for (int i = 0; i < 9; ++i) *next++ = &imu->linear_acceleration_covariance[i];
  CHECK(next == all + kImuDoubles);
}

static void fill_header(std_msgs_msg_dds__Header_* header, int m) {
  header->stamp.sec = pattern_sec(m);
  header->stamp.nanosec = pattern_nanosec(m);
  header->frame_id = (char*)kFrame;
}

static void check_header(const std_msgs_msg_dds__Header_* header, int m) {
  CHECK(header->stamp.sec == pattern_sec(m));
  CHECK(header->stamp.nanosec == pattern_nanosec(m));
  CHECK(strcmp(header->frame_id, kFrame) == 0);
}

static void publish_imu(dds_entity_t writer, int m) {
  Imu imu;
  double* all[kImuDoubles];
  fill_header(&imu.header, m);
  imu_doubles(&imu, all);
  for (int i = 0; i < kImuDoubles; ++i) *all[i] = pattern_double(m, i);
  CHECK(dds_write(writer, &imu) == 0);
}

static void check_imu(void* message, int m) {
  Imu* imu = message;
  double* all[kImuDoubles];
  check_header(&imu->header, m);
  imu_doubles(imu, all);
  for (int i = 0; i < kImuDoubles; ++i) CHECK(*all[i] == pattern_double(m, i));
}

static void publish_lidar(dds_entity_t writer, int m) {
  sensor_msgs_msg_dds__PointField_ fields[kPointFields];
  for (int i = 0; i < kPointFields; ++i) {
    fields[i].name = (char*)kFieldNames[i];
    fields[i].offset = kFieldOffsets[i];
    fields[i].datatype = kFieldTypes[i];
    fields[i].count = 1;
  }
  PointCloud2 cloud = {.height = 1, .width = kPoints, .point_step = kPointBytes, .is_dense = true};
  fill_header(&cloud.header, m);
  cloud.row_step = kPoints * kPointBytes;
  cloud.fields._length = cloud.fields._maximum = kPointFields;
  cloud.fields._buffer = fields;
  cloud.data._length = cloud.data._maximum = cloud.row_step;
  cloud.data._buffer = malloc(cloud.row_step);
  for (uint32_t i = 0; i < cloud.row_step; ++i) cloud.data._buffer[i] = pattern_byte(m, i);
  CHECK(dds_write(writer, &cloud) == 0);
  free(cloud.data._buffer);
}

static void check_lidar(void* message, int m) {
  const PointCloud2* cloud = message;
  check_header(&cloud->header, m);
  CHECK(cloud->height == 1 && cloud->width == kPoints);
  CHECK(cloud->point_step == kPointBytes && cloud->row_step == kPoints * kPointBytes);
  CHECK(cloud->is_dense && !cloud->is_bigendian);
  CHECK(cloud->fields._length == kPointFields);
  for (int i = 0; i < kPointFields; ++i) {
    const sensor_msgs_msg_dds__PointField_* field = &cloud->fields._buffer[i];
    CHECK(strcmp(field->name, kFieldNames[i]) == 0);
    CHECK(field->offset == kFieldOffsets[i] && field->datatype == kFieldTypes[i]);
    CHECK(field->count == 1);
  }
  CHECK(cloud->data._length == cloud->row_step);
  for (uint32_t i = 0; i < cloud->row_step; ++i) {
    CHECK(cloud->data._buffer[i] == pattern_byte(m, i));
  }
}

static void publish_internal(dds_entity_t writer, int m) {
  static float points[kInternalPoints * 4];
  for (uint32_t i = 0; i < kInternalPoints * 4; ++i) points[i] = pattern_float(m, i);
  Cloud cloud = {.deskew = 1, .stationary = 1};
  cloud.header.stamp_ns = pattern_sec(m) * (int64_t)1000000000;
  cloud.header.frame_id = (uint64_t)m + 1;
  for (int i = 0; i < 3; ++i) cloud.angular_velocity_lidar[i] = pattern_double(m, i);
  for (int i = 0; i < 3; ++i) cloud.velocity_lidar[i] = pattern_double(m, 3 + i);
  for (int i = 0; i < 4; ++i) cloud.rotation_imu[i] = pattern_double(m, 6 + i);
  cloud.points._length = cloud.points._maximum = kInternalPoints * 4;
  cloud.points._buffer = points;
  CHECK(dds_write(writer, &cloud) == 0);
}

static void check_internal(void* message, int m) {
  const Cloud* cloud = message;
  CHECK(cloud->header.stamp_ns == pattern_sec(m) * (int64_t)1000000000);
  CHECK(cloud->header.frame_id == (uint64_t)m + 1);
  for (int i = 0; i < 3; ++i) CHECK(cloud->angular_velocity_lidar[i] == pattern_double(m, i));
  for (int i = 0; i < 3; ++i) CHECK(cloud->velocity_lidar[i] == pattern_double(m, 3 + i));
  for (int i = 0; i < 4; ++i) CHECK(cloud->rotation_imu[i] == pattern_double(m, 6 + i));
  CHECK(cloud->deskew == 1 && cloud->stationary == 1);
  CHECK(cloud->points._length == kInternalPoints * 4);
  for (uint32_t i = 0; i < cloud->points._length; ++i) {
    CHECK(cloud->points._buffer[i] == pattern_float(m, i));
  }
}

static bool is_primer(const void* header) {
  return ((const std_msgs_msg_dds__Header_*)header)->stamp.sec == pattern_sec(kPrimer);
}

static bool is_internal_primer(const void* header) {
  return ((const camvox_interfaces_msg_dds__MessageHeader_*)header)->frame_id == 0;
}

struct channel {
  const char* topic;
  const dds_topic_descriptor_t* type;
  void (*publish)(dds_entity_t, int);
  void (*check)(void*, int);
  bool (*is_primer)(const void*);
};

static const struct channel kChannels[] = {
    {"rt/livox/imu", &sensor_msgs_msg_dds__Imu__desc, publish_imu, check_imu, is_primer},
    {"rt/livox/lidar",
     &sensor_msgs_msg_dds__PointCloud2__desc,
     publish_lidar,
     check_lidar,
     is_primer},
    {"rt/camvox/cloud",
     &camvox_interfaces_msg_dds__Cloud__desc,
     publish_internal,
     check_internal,
     is_internal_primer}};
enum { kChannelCount = sizeof kChannels / sizeof kChannels[0] };

static void publish_all(dds_entity_t participant) {
  dds_entity_t writers[kChannelCount];
  for (int c = 0; c < kChannelCount; ++c) {
    writers[c] = make_writer(participant, kChannels[c].type, kChannels[c].topic);
  }
  for (int c = 0; c < kChannelCount; ++c) wait_for_reader(writers[c]);
  for (int m = 0; m < kMessages; ++m) {
    for (int c = 0; c < kChannelCount; ++c) kChannels[c].publish(writers[c], m);
  }
  for (int c = 0; c < kChannelCount; ++c) CHECK(dds_wait_for_acks(writers[c], kPatience) == 0);
  finish("published");
}

struct inbox {
  dds_entity_t reader;
  const struct channel* channel;
  bool hears;
  int seen;
};

static void take_and_check(struct inbox* inbox) {
  void* sample = NULL;
  dds_sample_info_t info;
  while (dds_take(inbox->reader, &sample, &info, 1, 1) == 1) {
    inbox->hears = true;
    if (info.valid_data && !inbox->channel->is_primer(sample)) {
      inbox->channel->check(sample, inbox->seen++);
    }
    CHECK(dds_return_loan(inbox->reader, &sample, 1) == 0);
    sample = NULL;
  }
}

/* Reads until every channel has heard something, or has seen all messages. */
static void read_all(struct inbox* inboxes, bool until_seen) {
  const dds_time_t deadline = dds_time() + kPatience;
  int complete = 0;
  while (complete < kChannelCount && dds_time() < deadline) {
    complete = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      take_and_check(&inboxes[c]);
      complete += until_seen ? inboxes[c].seen == kMessages : inboxes[c].hears;
    }
    dds_sleepfor(DDS_MSECS(1));
  }
  for (int c = 0; c < kChannelCount; ++c) {
    printf("%s: hears %d, seen %d\n", kChannels[c].topic, inboxes[c].hears, inboxes[c].seen);
  }
  CHECK(complete == kChannelCount);
}

static void subscribe_all(dds_entity_t participant) {
  struct inbox inboxes[kChannelCount] = {0};
  dds_qos_t* qos = reliable_qos();
  for (int c = 0; c < kChannelCount; ++c) {
    const dds_entity_t topic = make_topic(participant, kChannels[c].type, kChannels[c].topic);
    inboxes[c].channel = &kChannels[c];
    inboxes[c].reader = dds_create_reader(participant, topic, qos, NULL);
    CHECK(inboxes[c].reader > 0);
  }
  dds_delete_qos(qos);
  read_all(inboxes, false);
  printf("hears all\n");
  fflush(stdout);
  read_all(inboxes, true);
  finish("received");
}

int main(int argc, char** argv) {
  CHECK(argc == 3);
  const dds_entity_t participant =
      dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL);
  CHECK(participant > 0);
  if (strcmp(argv[2], "publish") == 0) {
    publish_all(participant);
  } else {
    subscribe_all(participant);
  }
  dds_delete(participant);
  return 0;
}
