#include "ingest/synthetic/synthetic_frames.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>

#include "ingest/find/blurred_disk.hpp"
#include "ingest/synthetic/random_stream.hpp"

namespace shakebed::ingest {

const float* normal_quantiles() {
  static const std::vector<float> table = [] {
    constexpr std::size_t count = 65536;
    std::vector<float> quantiles(count);
    std::vector<double> exact(count);
    double x = 0;
    double sum_of_squares = 0;
    for (std::size_t i = count / 2; i < count; ++i) {
      const double probability = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      for (int step = 0; step < 20; ++step) {  // Newton from the neighbour's quantile
        const double upper = 0.5 * std::erfc(x / std::numbers::sqrt2);
        const double density = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
        const double change = (upper - (1 - probability)) / density;
        x += change;
        if (std::abs(change) < 1e-12) break;
      }
      exact[i] = x;
      exact[count - 1 - i] = -x;
      sum_of_squares += 2 * x * x;
    }
    const double to_unit = 1 / std::sqrt(sum_of_squares / static_cast<double>(count));
    for (std::size_t i = 0; i < count; ++i) quantiles[i] = static_cast<float>(exact[i] * to_unit);
    return quantiles;
  }();
  return table.data();
}

double RandomStream::normal() { return static_cast<double>(normal_quantiles()[next() >> 48U]); }

// Blurred contrast against the distance to the centre, linear between samples `step` apart.
struct BlurredDisk {
  double step = 0.01;
  double reach = 0;  // px, beyond which it is 0
  double core = 0;   // px, within which it is smooth on the scale of a pixel
  std::vector<float> contrast;
  [[nodiscard]] double at(double distance) const {
    const double position = distance / step;
    const std::size_t cell = static_cast<std::size_t>(position);
    if (cell + 1 >= contrast.size()) return 0;
    const double part = position - static_cast<double>(cell);
    return static_cast<double>(contrast[cell]) * (1 - part) + static_cast<double>(contrast[cell + 1]) * part;
  }
};

namespace {

// Below this optical blur a disk is drawn sharp: its edge is then the pixel's own.
constexpr double sharp_below_px = 0.12;

BlurredDisk blur_disk(double radius, double blur, const RadialContrast& contrast) {
  BlurredDisk disk;
  disk.step = blur / 50;
  disk.reach = radius + 5.5 * blur;
  disk.core = radius - 5 * blur - 0.75;
  const std::size_t count = static_cast<std::size_t>(disk.reach / disk.step) + 2;
  disk.contrast.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    disk.contrast[i] =
        static_cast<float>(blurred_disk_contrast(radius, blur, contrast, static_cast<double>(i) * disk.step));
  return disk;
}

// Area of the part of the rectangle [x0, x1] x [y0, y1] inside the circle of radius `radius` around the origin. Exact.
double circle_rectangle_area(double radius, double x0, double x1, double y0, double y1) {
  const auto half_chord_integral = [radius](double x) {  // integral of sqrt(R^2 - x^2)
    const double c = std::clamp(x / radius, -1.0, 1.0);
    return 0.5 * (x * std::sqrt(std::max(0.0, radius * radius - x * x)) + radius * radius * std::asin(c));
  };
  std::array<double, 8> cuts{};
  std::size_t cut_count = 0;
  const double left = std::max(x0, -radius), right = std::min(x1, radius);
  if (left >= right) return 0;
  cuts[cut_count++] = left;
  for (const double y : {y0, y1}) {
    if (std::abs(y) >= radius) continue;
    const double x = std::sqrt(radius * radius - y * y);
    if (-x > left && -x < right) cuts[cut_count++] = -x;
    if (x > left && x < right) cuts[cut_count++] = x;
  }
  cuts[cut_count++] = right;
  for (std::size_t i = 1; i < cut_count; ++i)
    for (std::size_t j = i; j > 0 && cuts[j] < cuts[j - 1]; --j) std::swap(cuts[j], cuts[j - 1]);
  double area = 0;
  for (std::size_t i = 0; i + 1 < cut_count; ++i) {
    const double a = cuts[i], b = cuts[i + 1];
    if (b <= a) continue;
    const double middle = 0.5 * (a + b);
    const double half = std::sqrt(std::max(0.0, radius * radius - middle * middle));
    if (half <= y0 || -half >= y1) continue;
    const double chord = half_chord_integral(b) - half_chord_integral(a);
    const double top = half < y1 ? chord : y1 * (b - a);       // upper bound: min(h, y1)
    const double bottom = -half > y0 ? -chord : y0 * (b - a);  // lower bound: max(-h, y0)
    area += top - bottom;
  }
  return std::max(0.0, area);
}

double middle_brightening(double rho) { return std::sqrt(std::max(0.0, 1 - rho * rho)); }

}  // namespace

struct FrameRenderer::State {
  Camera camera;
  RadialContrast opaque, transparent;
  std::vector<float> light;  // illumination (dust included), 1 where full; empty when even
  GaussLegendre pixel_rule;
  mutable std::mutex mutex;
  mutable std::map<std::pair<double, bool>, std::shared_ptr<const BlurredDisk>> tables;

