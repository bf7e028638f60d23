#pragma once

namespace camvox {

/// Lets the calling thread give way to those that serve each frame when processors are scarce: its
/// nice value becomes `kBackgroundNice`. For work that takes long and is not waited for, at the
/// start of its thread. Needs no rights; on an idle machine nothing changes.
void make_background_thread();

inline constexpr int kBackgroundNice = 10;

}  // namespace camvox
