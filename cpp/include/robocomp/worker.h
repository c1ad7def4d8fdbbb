// The base of every generic worker, and the functions that generated code lists in its tables.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "robocomp/cdr.h"
#include "robocomp/client.h"
#include "robocomp/context.h"
#include "robocomp/errors.h"
#include "robocomp/in_place.h"
#include "robocomp/members.h"

namespace rc {

// One change of a parameter. Values are texts of TOML.
struct ParamChange {
  std::string path;
  std::string old_value;
  std::string new_value;
  bool secret = false;
  RC_STRUCT(ParamChange, path, old_value, new_value, secret)
};

class Worker;

namespace detail {

// A call of a function of the worker, and its answer.
struct Call {
  // A started call is the worker's.
  explicit Call(const rc_call& call)
      : name(text(call.name)), body(call.body), raw(call), held(call.function == RC_HANDLE ? call.held : 0) {}

  std::string name;
  Reader body;
  // Lives while the function runs.
  const rc_call& raw;
  // The sample in place, until the argument of the handler has it.
  Held held;
  std::int32_t status = RC_DONE;
  std::int64_t number = 0;
  Writer reply;
};

using Function = std::function<void(Worker&, Call&)>;

// A function of the table: its kind, its numbers, and its call.
struct Entry {
  rc_function function;
  std::size_t first;
  std::size_t second;
  Function call;
};

}  // namespace detail

// The functions of every worker, and of its component. The runtime calls all of them on one thread.
class Worker {
 public:
  virtual ~Worker() = default;

  // Runs once, when clients and publishers are open and the parameters are set.
  virtual void initialize() {}
  // Runs once a period; in a component with a state machine, while no active state has a `during`.
  virtual void compute() {}
  // Runs after parameters changed, with all changes of one request. `params` holds the new values.
  // An exception rejects the request: the requester gets its text, and `params` the old values.
  virtual void params_changed(const std::vector<ParamChange>&) {}
  // Runs once a period instead of `compute`, while the component is in the state Emergency.
  virtual void emergency() {}
  // Runs once when the state Emergency ends.
  virtual void restore() {}
  // Runs once before the component ends. It can still send commands and publish.
  virtual void finalize() {}

  // The transitions of a managed component.
  virtual void configure() {}
  virtual void activate() {}
  virtual void deactivate() {}
  virtual void cleanup() {}
  virtual void shutdown() {}
  // Runs when a transition of a managed component has failed. An exception finalizes the component.
  virtual void error(const std::string& /*transition*/, const std::string& reason) {
    throw WorkerError(reason);
  }

  // RoboComp's names for functions of the context.
  void setPeriod(int milliseconds) { setPeriod(std::chrono::milliseconds(milliseconds)); }
  void setPeriod(std::chrono::nanoseconds period) { Context().set_period(period); }
  int getPeriod() const {
    using std::chrono::milliseconds;
    return static_cast<int>(
        std::chrono::duration_cast<milliseconds>(Context().period()).count());
  }
  // Enters the state Emergency after this function. Throws `rc::WrongThread` on another thread.
  void goToEmergency(const std::string& reason = "the worker asks for it") {
    (void)Context().is_stopping();
    emergency_reason_ = reason;
    detail::look_again();
  }

  // Prepares what a worker needs before it is made, and returns its owner.
  static std::shared_ptr<void> rc_prepare() { return nullptr; }

 protected:
  // Generated code sets its parameters, and lists its functions.
  virtual void rc_set_parameters(detail::Reader&) {}
  virtual const std::vector<detail::Entry>& rc_functions() const = 0;
  // Of a worker that is a window: shows it, and runs its events until the descriptor is readable or
  // the time is over.
  virtual void rc_show() {}
  virtual void rc_wait(int /*descriptor*/, std::chrono::nanoseconds /*limit*/) {}
  // Says that the worker did not write the function that runs.
  void rc_not_written() { is_written_ = false; }

 private:
  template <class Specific>
  friend class Program;