  [[nodiscard]] bool sharp() const { return camera.blur_px < sharp_below_px; }

  std::shared_ptr<const BlurredDisk> table(double radius, bool is_transparent) const {
    const std::lock_guard<std::mutex> lock(mutex);
    auto& slot = tables[{radius, is_transparent}];
    if (!slot)
      slot =
          std::make_shared<const BlurredDisk>(blur_disk(radius, camera.blur_px, is_transparent ? transparent : opaque));
    if (tables.size() > 4096) {  // beds of ever new radii: do not hoard
      auto kept = slot;
      tables.clear();
      return kept;
    }
    return slot;
  }

  void add_blurred(const BlurredDisk& disk, double x, double y, float weight, std::vector<float>& contrast) const;
  void add_sharp(double radius, const RadialContrast& profile, double x, double y, float weight,
                 std::vector<float>& contrast) const;
  void add_spot(double x, double y, double sigma, double amplitude, std::vector<float>& contrast) const;
  [[nodiscard]] DrawnAs fate_of(std::size_t i) const;
  void add_disk(const RenderedDisk& disk, bool is_transparent, std::vector<float>& contrast) const;
  void expose(std::uint64_t frame_index, std::vector<float>& contrast) const;
};

void FrameRenderer::State::add_blurred(const BlurredDisk& disk, double x, double y, float weight,
                                       std::vector<float>& contrast) const {
  const double reach = disk.reach + 0.75;
  const int top = std::max(0, static_cast<int>(std::ceil(y - reach)));
  const int bottom = std::min(camera.height - 1, static_cast<int>(std::floor(y + reach)));
  const std::size_t nodes = pixel_rule.node.size();
  const double core_squared = disk.core > 0 ? disk.core * disk.core : -1;
  const float inverse_step = static_cast<float>(1 / disk.step);
  const float* table = disk.contrast.data();
  const int last = static_cast<int>(disk.contrast.size()) - 1;
  for (int row = top; row <= bottom; ++row) {
    const double dy = row - y;
    const double half = reach * reach - dy * dy;
    if (half <= 0) continue;
    const double half_chord = std::sqrt(half);
    const int left = std::max(0, static_cast<int>(std::ceil(x - half_chord)));
    const int right = std::min(camera.width - 1, static_cast<int>(std::floor(x + half_chord)));
    float* line = contrast.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width);
    for (int column = left; column <= right; ++column) {
      const double dx = column - x;
      const double squared = dx * dx + dy * dy;
      if (squared < core_squared) {
        line[column] += weight * static_cast<float>(disk.at(std::sqrt(squared)));
        continue;
      }
      float sum = 0;
      for (std::size_t i = 0; i < nodes; ++i) {
        const float sub_y = static_cast<float>(dy + pixel_rule.node[i] - 0.5);
        float row_sum = 0;
        for (std::size_t j = 0; j < nodes; ++j) {
          const float sub_x = static_cast<float>(dx + pixel_rule.node[j] - 0.5);
          const float position = std::sqrt(sub_x * sub_x + sub_y * sub_y) * inverse_step;
          const int cell = static_cast<int>(position);
          if (cell >= last) continue;
          const float part = position - static_cast<float>(cell);
          row_sum += static_cast<float>(pixel_rule.weight[j]) * (table[cell] * (1 - part) + table[cell + 1] * part);
        }
        sum += static_cast<float>(pixel_rule.weight[i]) * row_sum;
      }
      line[column] += weight * sum;
    }
  }
}

