// Results of calls, and the bases of generated clients and publishers.
#pragma once

#include <chrono>
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "robocomp/cdr.h"
#include "robocomp/errors.h"
#include "robocomp/freshness.h"
#include "robocomp/in_place.h"

namespace rc {

// The value of a call, or why there is none.
template <class T>
class Result {
  using Value = std::conditional_t<std::is_void_v<T>, std::tuple<>, T>;

 public:
  Result(Value value) : value_(std::move(value)) {}
  Result(std::exception_ptr error) : error_(std::move(error)) {}

  bool ok() const { return value_.has_value(); }
  explicit operator bool() const { return ok(); }

  // The value. Throws the error if there is none.
  T value() {
    if (error_) std::rethrow_exception(error_);
    if constexpr (!std::is_void_v<T>) return std::move(*value_);
  }

  // The value, or another one instead.
  template <class U = Value>
  Value value_or(U&& other) const {
    return ok() ? *value_ : Value(std::forward<U>(other));
  }

  // The error, for `std::rethrow_exception`; null if there is a value.
  std::exception_ptr error() const { return error_; }

  // Whether the call failed with this exception: `result.is<rc::Timeout>()`.
  template <class E>
  bool is() const {
    if (!error_) return false;
    try {
      std::rethrow_exception(error_);
    } catch (const E&) {
      return true;
    } catch (...) {
      return false;
    }
  }

  // The text of the error; empty if there is a value.
  std::string what() const {
    if (!error_) return {};
    try {
      std::rethrow_exception(error_);
    } catch (const std::exception& error) {
      return error.what();
    } catch (...) {
      return "unknown";
    }
  }

 private:
  std::optional<Value> value_;
  std::exception_ptr error_;
};

namespace detail {

// The exceptions that an operation declares.
template <class... Exceptions>
struct Throws {
  static std::exception_ptr read(const rc_answer& answer) {
    std::exception_ptr found;
    ((Exceptions::rc_id == answer.number ? void(found = one<Exceptions>(answer)) : void()), ...);
    return found ? found : std::make_exception_ptr(MalformedReply("an unknown exception"));
  }

 private:
  template <class Exception>
  static std::exception_ptr one(const rc_answer& answer) {
    Exception thrown;
    Reader(answer.bytes).members(thrown.rc_members());
    return std::make_exception_ptr(std::move(thrown));
  }
};

// The parts of a reply: nothing, a value, or a tuple.
inline void read_parts(Reader&, std::tuple<>&) {}
template <class... Parts>
void read_parts(Reader& reader, std::tuple<Parts...>& parts) {
  std::apply([&](auto&... part) { (reader.get(part), ...); }, parts);
}
template <class T>
void read_parts(Reader& reader, T& part) {
  reader.get(part);
}

template <class... Parts>
void write_parts(Writer& writer, const std::tuple<Parts...>& parts) {
  std::apply([&](const auto&... part) { (writer.put(part), ...); }, parts);
}
template <class T>
void write_parts(Writer& writer, const T& part) {
  writer.put(part);
}

// The result of a call.
template <class Reply, class Throws>
Result<Reply> result(const rc_answer& answer) {
  if (answer.status == RC_EXCEPTION) return Throws::read(answer);
  if (answer.status != RC_DONE) return failure(answer);
  std::conditional_t<std::is_void_v<Reply>, std::tuple<>, Reply> reply{};
  Reader reader(answer.bytes);
  read_parts(reader, reply);
  // C++17 would copy the value into the result.
  return Result<Reply>(std::move(reply));
}

// The end of a slot that sends. It works on the thread of the worker.
class End {
 public:
  explicit End(std::size_t slot) : slot_(slot) {}

  // The number of servers or of subscribers.
  std::size_t peers() const {
    return static_cast<std::size_t>(checked(robocomp_get(RC_PEERS, slot_)).number);
  }
  // Whether there is one.
  bool is_connected() const { return peers() > 0; }

 protected:
  std::size_t slot_;
};

}  // namespace detail

// Identifies a started call when it ends.
class CallId {
 public:
  explicit CallId(std::uint64_t number = 0) : number_(number) {}
  friend bool operator==(CallId a, CallId b) { return a.number_ == b.number_; }
  friend bool operator!=(CallId a, CallId b) { return !(a == b); }
  friend bool operator<(CallId a, CallId b) { return a.number_ < b.number_; }

