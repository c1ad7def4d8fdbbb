// The component in C++ of the test of ages: it prints what it sees, each line once until another one.
#pragma once

#include <set>
#include <string>

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void initialize() override;
  void compute() override;
  RoboCompBatteryStatus::TBattery BatteryStatus_getBatteryState() override;
  void view(rc::Fresh<RoboCompLaser::TLaserData> scan,
            rc::Fresh<RoboCompFullPoseEstimation::FullPoseEuler> pose) override;

 private:
  void see(const std::string& what);
  void give();
  void ask();

  std::set<std::string> seen_;
  std::string last_;
  float number_ = 0;
};
