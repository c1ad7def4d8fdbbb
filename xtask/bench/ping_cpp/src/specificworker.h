// Runs one block a period, by commands on its standard input. A block is longer than the period; the reported
// overrun is harmless here.
#pragma once

#include "../../cpp/bench_protocol.h"
#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void initialize() override;
  void compute() override;

 private:
  /// Sends one message of a block.
  void send(const bench_protocol::Command& command);

  std::vector<std::uint8_t> data_;
  std::vector<std::int64_t> times_;
};
