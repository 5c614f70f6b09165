#include "tests/bench/cases/finder_benchmark.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <unordered_map>

#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/profile/density.hpp"

namespace shakebed::ingest {

namespace {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Centre {
  double x = 0, y = 0;
};

struct Tally {
  std::size_t truths = 0, found = 0, hits = 0;
  double square = 0, density_square = 0, density_count = 0;
};

// One-to-one matches within half a radius; densities in strips of one diameter above the lowest truth.
void tally(const std::vector<Centre>& found, const std::vector<RenderedDisk>& truth, int width, int height,
           double found_radius, Tally& result) {
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells;
  const double cell = 2 * truth.front().radius_px;
  const auto key = [&](double x, double y) {
    return static_cast<std::int64_t>(std::floor(y / cell)) * 100000 + static_cast<std::int64_t>(std::floor(x / cell));
  };
  for (std::size_t k = 0; k < found.size(); ++k) cells[key(found[k].x, found[k].y)].push_back(k);
  std::vector<bool> used(found.size(), false);
  std::vector<double> true_heights, found_heights;
  for (const RenderedDisk& disk : truth) {
    if (disk.x_px < -0.5 || disk.y_px < -0.5 || disk.x_px >= width - 0.5 || disk.y_px >= height - 0.5) continue;
    ++result.truths;
    true_heights.push_back((height - disk.y_px) / (2 * disk.radius_px));
    double best = 0.5 * disk.radius_px;
    std::size_t winner = found.size();
    for (int row = -1; row <= 1; ++row)
      for (int column = -1; column <= 1; ++column) {
        const auto at = cells.find(key(disk.x_px + column * cell, disk.y_px + row * cell));
        if (at == cells.end()) continue;
        for (const std::size_t k : at->second) {
          const double distance = std::hypot(found[k].x - disk.x_px, found[k].y - disk.y_px);
          if (!used[k] && distance < best) {
            best = distance;
            winner = k;
          }
        }
      }
    if (winner == found.size()) continue;
    used[winner] = true;
    ++result.hits;
    result.square += best * best;
  }
  result.found += found.size();
  // The strips are fixed in px; their densities carry D^2 as each side knows it.
  for (const Centre& centre : found) found_heights.push_back((height - centre.y) / (2 * truth.front().radius_px));
  const double ratio = found_radius / truth.front().radius_px;
  const HeightBins bins{0, 1, static_cast<std::size_t>(height / (2 * truth.front().radius_px)) + 1};
  const Kernel kernel{KernelKind::gaussian, 0.4};
  const double bed_width = width / (2 * truth.front().radius_px);
  const auto a = density_of_frame(true_heights, bed_width, bins, kernel);
  const auto b = density_of_frame(found_heights, bed_width, bins, kernel);
  for (std::size_t k = 0; k < bins.count; ++k) {
    result.density_square += std::pow(b[k] * ratio * ratio - a[k], 2);
    result.density_count += 1;
  }
}

std::vector<Centre> hough(const GrayFrame& frame, double radius, double edge_threshold, double votes, double blur) {
  cv::Mat picture(frame.height, frame.width, CV_8U);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      picture.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::min(255.0F, std::max(0.0F, frame.at(column, row))) + 0.5F);
  if (blur > 0) cv::GaussianBlur(picture, picture, cv::Size(), blur);
  std::vector<cv::Vec3f> circles;
  cv::HoughCircles(picture, circles, cv::HOUGH_GRADIENT, 1.0, 1.6 * radius, edge_threshold, votes,
                   static_cast<int>(std::floor(0.85 * radius)), static_cast<int>(std::ceil(1.15 * radius)));
  std::vector<Centre> centres;
  for (const cv::Vec3f& circle : circles)
    centres.push_back({static_cast<double>(circle[0]), static_cast<double>(circle[1])});
  return centres;
}

// Limits and verdict of a row of the usual frames.
void judge(FinderBenchmarkRow& row) {
  row.has_limits = true;
  row.rms_limit_px = row.noise > 0 ? 1.3 * row.bound_px : 0.006;
  row.radius_limit_px = row.noise > 0 ? 0.02 : 0.005;
  row.density_limit = row.blur_px <= 1 ? 0.001 : 0.003;
  row.cpu_limit_ms = 60;
  const auto require = [&](bool kept, const char* what) {
    if (!kept) row.beyond += (row.beyond.empty() ? "" : ", ") + std::string(what);
  };
  require(row.recall >= 0.999, "recall");
  require(row.precision >= 0.999, "precision");
  require(row.rms_px <= row.rms_limit_px, "centres");
  require(std::abs(row.radius_error_px) <= row.radius_limit_px, "radius");
  require(row.density_error <= row.density_limit, "density");
  require(row.cpu_ms <= row.cpu_limit_ms, "time");
  row.within_limits = row.beyond.empty();
}

}  // namespace

