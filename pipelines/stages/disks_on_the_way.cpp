#include "pipelines/stages/disks_on_the_way.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {
DisksOnTheWay::DisksOnTheWay(RunContext& context, const ExtractOptions& options, std::istream* truth)
    : options_(options),
      disks_(context.output("disks.csv"), std::ios::binary),
      details_(context.output("disk_details.csv"), std::ios::binary),
      truth_(truth) {
  for (auto [file, stream] : {std::pair("disks.csv", &disks_), {"disk_details.csv", &details_}}) {
    const Table head = context.table(file);
    *stream << head.csv();
    write_file(metadata_path(context.output(file)), dump(head.metadata(file)));
  }
  if (options.frame_rate) {
    ingest::VelocityOptions velocity;
    velocity.frame_rate_hz = *options.frame_rate / static_cast<double>(options.stride);
    velocity.gravity_m_per_s2 = options.gravity;
    meter_.emplace(options.diameter, velocity);
  }
}

void DisksOnTheWay::take(const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks) {
  disks_ << ingest::disks_csv_rows(disks);
  details_ << ingest::disk_details_csv_rows(disks);
  for (const ingest::MeasuredDisk& disk : disks) {
    ++quality_[std::min<std::size_t>(quality_.size() - 1,
                                     static_cast<std::size_t>(disk.quality * static_cast<double>(quality_.size())))];
    cut_ += disk.cut, half_hidden_ += disk.half_hidden;
  }
  if (meter_) {
    std::vector<ingest::MeasuredDisk> first;
    std::copy_if(disks.begin(), disks.end(), std::back_inserter(first),
                 [](const ingest::MeasuredDisk& disk) { return disk.species == 1; });
    meter_->add(first);
  }
  if (truth_ != nullptr) compare(frame.index, disks);
  keep_for_drawing(frame, disks);
}

// Frames to be drawn in the end, spread over a film of unknown length: every so many, thinned out as it goes on.
void DisksOnTheWay::keep_for_drawing(const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks) {
  if (options_.overlays == 0 || frame.status != ingest::FrameStatus::good || frame.index % every_ != 0) return;
  to_draw_.emplace(frame.index, disks);
  if (to_draw_.size() <= 2 * options_.overlays) return;
  every_ *= 2;
  std::erase_if(to_draw_, [&](const auto& one) { return one.first % every_ != 0; });
}

void DisksOnTheWay::close() {
  for (std::ofstream* file : {&disks_, &details_}) {
    file->close();
    if (!*file) throw StageError("the tables of disks could not be written: is the disk full?");
  }
}

DisksOnTheWay::Frames DisksOnTheWay::to_draw() const {
  Frames chosen;
  std::size_t number = 0;
  const std::size_t wanted = std::min<std::size_t>(options_.overlays, to_draw_.size());
  for (const auto& [index, disks] : to_draw_) {
    if (chosen.size() < wanted && number * wanted >= chosen.size() * to_draw_.size()) chosen.emplace(index, disks);
    ++number;
  }
  return chosen;
}

std::optional<ingest::VelocityMeasurement> DisksOnTheWay::velocities() {
  if (!meter_) return std::nullopt;
  return meter_->result();
}

Json DisksOnTheWay::quality() const {
  std::size_t all = 0, below = 0;
  for (const std::size_t count : quality_) all += count;
  Json json;
  for (const double share : {0.01, 0.5}) {
    below = 0;
    std::size_t bin = 0;
    while (bin < quality_.size() && static_cast<double>(below + quality_[bin]) < share * static_cast<double>(all))
      below += quality_[bin++];
    json[share < 0.1 ? "lowest_percent" : "median"] =
        static_cast<double>(bin + 1) / static_cast<double>(quality_.size());
  }
  return json;
}

Table DisksOnTheWay::quality_table(Table table) const {
  for (std::size_t k = 0; k < quality_.size(); ++k)
    table.add({static_cast<double>(k) / 50, static_cast<double>(k + 1) / 50, count_cell(quality_[k])});
  return table;
}

