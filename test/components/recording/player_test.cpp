#include "camvox/recording/player.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "bag_files.hpp"

namespace camvox::recording {
namespace {

using std::chrono::steady_clock;
using ::testing::ElementsAre;
using ::testing::SizeIs;

constexpr auto kDeadline = std::chrono::seconds(20);

/// Plays a bag and keeps what was sent.
class Playing {
 public:
  Playing(const std::string& bag, const PlayerOptions& options, Player::Gate gate = {})
      : player(
            open_bag(bag), options, [this](PlayedMessage&& message) { keep(message); }, gate) {
    player.start();
  }

  std::vector<int> contents() {
    const std::lock_guard lock(mutex_);
    return contents_;
  }
  bool wait_for_count(std::size_t count) {
    const auto deadline = steady_clock::now() + kDeadline;
    while (contents().size() < count && steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return contents().size() >= count;
  }

 private:
  void keep(const PlayedMessage& message) {
    const std::lock_guard lock(mutex_);
    contents_.push_back(message.cdr.back());
  }

  std::mutex mutex_;
  std::vector<int> contents_;

 public:
  Player player;
};

PlayerOptions fast() {
  PlayerOptions options;
  options.as_fast_as_possible = true;
  return options;
}

PlayerOptions paused_fast() {
  auto options = fast();
  options.start_paused = true;
  return options;
}

/// Five messages on /a at 0.0 to 0.4 s, and one on /b at 0.25 s.
std::string small_bag(const TemporaryFolder& folder) {
  const std::string path = folder.file("bag");
  write_bag(path,
            {{"/a", 0.0, 0},
             {"/a", 0.1, 1},
             {"/a", 0.2, 2},
             {"/b", 0.25, 9},
             {"/a", 0.3, 3},
             {"/a", 0.4, 4}});
  return path;
}

TEST(Player, SendsAllInOrderOfTheirLogTimes) {
  const TemporaryFolder folder;
  Playing playing(small_bag(folder), fast());
  playing.player.wait_until_finished();
  EXPECT_THAT(playing.contents(), ElementsAre(0, 1, 2, 9, 3, 4));
  EXPECT_EQ(playing.player.state().sent, 6U);
  EXPECT_TRUE(playing.player.state().status.ok());
}

TEST(Player, SelectsTopicsAndStart) {
  const TemporaryFolder folder;
  auto options = fast();
  options.topics = {"/a"};
  options.start_offset_s = 0.15;
  Playing playing(small_bag(folder), options);
  playing.player.wait_until_finished();
  EXPECT_THAT(playing.contents(), ElementsAre(2, 3, 4));
}

TEST(Player, NeverSendsBeforeItsTime) {
  const TemporaryFolder folder;
  PlayerOptions options;
  options.rate = 2.0;
  const auto start = steady_clock::now();
  Playing playing(small_bag(folder), options);
  playing.player.wait_until_finished();
  // 0.4 s of recording at twice the speed. How much later the last one may be is the machine's.
  EXPECT_GE(steady_clock::now() - start, std::chrono::milliseconds(200));
  EXPECT_THAT(playing.contents(), SizeIs(6));
}

TEST(Player, PausedSendsNothingButSteps) {
  const TemporaryFolder folder;
  PlayerOptions options;
  options.start_paused = true;
  Playing playing(small_bag(folder), options);
  playing.player.play_next();
  ASSERT_TRUE(playing.wait_for_count(1));
  playing.player.play_next();
  ASSERT_TRUE(playing.wait_for_count(2));
  EXPECT_THAT(playing.contents(), ElementsAre(0, 1));
  EXPECT_FALSE(playing.player.state().finished);
  playing.player.set_paused(false);
  playing.player.wait_until_finished();
  EXPECT_THAT(playing.contents(), ElementsAre(0, 1, 2, 9, 3, 4));
}

TEST(Player, LoopsUntilStopped) {
  const TemporaryFolder folder;
  auto options = fast();
  options.loop = true;
  Playing playing(small_bag(folder), options);
  ASSERT_TRUE(playing.wait_for_count(13));
  playing.player.stop();
  const auto contents = playing.contents();
  EXPECT_EQ(contents[6], 0);
  EXPECT_EQ(contents[11], 4);
  EXPECT_EQ(contents[12], 0);
}

TEST(Player, GateHoldsBackUntilPoked) {
  const TemporaryFolder folder;
  std::atomic<bool> open = false;
  Playing playing(small_bag(folder), fast(), [&](const PlayedMessage& message) {
    return message.cdr.back() != 2 || open;
  });
  ASSERT_TRUE(playing.wait_for_count(2));
  EXPECT_THAT(playing.contents(), ElementsAre(0, 1));
  open = true;
  playing.player.poke();
  playing.player.wait_until_finished();
  EXPECT_THAT(playing.contents(), ElementsAre(0, 1, 2, 9, 3, 4));
}

/// The poke comes just when the gate has said no and the player does not wait yet.
TEST(Player, APokeIsNotLostBeforeTheWaitBegins) {
  const TemporaryFolder folder;
  std::atomic<bool> open = false;
  std::thread poker;
  Player* player = nullptr;
  Playing playing(small_bag(folder), paused_fast(), [&](const PlayedMessage& message) {
    const bool answer = message.cdr.back() != 2 || open;
    if (answer || poker.joinable()) return answer;
    poker = std::thread([&] {
      open = true;
      player->poke();
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // as if preempted here
    return answer;
  });
  player = &playing.player;
  player->set_paused(false);
  EXPECT_TRUE(playing.wait_for_count(6));
  playing.player.stop();
  poker.join();
}

TEST(Player, AMessageThatCannotBePublishedCostsOnlyItself) {
  const TemporaryFolder folder;
  std::vector<int> contents;
  Player player(open_bag(small_bag(folder)), fast(), [&](PlayedMessage&& message) {
    if (message.cdr.back() % 2 == 1) throw std::runtime_error("odd");
    contents.push_back(message.cdr.back());
  });
  player.start();
  player.wait_until_finished();
  EXPECT_THAT(contents, ElementsAre(0, 2, 4));
  EXPECT_EQ(player.state().sent, 3U);
  EXPECT_EQ(player.state().refused, 3U);
  EXPECT_EQ(player.state().refusal, "odd");
  EXPECT_TRUE(player.state().status.ok());
}

TEST(Player, WhatItsThreadsThrowEndsPlayingAndIsTold) {
  const TemporaryFolder folder;
  Playing playing(small_bag(folder), fast(), [](const PlayedMessage& message) {
    if (message.cdr.back() == 2) throw std::runtime_error("no such topic");
    return true;
  });
  playing.player.wait_until_finished();
  playing.player.stop();
  EXPECT_THAT(playing.contents(), ElementsAre(0, 1));
  EXPECT_THAT(playing.player.state().status.message(), ::testing::HasSubstr("no such topic"));
}

TEST(Player, ReadAheadIsBoundedAndStillCompletes) {
  const TemporaryFolder folder;
  auto options = fast();
  options.read_ahead_bytes = 1;  // one message at a time
  Playing playing(small_bag(folder), options);
  playing.player.wait_until_finished();
  EXPECT_THAT(playing.contents(), SizeIs(6));
}

TEST(Player, EmptyBagEndsAtOnce) {
  const TemporaryFolder folder;
  write_bag(folder.file("empty"), {});
  auto options = fast();
  options.loop = true;
  Playing playing(folder.file("empty"), options);
  playing.player.wait_until_finished();
  EXPECT_EQ(playing.player.state().sent, 0U);
}

TEST(Player, StopsWhileWaitingForTheNextMessage) {
  const TemporaryFolder folder;
  write_bag(folder.file("long"), {{"/a", 0.0, 0}, {"/a", 3600.0, 1}});
  Playing playing(folder.file("long"), {});
  ASSERT_TRUE(playing.wait_for_count(1));
  playing.player.stop();  // must not wait for the hour to pass
  EXPECT_THAT(playing.contents(), ElementsAre(0));
}

}  // namespace
}  // namespace camvox::recording