double centre_bound_px(const std::vector<RenderedDisk>& disks, const Camera& camera) {
  if (disks.empty() || !(camera.read_noise > 0)) return 0;
  const double radius = disks.front().radius_px;
  const double edge = std::sqrt(camera.blur_px * camera.blur_px + 1.0 / 12);  // optics and pixel
  const double contrast = std::abs(camera.bead_level - camera.background_level);
  const double reach = radius + 4 * edge;
  // Slope of the profile against distance, and what the common radius and contrast change.
  constexpr double step = 0.02;
  const bool shaded = camera.shading != BeadShading::flat;
  const bool dark = camera.bead_level < camera.background_level;
  const auto value = [&](double size, double distance) {
    const BlurredShapes shapes = blurred_disk_shapes(size, edge, distance);
    if (!shaded) return shapes.flat;
    return dark ? shapes.flat - camera.shading_depth * shapes.sphere
                : (1 - camera.shading_depth) * shapes.flat + camera.shading_depth * shapes.sphere;
  };
  const auto count = static_cast<std::size_t>(reach / step) + 2;
  std::vector<double> level(count), wider(count), slope(count);
  for (std::size_t k = 0; k < count; ++k) {
    level[k] = value(radius, static_cast<double>(k) * step);
    wider[k] = (value(radius + 0.005, static_cast<double>(k) * step) - level[k]) / 0.005;
  }
  for (std::size_t k = 0; k + 1 < count; ++k) slope[k] = (level[k + 1] - level[k]) / step;
  // Information: 2 x 2 blocks of touching pairs, and a border of the two common unknowns.
  const std::size_t n = disks.size();
  struct Share {
    std::size_t disk;
    double x, y, wider, level;
  };
  std::vector<std::map<std::size_t, std::array<double, 4>>> blocks(n);  // [i][j >= i]: xx xy yx yy
  std::vector<std::array<double, 4>> border(n, {0, 0, 0, 0});           // x-radius, x-contrast, y-radius, y-contrast
  double rr = 0, rc = 0, cc = 0;
  std::unordered_map<std::int64_t, std::vector<Share>> pixels;
  for (std::size_t i = 0; i < n; ++i) {
    const RenderedDisk& disk = disks[i];
    for (int row = std::max(0, static_cast<int>(std::ceil(disk.y_px - reach)));
         row <= std::min(camera.height - 1, static_cast<int>(std::floor(disk.y_px + reach))); ++row)
      for (int column = std::max(0, static_cast<int>(std::ceil(disk.x_px - reach)));
           column <= std::min(camera.width - 1, static_cast<int>(std::floor(disk.x_px + reach))); ++column) {
        const double dx = column - disk.x_px, dy = row - disk.y_px, r = std::hypot(dx, dy);
        const auto k = static_cast<std::size_t>(r / step);
        if (k + 1 >= count || r < 1e-9) continue;
        pixels[static_cast<std::int64_t>(row) * camera.width + column].push_back(
            {i, -slope[k] * dx / r, -slope[k] * dy / r, wider[k], level[k]});
      }
  }
  for (const auto& [pixel, shares] : pixels) {
    double all_wider = 0, all_level = 0;
    for (const Share& share : shares) {
      all_wider += share.wider;
      all_level += share.level;
    }
    rr += all_wider * all_wider;
    rc += all_wider * all_level;
    cc += all_level * all_level;
    for (const Share& one : shares) {
      border[one.disk][0] += one.x * all_wider;
      border[one.disk][1] += one.x * all_level;
      border[one.disk][2] += one.y * all_wider;
      border[one.disk][3] += one.y * all_level;
      for (const Share& other : shares) {
        if (other.disk < one.disk) continue;
        auto& block = blocks[one.disk][other.disk];
        block[0] += one.x * other.x;
        block[1] += one.x * other.y;
        block[2] += one.y * other.x;
        block[3] += one.y * other.y;
      }
    }
  }
  // The bound of each disk with the two shells of neighbours it shares pixels with, all else known, plus the two common
  // unknowns: farther disks change it by less than a part in a thousand.
  std::vector<std::vector<std::size_t>> near(n);
  for (std::size_t i = 0; i < n; ++i)
    for (const auto& [j, block] : blocks[i])
      if (j != i) {
        near[i].push_back(j);
        near[j].push_back(i);
      }
  double sum = 0;
  std::size_t counted = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const RenderedDisk& disk = disks[i];
    if (disk.x_px < reach || disk.y_px < reach || disk.x_px > camera.width - 1 - reach ||
        disk.y_px > camera.height - 1 - reach)
      continue;
    std::vector<std::size_t> group = {i};
    for (const std::size_t j : near[i]) group.push_back(j);
    for (const std::size_t j : near[i])
      for (const std::size_t k : near[j])
        if (std::find(group.begin(), group.end(), k) == group.end()) group.push_back(k);
    const int size = static_cast<int>(2 * group.size() + 2);
    cv::Mat information = cv::Mat::zeros(size, size, CV_64F);
    for (std::size_t a = 0; a < group.size(); ++a)
      for (std::size_t b = 0; b < group.size(); ++b) {
        const std::size_t low = std::min(group[a], group[b]), high = std::max(group[a], group[b]);
        const auto found = blocks[low].find(high);
        if (found == blocks[low].end()) continue;
        const bool straight = group[a] <= group[b];
        const auto& block = found->second;
        const int row = static_cast<int>(2 * a), column = static_cast<int>(2 * b);
        information.at<double>(row, column) = block[0];
        information.at<double>(row, column + 1) = straight ? block[1] : block[2];
        information.at<double>(row + 1, column) = straight ? block[2] : block[1];
        information.at<double>(row + 1, column + 1) = block[3];
      }
    for (std::size_t a = 0; a < group.size(); ++a)
      for (int axis = 0; axis < 2; ++axis)
        for (int common = 0; common < 2; ++common) {
          const double coupling = border[group[a]][static_cast<std::size_t>(2 * axis + common)];
          information.at<double>(static_cast<int>(2 * a) + axis, size - 2 + common) = coupling;
          information.at<double>(size - 2 + common, static_cast<int>(2 * a) + axis) = coupling;
        }
    information.at<double>(size - 2, size - 2) = rr;
    information.at<double>(size - 2, size - 1) = information.at<double>(size - 1, size - 2) = rc;
    information.at<double>(size - 1, size - 1) = cc;
    cv::Mat inverse;
    if (cv::invert(information, inverse, cv::DECOMP_CHOLESKY) == 0) continue;
    sum += 0.5 * (inverse.at<double>(0, 0) + inverse.at<double>(1, 1));
    ++counted;
  }
  return counted ? camera.read_noise / contrast * std::sqrt(sum / static_cast<double>(counted)) : 0;
}

