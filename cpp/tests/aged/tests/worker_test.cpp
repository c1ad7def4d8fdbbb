// Patterns of communication: Listing 3 of RoboComp's paper as the `compute` of a worker.
#include "patterns.h"
#include "testing.h"

using namespace RoboCompSpeech;

namespace {

class Speaker final : public PatternWorker {
 public:
  void compute() override {
    RoboCompData<dataresponse > resp_busy;

    speechcomm->query<isBusy>(resp_busy);
    if (resp_busy -> resp!=true) {
      RoboCompData<datasayin> req_say;
      req_say -> text = "Hello";
      req_say -> override = true;
      RoboCompData<dataresponse> resp_say;
      speechcomm->query<say>(req_say, resp_say);
      if (resp_say -> resp) speechcomm->command<silence>(req_say);
    }
    RoboCompData<RoboCompBatteryStatus::TBattery> battery;
    othercomm->query<getBatteryState>(battery);
    level = battery->percentage;
    RoboCompData<RoboCompLaser::TLaserData> scan;
    laserpubcomm->publish<pushLaserData>(scan);
  }
  RoboCompBatteryStatus::TBattery BatteryStatus_getBatteryState() override { return {}; }
  void view(rc::Fresh<RoboCompLaser::TLaserData>,
            rc::Fresh<RoboCompFullPoseEstimation::FullPoseEuler>) override {}

  void initialize() override {
    if (is_broken) throw std::domain_error("no loudspeaker");
  }

  static bool is_broken;
  float level = 0;
};
bool Speaker::is_broken = true;

}  // namespace

int main() {
  return rc::run_test("patterns of communication", [] {
    TestContext test;
    bool busy = true;
    test.speech.on_is_busy([&] { return dataresponse{busy}; });
    test.speech.on_say([](const datasayin& request) { return dataresponse{request.override}; });
    RoboCompBatteryStatus::TBattery battery;
    battery.percentage = 40;
    test.other.on_get_battery_state([=] { return battery; });
    // A worker that did not start leaves the test as it was.
    try {
      test.start<Speaker>();
      RC_CHECK(false);
    } catch (const std::domain_error&) {
      Speaker::is_broken = false;
    }
    auto& worker = test.start<Speaker>();
    test.run(worker.ctx.period());
    RC_CHECK(test.speech.say_calls().empty() && worker.level == 40);
    busy = false;
    test.run(worker.ctx.period());
    RC_CHECK(test.speech.say_calls().size() == 1 && test.speech.say_calls()[0].text == "Hello");
    RC_CHECK(test.speech.silence_calls().size() == 1);
    RC_CHECK(test.laser_pub.push_laser_data_samples().size() == 2);
  });
}
