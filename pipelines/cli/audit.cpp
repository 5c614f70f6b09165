// implements: pipelines/cli/commands.hpp
#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {

void add_audit(Program& program) {
  program.add({"audit", "compare the numbers printed by Quinn and Hong (2000) with recomputed ones",
               "  shakebed audit\n  shakebed audit --json", false},
              [](const Call& call) {
                print(call.json ? dump(audit_json()) : audit_text());
                return exit_ok;
              });
}

}  // namespace shakebed::pipelines
