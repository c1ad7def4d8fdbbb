// The protocol of the crate `bench_protocol`, for components in C++.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace bench_protocol {

constexpr std::size_t LARGEST_IN_PLACE = 4 * 1024 * 1024;
constexpr std::size_t LARGE = 64 * 1024;

// The monotonic clock, which all processes share, in nanoseconds.
inline std::int64_t now() {
  using std::chrono::nanoseconds;
  const auto time = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<nanoseconds>(time).count();
}

inline void ready() {
  std::puts("ready");
  std::fflush(stdout);
}

inline void report(const std::vector<std::int64_t>& times) {
  std::string line = "times";
  for (const std::int64_t time : times) line += " " + std::to_string(time);
  std::puts(line.c_str());
  std::fflush(stdout);
}

// Pauses before a sample of this size: the receiver sleeps then.
inline void pause(std::size_t size) {
  std::this_thread::sleep_for(std::chrono::microseconds(size < LARGE ? 200 : 2000));
}

struct Command {
  std::string kind;
  std::size_t size = 0;
  std::size_t count = 0;
};

// The next command; none at the end of the standard input.
inline std::optional<Command> next_command() {
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  Command command;
  std::istringstream words(line);
  words >> command.kind >> command.size >> command.count;
  if (!words || command.size == 0 || command.size > LARGEST_IN_PLACE) {
    throw std::runtime_error("`" + line + "` is not a command");
  }
  return command;
}

}  // namespace bench_protocol
