// A locally linear policy from its arrays, with no library: π(x) = Σ_m b_m(x) (coef_m x + intercept_m), where b are the
// activations exp(-‖(x - centers_m) / width‖² / 2), divided by their sum. Nothing is allocated in a step.
#pragma once

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

class LocalPolicy {
 public:
  // A file of doubles: M, n, d, then centers (M, n), width (n), coef (M, d, n) and intercept (M, d).
  explicit LocalPolicy(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const auto read = [&](std::size_t count) {
      std::vector<double> numbers(count);
      if (!file.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(count * sizeof(double))))
        throw std::runtime_error(path + " is missing or too short");
      return numbers;
    };
    const auto sizes = read(3);
    M_ = static_cast<std::size_t>(sizes[0]);
    n_ = static_cast<std::size_t>(sizes[1]);
    d_ = static_cast<std::size_t>(sizes[2]);
    centers_ = read(M_ * n_);
    width_ = read(n_);
    coef_ = read(M_ * d_ * n_);
    intercept_ = read(M_ * d_);
    x_.resize(n_);
    u_.resize(d_);
    b_.resize(M_);
  }

  // Fill x before, and read u after.
  void act() {
    for (std::size_t m = 0; m < M_; ++m) {
      double squared = 0.0;
      for (std::size_t j = 0; j < n_; ++j) {
        const double away = (x_[j] - centers_[m * n_ + j]) / width_[j];
        squared += away * away;
      }
      b_[m] = -0.5 * squared;
    }
    // The largest exponent is taken out, or far from all centres they would all underflow.
    const double largest = *std::max_element(b_.begin(), b_.end());
    double sum = 0.0;
    for (double& b : b_) sum += b = std::exp(b - largest);
    std::fill(u_.begin(), u_.end(), 0.0);
    for (std::size_t m = 0; m < M_; ++m)
      for (std::size_t i = 0; i < d_; ++i) {
        double action = intercept_[m * d_ + i];
        for (std::size_t j = 0; j < n_; ++j) action += coef_[(m * d_ + i) * n_ + j] * x_[j];
        u_[i] += b_[m] / sum * action;
      }
  }

  std::vector<double>& x() { return x_; }
  const std::vector<double>& u() const { return u_; }

 private:
  std::size_t M_, n_, d_;
  std::vector<double> centers_, width_, coef_, intercept_, x_, u_, b_;
};
