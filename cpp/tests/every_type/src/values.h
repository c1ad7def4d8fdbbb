// The values of `values.rs`, made again, and what differs between two values.
#pragma once

#include <limits>
#include <numeric>

#include "genericworker.h"

enum Which : std::int32_t { LEAST = 1, MOST = 2, SOME = 3 };

template <class T>
constexpr T lowest = std::numeric_limits<T>::lowest();
template <class T>
constexpr T highest = std::numeric_limits<T>::max();

inline RcTypes::Numbers numbers(std::int32_t which) {
  if (which == LEAST) {
    return {false, 0, lowest<std::int16_t>, lowest<std::int32_t>, lowest<std::int64_t>,
            lowest<float>, lowest<double>, lowest<std::int8_t>, 0, lowest<std::int16_t>, 0,
            lowest<std::int32_t>, 0, lowest<std::int64_t>, 0,
            std::numeric_limits<float>::denorm_min(), std::numeric_limits<double>::denorm_min()};
  }
  if (which == MOST) {
    return {true, highest<std::uint8_t>, highest<std::int16_t>, highest<std::int32_t>,
            highest<std::int64_t>, highest<float>, highest<double>, highest<std::int8_t>,
            highest<std::uint8_t>, highest<std::int16_t>, highest<std::uint16_t>,
            highest<std::int32_t>, highest<std::uint32_t>, highest<std::int64_t>,
            highest<std::uint64_t>, std::numeric_limits<float>::infinity(),
            -std::numeric_limits<double>::infinity()};
  }
  return {true, 1, -2, 3, -4, 0.5f, -0.25, -5, 6, -7, 8, -9, 10, -11, 12, 1.5f, -2.5};
}

inline RcTypes::Outline outline(int length) {
  RcTypes::Outline points;
  for (int at = 0; at < length; ++at) points.push_back({static_cast<float>(at) + 0.5f, -1e300});
  return points;
}

inline RcTypes::Names names() { return {{"", 0.0}, {"Grüße, 世界", -12.5}}; }

inline RcTypes::Sequences sequences(std::int32_t which) {
  if (which == LEAST) return {};
  using namespace RcTypes;
  const Numbers least = numbers(LEAST);
  const Numbers most = numbers(MOST);
  Sequences all;
  all.flags = {true, false, true};
  all.bytes.resize(256);
  std::iota(all.bytes.begin(), all.bytes.end(), std::uint8_t{0});
  all.smalls = {least.small, 0, most.small};
  all.shorts = {least.s, 0, most.s};
  all.ports = {0, most.port};
  all.ints = {least.i, 0, most.i};
  all.addresses = {0, most.address};
  all.longs = {least.l, 0, most.l};
  all.masks = {0, most.mask};
  all.floats = {least.f, 0.5f, most.f, least.coarse};
  all.doubles = {least.d, 0.5, most.d, most.fine};
  all.texts = {"", "Grüße, 世界", std::string(1000, 'x')};
  all.kinds = {Kind::person, Kind::nothing, Kind::wall, Kind::door};
  all.points = outline(100);
  all.rows = {least, most, numbers(SOME)};
  all.outlines = {{}, outline(3), outline(1)};
  all.matrix = {{1.0, 2.0}, {}, {3.0}};
  all.paths = {{}, {{"a", "b"}, {}}, {{"c"}}};
  all.tables = {{}, names()};
  return all;
}

inline RcTypes::Bounded bounded(std::int32_t which) {
  if (which == LEAST) return {};
  using RcTypes::Kind;
  return {"Grüße!", {1, 2, 3, 255}, {0.5, -0.5}, {"four", "üß"}, {{1, 2, 3}, {-4}},
          {Kind::door, Kind::wall}, outline(3)};
}

