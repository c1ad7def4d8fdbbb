#include "specificworker.h"

using namespace std::chrono_literals;

namespace {

/// Below this percentage, the robot stops and charges; from the other one on, it drives again.
constexpr float LOW = 20;
constexpr float FULL = 80;
/// How often the battery is read.
constexpr auto BATTERY_PERIOD = 1s;

}  // namespace

// The robot drives from the start on.
void SpecificWorker::entry_motion() { machine.fire(Event::Go); }

void SpecificWorker::during_idle() { stand(); }

void SpecificWorker::during_charging() { stand(); }

// Runs before the function of the state inside.
void SpecificWorker::during_driving() {
  if (params.lockstep) {
    // Two interfaces are two queues: a server that is late may serve the scan before the motion that
    // was sent earlier. One answers in the order in which it was asked, so that an answer of the
    // base says it is done.
    RoboCompGenericBase::TBaseState state;
    differentialrobot_proxy->getBaseState(state);
  }
  scan_.clear();
  for (const auto& data : laser_proxy->getLaserData()) scan_.push_back({data.angle, data.dist});
}

void SpecificWorker::exit_driving() { differentialrobot_proxy->stopBase(); }

void SpecificWorker::during_cruising() {
  if (policy::is_clear(scan_, settings())) return drive(policy::cruise(scan_, settings()));
  machine.fire(Event::Obstacle);
  turn();
}

void SpecificWorker::during_turning() {
  if (!policy::is_clear_again(scan_, settings())) return turn();
  machine.fire(Event::Clear);
  drive(policy::cruise(scan_, settings()));
}

void SpecificWorker::exit_turning() { side_.reset(); }

void SpecificWorker::during_blocked() {
  if (policy::is_clear_again(scan_, settings())) machine.fire(Event::Clear);
  drive({});
}

void SpecificWorker::during_battery() {
  const auto now = ctx.now();
  const bool is_early = looked_ && now >= *looked_ && now - *looked_ < BATTERY_PERIOD;
  if (is_early || !batterystatus_proxy->is_connected()) return;
  looked_ = now;
  const auto battery = ctx.battery_status.get_battery_state();
  if (battery.percentage < LOW) {
    machine.fire(Event::BatteryLow);
  } else if (battery.percentage >= FULL) {
    machine.fire(Event::BatteryFull);
  }
}

// Turns on the spot, always to the same side.
void SpecificWorker::turn() {
  if (scan_.empty()) return drive({});
  if (!side_) side_ = policy::freer(scan_);
  drive(policy::turn(*side_, settings()));
}

// In lockstep, the time of the simulator passes with each motion.
void SpecificWorker::stand() {
  if (params.lockstep) drive({});
}

void SpecificWorker::drive(const policy::Motion& motion) {
  differentialrobot_proxy->setSpeedBase(motion.advance, motion.turn);
}

policy::Settings SpecificWorker::settings() const {
  return {params.safe_distance, params.speed, params.turn_speed};
}
