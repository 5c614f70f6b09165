#include "pipelines/runner/stage_code.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {

std::string code_of(const PlannedStage& stage) {
  std::string code(stage_code(stage.row->name));
  std::vector<std::string> inner = stage.stage->chain_kinds();
  if (inner.empty()) return code;
  std::sort(inner.begin(), inner.end());
  inner.erase(std::unique(inner.begin(), inner.end()), inner.end());
  for (const std::string& kind : inner) code += fmt::format(" {} {}", kind, stage_code(kind));
  return fast_hash(code);
}

}  // namespace shakebed::pipelines
