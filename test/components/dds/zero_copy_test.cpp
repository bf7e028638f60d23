#include <gmock/gmock.h>

#include <atomic>
#include <mutex>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using test::wait_until;
using ::testing::Each;
using ::testing::SizeIs;

constexpr Port kPort{"cloud", topics::kCloud};
constexpr int kRounds = 50;

/// Where a reader saw its messages, and what was in them.
class Eyes {
 public:
  void look(const Sample<Cloud>& cloud) {
    const std::lock_guard lock(mutex_);
    seen_.emplace_back(&*cloud, cloud->header().frame_id());
  }
  [[nodiscard]] std::vector<std::pair<const void*, std::uint64_t>> seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<const void*, std::uint64_t>> seen_;
};

/// Publishes one cloud at a time and expects every reader to have seen that very memory.
void expect_same_memory(Publisher<Cloud>& publisher, const std::deque<Eyes>& readers) {
  for (std::uint64_t round = 1; round <= kRounds; ++round) {
    auto cloud = publisher.loan();
    cloud->header().frame_id(round);
    const void* const address = &*cloud;
    publisher.publish(std::move(cloud));
    for (const auto& reader : readers) {
      ASSERT_TRUE(wait_until([&] { return reader.seen().size() == round; }));
      EXPECT_EQ(reader.seen().back(), (std::pair{address, round}));
    }
  }
}

struct Layout {
  int readers;
  int components;  ///< 1: all in the writer's own; 2: the readers in another one.
};

class ZeroCopy : public ::testing::TestWithParam<Layout> {};

TEST_P(ZeroCopy, ReadersSeeTheMemoryThatTheWriterFilled) {
  test::TestContainer container;
  auto& writer = container.component("writer");
  auto& reader = GetParam().components == 1 ? writer : container.component("reader");
  auto publisher = writer.advertise<Cloud>(kPort);
  std::deque<Eyes> eyes(static_cast<std::size_t>(GetParam().readers));
  for (auto& pair : eyes) {
    reader.subscribe<Cloud>(kPort, [&pair](const Sample<Cloud>& cloud) { pair.look(cloud); });
  }
  container.activate();
  EXPECT_EQ(publisher.subscriber_count(), eyes.size());
  expect_same_memory(publisher, eyes);
}

INSTANTIATE_TEST_SUITE_P(Layouts,
                         ZeroCopy,
                         ::testing::Values(Layout{1, 1}, Layout{1, 2}, Layout{3, 1}, Layout{3, 2}),
                         [](const auto& layout) {
                           return std::to_string(layout.param.readers) + "readers" +
                                  std::to_string(layout.param.components) + "components";
                         });

TEST(ZeroCopyReaders, EachInAComponentOfItsOwn) {
  test::TestContainer container;
  auto publisher = container.component("writer").advertise<Cloud>(kPort);
  std::deque<Eyes> eyes(3);
  for (auto& pair : eyes) {
    container.component("reader").subscribe<Cloud>(
        kPort, [&pair](const Sample<Cloud>& cloud) { pair.look(cloud); });
  }
  container.activate();
  expect_same_memory(publisher, eyes);
}

// Counts every call that would touch more than a pointer.

struct Calls {
  std::atomic<int> write_cdr = 0;
  std::atomic<int> read_cdr = 0;
  std::atomic<int> copy = 0;
  std::atomic<int> cdr_size = 0;
};
Calls calls;

MessageType counted_cloud_type() {
  MessageType type = interfaces::message_type<Cloud>();
  type.write_cdr = [](const void* message, std::uint8_t* data, std::size_t size) {
    ++calls.write_cdr;
    return interfaces::message_type<Cloud>().write_cdr(message, data, size);
  };
  type.read_cdr = [](const std::uint8_t* data, std::size_t size, void* message) {
    ++calls.read_cdr;
    return interfaces::message_type<Cloud>().read_cdr(data, size, message);
  };
  type.copy = [](const void* from, void* to) {
    ++calls.copy;
    interfaces::message_type<Cloud>().copy(from, to);
  };
  type.cdr_size = [](const void* message) {
    ++calls.cdr_size;
    return interfaces::message_type<Cloud>().cdr_size(message);
  };
  return type;
}

/// Opens the type-erased side of a context, to wire a message type of our own.
struct Opened : Context {
  static std::shared_ptr<PublisherBackend> publisher(Context& context, const MessageType& type) {
    return (context.*&Opened::make_publisher)(kPort, type, {});
  }
  static Subscription subscription(Context& context, const MessageType& type, Callback callback) {
    return (context.*&Opened::make_subscription)(kPort, type, std::move(callback), {});
  }
};

TEST(ZeroCopyCalls, NothingIsSerialisedOrCopiedInAContainer) {
  static const MessageType kType = counted_cloud_type();
  std::atomic<int> received = 0;
  test::TestContainer container;
  auto& context = container.component();
  Publisher<Cloud> publisher(Opened::publisher(context, kType));
  for (int reader = 0; reader < 2; ++reader) {
    Opened::subscription(context, kType, [&](const auto&, const MessageInfo&) { ++received; });
  }
  container.activate();
  for (int round = 1; round <= kRounds; ++round) {
    publisher.publish(publisher.loan());
    ASSERT_TRUE(wait_until([&] { return received == 2 * round; }));
  }
  EXPECT_EQ(calls.write_cdr, 0);
  EXPECT_EQ(calls.read_cdr, 0);
  EXPECT_EQ(calls.copy, 0);
  EXPECT_EQ(calls.cdr_size, 0);
}

TEST(ZeroCopyLoans, AreClearedButNotTheirRows) {
  test::TestContainer container;
  auto publisher = container.component().advertise<Cloud>(kPort);
  const void* first_address = nullptr;
  {
    auto cloud = publisher.loan();
    first_address = &*cloud;
    cloud->header().frame_id(7);
    cloud->points_count() = 1;
    cloud->points()[0][0] = 42;
  }
  auto cloud = publisher.loan();
  ASSERT_EQ(&*cloud, first_address) << "the pool is not LIFO any more; choose another proof";
  EXPECT_EQ(cloud->header().frame_id(), 0U);
  EXPECT_EQ(cloud->points_count(), 0U);
  EXPECT_EQ(cloud->points()[0][0], 42);
}

}  // namespace
}  // namespace camvox
