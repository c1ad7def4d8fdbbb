// The exceptions of calls, and those by which a worker changes the state of its component.
#pragma once

#include <chrono>
#include <exception>
#include <ostream>
#include <string>
#include <utility>

#include "robocomp/abi.h"

#if !defined(__cplusplus) || __cplusplus < 201703L
#error "robocomp needs C++17: g++ 8, clang++ 7 or later, with -std=c++17"
#endif

namespace Ice {

// The base of the errors of calls, under the name that workers of RoboComp catch.
class Exception : public std::exception {
 public:
  explicit Exception(std::string text) : text_(std::move(text)) {}
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string text_;
};

inline std::ostream& operator<<(std::ostream& out, const Exception& error) {
  return out << error.what();
}

}  // namespace Ice

namespace rc {

// An exception that the IDSL declares.
class UserException : public Ice::Exception {
 public:
  using Ice::Exception::Exception;
};

// A call or a publication that failed.
class CallError : public Ice::Exception {
 public:
  using Ice::Exception::Exception;
};

// No component serves the slot.
class NoServer final : public CallError { using CallError::CallError; };
// No reply came within the time of the slot.
class Timeout final : public CallError { using CallError::CallError; };
// The server ended while it had the request.
class ServerDied final : public CallError { using CallError::CallError; };
// The server has as many requests as its queue holds.
class QueueFull final : public CallError { using CallError::CallError; };
// The server's handler failed, or does not accept the arguments.
class Refused final : public CallError { using CallError::CallError; };
// The server does not serve the slot in its present state.
class Unavailable final : public CallError { using CallError::CallError; };
// No sample of the topic has come yet.
class NoValue final : public CallError { using CallError::CallError; };
// The value is older than its slot allows, which has `stale refuse`.
class Stale final : public CallError {
 public:
  Stale(std::string text, std::chrono::nanoseconds age) : CallError(std::move(text)), age_(age) {}
  // Its age.
  std::chrono::nanoseconds age() const { return age_; }

 private:
  std::chrono::nanoseconds age_;
};
// As many started calls of the slot as it may have are under way, or their results wait.
class TooManyStarted final : public CallError { using CallError::CallError; };
// This component stops, so it starts no queries.
class Stopping final : public CallError { using CallError::CallError; };
// An argument breaks a bound or a range of the IDSL.
class InvalidArgument final : public CallError { using CallError::CallError; };
// The reply is not of its type.
class MalformedReply final : public CallError { using CallError::CallError; };
// The middleware refused the message.
class MiddlewareError final : public CallError { using CallError::CallError; };
// A sample breaks a bound or a range of the IDSL.
class InvalidSample final : public CallError { using CallError::CallError; };
// A sample was not sent.
class NotSent final : public CallError { using CallError::CallError; };

// The context was used on another thread than the worker's.
class WrongThread final : public Ice::Exception { using Ice::Exception::Exception; };

// The time of the network did not advance.
class TimeError final : public Ice::Exception { using Ice::Exception::Exception; };

// A member of a slot array was not opened, or is none.
class MemberError final : public Ice::Exception { using Ice::Exception::Exception; };
// A view or a loan was used after it was moved from, dropped or sent.
class Dangling final : public Ice::Exception { using Ice::Exception::Exception; };

// A function of the worker that failed: the component runs on, and counts it. The same holds for every
// other exception.
class WorkerError final : public Ice::Exception { using Ice::Exception::Exception; };
// A worker throws it to bring its component into the state Emergency. From a handler, it only refuses
// the request.
class Emergency final : public Ice::Exception { using Ice::Exception::Exception; };
// A worker throws it to end its component with exit code 3.
class Fatal final : public Ice::Exception { using Ice::Exception::Exception; };

namespace detail {

// A window sets it: the end of its wait.
inline void (*end_of_wait)() = nullptr;
// The worker has changed what the component does next: a window looks at it at once.
inline void look_again() {
  if (end_of_wait != nullptr) end_of_wait();
}

inline rc_bytes bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

inline std::string text(rc_bytes bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data), bytes.size);
}

// The exception of a failed call across the border.
inline std::exception_ptr failure(const rc_answer& answer) {
  const std::string reason = text(answer.bytes);
  switch (answer.status) {
    case RC_NO_SERVER: return std::make_exception_ptr(NoServer(reason));
    case RC_TIMEOUT: return std::make_exception_ptr(Timeout(reason));
    case RC_SERVER_DIED: return std::make_exception_ptr(ServerDied(reason));
    case RC_QUEUE_FULL: return std::make_exception_ptr(QueueFull(reason));
    case RC_REFUSED: return std::make_exception_ptr(Refused(reason));
    case RC_UNAVAILABLE: return std::make_exception_ptr(Unavailable(reason));
    case RC_NO_VALUE: return std::make_exception_ptr(NoValue(reason));
    case RC_STALE:
      return std::make_exception_ptr(Stale(reason, std::chrono::nanoseconds(answer.number)));
    case RC_TOO_MANY_STARTED: return std::make_exception_ptr(TooManyStarted(reason));
    case RC_NOT_ADVANCED: return std::make_exception_ptr(TimeError(reason));
    case RC_NO_MEMBER: return std::make_exception_ptr(MemberError(reason));
    case RC_STOPPING: return std::make_exception_ptr(Stopping(reason));
    case RC_INVALID_ARGUMENT: return std::make_exception_ptr(InvalidArgument(reason));
    case RC_MALFORMED_REPLY: return std::make_exception_ptr(MalformedReply(reason));
    case RC_INVALID_SAMPLE: return std::make_exception_ptr(InvalidSample(reason));
    case RC_NOT_SENT: return std::make_exception_ptr(NotSent(reason));
    case RC_WRONG_THREAD:
      return std::make_exception_ptr(
          WrongThread(reason + "; let other threads put their results into a queue, and use the "
                               "context where compute() takes them out"));
    default: return std::make_exception_ptr(MiddlewareError(reason));
  }
}

// Passes a good answer on, and throws a failed one.
inline rc_answer checked(const rc_answer& answer) {
  if (answer.status != RC_DONE) std::rethrow_exception(failure(answer));
  return answer;
}

}  // namespace detail
}  // namespace rc
