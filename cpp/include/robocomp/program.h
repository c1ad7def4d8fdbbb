// Runs a worker over librobocomp_cpp.so.
#pragma once

#include <cxxabi.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <typeinfo>
#include <utility>

#include "robocomp/worker.h"

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define RC_HAS_THREAD_SANITIZER
#endif
#elif defined(__SANITIZE_THREAD__)
#define RC_HAS_THREAD_SANITIZER
#endif

#ifdef RC_HAS_THREAD_SANITIZER
// The library is compiled without the sanitizer, which does not see how its threads wait for each other.
extern "C" __attribute__((used)) inline const char* __tsan_default_suppressions() {
  return "called_from_lib:librobocomp_cpp.so\n";
}
#endif

namespace rc {

namespace detail {

// A name of C++ as its source has it.
inline std::string readable(const char* name) {
  int status = 0;
  char* text = abi::__cxa_demangle(name, nullptr, nullptr, &status);
  const std::string readable = status == 0 && text != nullptr ? text : name;
  std::free(text);
  return readable;
}

// A text in C, which may be a null pointer.
inline std::string told(const char* text) { return text != nullptr ? text : "a text that is a null pointer"; }

// The exception that is handled, in one line.
inline std::string current_exception_text() {
  try {
    throw;
  } catch (const Ice::Exception& error) {
    return told(error.what());
  } catch (const std::exception& error) {
    return readable(typeid(error).name()) + ": " + told(error.what());
  } catch (const std::string& text) {
    return text;
  } catch (const char* text) {
    return told(text);
  } catch (...) {
    const std::type_info* type = abi::__cxa_current_exception_type();
    const std::string name = type == nullptr ? "foreign" : readable(type->name());
    return "an exception of the type " + name + ", which is not a std::exception";
  }
}

// Prints the functions that led here. Those without a name, which are of the runtime, are one line.
inline void print_stack() {
  std::array<void*, 64> frames{};
  const auto count = static_cast<std::size_t>(backtrace(frames.data(), static_cast<int>(frames.size())));
  bool was_known = true;
  for (std::size_t at = 2; at < count; ++at) {
    Dl_info info{};
    const bool is_known = dladdr(frames[at], &info) != 0 && info.dli_sname != nullptr;
    if (is_known) {
      std::fprintf(stderr, "  %zu: %s\n", at - 2, readable(info.dli_sname).c_str());
    } else if (was_known) {
      std::fprintf(stderr, "  …\n");
    }
    was_known = is_known;
  }
}

// Prints why the program ends.
[[noreturn]] inline void terminated() {
  const std::string reason =
      std::current_exception() ? current_exception_text() : "std::terminate was called";
  std::fprintf(stderr, "error: the worker ended the process: %s\n", reason.c_str());
  print_stack();
  std::abort();
}

// Prints a backtrace of a fatal signal. It calls functions that are not meant for signal handlers
// and may hang, as in an allocation that was interrupted: then the alarm ends the process.
inline void crashed(int signal, siginfo_t* about, void*) {
  std::signal(SIGALRM, SIG_DFL);
  sigset_t alarms;
  sigemptyset(&alarms);
  sigaddset(&alarms, SIGALRM);
  pthread_sigmask(SIG_UNBLOCK, &alarms, nullptr);
  alarm(2);
  std::fprintf(stderr, "error: the worker crashed: %s\n", strsignal(signal));
  if (signal == SIGSEGV && ended_addresses.has(about->si_addr)) {
    std::fprintf(stderr, "it used a pointer or a reference into a sample in place after its view or loan had ended\n");
  }
  print_stack();
  std::raise(signal);
}

// Whether a function of the worker runs on this thread.
inline thread_local bool is_in_worker = false;

// Marks a function of the worker while it runs.
class InWorker {
 public:
  InWorker() : was_(std::exchange(is_in_worker, true)) {}
  InWorker(const InWorker&) = delete;
  InWorker& operator=(const InWorker&) = delete;
  ~InWorker() { is_in_worker = was_; }

 private:
  bool was_;
};

// Reports that the worker has called `exit`. Then the process ends at once: the runtime's threads still use what
// destructors would end.
inline void exited(int code, void*) {
  if (!is_in_worker) return;
  std::fprintf(stderr, "error: the worker called exit, which ends the process; ctx.stop() ends a component in order\n");
  print_stack();
  std::fflush(nullptr);
  std::_Exit(code);
}

// Reports crashes from now on.
inline void report_crashes() {
  on_exit(exited, nullptr);
  std::set_terminate(terminated);
  // Loads the libraries that a report needs.
  std::array<void*, 1> frame{};
  backtrace(frame.data(), 1);
  struct sigaction action {};
  action.sa_sigaction = crashed;
  // The second time, the signal ends the process.
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_NODEFER | SA_SIGINFO);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) sigaction(signal, &action, nullptr);
}

}  // namespace detail

