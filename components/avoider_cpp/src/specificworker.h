// The behaviour of the robot in the states of `avoider.scxml`: one scan and one motion in every
// period of `driving`.
#pragma once

#include <optional>

#include "genericworker.h"
#include "policy.h"

class SpecificWorker final : public GenericWorker {
 public:
  void entry_motion() override;
  void during_idle() override;
  void during_charging() override;
  void during_driving() override;
  void exit_driving() override;
  void during_cruising() override;
  void during_turning() override;
  void exit_turning() override;
  void during_blocked() override;
  void during_battery() override;

 private:
  policy::Settings settings() const;
  void drive(const policy::Motion& motion);
  void stand();
  void turn();

  /// The scan of this period.
  policy::Scan scan_;
  /// The side to which it turns.
  std::optional<policy::Side> side_;
  /// When it looked at the battery.
  std::optional<std::chrono::nanoseconds> looked_;
};
