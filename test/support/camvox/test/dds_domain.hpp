#pragma once

namespace camvox::test {

/// A DDS domain that no other test process of this machine uses, until this process ends.
[[nodiscard]] int own_domain();

}  // namespace camvox::test