// A component with the user's worker.
template <class Specific>
class Program {
 public:
  int run(const std::string& description, const std::string& folder, int count,
          const char* const* arguments) {
    detail::report_crashes();
    rc_program program{};
    program.version = RC_ABI_VERSION;
    const std::string release = RC_RELEASE;
    program.release = detail::bytes(release);
    program.description = detail::bytes(description);
    program.folder = detail::bytes(folder);
    program.call = &Program::call;
    program.object = this;
    return robocomp_run(&program, static_cast<std::size_t>(count), arguments);
  }

  // Makes the worker of a test on this thread.
  Specific& start(rc_bytes parameters) {
    const rc_answer answer = robocomp_test_start(&Program::call, this, parameters);
    rethrow();
    detail::checked(answer);
    return *worker_;
  }
  // Throws what the last functions of the worker have thrown, once.
  void rethrow() {
    if (std::exception_ptr thrown = std::exchange(thrown_, nullptr)) std::rethrow_exception(thrown);
  }

 private:
  // Runs a function of the worker; every exception is an outcome.
  static rc_answer call(void* object, const rc_call* raw) noexcept {
    auto& self = *static_cast<Program*>(object);
    const detail::InWorker marked;
    self.call_.emplace(*raw);
    try {
      self.dispatch(*raw);
      return {self.call_->status, self.call_->number, self.call_->reply.bytes()};
    } catch (const Emergency&) {
      return self.failed(RC_EMERGENCY);
    } catch (const Fatal&) {
      return self.failed(RC_FATAL);
    } catch (...) {
      return self.failed(RC_FAILED);
    }
  }

  rc_answer failed(std::int32_t status) {
    thrown_ = std::current_exception();
    text_ = detail::current_exception_text();
    // A slot or compute() that has called `goToEmergency` may fail afterwards, e.g. to stop a base that is not there.
    const bool is_free = call_->raw.function == RC_COMPUTE || call_->raw.function == RC_WAIT;
    if (status == RC_FAILED && is_free && worker_ && !worker_base().emergency_reason_.empty()) {
      log_error(text_);
      text_ = std::exchange(worker_base().emergency_reason_, {});
      status = RC_EMERGENCY;
    }
    return {status, 0, detail::bytes(text_)};
  }

  void dispatch(const rc_call& raw) {
    const auto function = static_cast<rc_function>(raw.function);
    if (function == RC_INITIALIZE) {
      prepared_ = Specific::rc_prepare();
      worker_ = std::make_unique<Specific>();
      worker_base().rc_set_parameters(call_->body);
      worker_base().initialize();
      worker_base().rc_show();
      return enter_emergency();
    }
    if (!worker_) return;  // its constructor has thrown
    Worker& worker = worker_base();
    switch (function) {
      case RC_WAIT:
        worker.rc_wait(static_cast<int>(raw.first), std::chrono::nanoseconds(raw.second));
        return enter_emergency();
      case RC_COMPUTE: worker.compute(); return enter_emergency();
      case RC_SET_PARAMETERS: return worker.rc_set_parameters(call_->body);
      case RC_PARAMETERS_CHANGED: {
        std::vector<ParamChange> changes;
        call_->body.get(changes);
        return worker.params_changed(changes);
      }
      case RC_ENTER_EMERGENCY: return worker.emergency();
      case RC_RESTORE: return worker.restore();
      case RC_FINALIZE: return worker.finalize();
      case RC_TRANSITION: return transition(worker, call_->name);
      case RC_ERROR: return worker.error(call_->name, detail::text(raw.body));
      case RC_END: worker_.reset(); return;
      default: break;
    }
    for (const detail::Entry& entry : worker.rc_functions()) {
      if (entry.function == function && entry.first == raw.first && entry.second == raw.second) {
        worker.is_written_ = true;
        entry.call(worker, *call_);
        if (!worker.is_written_) call_->status = RC_NOT_WRITTEN;
        if (function != RC_HANDLE && function != RC_GUARD && function != RC_ENDED) enter_emergency();
        return;
      }
    }
    call_->status = RC_NOT_WRITTEN;
  }

  static void transition(Worker& worker, const std::string& name) {
    if (name == "configure") return worker.configure();
    if (name == "activate") return worker.activate();
    if (name == "deactivate") return worker.deactivate();
    if (name == "cleanup") return worker.cleanup();
    if (name == "shutdown") return worker.shutdown();
  }

  // The request of `goToEmergency`.
  void enter_emergency() {
    std::string reason = std::move(worker_base().emergency_reason_);
    worker_base().emergency_reason_.clear();
    if (!reason.empty()) throw Emergency(std::move(reason));
  }

  Worker& worker_base() { return *worker_; }

  // Ends after the worker.
  std::shared_ptr<void> prepared_;
  std::unique_ptr<Specific> worker_;
  // The last call, which keeps the bytes of its answer.
  std::optional<detail::Call> call_;
  std::string text_;
  std::exception_ptr thrown_;
};

// The `main` of a component.
template <class Specific>
int run(const std::string& description, const std::string& folder, int count,
        const char* const* arguments) {
  static_assert(std::is_base_of_v<Worker, Specific>, "a worker inherits from GenericWorker");
  return Program<Specific>().run(description, folder, count > 0 ? count - 1 : 0,
                                 count > 0 ? arguments + 1 : arguments);
}

}  // namespace rc
