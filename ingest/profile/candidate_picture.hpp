#pragma once
// A survey's candidates drawn into the picture they were seen in.

#include <cstddef>
#include <filesystem>
#include <memory>

#include "ingest/find/survey.hpp"

namespace shakebed::ingest {

// A picture in its own colours, at most `most_px` wide and high.
class CandidatePictures {
 public:
  // Of a picture that was read already. Without its colours, as one channel alone has it, it is drawn in grey.
  explicit CandidatePictures(const ChannelFrames& frames, int most_px = 1400);
  // Picture number `page` of `source`, decoded once, with its columns `pixel_aspect` times as wide. Throws InputError.
  explicit CandidatePictures(const std::filesystem::path& source, std::size_t page = 0, double pixel_aspect = 1,
                             int most_px = 1400);
  ~CandidatePictures();
  CandidatePictures(const CandidatePictures&) = delete;
  CandidatePictures& operator=(const CandidatePictures&) = delete;

  // Writes it as PNG with the candidate's circles, if one is given. Magenta: beads of probability 0.9 or more. Yellow:
  // the others. Atomic. `bead_aspect`: width over height of a bead in the picture. Throws OutputError.
  void write(const std::filesystem::path& path, const SurveyCandidate* candidate, double bead_aspect = 1) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace shakebed::ingest
