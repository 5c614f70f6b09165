// Serialisation of state, for checkpoints of a measurement. A class names its members once,
//
//   template <class Archive> void visit(Archive& archive) { archive(count_, sums_, blocks_); }
//
// and the same function writes and reads them. Members may be numbers, plain structs, vectors and classes with a
// visit() of their own. The bytes are those of this kind of machine.
//
// A writer owns its bytes, a reader reads those of the caller. One thread at a time may use one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace shakebed::sim {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};

class ArchiveWriter {
 public:
  template <class... T>
  void operator()(T&... values) {
    (put(values), ...);
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  template <class T>
  void put(T& value) {
    if constexpr (IsVector<std::remove_const_t<T>>::value) {
      std::uint64_t size = value.size();
      put(size);
      for (auto& element : value) put(element);
    } else if constexpr (requires { value.visit(*this); }) {
      value.visit(*this);
    } else {
      static_assert(std::is_trivially_copyable_v<T>, "give it a visit()");
      const std::size_t before = bytes_.size();
      bytes_.resize(before + sizeof value);
      std::memcpy(bytes_.data() + before, &value, sizeof value);
    }
  }
  std::vector<std::uint8_t> bytes_;
};

// Throws std::invalid_argument where the bytes end too soon.
class ArchiveReader {
 public:
  explicit ArchiveReader(const std::vector<std::uint8_t>& bytes)
      : at_(bytes.data()), end_(bytes.data() + bytes.size()) {}
  template <class... T>
  void operator()(T&... values) {
    (take(values), ...);
  }
  bool at_end() const { return at_ == end_; }

 private:
  template <class T>
  void take(T& value) {
    if constexpr (IsVector<T>::value) {
      std::uint64_t size = 0;
      take(size);
      if (size > static_cast<std::uint64_t>(end_ - at_)) cut_short();  // an element is at least a byte
      value.resize(size);
      for (auto& element : value) take(element);
    } else if constexpr (requires { value.visit(*this); }) {
      value.visit(*this);
    } else {
      static_assert(std::is_trivially_copyable_v<T>, "give it a visit()");
      if (static_cast<std::size_t>(end_ - at_) < sizeof value) cut_short();
      std::memcpy(&value, at_, sizeof value);
      at_ += sizeof value;
    }
  }
  [[noreturn]] static void cut_short() { throw std::invalid_argument("the checkpoint is truncated"); }
  const std::uint8_t *at_, *end_;
};

}  // namespace shakebed::sim
