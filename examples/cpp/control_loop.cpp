// A control loop: a state comes in, the policy acts, the action goes out. States come from a file here, as they would
// from a robot's driver; the actions and how long each step took go to files, to be compared with Python's.
//
//   control_loop POLICY STATES n d ACTIONS TIMES
//
// POLICY ends in .onnx, or holds the arrays of a locally linear policy; STATES, ACTIONS and TIMES (in microseconds) are
// files of doubles.

#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "local_policy.hpp"
#include "onnx_policy.hpp"

namespace {

std::vector<double> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<double> numbers(static_cast<std::size_t>(file.tellg()) / sizeof(double));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(numbers.size() * sizeof(double)));
  return numbers;
}

void write(const std::string& path, const std::vector<double>& numbers) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(numbers.data()), static_cast<std::streamsize>(numbers.size() * sizeof(double)));
  if (!file) throw std::runtime_error("cannot write " + path);
}

template <typename Policy>
void loop(Policy& policy, const std::vector<double>& states, std::vector<double>& actions, std::vector<double>& times) {
  const std::size_t n = policy.x().size();
  for (std::size_t row = 0; row * n < states.size(); ++row) {
    const auto began = std::chrono::steady_clock::now();
    std::copy_n(states.begin() + static_cast<std::ptrdiff_t>(row * n), n, policy.x().begin());
    policy.act();
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - began;
    actions.insert(actions.end(), policy.u().begin(), policy.u().end());
    times.push_back(took.count());
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 7) throw std::runtime_error("usage: control_loop POLICY STATES n d ACTIONS TIMES");
  const std::string path = argv[1];
  const std::vector<double> states = read(argv[2]);
  std::vector<double> actions, times;
  if (path.size() > 5 && path.compare(path.size() - 5, 5, ".onnx") == 0) {
    OnnxPolicy policy(path, std::stoul(argv[3]), std::stoul(argv[4]));
    std::printf("onnxruntime %s\n", OnnxPolicy::version());
    loop(policy, states, actions, times);
  } else {
    LocalPolicy policy(path);
    loop(policy, states, actions, times);
  }
  write(argv[5], actions);
  write(argv[6], times);
} catch (const std::exception& error) {
  std::fprintf(stderr, "control_loop: %s\n", error.what());
  return 1;
}
