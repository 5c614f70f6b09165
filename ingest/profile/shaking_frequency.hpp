#pragma once
// The frequency of a motion that repeats, from places at the times of a film's frames.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace shakebed::ingest {

// A place (any unit) in a frame of the film, counted from 0. Frames rise; some may be missing.
struct PlaceInFrame {
  std::size_t frame = 0;
  double place = 0;
};

// place = middle + amplitude sin(2 pi (cycles_per_frame frame + phase)) + overtones + noise.
struct FoundFrequency {
  bool known = false;
  double cycles_per_frame = 0;  // 0 .. 1/2: a faster motion shows at its alias
  double std_error = 0;         // cycles a frame
  double amplitude = 0;
  double phase = 0;        // turns, 0 .. 1
  double false_alarm = 1;  // chance that noise would do as well anywhere between no motion and 1/2
  std::string why_not;     // a sentence unless known
};

// By a periodogram (Lomb's, since frames may be missing). Its lines are compared with their neighbourhood, a power law
// of the frequency: so slow irregular motion, such as sloshing, is no line. The level comes from m neighbours. By
// chance, a share (1 + z/m)^-m of the frequencies tried exceeds z times that level. Then by least squares with two
// overtones. The error follows from the residuals in the neighbourhood.
constexpr double most_false_alarm = 1e-4;
FoundFrequency find_frequency(const std::vector<PlaceInFrame>& places);

// The same from a longer stretch of the film once it is known from its beginning.
FoundFrequency refine_frequency(const std::vector<PlaceInFrame>& places, const FoundFrequency& from_beginning);

}  // namespace shakebed::ingest
