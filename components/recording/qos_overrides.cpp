#include "qos_overrides.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "camvox/storage/qos_profile.hpp"

namespace camvox::recording {
namespace {

interfaces::Qos to_qos(const storage::QosProfile& profile) {
  using Profile = storage::QosProfile;
  interfaces::Qos result = interfaces::qos::kDefault;
  result.reliable = profile.reliability != Profile::Reliability::kBestEffort;
  result.latched = profile.durability == Profile::Durability::kTransientLocal;
  result.depth =
      profile.history == Profile::History::kKeepAll
          ? kQueuedMessages
          : static_cast<int>(std::clamp<std::uint64_t>(profile.depth, 1, kQueuedMessages));
  return result;
}

}  // namespace

std::map<std::string, interfaces::Qos> read_qos_overrides(const std::string& path) {
  if (path.empty()) return {};
  std::ifstream stream(path);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf())) throw std::runtime_error(path + ": cannot be read");
  const auto profiles = storage::parse_qos_overrides(text.str(), path);
  if (!profiles.ok()) throw std::runtime_error(profiles.status().message());
  std::map<std::string, interfaces::Qos> overrides;
  for (const auto& [topic, profile] : *profiles) overrides[topic] = to_qos(profile);
  return overrides;
}

}  // namespace camvox::recording