void FrameRenderer::State::add_sharp(double radius, const RadialContrast& profile, double x, double y, float weight,
                                     std::vector<float>& contrast) const {
  const double reach = radius + 0.75;
  const int top = std::max(0, static_cast<int>(std::ceil(y - reach)));
  const int bottom = std::min(camera.height - 1, static_cast<int>(std::floor(y + reach)));
  const int left = std::max(0, static_cast<int>(std::ceil(x - reach)));
  const int right = std::min(camera.width - 1, static_cast<int>(std::floor(x + reach)));
  const bool flat = profile(0.0) == profile(0.9);
  for (int row = top; row <= bottom; ++row) {
    float* line = contrast.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width);
    for (int column = left; column <= right; ++column) {
      const double dx = column - x, dy = row - y;
      const double distance = std::sqrt(dx * dx + dy * dy);
      if (distance >= radius + 0.7072) continue;
      const bool inside = distance <= radius - 0.7072;
      const double covered = inside ? 1.0 : circle_rectangle_area(radius, dx - 0.5, dx + 0.5, dy - 0.5, dy + 0.5);
      if (covered <= 0) continue;
      double level = 1;
      if (flat) {
        level = profile(0.5);
      } else {
        const int samples = inside && distance < radius - 2 ? 2 : 8;
        double sum = 0;
        int hits = 0;
        for (int i = 0; i < samples; ++i)
          for (int j = 0; j < samples; ++j) {
            const double sub_x = dx - 0.5 + (j + 0.5) / samples, sub_y = dy - 0.5 + (i + 0.5) / samples;
            const double rho = std::sqrt(sub_x * sub_x + sub_y * sub_y) / radius;
            if (rho > 1) continue;
            sum += profile(rho);
            ++hits;
          }
        level = hits ? sum / hits : profile(1.0);
      }
      line[column] += weight * static_cast<float>(covered * level);
    }
  }
}

void FrameRenderer::State::add_spot(double x, double y, double sigma, double amplitude,
                                    std::vector<float>& contrast) const {
  const double width_squared = sigma * sigma + camera.blur_px * camera.blur_px + 1.0 / 12;
  const double peak = amplitude * sigma * sigma / width_squared;
  const double reach = 5 * std::sqrt(width_squared);
  const int top = std::max(0, static_cast<int>(std::ceil(y - reach)));
  const int bottom = std::min(camera.height - 1, static_cast<int>(std::floor(y + reach)));
  const int left = std::max(0, static_cast<int>(std::ceil(x - reach)));
  const int right = std::min(camera.width - 1, static_cast<int>(std::floor(x + reach)));
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column) {
      const double dx = column - x, dy = row - y;
      contrast[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) +
               static_cast<std::size_t>(column)] +=
          static_cast<float>(peak * std::exp(-0.5 * (dx * dx + dy * dy) / width_squared));
    }
}

