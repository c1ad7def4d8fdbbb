// Getting around without touching anything: the meaning of a scan, and the motions. This is the
// policy of the component `avoider`, which explains it. It computes with numbers of 32 bits in the
// same order, so that both decide equally in the same world.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace policy {

/// Half the width of the sector ahead, in rad.
inline constexpr float AHEAD = 0.6f;
/// Half the width of the sector in which the robot must not touch anything it passes, in rad.
inline constexpr float ASIDE = 1.3f;
/// The safe distance aside, as a part of the safe distance ahead.
inline constexpr float ASIDE_PART = 0.45f;
/// How much clearer than necessary the way must be before the robot drives again.
inline constexpr float MARGIN = 1.25f;
/// Half the width of the directions to lean towards, in rad.
inline constexpr float VIEW = 1.0f;
/// Half the width of the opening that is looked for, in rad.
inline constexpr float OPENING = 0.2f;
/// How strongly the robot turns towards an opening, in 1/s.
inline constexpr float LEAN = 0.8f;

/// One measure of a scan.
struct Measure {
  /// In rad from straight ahead, counter-clockwise.
  float angle;
  /// In mm.
  float distance;
};
using Scan = std::vector<Measure>;

/// The parameters of the policy.
struct Settings {
  /// Nothing ahead may come nearer, in mm.
  float safe_distance;
  /// In mm/s.
  float speed;
  /// In rad/s.
  float turn_speed;
};

/// A command for the base.
struct Motion {
  /// Forwards, in mm/s.
  float advance = 0;
  /// Counter-clockwise, in rad/s.
  float turn = 0;
};

/// The mean distance over the chosen angles, in mm; 0 without any.
template <class Chosen>
float mean(const Scan& scan, Chosen chosen) {
  float sum = 0;
  float count = 0;
  for (const Measure& measure : scan) {
    if (!chosen(measure.angle)) continue;
    sum += measure.distance;
    count += 1;
  }
  return count > 0 ? sum / count : 0;
}

/// A side to which the robot turns on the spot.
enum class Side { Left, Right };

/// The side on which things are farther, on average.
inline Side freer(const Scan& scan) {
  const float left = mean(scan, [](float angle) { return angle > 0; });
  const float right = mean(scan, [](float angle) { return angle < 0; });
  return left >= right ? Side::Left : Side::Right;
}

/// A turn to this side, on the spot.
inline Motion turn(Side side, const Settings& settings) {
  return {0, side == Side::Left ? settings.turn_speed : -settings.turn_speed};
}

/// Whether nothing is nearer than this.
inline bool has_room(const Scan& scan, float needed) {
  return std::all_of(scan.begin(), scan.end(), [needed](const Measure& measure) {
    const float angle = std::abs(measure.angle);
    if (angle <= AHEAD) return measure.distance >= needed;
    if (angle <= ASIDE) return measure.distance >= needed * ASIDE_PART;
    return true;
  });
}

/// Whether a robot that drives can drive on.
inline bool is_clear(const Scan& scan, const Settings& settings) {
  return has_room(scan, settings.safe_distance);
}

/// Whether a robot that stands or turns can drive again.
inline bool is_clear_again(const Scan& scan, const Settings& settings) {
  return !scan.empty() && has_room(scan, settings.safe_distance * MARGIN);
}

/// The direction within view in which things are farthest, in rad; straight ahead among equals.
inline float opening(const Scan& scan) {
  const auto around = [&scan](float direction) {
    return mean(scan, [direction](float angle) { return std::abs(angle - direction) <= OPENING; });
  };
  float farthest = mean(scan, [](float angle) { return std::abs(angle) <= OPENING; });
  float best = 0;
  for (const Measure& measure : scan) {
    if (std::abs(measure.angle) > VIEW) continue;
    const float depth = around(measure.angle);
    if (depth > farthest) {
      farthest = depth;
      best = measure.angle;
    }
  }
  return best;
}

/// The way on, with a turn towards the most open direction ahead. Without a scan, the robot stops.
inline Motion cruise(const Scan& scan, const Settings& settings) {
  if (scan.empty()) return {};
  return {settings.speed, std::clamp(LEAN * opening(scan), -settings.turn_speed, settings.turn_speed)};
}

}  // namespace policy
