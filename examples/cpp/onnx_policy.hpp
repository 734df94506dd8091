// A policy that unconstrain exported by policy.to_onnx, for one state at a time, by onnxruntime's C API.
#pragma once

#include <onnxruntime_c_api.h>

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

class OnnxPolicy {
 public:
  OnnxPolicy(const std::string& path, std::size_t n_states, std::size_t n_actions) : x_(n_states), u_(n_actions) {
    if (api_ == nullptr) throw std::runtime_error("this onnxruntime is older than the headers it was compiled with");
    check(api_->CreateEnv(ORT_LOGGING_LEVEL_WARNING, "policy", &env_));
    OrtSessionOptions* options = nullptr;
    check(api_->CreateSessionOptions(&options));
    check(api_->SetIntraOpNumThreads(options, 1));  // other threads would cost more than so small a policy
    check(api_->CreateSession(env_, path.c_str(), options, &session_));
    api_->ReleaseSessionOptions(options);
    check(api_->CreateCpuMemoryInfo(OrtDeviceAllocator, OrtMemTypeDefault, &memory_));
    input_ = wrap(x_);
    output_ = wrap(u_);
  }

  ~OnnxPolicy() {
    api_->ReleaseValue(output_);
    api_->ReleaseValue(input_);
    api_->ReleaseMemoryInfo(memory_);
    api_->ReleaseSession(session_);
    api_->ReleaseEnv(env_);
  }

  OnnxPolicy(const OnnxPolicy&) = delete;
  OnnxPolicy& operator=(const OnnxPolicy&) = delete;

  // Fill x before, and read u after.
  void act() {
    constexpr std::array<const char*, 1> inputs{"x"}, outputs{"u"};
    const OrtValue* given = input_;
    check(api_->Run(session_, nullptr, inputs.data(), &given, 1, outputs.data(), 1, &output_));
  }

  std::vector<double>& x() { return x_; }
  const std::vector<double>& u() const { return u_; }
  static const char* version() { return OrtGetApiBase()->GetVersionString(); }

 private:
  void check(OrtStatus* status) const {
    if (status == nullptr) return;
    const std::string message = api_->GetErrorMessage(status);
    api_->ReleaseStatus(status);
    throw std::runtime_error(message);
  }

  OrtValue* wrap(std::vector<double>& buffer) const {
    const std::array<int64_t, 2> shape{1, static_cast<int64_t>(buffer.size())};
    OrtValue* value = nullptr;
    check(api_->CreateTensorWithDataAsOrtValue(memory_, buffer.data(), buffer.size() * sizeof(double), shape.data(),
                                               shape.size(), ONNX_TENSOR_ELEMENT_DATA_TYPE_DOUBLE, &value));
    return value;
  }

  const OrtApi* api_ = OrtGetApiBase()->GetApi(ORT_API_VERSION);
  OrtEnv* env_ = nullptr;
  OrtSession* session_ = nullptr;
  OrtMemoryInfo* memory_ = nullptr;
  std::vector<double> x_, u_;
  OrtValue *input_ = nullptr, *output_ = nullptr;
};
