#include "specificworker.h"

#include "../../cpp/bench_protocol.h"

using bench_protocol::now;

void SpecificWorker::initialize() { bench_protocol::ready(); }

std::vector<std::uint8_t> SpecificWorker::Echo_echo(const std::vector<std::uint8_t>& data) { return data; }

void SpecificWorker::Sample_sample(std::int64_t sent, const std::vector<std::uint8_t>& data) {
  if (!data.empty()) {
    times_.push_back(now() - sent);
    return;
  }
  bench_protocol::report(times_);
  times_.clear();
}

void SpecificWorker::Pictures_picture(rc::View<RcBench::PictureInPlace> picture) {
  times_.push_back(now() - picture->sent);
}
