#include "specificworker.h"

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "values.h"

using namespace std::chrono_literals;

namespace {

constexpr std::int32_t SLOW = 5;
constexpr std::int32_t FOREIGN = 10;
constexpr std::int32_t THREAD = 11;
constexpr std::int32_t CRASH = 12;
constexpr std::int32_t DESTRUCTOR = 13;
constexpr std::int32_t EXIT = 14;
constexpr std::int32_t KEEPS_A_POINTER_OF_A_LOAN = 15;
constexpr std::int32_t KEEPS_A_POINTER_OF_A_VIEW = 16;
constexpr std::int32_t NO_TEXT = 17;
constexpr std::int32_t EMERGENCY_ON_A_THREAD = 18;

void fails() { throw std::runtime_error("at the end of an object"); }
struct ThrowsAtItsEnd {
  ~ThrowsAtItsEnd() { fails(); }
};
// Notes that let the component call itself, and drop all views.
constexpr std::int32_t ASK = 1000;
constexpr std::int32_t DROP = 1001;
// Pictures from this number on are kept.
constexpr std::int32_t KEPT = 2000;

// The exception of a call from another thread.
std::string on_another_thread(const Context& ctx) {
  std::string thrown = "nothing";
  std::thread([&] {
    try {
      ctx.now();
    } catch (const rc::WrongThread&) {
      thrown = "WrongThread";
    }
  }).join();
  return thrown;
}

}  // namespace

std::string SpecificWorker::Types_differs(const RcTypes::Everything& all) {
  return difference(sample(all.number), all);
}

RcTypes::Everything SpecificWorker::Types_make(std::int32_t number) { return sample(number); }

std::string SpecificWorker::Types_mirrored(std::int32_t number) {
  if (number == THREAD) return on_another_thread(ctx);
  // The server is slow when it is asked for that.
  if (number == -SLOW) {
    mirror_proxy->set_timeout(50ms);
  } else {
    mirror_proxy->set_timeout(20s);
  }
  try {
    if (number > 0) return difference(sample(number), mirror_proxy->echo(sample(number)));
    mirror_proxy->fail(-number);
    return "nothing was thrown";
  } catch (const RcTypes::Broken& error) {
    return number == -LEAST && error == broken() ? "" : "another Broken";
  } catch (const RcTypes::VeryBroken& error) {
    return number == -MOST && error == very_broken() ? "" : "another VeryBroken";
  } catch (const RcTypes::Gone&) {
    return number == -SOME ? "" : "another Gone";
  } catch (const rc::Refused& error) {
    return std::string("Refused: ") + error.what();
  } catch (const rc::Timeout&) {
    return "Deadline";
  } catch (const rc::NoServer&) {
    return "NoServer";
  } catch (const rc::ServerDied&) {
    return "ServerDied";
  } catch (const Ice::Exception& error) {
    return error.what();
  }
}

RcTypes::Picture SpecificWorker::Types_turned(const RcTypes::Picture& picture) {
  RcTypes::Picture turned = picture;
  std::reverse(turned.data.begin(), turned.data.end());
  return turned;
}

std::int32_t SpecificWorker::Types_several(std::int32_t number, const std::string& text,
                                           const RcTypes::Outline& outline, RcTypes::Kind kind,
                                           const std::optional<RcTypes::Point>& point,
                                           std::string& again, RcTypes::Outline& same,
                                           RcTypes::Kind& next,
                                           std::optional<RcTypes::Point>& maybe) {
  again = text;
  same = outline;
  next = kind;
  maybe = point;
  return number;
}

void SpecificWorker::Types_outputs(std::int64_t& number, std::vector<std::string>& texts) {
  number = INT64_MIN;
  texts = {"a", ""};
}

void SpecificWorker::Types_fail(std::int32_t which) {
  switch (which) {
    case 0: return;
    case LEAST: throw broken();
    case MOST: throw very_broken();
    case SOME: throw RcTypes::Gone();
    case FOREIGN: throw 42;  // no exception
    case NO_TEXT: throw static_cast<const char*>(nullptr);
    case EMERGENCY_ON_A_THREAD: {
      std::exception_ptr refused;
      std::thread([&] {
        try {
          goToEmergency();
        } catch (...) {
          refused = std::current_exception();
        }
      }).join();
      if (refused) std::rethrow_exception(refused);
      return;
    }
    case CRASH: {
      volatile int* nowhere = nullptr;
      *nowhere = 1;
      return;
    }
    case DESTRUCTOR: {
      const ThrowsAtItsEnd guard;
      return;
    }
    case EXIT: std::exit(7);
    case KEEPS_A_POINTER_OF_A_LOAN: {
      auto copy = copies_pubproxy->loan();
      copy.set({});
      auto* const number = &copy->number;
      copy.send();
      *number = 2;
      return;
    }
    case KEEPS_A_POINTER_OF_A_VIEW: {
      const auto* const number = &kept_.at(0)->number;
      kept_.clear();
      numbers_.push_back(static_cast<std::int32_t>(*number));
      return;
    }
    default: throw std::runtime_error("unexpected");
  }
}

