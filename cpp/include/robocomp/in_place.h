// Samples in shared memory: values whose size does not depend on their content, in the layout of C.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "robocomp/cdr.h"
#include "robocomp/errors.h"
#include "robocomp/expiring.h"

// The members of a structure in place, and the type of its values.
#define RC_IN_PLACE(Of, ...)                          \
  using rc_value = Of;                                \
  auto rc_members() { return std::tie(__VA_ARGS__); } \
  auto rc_members() const { return std::tie(__VA_ARGS__); }

namespace rc {

// A `bool` in one byte: any byte but 0 is true.
class Flag {
 public:
  Flag(bool value = false) : byte_(value ? 1 : 0) {}
  operator bool() const { return byte_ != 0; }

 private:
  std::uint8_t byte_;
};

// Room for at most `Bound` elements. Those that are not used have no value.
template <class T, std::size_t Bound>
class Bounded {
 public:
  Bounded() {}
  // The memory of a sample is not copied.
  Bounded(const Bounded&) = delete;
  Bounded& operator=(const Bounded&) = delete;

  // A sender that writes a longer length has as many as there is room for.
  std::size_t size() const { return length_ < Bound ? length_ : Bound; }
  bool empty() const { return size() == 0; }
  static constexpr std::size_t max_size() { return Bound; }
  T* data() { return std::launder(reinterpret_cast<T*>(items_)); }
  const T* data() const { return std::launder(reinterpret_cast<const T*>(items_)); }
  T* begin() { return data(); }
  const T* begin() const { return data(); }
  T* end() { return data() + size(); }
  const T* end() const { return data() + size(); }
  T& operator[](std::size_t at) { return data()[at]; }
  const T& operator[](std::size_t at) const { return data()[at]; }
  T& at(std::size_t at) { return checked(*this, at); }
  const T& at(std::size_t at) const { return checked(*this, at); }

  // Sets the number of elements. New ones have their default, except numbers and enumerators, which have any value.
  // Throws `rc::InvalidSample` if there is no room.
  void resize(std::size_t size) {
    if (size > Bound) {
      throw InvalidSample(std::to_string(size) + " elements, the type allows " +
                          std::to_string(Bound));
    }
    // Without optimisation, a loop that does nothing takes its time for each element.
    if constexpr (!std::is_trivially_default_constructible_v<T>) {
      for (std::size_t at = this->size(); at < size; ++at) new (data() + at) T;
    }
    length_ = static_cast<std::uint32_t>(size);
  }
  void clear() { length_ = 0; }

 private:
  template <class Self>
  static auto& checked(Self& self, std::size_t at) {
    if (at >= self.size()) throw std::out_of_range("rc::Bounded::at");
    return self[at];
  }

  std::uint32_t length_ = 0;
  alignas(T) unsigned char items_[Bound * sizeof(T)];
};

// Room for a text of at most `Bound` bytes.
template <std::size_t Bound>
class Text {
 public:
  Text(std::string_view text = {}) { *this = text; }
  Text& operator=(std::string_view text) {
    if (text.size() > Bound) {
      throw InvalidSample("a text of " + std::to_string(text.size()) + " bytes, the type allows " +
                          std::to_string(Bound));
    }
    length_ = static_cast<std::uint32_t>(text.size());
    text.copy(bytes_, text.size());
    return *this;
  }
  operator std::string_view() const { return view(); }
  std::string_view view() const { return {bytes_, length_ < Bound ? length_ : Bound}; }
  std::string str() const { return std::string(view()); }

 private:
  std::uint32_t length_ = 0;
  char bytes_[Bound];
};

// Room for a value that may be missing.
template <class T>
class Maybe {
 public:
  bool has_value() const { return !value_.empty(); }
  explicit operator bool() const { return has_value(); }
  const T& operator*() const { return value_.at(0); }
  const T* operator->() const { return &value_.at(0); }
  // Makes the value, with its default.
  T& emplace() {
    value_.clear();
    value_.resize(1);
    return value_[0];
  }
  void reset() { value_.clear(); }