namespace {

void require_possible(const Camera& camera) {
  const auto require = [](bool condition, const char* what) {
    if (!condition) throw std::invalid_argument(std::string("camera: ") + what);
  };
  require(camera.width > 0 && camera.height > 0, "width and height must be at least 1 px");
  require(camera.blur_px >= 0 && camera.exposure_s >= 0, "blur and exposure must not be negative");
  require(camera.read_noise >= 0 && camera.shot_noise >= 0, "noise must not be negative");
  require(std::abs(camera.gradient_x) < 1 && std::abs(camera.gradient_y) < 1 && camera.vignette < 1,
          "gradient and vignette must be below 1");
  require(camera.jpeg_quality >= 0 && camera.jpeg_quality <= 100, "jpeg_quality must lie in 0 .. 100");
  require(camera.dust_fraction >= 0 && camera.dust_fraction < 0.9, "dust_fraction must lie in 0 .. 0.9");
  require(camera.background_level != camera.bead_level, "beads and background have the same level");
}

// Specks that hold back light.
void add_dust(const Camera& camera, std::vector<float>& light) {
  const std::size_t width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  RandomStream random(camera.seed, 0xd057, 0);
  const double total = camera.dust_fraction * static_cast<double>(width) * static_cast<double>(height);
  double covered = 0;
  while (covered < total) {
    const double radius = 0.5 * camera.dust_size_px * (0.4 + 1.2 * random.uniform());
    const double x = random.uniform() * camera.width, y = random.uniform() * camera.height;
    const float level = static_cast<float>(0.35 + 0.5 * random.uniform());  // what is left of the light
    covered += std::max(0.5, std::numbers::pi * radius * radius);
    const int reach = static_cast<int>(radius + 2);
    for (int row = static_cast<int>(y) - reach; row <= static_cast<int>(y) + reach; ++row)
      for (int column = static_cast<int>(x) - reach; column <= static_cast<int>(x) + reach; ++column) {
        if (row < 0 || column < 0 || row >= camera.height || column >= camera.width) continue;
        const double distance = std::hypot(column - x, row - y);
        const double soft = std::clamp(radius + 0.5 - distance, 0.0, 1.0);
        float& there = light[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)];
        there *= static_cast<float>(1 - soft) + static_cast<float>(soft) * level;
      }
  }
}

// The illumination, 1 where full; empty when even.
std::vector<float> light_of(const Camera& camera) {
  const bool even =
      camera.gradient_x == 0 && camera.gradient_y == 0 && camera.vignette == 0 && camera.dust_fraction == 0;
  if (even) return {};
  const std::size_t width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  std::vector<float> light(width * height);
  const double middle_x = 0.5 * (camera.width - 1), middle_y = 0.5 * (camera.height - 1);
  const double corner_squared = std::max(1e-9, middle_x * middle_x + middle_y * middle_y);
  const double brightest = 1 + 0.5 * std::abs(camera.gradient_x) + 0.5 * std::abs(camera.gradient_y);
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t column = 0; column < width; ++column) {
      const double u = camera.width > 1 ? static_cast<double>(column) / (camera.width - 1) - 0.5 : 0;
      const double v = camera.height > 1 ? static_cast<double>(row) / (camera.height - 1) - 0.5 : 0;
      const double dx = static_cast<double>(column) - middle_x, dy = static_cast<double>(row) - middle_y;
      double level = (1 + camera.gradient_x * u + camera.gradient_y * v) / brightest;
      level *= 1 - camera.vignette * (dx * dx + dy * dy) / corner_squared;
      light[row * width + column] = static_cast<float>(level);
    }
  if (camera.dust_fraction > 0) add_dust(camera, light);
  return light;
}

}  // namespace

FrameRenderer::FrameRenderer(const Camera& camera) : state_(std::make_unique<State>()) {
  require_possible(camera);
  State& state = *state_;
  state.camera = camera;
  const bool dark = camera.bead_level < camera.background_level;
  const double depth = camera.shading_depth;
  // Light on a sphere brightens its middle: dark beads lose contrast there, bright ones lose it at the rim.
  if (camera.shading == BeadShading::flat)
    state.opaque = [](double) { return 1.0; };
  else if (dark)
    state.opaque = [depth](double rho) { return 1 - depth * middle_brightening(rho); };
  else
    state.opaque = [depth](double rho) { return 1 - depth + depth * middle_brightening(rho); };
  state.transparent = [](double rho) {
    const double rho2 = rho * rho, rho4 = rho2 * rho2;
    return 0.12 + 0.7 * rho4 * rho4;
  };
  const double blur = camera.blur_px;
  state.pixel_rule = gauss_legendre(blur >= 0.7 ? 2 : blur >= 0.35 ? 4 : 10);
  state.light = light_of(camera);
}

FrameRenderer::~FrameRenderer() = default;
FrameRenderer::FrameRenderer(FrameRenderer&&) noexcept = default;
FrameRenderer& FrameRenderer::operator=(FrameRenderer&&) noexcept = default;
const Camera& FrameRenderer::camera() const { return state_->camera; }

