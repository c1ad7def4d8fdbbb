// Workers under test: fake peers, virtual time, no process and no middleware.
//
// A worker has its real context, clients and publishers. Values pass the codec of the middleware, so that a
// value that a network would refuse is refused here, too. All of it stays on the thread of the test, which
// has one `TestContext` at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "robocomp/program.h"

// Fails the test with the text of the condition and its place.
#define RC_CHECK(...)                                                                          \
  do {                                                                                         \
    if (!(__VA_ARGS__)) {                                                                      \
      throw std::runtime_error(std::string(__FILE__) + ":" + std::to_string(__LINE__) + ": " + \
                               #__VA_ARGS__);                                                  \
    }                                                                                          \
  } while (false)

namespace rc {

// The fault of a fake server.
enum class Fault {
  // There is none: calls throw `rc::NoServer`, and `is_connected` is false.
  no_server,
  // It does not reply: queries throw `rc::Timeout`, without waiting; commands are queued.
  timeout,
  // It ends during the call: queries throw `rc::ServerDied`, commands `rc::NoServer`.
  server_died,
  // It takes no request: calls throw `rc::QueueFull`.
  queue_full
};

// The parameters of a component without any.
struct NoParams {
  RC_EMPTY_STRUCT(NoParams)
};

namespace detail {

inline rc_answer test(rc_test_what what, std::size_t slot = 0, std::int64_t value = 0,
                      const std::string& text = {}) {
  return checked(robocomp_test(what, slot, value, bytes(text)));
}

// The functions that answer for the fakes of a test.
class Answers {
 public:
  using Key = std::tuple<std::size_t, std::size_t, std::string>;

  void set(Key key, std::function<void(Call&)> answer) { answers_[std::move(key)] = std::move(answer); }
  void on_opened(std::size_t slot, std::function<void(const std::string&)> opened) {
    opened_[slot] = std::move(opened);
  }

  static rc_answer call(void* object, const rc_call* raw) noexcept {
    auto& self = *static_cast<Answers*>(object);
    const auto call = std::make_shared<Call>(*raw);
    // An answer may call further fakes.
    self.call_ = call;
    try {
      if (raw->function == RC_OPENED) {
        const auto found = self.opened_.find(raw->first);
        if (found != self.opened_.end()) found->second(call->name);
      } else {
        const auto found = self.answers_.find({raw->first, raw->second, call->name});
        if (found != self.answers_.end()) {
          const auto answer = found->second;
          answer(*call);
        }
      }
      self.call_ = call;
      return {call->status, call->number, call->reply.bytes()};
    } catch (...) {
      self.text_ = current_exception_text();
      return {RC_FAILED, 0, bytes(self.text_)};
    }
  }

 private:
  std::map<Key, std::function<void(Call&)>> answers_;
  std::map<std::size_t, std::function<void(const std::string&)>> opened_;
  // Keeps the bytes of the last answer.
  std::shared_ptr<Call> call_;
  std::string text_;
};

// The bench of this thread.
class Bench {
 public:
  Bench(const char* description, const char* folder) {
    const std::string all = description;
    const std::string own = folder;
    const std::string release = RC_RELEASE;
    rc_program program{};
    program.version = RC_ABI_VERSION;
    program.release = bytes(release);
    program.description = bytes(all);
    program.folder = bytes(own);
    program.call = &Answers::call;
    program.object = &answers_;
    const rc_answer opened = robocomp_test_open(&program);
    if (opened.status != RC_DONE) throw std::runtime_error(text(opened.bytes));
    parameters_.assign(opened.bytes.data, opened.bytes.data + opened.bytes.size);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() { robocomp_test(RC_TEST_CLOSE, 0, 0, {}); }

  // The values of the configuration.
  rc_bytes parameters() const { return {parameters_.data(), parameters_.size()}; }

  Answers& answers() { return answers_; }

 private:
  Answers answers_;
  std::vector<std::uint8_t> parameters_;
};

// The records of a fake: numbers of operations, and bodies.
class Records {
 public:
  void add(rc_answer taken) {
    Reader reader(taken.bytes);
    std::uint32_t count = 0;
    reader.get(count);
    for (; count > 0; --count) {
      std::uint64_t operation = 0;
      std::vector<std::uint8_t> body;
      reader.get(operation);
      reader.get(body);
      all_.emplace_back(operation, std::move(body));
    }
  }
  void clear() { all_.clear(); }
  std::size_t size() const { return all_.size(); }

  // Those of an operation.
  template <class Sample>
  std::vector<Sample> of(std::size_t operation) const {
    std::vector<Sample> found;
    for (const auto& [number, body] : all_) {
      if (number != operation) continue;
      Sample sample{};
      Reader reader({body.data(), body.size()});
      read_parts(reader, sample);
      found.push_back(std::move(sample));
    }
    return found;
  }

 private:
  std::vector<std::pair<std::uint64_t, std::vector<std::uint8_t>>> all_;
};

}  // namespace detail

// A change of a parameter that a worker has requested. The value is a text of TOML.
struct RequestedParameter {
  std::string path;
  std::string value;
  RC_STRUCT(RequestedParameter, path, value)
};

// The parameters, the worker, the clock and the state of a component under test. The generated class adds
// a fake peer for each slot that calls or publishes.
template <class Params>
class TestContext {
 public:
  // The parameters with which the worker starts: those of `etc/config.toml`.
  Params params;

  TestContext(const char* description, const char* folder) : bench_(description, folder) {
    // A component without parameters has no bytes.
    if (bench_.parameters().size == 0) return;
    detail::Reader reader(bench_.parameters());
    reader.get(params);
  }

  // Makes the worker, runs `initialize`, and starts its state machine. The worker lives as long as the test.
  template <class Worker>
  Worker& start() {
    auto program = std::make_shared<Program<Worker>>();
    program_ = program;
    rethrow_ = [raw = program.get()] { raw->rethrow(); };
    detail::Writer writer;
    writer.put(params);
    return program->start(writer.bytes());
  }

  // Runs the worker for this time, as its process does: `compute` now and after each period, the steps of
  // its machine, `emergency` in the state Emergency, and the ends of started calls. Ends early when the
  // worker stops the component, and with the exception of a function.
  void run(std::chrono::nanoseconds time) { act(RC_TEST_RUN, time.count()); }
  // Takes a managed worker through a transition: `configure`, `activate`, `deactivate`, `cleanup`,
  // `shutdown`. Returns the state afterwards.
  std::string transition(const std::string& transition) {
    return detail::text(act(RC_TEST_TRANSITION, 0, transition).bytes);
  }
  // Lets the worker handle the started calls that have ended. Returns how many.
  std::size_t end_calls() { return static_cast<std::size_t>(act(RC_TEST_END_CALLS).number); }
  // Lists the members of a slot array, as the network does, before the worker opens them.
  void list_members(const std::string& array, const std::vector<std::string>& members) {
    std::string lines = array;
    for (const std::string& member : members) lines += "\n" + member;
    act(RC_TEST_LIST_MEMBERS, 0, lines);
  }
  // Moves the time of `ctx.now()` forward, which begins at zero, or sets it.
  void advance(std::chrono::nanoseconds step) { act(RC_TEST_ADVANCE, step.count()); }
  void set_time(std::chrono::nanoseconds time) { act(RC_TEST_SET_TIME, time.count()); }
  // Sets the state of the component: `starting`, `running`, `emergency`, `stopping`.
  void set_state(const std::string& state) { act(RC_TEST_SET_STATE, 0, state); }

  // Takes the changes of parameters that the worker has requested by `ctx.set_parameter`, in their order. Nothing
  // checks them, and `params` of the worker stays.
  std::vector<RequestedParameter> requested_parameters() {
    std::vector<RequestedParameter> requested;
    detail::Reader(act(RC_TEST_PARAMETERS).bytes).get(requested);
    return requested;
  }

  // For fakes.
  detail::Answers& rc_answers() { return bench_.answers(); }

 private:
  // Throws what the worker has thrown, before the error that follows from it.
  rc_answer act(rc_test_what what, std::int64_t value = 0, const std::string& text = {}) {
    if (rethrow_) {
      try {
        rethrow_();
      } catch (...) {  // of an earlier call, and caught by then
      }
    }
    const rc_answer answer = robocomp_test(what, 0, value, detail::bytes(text));
    if (answer.status != RC_DONE && rethrow_) rethrow_();
    return detail::checked(answer);
  }

  // The worker ends with the bench, before its program.
  std::shared_ptr<void> program_;
  std::function<void()> rethrow_;
  detail::Bench bench_;
};

// The fake peer of a slot, or of a member of an array.
class FakePeer {
 public:
  // Ends the faults.
  void recover() { detail::test(RC_TEST_RECOVER, slot_, 0, member_); }

 protected:
  FakePeer(std::size_t slot, std::string member, rc_test_what kind)
      : slot_(slot), member_(std::move(member)) {
    detail::test(kind, slot_, 0, member_);
  }

  std::size_t slot_;
  std::string member_;
  detail::Records records_;
};

// The base of fake servers.
class FakeServer : public FakePeer {
 public:
  template <class Params>
  FakeServer(TestContext<Params>& test, std::size_t slot, std::string member = {})
      : FakePeer(slot, std::move(member), RC_TEST_SERVER), answers_(&test.rc_answers()) {}

  // Answers every query that has no answer yet with default values.
  void answer_defaults() { detail::test(RC_TEST_ANSWER_DEFAULTS, slot_, 0, member_); }
  // Lets all calls fail from now on, or only the next one.
  void fail(Fault fault) { detail::test(RC_TEST_FAIL, slot_, static_cast<int>(fault), member_); }
  void fail_once(Fault fault) {
    detail::test(RC_TEST_FAIL, slot_, static_cast<int>(fault) + 16, member_);
  }
  // The number of calls that have reached the server.
  std::size_t calls() {
    take();
    return records_.size();
  }
  // Forgets them.
  void clear_calls() {
    take();
    records_.clear();
  }

 protected:
  template <class Reply, class Throws, class... In>
  void rc_on(std::size_t operation, std::function<Reply(In...)> answer) {
    answers_->set({slot_, operation, member_}, [answer = std::move(answer)](detail::Call& call) {
      std::tuple<detail::Plain<In>...> arguments{};
      std::apply([&](auto&... argument) { (call.body.get(argument), ...); }, arguments);
      const auto run = [&] {
        if constexpr (std::is_void_v<Reply>) {
          std::apply(answer, arguments);
          call.reply.members(std::tuple<>());
        } else {
          detail::write_parts(call.reply, std::apply(answer, arguments));
        }
      };
      detail::guarded(call, run, Throws{});
    });
    detail::test(RC_TEST_ANSWER, slot_, static_cast<std::int64_t>(operation), member_);
  }
  template <class Sample>
  std::vector<Sample> rc_calls(std::size_t operation) {
    take();
    return records_.of<Sample>(operation);
  }

 private:
  void take() { records_.add(detail::test(RC_TEST_CALLS, slot_, 0, member_)); }

  detail::Answers* answers_;
};

// The base of fake subscribers.
class FakeSubscriber : public FakePeer {
 public:
  template <class Params>
  FakeSubscriber(TestContext<Params>&, std::size_t slot, std::string member = {})
      : FakePeer(slot, std::move(member), RC_TEST_SUBSCRIBER) {}

  // Lets publishing fail with `rc::NotSent`.
  void fail(const std::string& reason) {
    detail::test(RC_TEST_FAIL_PUBLISHING, slot_, 0, member_ + "\n" + reason);
  }
  // Sets the number of subscribers that the worker sees; there is one.
  void set_subscribers(std::size_t count) {
    detail::test(RC_TEST_SUBSCRIBERS, slot_, static_cast<std::int64_t>(count), member_);
  }
  // The number of samples of all topics.
  std::size_t samples() {
    take();
    return records_.size();
  }
  // Forgets them.
  void clear_samples() {
    take();
    records_.clear();
  }

 protected:
  template <class Sample>
  std::vector<Sample> rc_samples(std::size_t operation) {
    take();
    return records_.of<Sample>(operation);
  }

 private:
  void take() { records_.add(detail::test(RC_TEST_SAMPLES, slot_, 0, member_)); }
};

// The fake peers of the members of a slot array.
template <class Fake>
class FakeArray {
 public:
  template <class Params>
  FakeArray(TestContext<Params>& test, std::size_t slot)
      : make_([&test, slot](const std::string& name) { return std::make_unique<Fake>(test, slot, name); }) {
    test.rc_answers().on_opened(slot, [this](const std::string& name) { member(name); });
  }
  FakeArray(const FakeArray&) = delete;
  FakeArray& operator=(const FakeArray&) = delete;

  // The peer of a member. A test may prepare it before the worker opens the member.
  Fake& member(const std::string& name) {
    auto& fake = fakes_[name];
    if (!fake) {
      fake = make_(name);
      for (const auto& prepare : prepare_) prepare(*fake);
    }
    return *fake;
  }
  // Does this with the peer of each member, now and when the worker opens it.
  void each(std::function<void(Fake&)> prepare) {
    for (const auto& [name, fake] : fakes_) prepare(*fake);
    prepare_.push_back(std::move(prepare));
  }
  void answer_defaults() {
    each([](Fake& fake) { fake.answer_defaults(); });
  }

 private:
  std::function<std::unique_ptr<Fake>(const std::string&)> make_;
  std::map<std::string, std::unique_ptr<Fake>> fakes_;
  std::vector<std::function<void(Fake&)>> prepare_;
};

// Runs a test and prints what it has thrown. Returns the exit code.
template <class Test>
int run_test(const char* name, const Test& test) {
  detail::report_crashes();
  try {
    test();
    return 0;
  } catch (...) {
    std::fprintf(stderr, "%s: %s\n", name, detail::current_exception_text().c_str());
    return 1;
  }
}

}  // namespace rc