 private:
  Bounded<T, 1> value_;
};

namespace detail {

template <class T, class = void>
struct is_placed : std::false_type {};
template <class T>
struct is_placed<T, std::void_t<typename T::rc_value>> : std::true_type {};

// Copies between values in place and values.
struct Copy {
  template <class T, class V>
  static void set(T& place, const V& value) {
    if constexpr (is_placed<T>::value) {
      members<0>(place.rc_members(), value.rc_members(), [](auto& to, const auto& from) { set(to, from); });
    } else {
      place = value;
    }
  }
  template <class T, std::size_t Bound, class V>
  static void set(Bounded<T, Bound>& place, const std::vector<V>& value) {
    place.clear();
    place.resize(value.size());
    if constexpr (is_number<T>) {
      if (!value.empty()) std::memcpy(place.data(), value.data(), value.size() * sizeof(T));
    } else {
      for (std::size_t at = 0; at < value.size(); ++at) set(place[at], value[at]);
    }
  }
  // `std::vector<bool>` has no references.
  template <std::size_t Bound>
  static void set(Bounded<Flag, Bound>& place, const std::vector<bool>& value) {
    place.resize(value.size());
    for (std::size_t at = 0; at < value.size(); ++at) place[at] = value[at];
  }
  template <class T, std::size_t N, class V>
  static void set(std::array<T, N>& place, const std::array<V, N>& value) {
    for (std::size_t at = 0; at < N; ++at) set(place[at], value[at]);
  }
  template <class T, class V>
  static void set(Maybe<T>& place, const std::optional<V>& value) {
    place.reset();
    if (value) set(place.emplace(), *value);
  }

  template <class T, class V>
  static void get(const T& place, V& value) {
    if constexpr (is_placed<T>::value) {
      members<0>(value.rc_members(), place.rc_members(), [](auto& to, const auto& from) { get(from, to); });
    } else {
      value = place;
    }
  }
  template <std::size_t Bound>
  static void get(const Text<Bound>& place, std::string& value) {
    value = place.view();
  }
  template <class T, std::size_t Bound, class V>
  static void get(const Bounded<T, Bound>& place, std::vector<V>& value) {
    if constexpr (is_number<T>) {
      value.assign(place.begin(), place.end());
    } else {
      value.clear();
      for (const T& item : place) {
        V copy{};
        get(item, copy);
        value.push_back(std::move(copy));
      }
    }
  }
  template <class T, std::size_t N, class V>
  static void get(const std::array<T, N>& place, std::array<V, N>& value) {
    for (std::size_t at = 0; at < N; ++at) get(place[at], value[at]);
  }
  template <class T, class V>
  static void get(const Maybe<T>& place, std::optional<V>& value) {
    value.reset();
    if (place) get(*place, value.emplace());
  }

 private:
  template <std::size_t At, class To, class From, class Act>
  static void members(const To& to, const From& from, const Act& act) {
    if constexpr (At < std::tuple_size_v<To>) {
      act(std::get<At>(to), std::get<At>(from));
      members<At + 1>(to, from, act);
    }
  }
};

// Something that the runtime holds for the program, by a number.
class Held {
 public:
  Held() = default;
  explicit Held(std::uint64_t number) : number_(number) {}
  Held(Held&& other) noexcept : number_(std::exchange(other.number_, 0)) {}
  Held& operator=(Held&& other) noexcept {
    if (this != &other) {
      drop();
      number_ = std::exchange(other.number_, 0);
    }
    return *this;
  }
  ~Held() { drop(); }

  std::uint64_t number() const { return number_; }

 private:
  void drop() {
    if (number_ != 0) robocomp_drop(number_);
    number_ = 0;
  }

