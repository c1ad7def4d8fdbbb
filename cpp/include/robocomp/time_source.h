// The component that publishes the time of its network.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "robocomp/cdr.h"
#include "robocomp/errors.h"

namespace rc {

// The order in which followers do a tick.
enum class Order {
  // One after the other, as the network lists them: each run is the same.
  in_turn,
  // All at the same time. Messages between them may arrive in this tick or in the next one.
  at_once
};

// Advances the time of the network: `ctx.time` of a component whose `.cdsl` has `simulates time;`. Time
// advances when the present function of the worker returns. A negative duration throws `rc::TimeError`.
class TimeSource {
 public:
  // Whether the network takes its time from this component. Otherwise `advance` and `set` throw
  // `rc::TimeError`, and nothing else here has an effect.
  bool is_active() const { return get(RC_TIME_IS_ACTIVE).number != 0; }
  // Moves time forward. Returns the number of the tick, from 1. Throws `rc::TimeError` while the source waits
  // for the tick before and `missing()` is empty.
  std::uint64_t advance(std::chrono::nanoseconds step) const { return set(RC_TIME_ADVANCE, forward(step)); }
  // Sets time, possibly to an earlier one: followers begin their periods again and report the jump.
  // Otherwise as `advance`.
  std::uint64_t set(std::chrono::nanoseconds time) const { return set(RC_TIME_SET, forward(time)); }
  // From the next tick on, `compute` runs when every follower has done the work of the tick, or when none has
  // for `limit`, to within 50 ms; then `missing()` names the missing ones. A `compute` that does not advance
  // goes on waiting.
  void wait_for_all(std::chrono::nanoseconds limit) const { set(RC_TIME_WAIT, forward(limit)); }
  // From the next tick on, `compute` runs with its period and waits for no follower.
  void wait_for_nobody() const { set(RC_TIME_WAIT, -1); }
  void set_order(Order order) const { set(RC_TIME_ORDER, order == Order::in_turn ? 1 : 0); }
  // Whether `compute` runs with its period, in real time (the default), or as soon as all have done the tick.
  // Without `wait_for_all` it always runs with its period.
  void set_paced(bool paced) const { set(RC_TIME_PACE, paced ? 1 : 0); }
  // The number of the last tick.
  std::uint64_t tick() const { return static_cast<std::uint64_t>(get(RC_TIME_TICK).number); }
  // Followers that have not done the last tick within its limit. If followers run in turn, the one whose
  // turn it is.
  std::vector<std::string> missing() const { return names(RC_TIME_MISSING); }
  // The components that follow.
  std::vector<std::string> followers() const { return names(RC_TIME_FOLLOWERS); }
  // Waits no more for a follower, until it acknowledges again. Returns whether there was one of this name.
  bool release(const std::string& name) const { return set(RC_TIME_RELEASE, 0, name) != 0; }

 private:
  // The interface has another meaning for negative numbers.
  static std::int64_t forward(std::chrono::nanoseconds time) {
    if (time.count() < 0) throw TimeError("a time or a duration is negative");
    return time.count();
  }
  static rc_answer get(rc_get_what what) { return detail::checked(robocomp_get(what, 0)); }
  static std::uint64_t set(rc_set_what what, std::int64_t value, const std::string& text = {}) {
    const rc_answer answer = detail::checked(robocomp_set(what, 0, value, detail::bytes(text)));
    detail::look_again();
    return static_cast<std::uint64_t>(answer.number);
  }
  static std::vector<std::string> names(rc_get_what what) {
    std::vector<std::string> names;
    detail::Reader(get(what).bytes).get(names);
    return names;
  }
};

}  // namespace rc
