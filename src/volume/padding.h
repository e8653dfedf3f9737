#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace xray_registration {

/// Turns what lies outside of a scan's field into air. `low` to `high`: what its voxels hold, in HU. Values that no
/// tissue and hardly a metal has are cleared everywhere, others only where they reach from the end of a row inwards, as
/// what is outside of a round field does. Returns how many voxels were changed.
std::size_t clearPadding(int low, int high, int width, std::size_t rows, std::int16_t* hu);

/// The one value along four parallel edges of the volume, which is what padding without a word in the header looks
/// like when it is not air; empty when there is none, or it is no denser than bone. x fastest.
std::optional<std::int16_t> densePaddingAtEdges(const std::vector<std::int16_t>& hu, const std::array<int, 3>& size);

/// The same for any value.
std::optional<std::int16_t> valueAtEdges(const std::vector<std::int16_t>& hu, const std::array<int, 3>& size);

}  // namespace xray_registration
