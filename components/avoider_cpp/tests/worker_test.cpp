// The worker without scanner, base, battery or process.
#include "specificworker.h"
#include "testing.h"

namespace {

using namespace std::chrono_literals;

constexpr auto PERIOD = 50ms;
const std::tuple<float, float> DRIVE{300.0F, 0.0F};
const std::tuple<float, float> TURN{0.0F, 0.9F};

// A wall all around, in mm.
RoboCompLaser::TLaserData wall(float distance) {
  RoboCompLaser::TLaserData scan;
  for (int step = -18; step <= 18; ++step) {
    scan.push_back({static_cast<float>(step) * 0.087F, distance});
  }
  return scan;
}

// Whether the last command to the base is this one; forgets all of them.
bool commanded(TestContext& test, const std::tuple<float, float>& motion) {
  const auto commands = test.differential_robot.set_speed_base_calls();
  test.differential_robot.clear_calls();
  return !commands.empty() && commands.back() == motion;
}

void a_clear_way_is_driven_and_an_obstacle_is_not(TestContext& test) {
  auto& worker = test.start<SpecificWorker>();
  RC_CHECK(worker.machine.is_in(State::Idle));
  float distance = 4000;
  test.laser.on_get_laser_data([&] { return wall(distance); });
  test.run(PERIOD);
  RC_CHECK(worker.machine.is_in(State::Cruising) && commanded(test, DRIVE));
  distance = 400;
  test.run(PERIOD);
  RC_CHECK(worker.machine.is_in(State::Turning) && commanded(test, TURN));
  distance = 4000;
  test.run(PERIOD);
  RC_CHECK(worker.machine.is_in(State::Cruising) && commanded(test, DRIVE));
  worker.machine.fire(Event::Stop);
  test.run(PERIOD);
  RC_CHECK(worker.machine.is_in(State::Idle));
  RC_CHECK(test.differential_robot.stop_base_calls().size() == 1);
}

void a_low_battery_stops_the_robot(TestContext& test) {
  test.laser.on_get_laser_data([] { return wall(4000); });
  RoboCompBatteryStatus::TBattery battery;
  battery.percentage = 10;
  test.battery_status.recover();
  test.battery_status.on_get_battery_state([&] { return battery; });
  auto& worker = test.start<SpecificWorker>();
  test.run(2 * PERIOD);
  RC_CHECK(worker.machine.is_in(State::Charging));
  battery.percentage = 90;
  test.run(2s);
  RC_CHECK(worker.machine.is_in(State::Cruising));
}

}  // namespace

int main() {
  int failed = 0;
  for (const auto test_of_worker :
       {a_clear_way_is_driven_and_an_obstacle_is_not, a_low_battery_stops_the_robot}) {
    failed += rc::run_test("avoider", [&] {
      TestContext test;
      test.params.safe_distance = 500;
      test.params.speed = 300;
      test.params.turn_speed = 0.9F;
      test.params.lockstep = false;
      test.battery_status.fail(rc::Fault::no_server);
      test.differential_robot.answer_defaults();
      test_of_worker(test);
    });
  }
  return failed;
}