std::string DisksOnTheWay::quality_figure() const {
  constexpr double left = 60, top = 20, wide = 560, high = 200;
  const double most = std::log1p(static_cast<double>(*std::max_element(quality_.begin(), quality_.end())));
  const double step = wide / static_cast<double>(quality_.size());
  std::string bars;
  for (std::size_t k = 0; k < quality_.size(); ++k) {
    if (quality_[k] == 0) continue;
    const double tall = high * std::log1p(static_cast<double>(quality_[k])) / most;
    bars += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
        "fill=\"#1f6fb4\"><title>{}</title></rect>\n",
        left + step * static_cast<double>(k), top + high - tall, step - 1, tall, quality_[k]);
  }
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 290\" width=\"640\" height=\"290\" "
             "font-family=\"sans-serif\" font-size=\"13\">\n<rect x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" "
             "fill=\"none\" stroke=\"#888\"/>\n<text x=\"{0}\" y=\"{4}\">0</text>\n<text x=\"{5}\" y=\"{4}\" "
             "text-anchor=\"end\">1</text>\n<text x=\"{6}\" y=\"{7}\" text-anchor=\"middle\">quality of the disks: 1 "
             "for a bead that looks like the others</text>\n<text x=\"{6}\" y=\"{8}\" text-anchor=\"middle\">"
             "(height of a bar: logarithm of the number of disks)</text>\n",
             left, top, wide, high, top + high + 20, left + wide, left + wide / 2, top + high + 42, top + high + 60) +
         bars + "</svg>\n";
}

std::optional<Json> DisksOnTheWay::truth() const {
  if (real_ == 0 || matched_ == 0) return std::nullopt;
  return Json{{"recall", static_cast<double>(matched_) / static_cast<double>(real_)},
              {"precision", static_cast<double>(matched_) / static_cast<double>(std::max<std::size_t>(reported_, 1))},
              {"center_rms_error", quantity_json(std::sqrt(squares_ / static_cast<double>(matched_)), "px")}};
}

// The true centres of a frame: the table is in the order of frames.
DisksOnTheWay::Centres DisksOnTheWay::truth_of(std::size_t frame) {
  Centres centres;
  for (;;) {
    if (pending_.empty()) {
      if (!std::getline(*truth_, pending_)) return centres;
      if (pending_.empty() || std::isdigit(static_cast<unsigned char>(pending_.front())) == 0) {
        pending_.clear();
        continue;
      }
    }
    const auto cells = split_csv_line(pending_);
    const std::size_t of = cells.size() < 4 ? 0 : static_cast<std::size_t>(std::stoull(cells[0]));
    if (cells.size() >= 4 && of > frame) return centres;
    if (cells.size() >= 4 && of == frame) centres.emplace_back(std::stod(cells[2]), std::stod(cells[3]));
    pending_.clear();
  }
}

// Nearest true centre of each disk found, each true centre used once.
void DisksOnTheWay::compare(std::size_t index, const std::vector<ingest::MeasuredDisk>& disks) {
  Centres truth = truth_of(options_.skip + index * options_.stride);
  Marks marks;
  std::sort(truth.begin(), truth.end());
  real_ += truth.size(), reported_ += disks.size();
  std::vector<bool> used(truth.size(), false);
  for (const ingest::MeasuredDisk& disk : disks) {
    const double reach = disk.radius_px / 2;
    auto at = std::lower_bound(truth.begin(), truth.end(), std::pair(disk.x_px - reach, -1e300));
    std::ptrdiff_t best = -1;
    double best_distance = reach * reach;
    for (; at != truth.end() && at->first <= disk.x_px + reach; ++at) {
      const double dx = at->first - disk.x_px, dy = at->second - disk.y_px;
      if (dx * dx + dy * dy < best_distance && !used[static_cast<std::size_t>(at - truth.begin())])
        best_distance = dx * dx + dy * dy, best = at - truth.begin();
    }
    if (best < 0) {
      marks.wrong.push_back(static_cast<std::size_t>(&disk - disks.data()));
      continue;
    }
    used[static_cast<std::size_t>(best)] = true;
    ++matched_;
    squares_ += best_distance;
  }
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (!used[k]) marks.missed.push_back(truth[k]);
  }
  if (!marks.missed.empty() || !marks.wrong.empty()) marks_.emplace(index, std::move(marks));
}

const DisksOnTheWay::Marks* DisksOnTheWay::marks(std::size_t frame) const {
  const auto found = marks_.find(frame);
  return found == marks_.end() ? nullptr : &found->second;
}

}  // namespace shakebed::pipelines
