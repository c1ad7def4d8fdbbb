// Values that know their age.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "robocomp/abi.h"

namespace rc {

// What a value is made of.
enum class Made {
  // All of it is new: no part was used before, and no reply was kept.
  computed,
  // Some parts are new, others were used before or kept.
  partly_cached,
  // No part is new.
  cached
};

// The age of a value, and what it is made of.
struct Freshness {
  // The time since it was sent; of a reply, since its call began.
  std::chrono::nanoseconds age{0};
  Made made = Made::computed;
  // Whether it is no older than its slot allows.
  bool is_fresh = true;
};

// A value that knows its age.
template <class T>
struct Fresh {
  T value{};
  Freshness freshness;

  std::chrono::nanoseconds age() const { return freshness.age; }
  Made made() const { return freshness.made; }
  bool is_fresh() const { return freshness.is_fresh; }

  const T& operator*() const { return value; }
  const T* operator->() const { return &value; }

  // Both values: as old as the older one, and made of both.
  template <class U>
  Fresh<std::pair<T, U>> with(Fresh<U> other) const {
    const bool is_same = freshness.made == other.freshness.made;
    return {{value, std::move(other.value)},
            {std::max(freshness.age, other.freshness.age),
             is_same ? freshness.made : Made::partly_cached,
             freshness.is_fresh && other.freshness.is_fresh}};
  }
};

namespace detail {

// The age in a number of the interface.
inline Freshness freshness(std::int64_t number) {
  return {std::chrono::nanoseconds(number >> 3), static_cast<Made>(number >> 1 & 3),
          (number & 1) != 0};
}

}  // namespace detail
}  // namespace rc