inline RcTypes::Arrays arrays(std::int32_t which) {
  using RcTypes::Kind;
  RcTypes::Arrays all;
  if (which == LEAST) return all;
  const RcTypes::Numbers least = numbers(LEAST);
  const RcTypes::Numbers most = numbers(MOST);
  all.flags = {true, false, true};
  all.bytes = {0, 1, 254, 255};
  all.smalls = {least.small, most.small};
  all.shorts = {least.s, most.s};
  all.ports = {1, most.port};
  all.ints = {least.i, most.i};
  all.addresses = {1, most.address};
  all.longs = {least.l, most.l};
  all.masks = {1, most.mask};
  all.floats = {0.5f, -1.5f, 2.5f};
  for (std::size_t at = 0; at < all.doubles.size(); ++at) {
    all.doubles[at] = static_cast<double>(at) / 4;
  }
  all.texts = {"", "Grüße"};
  all.words = {"four", "ü"};
  all.kinds = {Kind::person, Kind::door};
  const RcTypes::Outline corners = outline(4);
  std::copy(corners.begin(), corners.end(), all.corners.begin());
  all.outlines = {outline(2), RcTypes::Outline()};
  all.tables = {names(), RcTypes::Names()};
  return all;
}

inline RcTypes::Dictionaries dictionaries(std::int32_t which) {
  if (which == LEAST) return {};
  using namespace RcTypes;
  Dictionaries all;
  all.byText = names();
  all.byBool = {{false, "no"}, {true, "yes"}};
  all.byByte = {{0, 1}, {255, -1}};
  all.byInt8 = {{-128, 1}, {127, -1}};
  all.byShort = {{lowest<std::int16_t>, {1, 2}}, {highest<std::int16_t>, {}}};
  all.byUint16 = {{0, Kind::door}, {highest<std::uint16_t>, Kind::nothing}};
  all.byInt = {{lowest<std::int32_t>, {1.0f, 2.0}}, {highest<std::int32_t>, Point()}};
  all.byUint32 = {{0, outline(3)}, {highest<std::uint32_t>, {}}};
  all.byLong = {{lowest<std::int64_t>, names()}, {highest<std::int64_t>, {}}};
  all.byUint64 = {{0, true}, {highest<std::uint64_t>, false}};
  all.byWord["four"] = {"a", "b"};
  all.byWord[""] = {};
  all.byKind = {{Kind::nothing, numbers(LEAST)}, {Kind::person, numbers(MOST)}};
  return all;
}

inline RcTypes::Optionals optionals(std::int32_t which) {
  using namespace RcTypes;
  Optionals all;
  if (which == LEAST) return all;
  if (which == MOST) {
    // Present, and empty.
    all.flag = false;
    all.number = 0;
    all.real = 0.0;
    all.text = "";
    all.kind = Kind::nothing;
    all.point = Point();
    all.floats.emplace();
    all.outlines.emplace();
    all.names.emplace();
    return all;
  }
  all.flag = true;
  all.number = lowest<std::int64_t>;
  all.real = 1e-300;
  all.text = "text";
  all.kind = Kind::door;
  all.point = Point{1.0f, 2.0};
  all.floats = std::vector<float>{0.5f, -0.5f};
  all.outlines = Outlines{{}, outline(2)};
  all.names = names();
  return all;
}

inline RcTypes::Defaults defaults(std::int32_t which) {
  if (which == LEAST) return {};
  return {false, -1, 1, 0.0, "", "", RcTypes::Kind::wall, {}, {1.0f, 1.0}, {7}};
}

inline RcTypes::Everything sample(std::int32_t which) {
  return {which, {}, numbers(which), sequences(which), bounded(which), arrays(which),
          dictionaries(which), optionals(which), defaults(which)};
}

inline RcTypes::Broken broken() { return {}; }

inline RcTypes::VeryBroken very_broken() {
  return RcTypes::VeryBroken("Grüße", lowest<std::int32_t>, outline(2), RcTypes::Kind::door,
                             names());
}

// The members in which two values differ; empty if they are the same.
inline std::string difference(const RcTypes::Everything& own, const RcTypes::Everything& other) {
  std::string text;
  const auto compare = [&text](const char* name, bool is_same) {
    if (!is_same) text += std::string(name) + " ";
  };
  compare("number", own.number == other.number);
  compare("numbers", own.numbers == other.numbers);
  compare("sequences", own.sequences == other.sequences);
  compare("bounded", own.bounded == other.bounded);
  compare("arrays", own.arrays == other.arrays);
  compare("dictionaries", own.dictionaries == other.dictionaries);
  compare("optionals", own.optionals == other.optionals);
  compare("defaults", own.defaults == other.defaults);
  return text;
}
