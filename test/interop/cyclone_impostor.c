/* Writes wrong contents under the right type names: `cyclone_impostor <domain>`. */
#include "camvox_impostor.h"
#include "cyclone_common.h"

typedef sensor_msgs_msg_dds__Imu_ Imu;
typedef camvox_interfaces_msg_dds__Cloud_ Cloud;

static void publish_floats(dds_entity_t writer, uint32_t count) {
  Cloud cloud = {.header = {.stamp_ns = 1, .frame_id = count}};
  cloud.points._length = cloud.points._maximum = count;
  cloud.points._buffer = calloc(count + 1, sizeof(float));
  CHECK(dds_write(writer, &cloud) == 0);
  free(cloud.points._buffer);
}

int main(int argc, char** argv) {
  CHECK(argc == 2);
  const dds_entity_t participant =
      dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL);
  CHECK(participant > 0);
  const dds_entity_t imu_writer =
      make_writer(participant, &sensor_msgs_msg_dds__Imu__desc, "rt/livox/imu");
  const dds_entity_t cloud_writer =
      make_writer(participant, &camvox_interfaces_msg_dds__Cloud__desc, "rt/camvox/cloud");
  wait_for_reader(imu_writer);
  wait_for_reader(cloud_writer);
  for (uint32_t i = 0; i < 3; ++i) {
    const Imu nonsense = {.nonsense = 0xFFFFFFFFu - i};
    CHECK(dds_write(imu_writer, &nonsense) == 0);
  }
  publish_floats(cloud_writer, 4 * (262144 + 1)); /* one point over SCAN_POINTS */
  publish_floats(cloud_writer, 5);      /* a point and a quarter */
  publish_floats(cloud_writer, 8);      /* the only good one */
  CHECK(dds_wait_for_acks(imu_writer, kPatience) == 0);
  CHECK(dds_wait_for_acks(cloud_writer, kPatience) == 0);
  finish("published");
  dds_delete(participant);
  return 0;
}
