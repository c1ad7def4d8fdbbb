#include "specificworker.h"

#include <algorithm>

using namespace std::chrono_literals;

namespace {

/// How often the battery is read.
constexpr auto BATTERY_PERIOD = 1s;
/// The limits of `range`, in millimetres.
constexpr std::int32_t LEAST_RANGE = 1000;
constexpr std::int32_t MOST_RANGE = 8000;

}  // namespace

void SpecificWorker::initialize() {
  connect(emergencyButton, &QPushButton::clicked, this, &SpecificWorker::stop);
  connect(scan, &ScanView::clicked, this, &SpecificWorker::zoom);
}

void SpecificWorker::compute() {
  show_scan();
  show_battery();
}

// The button: the base stops before anything else happens. `rcdeploy emergency NETWORK NAME off` ends the
// emergency.
void SpecificWorker::stop() {
  is_stopped_ = true;
  goToEmergency("the emergency button was pressed");
  show_emergency(true);
  base_proxy->stopBase();
}

void SpecificWorker::zoom() {
  const bool is_least = params.range <= LEAST_RANGE;
  ctx.set_parameter("range", is_least ? MOST_RANGE : std::max(params.range / 2, LEAST_RANGE));
}

void SpecificWorker::params_changed(const std::vector<rc::ParamChange>&) { show_scan(); }

// A tool may have asked for the emergency, too.
void SpecificWorker::emergency() {
  if (!is_stopped_) show_emergency(true);
  is_stopped_ = true;
  base_proxy->stopBase();
  compute();
}

void SpecificWorker::restore() {
  is_stopped_ = false;
  show_emergency(false);
}

// Nobody can stop the base without the window.
void SpecificWorker::finalize() { base_proxy->stopBase(); }

void SpecificWorker::show_scan() {
  auto result = ctx.laser.try_get_laser_data();
  const auto measures = result.value_or({});
  scan->show_scan(measures, params.range);
  if (measures.empty()) {
    return nearest->setText(result.ok() ? "empty scan" : QString::fromStdString(result.what()));
  }
  const auto closest = std::min_element(measures.begin(), measures.end(),
                                        [](const auto& a, const auto& b) { return a.dist < b.dist; });
  nearest->setText(QString("nearest: %1 mm").arg(qRound(closest->dist)));
}

void SpecificWorker::show_battery() {
  const auto now = ctx.now();
  if (looked_ && now >= *looked_ && now - *looked_ < BATTERY_PERIOD) return;
  looked_ = now;
  auto result = ctx.battery_status.try_get_battery_state();
  battery->setFormat(result.ok() ? "battery %p %" : "no battery");
  battery->setValue(qRound(result.value_or({}).percentage));
}

void SpecificWorker::show_emergency(bool is_on) {
  emergencyButton->setDisabled(is_on);
  emergencyButton->setText(is_on ? "STOPPED" : "EMERGENCY STOP");
}

// The gate. Motions do not pass it in an emergency; everything else does.

void SpecificWorker::DifferentialRobot_setSpeedBase(float adv, float rot) {
  if (!is_stopped_) base_proxy->setSpeedBase(adv, rot);
}

void SpecificWorker::DifferentialRobot_stopBase() { base_proxy->stopBase(); }

void SpecificWorker::DifferentialRobot_getBaseState(RoboCompGenericBase::TBaseState& state) {
  base_proxy->getBaseState(state);
}

void SpecificWorker::DifferentialRobot_getBasePose(std::int32_t& x, std::int32_t& z, float& alpha) {
  base_proxy->getBasePose(x, z, alpha);
}

RoboCompDifferentialRobot::TMechParams SpecificWorker::DifferentialRobot_getMechParams() {
  return base_proxy->getMechParams();
}

void SpecificWorker::DifferentialRobot_resetOdometer() { base_proxy->resetOdometer(); }

void SpecificWorker::DifferentialRobot_setOdometer(const RoboCompGenericBase::TBaseState& state) {
  base_proxy->setOdometer(state);
}

void SpecificWorker::DifferentialRobot_setOdometerPose(std::int32_t x, std::int32_t z, float alpha) {
  base_proxy->setOdometerPose(x, z, alpha);
}

void SpecificWorker::DifferentialRobot_correctOdometer(std::int32_t x, std::int32_t z, float alpha) {
  base_proxy->correctOdometer(x, z, alpha);
}
