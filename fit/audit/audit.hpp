#pragma once

#include <string>
#include <vector>

// The paper's printed numbers beside the same numbers recomputed from its own formulas by this library. [QuinnHong2000]
namespace shakebed::fit {

enum class AuditStatus {
  agrees,     // the print follows from the formulas, to the digits printed
  explained,  // it does not, and the reason is known
  open,       // it does not, and no reason is certain
};
std::string_view to_string(AuditStatus status);

// One number. A statement that is not a number (a misprinted formula, a claim) has `is_numeric` false and speaks
// through `printed_text` and `recomputed_text`; those two are filled for numbers too.
struct AuditRow {
  std::string quantity;  // "T_c/mg"
  std::string place;     // where in the paper
  std::string unit;
  bool is_numeric = true;
  double printed = 0.0;
  double recomputed = 0.0;
  double difference = 0.0;           // recomputed - printed
  double relative_difference = 0.0;  // difference/printed
  std::string printed_text;
  std::string recomputed_text;
  std::string explanation;
  AuditStatus status = AuditStatus::open;
};

// All rows, each recomputed at the call.
std::vector<AuditRow> audit();

}  // namespace shakebed::fit
