// Replies to queries, records the latencies of values, and reports them at the end of a block.
#pragma once

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void initialize() override;
  std::vector<std::uint8_t> Echo_echo(const std::vector<std::uint8_t>& data) override;
  void Sample_sample(std::int64_t sent, const std::vector<std::uint8_t>& data) override;
  void Pictures_picture(rc::View<RcBench::PictureInPlace> picture) override;

 private:
  std::vector<std::int64_t> times_;
};
