#pragma once
// To end long work on frames early. A picture of a thousand beads can take half a minute.
//
//   const StopQuestion question([&] { if (user_gave_up) throw Cancelled(); });
//   const DisksFound found = find_disks(image);   // or the exception

#include <functional>

namespace shakebed::ingest {

// While it lives, all finding and measuring that this thread calls asks the question often: within 0.4 s on a picture
// of 1,000 beads. What the question throws ends the call. measure_bed() asks it from its threads, too, several at once.
// Questions can be nested: the innermost is asked.
class StopQuestion {
 public:
  explicit StopQuestion(std::function<void()> question);
  ~StopQuestion();
  StopQuestion(const StopQuestion&) = delete;
  StopQuestion& operator=(const StopQuestion&) = delete;

  static void ask();                                       // that of this thread, if there is one
  [[nodiscard]] static std::function<void()> of_thread();  // to be asked by other threads, too; empty: there is none

 private:
  std::function<void()> question_;
  const StopQuestion* outer_;
};

}  // namespace shakebed::ingest