std::vector<FinderBenchmarkRow> benchmark_finder(const FinderBenchmarkOptions& options,
                                                 const std::function<void(const FinderBenchmarkRow&)>& progress) {
  std::vector<FinderBenchmarkRow> rows;
  const FinderBenchmarkOptions usual;
  const bool usual_frames = options.width == usual.width && options.height == usual.height &&
                            options.radius_px == usual.radius_px && options.rows == usual.rows &&
                            options.gas_count == usual.gas_count && options.with_bound;
  for (const BeadShading shading : {BeadShading::flat, BeadShading::shaded})
    for (const double blur : options.blurs)
      for (const double noise : options.noises) {
        Camera camera;
        camera.width = options.width;
        camera.height = options.height;
        camera.shading = shading;
        camera.blur_px = blur;
        camera.read_noise = noise;
        const FrameRenderer renderer(camera);
        std::vector<std::vector<RenderedDisk>> truths;
        std::vector<GrayFrame> frames;
        for (std::size_t k = 0; k < options.frames; ++k) {
          SyntheticBed bed;
          bed.left_wall_px = 0.4 * options.radius_px + 0.37 * static_cast<double>(k);
          bed.right_wall_px = options.width - 1 - 0.3 * options.radius_px;
          bed.floor_px = options.height - 1 - 0.7 * options.radius_px;
          bed.radius_px = options.radius_px;
          bed.rows = options.rows;
          bed.gas_count = options.gas_count;
          bed.gas_height_px = 0.2 * options.height;
          bed.jitter_px = 0.01 * options.radius_px;
          bed.seed = k + 1;
          truths.push_back(make_synthetic_bed(bed));
          frames.push_back(renderer.render(truths.back(), k));
        }
        FinderBenchmarkRow base;
        base.shading = shading;
        base.blur_px = blur;
        base.noise = noise;
        if (options.with_bound && !frames.empty()) base.bound_px = centre_bound_px(truths.front(), camera);
        const auto finish = [&](FinderBenchmarkRow row, const Tally& result, double seconds, bool judged = false) {
          row.recall = result.truths ? static_cast<double>(result.hits) / static_cast<double>(result.truths) : 0;
          row.precision = result.found ? static_cast<double>(result.hits) / static_cast<double>(result.found) : 0;
          row.rms_px = result.hits ? std::sqrt(result.square / 2 / static_cast<double>(result.hits)) : 0;
          row.density_error = result.density_count > 0 ? std::sqrt(result.density_square / result.density_count) : 0;
          row.cpu_ms = 1e3 * seconds / static_cast<double>(std::max<std::size_t>(1, frames.size()));
          if (judged && usual_frames) judge(row);
          rows.push_back(row);
          if (progress) progress(row);
        };
        if (options.with_hough) {
          struct Setting {
            double edge, votes, smooth;
          } best{};
          const auto run = [&](const Setting& setting, std::size_t count, Tally& result) {
            double seconds = 0;
            for (std::size_t k = 0; k < count; ++k) {
              const double start = cpu_seconds();
              const std::vector<Centre> found =
                  hough(frames[k], options.radius_px, setting.edge, setting.votes, setting.smooth);
              seconds += cpu_seconds() - start;
              tally(found, truths[k], options.width, options.height, options.radius_px, result);
            }
            return seconds;
          };
          constexpr std::size_t tuned_on = 4;  // frames
          double best_merit = -1;
          for (const double edge : {30.0, 60.0, 120.0, 200.0})
            for (const double votes : {4.0, 6.0, 8.0, 11.0, 15.0})
              for (const double smooth : {0.0, 1.0, 1.5}) {
                Tally result;
                run({edge, votes, smooth}, std::min(tuned_on, frames.size()), result);
                const double merit =
                    static_cast<double>(result.hits) - 0.5 * static_cast<double>(result.found - result.hits);
                if (merit > best_merit) {
                  best_merit = merit;
                  best = {edge, votes, smooth};
                }
              }
          FinderBenchmarkRow row = base;
          row.method = "hough";
          Tally result;
          const double seconds = run(best, frames.size(), result);
          finish(row, result, seconds);
        }
        const double start = cpu_seconds();
        const CalibrationResult calibrated = calibrate_finder({&frames.front()});
        const double calibration_seconds = cpu_seconds() - start;
        const std::vector<std::pair<int, const char*>> costs = {
            {0, "map"}, {1, "1 sweep"}, {2, "2 sweeps"}, {3, "3 sweeps"}, {20, "joint fit"}};
        for (const auto& [sweeps, name] : costs) {
          FinderBenchmarkRow row = base;
          row.method = name;
          Tally result;
          double seconds = calibration_seconds;
          if (calibrated.found) {
            FindOptions find;
            find.joint_fit_sweeps = sweeps;
            FinderCalibration calibration = calibrated.calibration;
            RadiusFromFrames radius;
            std::vector<std::vector<Centre>> all_centres;
            for (std::size_t k = 0; k < frames.size(); ++k) {
              const double frame_start = cpu_seconds();
              find.learn_rim = sweeps == 20 && k < rim_frames;
              const FindResult found = find_disks(frames[k], calibrated.calibration, find);
              radius.add(found);
              seconds += cpu_seconds() - frame_start;
              std::vector<Centre> centres;
              for (const FoundDisk& disk : found.disks) centres.push_back({disk.x_px, disk.y_px});
              all_centres.push_back(std::move(centres));
            }
            const double refine_start = cpu_seconds();
            radius.refine(calibration);
            seconds += cpu_seconds() - refine_start;
            row.radius_error_px = calibration.radius_px - options.radius_px;
            for (std::size_t k = 0; k < frames.size(); ++k)
              tally(all_centres[k], truths[k], options.width, options.height, calibration.radius_px, result);
          }
          finish(row, result, seconds, sweeps == 20);
        }
      }
  return rows;
}

std::string finder_benchmark_table(const std::vector<FinderBenchmarkRow>& rows) {
  std::string text =
      "look            method     recall  precision  rms_px   bound_px  rms/bound  radius_error  density_error  "
      "cpu_ms  verdict\n";
  char line[256];
  for (const FinderBenchmarkRow& row : rows) {
    std::snprintf(line, sizeof line,
                  "%-6s b%-3g n%-4g %-10s %.4f  %.4f     %.4f   %.4f    %-9.2f  %+.4f       %.5f        %-7.1f %s\n",
                  row.shading == BeadShading::flat ? "flat" : "shaded", row.blur_px, row.noise, row.method.c_str(),
                  row.recall, row.precision, row.rms_px, row.bound_px,
                  row.bound_px > 0 ? row.rms_px / row.bound_px : 0.0, row.radius_error_px, row.density_error,
                  row.cpu_ms, row.has_limits ? (row.within_limits ? "pass" : "FAIL") : "");
    text += line;
  }
  return text;
}

}  // namespace shakebed::ingest
