/* What the Cyclone DDS programs share. */
#pragma once

#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define CHECK(condition)                                     \
  do {                                                       \
    if (!(condition)) {                                      \
      printf("line %d: failed: %s\n", __LINE__, #condition); \
      fflush(stdout);                                        \
      exit(1);                                               \
    }                                                        \
  } while (0)

static const dds_duration_t kPatience = DDS_SECS(30);

static inline dds_qos_t* reliable_qos(void) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  return qos;
}

static inline dds_entity_t make_topic(dds_entity_t participant,
                                      const dds_topic_descriptor_t* type,
                                      const char* name) {
  const dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  CHECK(topic > 0);
  return topic;
}

static inline dds_entity_t make_writer(dds_entity_t participant,
                                       const dds_topic_descriptor_t* type,
                                       const char* name) {
  dds_qos_t* qos = reliable_qos();
  const dds_entity_t writer =
      dds_create_writer(participant, make_topic(participant, type, name), qos, NULL);
  CHECK(writer > 0);
  dds_delete_qos(qos);
  return writer;
}

static inline void wait_for_reader(dds_entity_t writer) {
  dds_publication_matched_status_t status = {0};
  const dds_time_t deadline = dds_time() + kPatience;
  while (status.current_count == 0 && dds_time() < deadline) {
    dds_get_publication_matched_status(writer, &status);
    dds_sleepfor(DDS_MSECS(5));
  }
  CHECK(status.current_count > 0);
}

/* Tells the test, and stays until it has seen enough: writers that go take their messages along. */
static inline void finish(const char* word) {
  printf("%s\n", word);
  fflush(stdout);
  char line[16];
  CHECK(fgets(line, sizeof line, stdin) != NULL);
}
