#include "specificworker.h"

#include <iostream>

void SpecificWorker::compute() {
  ctx.differential_robot.set_speed_base(params.speed, 0);
  RoboCompGenericBase::TBaseState state;
  differentialrobot_proxy->getBaseState(state);
  std::cout << "speed=" << params.speed << " x=" << state.x << std::endl;
}

void SpecificWorker::params_changed(const std::vector<rc::ParamChange>&) {
  std::cout << "parameter=" << params.speed << std::endl;
}

RoboCompBatteryStatus::TBattery SpecificWorker::BatteryStatus_getBatteryState() {
  RoboCompBatteryStatus::TBattery battery;
  battery.percentage = 77;
  return battery;
}

void SpecificWorker::FullPoseEstimationPub_newFullPose(const RoboCompFullPoseEstimation::FullPoseEuler& pose) {
  std::cout << "poses=" << ++poses_ << std::endl;
  ctx.seen.new_full_pose(pose);
}
