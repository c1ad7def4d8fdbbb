// Drives with a constant speed, repeats the poses that it hears, and serves a battery.
#pragma once

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void compute() override;
  void params_changed(const std::vector<rc::ParamChange>& changes) override;

  RoboCompBatteryStatus::TBattery BatteryStatus_getBatteryState() override;
  void FullPoseEstimationPub_newFullPose(const RoboCompFullPoseEstimation::FullPoseEuler& pose) override;

 private:
  int poses_ = 0;
};
