// The context of a worker: its state, and functions that change it. All of it works on the thread
// of the worker.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
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
  // Requests a change of a parameter of this component, by its path: `range`, `motors[2].max`. The value is a
  // number, a `bool`, a text, a path or a duration; an array is changed by its elements: `offsets[0]`. The rest is that
  // of `rcdeploy params set`: the value is checked, `params_changed` accepts or refuses it, and then `params` and all
  // tools have the new value. This is done before the next `compute`, in lockstep in the same tick; a change of several
  // components that is under way delays it. The log and the last error of the component have a refusal. At most 64
  // changes wait. Throws `rc::InvalidArgument` for an integer above 2^63 - 1, for a duration that is negative or longer
  // than 2^63 - 1 ns, and for a path with a line feed.
  template <class T>
  void set_parameter(const std::string& path, const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      set_parameter(path, RC_BOOL, value ? 1 : 0, {});
    } else if constexpr (std::is_integral_v<T>) {
      if constexpr (std::is_unsigned_v<T> && sizeof(T) >= sizeof(std::int64_t)) {
        if (value > static_cast<T>(INT64_MAX)) {
          throw InvalidArgument("`" + path + "`: an integer is at most " + std::to_string(INT64_MAX) + ", not " +
                                std::to_string(value));
        }
      }
      set_parameter(path, RC_INT, static_cast<std::int64_t>(value), {});
    } else if constexpr (std::is_floating_point_v<T>) {
      const double number = static_cast<double>(value);
      std::int64_t bits = 0;
      static_assert(sizeof bits == sizeof number);
      std::memcpy(&bits, &number, sizeof bits);
      set_parameter(path, RC_FLOAT, bits, {});
    } else if constexpr (std::is_convertible_v<const T&, std::string_view>) {
      set_parameter(path, RC_TEXT, 0, std::string(std::string_view(value)));
    } else if constexpr (std::is_convertible_v<const T&, std::chrono::nanoseconds>) {
      set_parameter(path, RC_DURATION, nanoseconds(path, value), {});
    } else {
      static_assert(std::is_same_v<T, std::filesystem::path>,
                    "no parameter has a value of this type; an array is changed by its elements: offsets[0]");
      set_parameter(path, RC_TEXT, 0, value.string());
    }
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
  static void set_parameter(const std::string& path, rc_value_kind kind, std::int64_t value, const std::string& text) {
    if (const std::size_t end = path.find('\n'); end != std::string::npos) {
      throw InvalidArgument("`" + path.substr(0, end) + "` and a line feed begin no path of a parameter");
    }
    const std::string both = path + '\n' + text;
    detail::checked(robocomp_set(RC_SET_PARAMETER, kind, value, detail::bytes(both)));
    detail::look_again();
  }
  // A duration in nanoseconds; -1 for a negative one. It is compared in its own unit, because its nanoseconds may be more
  // than an integer holds, and as 64 bits, because the longest one may be more than its own integer holds.
  template <class Rep, class Period>
  static std::int64_t nanoseconds(const std::string& path, std::chrono::duration<Rep, Period> value) {
    using std::chrono::duration;
    constexpr auto longest = std::chrono::nanoseconds::max();
    constexpr std::int64_t most = std::chrono::duration_cast<duration<std::int64_t, Period>>(longest).count();
    if (value < value.zero()) return -1;
    if (static_cast<std::uint64_t>(value.count()) > static_cast<std::uint64_t>(most)) {
      throw InvalidArgument("`" + path + "`: a duration is at most " + std::to_string(longest.count()) + " ns");
    }
    return std::chrono::nanoseconds(duration<std::int64_t, Period>(static_cast<std::int64_t>(value.count()))).count();
  }
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
