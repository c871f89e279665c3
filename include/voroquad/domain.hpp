// voroquad/domain.hpp: where cells end.
#pragma once

namespace voroquad {

// The unit box, whose faces bound the cells, or the unit torus, which has no border.
enum class Domain { box, torus };

} // namespace voroquad
