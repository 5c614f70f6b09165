// A recipe: parsed, written, parsed again; decoded into a plan whose resolved form is a recipe itself.
#include "pipelines/formats/json.hpp"
#include "pipelines/runner/plan.hpp"
#include "tests/robustness/fuzz/fuzz.hpp"

using namespace shakebed::pipelines;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  std::vector<Problem> problems;
  auto node = parse_json(text, "fuzz.json", problems);
  for (const Problem& problem : problems) {
    if (problem.what.empty()) shakebed::fuzz::fail("a problem without words");
  }
  if (!node && problems.empty()) shakebed::fuzz::fail("no document and no reason");
  if (!node || !problems.empty()) return 0;
  const std::string first = dump(node->to_json());
  auto again = parse_json(first, "again.json", problems);
  if (!again || !problems.empty()) shakebed::fuzz::fail("what was written cannot be read: " + first);
  if (dump(again->to_json()) != first) shakebed::fuzz::fail("written twice, not the same: " + first);
  try {
    const Plan plan = make_plan(std::move(*node), "fuzz.json", "/nonexistent");
    // Every default written out: a recipe that means the same.
    const Plan resolved = make_plan(to_node(plan.resolved), "resolved.json", "/nonexistent");
    if (dump(resolved.resolved) != dump(plan.resolved)) shakebed::fuzz::fail("resolving twice changes the recipe");
  } catch (const Error& error) {
    if (std::string_view(error.what()).empty()) shakebed::fuzz::fail("an error without words");
  }
  return 0;
}
