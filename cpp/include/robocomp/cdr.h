// Values in CDR (OMG DDS-XTypes 1.3, encoding version 1), as they cross the border.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "robocomp/errors.h"

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "robocomp needs a little-endian machine"
#endif

// The members of a structure in the order of the IDSL, and comparison by all of them.
#define RC_STRUCT(Name, ...)                                    \
  auto rc_members() { return std::tie(__VA_ARGS__); }           \
  auto rc_members() const { return std::tie(__VA_ARGS__); }     \
  friend bool operator==(const Name& rc_a, const Name& rc_b) {  \
    return rc_a.rc_members() == rc_b.rc_members();              \
  }                                                             \
  friend bool operator!=(const Name& rc_a, const Name& rc_b) { return !(rc_a == rc_b); }

#define RC_EMPTY_STRUCT(Name)                                      \
  std::tuple<> rc_members() const { return {}; }                   \
  friend bool operator==(const Name&, const Name&) { return true; } \
  friend bool operator!=(const Name&, const Name&) { return false; }

namespace rc {

// An array with equal elements: the default of an array of enumerators.
template <std::size_t N, class T>
std::array<T, N> filled(T element) {
  std::array<T, N> all{};
  all.fill(element);
  return all;
}

}  // namespace rc

namespace rc::detail {

template <class T, class = void>
struct is_struct : std::false_type {};
template <class T>
struct is_struct<T, std::void_t<decltype(std::declval<T&>().rc_members())>> : std::true_type {};

// Numbers whose sequences are one block of memory.
template <class T>
inline constexpr bool is_number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

// Small bodies, which are the most, take no memory of the heap.
class Writer {
 public:
  Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  rc_bytes bytes() const { return {data_, size_}; }
  void clear() { size_ = 0; }

  template <class... Members>
  void members(const std::tuple<Members...>& all) {
    if constexpr (sizeof...(Members) == 0) {
      number(std::uint8_t{0});  // an empty structure holds one octet
    } else {
      std::apply([&](const auto&... member) { (put(member), ...); }, all);
    }
  }

  void put(bool value) { number<std::uint8_t>(value ? 1 : 0); }
  void put(const std::string& text) {
    length(text.size() + 1);
    append(text.data(), text.size());
    number(std::uint8_t{0});
  }
  void put(const std::filesystem::path& path) { put(path.string()); }
  void put(std::chrono::nanoseconds time) { number<std::int64_t>(time.count()); }

  template <class T>
  void put(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      number(static_cast<std::int32_t>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
      number(value);
    } else {
      static_assert(is_struct<T>::value, "the type is none of the IDSL");
      members(value.rc_members());
    }
  }
  template <class T>
  void put(const std::vector<T>& items) {
    length(items.size());
    if constexpr (std::is_same_v<T, bool>) {
      for (const bool item : items) put(item);
    } else {
      elements(items.data(), items.size());
    }
  }
  template <class T, std::size_t N>
  void put(const std::array<T, N>& items) {
    elements(items.data(), N);
  }
  template <class K, class V>
  void put(const std::map<K, V>& pairs) {
    length(pairs.size());
    for (const auto& [key, value] : pairs) {
      put(key);
      put(value);
    }
  }
  template <class T>
  void put(const std::optional<T>& value) {
    length(value ? 1 : 0);
    if (value) put(*value);
  }

 private:
  template <class T>
  void number(T value) {
    align(sizeof(T));
    append(&value, sizeof(T));
  }
  void length(std::size_t length) {
    // The other side refuses a length that the bytes do not have.
    number(static_cast<std::uint32_t>(std::min<std::size_t>(length, UINT32_MAX)));
  }
  template <class T>
  void elements(const T* items, std::size_t count) {
    if constexpr (is_number<T>) {
      if (count == 0) return;
      align(sizeof(T));
      append(items, count * sizeof(T));
    } else {
      for (std::size_t at = 0; at < count; ++at) put(items[at]);
    }
  }
  // Sizes are powers of two.
  void align(std::size_t size) {
    while (size_ % size != 0) append("", 1);
  }
  void append(const void* data, std::size_t size) {
    if (size == 0) return;
    if (size > capacity_ - size_) grow(size);
    std::memcpy(data_ + size_, data, size);
    size_ += size;
  }
  void grow(std::size_t size) {
    const std::size_t capacity = std::max(size_ + size, 2 * capacity_);
    std::unique_ptr<std::uint8_t[]> larger(new std::uint8_t[capacity]);
    std::memcpy(larger.get(), data_, size_);
    large_ = std::move(larger);
    data_ = large_.get();
    capacity_ = capacity;
  }

