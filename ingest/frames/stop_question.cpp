#include "ingest/frames/stop_question.hpp"

#include <utility>

namespace shakebed::ingest {

namespace {
thread_local const StopQuestion* innermost = nullptr;
}

StopQuestion::StopQuestion(std::function<void()> question) : question_(std::move(question)), outer_(innermost) {
  innermost = this;
}

StopQuestion::~StopQuestion() { innermost = outer_; }

void StopQuestion::ask() {
  if (innermost != nullptr && innermost->question_) innermost->question_();
}

std::function<void()> StopQuestion::of_thread() {
  return innermost != nullptr ? innermost->question_ : std::function<void()>();
}

}  // namespace shakebed::ingest
