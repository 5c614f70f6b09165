#include "fit/map/empirical_map.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace shakebed::fit {

EmpiricalMap::EmpiricalMap(std::vector<MapAxis> axes, std::vector<MapPoint> points)
    : axes_(std::move(axes)), points_(std::move(points)) {
  const auto fail = [this](FitStatus status, std::string why) {
    status_ = status;
    message_ = std::move(why);
  };
  if (axes_.empty()) {
    fail(FitStatus::bad_input, "a map needs at least one axis");
    return;
  }
  for (const MapPoint& point : points_) {
    bool good = point.position.size() == axes_.size() && std::isfinite(point.temperature) && point.temperature > 0.0 &&
                std::isfinite(point.std_error) && point.std_error >= 0.0;
    for (std::size_t i = 0; good && i < axes_.size(); ++i) {
      good = std::isfinite(point.position[i]) && (!axes_[i].logarithmic || point.position[i] > 0.0);
    }
    if (!good) {
      fail(FitStatus::bad_input,
           "a point of the map is not finite, not positive or has the wrong number of coordinates");
      return;
    }
  }
  if (points_.size() < axes_.size() + 2) {
    fail(FitStatus::too_few_bins, "the map has " + std::to_string(points_.size()) + " points; a fit of " +
                                      std::to_string(axes_.size()) + " axes needs at least " +
                                      std::to_string(axes_.size() + 2));
    return;
  }
  low_.assign(axes_.size(), std::numeric_limits<double>::infinity());
  high_.assign(axes_.size(), -std::numeric_limits<double>::infinity());
  const auto coordinate = [this](const MapPoint& point, std::size_t i) {
    return axes_[i].logarithmic ? std::log(point.position[i]) : point.position[i];
  };
  for (const MapPoint& point : points_) {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      low_[i] = std::min(low_[i], coordinate(point, i));
      high_[i] = std::max(high_[i], coordinate(point, i));
    }
  }
  for (const MapPoint& point : points_) unit_.push_back(to_unit(point.position));
  double sum = 0.0;
  int count = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    double log_temperature = 0.0;
    double error = 0.0;
    if (!predict(unit_[p], p, log_temperature, error)) continue;
    sum += std::pow(log_temperature - std::log(points_[p].temperature), 2);
    ++count;
  }
  if (count > 0) interpolation_error_ = std::sqrt(sum / count);
}

std::vector<double> EmpiricalMap::to_unit(std::span<const double> position) const {
  std::vector<double> unit(axes_.size());
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const double x = axes_[i].logarithmic ? std::log(position[i]) : position[i];
    const double range = high_[i] - low_[i];
    unit[i] = range > 0.0 ? (x - low_[i]) / range : x - low_[i];
  }
  return unit;
}

bool EmpiricalMap::predict(std::span<const double> unit, std::size_t left_out, double& log_temperature,
                           double& error) const {
  const auto n = axes_.size();
  std::vector<double> distances;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    double distance = 0.0;
    for (std::size_t i = 0; i < n; ++i) distance += std::pow(unit_[p][i] - unit[i], 2);
    distances.push_back(p == left_out ? std::numeric_limits<double>::infinity() : std::sqrt(distance));
  }
  // The nearest 2 (axes + 1) points set the width of the weight.
  std::vector<double> sorted = distances;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t available = points_.size() - (left_out < points_.size() ? 1 : 0);
  const double width = std::max(1e-9, 0.5 * sorted[std::min(available - 1, 2 * (n + 1))]);
  const auto columns = static_cast<Eigen::Index>(n + 1);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(columns);
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(columns, columns);
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (!std::isfinite(distances[p])) continue;
    const double s = distances[p] / width;
    const double relative = points_[p].std_error / points_[p].temperature;
    const double weight = std::exp(-0.5 * s * s) / (1e-4 + relative * relative);
    if (!(weight > 0.0)) continue;
    Eigen::VectorXd row(columns);
    row[0] = 1.0;
    for (std::size_t i = 0; i < n; ++i) row[static_cast<Eigen::Index>(i) + 1] = unit_[p][i] - unit[i];
    normal += weight * row * row.transpose();
    right += weight * std::log(points_[p].temperature) * row;
    noise += weight * weight * relative * relative * row * row.transpose();
  }
  // A direction in which the table does not vary has no slope.
  normal.diagonal().tail(columns - 1).array() += 1e-9 * normal(0, 0);
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  if (solver.info() != Eigen::Success || !(normal(0, 0) > 0.0)) return false;
  const Eigen::VectorXd solution = solver.solve(right);
  const Eigen::VectorXd first = solver.solve(Eigen::VectorXd::Unit(columns, 0));
  log_temperature = solution[0];
  error = std::sqrt(std::max(0.0, first.dot(noise * first)));
  return std::isfinite(log_temperature) && std::isfinite(error);
}

EmpiricalMap::Prediction EmpiricalMap::at(std::span<const double> position) const {
  Prediction prediction;
  prediction.status = status_;
  if (status_ != FitStatus::ok) return prediction;
  bool good = position.size() == axes_.size();
  for (std::size_t i = 0; good && i < axes_.size(); ++i) {
    good = std::isfinite(position[i]) && (!axes_[i].logarithmic || position[i] > 0.0);
  }
  if (!good) {
    prediction.status = FitStatus::bad_input;
    return prediction;
  }
  const std::vector<double> unit = to_unit(position);
  double log_temperature = 0.0;
  double error = 0.0;
  if (!predict(unit, points_.size(), log_temperature, error)) {
    prediction.status = FitStatus::not_converged;
    return prediction;
  }
  prediction.inside = true;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const double range = high_[i] - low_[i];
    const double slack = 1e-12;
    prediction.inside = prediction.inside && unit[i] >= -slack && unit[i] <= (range > 0.0 ? 1.0 : 0.0) + slack;
  }
  const double value = std::exp(log_temperature);
  prediction.temperature = {value, value * std::hypot(error, interpolation_error_), false};
  return prediction;
}

}  // namespace shakebed::fit
