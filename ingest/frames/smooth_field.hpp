#pragma once
// Helpers of this folder: smooth polynomials over a frame, symmetric linear systems, frames reduced by averaging.

#include <cstddef>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// Number of terms T_i(u) T_j(v) with i + j <= order (order at most 8), and their values at u, v in -1 .. 1.
std::size_t polynomial_terms(int order);
void polynomial_values(double u, double v, int order, double* values);

// Solves A x = b for a symmetric positive definite A (size x size, row by row, lower triangle read). The solution x is
// written to `right`, the Cholesky factor to the lower triangle of `matrix`. False when A is not positive definite.
bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& right, std::size_t size);

// The frame averaged over factor x factor px. Pixel (i, j) has its centre at factor (i + 1/2) - 1/2 of the frame's px.
GrayFrame reduced(const GrayFrame& frame, int factor);

// The frame smoothed by the weights 1 2 1 along rows and columns (sigma 0.7 px); its outermost pixels are kept.
GrayFrame smoothed(const GrayFrame& frame);

}  // namespace shakebed::ingest