// What becomes of disk `i` of a film: the same bead is transparent or missing in every frame.
DrawnAs FrameRenderer::State::fate_of(std::size_t i) const {
  RandomStream lot(camera.seed, 0xbead, i);
  const double lottery = lot.uniform();
  if (lottery < camera.missing_fraction) return DrawnAs::missing;
  return lottery < camera.missing_fraction + camera.transparent_fraction ? DrawnAs::transparent : DrawnAs::opaque;
}

// Adds a disk that is not missing to `contrast`, at several moments of the exposure if it moves.
void FrameRenderer::State::add_disk(const RenderedDisk& disk, bool is_transparent, std::vector<float>& contrast) const {
  const double streak_x = disk.velocity_x_px_per_s * camera.exposure_s;
  const double streak_y = disk.velocity_y_px_per_s * camera.exposure_s;
  const double streak = std::hypot(streak_x, streak_y);
  const double smooth = std::max(0.25, camera.blur_px);
  const std::size_t moments = streak < 0.02 ? 1 : static_cast<std::size_t>(std::ceil(streak / (1.5 * smooth))) + 1;
  const double reach = disk.radius_px + 6 * camera.blur_px + 1 + 0.5 * streak;
  if (disk.x_px < -reach || disk.y_px < -reach || disk.x_px > camera.width + reach || disk.y_px > camera.height + reach)
    return;
  std::shared_ptr<const BlurredDisk> blurred;
  if (!sharp()) blurred = table(disk.radius_px, is_transparent);
  const GaussLegendre rule = moments > 1 ? gauss_legendre(moments) : GaussLegendre{{0.5}, {1.0}};
  for (std::size_t k = 0; k < moments; ++k) {
    const double x = disk.x_px + (rule.node[k] - 0.5) * streak_x;
    const double y = disk.y_px + (rule.node[k] - 0.5) * streak_y;
    const float weight = static_cast<float>(rule.weight[k]);
    if (blurred)
      add_blurred(*blurred, x, y, weight, contrast);
    else
      add_sharp(disk.radius_px, is_transparent ? transparent : opaque, x, y, weight, contrast);
    if (camera.shading == BeadShading::highlight && !is_transparent)
      add_spot(x - 0.3 * disk.radius_px, y - 0.3 * disk.radius_px, 0.12 * disk.radius_px,
               -static_cast<double>(weight) * camera.highlight_level * (1 - camera.shading_depth), contrast);
  }
}

// Grey levels from the contrast: the light, and the noise of frame `frame_index`.
void FrameRenderer::State::expose(std::uint64_t frame_index, std::vector<float>& contrast) const {
  const std::size_t width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  const float background = static_cast<float>(camera.background_level);
  const float depth = static_cast<float>(camera.bead_level - camera.background_level);
  const bool noisy = camera.read_noise > 0 || camera.shot_noise > 0;
  const float* quantiles = noisy ? normal_quantiles() : nullptr;
  const float read_variance = static_cast<float>(camera.read_noise * camera.read_noise);
  const float shot_variance = static_cast<float>(camera.shot_noise * camera.shot_noise / 255.0);
  for (std::size_t row = 0; row < height; ++row) {
    float* line = contrast.data() + row * width;
    const float* lit = light.empty() ? nullptr : light.data() + row * width;
    for (std::size_t column = 0; column < width; ++column) {
      const float level = background + depth * std::min(1.0F, line[column]);  // overlapping beads hide one another
      line[column] = lit ? level * lit[column] : level;
    }
    if (!noisy) continue;
    RandomStream random(camera.seed, frame_index + 1, row);
    std::uint64_t word = 0;
    for (std::size_t column = 0; column < width; ++column) {
      word = column % 4 == 0 ? random.next() : word >> 16U;
      const float variance = read_variance + shot_variance * std::max(0.0F, line[column]);
      line[column] += std::sqrt(variance) * quantiles[word & 0xffffU];
    }
  }
}

namespace {

// As a camera's JPEG gives it back.
void compress(GrayFrame& frame, int quality) {
  const std::size_t width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
  cv::Mat picture(frame.height, frame.width, CV_8U);
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t column = 0; column < width; ++column)
      picture.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column)) =
          static_cast<std::uint8_t>(std::clamp(frame.pixels[row * width + column], 0.0F, 255.0F) + 0.5F);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t column = 0; column < width; ++column)
      frame.pixels[row * width + column] = decoded.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column));
}

}  // namespace

