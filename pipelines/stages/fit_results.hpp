// The numbers and tables of a fit (fit.json and the CSV files beside it), stated before it runs.
#pragma once

#include "pipelines/formats/results.hpp"

namespace shakebed::pipelines {

struct FitOutput {
  bool matched = false;  // against simulated beds
  bool bootstrap = false;
  bool answer = false;
};
void state_fit_results(ResultList& list, const FitOutput& fit);

}  // namespace shakebed::pipelines
