#include "specificworker.h"

#include <algorithm>

using namespace std::chrono_literals;

namespace {

/// The shortest period of a component.
constexpr std::chrono::nanoseconds SHORTEST = 100us;
/// The period while nothing sets the pace.
constexpr std::chrono::nanoseconds IDLE = 10ms;

}  // namespace

void SpecificWorker::initialize() {
  if (!ctx.time.is_active()) {
    throw rc::Fatal("the network has another clock; write `time simulated by NAME;` in its .ddsl");
  }
  pace();
}

void SpecificWorker::compute() {
  // While a follower is missing, the runtime goes on waiting.
  if (!params.paused && !is_over() && ctx.time.missing().empty()) ctx.time.advance(params.step);
}

void SpecificWorker::params_changed(const std::vector<rc::ParamChange>&) { pace(); }

bool SpecificWorker::is_over() const { return params.end > 0ns && ctx.now() >= params.end; }

void SpecificWorker::pace() {
  const bool is_paced = params.rate > 0.0;
  ctx.time.set_paced(is_paced);
  ctx.time.set_order(params.at_once ? rc::Order::at_once : rc::Order::in_turn);
  if (params.wait) {
    ctx.time.wait_for_all(params.limit);
  } else {
    ctx.time.wait_for_nobody();
  }
  const auto step = std::chrono::duration<double, std::nano>(params.step) / (is_paced ? params.rate : 1.0);
  ctx.set_period(
      is_paced ? std::max(std::chrono::duration_cast<std::chrono::nanoseconds>(step), SHORTEST) : IDLE);
}
