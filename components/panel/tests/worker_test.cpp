// The panel without processes: its window, and the gate between the driver and the base.
#include "specificworker.h"
#include "testing.h"

int main() {
  return rc::run_test("the emergency button closes the gate", [] {
    TestContext test;
    test.base.answer_defaults();
    test.laser.on_get_laser_data([] { return RoboCompLaser::TLaserData{{0.1F, 900}, {0.2F, 450}}; });
    test.battery_status.on_get_battery_state([] {
      return RoboCompBatteryStatus::TBattery{42, {}, 12, -1};
    });
    auto& panel = test.start<SpecificWorker>();
    test.run(panel.ctx.period());
    RC_CHECK(panel.nearest->text() == "nearest: 450 mm");
    RC_CHECK(panel.battery->value() == 42);

    panel.DifferentialRobot_setSpeedBase(300, 0);
    RC_CHECK(test.base.set_speed_base_calls().size() == 1);
    panel.emergencyButton->click();
    RC_CHECK(test.base.stop_base_calls().size() == 1);
    RC_CHECK(!panel.emergencyButton->isEnabled());
    panel.DifferentialRobot_setSpeedBase(300, 0);
    RC_CHECK(test.base.set_speed_base_calls().size() == 1);

    panel.restore();
    panel.DifferentialRobot_setSpeedBase(300, 0);
    RC_CHECK(test.base.set_speed_base_calls().size() == 2);
  });
}
