// The context of a worker: its state, and functions that change it. All of it works on the thread
// of the worker.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <type_traits>

#include "robocomp/errors.h"

namespace rc {

// The component of this worker.
class Context {
 public:
  // The name of the component in its network.
  std::string name() const { return text(RC_NAME); }
  // The name of the network.
  std::string network() const { return text(RC_NETWORK); }
  // The state of the component: `compute`, `emergency` …
  std::string state() const { return text(RC_STATE); }
  // The time of the network's clock, since the epoch of that clock.
  std::chrono::nanoseconds now() const { return std::chrono::nanoseconds(number(RC_NOW)); }
  // The time between two calls of `compute`.
  std::chrono::nanoseconds period() const { return std::chrono::nanoseconds(number(RC_PERIOD)); }
  void set_period(std::chrono::nanoseconds period) {
    detail::checked(robocomp_set(RC_SET_PERIOD, 0, period.count(), {}));
    detail::look_again();
  }
  // Whether the component stops after this function.
  bool is_stopping() const { return number(RC_IS_STOPPING) != 0; }
  // Stops the component after this function.
  void stop(const std::string& reason) {
    detail::checked(robocomp_set(RC_STOP, 0, 0, detail::bytes(reason)));
  }
  // A seed for random numbers, which an exact recording keeps.
  std::uint64_t seed() const { return static_cast<std::uint64_t>(number(RC_SEED)); }

 private:
  static std::string text(rc_get_what what) {
    return detail::text(detail::checked(robocomp_get(what, 0)).bytes);
  }
  static std::int64_t number(rc_get_what what) { return detail::checked(robocomp_get(what, 0)).number; }
};

// Lines of the component's log, from any thread.
inline void log_error(const std::string& text) { robocomp_log(1, detail::bytes(text)); }
inline void log_warning(const std::string& text) { robocomp_log(2, detail::bytes(text)); }
inline void log_info(const std::string& text) { robocomp_log(3, detail::bytes(text)); }
inline void log_debug(const std::string& text) { robocomp_log(4, detail::bytes(text)); }

// The state machine of a component.
template <class State, class Event>
class Machine {
 public:
  // Fires an event, which the machine handles after this function.
  void fire(Event event) {
    detail::checked(robocomp_set(RC_FIRE, static_cast<std::size_t>(event), 0, {}));
    detail::look_again();
  }
  // Whether a state is active.
  bool is_in(State state) const {
    return detail::checked(robocomp_get(RC_IS_IN, static_cast<std::size_t>(state))).number != 0;
  }
  // Whether the machine is in its end state.
  bool has_ended() const { return detail::checked(robocomp_get(RC_HAS_ENDED, 0)).number != 0; }
};

}  // namespace rc