  std::size_t size_ = 0;
  std::size_t capacity_ = sizeof small_;
  std::uint8_t* data_ = small_;
  std::unique_ptr<std::uint8_t[]> large_;
  std::uint8_t small_[256];
};

class Reader {
 public:
  explicit Reader(rc_bytes bytes) : bytes_(bytes) {}

  template <class... Members>
  void members(std::tuple<Members...> all) {
    if constexpr (sizeof...(Members) == 0) {
      number<std::uint8_t>();  // an empty structure holds one octet
    } else {
      std::apply([&](auto&... member) { (get(member), ...); }, all);
    }
  }

  void get(bool& value) { value = number<std::uint8_t>() != 0; }
  void get(std::string& text) {
    const std::size_t size = length();
    const auto* data = reinterpret_cast<const char*>(take(size));
    text.assign(data, size == 0 ? 0 : size - 1);
  }
  void get(std::filesystem::path& path) {
    std::string text;
    get(text);
    path = text;
  }
  void get(std::chrono::nanoseconds& time) {
    time = std::chrono::nanoseconds(number<std::int64_t>());
  }

  template <class T>
  void get(T& value) {
    if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(number<std::int32_t>());
    } else if constexpr (std::is_arithmetic_v<T>) {
      value = number<T>();
    } else {
      static_assert(is_struct<T>::value, "the type is none of the IDSL");
      members(value.rc_members());
    }
  }
  template <class T>
  void get(std::vector<T>& items) {
    const std::size_t count = length();
    items.clear();
    if constexpr (is_number<T>) {
      if (count == 0) return;
      align(sizeof(T));
      // Their bytes are there before memory is.
      const std::uint8_t* data = take(count * sizeof(T));
      if constexpr (std::is_same_v<T, std::uint8_t>) {
        items.assign(data, data + count);
      } else {
        items.resize(count);
        std::memcpy(items.data(), data, count * sizeof(T));
      }
    } else {
      for (std::size_t at = 0; at < count; ++at) {
        T item{};
        get(item);
        items.push_back(std::move(item));
      }
    }
  }
  template <class T, std::size_t N>
  void get(std::array<T, N>& items) {
    for (T& item : items) get(item);
  }
  template <class K, class V>
  void get(std::map<K, V>& pairs) {
    const std::size_t count = length();
    pairs.clear();
    for (std::size_t at = 0; at < count; ++at) {
      K key{};
      get(key);
      V value{};
      get(value);
      pairs.insert_or_assign(std::move(key), std::move(value));
    }
  }
  template <class T>
  void get(std::optional<T>& value) {
    value.reset();
    if (length() != 0) get(value.emplace());
  }

 private:
  template <class T>
  T number() {
    align(sizeof(T));
    T value;
    std::memcpy(&value, take(sizeof(T)), sizeof(T));
    return value;
  }
  std::size_t length() {
    const std::size_t length = number<std::uint32_t>();
    // Every element has a byte at least.
    if (length > bytes_.size - at_) short_of_bytes();
    return length;
  }
  void align(std::size_t size) { at_ = std::min((at_ + size - 1) / size * size, bytes_.size); }
  const std::uint8_t* take(std::size_t size) {
    if (size > bytes_.size - at_) short_of_bytes();
    const std::uint8_t* data = bytes_.data + at_;
    at_ += size;
    return data;
  }
  [[noreturn]] static void short_of_bytes() {
    throw MalformedReply("a value ends early; generate the component again, and build it");
  }

  rc_bytes bytes_;
  std::size_t at_ = 0;
};

}  // namespace rc::detail
