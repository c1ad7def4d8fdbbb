// The panel without processes: its window, and the gate between the driver and the base.
#include <unistd.h>

#include <QTimer>

#include "specificworker.h"
#include "testing.h"

namespace {

// A function of the worker that changes what comes next ends the wait of the window: ctest has a limit.
int a_wait_ends_at_once() {
  return rc::run_test("the wait of the window ends at once", [] {
    TestContext test;
    test.base.answer_defaults();
    auto& panel = test.start<SpecificWorker>();
    int silent[2];
    RC_CHECK(pipe(silent) == 0);
    QTimer::singleShot(0, &panel, [&] { panel.ctx.set_period(std::chrono::milliseconds(20)); });
    static_cast<rc::detail::WindowApplication*>(qApp)->wait(silent[0], std::chrono::hours(1));
    RC_CHECK(panel.ctx.period() == std::chrono::milliseconds(20));
  });
}

}  // namespace

int main() {
  return a_wait_ends_at_once() + rc::run_test("the emergency button closes the gate", [] {
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

    RC_CHECK(panel.params.range == 4000);
    for (const int range : {2000, 1000, 8000, 4000}) {
      emit panel.scan->clicked();
      const auto requested = test.requested_parameters();
      RC_CHECK(requested.size() == 1 && requested[0] == (rc::RequestedParameter{"range", std::to_string(range)}));
      panel.params.range = range;
    }

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