  std::uint64_t number_ = 0;
};

// Whether memory is that of one structure.
template <class T>
void check_memory(const rc_bytes& memory) {
  static_assert(std::is_standard_layout_v<T>, "a structure in place has the layout of C");
  if (reinterpret_cast<std::uintptr_t>(memory.data) % alignof(T) != 0) {
    throw MalformedReply("a sample in place is not aligned for its type");
  }
  if (memory.size != sizeof(T)) {
    throw MalformedReply("a sample in place has " + std::to_string(memory.size) + " bytes, its type " +
                         std::to_string(sizeof(T)) + "; generate the component again, and build it");
  }
}

}  // namespace detail

// A received sample, which stays in its place for as long as the view lives. A worker keeps one by moving
// it, at most 4 of a topic; further samples do not reach their handler then.
template <class T>
class View {
 public:
  View() = default;
  // A view of a copy: for tests.
  explicit View(const typename T::rc_value& value) : own_(new T) {
    detail::Copy::set(*own_, value);
    begin(own_.get());
  }
  View(View&& other) noexcept
      : held_(std::move(other.held_)),
        own_(std::move(other.own_)),
        expiring_(std::move(other.expiring_)),
        place_(std::exchange(other.place_, nullptr)) {}
  View& operator=(View&& other) noexcept {
    expiring_ = std::move(other.expiring_);
    held_ = std::move(other.held_);
    own_ = std::move(other.own_);
    place_ = std::exchange(other.place_, nullptr);
    return *this;
  }

  // Whether there is a sample: not after it was moved from.
  explicit operator bool() const { return place_ != nullptr; }
  const T& operator*() const { return *place(); }
  const T* operator->() const { return place(); }
  // A value, which keeps no memory of the sample.
  typename T::rc_value copy() const {
    typename T::rc_value value{};
    detail::Copy::get(*place(), value);
    return value;
  }
  // Ends it: its publisher has the memory again.
  void reset() { *this = View(); }

  // For generated code.
  View(detail::Held held, rc_bytes memory) : held_(std::move(held)) {
    detail::check_memory<T>(memory);
    begin(memory.data);
  }

 private:
  void begin(const void* memory) {
    expiring_ = detail::Expiring(memory, sizeof(T));
    place_ = static_cast<const T*>(expiring_.place());
  }

  const T* place() const {
    if (place_ == nullptr) throw Dangling("the view was moved from or reset");
    return place_;
  }

  detail::Held held_;
  std::unique_ptr<T> own_;
  // Ends before the memory.
  detail::Expiring expiring_;
  const T* place_ = nullptr;
};

// A sample that is written in its place. Its end without `send` gives the memory back.
template <class T>
class Loan {
 public:
  explicit Loan(const rc_answer& begun) : held_(static_cast<std::uint64_t>(begun.number)) {
    detail::check_memory<T>(begun.bytes);
    expiring_ = detail::Expiring(begun.bytes.data, sizeof(T));
    // Unused elements keep the bytes of an earlier sample.
    place_ = new (expiring_.place()) T;
  }
  Loan(Loan&& other) noexcept
      : held_(std::move(other.held_)),
        expiring_(std::move(other.expiring_)),
        place_(std::exchange(other.place_, nullptr)) {}
  Loan& operator=(Loan&& other) noexcept {
    expiring_ = std::move(other.expiring_);
    held_ = std::move(other.held_);
    place_ = std::exchange(other.place_, nullptr);
    return *this;
  }

  T& operator*() const { return *place(); }
  T* operator->() const { return place(); }
  // Copies a value into it.
  void set(const typename T::rc_value& value) const { detail::Copy::set(*place(), value); }
  // Publishes the sample. Whether or not it throws, the loan has ended: `rc::InvalidSample` if an enumerator,
  // a text or a number is none of its type.
  void send() {
    place();
    place_ = nullptr;
    expiring_.write_back();
    expiring_.end();
    // Another thread sends nothing; then this gives the memory back.
    const detail::Held held = std::move(held_);
    detail::checked(robocomp_send(held.number()));
  }

 private:
  T* place() const {
    if (place_ == nullptr) throw Dangling("the loan was sent or moved from");
    return place_;
  }

  detail::Held held_;
  detail::Expiring expiring_;
  T* place_ = nullptr;
};

}  // namespace rc
