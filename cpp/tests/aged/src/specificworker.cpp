#include "specificworker.h"

#include <cstdlib>
#include <iostream>

namespace {

void require(bool holds, const char* what) {
  if (!holds) throw rc::Fatal(what);
}

const char* word(rc::Made made) {
  switch (made) {
    case rc::Made::computed: return "computed";
    case rc::Made::partly_cached: return "partly cached";
    default: return "cached";
  }
}

}  // namespace

void SpecificWorker::see(const std::string& what) {
  if (seen_.insert(what).second) std::cout << what << std::endl;
}

void SpecificWorker::initialize() {
  if (ctx.poses.try_new_full_pose().is<rc::NoValue>()) see("no value");
  if (ctx.name() == "giver") {
    RoboCompBatteryStatus::TBattery battery;
    battery.percentage = std::stof(std::getenv("AGED_BATTERY"));
    ctx.battery_status.set_get_battery_state(battery);
  }
}

void SpecificWorker::compute() {
  if (ctx.name() == "giver") give();
  else ask();
}

void SpecificWorker::give() {
  number_ += 1;
  RoboCompLaser::TData echo;
  echo.dist = number_;
  ctx.laser_pub.push_laser_data({echo});
  RoboCompFullPoseEstimation::FullPoseEuler pose;
  pose.x = number_;
  ctx.sent.new_full_pose(pose);
  auto first = ctx.poses.try_new_full_pose();
  auto scan = ctx.scans.try_push_laser_data();
  if (!first || !scan) return;
  const auto newest = first.value();
  const auto other = scan.value();
  if (newest.made() != rc::Made::computed || other.made() != rc::Made::computed) return;
  const auto again = ctx.poses.new_full_pose();
  require(again.made() == rc::Made::cached, "the second time it is cached");
  require(newest.is_fresh() && newest.age() <= again.age(), "it becomes older");
  require(again->x == newest->x, "the same pose");
  see(std::string("both are ") + word(again.with(other).made()));
}

void SpecificWorker::ask() {
  std::string now;
  auto battery = ctx.other.try_get_battery_state();
  if (battery) {
    const auto how = ctx.other.freshness();
    require(how && how->is_fresh, "a reply has an age");
    now = std::to_string(static_cast<int>(battery.value().percentage)) + " is " + word(how->made);
  } else if (battery.is<rc::NoServer>()) {
    now = "NoServer";
  } else if (battery.is<rc::ServerDied>()) {
    now = "ServerDied";
  } else if (battery.is<rc::Timeout>()) {
    now = "Deadline";
  } else {
    now = battery.what();
  }
  if (now != last_) std::cout << now << std::endl;
  last_ = now;
  try {
    ctx.strict.get_battery_state();
  } catch (const rc::Stale& stale) {
    see(stale.age() > std::chrono::milliseconds(50) ? "stale" : "not stale");
  } catch (const rc::CallError&) {
  }
}

void SpecificWorker::view(rc::Fresh<RoboCompLaser::TLaserData> scan,
                          rc::Fresh<RoboCompFullPoseEstimation::FullPoseEuler> pose) {
  require(scan->front().dist == pose->x, "the pose of the scan");
  require(scan.age() >= pose.age(), "the scan was sent first");
  if (ctx.name() == "giver") see("collected");
}

RoboCompBatteryStatus::TBattery SpecificWorker::BatteryStatus_getBatteryState() {
  see("handled");
  return {};
}
