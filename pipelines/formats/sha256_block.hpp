// The compression function of SHA-256 (FIPS 180-4), once in plain C++ and once with the processor's own instructions.
#pragma once

#include <cstddef>
#include <cstdint>

namespace shakebed::pipelines {

// Folds `blocks` blocks of 64 bytes into the eight words of the state.
void sha256_blocks_portable(std::uint32_t* state, const unsigned char* bytes, std::size_t blocks);
// The same, with SHA instructions where this processor has them (about eight times as fast).
void sha256_blocks(std::uint32_t* state, const unsigned char* bytes, std::size_t blocks);

}  // namespace shakebed::pipelines
