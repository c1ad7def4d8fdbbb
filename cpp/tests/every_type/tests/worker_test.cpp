// The component without processes: fake peers, virtual time, and the calls of its own array.
#include "specificworker.h"
#include "testing.h"
#include "values.h"

namespace {

using namespace std::chrono_literals;

// Queries, their exceptions and their faults.
void calls(TestContext& test, SpecificWorker& worker) {
  RC_CHECK(worker.Types_mirrored(SOME).find("does not answer `echo`") != std::string::npos);
  test.mirror.on_echo([](const RcTypes::Everything& all) { return all; });
  RC_CHECK(worker.Types_mirrored(SOME).empty());
  test.mirror.on_fail([](std::int32_t which) {
    if (which == SOME) throw RcTypes::Gone();
    if (which == LEAST) throw 42;
  });
  RC_CHECK(worker.Types_mirrored(-SOME).empty());
  RC_CHECK(worker.Types_mirrored(-LEAST).find("the answer of the test failed") != std::string::npos);
  test.mirror.fail_once(rc::Fault::timeout);
  RC_CHECK(worker.Types_mirrored(SOME) == "Deadline");
  test.mirror.fail(rc::Fault::no_server);
  RC_CHECK(worker.Types_mirrored(SOME) == "NoServer" && !worker.ctx.mirror.is_connected());
  test.mirror.recover();
  RC_CHECK(test.mirror.fail_calls() == std::vector<std::int32_t>({SOME, LEAST}));
  RC_CHECK(test.mirror.echo_calls().size() == 3 && test.mirror.echo_calls().back() == sample(SOME));
  test.mirror.clear_calls();
  RC_CHECK(test.mirror.calls() == 0);
}

// Samples by value and in place.
void topics(TestContext& test, SpecificWorker& worker) {
  worker.Samples_several(3, 1.5, "text", {}, RcTypes::Kind::wall, {});
  const auto several = test.repeats.several_samples();
  RC_CHECK(several.size() == 1 && std::get<0>(several[0]) == 3 && std::get<2>(several[0]) == "text");
  RcTypes::Picture picture;
  picture.outline = {{1.0F, 2.0}};
  picture.frame = "base";
  picture.data = {1, 2, 3};
  for (picture.number = 0; picture.number < 2; ++picture.number) {
    worker.Pictures_picture(rc::View<RcTypes::PictureInPlace>(picture));
    RC_CHECK(test.copies.copy_samples().back() == picture);
  }
  try {
    worker.Samples_several(3, 9.5, "", {}, RcTypes::Kind::wall, {});
    RC_CHECK(false);
  } catch (const rc::InvalidSample&) {
  }
  test.repeats.fail("no memory");
  try {
    worker.Samples_nothing();
    RC_CHECK(false);
  } catch (const rc::NotSent& error) {
    RC_CHECK(std::string(error.what()).find("no memory") != std::string::npos);
  }
  test.repeats.recover();
}

template <class Error = rc::InvalidArgument, class Act>
void refused(const std::string& part, const Act& act) {
  std::string said = "nothing";
  try {
    act();
  } catch (const Error& error) {
    said = error.what();
  }
  if (said.find(part) == std::string::npos) throw std::runtime_error("`" + part + "` is not in: " + said);
}

// Values of parameters that no parameter can have are no other ones.
void parameters(TestContext& test, SpecificWorker& worker) {
  auto& ctx = worker.ctx;
  constexpr auto longest = std::chrono::nanoseconds::max();
  ctx.set_parameter("count", static_cast<std::uint64_t>(INT64_MAX));
  ctx.set_parameter("pause", longest);
  ctx.set_parameter("pause", 0s);
  // The longest duration is more than these integers hold.
  ctx.set_parameter("pause", std::chrono::duration<int, std::milli>(500));
  ctx.set_parameter("pause", std::chrono::duration<std::uint8_t>(200));
  const auto requested = test.requested_parameters();
  RC_CHECK(requested.size() == 5 && requested[0].value == "9223372036854775807");
  RC_CHECK(requested[3].value == "\"500ms\"" && requested[4].value == "\"200s\"");
  const std::string most = "an integer is at most 9223372036854775807, not ";
  refused("`count`: " + most + "9223372036854775808", [&] { ctx.set_parameter("count", std::uint64_t{1} << 63); });
  refused(most + "18446744073709551615", [&] { ctx.set_parameter("count", UINT64_MAX); });
  refused("`pause`: a duration is 0 or longer", [&] { ctx.set_parameter("pause", -1ns); });
  refused("`pause`: a duration is 0 or longer", [&] { ctx.set_parameter("pause", std::chrono::hours::min()); });
  refused("at most 9223372036854775807 ns", [&] { ctx.set_parameter("pause", std::chrono::hours::max()); });
  refused("at most 9223372036854775807 ns",
          [&] { ctx.set_parameter("pause", std::chrono::duration<std::uint64_t, std::nano>(std::uint64_t{1} << 63)); });
  refused("`count` and a line feed", [&] { ctx.set_parameter("count\npause", 3); });
  refused("a duration is 0 or longer", [&] { ctx.set_period(-1ms); });
  refused("a duration is 0 or longer", [&] { ctx.mirror.set_timeout(-1ms); });
  RC_CHECK(test.requested_parameters().empty());
}

// Nobody gets an argument, a sample or an answer that its type does not allow.
void types(TestContext& test, SpecificWorker& worker) {
  auto& ctx = worker.ctx;
  constexpr auto strange = static_cast<RcTypes::Kind>(99);
  const std::string why = ": 99 is not a value of `RcTypes::Kind`";
  RcTypes::Everything all;
  const auto echo = [&] { (void)ctx.mirror.echo(all); };
  all.defaults.kind = strange;
  refused("echo(): `all.defaults.kind`" + why, echo);
  all.defaults.kind = RcTypes::Kind::door;
  for (const std::string& text : {std::string("\xff"), std::string(1, '\0')}) {
    all.defaults.text = text;
    refused("echo(): `all.defaults.text`: a string is not UTF-8", echo);
  }
  RC_CHECK(test.mirror.echo_calls().empty());
  refused<rc::InvalidSample>("several(): `kind`" + why, [&] { ctx.repeats.several(3, 1.5, "", {}, strange, {}); });
  RC_CHECK(test.repeats.several_samples().empty());
  test.mirror.on_echo([](const RcTypes::Everything&) {
    RcTypes::Everything wrong;
    wrong.bounded.text = "nine byte";
    return wrong;
  });
  all = {};
  refused<rc::Refused>("echo(): `return.bounded.text`: it has 9 elements, its type allows 8", echo);
}

// Started calls of the members of an array.
void started(TestContext& test, SpecificWorker& worker) {
  RC_CHECK(worker.ctx.asked.size() == 2 && worker.ctx.asked.get("second")->index() == 1);
  RcTypes::Everything note = sample(SOME);
  note.number = 1000;
  const std::size_t before = worker.Types_noted().size();
  worker.Types_note(note);
  RC_CHECK(worker.Types_noted().size() == before + 1);
  test.run(worker.ctx.period() * 2);
  const std::vector<std::int32_t> noted = worker.Types_noted();
  RC_CHECK(std::vector<std::int32_t>(noted.begin() + static_cast<std::ptrdiff_t>(before), noted.end()) ==
           std::vector<std::int32_t>({1000, 1001, 1002, 1011, 1010}));
  RC_CHECK(test.asked.member("first").echo_calls().size() == 1);
}

}  // namespace

int main() {
  return rc::run_test("every type", [] {
    TestContext test;
    test.asked.each([](FakeMirrorServer& server) {
      static int made = 0;
      const int number = ++made;
      server.on_echo([number](const RcTypes::Everything& all) {
        RcTypes::Everything same = all;
        same.number += number;
        return same;
      });
      if (number == 2) server.on_fail([](std::int32_t) { throw RcTypes::Gone(); });
    });
    test.set_time(5s);
    auto& worker = test.start<SpecificWorker>();
    RC_CHECK(worker.ctx.now() == 5s);
    calls(test, worker);
    topics(test, worker);
    parameters(test, worker);
    test.mirror.clear_calls();
    test.repeats.clear_samples();
    types(test, worker);
    started(test, worker);
    worker.ctx.stop("the test is over");
    RC_CHECK(worker.ctx.is_stopping());
  });
}
