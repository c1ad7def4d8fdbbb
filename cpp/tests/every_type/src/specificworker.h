// The component in C++ at the other end of the conformance tests: it has each value checked, sends
// it back, and makes calls when it is asked to.
#pragma once

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void initialize() override;
  RcTypes::Everything Types_echo(const RcTypes::Everything& all) override { return all; }
  std::string Types_differs(const RcTypes::Everything& all) override;
  RcTypes::Everything Types_make(std::int32_t number) override;
  std::string Types_mirrored(std::int32_t number) override;
  RcTypes::Picture Types_turned(const RcTypes::Picture& picture) override;
  std::int32_t Types_several(std::int32_t number, const std::string& text,
                             const RcTypes::Outline& outline, RcTypes::Kind kind,
                             const std::optional<RcTypes::Point>& point, std::string& again,
                             RcTypes::Outline& same, RcTypes::Kind& next,
                             std::optional<RcTypes::Point>& maybe) override;
  void Types_outputs(std::int64_t& number, std::vector<std::string>& texts) override;
  void Types_ranged(std::int32_t number, std::int32_t& more) override { more = number + 5; }
  void Types_fail(std::int32_t which) override;
  void Types_wait(std::int32_t milliseconds) override;
  void Types_note(const RcTypes::Everything& all) override;
  std::vector<std::int32_t> Types_noted() override { return numbers_; }
  void Samples_all(const RcTypes::Everything& all) override { repeats_pubproxy->all(all); }
  void Samples_several(std::int32_t number, double level, const std::string& text,
                       const RcTypes::Outline& outline, RcTypes::Kind kind,
                       const std::optional<RcTypes::Point>& point) override {
    repeats_pubproxy->several(number, level, text, outline, kind, point);
  }
  void Samples_nothing() override { repeats_pubproxy->nothing(); }
  void Pictures_picture(rc::View<RcTypes::PictureInPlace> picture) override;
  // The component calls the members of its own array.
  RcTypes::Everything served_echo(const rc::Member& member, const RcTypes::Everything& all) override;
  void served_fail(const rc::Member& member, std::int32_t which) override;
  void asked_echo_done(const rc::Member& member, rc::CallId call,
                       rc::Result<RcTypes::Everything> result) override;
  void compute() override;
  void Earlier_earlier(const RcTypes::Everything& all) override {
    numbers_.push_back(all.number);
    latest_pubproxy->latest(all);
  }

 private:
  void loans_that_are_not_sent();

  std::vector<std::int32_t> numbers_;
  rc::View<RcTypes::PictureInPlace> last_;
  std::vector<rc::View<RcTypes::PictureInPlace>> kept_;
  std::vector<decltype(ctx.asked[rc::Member()].start_echo({}))> echoes_;
  std::vector<decltype(ctx.asked[rc::Member()].start_fail(0))> fails_;
};