void SpecificWorker::Types_wait(std::int32_t milliseconds) {
  repeats_pubproxy->several(milliseconds, 0.0, "", {}, RcTypes::Kind::nothing, {});
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

void SpecificWorker::initialize() {
  for (const char* name : {"first", "second"}) {
    ctx.served.open(name);
    ctx.asked.open(name);
  }
  try {
    ctx.asked.open("first");
  } catch (const rc::MemberError&) {
    return;
  }
  throw rc::Fatal("a member was opened twice");
}

// Starts calls of its own members, which end later.
void SpecificWorker::Types_note(const RcTypes::Everything& all) {
  numbers_.push_back(all.number);
  if (all.number == DROP) {
    kept_.clear();
    last_ = {};
  }
  if (all.number != ASK) return;
  for (const rc::Member& member : ctx.asked.members()) {
    echoes_.push_back(ctx.asked[member].start_echo(all));
    fails_.push_back(ctx.asked[member].start_fail(SOME));
  }
}

RcTypes::Everything SpecificWorker::served_echo(const rc::Member& member,
                                                const RcTypes::Everything& all) {
  RcTypes::Everything same = all;
  same.number += static_cast<std::int32_t>(member.index()) + 1;
  return same;
}

void SpecificWorker::served_fail(const rc::Member& member, std::int32_t which) {
  if (member.name() == "first" && which == SOME) throw RcTypes::Gone();
}

void SpecificWorker::asked_echo_done(const rc::Member& member, rc::CallId call,
                                     rc::Result<RcTypes::Everything> result) {
  const bool is_own = call == echoes_.at(member.index()).id();
  numbers_.push_back(is_own ? result.value().number : -1);
}

// Takes the results that have no handler.
void SpecificWorker::compute() {
  for (std::size_t at = 0; at < fails_.size(); ++at) {
    auto taken = ctx.asked[ctx.asked.members()[at % 2]].take(fails_[at]);
    if (!taken) continue;
    numbers_.push_back(taken->ok() ? ASK + 11 : taken->is<RcTypes::Gone>() ? ASK + 10 : -1);
  }
}

// An error of `send` ends the loan: the topic lends one at a time.
void SpecificWorker::loans_that_are_not_sent() {
  auto invalid = copies_pubproxy->loan();
  invalid->kinds[1] = static_cast<RcTypes::Kind>(77);
  try {
    invalid.send();
    throw rc::Fatal("a number of no enumerator was sent");
  } catch (const rc::InvalidSample&) {
  }
  auto foreign = copies_pubproxy->loan();
  std::string thrown = "nothing";
  std::thread([&] {
    try {
      foreign.send();
    } catch (const rc::WrongThread&) {
      thrown = "WrongThread";
    }
  }).join();
  if (thrown != "WrongThread") throw rc::Fatal("another thread sent a sample");
  copies_pubproxy->loan();
}

void SpecificWorker::Pictures_picture(rc::View<RcTypes::PictureInPlace> picture) {
  if (picture->number >= KEPT) {
    numbers_.push_back(static_cast<std::int32_t>(picture->number));
    kept_.push_back(std::move(picture));
    return;
  }
  if (picture->number % 2 == 0) {
    copies_pubproxy->copy(picture.copy());
  } else {
    auto copy = copies_pubproxy->loan();
    copy.set(picture.copy());
    copy->number = picture->number;
    copy->data.resize(picture->data.size());
    std::copy(picture->data.begin(), picture->data.end(), copy->data.begin());
    copy.send();
    try {
      copy->number = 0;
      throw rc::Fatal("a loan was used after it was sent");
    } catch (const rc::Dangling&) {
    }
    loans_that_are_not_sent();
  }
  last_ = std::move(picture);
  if (picture || !last_) throw rc::Fatal("a view moves");
}
