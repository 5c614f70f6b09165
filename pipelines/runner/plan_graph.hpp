// The stages of a plan and their arrows, as text for drawing programs.
#pragma once

#include <string>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

std::string graph_dot(const Plan& plan);      // a Graphviz digraph
std::string graph_mermaid(const Plan& plan);  // a Mermaid flowchart

}  // namespace shakebed::pipelines
