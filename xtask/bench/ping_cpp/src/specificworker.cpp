#include "specificworker.h"

#include <algorithm>

using bench_protocol::now;

void SpecificWorker::initialize() { bench_protocol::ready(); }

void SpecificWorker::compute() {
  const auto command = bench_protocol::next_command();
  if (!command) return ctx.stop("no more orders");
  times_.clear();
  data_.resize(command->size, 7);
  for (std::size_t number = 0; number < command->count; ++number) send(*command);
  if (command->kind != "query") {
    bench_protocol::pause(command->size);
    ctx.sample.sample(0, {});
  }
  bench_protocol::report(times_);
}

void SpecificWorker::send(const bench_protocol::Command& command) {
  if (command.kind == "query") {
    const std::int64_t start = now();
    const auto answer = ctx.echo.echo(data_);
    times_.push_back(now() - start);
    if (answer.size() != data_.size()) throw rc::Fatal("another echo");
  } else if (command.kind == "publish") {
    bench_protocol::pause(command.size);
    ctx.sample.sample(now(), data_);
  } else if (command.kind == "place") {
    bench_protocol::pause(command.size);
    const std::int64_t sent = now();
    auto picture = ctx.pictures.loan();
    picture->sent = sent;
    picture->data.resize(data_.size());
    std::copy(data_.begin(), data_.end(), picture->data.begin());
    picture.send();
  } else {
    throw rc::Fatal("there is no measurement `" + command.kind + "`");
  }
}