GrayFrame FrameRenderer::render(const std::vector<RenderedDisk>& disks, std::uint64_t frame_index,
                                std::vector<DrawnAs>* drawn_as) const {
  const Camera& camera = state_->camera;
  GrayFrame frame;
  frame.width = camera.width;
  frame.height = camera.height;
  frame.pixels.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0F);
  if (drawn_as) drawn_as->assign(disks.size(), DrawnAs::opaque);
  for (std::size_t i = 0; i < disks.size(); ++i) {
    const RenderedDisk& disk = disks[i];
    if (!(disk.radius_px > 0) || !std::isfinite(disk.x_px) || !std::isfinite(disk.y_px))
      throw std::invalid_argument("disk " + std::to_string(i) + ": radius and centre must be finite, radius positive");
    const DrawnAs fate = state_->fate_of(i);
    if (drawn_as) (*drawn_as)[i] = fate;
    // The contrast is in units of bead minus background until the light is put on.
    if (fate != DrawnAs::missing) state_->add_disk(disk, fate == DrawnAs::transparent, frame.pixels);
  }
  state_->expose(frame_index, frame.pixels);
  if (camera.jpeg_quality > 0) compress(frame, camera.jpeg_quality);
  if (camera.round_to_8_bits)
    for (float& level : frame.pixels)
      level = static_cast<float>(static_cast<int>(std::min(255.0F, std::max(0.0F, level)) + 0.5F));
  return frame;
}

GrayFrame render_frame(const std::vector<RenderedDisk>& disks, const Camera& camera, std::uint64_t frame_index) {
  return FrameRenderer(camera).render(disks, frame_index);
}

std::vector<RenderedDisk> make_synthetic_bed(const SyntheticBed& bed) {
  if (!(bed.radius_px > 0) || !(bed.right_wall_px - bed.left_wall_px >= 2 * bed.radius_px))
    throw std::invalid_argument(
        "synthetic bed: the distance of the walls must be larger than a disk of positive radius");
  const double radius = bed.radius_px, diameter = 2 * radius;
  RandomStream random(bed.seed, 0xbed, 0);
  std::vector<RenderedDisk> disks;
  const double room = bed.right_wall_px - bed.left_wall_px;
  double top = bed.floor_px;
  const double keep = diameter - 1e-9;
  const auto touches = [&](double x, double y, std::size_t except) {
    for (std::size_t i = 0; i < disks.size(); ++i) {
      if (i == except || std::abs(disks[i].y_px - y) >= diameter) continue;
      const double dx = disks[i].x_px - x, dy = disks[i].y_px - y;
      if (dx * dx + dy * dy < keep * keep) return true;
    }
    return false;
  };
  for (int row = 0; row < bed.rows; ++row) {
    const double offset = row % 2 == 1 ? radius : 0;
    const double y = bed.floor_px - radius - row * radius * std::numbers::sqrt3;
    for (int k = 0;; ++k) {
      const double x = bed.left_wall_px + radius + offset + k * diameter;
      if (x + radius > bed.left_wall_px + room + 1e-9) break;
      disks.push_back({x, y, radius, 0, 0});
    }
    top = y - radius;
  }
  if (bed.jitter_px > 0)
    for (std::size_t i = 0; i < disks.size(); ++i) {
      const double x = disks[i].x_px + bed.jitter_px * random.normal(),
                   y = disks[i].y_px + bed.jitter_px * random.normal();
      if (x - radius < bed.left_wall_px || x + radius > bed.right_wall_px || y + radius > bed.floor_px) continue;
      if (touches(x, y, i)) continue;
      disks[i].x_px = x;
      disks[i].y_px = y;
    }
  int placed = 0;
  for (long attempt = 0; placed < bed.gas_count && attempt < 2000L * bed.gas_count; ++attempt) {
    const double x = bed.left_wall_px + radius + random.uniform() * (room - diameter);
    const double y = top - radius + bed.gas_height_px * std::log(1 - random.uniform());
    if (touches(x, y, disks.size())) continue;
    disks.push_back({x, y, radius, 0, 0});
    ++placed;
  }
  return disks;
}

}  // namespace shakebed::ingest
