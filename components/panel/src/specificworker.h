// The window of the panel, and the gate between the base and the component that drives it.
#pragma once

#include <optional>

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
  Q_OBJECT

 public:
  void initialize() override;
  void compute() override;
  void params_changed(const std::vector<rc::ParamChange>& changes) override;
  void emergency() override;
  void restore() override;
  void finalize() override;

  void DifferentialRobot_getBaseState(RoboCompGenericBase::TBaseState& state) override;
  void DifferentialRobot_getBasePose(std::int32_t& x, std::int32_t& z, float& alpha) override;
  RoboCompDifferentialRobot::TMechParams DifferentialRobot_getMechParams() override;
  void DifferentialRobot_setSpeedBase(float adv, float rot) override;
  void DifferentialRobot_stopBase() override;
  void DifferentialRobot_resetOdometer() override;
  void DifferentialRobot_setOdometer(const RoboCompGenericBase::TBaseState& state) override;
  void DifferentialRobot_setOdometerPose(std::int32_t x, std::int32_t z, float alpha) override;
  void DifferentialRobot_correctOdometer(std::int32_t x, std::int32_t z, float alpha) override;

 private slots:
  void stop();
  void zoom();

 private:
  void show_scan();
  void show_battery();
  void show_emergency(bool is_on);

  /// Whether the base must not move.
  bool is_stopped_ = false;
  /// When it looked at the battery.
  std::optional<std::chrono::nanoseconds> looked_;
};
