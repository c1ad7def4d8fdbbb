// The migrated worker without processes: it does what the old one did.
#include "specificworker.h"
#include "testing.h"

int main() {
  return rc::run_test("the migrated bumper", [] {
    TestContext test;
    float distance = 4000;
    test.laser.on_get_laser_data([&] { return RoboCompLaser::TLaserData{{0.1F, distance}, {1.5F, 10}}; });
    test.differential_robot.answer_defaults();
    auto& worker = test.start<SpecificWorker>();
    const auto commanded = [&](float advance, float turn) {
      test.run(worker.ctx.period());
      return test.differential_robot.set_speed_base_calls().back() == std::tuple(advance, turn);
    };
    RC_CHECK(commanded(300, 0) && worker.Bumper_getSensorData().at("front").state == 0);
    distance = 400;
    RC_CHECK(commanded(0, 0.8F) && worker.Bumper_getSensorData().at("front").state == 1);
    worker.Bumper_disable();
    RC_CHECK(commanded(300, 0) && !worker.Bumper_isEnabled());
    test.laser.fail(rc::Fault::timeout);
    const auto before = test.differential_robot.calls();
    test.run(worker.ctx.period());
    RC_CHECK(test.differential_robot.calls() == before);
  });
}
