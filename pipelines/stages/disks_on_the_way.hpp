// What is done with each frame's disks as they come, so that memory does not grow with the film.
#pragma once

#include <array>
#include <fstream>
#include <istream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/velocities.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

class DisksOnTheWay {
 public:
  using Frames = std::map<std::size_t, std::vector<ingest::MeasuredDisk>>;

  // Where the truth is known: centres of disks that were not found [px], numbers of those found where there is none.
  struct Marks {
    std::vector<std::pair<double, double>> missed{};
    std::vector<std::size_t> wrong{};
  };

  // `truth`: a table of true centres, where it is known.
  DisksOnTheWay(RunContext& context, const ExtractOptions& options, std::istream* truth);
  void take(const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks);
  void close();

  // `options.overlays` of the frames kept, spread evenly.
  [[nodiscard]] Frames to_draw() const;
  [[nodiscard]] std::size_t cut() const { return cut_; }
  [[nodiscard]] std::size_t half_hidden() const { return half_hidden_; }
  [[nodiscard]] std::optional<ingest::VelocityMeasurement> velocities();
  // Quality below which one in a hundred disks lies, and half of them; the table these follow from.
  [[nodiscard]] Json quality() const;
  [[nodiscard]] Table quality_table(Table table) const;
  // The same as a histogram; its height goes with the logarithm, so that a few odd disks among thousands show.
  [[nodiscard]] std::string quality_figure() const;
  // Where the truth is known, how near the disks came.
  [[nodiscard]] std::optional<Json> truth() const;
  // nullptr where every disk of the frame was found, and no other.
  [[nodiscard]] const Marks* marks(std::size_t frame) const;

 private:
  using Centres = std::vector<std::pair<double, double>>;
  Centres truth_of(std::size_t frame);
  void compare(std::size_t index, const std::vector<ingest::MeasuredDisk>& disks);
  void keep_for_drawing(const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks);

  const ExtractOptions& options_;
  std::ofstream disks_, details_;
  std::istream* truth_;
  std::string pending_;
  std::optional<ingest::VelocityMeter> meter_;
  std::array<std::size_t, 50> quality_{};
  std::size_t cut_ = 0, half_hidden_ = 0, matched_ = 0, reported_ = 0, real_ = 0;
  double squares_ = 0;
  std::size_t every_ = 1;
  Frames to_draw_;
  std::map<std::size_t, Marks> marks_;
};

}  // namespace shakebed::pipelines