  std::string emergency_reason_;
  bool is_written_ = true;
};

namespace detail {

template <class T>
using Plain = std::remove_cv_t<std::remove_reference_t<T>>;

// Reads an argument of a handler.
template <class T>
void read_argument(Call& call, T& argument) {
  call.body.get(argument);
}
inline void read_argument(Call& call, Member& member) {
  member = Member(call.raw.member, call.name);
}
template <class T>
void read_argument(Call& call, View<T>& view) {
  view = View<T>(std::move(call.held), call.raw.body);
}

// An argument as a parameter of this type takes it: views move.
template <class Parameter, class T>
decltype(auto) pass(T& argument) {
  if constexpr (std::is_reference_v<Parameter>) {
    return static_cast<T&>(argument);
  } else {
    return static_cast<T&&>(argument);
  }
}

// Whether a parameter of a handler is an `out` of the IDSL: a reference that it may write.
template <class T>
inline constexpr bool is_out =
    std::is_lvalue_reference_v<T> && !std::is_const_v<std::remove_reference_t<T>>;

// Writes an argument that is an `out`.
template <class Parameter, class T>
void write_out(Call& call, const T& argument) {
  if constexpr (is_out<Parameter>) call.reply.put(argument);
}

// Calls `run`; an exception of the list becomes the reply.
template <class Run>
void guarded(Call&, const Run& run, Throws<>) {
  run();
}
template <class Run, class First, class... Rest>
void guarded(Call& call, const Run& run, Throws<First, Rest...>) {
  try {
    guarded(call, run, Throws<Rest...>{});
  } catch (const First& thrown) {
    call.status = RC_EXCEPTION;
    call.number = First::rc_id;
    call.reply.clear();
    call.reply.members(thrown.rc_members());
  }
}

}  // namespace detail

// The table's function for a handler: reads its arguments, and writes `out` parameters and result.
template <class... Exceptions, class Generic, class Result, class... Parameters>
detail::Function handler(Result (Generic::*function)(Parameters...)) {
  return [function](Worker& worker, detail::Call& call) {
    std::tuple<detail::Plain<Parameters>...> arguments{};
    std::apply(
        [&](auto&... argument) {
          (void)std::initializer_list<int>{
              (detail::is_out<Parameters> ? void() : detail::read_argument(call, argument), 0)...};
        },
        arguments);
    const auto run = [&] {
      auto& generic = static_cast<Generic&>(worker);
      std::apply(
          [&](auto&... argument) {
            const auto write_outs = [&] {
              (void)std::initializer_list<int>{
                  (detail::write_out<Parameters>(call, argument), 0)...};
            };
            constexpr bool has_outs = (detail::is_out<Parameters> || ... || false);
            if constexpr (std::is_void_v<Result>) {
              (generic.*function)(detail::pass<Parameters>(argument)...);
              if constexpr (has_outs) write_outs();
              else call.reply.members(std::tuple<>());
            } else {
              const Result result = (generic.*function)(detail::pass<Parameters>(argument)...);
              write_outs();
              call.reply.put(result);
            }
          },
          arguments);
    };
    detail::guarded(call, run, detail::Throws<Exceptions...>{});
  };
}

// The table's function for the end of a started call.
template <class Reply, class Throws, class Generic>
detail::Function ended(void (Generic::*function)(CallId, Result<Reply>)) {
  return [function](Worker& worker, detail::Call& call) {
    const rc_answer answer{call.raw.status, call.raw.number, call.raw.body};
    (static_cast<Generic&>(worker).*function)(CallId(call.raw.held),
                                              detail::result<Reply, Throws>(answer));
  };
}
template <class Reply, class Throws, class Generic>
detail::Function ended(void (Generic::*function)(const Member&, CallId, Result<Reply>)) {
  return [function](Worker& worker, detail::Call& call) {
    const rc_answer answer{call.raw.status, call.raw.number, call.raw.body};
    (static_cast<Generic&>(worker).*function)(Member(call.raw.member, call.name),
                                              CallId(call.raw.held),
                                              detail::result<Reply, Throws>(answer));
  };
}

// The table's function for the handler of a collection: reads an age and a value for each topic.
template <class Generic, class... Values>
detail::Function collected(void (Generic::*function)(Fresh<Values>...)) {
  return [function](Worker& worker, detail::Call& call) {
    std::tuple<Fresh<Values>...> all;
    const auto read = [&](auto& fresh) {
      std::int64_t age = 0;
      std::vector<std::uint8_t> body;
      call.body.get(age);
      call.body.get(body);
      fresh.freshness = detail::freshness(age);
      detail::Reader reader({body.data(), body.size()});
      detail::read_parts(reader, fresh.value);
    };
    std::apply([&](auto&... fresh) { (read(fresh), ...); }, all);
    std::apply(
        [&](auto&... fresh) { (static_cast<Generic&>(worker).*function)(std::move(fresh)...); },
        all);
  };
}

// The table's function for a function that takes nothing: of a state, or an action.
template <class Generic>
detail::Function hook(void (Generic::*function)()) {
  return [function](Worker& worker, detail::Call&) { (static_cast<Generic&>(worker).*function)(); };
}

// The table's function for a guard.
template <class Generic>
detail::Function guard(bool (Generic::*function)()) {
  return [function](Worker& worker, detail::Call& call) {
    call.number = (static_cast<Generic&>(worker).*function)() ? 1 : 0;
  };
}

}  // namespace rc
