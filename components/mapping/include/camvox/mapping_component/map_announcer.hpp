#pragma once

#include <cstdint>
#include <deque>
#include <set>

#include "camvox/component/context.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/mapping/mapper.hpp"

namespace camvox::mapping_component {

/// Tells the others of a map that was loaded: its keyframes, parents first, then one map update
/// with all poses and ties. Loop closing acknowledges each keyframe, so that none is lost however
/// large the map and however late loop closing starts. At the end the root comes once more: its
/// acknowledgment says that the update has arrived, too.
class MapAnnouncer {
 public:
  using MapUpdate = camvox_interfaces::msg::MapUpdate;

  /// Advertises the port "map_keyframe".
  explicit MapAnnouncer(Context& context);

  /// Both must outlive the announcement, and the map must not change before it is done.
  void begin(const mapping::Mapper& mapper, Publisher<MapUpdate>& updates);
  void acknowledge(tracking::KeyframeId id);
  /// Called now and then: sends again what was not acknowledged since the last time.
  void repeat();

  [[nodiscard]] bool done() const { return stage_ == Stage::kDone; }

 private:
  enum class Stage { kKeyframes, kUpdate, kDone };

  void advance();
  void send(tracking::KeyframeId id);

  Context& context_;
  Publisher<camvox_interfaces::msg::Keyframe> keyframes_;
  const mapping::Mapper* mapper_ = nullptr;
  Publisher<MapUpdate>* updates_ = nullptr;
  Stage stage_ = Stage::kDone;
  std::deque<tracking::KeyframeId> waiting_;
  std::set<tracking::KeyframeId> in_flight_;
  bool progressed_ = false;  ///< Something was acknowledged since the last repeat().
};

}  // namespace camvox::mapping_component
