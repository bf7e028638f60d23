// The other process of the DDS tests: `dds_child <domain> <transport> <mode>`. Tells what happens
// on standard output, one fact a line, and does what it is told on standard input.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <deque>
#include <iostream>

#include "camvox/dds/shared_memory.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::Extrinsics;
using camvox_interfaces::msg::FrameImage;
using std::chrono_literals::operator""ms;

constexpr Port kCloudPort{"cloud", topics::kCloud};
constexpr Port kExtrinsicsPort{"extrinsics", topics::kExtrinsics};
constexpr Port kImagePort{"image", topics::kFrameImage};

void say(const std::string& fact) {
  std::puts(fact.c_str());
  std::fflush(stdout);
}

std::string next_order() {
  std::string line;
  return std::getline(std::cin, line) ? line : "quit";
}

void wait_for_quit() {
  while (next_order() != "quit") {
  }
}

dds::ParticipantOptions options_for(int domain_id, const std::string& transport) {
  dds::ParticipantOptions options;
  options.name = "child";
  options.domain_id = domain_id;
  options.udp = transport != "shm";
  options.shared_memory = transport != "udp";
  return options;
}

dds::TopicSettingsMap shared_topics() {
  dds::TopicSettings shared;
  shared.interprocess_zero_copy = true;
  return {{std::string(topics::kCloud), shared}, {std::string(topics::kFrameImage), shared}};
}

/// A writer may know this reader before the reader knows the writer; until then nothing arrives.
void say_when_matched(const Subscription& subscription) {
  say("ready");
  if (test::wait_until([&] { return subscription->publisher_count() > 0; })) say("matched");
}

/// Tells the size of every message on the wire.
void measure(test::TestContainer& container) {
  const auto subscription = container.component().subscribe_raw(
      kCloudPort, "camvox_interfaces/msg/Cloud", [](const Sample<RawMessage>& message) {
        say(fmt::format("bytes {}", message->cdr.size()));
      });
  container.activate();
  say_when_matched(subscription);
  wait_for_quit();
}

/// Reads clouds and tells each one's frame and number of points.
void read(test::TestContainer& container) {
  const auto subscription =
      container.component().subscribe<Cloud>(kCloudPort, [](const Sample<Cloud>& cloud) {
        say(fmt::format("frame {} points {}", cloud->header().frame_id(), cloud->points_count()));
      });
  container.activate();
  say_when_matched(subscription);
  wait_for_quit();
}

/// Keeps the first cloud and looks at it whenever told to.
void hold(test::TestContainer& container) {
  auto& context = container.component();
  std::deque<Sample<Cloud>> held;
  const auto subscription =
      context.subscribe<Cloud>(kCloudPort, [&held](const Sample<Cloud>& cloud) {
        if (!held.empty()) return;
        held.push_back(cloud);
        say(fmt::format("holding {}", cloud->points()[0][0]));
      });
  container.activate();
  say_when_matched(subscription);
  while (next_order() == "look") {
    context.post([&held] { say(fmt::format("seen {}", held.front()->points()[0][0])); });
  }
  container.remove(context);
}

/// Reads nothing any more after the first cloud: its callback does not return.
void stall(test::TestContainer& container) {
  const auto subscription =
      container.component().subscribe<Cloud>(kCloudPort, [](const Sample<Cloud>&) {
        say("stalled");
        wait_for_quit();
      });
  container.activate();
  say_when_matched(subscription);
  for (;;) pause();
}

/// Publishes small clouds, 100 a second, until told to quit.
void write(test::TestContainer& container) {
  auto& context = container.component();
  auto publisher = context.advertise<Cloud>(kCloudPort, {.qos = qos::kFrames});
  std::uint64_t frame = 0;
  context.every(10ms, [&] {
    auto cloud = publisher.loan();
    cloud->header().frame_id(++frame);
    cloud->points_count() = 10;
    publisher.publish(std::move(cloud));
  });
  container.activate();
  say("ready");
  wait_for_quit();
  container.remove(context);
}

void write_latched(test::TestContainer& container) {
  auto publisher =
      container.component().advertise<Extrinsics>(kExtrinsicsPort, {.qos = qos::kState});
  container.activate();
  for (std::uint64_t version = 1; version <= 3; ++version) {
    auto extrinsics = publisher.loan();
    extrinsics->version(version);
    publisher.publish(std::move(extrinsics));
  }
  say("ready");
  wait_for_quit();
}

/// A component that is there from the start, and one that comes when told to.
void read_latched(test::TestContainer& container) {
  const auto subscribe = [&container](const std::string& name) {
    container.component(name).subscribe<Extrinsics>(
        kExtrinsicsPort,
        [name](const Sample<Extrinsics>& extrinsics) {
          say(fmt::format("{} version {}", name, extrinsics->version()));
        },
        {.qos = qos::kState});
    container.activate();
  };
  subscribe("first");
  say("ready");
  while (next_order() == "again") subscribe("second");
}

/// Under the internal topic's type name: too short, wrong encapsulation, over capacity; then right.
void write_malformed(test::TestContainer& container) {
  auto publisher = container.component().advertise_raw(kCloudPort, "camvox_interfaces/msg/Cloud");
  container.activate();
  const auto cloud = std::make_unique<Cloud>();
  cloud->points_count() = 4;
  const auto good = interfaces::message_type<Cloud>().to_cdr(cloud.get());
  say("ready");
  if (!test::wait_until([&] { return publisher.subscriber_count() > 0; })) return;
  auto encapsulation = good;
  encapsulation[1] = 3;
  auto length = good;  // the length of the sequence stands before 4 x 4 floats
  length[length.size() - 64 - 1] = 0x7F;
  for (const auto& bytes : {std::vector<std::uint8_t>{0, 1, 0, 0}, encapsulation, length, good}) {
    publisher.publish(RawMessage{bytes});
  }
  say("written");
  wait_for_quit();
}

/// Removes stale shared memory, as a container does at its start.
void clean(test::TestContainer&) {
  for (const auto& name : dds::remove_stale_shared_memory()) say("removed " + name);
  say("cleaned");
}

/// Fills whole 8 MiB images in shared memory, more of them than can be in use at a time.
void write_images(test::TestContainer& container) {
  auto publisher = container.component().advertise<FrameImage>(kImagePort, {.qos = qos::kFrames});
  container.activate();
  say("ready");
  for (int i = 0; i < 20; ++i) {
    auto image = publisher.loan();
    image->data_count() = static_cast<std::uint32_t>(image->data().size());
    image->data().fill(1);
    publisher.publish(std::move(image));
  }
  say("written");
}

int run(const std::string& domain, const std::string& transport, const std::string& mode) {
  static const std::map<std::string, std::function<void(test::TestContainer&)>> kModes = {
      {"measure", measure},
      {"read", read},
      {"hold", hold},
      {"stall", stall},
      {"write", write},
      {"write_latched", write_latched},
      {"read_latched", read_latched},
      {"write_malformed", write_malformed},
      {"write_images", write_images},
      {"clean", clean}};
  const bool shared = transport == "shared";
  test::TestContainer container(options_for(std::stoi(domain), transport),
                                shared ? shared_topics() : dds::TopicSettingsMap{});
  kModes.at(mode)(container);
  for (const auto& error : container.errors()) say("error: " + error);
  return container.errors().empty() ? 0 : 3;
}

}  // namespace
}  // namespace camvox

int main(int argc, char** argv) {
  if (argc != 4) return 64;
  try {
    return camvox::run(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    camvox::say(std::string("fatal: ") + error.what());
    return 2;
  }
}
