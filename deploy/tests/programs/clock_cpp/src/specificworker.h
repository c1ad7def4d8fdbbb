// Publishes the time of the network: advances it by a step in each `compute`.
#pragma once

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void initialize() override;
  void compute() override;
  void params_changed(const std::vector<rc::ParamChange>& changes) override;

 private:
  /// Whether the last tick of the run is over.
  bool is_over() const;
  /// Sets how fast time passes, and for whom it waits.
  void pace();
};