 private:
  std::uint64_t number_;
};

// A call that was started and may not have ended. Its end forgets the call: neither a handler nor
// `take` gets its result.
template <class Reply, class Throws>
class Call {
 public:
  Call() = default;
  explicit Call(std::uint64_t number) : held_(number) {}

  CallId id() const { return CallId(held_.number()); }
  // Whether there is one: not after it was moved from.
  explicit operator bool() const { return held_.number() != 0; }

 private:
  friend class Client;
  detail::Held held_;
};

// The base of a generated client.
class Client : public detail::End {
 public:
  using End::End;

  // The longest time of a call.
  std::chrono::nanoseconds timeout() const {
    return std::chrono::nanoseconds(detail::checked(robocomp_get(RC_CALL_TIMEOUT, slot_)).number);
  }
  // The age of the last reply, and whether it was kept. None before the first one, and for a slot
  // without `fresh` or `cache`.
  std::optional<Freshness> freshness() const {
    const auto number = detail::checked(robocomp_get(RC_FRESHNESS, slot_)).number;
    if (number < 0) return std::nullopt;
    return detail::freshness(number);
  }
  void set_timeout(std::chrono::nanoseconds timeout) {
    detail::checked(robocomp_set(RC_SET_CALL_TIMEOUT, slot_, timeout.count(), {}));
  }

 protected:
  // Calls an operation. `Reply` is `void`, a value, or a tuple of `out` parameters and the result.
  template <class Reply, class Throws = detail::Throws<>, class... In>
  Result<Reply> rc_try(std::size_t operation, const In&... in) const {
    detail::Writer writer;
    writer.members(std::tie(in...));
    return detail::result<Reply, Throws>(robocomp_call(slot_, operation, writer.bytes()));
  }

  // Starts a query of an operation.
  template <class Reply, class Throws = detail::Throws<>, class... In>
  Call<Reply, Throws> rc_start(std::size_t operation, const In&... in) const {
    detail::Writer writer;
    writer.members(std::tie(in...));
    const rc_answer answer = detail::checked(robocomp_start(slot_, operation, writer.bytes()));
    detail::look_again();
    return Call<Reply, Throws>(static_cast<std::uint64_t>(answer.number));
  }

  // Takes the result of a started query.
  template <class Reply, class Throws>
  std::optional<Result<Reply>> rc_take(const Call<Reply, Throws>& call) const {
    const rc_answer answer = robocomp_take(slot_, call.held_.number());
    if (answer.status == RC_NOT_ENDED) return std::nullopt;
    return detail::result<Reply, Throws>(answer);
  }
};

// The base of the newest samples of a slot with `fresh`.
class Samples {
 public:
  explicit Samples(std::size_t slot) : slot_(slot) {}

 protected:
  template <class T>
  Result<Fresh<T>> rc_newest(std::size_t operation) const {
    const rc_answer answer = robocomp_newest(slot_, operation);
    if (answer.status != RC_DONE) return detail::failure(answer);
    Fresh<T> newest{{}, detail::freshness(answer.number)};
    detail::Reader reader(answer.bytes);
    detail::read_parts(reader, newest.value);
    return Result<Fresh<T>>(std::move(newest));
  }

 private:
  std::size_t slot_;
};

// The base of the results of a slot with `serve latest`, which answer queries without a handler.
class Results {
 public:
  explicit Results(std::size_t slot) : slot_(slot) {}

 protected:
  // `Reply` is a value, or a tuple of `out` parameters and the result.
  template <class Reply>
  Result<void> rc_set(std::size_t operation, const Reply& reply) const {
    detail::Writer writer;
    detail::write_parts(writer, reply);
    const rc_answer answer = robocomp_set_latest(slot_, operation, writer.bytes());
    if (answer.status != RC_DONE) return detail::failure(answer);
    return std::tuple<>{};
  }

 private:
  std::size_t slot_;
};

// The base of a generated publisher.
class Publisher : public detail::End {
 public:
  using End::End;

 protected:
  // Publishes a sample on the topic of an operation.
  template <class... In>
  Result<void> rc_try(std::size_t operation, const In&... in) const {
    detail::Writer writer;
    writer.members(std::tie(in...));
    const rc_answer answer = robocomp_publish(slot_, operation, writer.bytes());
    if (answer.status != RC_DONE) return detail::failure(answer);
    return std::tuple<>{};
  }

  // Begins a sample in place.
  template <class Placed>
  Loan<Placed> rc_loan(std::size_t operation) const {
    return Loan<Placed>(detail::checked(robocomp_loan(slot_, operation)));
  }
};

}  // namespace rc
